"""What an animation shows: bodies with their shapes, poses over time, the track, wheel forces.

Bodies are the boxes of `railsim.definitions.vehicle.outlines`; wheels have their radii, and their
profiles sit on the sections of the rails.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.contact.curves import rail_curve, tape_circle_position
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import FlatVehicle, flatten
from railsim.definitions.vehicle.outlines import body_boxes
from railsim.errors import Fault, Faults, argument_error, input_error, nearest
from railsim.notation import COMPONENTS
from railsim.result import Result
from railsim.result.data import check_result
from railsim.track.alignment import Alignment
from railsim.track.irregularity import shown_displacement

FRAMES, FILM_FRAMES = 600, 200  # at most, of a page and of a film of a run
TRACK_STEP = 1.0  # m
AROUND = 60.0  # m of track ahead and behind
NEEDED = ("body_position", "Q", "Y")
LARGEST = 0.05  # displacement of a mode over the vehicle's length


@dataclass(frozen=True)
class DrawnBody:
    """A body to draw."""

    name: str
    kind: str  # ``car``, ``frame`` or ``wheelset``
    offset: float  # arc length of its frame beyond that of the reference body [m]
    y: float  # nominal position of its centre of gravity in the track frame [m]
    z: float
    # half length, half width and half height, and the middle of the box from the centre of gravity,
    # x, y, z [m]; of a wheelset its radius, half the wheels' distance, and zeros
    box: tuple[float, ...]


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
    right, see `sections`. `seats` (float64[frame, wheelset, 2]): Height of the
    wheelsets' centres, z, at which their wheels touch the drawn rails, and by how much these stand
    further apart than the gauge [m]. `patches`: ``y``, ``z`` [m] and ``N`` [N] of all patches,
    [frame, wheelset, side, patch]. `curves`: ``distance`` [m], ``Q``, ``Y`` [N] and ``lateral``
    [m] for plots, smallest and largest values between frames, [2 frames, wheelset, side].
    """

    title: str
    bodies: tuple[DrawnBody, ...]
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
    curves: Mapping[str, Floats] | None = None


def result_scene(
    result: Result, *, frames: int = FRAMES, between: tuple[float, float] | None = None
) -> Scene:
    """Scene of a run.

    `result`: With `body_position`, Q and Y. `frames`: Number of frames at most. `between`:
    Distances of the reference body between which the run is shown [m]. Raises InputError: the
    result lacks something; nothing lies between.
    """
    check_result(result)
    allowed = f"run it with settings.outputs.quantities with {', '.join(NEEDED)}"
    Faults(
        Fault("result", name, "is not in it", allowed) for name in NEEDED if name not in result
    ).check()
    distance = result["distance"]
    if len(distance) < 2:
        found = f"{len(distance)} instants: {result.status}"
        raise input_error("result", found, "a run of some length", "time")
    low, high = between or (float(distance[0]), float(distance[-1]))
    first = int(np.searchsorted(distance, low))
    last = int(np.searchsorted(distance, high, side="right"))
    if last - first < 2:
        found = f"nothing between {low:g} and {high:g} m"
        allowed = f"the run goes from {distance[0]:.6g} to {distance[-1]:.6g} m"
        raise argument_error("between", found, allowed)
    rows = np.unique(np.linspace(first, last - 1, min(frames, last - first)).astype(int))
    vehicle = result.vehicle()
    flat = flatten(vehicle)
    drawn = _bodies_to_draw(flat)
    columns = [result.bodies.index(body.name) for body in drawn]
    known = "patch_N" in result
    patches = {name: result[f"patch_{name}"][rows] for name in "yzN"} if known else None
    poses = _poses(result, rows)
    wheelsets = [result.bodies.index(name) for name in result.wheelsets]
    profiles = sections(result, flat)
    return Scene(
        title=f"{vehicle.name_with_load} · {result.track().name} · "
              f"{result.speed_words}{result.end_words}",
        bodies=drawn,
        time=result["time"][rows], distance=distance[rows], pose=poses[:, columns],
        track=_track(Alignment(result.track()), distance[rows]), Q=result["Q"][rows],
        Y=result["Y"][rows], contact=contact_points(result, rows, profiles), sections=profiles,
        seats=seats(result, rows, profiles, poses[:, wheelsets]), patches=patches,
        curves=_curves(result, np.append(rows, last)),
    )  # fmt: skip


