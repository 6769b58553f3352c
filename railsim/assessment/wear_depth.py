"""Depth of wear over the profile of a wheel or a rail, and the worn profile.

At each instant every contact patch wears after a law of `railsim.assessment.wear.LAWS`; the worn
area is distributed across the patch as a half ellipse, at the position of the patch on the
profile.  The wheel stays round: the depth is uniform over the circumference.  The rail loses the
volume that a law gives for the wheel, pi D times the worn area of its profile: the laws are those
of wheel and rail of like hardness.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats
from railsim.assessment.wear import DEFAULT_LAW, LAWS, Patches, WearLaw
from railsim.contact.curves import inclined_to_track, tape_circle_position
from railsim.contact.gauges import wheel_gauge
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.tables import Wheelset
from railsim.errors import Fault, Faults, argument_error, input_error
from railsim.profiles import Profile
from railsim.result import Result

SPACING = 0.25e-3  # m
RANGE = (-0.070, 0.070)  # m from the nominal rolling circle
SCATTER = 3e-3  # m along the contour, standard deviation of where the same contact lies
ROUNDING = 0.1  # largest share of the worn area that the points of the profile may miss
WORN = " worn"
DEEPEST = 1e-3  # m, in one step: beyond it the contact would have moved on the profile meanwhile
UPDATE = 0.1e-3  # m, after which the contact is computed again on the worn profile
MOST_PARTS = 100  # of a step
OF_PATCHES = ("T_gamma", "N", "friction", "a", "b", "y", "z", "angle")
OF_RAILS = "rail_lateral", "rail_deflection_lateral"
NEEDED = (*(f"patch_{name}" for name in OF_PATCHES), "body_position")


def grid() -> Floats:
    """Positions on the profile from the nominal rolling circle, positive to the field side [m]."""
    count = round((RANGE[1] - RANGE[0]) / SPACING)
    return np.asarray(RANGE[0] + SPACING * (np.arange(count) + 0.5), dtype=np.float64)


def worn_depth(
    result: Result, wheelset: int, side: int, law: WearLaw = LAWS[DEFAULT_LAW]
) -> Floats:
    """Depth of wear of a wheel profile per distance, over `grid`.

    `result`: Run with `outputs.contact_patches`. `wheelset`, `side`: From 0; side 0 left, 1 right.
    `law`: One of `railsim.assessment.wear.LAWS`, or of a file: `railsim.assessment.wear.wear_law`.
    Returns float64[position]: Mean depth per metre run, in the direction z of the profile [m/m].
    Its integral over the grid is the worn area per distance. Raises InputError: the result lacks a
    quantity.
    """
    areas, ways, across, widths, wheel = _patches(result, wheelset, side, law)
    centres = (-1.0, 1.0)[side] * across - tape_circle_position(wheel.back_to_back)
    return spread(centres, widths, areas * ways[:, None]) / float(np.sum(ways))


def rail_depth(
    result: Result, wheelset: int, side: int, law: WearLaw = LAWS[DEFAULT_LAW]
) -> Floats:
    """Depth of wear of a rail profile per passing wheelset, over `grid` from the rail's middle.

    Mean over the distance of the run.  Arguments and errors as of `worn_depth`; the run also needs
    `outputs.track`, which says where the rails are.

    Returns float64[position]: [m]; its integral over the grid is the worn area of a passage.
    """
    areas, ways, _, widths, wheel = _patches(result, wheelset, side, law)
    _require(result, OF_RAILS, "settings.outputs.track=true")
    wheel_index, track = (slice(None), wheelset, side), result.track()
    body = result.bodies.index(result.wheelsets[wheelset])
    across = result["patch_y"][wheel_index] + result["body_position"][:, body, 1, None]
    for name in OF_RAILS:
        across = across - result[name][wheel_index][:, None]
    rail = result.profiles[track.rail[side]]
    head = upper_side(rail)
    y = inclined_to_track(rail, track.gauge, track.inclination)[0][head]
    centres = np.interp((-1.0, 1.0)[side] * across, y, rail.y[head])
    areas = areas * np.pi * 2.0 * wheel.radius[side]
    return spread(centres, widths, areas * ways[:, None]) / float(np.sum(ways))


def _patches(
    result: Result, wheelset: int, side: int, law: WearLaw
) -> tuple[Floats, Floats, Floats, Floats, Wheelset]:
    """Worn areas, distances, positions across in the wheelset's axes, half widths; wheelset."""
    _require(result, NEEDED, "settings.outputs.contact_patches=true")
    wheel = flatten(result.vehicle()).of_kind("wheelset")[wheelset].wheelset
    if wheel is None:  # a body of this kind has its definition
        raise input_error("result", f"no wheelset {wheelset}", "", "wheelset")
    columns = (result[f"patch_{name}"][:, wheelset, side] for name in OF_PATCHES)
    T_gamma, N, friction, a, b, y, z, angle = columns
    ways = np.gradient(result["distance"])
    speed = (ways / np.gradient(result["time"]))[:, None]
    patches = Patches(T_gamma, np.pi * a * b, 2.0 * wheel.radius[side], N, friction, speed)
    body = result.bodies.index(result.wheelsets[wheelset])
    # from the axes of the track to those of the wheelset
    across = y + result["body_position"][:, body, 3, None] * z
    return law.worn_area(patches), ways, across, b * np.abs(np.cos(angle)), wheel


