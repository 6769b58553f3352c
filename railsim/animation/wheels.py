"""Wheels on their rails: profiles as sections, points of contact, and how a wheelset sits."""

from collections.abc import Mapping

import numpy as np

from railsim.arrays import Floats
from railsim.contact.curves import rail_curve, tape_circle_position
from railsim.definitions.vehicle.flatten import FlatVehicle
from railsim.result import Result
from railsim.track.irregularity import shown_displacement

Section = Mapping[str, Floats]
POINTS = 150  # of a profile
MEETS = 2e-4  # m, to which both wheels of a wheelset touch
WIDEST = 0.012  # m, by which rails are moved apart
STEPS = 10  # of the search for it


def sections(result: Result, flat: FlatVehicle) -> tuple[tuple[Section, ...], ...]:
    """Profiles of each wheelset, left and right.

    Returns: ``wheel_y``, ``wheel_z`` in the wheelset's axes (y from its middle, z from its axis),
    ``rail_y``, ``rail_z`` in track axes, y rising [m].
    """
    track = result.track()
    found = []
    for body in flat.of_kind("wheelset"):
        assert body.wheelset is not None  # of its kind
        tape = tape_circle_position(body.wheelset.back_to_back)
        pair = []
        for side, sign in ((0, -1.0), (1, 1.0)):
            wheel = result.profiles[body.wheelset.profile[side]]
            rail = rail_curve(result.profiles[track.rail[side]], track.gauge, track.inclination)
            part = _thinned(rail.z.size)[:: int(sign)]
            rows = _thinned(len(wheel.y))
            pair.append({
                "wheel_y": sign * (tape + wheel.y[rows]),
                "wheel_z": body.wheelset.radius[side] + wheel.z[rows],
                "rail_y": sign * rail.Y[part], "rail_z": rail.z[part],
            })  # fmt: skip
        found.append(tuple(pair))
    return tuple(found)


def _thinned(length: int) -> Floats:
    return np.unique(np.linspace(0, length - 1, min(POINTS, length)).astype(int))


def contact_points(
    result: Result, rows: Floats, profiles: tuple[tuple[Section, ...], ...]
) -> Floats:
    """Points at which the wheel forces act, from the wheelsets' centres in track axes.

    A wheel that yaws touches ahead of its axle or behind it by -z dz/dy psi, with the slope of its
    profile at the point of contact; its axle is there at -y psi (to first order in the yaw psi).

    Returns float64[frame, wheelset, side, 3]: NaN where a wheel does not touch; the nominal
    rolling circles where the result does not have `contact_y` and `contact_z` [m].
    """
    found = np.zeros((len(rows), len(profiles), 2, 3))
    known = all(name in result for name in ("contact_y", "contact_z", "wheelset_yaw"))
    if known:
        found[..., 1] = result["contact_y"][rows]
        found[..., 2] = result["contact_z"][rows]
    for w, pair in enumerate(profiles):
        for side, section in enumerate(pair):
            y, z = section["wheel_y"], section["wheel_z"]
            order = np.argsort(y)
            y, z = y[order], z[order]
            if known:
                slope = np.interp(found[:, w, side, 1], y, np.gradient(z, y))
                yaw = result["wheelset_yaw"][rows, w]
                found[:, w, side, 0] = -(found[:, w, side, 2] * slope + found[:, w, side, 1]) * yaw
            else:
                middle = 0.75 * (2 * side - 1)
                found[:, w, side, 1:] = middle, np.interp(middle, y, z)
    return found


def seats(
    result: Result, rows: Floats, profiles: tuple[tuple[Section, ...], ...], pose: Floats
) -> Floats:
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
