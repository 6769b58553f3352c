"""From the points of a file to a profile: recognise, report, correct or refuse.

What can be recognised from the shape alone is corrected with a note: millimetres instead of metres,
points out of order, z up instead of down, mirrored, origin at the flange back, a rail that is
already inclined, duplicate points, single outliers, measuring noise.  What cannot be recognised is
refused with the line and a remedy: gaps, vertical steps, a rail given as wheel, too few points.

The shape of a wheel: a tread at least 30 mm wide and a flange, the highest point of the contour
seen from the rail, within its first half and round (the contour turns back behind it).  The shape
of a rail: a crown from which the contour only falls, 14 mm or more on the gauge side.
"""

from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.profiles.profile import FLANGE_BACK, Kind, Profile
from railsim.profiles.readers import Points
from railsim.profiles.smoothing import departures, smoothed_points, used_part

FEWEST_POINTS = 20
LARGEST_HOLE = 0.006
"""Largest distance of neighbouring points [m]: across it a curve of 13 mm radius departs by
0.35 mm from its chord, which cubic interpolation still brings down to some 5 um."""

NEAREST = 5e-6
"""Distance below which a point that is far nearer than usual repeats the one before [m]."""

STEP = 0.3e-3
"""Smallest vertical step that is not taken for a steep slope [m]."""

SMALLEST_OUTLIER = 15e-6
"""Departure from the neighbours, over that of noise, below which no point is an outlier [m]."""

MOST_TRIED, WIDEST = 10, 4e-3
"""Number of departing points of which one may be an outlier; its four neighbours' width [m]."""

FLANGE_HEIGHTS = (0.015, 0.050)
TREAD_WIDTH = 0.030
GAUGE_SIDE_DEPTH = 0.0140
STANDARD_INCLINATIONS = (1 / 20, 1 / 30, 1 / 40)
HIGHEST_FACE, DEEPEST_FACE = 1.5e-3, 10e-3
"""Depths below its top between which a rail that is steeper than 80 degrees is worn [m]."""

STEEP_FLANK = 0.075
"""Slope to the vertical of an unworn head's flanks at most [1]; 1:17.2 of 49E1 is 0.058."""

LARGEST_SKEW = 0.5e-3
"""Shift of a head's upper part from the middle of its flanks beyond which it is worn [m]."""

BACK_TOLERANCE = 0.5e-3
"""Distance of a measured flange back from -70 mm up to which the origin is left alone [m]."""

UPRIGHT = 4e-3
"""Lean that measuring noise and wear may feign [1]."""


def recognised_profile(work: Points, kind: Kind | None = None) -> Profile:
    """Turn a file's points into a profile.

    `work`: what the file holds; is changed; `kind`: what it is used as; None goes by the file.
    Returns: with a note on every correction. Raises InputError: if it is not a usable profile of
    that kind.
    """
    kind = kind or work.kind
    if kind is None:  # wheels are more than 95 mm wide, rail heads less
        width = np.ptp(work.y) if work.y.size else 0.0
        kind = "wheel" if width * (work.unit or (1e-3 if width > 1.0 else 1.0)) > 0.095 else "rail"
    if work.y.size < FEWEST_POINTS:
        raise work.fail(
            f"{work.y.size} points", f"a profile needs {FEWEST_POINTS} or more, 0.5 mm apart"
        )
    if work.kind is not None and work.kind != kind:
        raise work.fail(f"this is a {work.kind} profile", f"give a {kind} profile")
    _to_metres(work, kind)
    _remove_double_points(work)
    _bring_into_order(work)
    _remove_outliers(work)
    _check_holes(work)
    inclination = 0.0
    if kind == "wheel":
        _orient_wheel(work)
        _shift_wheel(work)
    else:
        inclination = _orient_rail(work)
    _check_steps(work, kind)
    y, z = smoothed_points(work)
    _check_overhang(work, kind, y, z)
    if y[-1] < 0.040 if kind == "wheel" else z[-1] - z.min() < 3e-3:
        beyond = "no contact is found" if kind == "wheel" else "the rail goes on straight"
        work.notes.append(f"field side ends at y = {1e3 * y[-1]:.1f} mm: beyond it {beyond}")
    level = float(np.interp(0.0, *_function_part(y, z)) if kind == "wheel" else z.min())
    if kind == "wheel" and abs(level) > 1e-5:
        work.notes.append(f"z moved by {-1e3 * level:.3f} mm: zero at the nominal rolling circle")
    smoothed = y is not work.y
    return Profile(
        work.name,
        kind,
        y,
        z - level,
        work.file,
        inclination,
        tuple(work.notes),
        measured=np.stack((work.y, work.z - level)) if smoothed else None,
    )


