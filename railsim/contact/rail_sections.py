"""Rails whose section changes along the track: crossings, blades, noses.

**Parts.**  A section is cut at its grooves into the rails that stand side by side, such as wing and
nose; the parts of neighbouring sections that overlap are one rail.  A rail begins at the first
section that has it, so that a nose that appears is a nose and not a ramp.

**Blending.**  Between sections points at equal shares of the flank before the running edge, where
the contour stands at 60 degrees, are joined, and behind it points at equal shares of the way from
there to y = 75 mm, by cubics along s whose slopes at the sections are those of parabolas through
three neighbours: smooth in s; a running edge goes aside as an edge, and a top stays where it is.

**The slope along the rail.**  A wheel rolls over x before and behind its axle; where the rail rises
it touches ahead.  Its surface is that of circles, lower by x^2/2r ahead of the axle than under it,
so that the wheel stands on the rail as on one of the section

    z_e(Y; s) = min over x of z(s + x, Y) + r - sqrt(r^2 - x^2),

with the patch x ahead of the axle: dz_e/ds is the rail's slope there, and the normal passes through
the axle.  For a rolling radius that differs from r by the depth of a flange, 6 %, z_e is too high
or low by 6 % of x^2/2r, some micrometres.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railsim.arrays import Floats
from railsim.contact import curves
from railsim.definitions.section_files import SectionList

DEEP = 8e-3  # m, of a groove between two rails
TOP = 5e-3  # m below its highest point in which a rail is recognised in the next section
TURN = np.radians(60.0)  # of the contour at its running edge
FLANK = 60  # points of the contour before the running edge
FAR, ABSENT = 0.075, 0.05  # m, lateral position up to which a rail is followed; its z beyond
ACROSS = 1e-4  # m, distance of the points
JUMP = 0.01  # m between neighbouring sections
WINDOW = 0.06  # m ahead of and behind the axle that is searched
STEP = 1e-3  # m, of the search
NOWHERE = 1.0  # m, height of a rail where it is not
AHEAD = STEP * np.arange(-round(WINDOW / STEP), round(WINDOW / STEP) + 1)


@dataclass(frozen=True, eq=False)
class RailPart:
    """One rail of the sections, as points of equal share over s."""

    positions: Floats  # arc lengths of its sections, shape (n,) [m]
    contours: Floats  # y and z of the points, shape (n, 2, k) [m]
    sections: tuple[Floats, ...]  # y and z of the sections as they were given, shape (2, k) [m]

    @cached_property
    def _slopes(self) -> Floats:
        h = np.diff(self.positions)[:, None, None]
        step = np.diff(self.contours, axis=0)
        secant = np.where(np.abs(step) > JUMP, 0.0, step) / h  # to where a section has ended
        slopes = np.concatenate([secant[:1], secant, secant[-1:]])[1:]
        share = h[:-1] / (h[:-1] + h[1:])
        slopes[1:-1] = (1.0 - share) * secant[:-1] + share * secant[1:]
        slopes[0] = secant[0]
        return np.asarray(slopes)

    def contour(self, s: float) -> Floats:
        """Points y, z of its contour at an arc length within its ends [m]."""
        last = self.positions.size - 2
        i = int(np.clip(np.searchsorted(self.positions, s, "right") - 1, 0, last))
        h = self.positions[i + 1] - self.positions[i]
        u = (s - self.positions[i]) / h
        return cubic(u, h, [*self.contours[i : i + 2]], [*self._slopes[i : i + 2]])

    def height(self, s: float, Y: Floats) -> Floats:
        """Height below the rail tops at lateral positions, inf where the rail is not [m]."""
        if not self.positions[0] <= s <= self.positions[-1]:
            return np.full(Y.shape, np.inf)
        y, z = self.contour(s)
        return np.interp(Y, *_seen_from_above(y, z), left=np.inf, right=np.inf)

    def heights_ahead(self, s: float, Y: Floats) -> Floats:
        """Heights before and behind an arc length, at `AHEAD` of it, float64[ahead, Y] [m]."""
        return np.array([self.height(s + ahead, Y) for ahead in AHEAD])

    def constant_section(self, s: float) -> Floats | None:
        """Points of its sections as given where they do not change around `s`, else None."""
        first = int(np.searchsorted(self.positions, s - WINDOW, "right")) - 1
        last = int(np.searchsorted(self.positions, s + WINDOW, "left"))
        if first < 0 or last >= self.positions.size:
            return None
        around = self.sections[max(first - 1, 0) : last + 2]
        same = all(np.array_equal(points, around[0]) for points in around)
        return around[0] if same else None


def cubic(
    u: Floats | float, h: float, values: Sequence[Floats], slopes: Sequence[Floats]
) -> Floats:
    """Hermite's cubic at the shares `u` of a distance h, by values and slopes at both ends."""
    rest = 1.0 - u
    return np.asarray(
        (1.0 + 2.0 * u) * rest**2 * values[0]
        + u**2 * (3.0 - 2.0 * u) * values[1]
        + h * u * rest * (rest * slopes[0] - u * slopes[1])
    )


