"""The built-in profiles, generated from their definitions.

Nothing is copied from tables of points: each profile is the chain of polynomials, arcs and lines
that its source states, sampled densely enough (0.05 mm) for cubic interpolation to 1e-8 m.
"""

from collections.abc import Callable
from functools import cache, partial

import numpy as np

from railsim.arrays import Floats
from railsim.profiles.profile import Profile

Height = Callable[[Floats], Floats]

SPACING = 0.05
"""Distance of the points along the contour [mm]."""

S1002_OUTER = (1.364323640, -0.066666667)
S1002_FLANK_END = -39.764473993
S1002_FLANK = (-93.576667419, -2.747477419)
S1002_ARC = (-58.558326413, 8.834924130, 20.0)  # centre and radius of the section F
S1002_TREAD = (
    0.0,
    -3.358537058e-2,
    1.565681624e-3,
    -2.810427944e-5,
    5.844240864e-8,
    -1.562379023e-8,
    5.309217349e-15,
    -5.957839843e-12,
    2.646656573e-13,
)
S1002_ROOT = (
    -4.320221063e3,
    -1.038384026e3,
    -1.065501873e2,
    -6.051367875,
    -2.054332446e-1,
    -4.169739389e-3,
    -4.687195829e-5,
    -2.252755540e-7,
)


def _circle(centre_y: float, centre_z: float, radius: float) -> Height:
    """Arc above its centre, of a negative radius below it."""

    def height(y: Floats) -> Floats:
        half = np.sqrt(np.maximum(radius**2 - (y - centre_y) ** 2, 0.0))
        return np.asarray(centre_z + np.copysign(half, radius))

    return height


def _polynomial(coefficients: tuple[float, ...]) -> Height:
    return lambda y: np.asarray(np.polynomial.polynomial.polyval(y, coefficients))


S1002_SECTIONS: dict[str, tuple[float, Height]] = {
    # name of the section in EN 13715: upper end [mm], height
    "H": (-62.764705882, _circle(-49.5, 9.519259302, 20.5)),
    "G": (-49.662510381, _circle(-55.0, 16.0, 12.0)),
    "F": (S1002_FLANK_END, _circle(*S1002_ARC)),
    "E": (-38.426669071, _polynomial(S1002_FLANK)),
    "D": (-35.0, _circle(-26.210665, 16.446, -13.0)),
    "C": (-26.0, _polynomial(S1002_ROOT)),
    "B": (32.15796, _polynomial(S1002_TREAD)),
    "A": (60.0, _polynomial(S1002_OUTER)),
}


def s1002_height(y: Floats) -> Floats:
    """Height of the S1002 contour [mm] at the lateral position y [mm], flange at negative y.

    Source: EN 13715, wheel profile S1002 (also UIC 510-2), sections A to H, from -70 mm on.  The
    standard's polynomials join with steps of 1.2e-4 mm at -35 mm and 4e-5 mm at -26 mm.
    """
    ends, heights = zip(*S1002_SECTIONS.values(), strict=True)
    index, z = np.searchsorted(ends[:-1], y, side="right"), np.empty(np.shape(y))
    for k, height in enumerate(heights):
        z[index == k] = height(y[index == k])
    return z


def even_points(y: Floats, z: Floats, spacing: float) -> Floats:
    """Lateral positions at about equal distances along the contour through the given points."""
    length = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))))
    n = max(int(np.ceil(length[-1] / spacing)), 1)
    positions: Floats = np.interp(np.linspace(0.0, length[-1], n + 1), length, y)
    return positions


def _wheel(name: str, height: Height, source: str) -> Profile:
    """Wheel profile of a contour from -70 to 60 mm [mm]."""
    # finely pre-sampled so that the distances along the nearly vertical flange back are right
    fine = -70.0 + 130.0 * np.linspace(0.0, 1.0, 400_001) ** 1.5
    y = even_points(fine, height(fine), SPACING)
    return Profile(name, "wheel", 1e-3 * y, 1e-3 * height(y), source)


def s1002() -> Profile:
    """Wheel profile S1002 of EN 13715, flange 32.5 mm thick and 28 mm high."""
    return _wheel("S1002", s1002_height, "EN 13715, profile S1002")