def _to_metres(work: Points, kind: Kind) -> None:
    """Convert to metres, from the file's unit or from the size."""
    unit = work.unit
    width = float(np.ptp(work.y))
    sizes = (0.060, 0.220) if kind == "wheel" else (0.030, 0.250)

    def fits(scale: float) -> bool:
        return sizes[0] <= width * scale <= sizes[1]

    names = {1e-3: "millimetres", 1.0: "metres"}
    if unit is None or not fits(unit):
        by_width = next((scale for scale in names if fits(scale)), None)
        if by_width is None:
            found = f"width {width:g}, neither millimetres nor metres"
            found = found if unit is None else f"{1e3 * width * unit:.4g} mm wide"
            remedy = f"a {kind} is {1e3 * sizes[0]:.0f} to {1e3 * sizes[1]:.0f} mm wide"
            raise work.fail(found, remedy)
        taken = names[by_width]
        words = f"taken as {taken} by its width"
        if unit is not None:
            said = names.get(unit, f"{unit:g} m")
            words = f"the file says {said}, its width says {taken}: taken as {taken}"
        work.notes.append(words)
        unit = by_width
    work.y, work.z = work.y * unit, work.z * unit


def _distances(work: Points) -> Floats:
    return np.hypot(np.diff(work.y), np.diff(work.z))


def _remove_double_points(work: Points) -> None:
    distances = _distances(work)
    apart = distances[distances > 1e-9]
    # the rounding of numbers makes any slope between points that nearly coincide
    nearest = max(1e-9, min(NEAREST, 0.1 * float(np.median(apart)))) if apart.size else 1e-9
    double = np.concatenate(([False], distances < nearest))
    if double.any():
        work.notes.append(f"{int(double.sum())} double points left out")
        work.keep(~double)
    if work.y.size < FEWEST_POINTS:
        raise work.fail(f"{work.y.size} different points", f"{FEWEST_POINTS} or more are needed")


def _bring_into_order(work: Points) -> None:
    """Sort points by y if that, and not the file's order, makes a contour."""
    in_file = _distances(work)
    order = np.argsort(work.y, kind="stable")
    if np.sum(in_file) > 3.0 * (np.ptp(work.y) + np.ptp(work.z)):
        sorted_length = np.sum(np.hypot(np.diff(work.y[order]), np.diff(work.z[order])))
        if sorted_length > 0.5 * np.sum(in_file):
            at = int(np.argmax(in_file))
            raise work.fail(
                "the points are not in the order of a contour", "list them along the contour", at
            )
        work.keep(order)
        work.notes.append("points were not in order: sorted by y")
        _remove_double_points(work)


def _remove_outliers(work: Points) -> None:
    """Leave out single points that stand off the contour through their neighbours."""
    removed: list[int] = []
    most = max(work.y.size // 50, 1)
    for _ in range(most + 1):
        at = _spike(work.y, work.z)
        if at is None:
            at = _small_outlier(work.y, work.z)
        if at is None:
            break
        removed.append(int(work.line[at]))
        if len(removed) > most:
            found = f"{len(removed)} or more points stand off the contour, the last in this line"
            raise work.fail(found, "mend the measurement", at)
        work.keep(np.arange(work.y.size) != at)
    if removed:
        lines = ", ".join(str(line) for line in sorted(removed)[:8])
        work.notes.append(f"{len(removed)} outliers left out (line {lines})")


def _spike(y: Floats, z: Floats) -> int | None:
    """Index of the point that stands off the line through its neighbours most, if it is a spike."""
    chord = np.hypot(y[2:] - y[:-2], z[2:] - z[:-2])
    area = np.abs((y[2:] - y[:-2]) * (z[1:-1] - z[:-2]) - (z[2:] - z[:-2]) * (y[1:-1] - y[:-2]))
    height = area / np.maximum(chord, 1e-9)
    usual = np.median(height) + 1e-6
    spike = (height > STEP) & (height > 30.0 * usual) & (height > 0.6 * chord)
    # an outlier stands off more than its neighbours do
    padded = np.concatenate(([0.0], height, [0.0]))
    spike &= (height >= padded[:-2]) & (height >= padded[2:])
    return int(np.argmax(np.where(spike, height, 0.0))) + 1 if spike.any() else None


def _small_outlier(y: Floats, z: Floats) -> int | None:
    """Index of a point that stands off the cubic through its neighbours far beyond the noise.

    Without an outlier its neighbours fit each other, without a point of an edge they do not.
    """

    def off(part: Any) -> Floats:
        s = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(y[part]), np.diff(z[part])))))
        return np.hypot(departures(s, y[part]), departures(s, z[part]))

    every = off(slice(None))
    least = max(SMALLEST_OUTLIER, 20.0 * float(np.median(every)))
    for at in np.argsort(every)[: -MOST_TRIED - 1 : -1] + 2:
        if every[at - 2] < least:
            break
        around = np.arange(max(at - 6, 0), min(at + 7, y.size))
        width = np.hypot(y[at + 2] - y[at - 2], z[at + 2] - z[at - 2])
        if width < WIDEST and off(around[around != at]).max() < 0.2 * every[at - 2]:
            return int(at)
    return None


