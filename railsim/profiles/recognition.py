"""From the points of a file to a profile: recognise, report, correct or refuse.

What can be recognised from the shape alone is corrected with a note: millimetres instead of metres,
points out of order, z up instead of down, mirrored, origin at the flange back, a rail that is
already inclined, duplicate points, single outliers, measuring noise.  What cannot be recognised is
refused with the line and a remedy: gaps, vertical steps, a rail given as wheel, too few points.

The shape of a wheel: a tread at least 30 mm wide and a flange, the highest point of the contour
seen from the rail, within its first half and round (the contour turns back behind it).  The shape
of a rail: a crown from which the contour only falls, 14 mm or more on the gauge side.
"""

import numpy as np

from railsim.arrays import Floats
from railsim.profiles.profile import FLANGE_BACK, Kind, Profile
from railsim.profiles.readers import Points
from railsim.profiles.smoothing import smoothed_points, used_part

FEWEST_POINTS = 20
LARGEST_HOLE = 0.006
"""Largest distance of neighbouring points [m]: across it a curve of 13 mm radius departs by
0.35 mm from its chord, which cubic interpolation still brings down to some 5 um."""

STEP = 0.3e-3
"""Smallest vertical step that is not taken for a steep slope [m]."""

FLANGE_HEIGHTS = (0.015, 0.050)
TREAD_WIDTH = 0.030
GAUGE_SIDE_DEPTH = 0.0140
STANDARD_INCLINATIONS = (1 / 20, 1 / 30, 1 / 40)
UPRIGHT = 4e-3
"""Lean that measuring noise and wear may feign [1]."""


def recognised_profile(work: Points, kind: Kind | None = None) -> Profile:
    """Turn a file's points into a profile.

    `work`: what the file holds; is changed; `kind`: what it is used as; None goes by the file.
    Returns: with a note on every correction. Raises InputError: if it is not a usable profile of
    that kind.
    """
    kind = kind or work.kind
    if kind is None:
        kind = "wheel" if _looks_like_wheel(work) else "rail"
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
    level = float(np.interp(0.0, *_function_part(y, z)) if kind == "wheel" else z.min())
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


def _looks_like_wheel(work: Points) -> bool:
    """Guess for files that do not say: wheels are more than 95 mm wide, rail heads less."""
    width = np.ptp(work.y) if work.y.size else 0.0
    scale = work.unit or (1e-3 if width > 1.0 else 1.0)
    return bool(width * scale > 0.095)


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
    double = np.concatenate(([False], _distances(work) < 1e-9))
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
    """Leave out single points that stand off the line through their neighbours."""
    removed: list[int] = []
    for _ in range(max(work.y.size // 50, 1) + 1):
        y, z = work.y, work.z
        chord = np.hypot(y[2:] - y[:-2], z[2:] - z[:-2])
        area = np.abs((y[2:] - y[:-2]) * (z[1:-1] - z[:-2]) - (z[2:] - z[:-2]) * (y[1:-1] - y[:-2]))
        height = area / np.maximum(chord, 1e-9)
        usual = np.median(height) + 1e-6
        spike = (height > STEP) & (height > 30.0 * usual) & (height > 0.6 * chord)
        # an outlier stands off more than its neighbours do
        padded = np.concatenate(([0.0], height, [0.0]))
        spike &= (height >= padded[:-2]) & (height >= padded[2:])
        if not spike.any():
            break
        at = int(np.argmax(np.where(spike, height, 0.0))) + 1
        removed.append(int(work.line[at]))
        if len(removed) > max(work.y.size // 50, 1):
            found = f"{len(removed)} or more points stand off the contour, the last in this line"
            raise work.fail(found, "mend the measurement", at)
        work.keep(np.arange(work.y.size) != at)
    if removed:
        lines = ", ".join(str(line) for line in sorted(removed)[:8])
        work.notes.append(f"{len(removed)} outliers left out (line {lines})")


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
        hint = "it looks like a rail" if _rail_like(work) else "no flange with a tread beside it"
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


def _rail_like(work: Points) -> bool:
    """Whether the contour falls on both sides, or on one side without turning back."""
    for z in (work.z, -work.z):
        top = int(np.argmin(z))
        if 0.05 * np.ptp(work.y) < abs(work.y[top] - work.y[0]) and np.ptp(work.y) < 0.095:
            return True
    return False


def _shift_wheel(work: Points) -> None:
    """Origin at the nominal rolling circle; from the flange back where the file has it there."""
    tip = int(np.argmax(work.z))
    before = work.y[: tip + 1]
    back = float(before.min())
    slope_back = np.abs(np.diff(work.z[: tip + 1])) > 5.0 * np.abs(np.diff(before))
    has_back = bool(slope_back.any()) and float(work.z[tip] - work.z[: tip + 1].min()) > 5e-3
    tip_y = float(work.y[tip])
    if not -0.066 < tip_y < -0.045:
        if not has_back:
            raise work.fail(
                f"the flange's tip lies at y = {1e3 * tip_y:.1f} mm and the flange back is missing",
                "give y from the nominal rolling circle: flange back at -70 mm, tip near -55 mm",
            )
        shift = FLANGE_BACK - back
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
    y, z = _function_part(work.y, work.z)
    level = float(np.interp(0.0, y, z))
    if abs(level) > 1e-5:
        work.notes.append(f"z moved by {-1e3 * level:.3f} mm: zero at the nominal rolling circle")
    work.z = work.z - level


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
                "a rail falls on both sides",
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
    work.notes.append(f"already inclined, 1:{1.0 / inclination:.0f}")
    return float(inclination)


def _flank_inclination(work: Points) -> float | None:
    """Lean of the head's middle line between both flanks, gauge side positive [1]."""
    top = int(np.argmin(work.z))
    lower = min(float(work.z[: top + 1].max()), float(work.z[top:].max()))
    depths = np.linspace(GAUGE_SIDE_DEPTH + 3e-3, min(lower, 0.032), 12)
    if depths[-1] - depths[0] < 3e-3:
        return None
    left, right = [], []
    for depth in depths:
        inner = int(np.flatnonzero(work.z[: top + 1] <= depth)[0])
        outer = top + int(np.flatnonzero(work.z[top:] <= depth)[-1])
        if inner == 0 or outer == work.y.size - 1:
            return None
        left.append(_crossing(work, inner - 1, inner, depth))
        right.append(_crossing(work, outer, outer + 1, depth))
    middle = 0.5 * (np.array(left) + np.array(right))
    slope, offset = np.polyfit(depths, middle, 1)
    if np.max(np.abs(middle - slope * depths - offset)) > 0.2e-3:
        return None  # the flanks are not straight: worn, or not a flat-bottom rail
    return float(slope)


def _crossing(work: Points, i: int, j: int, depth: float) -> float:
    share = (depth - work.z[i]) / (work.z[j] - work.z[i])
    return float(work.y[i] + share * (work.y[j] - work.y[i]))


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
    """Refuse a contour that runs back where wheel and rail touch."""
    overhang = np.flatnonzero(used_part(y, z, kind) & (np.diff(y) <= 0.0))
    if overhang.size:
        at = int(overhang[0])
        found = f"the contour runs back at y = {1e3 * y[at]:.1f} mm"
        raise work.fail(found, "a profile may not overhang where wheel and rail touch", at)
