"""The contact table: what the time integration needs to know of a wheel on a rail.

Over the lateral displacement, roll and squared yaw of the wheelset, for each of three patches
(tread, flange root, flange), the table holds the height at which the patch touches, its stiffness,
place and unit-load Hertz ellipse.  The normal force is the gradient of the potential

    U(y, z, roll, yaw) = 2/5 K p^(5/2),   p = z - g,

through the interpolating spline, hence conservative whatever the table holds.

Interpolation: uniform cubic B-splines in s and roll with the stored values as coefficients, linear
in w = yaw^2, where

    s = y - shear * roll

is the lateral displacement of the wheel's foot: roll turns the wheelset about its centre and moves
the foot sideways by 0.46 mm per milliradian, so that in (y, roll) every feature of the contact
would run diagonally through the table and be smeared over several places.

Soft minimum.  Over the candidates u of a zone with window omega (the three windows add up to one)

    g = -eps ln( integral omega exp(-h/eps) du / l ),

whose derivative is exactly the weighted mean of the slope; every other field is the mean with the
same weights.  l makes g agree with the hard minimum in the zone's typical contact.  The zone's
share W = <omega> multiplies the stiffness: a contact on the border of two zones is shared, not
counted twice.

Place of contact under load.  Pressed down by p, wheel and rail overlap, and the patch lies where
the *normal* approach is greatest: between the points of rail and wheel with a common normal, p
sin(gamma) apart.  Both move along their profiles; to first order their middle is where

    h + delta_r L,   L = (1/cos(gamma_rail) + 1/cos(gamma_wheel))/2,

is least, with the approach delta_r = 80 um under some 60 kN.  The minimum is taken of this, delta_r
L is taken off g again, and p = delta L.  The common normal's angle follows from the rail's slope
there and its change over half the distance, tan(gamma) = -z' (1 + delta_r kappa (1 + z'^2)/2): on a
straight flank exactly the flank's.  At that approach it is the direction of the gradient of U where
the ellipse does not change.

Frame: right wheel and rail, track axes (x forward, y right, z down), forces and places relative to
the wheelset's centre.  The left wheel is the mirror image (y and roll change sign); where left and
right differ in profile or radius a second table is built for the left, as a right one.
"""

import functools
import hashlib
import json
import os
import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from railsim.contact.curves import (
    HALF_WIDTHS,
    WheelCurve,
    misfits,
    rail_curve,
    tape_circle_place,
    wheel_curve,
)
from railsim.errors import InputError
from railsim.kernels import cache
from railsim.kernels import contact_geometry as kernel
from railsim.kernels.hertz import unit_load_ellipse
from railsim.profiles.profile import Profile

Array = NDArray[np.float64]

FORMAT = "railsim-contact-table/1"
PATCHES = ("tread", "flange root", "flange")
FIELDS = ("g", "K", "c_y", "c_z", "c_x", "a1", "b1", "tan_gamma")


Normal = Literal["hertz", "kik-piotrowski"]


@dataclass(frozen=True)
class TableGrid:
    """Extent and fineness of a contact table.

    Attributes
    ----------
    s_min, s_max, ds : float
        Range and spacing of the sheared lateral displacement [m].
    roll_max, droll : float
        Largest roll, both ways, and its spacing [rad].
    yaw_max : float
        Largest yaw [rad].
    n_w : int
        Number of nodes of w = yaw^2, from 0 to yaw_max^2.
    eps : float
        Softness of the minimum [m].  Geometry is averaged over places whose gap differs by about
        this much, a tenth of the approach under a wheel's load: the middle third of the patch.
        A sharp minimum (3 um) lets the place of contact jump where the patch itself spreads, and
        a coach hunts with half a millimetre at any speed.
    load : float
        Wheel load for whose patch the curvatures are averaged [N].
    floor_ratio : float
        Half relative curvature across is kept above about this share of that along [1].
    approach : float
        Normal approach at which the place of contact is sought [m].
    normal : "hertz" or "kik-piotrowski"
        Stiffness and patch from the Hertz ellipse of the averaged curvatures, or from the
        non-elliptic patch at `approach`, replaced by an ellipse of its area and proportions.
    """

    s_min: float = -0.020
    s_max: float = 0.014
    ds: float = 5e-5
    roll_max: float = 0.030
    droll: float = 3.0e-3
    yaw_max: float = 0.040
    n_w: int = 17
    eps: float = 10.0e-6
    load: float = 60e3
    floor_ratio: float = 0.02
    approach: float = 80e-6
    normal: Normal = "hertz"