def _seen_from_above(y: Floats, z: Floats) -> tuple[Floats, Floats]:
    """The part of a contour that is seen from above, to both sides of its top."""
    top = int(np.argmin(z))
    right = y >= np.maximum.accumulate(np.where(np.arange(y.size) >= top, y, -np.inf))
    left = y <= np.minimum.accumulate(np.where(np.arange(y.size) <= top, y, np.inf)[::-1])[::-1]
    seen = np.where(np.arange(y.size) >= top, right, left)
    y, z = y[seen], z[seen]
    keep = np.append(True, np.diff(y) > 0.0)
    return y[keep], z[keep]


def rail_parts(sections: SectionList) -> tuple[RailPart, ...]:
    """Cut sections into rails and join those that belong together.

    Returns rails of two sections at least, in the order of their begins.
    """
    chains: list[tuple[list[float], list[Floats]]] = []
    open_chains: list[int] = []
    for s, points in zip(sections.positions.tolist(), sections.points, strict=True):
        continued = []
        for part in _split_at_grooves(points):
            low, high = _top_range(part)
            best, overlap = -1, 0.0
            for k in open_chains:
                before = _top_range(chains[k][1][-1])
                shared = min(high, before[1]) - max(low, before[0])
                if k not in continued and shared > overlap:
                    best, overlap = k, shared
            if best < 0:
                chains.append(([], []))
                best = len(chains) - 1
            chains[best][0].append(s)
            chains[best][1].append(part)
            continued.append(best)
        open_chains = continued
    return tuple(
        RailPart(
            np.array(positions), np.array([_contour_points(part) for part in parts]), tuple(parts)
        )
        for positions, parts in chains
        if len(positions) > 1
    )


def _top_range(part: Floats) -> tuple[float, float]:
    top = part[0][part[1] < part[1].min() + TOP]
    return float(top.min()), float(top.max())


def _split_at_grooves(points: Floats) -> list[Floats]:
    """Cut a contour where a groove lies between two rails."""
    z = points[1]
    left = np.minimum.accumulate(z)
    right = np.minimum.accumulate(z[::-1])[::-1]
    depth = z - np.maximum(left, right)
    deepest = int(np.argmax(depth))
    if depth[deepest] <= DEEP:
        return [points]
    return _split_at_grooves(points[:, : deepest + 1]) + _split_at_grooves(points[:, deepest:])


def _contour_points(part: Floats) -> Floats:
    """Points of a contour at equal shares before its running edge, and from there to `FAR`."""
    from scipy.interpolate import Akima1DInterpolator

    length = np.append(0.0, np.cumsum(np.hypot(*np.diff(part))))
    angle = np.arctan2(-np.diff(part[1]), np.diff(part[0]))
    middle, top = 0.5 * (length[1:] + length[:-1]), length[int(np.argmin(part[1]))]
    rising = np.flatnonzero((angle > TURN) & (middle < top))
    edge = length[rising[-1] + 1] if rising.size else 0.0
    keep = np.append(True, np.diff(length) > 1e-7)
    spline = Akima1DInterpolator(length[keep], part[:, keep], axis=1)
    flank = np.asarray(spline(np.linspace(0.0, edge, FLANK, endpoint=False)))
    y, z = np.asarray(spline(np.arange(edge, length[-1], 0.5 * ACROSS)))
    places = y[0] + (FAR - y[0]) * np.linspace(0.0, 1.0, round(0.11 / ACROSS))
    behind = np.interp(places, *_seen_from_above(y, z), right=ABSENT)
    return np.concatenate([flank, [places, behind]], axis=1)


def _envelope(heights: Floats, radius: float) -> tuple[Floats, Floats]:
    """Section on which a wheel of some radius stands on a rail, of the rail's heights at `AHEAD`.

    Its heights below the rail tops, and how far ahead of the axle they are [m].
    """
    heights = heights + (radius - np.sqrt(radius**2 - AHEAD**2))[:, None]
    best = np.argmin(heights, axis=0)
    columns = np.arange(heights.shape[1])
    inner = np.clip(best, 1, AHEAD.size - 2)
    a, b, c = (heights[inner + k, columns] for k in (-1, 0, 1))
    known = np.isfinite(a) & np.isfinite(b) & np.isfinite(c) & (best == inner)
    a, b, c = (np.where(known, value, 0.0) for value in (a, b, c))
    bend = a - 2.0 * b + c
    offset = np.where(bend > 0.0, 0.5 * (a - c) / np.where(bend > 0.0, bend, 1.0), 0.0)
    offset = np.clip(offset, -0.5, 0.5)
    z = heights[best, columns] - 0.25 * (a - c) * offset
    return z, AHEAD[best] + STEP * offset


