"""Thousands of nests at once: what each one does, and how far it is from every limit.

`task_of` collects what stays fixed during a search, `evaluate` takes arrays of dimensions and gives
arrays of masses, fatigue margins and slacks.  A slack is relative, positive while the limit is
kept, and nan where a nest has no physical solution.  The formulas are those of `helical`, `arm`,
`design` and `checks`; nothing is computed differently here than in design and verification.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.spring import Search, TrailingArmSuspension
from railsim.errors import Fault, InputError
from railsim.springs import arm as trailing_arm
from railsim.springs import checks, helical
from railsim.springs.arm import Arm, Coil, CoilState
from railsim.springs.design import Wanted, stiffnesses
from railsim.springs.verification import dynamic_loads

Floats = NDArray[np.float64]
Pair = tuple[Floats, Floats]

# Diameters of hot rolled round steel bars for general purposes, EN 10060:2003, 10 to 60 mm [m].
EN_10060 = (
    *(0.010, 0.012, 0.013, 0.014, 0.015, 0.016, 0.018, 0.019, 0.020, 0.022, 0.024, 0.025, 0.026),
    *(0.027, 0.028, 0.030, 0.032, 0.035, 0.036, 0.038, 0.040, 0.042, 0.045, 0.048, 0.050, 0.052),
    *(0.055, 0.060),
)
_STIFFNESS_RATIO_MIN = 0.02  # each spring carries 2 % of the nest's stiffness at least


@dataclass(frozen=True)
class Task:
    """All that stays fixed during a search.

    Attributes
    ----------
    suspension : TrailingArmSuspension
        The file's content.
    limits : Search
        Its table `[search]`.
    wanted : Wanted
        Loads and deflections to be met.
    wires : ndarray
        Wire diameters to choose from [m].
    nu : float
        Poisson's ratio.
    gap : float
        Deflection of the outer spring at which the inner one starts to work [m].
    height_difference : float
        Free height of the outer spring less that of the inner one [m].
    loads : ndarray, shape (3,)
        Load for the solid height, highest and lowest dynamic load [N].
    """

    suspension: TrailingArmSuspension
    limits: Search
    wanted: Wanted
    wires: Floats
    nu: float
    gap: float
    height_difference: float
    loads: Floats


@dataclass(frozen=True)
class Dimensions:
    """Free dimensions of nests; arrays of one shape.

    Attributes
    ----------
    d_outer, d_inner : ndarray
        Wire diameters [m].
    D_outer, D_inner : ndarray
        Mean coil diameters [m].
    H0 : ndarray
        Free height of the outer spring [m].
    """

    d_outer: Floats
    d_inner: Floats
    D_outer: Floats
    D_inner: Floats
    H0: Floats


@dataclass(frozen=True)
class Evaluation:
    """What nests do; arrays of the shape of their dimensions.

    Attributes
    ----------
    n : tuple of ndarray
        Active coils, outer and inner.
    mass : ndarray
        Mass of both springs [kg].
    margin : tuple of ndarray
        Fatigue margins, outer and inner; `inf` without a table `[fatigue]`.
    slack : dict of str to ndarray
        Relative distance to each limit, negative where it is broken, nan where unknown.
    deflection_error : tuple of ndarray
        Deviation from the mounting and the target deflection [m].
    """

    n: Pair
    mass: Floats
    margin: Pair
    slack: dict[str, Floats]
    deflection_error: Pair

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Whether every limit is kept (to round-off)."""
        kept: NDArray[np.bool_] = np.all([slack >= -1e-9 for slack in self.slack.values()], axis=0)
        return kept


def task_of(suspension: TrailingArmSuspension) -> Task:
    """Collect what stays fixed during a search.

    Raises
    ------
    InputError : a table that the search needs is missing.
    """
    limits, target, inner = suspension.search, suspension.target, suspension.inner
    needed: dict[str, object] = {"search": limits, "target": target, "inner": inner}
    if limits is not None and limits.objective == "fatigue":
        needed["fatigue"] = suspension.fatigue
    missing = [name for name, table in needed.items() if table is None]
    if limits is None or target is None or inner is None or missing:
        raise InputError(
            [Fault(suspension.name, name, "missing", "the search needs it") for name in missing]
        )
    solid_load = max(suspension.loads.values())
    if suspension.checks.solid_load is not None:
        solid_load = suspension.loads[suspension.checks.solid_load]
    dynamic = dynamic_loads(suspension).values() if suspension.fatigue else (solid_load, solid_load)
    mounting = suspension.mounting
    return Task(
        suspension=suspension,
        limits=limits,
        wanted=Wanted(mounting.load, mounting.deflection, target.load, target.deflection),
        wires=np.array(limits.wire_diameters or EN_10060),
        nu=float(helical.poisson_number(suspension.material.E, suspension.material.G)),
        gap=suspension.engagement,
        height_difference=suspension.outer.free_height - inner.free_height,
        loads=np.array([solid_load, *dynamic]),
    )


