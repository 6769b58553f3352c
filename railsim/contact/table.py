"""The contact table: what the time integration needs to know of a wheel on a rail.

Over the lateral displacement, roll and squared yaw of the wheelset, for each of three patches
(tread, flange root, flange), the table holds the height g at which the patch touches and two
stiffnesses, of the potential

    U(y, z, roll, yaw) = 2/5 K e^(5/2) + 1/3 K2 e^3,   e = z - g,

whose gradient through the interpolating spline is the normal force, hence conservative whatever the
table holds; and position, direction and unit-load ellipse of the patch as functions of the load.

Elastic contact of a zone.  With the vertical gap h(u) of rail and wheel over the position u along
the axle, L = (1/cos(gamma_rail) + 1/cos(gamma_wheel))/2, the wheel is pressed down to z.  Bodies
approach each other along the normal by theta as a whole, and the rest v = z - h - theta L of the
overlap is taken by a foundation along the contour (Winkler; Johnson, Contact Mechanics (1985),
4.3) of the stiffness k:

    N = k integral v du,   N_z = k integral v/L du,   theta = kappa N^(2/3),
    U = k/2 integral v^2/L du + 2/5 kappa N^(5/3).

The lateral force is the pressure's mean of the rail's slope: the undeformed gap is averaged over
the elastic patch, which grows with the load, and no softness is chosen.  Where the contact is an
ellipse of the half relative curvatures A and B, with Hertz' unit-load semi-axis b1 and approach d1,
the foundation's patch is as wide in proportion to it as

    k = max(1.2 E*, 0.58 k_H),   k_H = 3/(4 B b1^3)   (a smooth maximum of the fourth power)

gives (k_H would make it exactly as wide), and kappa = d1 - B^(1/3) (3/(4 k))^(2/3) makes the whole
approach Hertz'.  1.2 is the one number that was fitted: to the lateral stiffness that boundary
elements give (docs/validation/contact_geometry.md); B is averaged over the ellipse's width.  g, K
and K2 are those that give the energies under three loads.

Zones.  A contact on the border of two zones is shared: the integrals of N_z and U, and the means
below, carry the zone's window, and the three windows add up to one.

Patch.  Position, direction and ellipse at the three loads are the pressure's means and that of
the parabola that the foundation would take for the patch, B = (4 k/(3 N))^2 v_max^3.  Between the
loads each is v + dv N/(N + 35 kN).

Interpolation: uniform cubic B-splines in s and roll, linear in w = yaw^2, where

    s = y - shear * roll

is the lateral displacement of the wheel's foot: roll turns the wheelset about its centre and moves
the foot sideways by 0.46 mm per milliradian, so that in (y, roll) every feature of the contact
would run diagonally through the table and be smeared over several nodes.  The roll's nodes lie
close together near the middle (`railsim.kernels.contact_table.stretched_roll`): a milliradian moves
the contact within the tread by millimetres.  The coefficients are c = f - f''/6 (second
difference), which gives back cubic functions and smears nothing to fourth order (de Boor, A
Practical Guide to Splines (1978), chapter XII).

Frame: right wheel and rail, track axes (x forward, y right, z down), forces and positions from
the wheelset's centre.  The left wheel is the mirror image (y and roll change sign); where left and
right differ in profile or radius a second table is built for the left, as a right one.
"""

import functools
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from railsim.arrays import Floats
from railsim.contact import curves
from railsim.contact.zones import table_range, zone_windows
from railsim.errors import Faults
from railsim.kernels import table_slice as kernel
from railsim.kernels.contact_table import A1, B1, D_B1, FINE_ROLL, K2, N_FIELD, K, stretched_roll
from railsim.kernels.hertz import unit_load_ellipse
from railsim.profiles.profile import Profile

FORMAT = "railsim-contact-table/2"
PATCHES = ("tread", "flange root", "flange")


Normal = Literal["hertz", "kik-piotrowski"]


