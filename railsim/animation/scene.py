"""What an animation shows: bodies with their shapes, poses over time, the track, wheel forces.

Bodies are the boxes of `railsim.definitions.vehicle.outlines`; wheels have their radii.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.animation.wheels import contact_points, seats, sections
from railsim.arrays import Floats
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import FlatVehicle, flatten
from railsim.definitions.vehicle.outlines import body_boxes
from railsim.errors import Fault, InputError, argument_error, input_error, nearest
from railsim.result import Result
from railsim.track.alignment import Alignment
from railsim.track.irregularity import shown_displacement

FRAMES = 600
TRACK_STEP = 1.0  # m
AROUND = 60.0  # m of track ahead and behind
NEEDED = ("body_position", "Q", "Y")
LARGEST = 0.05  # displacement of a mode over the vehicle's length


@dataclass(frozen=True)
class Drawn:
    """A body to draw.

    `name`, `kind`: Kind ``car``, ``frame`` or ``wheelset``. `y`, `z`: Nominal position of its
    centre of gravity in the track frame [m]. `box`: Half length, half width and half height, and
    the middle of the box from the centre of gravity, x, y, z [m]; of a wheelset its radius, half
    the wheels' distance, and zeros.
    """

    name: str
    kind: str
    offset: float  # arc length of its frame beyond that of the reference body [m]
    y: float
    z: float
    box: tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Scene:
    """Everything that a page or a film shows.

    `time`, `distance` (float64[frame]): [s], [m]. `pose` (float64[frame, body, 6]): Against the
    nominal position, as `body_position`; those of wheelsets in y, z and roll against their rails,
    which are drawn without irregularities [m], [rad]. `track`: ``s``, ``x``, ``y``, ``heading``,
    ``cant`` along the track [m], [rad]. `Q`, `Y` (float64[frame, wheelset, 2]): Wheel forces on
    the rail [N]; None for a mode. `contact` (float64[frame, wheelset, 2, 3]): Where they act: of
    the most loaded patch, from the wheelset's centre, NaN without contact; of results without it
    the nominal rolling circles [m]. `sections`: Wheel and rail profiles of each wheelset, left and
    right, see `railsim.animation.wheels`. `seats` (float64[frame, wheelset, 2]): Height of the
    wheelsets' centres, z, at which their wheels touch the drawn rails, and by how much these stand
    further apart than the gauge [m]. `patches`: ``y``, ``z`` [m] and ``N`` [N] of all patches,
    [frame, wheelset, side, patch].
    """

    title: str
    bodies: tuple[Drawn, ...]
    time: Floats
    distance: Floats
    pose: Floats
    track: Mapping[str, Floats]
    Q: Floats | None
    Y: Floats | None
    contact: Floats | None
    sections: tuple[tuple[Mapping[str, Floats], ...], ...]
    seats: Floats | None
    patches: Mapping[str, Floats] | None


def result_scene(
    result: Result, *, frames: int = FRAMES, between: tuple[float, float] | None = None
) -> Scene:
    """Scene of a run.

    `result`: With `body_position`, Q and Y. `frames`: Number of frames at most. `between`:
    Distances of the reference body between which the run is shown [m]. Raises InputError: the
    result lacks something; nothing lies between.
    """
    missing = [name for name in NEEDED if name not in result]
    if missing:
        allowed = f"run it with settings.outputs.quantities with {', '.join(NEEDED)}"
        raise InputError([Fault("result", name, "is not in it", allowed) for name in missing])
    distance = result["distance"]
    if len(distance) < 2:
        found = f"{len(distance)} instants: {result.status}"
        raise input_error("result", found, "a run of some length", "time")
    low, high = between or (float(distance[0]), float(distance[-1]))
    first, last = np.searchsorted(distance, [low, high])
    if last - first < 2:
        found = f"nothing between {low:g} and {high:g} m"
        allowed = f"the run goes from {distance[0]:.6g} to {distance[-1]:.6g} m"
        raise argument_error("between", found, allowed)
    rows = np.unique(np.linspace(first, last - 1, min(frames, last - first)).astype(int))
    vehicle = result.vehicle()
    flat = flatten(vehicle)
    drawn = _drawn(flat)
    columns = [result.bodies.index(body.name) for body in drawn]
    speed = f"{result.speed:.4g} m/s ({3.6 * result.speed:.4g} km/h)"
    patches = None
    if "patch_N" in result:
        patches = {name: result[f"patch_{name}"][rows] for name in "yzN"}
    poses = _poses(result, rows)
    wheelsets = [result.bodies.index(name) for name in result.wheelsets]
    profiles = sections(result, flat)
    return Scene(
        title=f"{vehicle.name} · {result.track().name} · {speed}", bodies=drawn,
        time=result["time"][rows], distance=distance[rows], pose=poses[:, columns],
        track=_track(Alignment(result.track()), distance[rows]), Q=result["Q"][rows],
        Y=result["Y"][rows], contact=contact_points(result, rows, profiles), sections=profiles,
        seats=seats(result, rows, profiles, poses[:, wheelsets]), patches=patches,
    )  # fmt: skip


def _poses(result: Result, rows: Floats) -> Floats:
    """Poses of all bodies; of wheelsets where they are on their rails."""
    pose = np.array(result["body_position"][rows])
    wheelsets = [result.bodies.index(name) for name in result.wheelsets]
    if "wheelset_lateral" in result and "wheelset_roll" in result:
        pose[:, wheelsets, 1] = result["wheelset_lateral"][rows]
        pose[:, wheelsets, 3] = result["wheelset_roll"][rows]
    irregularity = shown_displacement(result.track())
    if irregularity is not None and "wheelset_distance" in result:
        at = result["wheelset_distance"][rows]
        _, z_left, _, z_right = irregularity(at.ravel())[0]
        pose[:, wheelsets, 2] -= 0.5 * (z_left + z_right).reshape(at.shape)
    return pose


def mode_scene(
    vehicle: Vehicle, mode: Mapping[str, Any], *, frames: int = 90, cycles: int = 3
) -> Scene:
    """Scene of a mode of ``railsim modes``: its shape through some cycles, standing still.

    The largest displacement is 5 % of the vehicle's length.

    `mode`: With ``name``, ``frequency``, ``damping_ratio`` and ``shape`` {"body.component": [re,
    im]}. Raises InputError: the shape names bodies that the vehicle does not have.
    """
    flat = flatten(vehicle)
    drawn = _drawn(flat)
    names = [body.name for body in drawn]
    components = ("x", "y", "z", "roll", "pitch", "yaw")
    shape = np.zeros((len(drawn), 6), dtype=complex)
    known = {body.name for body in flat.bodies}
    for key, (real, imaginary) in mode["shape"].items():
        body, _, component = key.rpartition(".")
        if body not in known or component not in components:
            raise input_error("modes", "not of this vehicle", nearest(body, known), key)
        if body in names and not (component == "pitch" and drawn[names.index(body)].kind ==
                                  "wheelset"):  # fmt: skip
            shape[names.index(body), components.index(component)] = complex(real, imaginary)
    length = max(body.offset for body in drawn) - min(body.offset for body in drawn)
    largest = max(_largest(body, own) for body, own in zip(drawn, shape, strict=True))
    if largest == 0.0:
        raise input_error("modes", "nothing moves", "another mode", "shape")
    shape = shape * LARGEST * length / largest
    phase = np.linspace(0.0, 2.0 * np.pi * cycles, frames * cycles)
    frequency = float(mode["frequency"])
    time = phase / (2.0 * np.pi * max(frequency, 1e-3))
    s = np.arange(-AROUND, AROUND + 1.0, TRACK_STEP)
    flat_track = {"s": s, "x": s, "y": 0.0 * s, "heading": 0.0 * s, "cant": 0.0 * s}
    return Scene(
        title=f"{vehicle.name} · {mode['name']} · {frequency:.3g} Hz, "
              f"damping {100.0 * float(mode['damping_ratio']):.3g} %",
        bodies=drawn, time=time, distance=np.zeros(len(time)),
        pose=np.real(shape[None] * np.exp(1j * phase)[:, None, None]),
        track=flat_track, Q=None, Y=None, contact=None, sections=(), seats=None, patches=None,
    )  # fmt: skip


def _largest(body: Drawn, shape: np.ndarray) -> float:
    """Largest displacement of a body's corners in a mode, over all phases along each axis [m]."""
    a, b, c, *middle = body.box
    half = a if body.kind == "wheelset" else c
    corners = np.array([[x, y, z] for x in (-a, a) for y in (-b, b) for z in (-half, half)])
    moved = shape[:3] + np.cross(shape[3:], corners + middle)
    return float(np.max(np.abs(moved)))


