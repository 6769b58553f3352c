"""A scene as one HTML page without anything from elsewhere: plays, scrubs, zooms, turns."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from railsim.animation.scene import Scene
from railsim.files.access import check_file, write_text
from railsim.notation import QUANTITIES
from railsim.page import render_page

ENDINGS = (".html", ".htm")


def write_page(
    scene: Scene, path: str | Path, *, modes: Sequence[Scene] = (), overwrite: bool = False
) -> Path:
    """Write a scene as an HTML page.

    `scene`: What is shown at first. `modes`: Modes of the same vehicle to choose from, the scene
    among them. Raises InputError: the file exists and may not be overwritten, or cannot be
    written.
    """
    path = Path(path)
    check_file(path, overwrite=overwrite, endings=ENDINGS)
    text = render_page(
        "railsim.animation", "page.html", title=scene.title, styles=["page.css"],
        scripts=["page.js"], data=scene_data(scene) | {"modes": [_motion(mode) for mode in modes]},
        schemes="light dark",
    )  # fmt: skip
    write_text(path, text)
    return path


def scene_data(scene: Scene) -> dict[str, Any]:
    """Return a scene as plain lists, rounded to what a screen shows (0.01 mm, 0.01 mrad)."""
    forces = patches = curves = None
    named = [QUANTITIES[name] for name in ("Q", "Y", "wheelset_lateral")]
    if scene.Q is not None and scene.Y is not None:
        forces = {"Q": _list(scene.Q * 1e-3, 2), "Y": _list(scene.Y * 1e-3, 2)}
    if scene.curves is not None:
        scales = {"distance": (1.0, 2), "Q": (1e-3, 2), "Y": (1e-3, 2), "lateral": (1e3, 3)}
        curves = {name: _list(scene.curves[name] * a, n) for name, (a, n) in scales.items()}
    if scene.patches is not None:
        patches = {name: _list(scene.patches[name], 5) for name in "yz"}
        patches["N"] = _list(scene.patches["N"] * 1e-3, 2)
    return {
        "title": scene.title,
        "bodies": [
            {"name": b.name, "kind": b.kind, "offset": b.offset, "y": b.y, "z": b.z,
             "box": list(b.box)}
            for b in scene.bodies
        ],
        "words": {q.name: f"{q.symbol} ({q.shown_unit}): {q.long_name}" for q in named},
        "time": _list(scene.time, 4), "distance": _list(scene.distance, 3),
        "pose": _list(scene.pose, 5),
        "track": {name: _list(values, 5) for name, values in scene.track.items()}, "forces": forces,
        "contact": _list(scene.contact, 5),
        "sections": [[{k: _list(v, 5) for k, v in section.items()} for section in pair]
                     for pair in scene.sections],
        "seats": _list(scene.seats, 5), "patches": patches, "curves": curves,
    }  # fmt: skip


def _motion(scene: Scene) -> dict[str, Any]:
    """What differs between the modes of a vehicle."""
    times, poses = _list(scene.time, 5), _list(scene.pose, 4)
    name = scene.title.partition(" · ")[2]
    return {"title": scene.title, "name": name, "time": times, "pose": poses}


def _list(values: Any, decimals: int) -> Any:
    if values is None:
        return None
    return np.round(np.nan_to_num(np.asarray(values)), decimals).tolist()
