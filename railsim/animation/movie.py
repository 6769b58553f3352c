"""A scene as GIF (Pillow) or MP4 (ffmpeg): the vehicle, and its leading wheelset's contacts."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from railsim.animation.scene import DrawnBody, Scene
from railsim.arrays import Floats
from railsim.errors import argument_error
from railsim.files.access import check_file, whole_file
from railsim.result.sensors import out_of_body, turned

AZIMUTH, ELEVATION = -0.75, 0.3  # rad, of the view
MARGIN = 1.5  # m, about the vehicle: modes move by 5 % of its length
FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
SIDES = ("#004a80", "#b8450a")
COLOURS = {"car": ((0.34, 0.66, 0.88, 0.22), "#004a80"), "frame": ((0.94, 0.63, 0.24, 0.8),
           "#b8450a"), "wheelset": ((0.28, 0.3, 0.32, 0.85), "#222222")}  # fmt: skip
ENDINGS = (".gif", ".mp4")


def write_movie(
    scene: Scene,
    path: str | Path,
    *,
    frames_per_second: int = 20,
    gain: float = 1.0,
    overwrite: bool = False,
) -> Path:
    """Write a scene as a film; the ending of the name says which kind.

    `scene`: One picture for each of its frames. `path`: ``.gif`` or ``.mp4``. `frames_per_second`:
    Pictures a second when it is played. `gain`: Factor on the motion of the bodies against their
    nominal positions. Raises InputError: the name or the location; MP4 without ffmpeg.
    """
    path = Path(path)
    check_file(path, overwrite=overwrite, endings=ENDINGS)
    film = path.suffix.lower() == ".mp4"
    if film and shutil.which("ffmpeg") is None:
        allowed = "install ffmpeg, or write a .gif or .html"
        raise argument_error("path", "MP4 needs ffmpeg", allowed, key=path.name, option="--out")
    writer: Any = (FFMpegWriter if film else PillowWriter)(fps=frames_per_second)
    figure = Figure(figsize=(8.0, 4.5 if scene.sections else 3.6), dpi=100)
    FigureCanvasAgg(figure)
    view = figure.add_axes((0.0, 0.36, 1.0, 0.56) if scene.sections else (0.0, 0.0, 1.0, 0.9))
    places = [(0.06 + 0.48 * k, 0.06, 0.42, 0.27) for k in range(2)] if scene.sections else []
    sections = [figure.add_axes(place) for place in places]
    with whole_file(path) as partial:
        # the writers choose their format by the ending
        named = partial.with_name(partial.name + path.suffix.lower())
        try:
            with writer.saving(figure, str(named), dpi=100):
                for frame in range(len(scene.time)):
                    draw(view, sections, scene, frame, gain)
                    writer.grab_frame()
            named.replace(partial)
        finally:
            named.unlink(missing_ok=True)
    return path


def draw(view: Axes, sections: list[Axes], scene: Scene, frame: int, gain: float = 1.0) -> None:
    """Draw one frame of a scene."""
    view.clear()
    polygons = sorted(_polygons(scene, frame, gain), key=lambda item: -item[0])
    _, points, faces, edges = zip(*polygons, strict=True)
    view.add_collection(PolyCollection(points, facecolors=faces, edgecolors=edges, linewidths=0.7))
    (left, top), (right, bottom) = _extent(scene)
    view.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    view.set_axis_off()
    at_s = "" if scene.Q is None else f", s {scene.distance[frame]:.1f} m"
    larger = "" if gain == 1.0 else f"; motion of the bodies magnified {gain:g} times"
    words = f"{scene.title}\nt {scene.time[frame]:.2f} s{at_s}{larger}"
    view.set_title(words, fontsize=8, loc="left")
    for side, axes in enumerate(sections):
        _draw_section(axes, scene, frame, side)


def _extent(scene: Scene) -> tuple[Floats, Floats]:
    """Corners of what is seen of the bodies on straight track, with a margin [m]."""
    points = [
        points + np.array([body.offset, body.y, body.z])
        for body in scene.bodies
        for points in _shape(body)
    ]
    corners, _ = _on_screen(np.concatenate(points), np.zeros(4))
    return corners.min(axis=0) - MARGIN, corners.max(axis=0) + MARGIN


def _polygons(scene: Scene, frame: int, gain: float) -> Iterator[tuple[float, Floats, Any, Any]]:
    s0 = float(scene.distance[frame])
    pose = _track(scene, s0)
    for side in (-0.75, 0.75):
        for s in np.arange(s0 - 22.0, s0 + 22.0, 2.0):
            ends = [_in_space(_track(scene, s + d), np.array([[0.0, side - w, 0.0]]))
                    for d, w in ((0.0, 0.04), (0.0, -0.04), (2.0, -0.04), (2.0, 0.04))]  # fmt: skip
            points, depth = _on_screen(np.concatenate(ends), pose)
            yield depth, points, "#8a8a8a", "#6b6b6b"
    for k, body in enumerate(scene.bodies):
        q = scene.pose[frame, k]
        frame_at = _track(scene, s0 + body.offset + q[0])
        face, edge = COLOURS[body.kind]
        roll, pitch, yaw = gain * q[3:]
        pitch = 0.0 if body.kind == "wheelset" else pitch  # its rims are round
        for points in _shape(body):
            moved = out_of_body(points, roll, pitch, yaw) + np.array(
                [(gain - 1.0) * q[0], body.y + gain * q[1], body.z + gain * q[2]]
            )
            corners, depth = _on_screen(_in_space(frame_at, moved), pose)
            yield depth, corners, face, edge


def _shape(body: DrawnBody) -> list[Floats]:
    """Polygons of a body in its own axes."""
    a, b, c, *middle = body.box
    if body.kind == "wheelset":
        t = np.linspace(0.0, 2.0 * np.pi, 25)
        rims = [np.column_stack([a * np.cos(t), np.full(25, y), a * np.sin(t)]) for y in (-b, b)]
        return [*rims, np.array([[0.0, -b, 0.0], [0.0, b, 0.0], [0.0, b, 0.02], [0.0, -b, 0.02]])]
    corners = np.array([[x, y, z] for x in (-a, a) for y in (-b, b) for z in (-c, c)]) + middle
    return [corners[list(face)] for face in FACES]


def _track(scene: Scene, s: float) -> Floats:
    """Position in plan, heading and cant of the track."""
    track = scene.track
    return np.array([np.interp(s, track["s"], track[n]) for n in ("x", "y", "heading", "cant")])


def _in_space(pose: Floats, points: Floats) -> Floats:
    """Points of the track frame in space."""
    x, y, heading, cant = pose
    across, down = turned(points[:, 1], points[:, 2], cant)
    east, south = turned(points[:, 0], across, heading)
    return np.column_stack([x + east, y + south, down])


def _on_screen(points: Floats, pose: Floats) -> tuple[Floats, float]:
    """Points on the screen, right and down [m], and their mean depth."""
    x, y, z = points.T
    forward, right = turned(x - pose[0], y - pose[1], -(pose[2] + AZIMUTH))
    down, depth = turned(z + 1.4, forward, ELEVATION)
    return np.column_stack([right, down]), float(np.mean(depth))


def _draw_section(axes: Axes, scene: Scene, frame: int, side: int) -> None:
    axes.clear()
    assert scene.seats is not None  # as there are sections
    assert scene.contact is not None
    section = scene.sections[0][side]
    k = next(i for i, body in enumerate(scene.bodies) if body.kind == "wheelset")
    q, (height, wider) = scene.pose[frame, k], scene.seats[frame, 0]
    wheel_y = q[1] + section["wheel_y"] - q[3] * section["wheel_z"]
    wheel_z = height + section["wheel_z"] + q[3] * section["wheel_y"]
    rail_y = section["rail_y"] + (side - 0.5) * wider
    axes.plot(1e3 * rail_y, 1e3 * section["rail_z"], color="#8a7a5c", lw=1.4)
    axes.plot(1e3 * wheel_y, 1e3 * wheel_z, color="0.2", lw=1.4)
    middle = -750.0 if side == 0 else 750.0
    axes.set(xlim=(middle - 80.0, middle + 80.0), ylim=(45.0, -35.0), aspect="equal")
    axes.tick_params(labelsize=6)
    axes.set_ylabel("mm", fontsize=6)
    if scene.Q is None or scene.Y is None:
        return
    Q, Y = 1e-3 * scene.Q[frame, 0, side], 1e-3 * scene.Y[frame, 0, side]
    axes.set_title(f"{('left', 'right')[side]} wheel 1: Q {Q:.1f} kN, Y {Y:.1f} kN", fontsize=7)
    _, y, z = scene.contact[frame, 0, side]
    y, z = 1e3 * (q[1] + y), 1e3 * (height + z)
    for end in ((y, z + 0.35 * Q), (y + 0.7 * Y, z)):
        if np.isfinite(z):
            arrow = {"arrowstyle": "-|>", "color": SIDES[side], "lw": 1.4}
            axes.annotate("", xy=end, xytext=(y, z), arrowprops=arrow)