def envelope_curve(part: RailPart, s: float, radius: float, zero: float = 0.75) -> curves.RailCurve:
    """Return the section of a rail on which a wheel stands as the contact search takes it.

    In the frame of the right rail in the track, whose y = 0 lies `zero` beside its middle [m].
    Where the rail does not change it is the section as given.
    """
    given = part.constant_section(s)
    if given is not None:
        return curves.contour_curve(given[0] + zero, given[1])
    y, _ = part.contour(float(np.clip(s, part.positions[0], part.positions[-1])))
    Y = np.arange(y.min() - 2e-3, y.max() + 2e-3, 5.0 * curves.RAIL_SPACING)
    z, _ = _envelope(part.heights_ahead(s, Y), radius)
    known = np.isfinite(z)
    Y, z = Y[known], z[known]
    usable = curves.single_valued_part(Y, z, int(np.argmin(z)), curves.STEEPEST)
    Y, z = Y[usable][:-1], z[usable][:-1]
    from scipy.interpolate import make_smoothing_spline

    spline = make_smoothing_spline(1e3 * Y, 1e3 * z, lam=1e-4)
    nodes = np.arange(Y[0], Y[-1], curves.RAIL_SPACING)
    slope = spline.derivative()(1e3 * nodes)
    slope[0], slope[-1] = -curves.STEEPEST, curves.STEEPEST  # walls, or where the section ends
    return curves.RailCurve(
        Y0=float(nodes[0]) + zero,
        dY=curves.RAIL_SPACING,
        z=1e-3 * spline(1e3 * nodes),
        slope=slope,
        curvature=curves.averaged_curvature(nodes, slope, 1.0),
    )


def rigid_gaps(
    part: RailPart, s: Floats, radius: float, wheels: Sequence[tuple[Floats, Floats]], y: Floats
) -> Floats:
    """Heights at which parts of a wheel touch one rail, neither deforming.

    `part`: rail; `s`, shape (n_s,): positions of the axle, a whole number of `STEP` apart [m];
    `radius`: nominal rolling radius [m]; `wheels`, shape (n,): lateral position from the nominal
    rolling circle, and radius, of each part of the wheel [m]; `y`, shape (n_y,): lateral positions
    of the nominal rolling circle from y = 0 of the rails [m]. Returns shape (n_s, n_wheels, n_y),
    height of the wheel below that on a level rail at the tops [m]; `NOWHERE` without contact.
    """
    present = [(k, u, r) for k, (u, r) in enumerate(wheels) if u.size]
    low, high = min(u[0] for _, u, _ in present), max(u[-1] for _, u, _ in present)
    Y = np.arange(low + y.min(), high + y.max() + ACROSS, ACROSS)
    every, reach = round((s[1] - s[0]) / STEP), AHEAD.size // 2
    along = s[0] + STEP * np.arange(-reach, every * s.size + reach)
    heights = np.array([part.height(at, Y) for at in along])
    gaps = np.full((s.size, len(wheels), y.size), NOWHERE)
    for i in range(s.size):
        around = heights[every * i : every * i + AHEAD.size]
        z = np.minimum(_envelope(around, radius)[0], NOWHERE)
        for k, u, r in present:
            for j, aside in enumerate(y):
                gaps[i, k, j] = (np.interp(u + aside, Y, z) - r).min() + radius
    return np.asarray(np.minimum(gaps, NOWHERE))


def kinematic_height(
    parts: tuple[RailPart, ...], s: float, wheel: tuple[Floats, Floats], radius: float, y: float
) -> tuple[float, float, int]:
    """Height at which a wheel stands on rails without deforming them.

    `parts`: rails; `s`, `y`: position of the axle, and of the wheel's nominal rolling circle from y
    = 0 [m]; `wheel`: lateral position from the nominal rolling circle, and radius [m]; `radius`:
    nominal rolling radius [m]. Returns height of the wheel below that on a level rail at the tops
    [m], contact ahead of the axle [m], and which rail carries it.
    """
    best = (np.inf, 0.0, -1)
    for number, part in enumerate(parts):
        z, ahead = _envelope(part.heights_ahead(s, wheel[0] + y), radius)
        gap = z - (wheel[1] - radius)
        k = int(np.argmin(gap))
        if gap[k] < best[0]:
            best = float(gap[k]), float(ahead[k]), number
    return best