def _require(result: Result, names: Sequence[str], output: str) -> None:
    """Refuse a result that lacks quantities."""
    words = "is not in it", f"run it with {output}"
    Faults(Fault("result", name, *words) for name in names if name not in result).check()


def upper_side(profile: Profile) -> slice:
    """Points of a profile that contact can reach: y increases from one to the next."""
    if profile.kind == "wheel":
        return slice(None)
    top = int(np.argmin(profile.z))
    back = np.diff(profile.y) <= 0.0
    first = int(np.flatnonzero(back[:top])[-1]) + 1 if back[:top].any() else 0
    last = top + int(np.argmax(back[top:])) + 1 if back[top:].any() else len(profile.y)
    return slice(first, last)


def spread(centres: Floats, widths: Floats, areas: Floats) -> Floats:
    """Sum of half ellipses of given centres, half widths [m] and areas [m2] over `grid` [m].

    The integral over each cell is exact.
    """
    positive = areas > 0.0
    y, b, A = centres[positive], np.maximum(widths[positive], 1e-5), areas[positive]
    edges = np.concatenate([grid() - 0.5 * SPACING, [RANGE[1]]])
    # first edge within each ellipse, and first one behind it
    first, end = np.searchsorted(edges, y - b), np.searchsorted(edges, y + b)
    whole = np.bincount(end, weights=A, minlength=len(edges) + 1)[1:-1]
    within = np.zeros(len(edges))
    for start in range(0, len(y), 20000):  # in parts, to limit the memory
        part = np.arange(start, min(start + 20000, len(y)))
        count = (end - first)[part]
        ellipse = np.repeat(part, count)
        edge = np.arange(len(ellipse)) + np.repeat(end[part] - np.cumsum(count), count)
        u = np.clip((edges[edge] - y[ellipse]) / b[ellipse], -1.0, 1.0)
        share = 0.5 + (u * np.sqrt(1.0 - u**2) + np.arcsin(u)) / np.pi
        within += np.bincount(edge, weights=share * A[ellipse], minlength=len(edges))
    return np.asarray((whole + np.diff(within)) / SPACING)


def scattered(profile: Profile, depth: Floats) -> Floats:
    """Depth of wear as contacts scatter along the contour that a run has in one place.

    Gauge, rails and loads differ from place to place; without, a circle and its one rail would cut
    a groove narrower than any rail.  On the flank the same way along the contour is shorter in y.

    `profile`: A wheel or a rail. `depth` (float64[position]): Depth in the direction z over `grid`
    [m]. Returns float64[position]: Depth with the same worn area [m].
    """
    lengths = _lengths(profile)
    s = np.cumsum(lengths)
    kernel = np.exp(-0.5 * ((s[:, None] - s) / SCATTER) ** 2) * lengths[:, None]
    return np.asarray(kernel / kernel.sum(axis=0) @ depth)


def _lengths(profile: Profile) -> Floats:
    """Length of the contour in each cell of `grid` [m]."""
    side = upper_side(profile)
    z = np.interp(grid(), profile.y[side], profile.z[side])
    return np.asarray(np.hypot(SPACING, np.gradient(z)))


