"""Profiles prepared for contact search: placed, single-valued, with slopes and curvatures.

A wheel becomes candidate points along the axle, a rail a function of the lateral position.  Both
keep only the part that a vertical search can reach: slopes up to `STEEPEST`; beyond, the rail goes
on straight.  The frame is that of the right wheel and rail in track axes: y to the right from the
track's centre line, z down from the plane through the rail tops.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

from railsim.arrays import Floats
from railsim.errors import Fault, input_error
from railsim.profiles.profile import FLANGE_BACK, Profile

STEEPEST = 5.67
"""Steepest slope of a rail that is searched, the tangent of 80 degrees [1]."""

STEEPEST_BACK = 2.0
"""Steepest slope on the back of the flange's tip that is searched [1]."""

GAUGE_DEPTH = 0.014
"""Depth below the rail tops at which the gauge is measured [m] (EN 13848-1)."""

RAIL_SPACING = 2e-5
"""Distance of the rail's nodes [m]."""

HALF_WIDTHS = np.array([0.5, 1.0, 1.5, 2.0, 3.0, 4.5, 7.0, 11.0]) * 1e-3
"""Half-widths over which curvatures are averaged [m]."""

ARC_SPACING = 5e-5
"""Distance along the contour at which curvatures are averaged [m]."""


@dataclass(frozen=True)
class WheelCurve:
    """Candidate points of a right wheel, each of shape (n,)."""

    y: Floats  # lateral position from the nominal rolling circle, field side positive [m]
    u: Floats  # position along the axle from the wheelset's centre [m]
    r: Floats  # radius [m]
    t: Floats  # slope dr/du [1]
    curvature: Floats  # convex positive, averaged over `HALF_WIDTHS`, shape (n_width, n) [1/m]


@dataclass(frozen=True)
class RailCurve:
    """A right rail in the track, as a function of the lateral position."""

    Y0: float  # first node [m]
    dY: float  # spacing [m]
    z: Floats  # height below the rail-top plane, shape (n,) [m]
    slope: Floats  # dz/dY, shape (n,) [1]
    curvature: Floats  # convex positive, averaged over `HALF_WIDTHS`, shape (n_width, n) [1/m]

    @property
    def Y(self) -> Floats:
        """Lateral positions of the nodes [m], shape (n,)."""
        return self.Y0 + self.dY * np.arange(self.z.size, dtype=np.float64)


def averaged_curvature(y: Floats, slope: Floats, sign: float) -> Floats:
    """Curvature of a contour averaged over the patch, with the patch's parabolic weight.

    The weight is 3/(4 b) (1 - (s/b)^2) over the contour's length s within half a width b.

    `y`, `slope`, shape (n,): lateral position, increasing [m], and dz/dy [1]; `sign`: 1 for a rail
    (z down, convex upwards), -1 for a wheel. Returns shape (n_width, n), averages at the given
    points, for each of `HALF_WIDTHS` [1/m].
    """
    length = np.concatenate(
        ([0.0], np.cumsum(np.diff(y) * np.sqrt(1.0 + (0.5 * (slope[1:] + slope[:-1])) ** 2)))
    )
    n = max(int(np.ceil(length[-1] / ARC_SPACING)), 2)
    even = np.linspace(0.0, length[-1], n + 1)
    step = even[1]
    angle = np.arctan(np.interp(even, length, slope))
    curvature = sign * np.gradient(angle, step)
    result = np.empty((HALF_WIDTHS.size, y.size))
    for i, half_width in enumerate(HALF_WIDTHS):
        m = max(round(half_width / step), 1)
        weight = 1.0 - (np.arange(-m, m + 1) / (m + 0.5)) ** 2
        weight /= weight.sum()
        padded = np.pad(curvature, m, mode="edge")
        result[i] = np.interp(length, even, np.convolve(padded, weight, mode="valid"))
    return result


def single_valued_part(y: Floats, z: Floats, start: int, limit: float) -> slice:
    """Largest run of points around `start` that goes forward in y with slopes up to `limit`."""
    dy, dz = np.diff(y), np.diff(z)
    good = (dy > 0.0) & (np.abs(dz) <= limit * dy)
    first = start
    while first > 0 and good[first - 1]:
        first -= 1
    last = start
    while last < y.size - 1 and good[last]:
        last += 1
    return slice(first, last + 1)


