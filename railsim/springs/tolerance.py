"""How far the ride height scatters because springs are not made exactly as drawn.

The seats on frame and arm keep their positions in the nominal nest; wire, mean diameter, coils,
free height, shear modulus and bush deviate within their tolerances, and the arm finds its
equilibrium.  What changes is the height of the bogie frame above the axle, `-L sin(phi)` measured
at the hinge, positive when the frame stands too high.

Three answers, from narrow to wide: each tolerance alone; all of them as independent random
deviations (root of the sum of squares); and the worst case, the extremes over all corners.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.spring import TrailingArmSuspension
from railsim.errors import input_error
from railsim.springs import arm as trailing_arm
from railsim.springs import helical
from railsim.springs.arm import Arm, Coil
from railsim.springs.verification import load_cases, wire_and_coils


@dataclass(frozen=True)
class RideHeight:
    """Scatter of the ride height under one load, relative to the nominal nest [m]."""

    name: str  # of the load
    load: float  # at the axle [N]
    lowest: float  # worst case: all deviations at their limits, in the worst combination
    highest: float
    random: float  # root of the sum of squares of the single deviations: the 3 sigma range if every
    # tolerance is 3 sigma of an independent scatter
    single: Mapping[str, tuple[float, float]]  # one deviation at its lower and at its upper limit


def ride_heights(suspension: TrailingArmSuspension) -> tuple[RideHeight, ...]:
    """Scatter of the ride height under every load of a suspension file.

    Raises InputError: no table `[tolerances]`, or a load that the nest cannot carry, as drawn or
    with its springs at their limits.
    """
    limits = deviations(suspension)
    frame, cases = load_cases(suspension, suspension.loads)
    loads = np.array([case.load for case in cases])
    nominal = -frame.length * np.sin([case.rotation for case in cases])

    def heights(shares: Floats) -> Floats:
        """Deviation of the height, shape (combination, load), for shares -1 to 1 of the limits."""
        deviation = {name: shares[:, i, None] * limits[name] for i, name in enumerate(limits)}
        phi = trailing_arm.rotation(_deviating(suspension, frame, deviation), loads)
        height: Floats = -frame.length * np.sin(phi) - nominal
        return np.broadcast_to(height, (len(shares), len(loads)))

    alone = np.eye(len(limits))
    lower, upper = heights(-alone), heights(alone)
    worst = heights(np.array(list(product((-1.0, 1.0), repeat=len(limits)))))
    lost = ~np.all(np.isfinite(np.vstack([lower, upper, worst])), axis=0)
    if np.any(lost):
        names = ", ".join(case.name for case, is_lost in zip(cases, lost, strict=True) if is_lost)
        words = f"springs at their limits cannot carry {names}"
        raise input_error(suspension.name, words, "smaller tolerances or loads", "tolerances")
    random = np.sqrt(np.sum((0.5 * (upper - lower)) ** 2, axis=0))
    found = []
    for i, case in enumerate(cases):
        alone_at = zip(lower[:, i].tolist(), upper[:, i].tolist(), strict=True)
        single = dict(zip(limits, alone_at, strict=True))
        ends = float(np.min(worst[:, i])), float(np.max(worst[:, i]))
        found.append(RideHeight(case.name, case.load, *ends, float(random[i]), single))
    return tuple(found)


def deviations(suspension: TrailingArmSuspension) -> dict[str, float]:
    """The file's tolerances that are not zero, by the dotted name of what deviates."""
    table = suspension.tolerances
    if table is None:
        raise input_error(suspension.name, "missing", "needed: the scatter", "tolerances")
    keys = "wire_diameter", "mean_diameter", "active_coils", "free_height"
    every = {f"{s}.{key}": float(getattr(table, key)) for s in suspension.springs for key in keys}
    every |= {"material.G": table.G, "arm.bush_torsional_stiffness": table.bush}
    return {name: value for name, value in every.items() if value > 0.0}


def _deviating(
    suspension: TrailingArmSuspension, frame: Arm, deviation: Mapping[str, Floats]
) -> Arm:
    """The nominal arm with springs that deviate; the seats on frame and arm stay in place."""
    G = suspension.material.G * (1.0 + deviation.get("material.G", 0.0))
    coils = []
    for (name, spring), coil in zip(suspension.springs.items(), frame.coils, strict=True):
        keys = "wire_diameter", "active_coils", "mean_diameter", "free_height"
        each = zip((*wire_and_coils(spring), spring.mean_diameter, 0.0), keys, strict=True)
        d, n, D, taller = (x + deviation.get(f"{name}.{key}", 0.0) for x, key in each)
        K_V = helical.vertical_stiffness(G, d, D, n)
        coils.append(Coil(K_V, D, coil.H0 + taller, coil.seat, coil.start + taller))
    bush = frame.bush * (1.0 + deviation.get("arm.bush_torsional_stiffness", 0.0))
    return replace(frame, bush=bush, coils=tuple(coils))