def _curves(result: Result, rows: Floats) -> dict[str, Floats]:
    """Smallest and largest value from each of some rows to the next, in the order of the ends."""
    starts, ends = rows[:-1] - rows[0], rows[1:] - 1 - rows[0]
    if "wheelset_lateral" in result:
        lateral = result["wheelset_lateral"]
    else:
        lateral = result["body_position"][:, [result.bodies.index(w) for w in result.wheelsets], 1]
    found = {"distance": np.repeat(result["distance"][rows[:-1]], 2)}
    for name, values in (("Q", result["Q"]), ("Y", result["Y"]), ("lateral", lateral[..., None])):
        part = values[rows[0] : rows[-1]]
        low, high = (extreme.reduceat(part, starts) for extreme in (np.fmin, np.fmax))
        rising = part[ends] >= part[starts]
        pair = np.where(rising, low, high), np.where(rising, high, low)
        found[name] = np.stack(pair, axis=1).reshape(-1, *part.shape[1:])
    return found


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
    drawn = _bodies_to_draw(flat)
    names = [body.name for body in drawn]
    shape = np.zeros((len(drawn), 6), dtype=complex)
    body_names = {body.name for body in flat.bodies}
    for key, (real, imaginary) in mode["shape"].items():
        body, _, component = key.rpartition(".")
        if body not in body_names or component not in COMPONENTS:
            raise input_error("modes", "not of this vehicle", nearest(body, body_names), key)
        if body not in names:
            continue
        row = names.index(body)
        if component != "pitch" or drawn[row].kind != "wheelset":
            shape[row, COMPONENTS.index(component)] = complex(real, imaginary)
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
        title=f"{vehicle.name_with_load} · {mode['name']} · {frequency:.3g} Hz, "
              f"damping {100.0 * float(mode['damping_ratio']):.3g} %",
        bodies=drawn, time=time, distance=np.zeros(len(time)),
        pose=np.real(shape[None] * np.exp(1j * phase)[:, None, None]),
        track=flat_track, Q=None, Y=None, contact=None, sections=(), seats=None, patches=None,
    )  # fmt: skip


def _largest(body: DrawnBody, shape: np.ndarray) -> float:
    """Largest displacement of a body's corners in a mode, over all phases along each axis [m]."""
    a, b, c, *middle = body.box
    half = a if body.kind == "wheelset" else c
    corners = np.array([[x, y, z] for x in (-a, a) for y in (-b, b) for z in (-half, half)])
    return float(np.max(np.abs(shape[:3] + np.cross(shape[3:], corners + middle))))


def _bodies_to_draw(flat: FlatVehicle) -> tuple[DrawnBody, ...]:
    """Bodies with boxes; axleboxes are not drawn."""
    boxes = body_boxes(flat)
    reference = flat.body(flat.reference).position[0]
    bodies = []
    for body in flat.bodies:
        x, y, z = body.position
        if body.kind == "wheelset" and body.wheelset:
            radius = float(np.mean(body.wheelset.radius))
            box = (radius, 0.5 * body.wheelset.tape_circle_distance, 0.0, 0.0, 0.0, 0.0)
            bodies.append(DrawnBody(body.name, "wheelset", x - reference, y, z, box))
        elif body.name in boxes:
            low, high = map(np.array, boxes[body.name])
            sizes = [*0.5 * (high - low), *0.5 * (high + low) - body.position]
            kind = "car" if body.name == flat.reference else "frame"
            bodies.append(DrawnBody(body.name, kind, x - reference, y, z, tuple(map(float, sizes))))
    return tuple(bodies)


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
    modes: Sequence[Mapping[str, Any]], name: str | None, option: str = "--mode"
) -> Mapping[str, Any]:
    """Mode by name or number (from 1); the first one by default; `option` asks for it.

    Raises InputError: there is none of this name.
    """
    names = [str(mode["name"]) for mode in modes]
    if name is None:
        return modes[0]
    if name.isdigit() and 1 <= int(name) <= len(modes):
        return modes[int(name) - 1]
    if name not in names:
        raise input_error(option, "no such mode", nearest(name, names), name)
    return modes[names.index(name)]


Section = Mapping[str, Floats]
Profiles = tuple[tuple[Section, ...], ...]
POINTS = 150  # of a profile
MEETS = 2e-4  # m, to which both wheels of a wheelset touch
WIDEST = 0.012  # m, by which rails are moved apart
STEPS = 10  # of the search for it


def sections(result: Result, flat: FlatVehicle) -> Profiles:
    """Profiles of each wheelset, left and right.

    Returns: ``wheel_y``, ``wheel_z`` in the wheelset's axes (y from its middle, z from its axis),
    ``rail_y``, ``rail_z`` in track axes, y rising [m].
    """
    track = result.track()
    wheelsets = []
    for body in flat.of_kind("wheelset"):
        assert body.wheelset is not None  # of its kind
        tape = tape_circle_position(body.wheelset.back_to_back)
        pair = []
        for side, sign in ((0, -1.0), (1, 1.0)):
            wheel = result.profiles[body.wheelset.profile[side]]
            rail = rail_curve(result.profiles[track.rail[side]], track.gauge, track.inclination)
            part = _sample_rows(rail.z.size)[:: int(sign)]
            rows = _sample_rows(len(wheel.y))
            pair.append({
                "wheel_y": sign * (tape + wheel.y[rows]),
                "wheel_z": body.wheelset.radius[side] + wheel.z[rows],
                "rail_y": sign * rail.Y[part], "rail_z": rail.z[part],
            })  # fmt: skip
        wheelsets.append(tuple(pair))
    return tuple(wheelsets)


