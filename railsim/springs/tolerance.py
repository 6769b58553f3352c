"""How far the ride height scatters because springs are not made exactly as drawn.

The seats on frame and arm keep their positions in the nominal nest; wire, mean diameter, coils,
free height, shear modulus and bush deviate within their tolerances, and the arm finds its
equilibrium.  What changes is the height of the bogie frame above the axle, `-L sin(phi)` measured
at the hinge, positive when the frame stands too high.

Three answers, from narrow to wide: each tolerance alone; all of them as independent random
deviations (root of the sum of squares); and the worst case, the extremes over all corners.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.spring import TrailingArmSuspension
from railsim.errors import Fault, InputError
from railsim.springs import arm as trailing_arm
from railsim.springs import helical
from railsim.springs.arm import Arm, Coil
from railsim.springs.verification import load_cases
from railsim.springs.verification_checks import built

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RideHeight:
    """Scatter of the ride height under one load, relative to the nominal nest [m].

    Attributes
    ----------
    name : str
        Name of the load.
    load : float
        Load at the axle [N].
    lowest, highest : float
        Worst case: all deviations at their limits, in the worst combination [m].
    random : float
        Root of the sum of squares of the single deviations: the 3 sigma range if every tolerance
        is 3 sigma of an independent scatter [m].
    single : dict of str to (float, float)
        Ride height with one deviation at its lower and at its upper limit [m].
    """

    name: str
    load: float
    lowest: float
    highest: float
    random: float
    single: Mapping[str, tuple[float, float]]


def ride_heights(suspension: TrailingArmSuspension) -> tuple[RideHeight, ...]:
    """Scatter of the ride height under every load of a suspension file.

    Raises
    ------
    InputError : no table `[tolerances]`, or a load that the nominal nest cannot carry.
    """
    limits = deviations(suspension)
    frame, cases = load_cases(suspension, suspension.loads)
    loads = np.array([case.load for case in cases])
    nominal = -frame.length * np.sin([case.rotation for case in cases])
    names = list(limits)

    def heights(shares: Floats) -> Floats:
        """Deviation of the height, shape (combination, load), for shares -1 to 1 of the limits."""
        deviation = {name: shares[:, i, None] * limits[name] for i, name in enumerate(names)}
        phi = trailing_arm.rotation(_deviating(suspension, frame, deviation), loads)
        height: Floats = -frame.length * np.sin(phi) - nominal
        return np.broadcast_to(height, (len(shares), len(loads)))

    alone = np.eye(len(names))
    lower, upper = heights(-alone), heights(alone)
    worst = heights(np.array(list(product((-1.0, 1.0), repeat=len(names)))))
    random = np.sqrt(np.sum((0.5 * (upper - lower)) ** 2, axis=0))
    return tuple(
        RideHeight(
            name=case.name,
            load=case.load,
            lowest=float(np.min(worst[:, i])),
            highest=float(np.max(worst[:, i])),
            random=float(random[i]),
            single={name: (float(lower[j, i]), float(upper[j, i])) for j, name in enumerate(names)},
        )
        for i, case in enumerate(cases)
    )


def deviations(suspension: TrailingArmSuspension) -> dict[str, float]:
    """The file's tolerances that are not zero, by the dotted name of what deviates."""
    table = suspension.tolerances
    if table is None:
        raise InputError([Fault(suspension.name, "tolerances", "missing", "needed: the scatter")])
    by_spring = {
        f"{spring}.{key}": float(getattr(table, key))
        for spring in suspension.springs
        for key in ("wire_diameter", "mean_diameter", "active_coils", "free_height")
    }
    every = {**by_spring, "material.G": table.G, "arm.bush_torsional_stiffness": table.bush}
    return {name: value for name, value in every.items() if value > 0.0}


def _deviating(
    suspension: TrailingArmSuspension, frame: Arm, deviation: Mapping[str, Floats]
) -> Arm:
    """The nominal arm with springs that deviate; the seats on frame and arm stay in place."""

    def of(name: str) -> Floats | float:
        return deviation.get(name, 0.0)

    G = suspension.material.G * (1.0 + of("material.G"))
    coils = []
    for (name, spring), coil in zip(suspension.springs.items(), frame.coils, strict=True):
        nominal_d, n = built(spring)
        d = nominal_d + of(f"{name}.wire_diameter")
        D = spring.mean_diameter + of(f"{name}.mean_diameter")
        taller = of(f"{name}.free_height")
        K_V = helical.vertical_stiffness(G, d, D, n + of(f"{name}.active_coils"))
        coils.append(Coil(K_V, D, coil.H0 + taller, coil.seat, coil.start + taller))
    return Arm(
        length=frame.length,
        bush=frame.bush * (1.0 + of("arm.bush_torsional_stiffness")),
        nu=frame.nu,
        coils=tuple(coils),
        form=frame.form,
    )
