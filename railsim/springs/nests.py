"""Thousands of nests at once: what each one does, and how far it is from every limit.

`task_of` collects what stays fixed during a search, `evaluate` takes arrays of dimensions and gives
arrays of masses, fatigue margins and slacks.  A slack is relative, positive while the limit is
kept, and nan where a nest has no physical solution.  The formulas are those of `helical`, `arm`,
`design` and `checks`; nothing is computed differently here than in design and verification.
"""

from dataclasses import dataclass, replace

import numpy as np

from railsim.arrays import Flags, Floats
from railsim.definitions.spring import Search, TrailingArmSuspension
from railsim.errors import Fault, InputError
from railsim.springs import arm as trailing_arm
from railsim.springs import checks, helical
from railsim.springs.arm import Arm, Coil, CoilState
from railsim.springs.design import Wanted, stiffnesses
from railsim.springs.verification import dynamic_loads

Pair = tuple[Floats, Floats]  # outer and inner spring

# Diameters of hot rolled round steel bars for general purposes, EN 10060:2003, 10 to 60 mm [m].
EN_10060 = (
    *(0.010, 0.012, 0.013, 0.014, 0.015, 0.016, 0.018, 0.019, 0.020, 0.022, 0.024, 0.025, 0.026),
    *(0.027, 0.028, 0.030, 0.032, 0.035, 0.036, 0.038, 0.040, 0.042, 0.045, 0.048, 0.050, 0.052),
    *(0.055, 0.060),
)
_STIFFNESS_RATIO_MIN = 0.02  # each spring carries 2 % of the nest's stiffness at least


@dataclass(frozen=True)
class Task:
    """All that stays fixed during a search."""

    suspension: TrailingArmSuspension
    limits: Search  # its table [search]
    wanted: Wanted  # loads and deflections to be met
    wires: Floats  # wire diameters to choose from [m]
    height_difference: float  # free height of the outer spring less that of the inner one [m]
    loads: Floats  # for the solid height, highest and lowest dynamic load [N]


@dataclass(frozen=True)
class Dimensions:
    """Free dimensions of nests [m]; arrays of one shape."""

    d_outer: Floats  # wire diameters
    d_inner: Floats
    D_outer: Floats  # mean coil diameters
    D_inner: Floats
    H0: Floats  # free height of the outer spring


@dataclass(frozen=True)
class Evaluation:
    """What nests do; arrays of the shape of their dimensions."""

    n: Pair  # active coils
    mass: Floats  # of both springs [kg]
    margin: Pair  # fatigue margins; inf without a table [fatigue]
    slack: dict[str, Floats]  # distance to each limit, relative; negative: broken, nan: unknown
    deflection_error: Pair  # deviation from the mounting and the target deflection [m]

    @property
    def feasible(self) -> Flags:
        """Whether every limit is kept (to round-off)."""
        kept: Flags = np.all([slack >= -1e-9 for slack in self.slack.values()], axis=0)
        return kept


def task_of(suspension: TrailingArmSuspension) -> Task:
    """Collect what stays fixed during a search.

    Raises InputError: a table that the search needs is missing.
    """
    limits, target, inner = suspension.search, suspension.target, suspension.inner
    missing = [name for name in ("search", "target", "inner") if getattr(suspension, name) is None]
    if limits is not None and limits.objective == "fatigue" and suspension.fatigue is None:
        missing.append("fatigue")
    if limits is None or target is None or inner is None or missing:
        words = "missing", "the search needs it"
        raise InputError(Fault(suspension.name, name, *words) for name in missing)
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
        height_difference=suspension.outer.free_height - inner.free_height,
        loads=np.array([solid_load, *dynamic]),
    )


def evaluate(task: Task, x: Dimensions, n: Pair | None = None) -> Evaluation:
    """Evaluate nests of shape (nest,), all in one call.

    `n` are numbers of coils as built; by default those that the wanted deflections need.
    """
    springs = _springs(task, x)
    errors = (np.zeros_like(x.H0), np.zeros_like(x.H0))
    if n is None:
        n, frame = _as_designed(task, springs)
    else:
        frame = _as_built(task, springs, n)
        at_target = trailing_arm.rotation(frame, task.wanted.target_load)
        deflection = trailing_arm.coil_state(frame, frame.coils[0], at_target).deflection
        mounted = frame.coils[0].start - task.wanted.mounting_deflection
        errors = mounted, deflection - task.wanted.target_deflection
    # the same arms with a last axis for the loads
    coils = (Coil(*(np.expand_dims(v, -1) for v in vars(coil).values())) for coil in frame.coils)
    across = replace(frame, coils=tuple(coils))
    phi = trailing_arm.rotation(across, task.loads)
    weaker = np.minimum(*(coil.K_V for coil in frame.coils))
    share = weaker * task.wanted.mounting_deflection / task.wanted.mounting_load
    slack = _space_slack(task, x, share)
    lost = np.isfinite(weaker) & np.any(np.isnan(phi), axis=-1)
    slack["equilibrium"] = np.where(lost, -1.0, 1.0)
    mass, margins = np.zeros_like(x.H0), []
    for name, spring, built, coil in zip(("outer", "inner"), springs, n, across.coils, strict=True):
        state = trailing_arm.coil_state(across, coil, phi)
        limits, density = task.suspension.checks, task.suspension.material.density
        n_t = checks.total_coils(built, limits.dead_coils, limits.end_coils)
        mass = mass + checks.mass(spring.d, spring.D, n_t, density)
        margins.append(_margin(task, spring, state))
        strength = _strength_slack(task, spring, built, n_t, state)
        slack |= {f"{limit}_{name}": value for limit, value in strength.items()}
        slack[f"fatigue_{name}"] = margins[-1] / task.limits.fatigue_margin_min - 1.0
        slack[f"coils_{name}"] = built / task.limits.active_coils_min - 1.0
    return Evaluation(n, mass, (margins[0], margins[1]), slack, errors)