@dataclass(frozen=True, eq=False)
class ContactTable:
    """Contact of a right wheel on a right rail, see the module's text.

    Attributes
    ----------
    values : ndarray, shape (n_patch, n_w, n_roll, n_y, n_field)
        Spline coefficients; fields 0 g [m], 1 K [N/m^1.5], 2 c_y [m], 3 c_z [m], 4 c_x/yaw
        [m/rad], 5 a1, 6 b1 [m/N^(1/3)], 7 tan of the contact angle [1].
    y0, dy : float
        First node and spacing of s = y - shear * roll [m].
    roll0, droll : float
        First node and spacing of roll [rad].
    dw : float
        Spacing of w = yaw^2, from 0 [rad^2].
    shear : float
        Lever that turns roll into lateral displacement of the wheel's foot [m].
    r0 : float
        Rolling radius at the tape circle [m].
    centre_height : float
        Height of the wheelset's centre above the rail tops at z = 0 [m].
    G, nu : float
        Shear modulus [Pa] and Poisson's number [1] of wheel and rail.
    description : dict
        What the table was built from, for results and messages.
    """

    values: Array
    y0: float
    dy: float
    roll0: float
    droll: float
    dw: float
    shear: float
    r0: float
    centre_height: float
    G: float
    nu: float
    description: dict[str, object] = field(default_factory=dict)


def zone_windows(wheel: WheelCurve) -> Array:
    """Partition of a wheel's candidates into tread, flange root and flange.

    The borders lie where the profile's angle, followed from the tape circle towards the flange,
    passes 10 to 15 degrees (tread to root), and 70 to 90 % of the flank's greatest angle (root to
    flange); between these places the windows change by the smoothest cubic.

    Returns
    -------
    ndarray, shape (3, n)
        Windows adding up to 1 [1].
    """
    angle = np.degrees(np.arctan(-wheel.t))
    start = int(np.argmin(np.abs(wheel.y)))
    toward_flange = slice(start, None, -1)
    ahead, places = angle[toward_flange], wheel.y[toward_flange]
    steepest = float(ahead.max())

    def passes(limit: float) -> float:
        beyond = np.flatnonzero(ahead > limit)
        return float(places[beyond[0]]) if beyond.size else float(places[-1])

    def beyond(begin: float, end: float) -> Array:
        """0 on the tread side of `begin`, 1 on the flange side of `end`."""
        width = max(begin - end, 1e-4)
        x = np.clip((begin - wheel.y) / width, 0.0, 1.0)
        share: Array = x * x * (3.0 - 2.0 * x)
        return share

    root = beyond(passes(10.0), passes(15.0))
    flange = beyond(passes(0.7 * steepest), passes(0.9 * steepest))
    flange = np.minimum(flange, root)
    return np.stack((1.0 - root, root - flange, flange))


@functools.cache
def ellipse_functions(G: float, nu: float) -> tuple[float, float, Array]:
    """Unit-load ellipses over ln(A/B), for the generator: start, spacing and logarithms.

    Rows: a1 A^(1/3), b/a, d1 A^(-1/3).  Linear interpolation is within 2e-6.
    """
    E_star = G / (1.0 - nu)
    x = np.linspace(-14.0, 14.0, 2801)
    rows = np.log([unit_load_ellipse(1.0, np.exp(-value), E_star) for value in x]).T
    rows[1] -= rows[0]
    return float(x[0]), float(x[1] - x[0]), np.ascontiguousarray(rows)