@dataclass(frozen=True)
class TableGrid:
    """Extent and fineness of a contact table.

    - `s_min`, `s_max`: range of the sheared lateral displacement [m]; default `table_range`
    - `ds`: its spacing [m]
    - `roll_max`, `droll`: largest roll, both ways, and the spacing of its stretched coordinate,
      which is the roll's own near the middle and four times as much at 20 mrad [rad]
    - `yaw_max`: largest yaw [rad]; beyond, the table is continued linearly in w = yaw^2
    - `n_w`: number of nodes of w, from 0 to yaw_max^2, see `yaw_nodes`
    - `spacing`: distance of the candidates on the wheel's tread, at most `ds`: with nodes that lie
      closer than the candidates the sums over the patch ripple from node to node [m]
    - `reference`: load of the ellipse over which curvatures are averaged [N]
    - `floor_ratio`: half relative curvature across is kept above about this share of that along [1]
    - `normal`: patch as the ellipse of the foundation's patch, or the non-elliptic patch under each
      of the three loads, replaced by an ellipse of its area and proportions
    """

    s_min: float | None = None
    s_max: float | None = None
    ds: float = 1e-4
    roll_max: float = 0.030
    droll: float = 0.75e-3
    yaw_max: float = 0.060
    n_w: int = 17
    spacing: float = 1e-4
    reference: float = 60e3
    floor_ratio: float = 0.02
    normal: Normal = "hertz"


@dataclass(frozen=True, eq=False)
class ContactTable:
    """Contact of a right wheel on a right rail, see the module's text.

    Attributes
    ----------
    values : ndarray, shape (n_patch, n_w, n_roll, n_y, n_field)
        Spline coefficients; fields 0 g [m], 1 K [N/m^1.5], 2 K2 [N/m^2], 3 a1 [m/N^(1/3)], 4 c_y,
        5 c_z [m], 6 b1 [m/N^(1/3)], 7 tan of the contact angle [1]; 8 to 11 their differences
        between no and endless load, those of 4 to 7.
    y0, dy : float
        First node and spacing of s = y - shear * roll [m].
    roll0, droll : float
        First node and spacing of the stretched roll, see `stretched_roll` [rad].
    w : ndarray, shape (n_w,)
        Nodes of w = yaw^2, from 0 [rad^2].
    shear : float
        Lever that turns roll into lateral displacement of the wheel's foot [m].
    r0 : float
        Rolling radius at the nominal rolling circle [m].
    centre_height : float
        Height of the wheelset's centre above the rail tops at z = 0 [m].
    G, nu : float
        Shear modulus [Pa] and Poisson's ratio [1] of wheel and rail.
    description : dict
        What the table was built from, for results and messages.
    """

    values: Floats
    y0: float
    dy: float
    roll0: float
    droll: float
    w: Floats
    shear: float
    r0: float
    centre_height: float
    G: float
    nu: float
    description: dict[str, object] = field(default_factory=dict)


@functools.cache
def ellipse_functions(G: float, nu: float) -> kernel.Hertz:
    """Unit-load ellipses over ln(A/B), for the generator; linear interpolation is within 2e-6."""
    E_star = G / (1.0 - nu)
    x = np.linspace(-14.0, 14.0, 2801)
    rows = np.log([unit_load_ellipse(1.0, np.exp(-value), E_star) for value in x]).T
    rows[1] -= rows[0]
    return kernel.Hertz(float(x[0]), float(x[1] - x[0]), np.ascontiguousarray(rows))