def contour_spline(y: Floats, z: Floats) -> "CubicSpline":
    """Cubic spline of a contour whose end slopes are those of its last pieces.

    Where the usable part ends at a kink, a free end would swing to the wrong side.
    """
    ends = (z[1] - z[0]) / (y[1] - y[0]), (z[-1] - z[-2]) / (y[-1] - y[-2])
    # here and below: a run with cached tables does without this import of a quarter of a second
    from scipy.interpolate import CubicSpline

    return CubicSpline(y, z, bc_type=((1, ends[0]), (1, ends[1])))


def wheel_curve(
    profile: Profile, radius: float, tape_circle: float, spacing: float = 2e-4
) -> WheelCurve:
    """Candidate points of a wheel.

    `profile`: wheel profile; `radius`: rolling radius at the nominal rolling circle [m];
    `tape_circle`: position of the nominal rolling circle from the wheelset's centre [m]; `spacing`:
    distance of the candidates on level parts [m]; it shrinks with the slope t by the factor (1 +
    t^2)^(-3/4), as the width of a contact in lateral projection does.
    """
    y, z = profile.y, profile.z
    tip = int(np.argmax(z))
    on_tread = tip + int(np.argmin(np.abs(y[tip:])))
    part = single_valued_part(y, z, on_tread, 3.0 * STEEPEST)
    # scans from both sides often do not meet exactly on the tip itself
    if z[part.start] < z[tip] - 3e-3 and part.start > tip:
        found = "the contour is not continuous from tread to flange tip"
        allowed = "a wheel profile must run in one piece from the flange's tip to the field side"
        raise input_error(profile.name, found, allowed)
    spline = contour_spline(y[part], z[part])
    fine = np.linspace(y[part.start], y[part.stop - 1], 40_001)
    slope = spline(fine, 1)
    back = np.flatnonzero((fine < y[tip]) & (slope > STEEPEST_BACK))
    fine = fine[(back[-1] + 1 if back.size else 0) :]
    slope = spline(fine, 1)
    density = (1.0 + slope**2) ** 0.75 / spacing
    count = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine))))
    n = int(np.ceil(count[-1]))
    nodes = np.interp(np.linspace(0.0, count[-1], n + 1), count, fine)
    t = spline(nodes, 1)
    return WheelCurve(
        y=nodes,
        u=nodes + tape_circle,
        r=radius + spline(nodes),
        t=t,
        curvature=averaged_curvature(nodes, t, -1.0),
    )


def tape_circle_position(back_to_back: float) -> float:
    """Position of the right nominal rolling circle from the wheelset's centre [m].

    The wheels sit on the axle at the given back-to-back distance; profiles are given from a nominal
    rolling circle 70 mm from the flange back.
    """
    return 0.5 * back_to_back - FLANGE_BACK


def gauge_face(y: Floats, z: Floats) -> float:
    """Innermost lateral position of a rail's gauge side within `GAUGE_DEPTH` below its top [m].

    Raises ValueError: if the contour does not reach that deep on the gauge side.
    """
    top = int(np.argmin(z))
    if z[: top + 1].max() < GAUGE_DEPTH:
        raise ValueError(f"the gauge side ends {1e3 * z[: top + 1].max():.1f} mm below the top")
    below = int(np.flatnonzero(z[: top + 1] >= GAUGE_DEPTH)[-1])
    share = (GAUGE_DEPTH - z[below + 1]) / (z[below] - z[below + 1])
    crossing = y[below + 1] + share * (y[below] - y[below + 1])
    return float(min(crossing, y[below + 1 : top + 1].min()))


