"""``railsim animate``: a run or a mode as a page that plays, a GIF or a film."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.errors import input_error
from railsim.files.access import TABLE_BYTES, read_text

if TYPE_CHECKING:
    from railsim.animation import Scene

ENDINGS = (".html", ".htm", ".gif", ".mp4")


@click.command()
@click.argument("file", metavar="R.h5|modes.json")
@cli.option("--out", "Page (.html), .gif or .mp4; default: next to the input.", "F")
@cli.option("--vehicle", "Vehicle of the modes, where it is not that of the file.", "F")
@cli.option("--mode", "Mode by name or number; default the first.", "NAME")
@cli.option("--between", "Section of the run to show, distance in m.", "S1 S2", float, nargs=2)
@cli.option("--frames", "Maximum number of frames.", "N", click.IntRange(2, 20_000))
@cli.option("--fps", "Frames per second of a film.", "N", click.IntRange(1, 100), default=20)
@cli.option("--gain", "Magnification in a film.", "G", click.FloatRange(0.0, 1000.0), default=1.0)
@cli.output_options()
def command(file: str, fps: int, gain: float, output: cli.Output, **how: Any) -> None:
    """Animate a run or a mode as one HTML page or as a film.

    The page is self-contained: it plays, zooms and rotates in any browser, also without a network.
    Films show the motion from one side; MP4 needs ffmpeg.

    \b
    Example:
      railsim animate run.h5 --out run.html
    """
    from railsim.animation import animate

    path = output.file(file, ENDINGS, suffix=".html")
    scene = _scene(Path(file), path.suffix.lower() in (".gif", ".mp4"), **how)
    animate(scene, path, frames_per_second=fps, gain=gain, overwrite=output.overwrite)
    output.wrote(path, frames=len(scene.time), title=scene.title)


def _scene(
    file: Path, film: bool, vehicle: str | None, mode: str | None, between: Any, frames: int | None
) -> "Scene":
    from railsim.animation import mode_scene, result_scene
    from railsim.animation.scene import FILM_FRAMES, FRAMES, chosen_mode

    if file.suffix.lower() != ".json":
        from railsim.result import open_run

        allowed = "give the JSON of railsim modes"
        cli.refusals("belongs to a mode", allowed, "vehicle", "mode").check()
        frames = frames or (FILM_FRAMES if film else FRAMES)
        return result_scene(open_run(file), frames=frames, between=between)
    from railsim.definitions.loading import load_vehicle
    from railsim.linear.eigenmodes import SLOWEST

    data = _read(file)
    name = vehicle or data.get("vehicle")
    if not isinstance(name, str):
        raise input_error("--vehicle", "not given", "the vehicle of the modes")
    modes = data["modes"]
    if mode is None or mode.isdigit():  # as `railsim modes` lists them
        oscillations = [one for one in modes if one["frequency"] > SLOWEST]
        oscillations.sort(key=lambda one: one.get("natural_frequency", one["frequency"]))
        modes = oscillations or modes
    found = chosen_mode(modes, mode)
    how = {"frames": frames} if frames else ({"frames": 30, "cycles": 2} if film else {})
    return mode_scene(load_vehicle(name), found, **how)


def _read(file: Path) -> dict[str, Any]:
    """Read what ``railsim modes --json`` printed; of several speeds the first."""
    import json

    try:
        data: Any = json.loads(read_text(file, TABLE_BYTES))
    except (ValueError, RecursionError) as error:
        raise input_error(file, f"cannot be read ({error})") from None
    if isinstance(data, list) and data:
        data = data[0]
    modes = data.get("modes") if isinstance(data, dict) else None
    known = {"name", "frequency", "damping_ratio", "shape"}
    complete = isinstance(modes, list) and all(isinstance(m, dict) and known <= {*m} for m in modes)
    if not modes or not complete:
        allowed = "the JSON of railsim modes"
        raise input_error(file, "missing or incomplete", allowed, key="modes")
    return dict(data)