@functools.cache
def strip_influence() -> kernel.Strips:
    """Influences for the non-elliptic patch, as logarithms over a logarithm.

    - `start`, `spacing`: grid of the logarithms of q and of b/a
    - `strip`: ln J(q), J(q) = integral_-1^1 sqrt(1 - t^2)/sqrt(t^2 + q^2) dt: a strip with a
      semi-elliptic load at the distance q of its half length.  With t = q sinh(v) the integrand has
      no peak.
    - `whole`: ln of integral_-1^1 sqrt(1 - t^2) J(|t| (b/a)/sqrt(1 - t^2)) dt: all strips of an
      ellipse
    """
    x = np.linspace(-12.0, 4.0, 801)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    q = np.exp(x)[:, None]
    end = np.arcsinh(1.0 / q)
    # v = end sin(w) takes away the square root at the ends
    w = 0.25 * np.pi * (nodes + 1.0)
    v = end * np.sin(w)
    values = np.sqrt(np.maximum(1.0 - (q * np.sinh(v)) ** 2, 0.0)) * end * np.cos(w)
    J = 2.0 * np.sum(values * weights, axis=1) * 0.25 * np.pi
    # over an ellipse: t = sin(angle), with nodes drawn to the middle where J is singular
    u = 0.5 * (nodes + 1.0)
    angle = 0.5 * np.pi * u**3
    distance = np.log(np.exp(x)[:, None] * np.tan(angle))
    inner = np.exp(np.interp(distance, x, np.log(J), left=np.nan, right=np.nan))
    # beyond the grid: 2 ln(4/q) - 2 close by, pi/(2 q) far away
    inner = np.where(distance < x[0], 4.0 * np.log(2.0) - 2.0 * distance - 2.0, inner)
    inner = np.where(distance > x[-1], 0.5 * np.pi * np.exp(-distance), inner)
    jacobian = np.cos(angle) ** 2 * 0.5 * np.pi * 3.0 * u**2 * 0.5
    whole = 2.0 * np.sum(weights * jacobian * inner, axis=1)
    return kernel.Strips(float(x[0]), float(x[1] - x[0]), np.log(J), np.log(whole))


def build_contact_table(
    wheel: Profile,
    rail: Profile,
    radius: float = 0.46,
    gauge: float = 1.435,
    inclination: float = 0.025,
    back_to_back: float = 1.360,
    tape_circle_distance: float = 1.5,
    G: float = 82e9,
    nu: float = 0.28,
    *,
    centre_height: float | None = None,
    normal: Normal | None = None,
    grid: TableGrid | None = None,
    widening: float = 0.0,
    workers: int | None = None,
) -> ContactTable:
    """Build the contact table of a right wheel on a right rail.

    Parameters
    ----------
    wheel, rail : Profile
        Profiles.
    radius : float
        Rolling radius at the nominal rolling circle [m].
    gauge : float
        Distance of the gauge faces within 14 mm below the rail tops [m].
    inclination : float
        Inclination of the rails, as tangent [1].
    back_to_back : float
        Distance of the flange backs; it places the wheels on the axle [m].
    tape_circle_distance : float
        Distance of the nominal rolling circles by name [m]; recorded only.
    G, nu : float
        Shear modulus [Pa] and Poisson's ratio [1].
    centre_height : float, optional
        Height of the wheelset's centre above the rail tops at z = 0; default `radius` [m].
    normal : "hertz" or "kik-piotrowski", optional
        Kind of normal contact; default that of `grid`.
    grid : TableGrid, optional
        Extent and fineness.
    widening : float
        Largest widening of the gauge on the track, by which the other wheel goes further inwards
        before this one has climbed its rail [m].
    workers : int, optional
        Threads; default as many as there are cores.

    Returns
    -------
    ContactTable

    Raises
    ------
    InputError
        If the wheelset does not fit into the track, or a profile cannot be used.
    """
    grid = complete_grid(grid, normal)
    height = radius if centre_height is None else centre_height
    wheel_points = curves.wheel_curve(
        wheel, radius, curves.tape_circle_position(back_to_back), min(grid.spacing, grid.ds)
    )
    rail_nodes = curves.rail_curve(rail, gauge, inclination)
    pair = f"{wheel.name} on {rail.name}"
    Faults(curves.misfits(wheel_points, rail_nodes, gauge, pair)).check()
    default_range = table_range(wheel_points, rail_nodes, widening)
    s_min = default_range[0] if grid.s_min is None else grid.s_min
    s_max = default_range[1] if grid.s_max is None else grid.s_max
    n_y = round((s_max - s_min) / grid.ds) + 1
    # a cubic spline needs two nodes to each side of the middle
    half = max(int(np.ceil(stretched_roll(grid.roll_max)[0] / grid.droll)), 2)
    stretched_nodes = grid.droll * np.arange(-half, half + 1, dtype=np.float64)
    roll_nodes = roll_from_stretched(stretched_nodes)
    s_nodes = s_min + grid.ds * np.arange(n_y, dtype=np.float64)
    w_nodes = yaw_nodes(grid)
    generator = Generator(wheel_points, rail_nodes, radius, height, G, nu, grid)
    values = generator.values(rail_nodes, s_nodes, roll_nodes, w_nodes, workers or os.cpu_count())
    values = spline_coefficients(values, stretched_nodes)
    # as from the cache: the time loop is compiled once, not for both kinds of arrays
    values.setflags(write=False)
    description = {
        "format": FORMAT,
        "wheel": wheel.name,
        "rail": rail.name,
        "radius": radius,
        "gauge": gauge,
        "inclination": inclination,
        "back_to_back": back_to_back,
        "tape_circle_distance": tape_circle_distance,
    }
    return ContactTable(
        values=values,
        y0=s_min,
        dy=grid.ds,
        roll0=float(stretched_nodes[0]),
        droll=grid.droll,
        w=w_nodes,
        shear=radius,
        r0=radius,
        centre_height=height,
        G=G,
        nu=nu,
        description=description,
    )