@dataclass(frozen=True)
class _Spring:
    """Dimensions of one spring of each nest, nan where they make no spring."""

    d: Floats
    D: Floats
    H0: Floats


def _springs(task: Task, x: Dimensions) -> tuple[_Spring, _Spring]:
    H0 = x.H0 - task.height_difference
    sane = (x.D_outer > x.d_outer) & (x.D_inner > x.d_inner)
    sane &= task.wanted.target_deflection < np.minimum(x.H0, H0)

    def spring(d: Floats, D: Floats, H0: Floats) -> _Spring:
        return _Spring(d, np.where(sane, D, np.nan), np.where(sane, H0, np.nan))

    return spring(x.d_outer, x.D_outer, x.H0), spring(x.d_inner, x.D_inner, H0)


def _as_designed(task: Task, springs: tuple[_Spring, _Spring]) -> tuple[Pair, Arm]:
    """Coils that meet the wanted deflections, and the arm with them."""
    start, suspension = task.wanted.mounting_deflection, task.suspension
    frame = trailing_arm.nest(suspension, [(1.0, spring.D, spring.H0) for spring in springs], start)
    K_outer, K_inner, _ = stiffnesses(frame, suspension.engagement, task.wanted)
    physical = (K_outer > 0.0) & (K_inner > 0.0)
    K_V = [np.where(physical, value, np.nan) for value in (K_outer, K_inner)]
    G, each = suspension.material.G, zip(springs, K_V, strict=True)
    n_outer, n_inner = (helical.active_coils(G, spring.d, spring.D, k) for spring, k in each)
    built = tuple(replace(coil, K_V=k) for coil, k in zip(frame.coils, K_V, strict=True))
    return (n_outer, n_inner), replace(frame, coils=built)


def _as_built(task: Task, springs: tuple[_Spring, _Spring], n: Pair) -> Arm:
    """The arm with stated numbers of coils, horizontal under the mounting load."""
    suspension = task.suspension
    G, each = suspension.material.G, zip(springs, n, strict=True)
    K_V = [helical.vertical_stiffness(G, spring.d, spring.D, coils) for spring, coils in each]
    start = trailing_arm.mounting_deflection(task.wanted.mounting_load, K_V, suspension.engagement)
    nest = [(k, spring.D, spring.H0) for k, spring in zip(K_V, springs, strict=True)]
    return trailing_arm.nest(suspension, nest, start)


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
    task: Task, spring: _Spring, n: Floats, n_t: Floats, state: CoilState
) -> dict[str, Floats]:
    limits, search, material = task.suspension.checks, task.limits, task.suspension.material
    solid = checks.solid_height(n_t, spring.d)
    factor = max(limits.clearance_factor, limits.standard_clearance_factor)
    smallest = solid + checks.coil_clearance(n, spring.D, spring.d, factor)
    nu = trailing_arm.poisson_ratio(task.suspension)
    buckling = helical.buckling_deflection(spring.H0, spring.D, nu, limits.seating)
    highest = np.max(state.deflection, axis=-1)
    slack = {"height": state.height[..., 0] / smallest - 1.0}
    slack["buckling"] = 1.0 - highest / (search.buckling_ratio_max * buckling)
    if material.tau_allowable is not None:
        K_V = helical.vertical_stiffness(material.G, spring.d, spring.D, n)
        stress = checks.solid_stress(K_V, spring.d, spring.D, spring.H0 - solid)
        allowable = checks.allowable_stress(material.tau_allowable, spring.d)
        slack["yield"] = 1.0 - stress / (search.stress_ratio_max * allowable)
    return slack


def _margin(task: Task, spring: _Spring, state: CoilState) -> Floats:
    """Goodman-Smith margin; the loads are (solid, highest, lowest)."""
    table = task.suspension.fatigue
    if table is None:
        return np.full(spring.d.shape, np.inf)
    d, D, shear = spring.d[..., None], spring.D[..., None], state.K_L * state.lateral
    stress = checks.corrected_stress(d, D, state.force, shear, state.height, state.lateral)[..., 1:]
    tau_min, tau_max = np.min(stress, axis=-1), np.max(stress, axis=-1)
    with np.errstate(divide="ignore"):  # no equilibrium: no stress, and a slack that says so
        margin: Floats = checks.goodman_limit(table.goodman, tau_min) / tau_max
    return margin
