"""Normal contact of real profiles by boundary elements, the check of the contact table.

The contact surface follows the rail: s is the length along its contour, x along the track, and the
gap is measured along the rail's normal at each s, exactly between the profiles (no curvatures).
Each element of the half-space carries constant pressure; all patches of the wheel are solved for
at once and interact.  Left out: friction, yaw, and the difference between a curved contact
surface and a half-space (it matters in the flange root, where the normal turns over the patch).
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from railsim.arrays import Floats, stretches
from railsim.contact.curves import (
    RailCurve,
    WheelCurve,
    misfits,
    rail_curve,
    tape_circle_position,
    wheel_curve,
)
from railsim.contact.elastic import Patch
from railsim.errors import Faults, ModelError
from railsim.kernels import normal_contact as kernel
from railsim.profiles.profile import Profile

CANDIDATE_SPACING = 3e-5
LARGEST_OVERLAP = 1.5e-3
"""Overlap beyond which the search for a load is given up [m]."""


@dataclass(frozen=True, eq=False)
class ExactContact:
    """Contact of a right wheel on a right rail."""

    z: float  # vertical displacement of the wheelset's centre [m]
    penetration: float  # how far the wheel is below its first touch, vertically [m]
    patches: tuple[Patch, ...]  # from the flange to the tread
    x: Floats  # element centres along the track, shape (n_x,) [m]
    s: Floats  # and along the rail's contour, 0 at its top, shape (n_s,) [m]
    Y: Floats  # lateral position on the rail at `s`, track axes [m]
    pressure: Floats  # shape (n_x, n_s) [Pa]


def exact_contact(
    wheel: Profile,
    rail: Profile,
    y: float,
    roll: float = 0.0,
    load: float = 60e3,
    *,
    radius: float = 0.46,
    gauge: float = 1.435,
    inclination: float = 0.025,
    back_to_back: float = 1.360,
    G: float = 82e9,
    nu: float = 0.28,
    elements: int = 32,
) -> ExactContact:
    """Normal contact of a right wheel on its rail under a given vertical force.

    `wheel`, `rail`: profiles; `y`, `roll`: lateral displacement [m] and roll [rad] of the wheelset;
    `load`: vertical force of the wheel on the rail [N]; `radius`, `gauge`, `inclination`,
    `back_to_back`, `G`, `nu`: as `railsim.contact.build_contact_table`; `elements`: elements across
    the narrowest patch and half as many along its half length. Raises InputError: if the wheelset
    does not fit into the track. Raises ModelError: if the load is not reached or the solver does
    not converge.
    """
    points = wheel_curve(wheel, radius, tape_circle_position(back_to_back), CANDIDATE_SPACING)
    nodes = rail_curve(rail, gauge, inclination)
    Faults(misfits(points, nodes, gauge, f"{wheel.name} on {rail.name}")).check()
    geometry = _Geometry(points, nodes, y, roll, radius)
    E_star = G / (1.0 - nu)
    first = geometry.first_touch()

    # a coarse solution gives the height, which places the fine elements
    def excess(z: float, count: int) -> float:
        solution = geometry.solve(first + z, first, E_star, count)
        return sum(patch.N_z for patch in solution.patches) - load

    upper = 50e-6
    while excess(upper, 10) < 0.0:
        upper *= 1.5
        if upper > LARGEST_OVERLAP:
            raise ModelError(f"a vertical load of {1e-3 * load:.0f} kN is not reached")
    coarse = brentq(excess, 1e-7, upper, args=(10,), xtol=1e-9)
    fine = brentq(excess, 0.8 * coarse, 1.25 * coarse, args=(elements,), xtol=2e-9, rtol=1e-6)
    return geometry.solve(first + fine, first, E_star, elements)


class _Geometry:
    """Wheel and rail in the track's cross-section."""

    def __init__(
        self, points: WheelCurve, nodes: RailCurve, y: float, roll: float, radius: float
    ) -> None:
        cosine, sine = np.cos(roll), np.sin(roll)
        lateral = y + points.u * cosine - points.r * sine
        self.wheel = CubicSpline(lateral, points.u * sine + points.r * cosine - radius)
        self.wheel_range = (lateral[0], lateral[-1])
        self.radius = CubicSpline(lateral, points.r)
        self.Y, self.z, self.slope = nodes.Y, nodes.z, nodes.slope
        stretch = np.sqrt(1.0 + nodes.slope**2)
        length = np.concatenate(([0.0], np.cumsum(0.5 * (stretch[1:] + stretch[:-1]) * nodes.dY)))
        self.s = length - length[int(np.argmin(nodes.z))]
        self.rail = CubicSpline(self.s, np.stack((self.Y, self.z), axis=1))

    def first_touch(self) -> float:
        """Displacement at which the rigid wheel touches [m]."""
        first, last = self.wheel_range
        inside = (first < self.Y) & (last > self.Y)
        return float(np.min(self.z[inside] - self.wheel(self.Y[inside])))

    def normal_gap(self, s: Floats, z: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Gap along the rail's normal, lateral position [m], contact angle, wheel radius [m]."""
        points = self.rail(s)
        tangent = self.rail(s, 1)
        angle = np.arctan2(-tangent[:, 1], tangent[:, 0])
        sine, cosine = np.sin(angle), np.cos(angle)
        t = np.zeros(s.size)
        for _ in range(6):
            Y = np.clip(points[:, 0] - t * sine, *self.wheel_range)
            excess = points[:, 1] - t * cosine - self.wheel(Y) - z
            t += np.clip(excess / (cosine - self.wheel(Y, 1) * sine), -2e-3, 2e-3)
        first, last = self.wheel_range
        return np.where((first >= Y) | (last <= Y), 1.0, t), points[:, 0], angle, self.radius(Y)

    def solve(self, z: float, first: float, E_star: float, elements: int) -> ExactContact:
        """Solution at a given height."""
        s = np.arange(self.s[0] + 1e-3, self.s[-1] - 1e-3, 2.5e-5)
        overlap = self.normal_gap(s, z)[0] < 0.0
        if not overlap.any():
            nothing = np.zeros(0)
            return ExactContact(z, z - first, (), nothing, nothing, nothing, np.zeros((0, 0)))
        parts = stretches(overlap)
        first_point, last_point = parts[0][0], parts[-1][1]
        widths = [2.5e-5 * (end - begin) for begin, end in parts]
        # a contact that has only just formed must not set the size of all elements
        ds = max(min(widths) / elements, max(widths) / (3 * elements), 2e-5)
        n_s = int(np.ceil(2.5e-5 * (last_point - first_point) / ds)) + 2
        centre = s[first_point] - ds + ds * np.arange(n_s)
        gap, Y, angle, radius = self.normal_gap(centre, z)
        deepest = float(np.max(-gap * radius / np.cos(angle)))
        half_length = np.sqrt(2.0 * deepest)
        n_x = elements // 2
        dx = half_length / n_x
        x = dx * (np.arange(n_x) + 0.5)
        drop = radius[None, :] - np.sqrt(radius[None, :] ** 2 - x[:, None] ** 2)
        full = gap[None, :] + drop * np.cos(angle)[None, :]
        # under pressure the surfaces move apart only: contact lies within the overlap
        row, column = np.nonzero(full < 0.0)
        table = kernel.influence(2 * n_x + 1, n_s, dx, ds, E_star)
        p = np.full(row.size, 1e8)
        tolerance = 1e-6 * float(-full.min())
        order = np.argsort(column, kind="stable")
        row, column = row[order], column[order]
        status = kernel.pressure(full[row, column], column, row, table, max(tolerance, 1e-12), p)
        if status != kernel.CONVERGED:
            raise ModelError("the boundary-element solver did not converge")
        field = np.zeros((n_x, n_s))
        field[row, column] = p
        return ExactContact(
            z,
            z - first,
            self._patches(field, Y, angle, dx, ds),
            np.concatenate((-x[::-1], x)),
            centre,
            Y,
            np.concatenate((field[::-1], field)),
        )

    @staticmethod
    def _patches(
        field: Floats, Y: Floats, angle: Floats, dx: float, ds: float
    ) -> tuple[Patch, ...]:
        """Connected patches along s, with both halves."""
        patches = []
        for start, end in stretches(np.any(field, axis=0)):
            part = field[:, start:end]
            line = 2.0 * part.sum(axis=0) * dx * ds
            N_y = float(np.sum(line * np.sin(angle[start:end])))
            N_z = float(np.sum(line * np.cos(angle[start:end])))
            reaches = [_reach(column) for column in part.T]
            patches.append(
                Patch(
                    N=float(line.sum()),
                    N_z=N_z,
                    N_y=N_y,
                    y=float(np.sum(line * Y[start:end]) / line.sum()),
                    angle=float(np.arctan2(N_y, N_z)),
                    area=2.0 * ds * sum(reaches) * dx,
                    p_max=float(part.max()),
                    length=2.0 * dx * max(reaches),
                    width=ds * (_reach(part[0]) + _reach(part[0, ::-1]) - (end - start)),
                )
            )
        return tuple(patches)


def _reach(pressure: Floats) -> float:
    """Where a line of elements loses contact, in elements from its beginning.

    At an edge the square of the pressure falls linearly; it is continued from the last two loaded
    elements to zero, which removes most of the error of counting whole elements.
    """
    loaded = np.flatnonzero(pressure > 0.0)
    if loaded.size == 0:
        return 0.0
    last = int(loaded[-1])
    inner, outer = (pressure[last - 1] ** 2 if last else 0.0), pressure[last] ** 2
    beyond = min(outer / (inner - outer), 1.0) if inner > outer else 0.5
    return last + 0.5 + float(beyond)