def evaluate(task: Task, x: Dimensions, n: Pair | None = None) -> Evaluation:
    """Evaluate nests, all in one call.

    Parameters
    ----------
    task : Task
        What stays fixed.
    x : Dimensions
        The nests; arrays of shape (nest,).
    n : tuple of ndarray, optional
        Numbers of coils as built; by default those that the wanted deflections need.
    """
    springs = _springs(task, x)
    if n is None:
        n, frame = _as_designed(task, springs)
        errors = (np.zeros_like(x.H0), np.zeros_like(x.H0))
    else:
        frame = _as_built(task, springs, n)
        errors = _deflection_errors(task, frame)
    across = _with_load_axis(frame)
    phi = trailing_arm.rotation(across, task.loads)
    weaker = np.minimum(*(coil.K_V for coil in frame.coils))
    share = weaker * task.wanted.mounting_deflection / task.wanted.mounting_load
    slack = _space_slack(task, x, share)
    lost = np.isfinite(weaker) & np.any(np.isnan(phi), axis=-1)
    slack["equilibrium"] = np.where(lost, -1.0, 1.0)
    mass, margins = np.zeros_like(x.H0), []
    for name, spring, coils, coil in zip(("outer", "inner"), springs, n, across.coils, strict=True):
        state = trailing_arm.coil_state(across, coil, phi)
        limits = task.suspension.checks
        n_t = checks.total_coils(coils, limits.dead_coils, limits.end_coils)
        mass = mass + checks.mass(spring.d, spring.D, n_t, task.suspension.material.density)
        margins.append(_margin(task, spring, state))
        slack |= _strength_slack(task, name, spring, coils, n_t, coil, state)
        slack[f"fatigue_{name}"] = margins[-1] / task.limits.fatigue_margin_min - 1.0
        slack[f"coils_{name}"] = coils / task.limits.active_coils_min - 1.0
    return Evaluation(n, mass, (margins[0], margins[1]), slack, errors)


@dataclass(frozen=True)
class _Spring:
    """Dimensions of one spring of each nest, nan where they make no spring."""

    d: Floats
    D: Floats
    H0: Floats
    seat: float


def _springs(task: Task, x: Dimensions) -> tuple[_Spring, _Spring]:
    H0 = x.H0 - task.height_difference
    sane = (x.D_outer > x.d_outer) & (x.D_inner > x.d_inner)
    sane &= task.wanted.target_deflection < np.minimum(x.H0, H0)
    seat = task.suspension.arm.seat_height

    def spring(d: Floats, D: Floats, H0: Floats, seat: float) -> _Spring:
        return _Spring(d, np.where(sane, D, np.nan), np.where(sane, H0, np.nan), seat)

    return (
        spring(x.d_outer, x.D_outer, x.H0, seat),
        spring(x.d_inner, x.D_inner, H0, seat + task.height_difference - task.gap),
    )


def _as_designed(task: Task, springs: tuple[_Spring, _Spring]) -> tuple[Pair, Arm]:
    """Coils that meet the wanted deflections, and the arm with them."""
    start = task.wanted.mounting_deflection
    K_outer, K_inner, _ = stiffnesses(
        _frame(task, springs, (1.0, 1.0), start), task.gap, task.wanted
    )
    physical = (K_outer > 0.0) & (K_inner > 0.0)
    K_V = tuple(np.where(physical, value, np.nan) for value in (K_outer, K_inner))
    G = task.suspension.material.G
    outer, inner = (
        helical.active_coils(G, spring.d, spring.D, k)
        for spring, k in zip(springs, K_V, strict=True)
    )
    return (outer, inner), _frame(task, springs, K_V, start)


def _as_built(task: Task, springs: tuple[_Spring, _Spring], n: Pair) -> Arm:
    """The arm with given numbers of coils, horizontal under the mounting load."""
    G = task.suspension.material.G
    K_V = [
        helical.vertical_stiffness(G, spring.d, spring.D, coils)
        for spring, coils in zip(springs, n, strict=True)
    ]
    start = trailing_arm.mounting_deflection(task.wanted.mounting_load, K_V, (0.0, task.gap))
    return _frame(task, springs, K_V, start)


