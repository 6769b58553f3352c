"""Values for information: regression over several influences, and the steering index.

The regression (EN 14363, multiple regression) pools the curves of zones 2 to 4 of a population: a
quantity as a linear function of cant deficiency and curvature, at the admissible cant deficiency
and the mean radius of zone 4.

The steering index is the rolling radius difference with which the leading wheelset would roll
through the curve without creep, e r0/R with the distance e of the contact points (Redtenbacher
1855), over the largest one that its profiles offer before the flange makes contact.  Above 1 it
cannot steer without its flange.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railsim.assessment.rules import RULES, Rule
from railsim.assessment.statistics import Regression, multiple_regression
from railsim.assessment.zones import ZoneReport
from railsim.constants import CANT_BASE
from railsim.contact.geometry import ContactGeometry
from railsim.definitions.vehicle_tables import Service

RADIUS = 300.0  # m, mean one of zone 4
FLANGE = 0.5  # rad, contact angle from which the flange counts as touching
FORCES = ("sum_Y", "Y_over_Q", "Q", "Q_qst", "Y_qst", "T_qst")


@dataclass(frozen=True)
class Influence:
    """Regression of one quantity at one place.

    Attributes
    ----------
    population, place : str
    rule : Rule
    regression : Regression
        Coefficients: constant, of the cant deficiency [1/m], of the curvature [m].
    """

    population: str
    place: str
    rule: Rule
    regression: Regression

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        found = self.regression
        names = ("constant", "cant_deficiency", "curvature")
        return {
            "population": self.population, "name": self.rule.name, "place": self.place,
            "N": found.N, "coefficients": dict(zip(names, found.coefficients, strict=True)),
            "standard_error": found.error, "determination": found.determination,
            "radius": RADIUS, "value": found.value,
        }  # fmt: skip


def influences(reports: Sequence[ZoneReport], service: Service) -> list[Influence]:
    """Regressions of all wheel forces in curves, population by population."""
    found = []
    target = np.array([service.cant_deficiency, 1.0 / RADIUS])
    rules = {rule.name: rule for rule in RULES if rule.name in FORCES}
    for population in dict.fromkeys(report.population.name for report in reports):
        curves = [v for r in reports if r.population.name == population for v in r.values
                  if v.section.turn]  # fmt: skip
        keys = dict.fromkeys(key for value in curves for key in value.values if key[0] in rules)
        for name, place in keys:
            own = [value for value in curves if (name, place) in value.values]
            x = np.array([[v.section.cant_deficiency, 1.0 / abs(v.section.radius)] for v in own])
            y = np.array([v.values[name, place][0] for v in own])
            solved = multiple_regression(x, y, target)
            if solved is not None:
                found.append(Influence(population, place, rules[name], solved))
    return found


def steering_index(geometry: ContactGeometry, radius: float, rolling_radius: float) -> float:
    """Radius difference for rolling without creep over that before the flange; nan if unknown [1].

    Parameters
    ----------
    geometry : ContactGeometry
        Contact functions of the leading wheelset.
    radius, rolling_radius : float
        Of the curve, unsigned, and of the wheels [m].
    """
    y, difference = geometry.lateral, np.asarray(geometry.delta_r)
    ahead = np.flatnonzero((y >= 0.0) & np.isfinite(difference))
    touching = ahead[np.abs(geometry.contact_angle[ahead]).max(axis=1) > FLANGE]
    if not len(touching) or touching[0] == 0 or difference[touching[0] - 1] <= 0.0:
        return float("nan")
    return float(CANT_BASE * rolling_radius / radius / difference[touching[0] - 1])
