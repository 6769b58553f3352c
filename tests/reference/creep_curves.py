"""Creep curves of the program CONTACT and of converged FASTSIM as arrays in SI units.

Source: tests/data/contact/creep_curves_dev.csv (CONTACT rev. 2707, Vollebregt and Kalker;
`fastsim3_continuum` by an independent program; tests/data/SOURCES.md).  Signs turned to those of
the interface.
"""

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

DATA = Path(__file__).parents[1] / "data" / "contact"


class CreepCurves(NamedTuple):
    """Inputs [SI] and outputs of every point; forces over mu N, moments over mu N sqrt(ab)."""

    case: np.ndarray
    curve: np.ndarray
    ratio: np.ndarray
    a: np.ndarray
    b: np.ndarray
    N: np.ndarray
    mu: np.ndarray
    G: float
    nu: float
    xi_x: np.ndarray
    xi_y: np.ndarray
    phi: np.ndarray
    columns: dict[str, np.ndarray]

    def result(self, method):
        """(fx, fy, mz) of a method, shape (3, n_point)."""
        names = (f"{method}_fx", f"{method}_fy", f"{method}_mz")
        return np.stack([self.columns[name] for name in names])

    def inputs(self):
        return self.a, self.b, self.N, self.mu, self.xi_x, self.xi_y, self.phi

    def normalised(self, force):
        """A creep force in the units of the reference, shape (3, n_point)."""
        bound = self.mu * self.N
        return np.stack(
            [force.T_x / bound, force.T_y / bound, force.M_z / bound / np.sqrt(self.a * self.b)]
        )

    def errors(self, force, method):
        """Vector error of the force and error of the moment against a method, per point."""
        difference = self.normalised(force) - self.result(method)
        return np.hypot(difference[0], difference[1]), np.abs(difference[2])


def creep_curves():
    """Read the points."""
    with open(DATA / "creep_curves_dev.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    text = ("case", "curve")
    columns = {
        name: np.array([float(row[name]) for row in rows]) for name in rows[0] if name not in text
    }
    return CreepCurves(
        case=np.array([row["case"] for row in rows]),
        curve=np.array([row["curve"] for row in rows]),
        ratio=columns["a_over_b"],
        a=columns["a_mm"] * 1e-3,
        b=columns["b_mm"] * 1e-3,
        N=columns["N_newton"],
        mu=columns["mu"],
        G=82e9,
        nu=0.28,
        xi_x=-columns["cksi"],
        xi_y=-columns["ceta"],
        phi=-1e3 * columns["cphi_per_mm"],
        columns=columns,
    )
