"""Thousands of nests at once: what each one does, and how far it is from every limit.

`task_of` collects what stays fixed during a search, `evaluate` takes arrays of dimensions and gives
arrays of masses, fatigue margins and slacks.  A slack is relative, positive while the limit is
kept, and nan where a nest has no physical solution.  The formulas are those of `helical`, `arm`,
`design` and `checks`; nothing is computed differently here than in design and verification.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railsim.arrays import Flags, Floats
from railsim.definitions.spring import Search, TrailingArmSuspension
from railsim.errors import Fault, InputError
from railsim.springs import arm as trailing_arm
from railsim.springs import checks, helical
from railsim.springs.arm import Coil, CoilState
from railsim.springs.design import Demand, stiffnesses
from railsim.springs.verification import dynamic_loads

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
    demand: Demand  # loads and deflections to be met
    wires: Floats  # wire diameters to choose from [m]
    height_difference: float  # free height of the outer spring less that of the inner one [m]
    loads: Floats  # largest, for the solid height, highest and lowest dynamic load [N]


@dataclass(frozen=True)
class Dimensions:
    """Free dimensions of nests [m]."""

    d: Floats  # wire diameters, (spring, nest)
    D: Floats  # mean coil diameters, likewise
    H0: Floats  # free height of the outer spring, (nest,)

    @classmethod
    def concatenated(cls, nests: Sequence["Dimensions"]) -> "Dimensions":
        """Nests of several."""
        parts = zip(*(vars(one).values() for one in nests), strict=True)
        return cls(*(np.concatenate(part, axis=-1) for part in parts))


@dataclass(frozen=True)
class Evaluation:
    """What nests do; arrays of shape (nest,), of both springs (spring, nest)."""

    n: Floats  # active coils, (spring, nest)
    mass: Floats  # of both springs [kg]
    margin: Floats  # fatigue margins, (spring, nest); inf without a table [fatigue]
    slack: dict[str, Floats]  # distance to each limit, relative; negative: broken, nan: unknown
    deflection_error: Floats  # from the mounting and from the target deflection, (2, nest) [m]

    @property
    def feasible(self) -> Flags:
        """Whether every limit is kept (to round-off)."""
        kept: Flags = np.all([slack >= -1e-9 for slack in self.slack.values()], axis=0)
        return kept

    def part(self, rows: slice) -> "Evaluation":
        """Some of the nests."""
        slack = {name: values[rows] for name, values in self.slack.items()}
        n, margin, errors = (of[:, rows] for of in (self.n, self.margin, self.deflection_error))
        return Evaluation(n, self.mass[rows], margin, slack, errors)


def task_of(suspension: TrailingArmSuspension) -> Task:
    """Collect what stays fixed during a search; raises InputError: a table that it needs lacks."""
    limits, target, inner = suspension.search, suspension.target, suspension.inner
    missing = [name for name in ("search", "target", "inner") if getattr(suspension, name) is None]
    if limits is not None and limits.objective == "fatigue" and suspension.fatigue is None:
        missing.append("fatigue")
    if limits is None or target is None or inner is None or missing:
        words = "missing", "the search needs it"
        raise InputError(Fault(suspension.name, name, *words) for name in missing)
    checked, largest = suspension.checks, max(suspension.loads.values())
    solid_load = suspension.loads[checked.solid_load] if checked.solid_load else largest
    dynamic = dynamic_loads(suspension).values() if suspension.fatigue else (solid_load, solid_load)
    mounting = suspension.mounting
    return Task(
        suspension=suspension,
        # what the verification asks for is not offered with less
        limits=limits.model_copy(
            update={
                "clearance_min": max(limits.clearance_min, checked.radial_clearance),
                "fatigue_margin_min": max(limits.fatigue_margin_min, checked.fatigue_margin),
            }
        ),
        demand=Demand(mounting.load, mounting.deflection, target.load, target.deflection),
        wires=np.array(limits.wire_diameters or EN_10060),
        height_difference=suspension.outer.free_height - inner.free_height,
        loads=np.array([largest, solid_load, *dynamic]),
    )


def evaluate(task: Task, x: Dimensions, n: Floats | None = None) -> Evaluation:
    """Evaluate nests, all in one call.

    `n` are numbers of coils as built, (spring, nest); by default those that the wanted deflections
    need.
    """
    suspension, demand = task.suspension, task.demand
    G, engagement = suspension.material.G, suspension.engagement
    H0 = np.stack([x.H0, x.H0 - task.height_difference])
    # nan where the dimensions make no spring
    sane = np.all(x.d < x.D, axis=0) & (demand.target_deflection < np.min(H0, axis=0))
    D, H0 = np.where(sane, x.D, np.nan), np.where(sane, H0, np.nan)
    start = demand.mounting_deflection
    if n is None:
        sizes = [(1.0, *size) for size in zip(D, H0, strict=True)]
        arm = trailing_arm.nest(suspension, sizes, start)
        K_V = np.stack(stiffnesses(arm, engagement, demand)[:2])
        K_V = np.where(np.all(K_V > 0.0, axis=0), K_V, np.nan)
        n, as_built = helical.active_coils(G, x.d, D, K_V), False
    else:
        K_V, as_built = helical.vertical_stiffness(G, x.d, D, n), True
        start = trailing_arm.mounting_deflection(demand.mounting_load, K_V, engagement)
    arm = trailing_arm.nest(suspension, list(zip(K_V, D, H0, strict=True)), start)
    errors = np.zeros((2, len(x.H0)))
    if as_built:
        at_target = trailing_arm.rotation(arm, demand.target_load)
        deflection = trailing_arm.coil_state(arm, arm.coils[0], at_target).deflection
        apart = start - demand.mounting_deflection, deflection - demand.target_deflection
        errors = np.stack(apart)
    # the same arms with a last axis for the loads
    coils = (Coil(*(np.expand_dims(v, -1) for v in vars(coil).values())) for coil in arm.coils)
    arm = replace(arm, coils=tuple(coils))
    phi = trailing_arm.rotation(arm, task.loads)
    weaker = np.min(K_V, axis=0)
    slack = _space_slack(task, x, weaker * demand.mounting_deflection / demand.mounting_load)
    slack["equilibrium"] = np.where(np.isfinite(weaker) & np.any(np.isnan(phi), axis=-1), -1.0, 1.0)
    n_t = checks.total_coils(n, suspension.checks.dead_coils, suspension.checks.end_coils)
    mass = np.sum(checks.mass(x.d, D, n_t, suspension.material.density), axis=0)
    states = [vars(trailing_arm.coil_state(arm, coil, phi)) for coil in arm.coils]
    state = CoilState(*(np.stack([one[name] for one in states]) for name in states[0]))
    margin = _margin(task, x.d, D, state)
    strength = _strength_slack(task, (x.d, D, H0), n, n_t, state)
    strength["fatigue"] = margin / task.limits.fatigue_margin_min - 1.0
    strength["coils"] = n / task.limits.active_coils_min - 1.0
    for i, name in enumerate(("outer", "inner")):
        slack |= {f"{limit}_{name}": both[i] for limit, both in strength.items()}
    return Evaluation(n, mass, margin, slack, errors)


def _space_slack(task: Task, x: Dimensions, share: Floats) -> dict[str, Floats]:
    """Slacks of the space; a stiffness that no pair of springs has counts as a broken limit."""
    limits = task.limits
    (d_outer, d_inner), (D_outer, D_inner) = x.d, x.D
    clearance = 0.5 * (D_outer - D_inner - d_outer - d_inner)
    low, high = limits.free_height
    w_min, w_max = limits.spring_index
    w_outer, w_inner = np.minimum(x.D / x.d / w_min - 1.0, 1.0 - x.D / x.d / w_max)
    return {
        "outer_diameter": 1.0 - (D_outer + d_outer) / limits.outer_diameter_max,
        "inner_diameter": (D_inner - d_inner - limits.inner_diameter_min) / D_inner,
        "radial_clearance": (clearance - limits.clearance_min) / d_inner,
        "free_height_min": x.H0 / low - 1.0,
        "free_height_max": 1.0 - x.H0 / high,
        "stiffness": np.where(np.isnan(share), -1.0, share / _STIFFNESS_RATIO_MIN - 1.0),
        "index_outer": w_outer,
        "index_inner": w_inner,
    }


def _strength_slack(
    task: Task, sizes: tuple[Floats, Floats, Floats], n: Floats, n_t: Floats, state: CoilState
) -> dict[str, Floats]:
    """Slacks of each spring, (spring, nest), with the sizes d, D and H0."""
    limits, search, material = task.suspension.checks, task.limits, task.suspension.material
    d, D, H0 = sizes
    solid = checks.solid_height(n_t, d)
    factor = max(limits.clearance_factor, limits.standard_clearance_factor)
    smallest = solid + checks.coil_clearance(n, D, d, factor)
    nu = trailing_arm.poisson_ratio(task.suspension)
    buckling = helical.buckling_deflection(H0, D, nu, limits.seating)
    highest = np.max(state.deflection, axis=-1)
    least = np.minimum(state.height[..., 0] / solid, state.height[..., 1] / smallest)
    slack = {"height": least - 1.0}
    slack["buckling"] = 1.0 - highest / (search.buckling_ratio_max * buckling)
    if material.tau_allowable is not None:
        K_V = helical.vertical_stiffness(material.G, d, D, n)
        stress = checks.solid_stress(K_V, d, D, H0 - solid)
        allowable = checks.allowable_stress(material.tau_allowable, d)
        slack["yield"] = 1.0 - stress / (search.stress_ratio_max * allowable)
    return slack


def _margin(task: Task, d: Floats, D: Floats, state: CoilState) -> Floats:
    """Goodman-Smith margins, (spring, nest); the last loads are the highest and the lowest."""
    table = task.suspension.fatigue
    if table is None:
        return np.full(d.shape, np.inf)
    shear, under = state.K_L * state.lateral, (state.height, state.lateral)
    stress = checks.corrected_stress(d[..., None], D[..., None], state.force, shear, *under)
    tau_min, tau_max = np.min(stress[..., 2:], axis=-1), np.max(stress[..., 2:], axis=-1)
    with np.errstate(divide="ignore"):  # no equilibrium: no stress, and a slack that says so
        margin: Floats = checks.goodman_limit(table.goodman, tau_min) / tau_max
    return margin