def inclined_to_track(profile: Profile, gauge: float, inclination: float) -> tuple[Floats, Floats]:
    """Points of a right rail in the track: lateral position and height below the rail tops [m].

    `profile`, `gauge`, `inclination`: as `rail_curve`. Raises InputError: if the profile does not
    reach down to where gauge is measured.
    """
    from scipy.interpolate import CubicSpline

    angle = np.arctan(inclination) - np.arctan(profile.inclination)
    y = profile.y * np.cos(angle) + profile.z * np.sin(angle)
    z = -profile.y * np.sin(angle) + profile.z * np.cos(angle)
    highest = int(np.argmin(z))
    around = slice(max(highest - 3, 0), highest + 4)
    crown = CubicSpline(y[around], z[around])
    roots = crown.derivative().roots(extrapolate=False)
    z -= float(np.min(crown(roots))) if roots.size else float(z.min())
    try:
        face = gauge_face(y, z)
    except ValueError as error:
        remedy = f"the gauge is measured {1e3 * GAUGE_DEPTH:.0f} mm below the top"
        raise input_error(profile.name, str(error), remedy) from None
    return y - face + 0.5 * gauge, z


def rail_curve(profile: Profile, gauge: float, inclination: float) -> RailCurve:
    """Place a right rail in the track.

    `profile`: rail profile; `gauge`: distance of the gauge faces within 14 mm below the rail tops
    [m]; `inclination`: inclination towards the track's centre, as tangent [1]; what the profile
    already carries counts.
    """
    return contour_curve(*inclined_to_track(profile, gauge, inclination))


def contour_curve(y: Floats, z: Floats) -> RailCurve:
    """Rail of a contour: lateral positions in the track and heights below the rail tops [m]."""
    part = single_valued_part(y, z, int(np.argmin(z)), STEEPEST)
    spline = contour_spline(y[part], z[part])
    n = int((y[part.stop - 1] - y[part.start]) / RAIL_SPACING)
    cut = part.start > 0, part.stop < y.size
    nodes = y[part.start] + RAIL_SPACING * np.arange(-cut[0], n + 1 + cut[1])
    inside = np.clip(nodes, y[part.start], y[part.start] + RAIL_SPACING * n)
    beyond = nodes - inside
    slope = np.where(beyond == 0.0, spline(inside, 1), np.copysign(STEEPEST, beyond))
    # beyond the ends the rail goes on straight: where the points go on more steeply, at the
    # steepest slope that is searched; where they end, as they do, and never upwards
    slope[0], slope[-1] = min(float(slope[0]), 0.0), max(float(slope[-1]), 0.0)
    return RailCurve(
        Y0=float(nodes[0]),
        dY=RAIL_SPACING,
        z=spline(inside) + STEEPEST * np.abs(beyond),
        slope=slope,
        curvature=averaged_curvature(nodes, slope, 1.0),
    )


def misfits(wheel: WheelCurve, rail: RailCurve, gauge: float, pair: str) -> list[Fault]:
    """Why a wheelset of this wheel cannot run in this track, on both sides the same.

    `gauge`: for the message [m]; `pair`: what the message calls them. Returns nothing if it can: in
    the middle of the track the tread stands on the rail, and pushed to one side until the flange
    touches, the other wheel still has the rail under it.
    """
    steepest = float(wheel.t.min())
    # a wheel without flange has none to be in the way
    flank = int(np.flatnonzero(wheel.t < 0.9 * steepest)[-1]) if steepest < -0.5 else 0
    flank_u = wheel.u[flank]
    corner = rail.Y[int(np.argmax(rail.slope > -1.0))]
    slack = 0.5 * gauge - flank_u
    height = np.interp(wheel.u, rail.Y, rail.z, left=1.0, right=1.0) - (wheel.r - wheel.r.min())
    if corner - flank_u < 0.0:
        found = (
            f"the flange stands on the rail, {1e3 * (flank_u - corner):.1f} mm beyond the "
            "gauge corner, when the wheelset is central"
        )
    elif wheel.u[-1] - slack < corner:
        short = 1e3 * (corner + slack - wheel.u[-1])
        found = (
            "the wheelset falls between the rails: with one flange at its rail, the outer end of "
            f"the other wheel is {short:.1f} mm short of the rail"
        )
    elif int(np.argmin(height)) <= flank:
        found = "the flange touches the rail when the wheelset is central"
    else:
        return []
    remedy = "check gauge, back-to-back distance and both profiles"
    return [Fault(f"gauge {1e3 * gauge:.1f} mm", pair, found, remedy)]
