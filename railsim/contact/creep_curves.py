"""Creep forces of one patch by every creep law, over normalised creepages."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from railsim.arrays import Floats
from railsim.contact.creep import LAWS, creep_force
from railsim.contact.exact_creep import ExactCreepForce, exact_creep_force
from railsim.contact.kalker import kalker_coefficients

CASES = {
    "longitudinal": (1.0, 0.0, 0.0),
    "lateral": (0.0, 1.0, 0.0),
    "spin": (0.0, 0.0, 1.0),
    "lateral and spin, same sign": (0.0, 1.0, 1.0),
    "lateral and spin, opposite sign": (0.0, 1.0, -0.5),
    "longitudinal and spin": (1.0, 0.0, 1.0),
}
"""Directions of the normalised creepages (x, y, spin)."""

SIZES = (0.1, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Magnitudes of the normalised creepage in the table of `forces_by_law`."""


class Patch(NamedTuple):
    """A loaded contact ellipse."""

    a: float  # semi-axis along the rail [m]
    b: float  # across [m]
    N: float  # normal force [N]
    mu: float  # friction coefficient [1]
    G: float = 82e9  # shear modulus [Pa]
    nu: float = 0.28  # Poisson's ratio [1]

    def creepages(self, normalised: Sequence[float] | Floats) -> tuple[float, float, float]:
        """Creepages whose forces in linear theory are the given multiples of mu N."""
        c11, c22, c23, _ = (float(c) for c in kalker_coefficients(self.a / self.b, self.nu))
        unit = self.mu * self.N / (self.G * self.a * self.b)
        x, y, spin = (float(value) for value in normalised)
        return unit * x / c11, unit * y / c22, unit * spin / (c23 * float(np.sqrt(self.a * self.b)))

    def unit_creepages(self, direction: Sequence[float]) -> Floats:
        """Creepages of magnitude 1, normalised, in a direction such as those of `CASES`."""
        return np.array(self.creepages(direction)) / float(np.linalg.norm(direction))


def forces_by_law(patch: Patch) -> list[dict[str, Any]]:
    """Creep forces of all laws for all directions and sizes, over mu N (moment: times size)."""
    rows = []
    size = float(np.sqrt(patch.a * patch.b))
    bound = patch.mu * patch.N
    for case, direction in CASES.items():
        unit = patch.unit_creepages(direction)
        for scale in SIZES:
            xi = dict(zip(("xi_x", "xi_y", "phi"), (scale * unit).tolist(), strict=True))
            for law in LAWS:
                ellipse = patch.a, patch.b, patch.N, patch.mu
                force = creep_force(*ellipse, **xi, G=patch.G, nu=patch.nu, law=law)
                row: dict[str, Any] = {"case": case, "size": scale, **xi, "law": law}
                row |= {name: float(getattr(force, name)) / bound for name in ("T_x", "T_y")}
                rows.append(row | {"M_z": float(force.M_z) / (bound * size)})
    return rows


def exact_force(patch: Patch, creepages: Sequence[float] | Floats) -> ExactCreepForce:
    """Full theory for a patch and its creepages (x, y, spin) [1, 1, 1/m]."""
    x, y, spin = (float(value) for value in creepages)
    return exact_creep_force(patch.a, patch.b, patch.N, patch.mu, x, y, spin, patch.G, patch.nu)