def complete_grid(grid: TableGrid | None, normal: Normal | None) -> TableGrid:
    """Return the grid of a table, with another normal contact if requested."""
    grid = grid or TableGrid()
    return replace(grid, normal=normal) if normal else grid


class Generator:
    """A wheel with its zones, and what its contact with any rail is computed with.

    `wheel`, `rail`: the wheel, and the rail that decides about its zones; `radius`, `height`:
    rolling radius; height of the wheelset's centre above the rail tops at z = 0 [m].
    """

    def __init__(
        self,
        wheel: curves.WheelCurve,
        rail: curves.RailCurve,
        radius: float,
        height: float,
        G: float,
        nu: float,
        grid: TableGrid,
    ) -> None:
        self._radius, self._height = radius, height
        self._wheel = _wheel_arrays(wheel, rail)
        elliptic = grid.normal == "hertz"
        self._laws = (
            kernel.Elastic(
                G / (1.0 - nu), curves.HALF_WIDTHS, grid.reference, grid.floor_ratio, not elliptic
            ),
            ellipse_functions(G, nu),
            strip_influence(),
        )

    def values(
        self, rail: curves.RailCurve, s: Floats, roll: Floats, w: Floats, workers: int | None
    ) -> Floats:
        """Fields of the three patches on a rail, shape (3, w.size, roll.size, s.size, N_FIELD)."""
        values = np.empty((3, w.size, roll.size, s.size, N_FIELD))
        nodes = kernel.Rail(rail.Y0, rail.dY, rail.z, rail.slope, rail.curvature)

        def fill(task: tuple[int, int]) -> None:
            i_w, i_roll = task
            part = np.empty((3, s.size, N_FIELD))
            y, yaw = s + self._radius * roll[i_roll], float(np.sqrt(w[i_w]))
            pose = y, roll[i_roll], yaw, self._height
            kernel.fill_table_slice(part, *pose, self._wheel, nodes, *self._laws)
            values[:, i_w, i_roll] = part

        tasks = [(i_w, i_roll) for i_w in range(w.size) for i_roll in range(roll.size)]
        fill(tasks[0])  # compile once, not in every thread
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(fill, tasks[1:]))
        # a zone of a single candidate, at the end of the contour, has no width to carry anything
        values[~np.isfinite(values).all(axis=-1)] = NOTHING
        return values