def _check_holes(work: Points) -> None:
    distance = _distances(work)
    at = int(np.argmax(distance))
    if distance[at] > LARGEST_HOLE:
        words = f"a hole of {1e3 * distance[at]:.1f} mm after this point"
        found = f"{words}, at y = {1e3 * work.y[at]:.1f} mm"
        allowed = f"neighbouring points may be {1e3 * LARGEST_HOLE:.0f} mm apart"
        raise work.fail(found, f"{allowed}; measure again or cut the profile there", at)


def _orient_wheel(work: Points) -> None:
    """Flange to negative y, z outwards from the axle; refuse what has no flange."""
    candidates = []
    for sign in (1.0, -1.0):
        z = sign * work.z
        tip = int(np.argmax(z))
        lateral = (work.y[tip] - work.y.min()) / np.ptp(work.y)
        for side, share in ((1.0, lateral), (-1.0, 1.0 - lateral)):
            inward = side * (work.y - work.y[tip])
            beyond, tread = inward < 0.0, (inward > 0.045) & (inward < 0.100)
            if share > 0.45 or tread.sum() < 3:
                continue
            level = float(np.median(z[tread]))
            height = float(z[tip] - level)
            width = float(np.ptp(work.y[tread]))
            # behind a flange's tip the contour turns back; a rail's flank just ends
            back = float(z[tip] - z[beyond].min()) if beyond.any() else 0.0
            flat = float(np.median(np.abs(z[tread] - level)))
            if (
                FLANGE_HEIGHTS[0] < height < FLANGE_HEIGHTS[1]
                and width >= TREAD_WIDTH - 0.01
                and back > 0.3e-3
                and flat < 0.35 * height
            ):
                candidates.append((flat / height, sign, side))
    if not candidates:
        # whose contour falls on both sides, or on one side without turning back
        tops, width = work.y[[np.argmin(work.z), np.argmax(work.z)]], np.ptp(work.y)
        rail_like = width < 0.095 and (np.abs(tops - work.y[0]) > 0.05 * width).any()
        hint = "it looks like a rail" if rail_like else "no flange with a tread beside it"
        raise work.fail(
            f"not a wheel profile: {hint}",
            "a wheel has a flange 15 to 50 mm high, round at its tip, and 30 mm or more of tread",
        )
    _, sign, side = min(candidates)
    if sign < 0:
        work.z = -work.z
        work.notes.append("z pointed to the axle: turned")
    if side < 0:
        work.y = -work.y
        work.notes.append("flange at positive y: mirrored")
    _flange_side_first(work)


def _flange_side_first(work: Points) -> None:
    """Contour from the flange (gauge) side to the field side."""
    if work.y[0] > work.y[-1]:
        work.keep(np.arange(work.y.size)[::-1])


def _shift_wheel(work: Points) -> None:
    """Origin at the nominal rolling circle; from the flange back where the file has it there."""
    tip = int(np.argmax(work.z))
    before = work.y[: tip + 1]
    back = float(before.min())
    has_back = _steep_back(before, work.z[: tip + 1])
    tip_y = float(work.y[tip])
    if not has_back and not -0.066 < tip_y < -0.045:
        raise work.fail(
            f"the flange's tip lies at y = {1e3 * tip_y:.1f} mm and the flange back is missing",
            "give y from the nominal rolling circle: flange back at -70 mm, tip near -55 mm",
        )
    shift = FLANGE_BACK - back
    if has_back and abs(shift) > BACK_TOLERANCE:
        work.y = work.y + shift
        work.notes.append(
            f"origin moved by {1e3 * shift:.2f} mm to the nominal rolling circle, "
            "70 mm from the flange back"
        )
    if not work.y.min() < -0.02 < 0.02 < work.y.max():
        raise work.fail(
            f"covers y from {1e3 * work.y.min():.1f} to {1e3 * work.y.max():.1f} mm only",
            "the tread is needed from the flange to 20 mm outside of the nominal rolling circle",
        )