def deepest(profile: Profile, depth: Floats) -> float:
    """Greatest depth of `scattered` wear, measured along the normal [as `depth`]."""
    return float(np.max(scattered(profile, depth) * SPACING / _lengths(profile)))


def parts_of_step(profile: Profile, depth: Floats, distance: float) -> int:
    """Into how many parts a distance is divided so that each wears the profile by `UPDATE` at most.

    Arguments as for `worn_profile`.

    Raises InputError: more than `MOST_PARTS`.
    """
    worn = deepest(profile, depth) * distance
    parts = max(math.ceil(worn / UPDATE), 1)
    if not parts <= MOST_PARTS:
        allowed = f"at most {1e3 * MOST_PARTS * UPDATE:g} mm in a step"
        found = f"{_amount(profile, distance)} wear it {1e3 * worn:.3g} mm deep"
        raise input_error(profile.name, found, allowed, "step")
    return parts


def _amount(profile: Profile, amount: float) -> str:
    """Distance that a wheel has run [m], or tonnage over a rail [kg], as messages give it."""
    return f"{1e-9 * amount:.4g} Mt" if profile.kind == "rail" else f"{1e-3 * amount:.4g} km"


def worn_profile(profile: Profile, depth: Floats, distance: float) -> Profile:
    """Profile after a distance at a constant rate of wear.

    `profile`: A wheel; or a rail, whose amount of traffic stands for the distance. `depth`
    (float64[position]): Depth per distance over `grid` [m/m]. `distance`: [m]. Returns: The depth
    is that of `scattered`; the worn area is that of `depth` times `distance`. Raises InputError:
    the wear is deeper than 1 mm; the points of the profile are too far apart.
    """
    worn = depth * distance
    most = deepest(profile, worn)
    if most > DEEPEST:
        allowed = f"at most {1e3 * DEEPEST:g} mm: {_amount(profile, distance * DEEPEST / most)}"
        found = f"{_amount(profile, distance)} wear {1e3 * most:.3g} mm deep"
        raise argument_error("step", found, allowed)
    smooth = scattered(profile, worn)
    side, lost = upper_side(profile), np.zeros(len(profile.y))
    lost[side] = np.interp(profile.y[side], grid(), smooth, left=0.0, right=0.0)
    area, resolved = SPACING * float(np.sum(worn)), float(np.trapezoid(lost, profile.y))
    if area > 0.0:
        if abs(resolved / area - 1.0) > ROUNDING:
            found = f"its points resolve {100.0 * resolved / area:.0f} % of the worn area"
            raise input_error(profile.name, found, "points at most 1 mm apart", "points")
        lost *= area / resolved
    note = f"worn by {1e6 * area:.2f} mm2"
    name = f"{profile.name.removesuffix(WORN)}{WORN}"
    # z points down: a wheel loses height, a rail gains depth
    z = profile.z + lost if profile.kind == "rail" else profile.z - lost
    origin = f"{profile.source}; {note}", profile.inclination, (*profile.notes, note)
    return Profile(name, profile.kind, profile.y, z, *origin)


@dataclass(frozen=True)
class WheelDimensions:
    """Dimensions of a wheel profile (EN 15313), in [m]."""

    flange_height: float  # sh: tip of the flange below the nominal rolling circle
    flange_thickness: float  # sd: of the flange, 10 mm below the nominal rolling circle
    flange_slope: float  # qR: along the axle, from there to 2 mm above the tip
    hollow: float  # deepest place of the tread above what is farther out


def wheel_dimensions(profile: Profile) -> WheelDimensions:
    """Dimensions of a wheel profile; z = 0 need not be on the rolling circle.

    >>> from railsim.profiles import load_profile
    >>> found = wheel_dimensions(load_profile("S1002"))
    >>> [round(1e3 * v, 1) for v in (found.flange_height, found.flange_thickness)]
    [28.0, 32.5]
    """
    tread = profile.z[int(np.argmax(profile.z)) :]
    outer = np.maximum.accumulate(tread[::-1])[::-1]
    return WheelDimensions(*wheel_gauge(profile), float(np.max(outer - tread)))