def _drawn(flat: FlatVehicle) -> tuple[Drawn, ...]:
    """Bodies with boxes; axleboxes are not drawn."""
    boxes = body_boxes(flat)
    reference = flat.body(flat.reference).position[0]
    found = []
    for body in flat.bodies:
        x, y, z = body.position
        if body.kind == "wheelset" and body.wheelset:
            radius = float(np.mean(body.wheelset.radius))
            box = (radius, 0.5 * body.wheelset.tape_circle_distance, 0.0, 0.0, 0.0, 0.0)
            found.append(Drawn(body.name, "wheelset", x - reference, y, z, box))
        elif body.name in boxes:
            low, high = map(np.array, boxes[body.name])
            sizes = [*0.5 * (high - low), *0.5 * (high + low) - body.position]
            kind = "car" if body.name == flat.reference else "frame"
            a, b, c, *middle = map(float, sizes)
            box = (a, b, c, middle[0], middle[1], middle[2])
            found.append(Drawn(body.name, kind, x - reference, y, z, box))
    return tuple(found)


def _track(alignment: Alignment, distance: Floats) -> dict[str, Floats]:
    """Centre line in plan and cant angle around the way of a run; gradients are left out."""
    s = np.arange(distance[0] - AROUND, distance[-1] + AROUND + TRACK_STEP, TRACK_STEP)
    heading = alignment.heading(s)
    middle = alignment.heading(0.5 * (s[1:] + s[:-1]))
    # Simpson's rule for the integral of the direction
    x = TRACK_STEP / 6.0 * (np.cos(heading[1:]) + 4.0 * np.cos(middle) + np.cos(heading[:-1]))
    y = TRACK_STEP / 6.0 * (np.sin(heading[1:]) + 4.0 * np.sin(middle) + np.sin(heading[:-1]))
    return {
        "s": s, "x": np.concatenate([[0.0], np.cumsum(x)]),
        "y": np.concatenate([[0.0], np.cumsum(y)]), "heading": heading,
        "cant": alignment.cant_angle(s),
    }  # fmt: skip


def chosen_mode(
    modes: Sequence[Mapping[str, Any]], wanted: str | None, option: str = "--mode"
) -> Mapping[str, Any]:
    """Mode by name or number (from 1); the first one by default; `option` asks for it.

    Raises InputError: there is none of this name.
    """
    names = [str(mode["name"]) for mode in modes]
    if wanted is None:
        return modes[0]
    if wanted.isdigit() and 1 <= int(wanted) <= len(modes):
        return modes[int(wanted) - 1]
    if wanted not in names:
        raise input_error(option, "no such mode", nearest(wanted, names), wanted)
    return modes[names.index(wanted)]