@functools.cache
def strip_influence() -> tuple[float, float, Array, Array]:
    """Influences for the non-elliptic patch, as logarithms over a logarithm.

    Returns
    -------
    start, spacing : float
        Grid of the logarithms of q and of b/a.
    strip : ndarray, shape (n,)
        ln J(q), J(q) = integral_-1^1 sqrt(1 - t^2)/sqrt(t^2 + q^2) dt: a strip with a
        semi-elliptic load at the distance q of its half length.  With t = q sinh(v) the integrand
        has no peak.
    whole : ndarray, shape (n,)
        ln of integral_-1^1 sqrt(1 - t^2) J(|t| (b/a)/sqrt(1 - t^2)) dt: all strips of an ellipse.
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
    # beyond the grid: 2 ln(2/q) - 1 close by, pi/(2 q) far away
    inner = np.where(distance < x[0], 2.0 * np.log(2.0) - 2.0 * distance - 1.0, inner)
    inner = np.where(distance > x[-1], 0.5 * np.pi * np.exp(-distance), inner)
    jacobian = np.cos(angle) ** 2 * 0.5 * np.pi * 3.0 * u**2 * 0.5
    whole = 2.0 * np.sum(weights * jacobian * inner, axis=1)
    return float(x[0]), float(x[1] - x[0]), np.log(J), np.log(whole)


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
    workers: int | None = None,
) -> ContactTable:
    """Build the contact table of a right wheel on a right rail.

    Parameters
    ----------
    wheel, rail : Profile
        Profiles.
    radius : float
        Rolling radius at the tape circle [m].
    gauge : float
        Distance of the gauge faces within 14 mm below the rail tops [m].
    inclination : float
        Inclination of the rails, as tangent [1].
    back_to_back : float
        Distance of the wheel backs; it places the wheels on the axle [m].
    tape_circle_distance : float
        Distance of the tape circles by name [m]; recorded only.
    G, nu : float
        Shear modulus [Pa] and Poisson's number [1].
    centre_height : float, optional
        Height of the wheelset's centre above the rail tops at z = 0; default `radius` [m].
    normal : "hertz" or "kik-piotrowski", optional
        Kind of normal contact; default that of `grid`.
    grid : TableGrid, optional
        Extent and fineness.
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
    grid = _chosen_grid(grid, normal)
    height = radius if centre_height is None else centre_height
    wheel_points = wheel_curve(wheel, radius, tape_circle_place(back_to_back))
    rail_nodes = rail_curve(rail, gauge, inclination)
    if faults := misfits(wheel_points, rail_nodes, gauge, f"{wheel.name} on {rail.name}"):
        raise InputError(faults)
    window = zone_windows(wheel_points)
    present = window > 1e-6
    first = np.array([int(np.argmax(row)) for row in present])
    last = np.array([row.size - int(np.argmax(row[::-1])) for row in present])
    log_window = np.log(np.maximum(window, 1e-30))

    n_y = round((grid.s_max - grid.s_min) / grid.ds) + 1
    # a cubic spline needs two nodes to each side of the middle
    n_roll = 2 * max(round(grid.roll_max / grid.droll), 2) + 1
    s_nodes = grid.s_min + grid.ds * np.arange(n_y)
    roll_nodes = grid.droll * (np.arange(n_roll) - n_roll // 2)
    w_nodes = np.linspace(0.0, grid.yaw_max**2, grid.n_w)
    values = np.empty((3, grid.n_w, n_roll, n_y, kernel.N_FIELD))
    ellipse_x0, ellipse_dx, ellipse = ellipse_functions(G, nu)

    def fill(task: tuple[int, int]) -> None:
        i_w, i_roll = task
        part = np.empty((3, n_y, kernel.N_FIELD))
        kernel.fill_table_slice(
            part,
            s_nodes + radius * roll_nodes[i_roll],
            roll_nodes[i_roll],
            float(np.sqrt(w_nodes[i_w])),
            height,
            wheel_points.u,
            wheel_points.r,
            wheel_points.t,
            wheel_points.du,
            log_window,
            window,
            first,
            last,
            wheel_points.curvature,
            rail_nodes.Y0,
            rail_nodes.dY,
            rail_nodes.z,
            rail_nodes.slope,
            rail_nodes.curvature,
            HALF_WIDTHS,
            ellipse_x0,
            ellipse_dx,
            ellipse,
            grid.eps,
            grid.load,
            grid.floor_ratio,
            grid.approach,
            G / (1.0 - nu),
            grid.normal == "kik-piotrowski",
            *strip_influence(),
        )
        values[:, i_w, i_roll] = part

    tasks = [(i_w, i_roll) for i_w in range(grid.n_w) for i_roll in range(n_roll)]
    fill(tasks[0])  # compile once, not in every thread
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        list(pool.map(fill, tasks[1:]))
    values[..., kernel.G] -= gap_offsets(wheel_points, grid.eps)[:, None, None, None]
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
        y0=grid.s_min,
        dy=grid.ds,
        roll0=float(roll_nodes[0]),
        droll=grid.droll,
        dw=float(w_nodes[1]),
        shear=radius,
        r0=radius,
        centre_height=height,
        G=G,
        nu=nu,
        description=description,
    )


