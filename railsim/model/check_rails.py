"""Check rails and flange backs as the time loop takes them, see `railsim.kernels.check_rails`."""

from typing import NamedTuple

import numpy as np

from railsim.arrays import Floats
from railsim.contact.curves import GAUGE_DEPTH, tape_circle_position
from railsim.definitions import Track
from railsim.definitions.track.check_rail import FAR, CheckRail
from railsim.definitions.vehicle.flatten import FlatVehicle
from railsim.definitions.vehicle.tables import Wheelset
from railsim.kernels.check_rails import CHECK_ROW, CHECK_WHEEL, FIRST, LAST
from railsim.profiles.profile import Profile

SPACING = 1e-4  # m, of the heights at which both contours are compared
USUAL_YAW = 0.015  # rad, at which the disc reaches as far as the flange


class CheckRails(NamedTuple):
    """The fields of `kernels.system.Contact` that hold check rails."""

    check: Floats
    check_flangeway: Floats
    check_wheel: Floats


NONE = CheckRails(np.zeros((0, CHECK_ROW)), np.zeros((0, 2)), np.zeros((0, 0, CHECK_WHEEL)))


def standing_at(check: CheckRails, s: float) -> CheckRails:
    """Return the check rails at `s` all along the track, as wide there as at `s`."""
    kept, rows = [], []
    table: list[tuple[float, float]] = []
    for k, row in enumerate(check.check):
        first, last = int(row[FIRST]), int(row[LAST])
        at, width = check.check_flangeway[first : last + 1].T
        if at[0] <= s <= at[-1]:
            moved = row.copy()
            moved[FIRST : LAST + 1] = len(table), len(table) + 1
            table += [(-FAR, float(np.interp(s, at, width))), (FAR, float(np.interp(s, at, width)))]
            kept.append(k)
            rows.append(moved)
    if not kept:
        return NONE
    return CheckRails(np.array(rows), np.array(table), check.check_wheel[:, kept])


def check_rails(flat: FlatVehicle, track: Track, profiles: dict[str, Profile]) -> CheckRails:
    """Return the check rails of a track, with the backs of a vehicle's wheels."""
    if not track.check_rail:
        return NONE
    rows, tables = [], list[tuple[float, float]]()
    for rail in track.check_rail:
        side, first = 0 if rail.rail == "left" else 1, len(tables)
        tables += rail.rows
        last = len(tables) - 1
        rows.append([side, first, last, rail.stiffness, rail.damping, rail.friction])
    wheels = np.array(
        [
            [flange_back(wheelset, rail, track.gauge, profiles) for rail in track.check_rail]
            for wheelset in (body.wheelset for body in flat.of_kind("wheelset"))
            if wheelset is not None
        ]
    )
    return CheckRails(np.array(rows, dtype=float), np.array(tables), wheels)


def flange_back(
    wheelset: Wheelset, rail: CheckRail, gauge: float, profiles: dict[str, Profile]
) -> tuple[float, float, float, float]:
    """Clearance less the flangeway, height of the contact below the axle, its reach, and the back.

    The contour of the flange goes on upwards from the end of its profile, parallel to the wheel's
    plane.  Contours are compared between the top of the check rail and the tip of the flange.
    With psi the yaw the circle of the radius r meets the height h of the face x ahead of the axle,
    x^2 = r^2 - h^2, so that the clearance is the least of own(r) - face(h) - psi x over r >= h.
    """
    side = 0 if rail.rail == "left" else 1
    wheel = profiles[wheelset.profile[side]]
    tip = int(np.argmax(wheel.z))
    y, z = wheel.y[: tip + 1], wheel.z[: tip + 1]
    order = np.argsort(z, kind="stable")
    y, z = np.minimum.accumulate(y[order][::-1])[::-1], z[order]
    heights = np.arange(-rail.height, z[-1], SPACING)
    if rail.profile is None:
        face = np.zeros_like(heights)
    else:
        contour = np.array(rail.profile)[np.argsort([point[1] for point in rail.profile])]
        at = np.interp(GAUGE_DEPTH + rail.height, contour[:, 1], contour[:, 0])
        face = np.interp(heights + rail.height, contour[:, 1], contour[:, 0]) - at
    own = np.interp(heights, z, y, left=float(y[0]))
    clearance = own - face
    # of a plane back on a plane face the highest point, where the disc is widest
    first = int(np.argmax(clearance <= clearance.min() + 1e-6))
    tape, radius = tape_circle_position(wheelset.back_to_back), wheelset.radius[side]
    below = radius + float(heights[first])
    # a yawed flange touches with a larger circle, where it is rounded already
    r = radius + heights
    ahead = np.sqrt(np.maximum(r[:, None] ** 2 - r**2, 0.0))
    yawed = np.where(np.tri(r.size, dtype=bool), own[:, None] - face - USUAL_YAW * ahead, np.inf)
    reach = float(clearance[first] - yawed.min()) / USUAL_YAW
    back = float(own[first]) + tape
    return float(clearance[first]) + tape - 0.5 * gauge, below, reach, back