def _steep_back(y: Floats, z: Floats) -> bool:
    """Whether the contour before the flange's tip reaches the flange back.

    It does where it falls 5 mm behind the tip and is steeper than 1:7 to the vertical over 1 mm,
    so that noise between close points does not feign it; the arc of 20.5 mm between the tip and
    the back of EN 13715 is then 0.2 mm from the back.
    """
    s = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))))
    even = np.arange(0.0, s[-1], 1e-3)
    dy, dz = np.diff(np.interp(even, s, y)), np.diff(np.interp(even, s, z))
    return bool((np.abs(dz) > 7.0 * np.abs(dy)).any() and z[-1] - z.min() > 5e-3)


def _function_part(y: Floats, z: Floats) -> tuple[Floats, Floats]:
    """Run of increasing y around the outermost point near the nominal rolling circle, y = 0."""
    near = np.flatnonzero(np.abs(y) < 5e-3)
    start = int(near[np.argmax(z[near])]) if near.size else int(np.argmin(np.abs(y)))
    first = last = start
    while first > 0 and y[first - 1] < y[first]:
        first -= 1
    while last < y.size - 1 and y[last + 1] > y[last]:
        last += 1
    return y[first : last + 1], z[first : last + 1]


def _orient_rail(work: Points) -> float:
    """Crown up (z down), gauge side at negative y; inclination that the points carry."""
    widths = []
    for sign in (1.0, -1.0):
        z = sign * work.z
        middle = 0.5 * (z[1:] + z[:-1])
        widths.append(float(np.sum(np.abs(np.diff(work.y))[middle < z.min() + 3e-3])))
    if widths[1] > widths[0]:
        work.z = -work.z
        work.notes.append("z pointed upwards: turned")
    work.z = work.z - work.z.min()
    _flange_side_first(work)
    top = int(np.argmin(work.z))
    for part in (work.z[top:], work.z[top::-1]):
        back = float(np.max(np.maximum.accumulate(part) - part)) if part.size else 0.0
        if back > 1e-3:
            raise work.fail(
                f"not a rail profile: the contour rises again by {1e3 * back:.1f} mm beside the "
                "crown, like a wheel's flange",
                "a rail falls on both sides; cut a grooved rail at the bottom of its groove",
            )
    if max(widths) < 0.015:
        found = f"the crown is only {1e3 * max(widths):.1f} mm wide"
        raise work.fail(found, "this is not a rail head")
    depth = (float(work.z[: top + 1].max()), float(work.z[top:].max()))
    inclination = _flank_inclination(work) if min(depth) > GAUGE_SIDE_DEPTH + 6e-3 else None
    mirror = False
    if min(depth) < GAUGE_SIDE_DEPTH <= max(depth):
        mirror = depth[1] > depth[0]
        why = "the deeper side is the gauge side"
    elif max(depth) < GAUGE_SIDE_DEPTH:
        raise work.fail(
            f"the contour ends {1e3 * max(depth):.1f} mm below the crown",
            f"the gauge side is needed down to {1e3 * GAUGE_SIDE_DEPTH:.0f} mm, where gauge is "
            "measured",
        )
    elif inclination is not None and inclination < -UPRIGHT:
        mirror, why = True, "a rail leans to the gauge side"
    if mirror:
        work.y = -work.y
        _flange_side_first(work)
        work.notes.append(f"gauge side at positive y: mirrored ({why})")
    if inclination is None:
        work.notes.append("cannot tell from the head alone whether inclined: taken as upright")
        return 0.0
    inclination = abs(inclination)
    if inclination < UPRIGHT:
        return 0.0
    standards = np.array(STANDARD_INCLINATIONS)
    nearest = float(standards[np.argmin(np.abs(standards - inclination))])
    if abs(nearest - inclination) < 3e-3:
        inclination = nearest
    work.notes.append(f"already inclined, 1:{1.0 / inclination:.0f}; that of the track counts")
    return float(inclination)