def _sample_rows(length: int) -> Floats:
    return np.unique(np.linspace(0, length - 1, min(POINTS, length)).astype(int))


def contact_points(result: Result, rows: Floats, profiles: Profiles) -> Floats:
    """Points at which the wheel forces act, from the wheelsets' centres in track axes.

    A wheel that yaws touches ahead of its axle or behind it by -z dz/dy psi, with the slope of its
    profile at the point of contact; its axle is there at -y psi (to first order in the yaw psi).

    They turn with the wheelset from its roll on the track to that on its rails, which are drawn
    level.  Returns float64[frame, wheelset, side, 3]: NaN where a wheel does not touch; the nominal
    rolling circles where the result does not have `contact_y` and `contact_z` [m].
    """
    found = np.zeros((len(rows), len(profiles), 2, 3))
    recorded = all(name in result for name in ("contact_y", "contact_z", "wheelset_yaw"))
    if recorded:
        found[..., 1] = result["contact_y"][rows]
        found[..., 2] = result["contact_z"][rows]
        if "wheelset_roll" in result:
            bodies = [result.bodies.index(name) for name in result.wheelsets]
            roll = result["body_position"][rows][:, bodies, 3] - result["wheelset_roll"][rows]
            y, z = found[..., 1].copy(), found[..., 2].copy()
            found[..., 1], found[..., 2] = y + roll[..., None] * z, z - roll[..., None] * y
    for w, pair in enumerate(profiles):
        for side, section in enumerate(pair):
            y, z = section["wheel_y"], section["wheel_z"]
            order = np.argsort(y)
            y, z = y[order], z[order]
            if recorded:
                slope = np.interp(found[:, w, side, 1], y, np.gradient(z, y))
                yaw = result["wheelset_yaw"][rows, w]
                found[:, w, side, 0] = -(found[:, w, side, 2] * slope + found[:, w, side, 1]) * yaw
            else:
                middle = 0.75 * (2 * side - 1)
                found[:, w, side, 1:] = middle, np.interp(middle, y, z)
    return found


def seats(result: Result, rows: Floats, profiles: Profiles, pose: Floats) -> Floats:
    """How wheelsets sit so that the drawn sections of wheels and rails meet.

    A result gives the wheelset against the middle of its rails and the line over their tops.  The
    height follows from touching, and the distance of elastic rails from touching on both sides.

    `pose` (float64[frame, wheelset, 6]): Of which y and roll against the rails count [m], [rad].
    Returns float64[frame, wheelset, 2]: z of the wheelset's centre, and by how much the rails
    stand further apart [m].
    """
    found = np.zeros((len(rows), len(profiles), 2))
    moved = shown_displacement(result.track())
    for w, pair in enumerate(profiles):
        wider = np.zeros(len(rows))
        if moved is not None and "wheelset_distance" in result:
            y_left, _, y_right, _ = moved(result["wheelset_distance"][rows, w])[0]
            wider = y_right - y_left
        y, roll = pose[:, w, 1], pose[:, w, 3]
        # a wheel that would stand within its rail moves it outwards
        low, high = wider, wider + WIDEST
        uneven = _unevenness(pair, wider, y, roll)
        within, sign = np.abs(uneven) > MEETS, np.sign(uneven)
        for _ in range(STEPS if within.any() else 0):
            middle = 0.5 * (low + high)
            apart = sign * _unevenness(pair, middle, y, roll) > MEETS
            low, high = np.where(apart, middle, low), np.where(apart, high, middle)
        wider = np.where(within, high, wider)
        height = _heights(pair, wider, y, roll).min(axis=0)
        # a wheelset beside its rails stays at the height of its flanges on the rail tops
        height[~np.isfinite(height)] = -float(pair[0]["wheel_z"].max())
        found[:, w] = np.stack([height, wider], axis=-1)
    return found


def _unevenness(pair: tuple[Section, ...], wider: Floats, y: Floats, roll: Floats) -> Floats:
    """By how much the left wheel would stand lower than the right one [m]."""
    left, right = _heights(pair, wider, y, roll)
    both = np.isfinite(left) & np.isfinite(right)
    return np.where(both, left, 0.0) - np.where(both, right, 0.0)


def _heights(pair: tuple[Section, ...], wider: Floats, y: Floats, roll: Floats) -> Floats:
    """Height of the wheelset's centre at which each wheel touches, float64[side, frame] [m]."""
    found = np.empty((2, len(y)))
    for side, section in enumerate(pair):
        wheel_y, wheel_z = section["wheel_y"], section["wheel_z"]
        across = y[:, None] + wheel_y - roll[:, None] * wheel_z - (side - 0.5) * wider[:, None]
        down = wheel_z + roll[:, None] * wheel_y
        rail = np.interp(across, section["rail_y"], section["rail_z"], np.inf, np.inf)
        found[side] = np.min(rail - down, axis=1)
    return found