HOLLOW_DEPTH, HOLLOW_HALF = 0.9, 35.0
"""Depth of the hollow and half its width [mm]."""


def s1002_hollow() -> Profile:
    """S1002 with a hollow tread: a construction that stands for a worn wheel, not a measurement.

    The tread is lower by 0.9 mm cos^2(pi y/70 mm) within 35 mm of the nominal rolling circle, so
    that its slope outside it remains continuous.  On 60E1 rails inclined by 1:40 the equivalent
    conicity for 3 mm grows from 0.18 to 0.46.
    """
    new = s1002()
    share = np.clip(1e3 * new.y / HOLLOW_HALF, -1.0, 1.0)
    # a slope of at most 2 % leaves the spacing of the points as it is
    z = new.z - 1e-3 * HOLLOW_DEPTH * np.cos(0.5 * np.pi * share) ** 2
    words = "S1002 with a constructed hollow of 0.9 mm in the tread"
    return Profile("S1002_hollow", "wheel", new.y, z, words)


def cone(taper: float) -> Profile:
    """Straight cone with the flange of S1002.

    The tread is a cone of the given taper; flank, tip and back are those of S1002, the fillet of
    13 mm between them is tangent to both, as S1002's own; of a cone steeper than 0.24 to the arc
    below the flank.

    `taper`: taper, 0.05 for 1:20 [1].
    """
    radius, (level, slope) = 13.0, S1002_FLANK
    # centre of the fillet: its radius away from cone and flank, on the rail's side
    lines = np.array([[taper, 1.0], [-slope, 1.0]])
    right_side = np.array([0.0, level]) + radius * np.hypot(lines[:, 0], 1.0)
    centre_y, centre_z = np.linalg.solve(lines, right_side)
    end = centre_y + radius * slope / np.hypot(slope, 1.0)
    if end < S1002_FLANK_END:  # of a steep cone the fillet meets the arc F below the flank
        (arc_y, arc_z, arc_radius), apart = S1002_ARC, S1002_ARC[2] + radius
        above = radius * np.hypot(taper, 1.0) - arc_z
        b, c = arc_y + taper * above, arc_y**2 + above**2 - apart**2
        root = np.sqrt(max(b**2 - (1.0 + taper**2) * c, 0.0))
        centre_y = (b + root) / (1.0 + taper**2)
        centre_z = radius * np.hypot(taper, 1.0) - taper * centre_y
        end = arc_y + arc_radius / apart * (centre_y - arc_y)
    start = centre_y - radius * taper / np.hypot(taper, 1.0)

    fillet = _circle(float(centre_y), float(centre_z), -radius)

    def height(y: Floats) -> Floats:
        # S1002's own fillet ends farther down: its flank goes on along the same line
        flange = np.where(y > S1002_FLANK_END, level + slope * y, s1002_height(y))
        return np.where(y > start, -taper * y, np.where(y > end, fillet(y), flange))

    ratio = f"1:{float(f'{1.0 / taper:.3g}'):g}"  # 1:3.33, 1:1000
    source = f"cone of {ratio}, flank, tip and back of S1002, fillet of 13 mm"
    return _wheel(f"cone {ratio}", height, source)


FLANK_DEPTH = 38.0
"""Depth below the crown to which the flank of a rail is drawn [mm]."""