def _chosen_grid(grid: TableGrid | None, normal: Normal | None) -> TableGrid:
    grid = grid or TableGrid()
    return replace(grid, normal=normal) if normal else grid


TYPICAL_CURVATURES = (3.0, 30.0, 77.0)
"""Relative curvature across in an everyday contact of each zone [1/m]: R 300 to 80 mm on the
tread less a hollow wheel, the gauge corner of R 13 mm in the root, and against a straight flank.
They only place the zones' heights against each other, within some micrometres."""


def gap_offsets(wheel: WheelCurve, eps: float) -> Array:
    """What the soft minimum says too much in each zone's typical contact [m], shape (3,).

    For a gap h = h'' u^2/2 the integral is sqrt(2 pi eps/h''), with h'' = kappa (1 + t^2)^(3/2)
    at the slope t in the zone's middle.
    """
    angles = np.radians([3.0, 25.0, np.degrees(np.arctan(-wheel.t)).max()])
    second = np.array(TYPICAL_CURVATURES) / np.cos(angles) ** 3
    offsets: Array = -eps * np.log(np.sqrt(2.0 * np.pi * eps / second))
    return offsets


def cache_folder() -> Path | None:
    """Folder of the stored tables; None where none may be used, see `railsim.kernels.cache`."""
    base = cache.cache_base()
    return cache.safe_folder(base and base / "tables")


def generator_hash() -> str:
    """Hash of the sources that decide what a table holds."""
    digest = hashlib.sha256()
    here, kernels = Path(__file__).parent, Path(kernel.__file__).parent
    for path in (
        here / "table.py",
        here / "curves.py",
        kernels / "contact_geometry.py",
        kernels / "hertz.py",
    ):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def cached_contact_table(
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
) -> ContactTable:
    """As `build_contact_table`, from the disk where the same table has been built before.

    The name of the stored table is a hash of everything that enters: both profiles, all numbers,
    the grid and the generator's sources.  Tables are written under a temporary name and renamed,
    so that parallel runs never see half a table; they are memory-mapped, so that parallel runs
    share one copy.  A table that is not, byte for byte, what was stored is built anew.
    """
    grid = _chosen_grid(grid, normal)
    numbers = (radius, gauge, inclination, back_to_back, tape_circle_distance, G, nu, centre_height)
    digest = hashlib.sha256(generator_hash().encode())
    digest.update(repr((numbers, grid)).encode())
    digest.update(wheel.key())
    digest.update(rail.key())
    folder = cache_folder()
    path = folder and folder / f"{digest.hexdigest()[:32]}.npy"
    if path and (stored := _stored_table(path)):
        return stored
    table = build_contact_table(
        wheel,
        rail,
        radius,
        gauge,
        inclination,
        back_to_back,
        tape_circle_distance,
        G,
        nu,
        centre_height=centre_height,
        grid=grid,
    )
    if path:
        _store_table(table, path)
    return table


def _stored_table(path: Path) -> ContactTable | None:
    text = cache.stored(path.with_suffix(".json"))
    if text is None or not path.exists():
        return None
    try:
        facts = json.loads(text)
        crc = facts.pop("crc32")
        table = ContactTable(values=np.load(path, mmap_mode="r"), **facts)
    except (OSError, ValueError, TypeError, KeyError, EOFError):
        cache.discard(path)
        return None
    if zlib.crc32(table.values.data) != crc:
        cache.discard(path)
        return None
    return table


def _store_table(table: ContactTable, path: Path) -> None:
    facts = {name: getattr(table, name) for name in ContactTable.__dataclass_fields__}
    facts["crc32"] = zlib.crc32(facts.pop("values").data)

    def write(handle: int) -> None:
        with os.fdopen(os.dup(handle), "wb") as file:
            np.save(file, table.values)

    if cache.store_file(path, write):
        cache.store(path.with_suffix(".json"), json.dumps(facts).encode())