def _flank_inclination(work: Points) -> float | None:
    """Lean of the head's middle line between both flanks, gauge side positive [1].

    Side wear shifts the middle line too, and leans it by half of the worn face's slope. Where the
    flanks together are less steep than unworn ones, or the turned head is not symmetric to the
    line, the lean is not the rail's (unless it is a usual one between flanks of some 1:20), and a
    note says so.
    """
    top = int(np.argmin(work.z))
    lower = min(float(work.z[: top + 1].max()), float(work.z[top:].max()))
    depths = np.linspace(GAUGE_SIDE_DEPTH + 3e-3, min(lower, 0.032), 12)
    if depths[-1] - depths[0] < 3e-3:
        return None
    chords = _chords(work.y, work.z, depths)
    if chords is None:
        return None
    middle = chords.mean(axis=0)
    slope, offset = np.polyfit(depths, middle, 1)
    if np.max(np.abs(middle - slope * depths - offset)) > 0.2e-3:
        return None  # the flanks are not straight: worn, or not a flat-bottom rail
    growth = 0.5 * float(np.polyfit(depths, chords[1] - chords[0], 1)[0])
    angle = np.arctan(slope)
    y = work.y * np.cos(angle) - work.z * np.sin(angle)
    z = work.y * np.sin(angle) + work.z * np.cos(angle)
    upper = _chords(y, z - z.min(), np.linspace(3e-3, 9e-3, 7))
    skew = float((upper.mean(axis=0) - offset * np.cos(angle)).mean()) if upper is not None else 0.0
    if abs(skew) < LARGEST_SKEW and growth < STEEP_FLANK:
        return float(slope)
    work.notes.append("one side of the head is worn: the gauge side is taken at negative y")
    usual = np.min(np.abs(np.array((0.0, *STANDARD_INCLINATIONS)) - abs(slope))) < 3e-3
    return float(slope) if usual and 0.04 < growth < 0.062 else None


def _chords(y: Floats, z: Floats, depths: Floats) -> Floats | None:
    """Left and right ends of the chords at depths below the top, float64[2, n]."""
    top = int(np.argmin(z))
    ends = []
    for depth in depths:
        inner = int(np.flatnonzero(z[: top + 1] <= depth)[0])
        outer = top + int(np.flatnonzero(z[top:] <= depth)[-1])
        if inner == 0 or outer == y.size - 1:
            return None
        pairs = slice(inner, inner - 2 if inner > 1 else None, -1), slice(outer, outer + 2)
        ends.append([np.interp(depth, z[pair], y[pair]) for pair in pairs])
    return np.array(ends).T


def _check_steps(work: Points, kind: Kind) -> None:
    """Refuse vertical steps where wheel and rail touch."""
    dy, dz = np.diff(work.y), np.diff(work.z)
    angle = np.abs(np.degrees(np.arctan2(np.abs(dz), dy)))
    used = used_part(work.y, work.z, kind)
    for i in np.flatnonzero(used & (np.abs(dz) > STEP) & (angle > 60.0)):
        before = angle[max(i - 3, 0) : i]
        after = angle[i + 1 : i + 4]
        if before.size and after.size and max(np.median(before), np.median(after)) < 45.0:
            words = f"a vertical step of {1e3 * abs(dz[i]):.2f} mm after this point"
            found = f"{words}, at y = {1e3 * work.y[i]:.1f} mm"
            remedy = "wheel and rail profiles are continuous; mend the measurement"
            raise work.fail(found, remedy, int(i))


def _check_overhang(work: Points, kind: Kind, y: Floats, z: Floats) -> None:
    """Refuse a contour that runs back where wheel and rail touch.

    A rail may be worn to a vertical or overhanging face: no wheel reaches what lies below its edge.
    """
    used, dy = used_part(y, z, kind), np.diff(y)
    back = dy <= 0.0
    if kind == "rail":
        back |= np.abs(np.diff(z)) > np.tan(np.radians(80.0)) * dy
        top = int(np.argmin(z))
        for side, after, face in (
            ("gauge", slice(0, top), np.flatnonzero(back[:top])[-1:]),
            ("field", slice(top, None), top + np.flatnonzero(back[top:])[:1]),
        ):
            depth = min(z[face[0]], z[face[0] + 1]) if face.size else 0.0
            if depth > HIGHEST_FACE:
                back[after] = False
                if depth < DEEPEST_FACE:
                    words = f"{side} face vertical or nearly so from {1e3 * depth:.1f} mm down"
                    work.notes.append(words)
    overhang = np.flatnonzero(used & back)
    if overhang.size:
        at = int(overhang[0])
        found = f"the contour runs back at y = {1e3 * y[at]:.1f} mm"
        raise work.fail(found, "a profile may not overhang where wheel and rail touch", at)