NOTHING = np.array([1.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 0.0, 0.0])
"""Fields of a zone that never touches."""


def _wheel_arrays(wheel: curves.WheelCurve, rail: curves.RailCurve) -> kernel.Wheel:
    """A wheel as the generator takes it, with its zones."""
    window = zone_windows(wheel, rail)
    present = window > 1e-6
    # what touches with the zone's edge only has a share too small to feel, but a position
    window = np.where(present, np.maximum(window, 1e-6), 0.0)
    first = np.array([int(np.argmax(row)) for row in present])
    last = np.array([row.size - int(np.argmax(row[::-1])) for row in present])
    last[~present.any(axis=1)] = 0  # no such zone
    return kernel.Wheel(wheel.u, wheel.r, wheel.t, wheel.curvature, window, first, last)


def yaw_nodes(grid: TableGrid) -> Floats:
    """Nodes of w = yaw^2 [rad^2]: half of the cells up to 28 of 60 mrad, a quarter up to 40.

    Vehicles yaw by less in the tightest curves; more is the tangent of a rail with a sharp kink.
    """
    share = np.linspace(0.0, 1.0, grid.n_w)
    nodes: Floats = grid.yaw_max**2 * np.interp(
        share, (0.0, 0.5, 0.75, 1.0), (0.0, 2 / 9, 4 / 9, 1.0)
    )
    return nodes


def roll_from_stretched(stretched: Floats) -> Floats:
    """Roll of which `railsim.kernels.contact_table.stretched_roll` makes the given values [rad]."""
    # q = x^2/sqrt(1 + x^2) with x = roll/FINE_ROLL: x^4 - q^2 x^2 - q^2 = 0
    q = (stretched / FINE_ROLL) ** 2
    roll: Floats = np.sign(stretched) * FINE_ROLL * np.sqrt(0.5 * q * (q + np.sqrt(q * q + 4.0)))
    return roll


def spline_coefficients(values: Floats, stretched: Floats) -> Floats:
    """Coefficients of the splines over s and roll that give back cubic functions of both.

    Over the roll only near the middle: farther out, where the nodes lie too far apart to follow the
    contact from one to the next, a spline through the values would swing; there they are the
    coefficients themselves.  Stiffnesses and axes are kept from falling below nothing.

    `values`, shape (n_patch, n_w, n_roll, n_y, n_field): values at the nodes; those at the ends of
    an axis are taken as they are; `stretched`, shape (n_roll,): stretched roll of the nodes [rad].
    """
    result = values.copy()
    near = 1.0 / (1.0 + (stretched / FINE_ROLL) ** 4)
    for k in np.ndindex(values.shape[:2]):  # part by part, which the processor holds at hand
        _to_coefficients(result[k], values[k], near[1:-1, None, None])
    return result


def _to_coefficients(result: Floats, values: Floats, near: Floats) -> None:
    """The same of one patch and yaw, in place; `near`: share over the roll, of the inner nodes."""
    for axis, share in ((0, near), (1, 1.0)):
        source = np.moveaxis(result, axis, 0)
        second = source[2:] - 2.0 * source[1:-1] + source[:-2]
        source[1:-1] -= share * second / 6.0
    np.maximum(result[..., A1], 0.5 * values[..., A1], out=result[..., A1])
    np.maximum(result[..., B1], 0.5 * values[..., B1], out=result[..., B1])
    endless = 0.5 * (values[..., B1] + values[..., D_B1])
    np.maximum(result[..., D_B1], endless - result[..., B1], out=result[..., D_B1])
    # K and K + K2 sqrt(e) at e = 0.1 mm
    low = np.zeros(values.shape[:-1], dtype=bool)
    for root in (0.0, 0.01):
        before = values[..., K] + root * values[..., K2]
        low |= result[..., K] + root * result[..., K2] < 0.2 * before
    for stiffness in (K, K2):
        result[low, stiffness] = values[low, stiffness]