def arc_chain_rail(
    half_widths: tuple[float, ...], radii: tuple[float, ...], flank_slope: float = 0.05
) -> tuple[Floats, Floats]:
    """Rail head of tangent arcs and a straight flank, symmetric about its axis.

    `half_widths`: distances from the axis at which each arc but the last meets the next one [mm];
    `radii`: radii from the crown to the gauge corner [mm]; `flank_slope`: flank's inclination to
    the vertical [1]. Returns: `y, z` (shape (n,)): contour from the left flank to the right one, z
    down from the crown [mm].
    """
    angles, centre = [0.0], [(0.0, radii[0])]
    for i, half_width in enumerate(half_widths):
        angle = float(np.arcsin((half_width - centre[i][0]) / radii[i]))
        # the next centre lies on the normal through the joint
        offset = radii[i] - radii[i + 1]
        centre.append(
            (centre[i][0] + offset * np.sin(angle), centre[i][1] - offset * np.cos(angle))
        )
        angles.append(angle)
    angles.append(float(np.arctan2(1.0, flank_slope)))
    y_parts, z_parts = [], []
    for i, radius in enumerate(radii):
        n = max(int(np.ceil(radius * (angles[i + 1] - angles[i]) / SPACING)), 1)
        angle_points = np.linspace(angles[i], angles[i + 1], n + 1)[(1 if i else 0) :]
        y_parts.append(centre[i][0] + radius * np.sin(angle_points))
        z_parts.append(centre[i][1] - radius * np.cos(angle_points))
    y_end, z_end = y_parts[-1][-1], z_parts[-1][-1]
    n = int(np.ceil((FLANK_DEPTH - z_end) / SPACING))
    z_flank = np.linspace(z_end, FLANK_DEPTH, n + 1)[1:]
    y_parts.append(y_end + flank_slope * (z_flank - z_end))
    z_parts.append(z_flank)
    y, z = np.concatenate(y_parts), np.concatenate(z_parts)
    return np.concatenate((-y[:0:-1], y)), np.concatenate((z[:0:-1], z))


RAIL_HEADS: dict[str, tuple[tuple[float, ...], tuple[float, ...], float]] = {
    # joints [mm] as halves of the widths in EN 13674-1, radii [mm], flank's slope
    "60E1": ((20.456 / 2, 52.053 / 2), (300.0, 80.0, 13.0), 1 / 20),
    "60E2": ((23.778 / 2, 48.913 / 2, 70.774 / 2), (200.0, 70.0, 16.0, 8.0), 1 / 20),
    "54E1": ((20.024 / 2, 49.727 / 2), (300.0, 80.0, 13.0), 1 / 20),
    "49E1": ((15.267 / 2, 46.835 / 2), (300.0, 80.0, 13.0), 1 / 17.2),
}
"""Rail heads of EN 13674-1:2017.

The numbers are those of the standard as the open package EN13674 (A. Rohrbeck, 2022) gives them,
whose tests demand that all elements join tangentially.  Second evidence, which the tests repeat:
each chain closes on the head's width of the standard without using it.
"""


def en_rail(name: str) -> Profile:
    """Rail of EN 13674-1, upright: a name of `RAIL_HEADS`."""
    half_widths, radii, flank = RAIL_HEADS[name]
    y, z = arc_chain_rail(half_widths, radii, flank)
    chain = "/".join(f"{radius:.0f}" for radius in radii)
    return Profile(
        name, "rail", 1e-3 * y, 1e-3 * z, f"EN 13674-1, profile {name}, tangent arcs {chain} mm"
    )


def rail_benchmark() -> Profile:
    """The Manchester contact benchmark's UIC 60 rail, canted 1:40, from its arcs."""
    y, z = arc_chain_rail((10.49979, 25.98803), (300.0, 80.0, 13.0))
    angle = np.arctan(1.0 / 40.0)
    y_turned = y * np.cos(angle) + z * np.sin(angle)
    z_turned = -y * np.sin(angle) + z * np.cos(angle)
    return Profile(
        "benchmark",
        "rail",
        1e-3 * y_turned,
        1e-3 * (z_turned - z_turned.min()),
        "Manchester contact benchmark, UIC 60 as an arc chain 300/80/13 mm "
        "with half-widths 10.49979 and 25.98803 mm, canted by atan(1/40)",
        inclination=1.0 / 40.0,
    )


DEFINITIONS: dict[str, Callable[[], Profile]] = {
    "S1002": s1002,
    "S1002_hollow": s1002_hollow,
    "cone_1in20": partial(cone, 1 / 20),
    "cone_1in40": partial(cone, 1 / 40),
    **{name: partial(en_rail, name) for name in RAIL_HEADS},
    "benchmark": rail_benchmark,
}


@cache
def builtin_profile(name: str) -> Profile:
    """Built-in profile by its name, a key of `DEFINITIONS`."""
    return DEFINITIONS[name]()