def _deflection_errors(task: Task, frame: Arm) -> Pair:
    """Deviation from the mounting and the target deflection [m]."""
    outer = frame.coils[0]
    at_target = trailing_arm.rotation(frame, task.wanted.target_load)
    deflection = trailing_arm.coil_state(frame, outer, at_target).deflection
    return (
        outer.start - task.wanted.mounting_deflection,
        deflection - task.wanted.target_deflection,
    )


def _frame(
    task: Task, springs: Sequence[_Spring], K_V: Sequence[Floats | float], start: Floats | float
) -> Arm:
    arm = task.suspension.arm
    starts = (start, start - task.gap)
    coils = tuple(
        Coil(k, spring.D, spring.H0, spring.seat, each)
        for k, spring, each in zip(K_V, springs, starts, strict=True)
    )
    return Arm(arm.length, arm.bush_torsional_stiffness, task.nu, coils, arm.equilibrium)


def _with_load_axis(frame: Arm) -> Arm:
    """The same arms with a last axis for the loads."""
    coils = tuple(
        Coil(*(np.expand_dims(value, -1) for value in vars(coil).values())) for coil in frame.coils
    )
    return replace(frame, coils=coils)


def _space_slack(task: Task, x: Dimensions, share: Floats) -> dict[str, Floats]:
    """Slacks of the space; a stiffness that no pair of springs has counts as a broken limit."""
    limits = task.limits
    clearance = 0.5 * (x.D_outer - x.D_inner - x.d_outer - x.d_inner)
    low, high = limits.free_height
    w_min, w_max = limits.spring_index
    index = {"index_outer": x.D_outer / x.d_outer, "index_inner": x.D_inner / x.d_inner}
    return {
        "outer_diameter": 1.0 - (x.D_outer + x.d_outer) / limits.outer_diameter_max,
        "inner_diameter": (x.D_inner - x.d_inner - limits.inner_diameter_min) / x.D_inner,
        "radial_clearance": (clearance - limits.clearance_min) / x.d_inner,
        "free_height_min": x.H0 / low - 1.0,
        "free_height_max": 1.0 - x.H0 / high,
        "stiffness": np.where(np.isnan(share), -1.0, share / _STIFFNESS_RATIO_MIN - 1.0),
        **{name: np.minimum(w / w_min - 1.0, 1.0 - w / w_max) for name, w in index.items()},
    }


def _strength_slack(
    task: Task, name: str, spring: _Spring, n: Floats, n_t: Floats, coil: Coil, state: CoilState
) -> dict[str, Floats]:
    limits, search = task.suspension.checks, task.limits
    solid = checks.solid_height(n_t, spring.d)
    factor = max(limits.clearance_factor, limits.standard_clearance_factor)
    smallest = solid + checks.coil_clearance(n, spring.D, spring.d, factor)
    buckling = helical.buckling_deflection(spring.H0, spring.D, task.nu, limits.seating)
    highest = np.max(state.deflection, axis=-1)
    slack = {
        f"height_{name}": state.height[..., 0] / smallest - 1.0,
        f"buckling_{name}": 1.0 - highest / (search.buckling_ratio_max * buckling),
    }
    table = task.suspension.material.tau_allowable
    if table is not None:
        stress = checks.solid_stress(coil.K_V[..., 0], spring.d, spring.D, spring.H0 - solid)
        allowed = search.stress_ratio_max * checks.allowable_stress(table, spring.d)
        slack[f"yield_{name}"] = 1.0 - stress / allowed
    return slack


def _margin(task: Task, spring: _Spring, state: CoilState) -> Floats:
    """Goodman-Smith margin; the loads are (solid, highest, lowest)."""
    table = task.suspension.fatigue
    if table is None:
        return np.full(spring.d.shape, np.inf)
    stress = checks.corrected_stress(
        spring.d[..., None],
        spring.D[..., None],
        state.force,
        state.K_L * state.lateral,
        state.height,
        state.lateral,
    )[..., 1:]
    tau_min, tau_max = np.min(stress, axis=-1), np.max(stress, axis=-1)
    with np.errstate(divide="ignore"):  # no equilibrium: no stress, and a slack that says so
        margin: Floats = checks.goodman_limit(table.goodman, tau_min) / tau_max
    return margin
