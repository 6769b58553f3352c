"""Regression over several influences, for information (EN 14363, multiple regression).

It pools the curves of zones 2 to 4 of a population: a quantity as a linear function of cant
deficiency and curvature, at the admissible cant deficiency and the mean radius of zone 4.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from railsim.assessment.criteria import CRITERIA, Criterion
from railsim.assessment.statistics import Regression, multiple_regression
from railsim.assessment.zones import ZoneReport
from railsim.definitions.vehicle.tables import Service

RADIUS = 300.0  # m, mean one of zone 4
FORCES = ("sum_Y", "Y_over_Q", "Q", "Q_qst", "Y_qst", "T_qst")


@dataclass(frozen=True)
class Influence:
    """Regression of one quantity at one place."""

    population: str
    place: str
    criterion: Criterion
    regression: Regression  # of 1, the cant deficiency [1/m], the curvature [m]

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        fit = self.regression
        names = ("constant", "cant_deficiency", "curvature")
        return {
            "population": self.population, "name": self.criterion.name, "place": self.place,
            "N": fit.N, "coefficients": dict(zip(names, fit.coefficients, strict=True)),
            "standard_error": fit.error, "determination": fit.determination,
            "radius": RADIUS, "value": fit.value,
        }  # fmt: skip


def influences(reports: Sequence[ZoneReport], service: Service) -> Iterator[Influence]:
    """Regressions of all wheel forces in curves, population by population."""
    target = np.array([service.cant_deficiency, 1.0 / RADIUS])
    for population in dict.fromkeys(report.population.name for report in reports):
        values = [v for r in reports if r.population.name == population for v in r.values]
        curves = [v for v in values if v.section.turn]
        keys = dict.fromkeys(key for value in curves for key in value.values if key[0] in FORCES)
        for name, place in keys:
            group = [value for value in curves if (name, place) in value.values]
            x = np.array([[v.section.cant_deficiency, 1.0 / abs(v.section.radius)] for v in group])
            y = np.array([v.values[name, place][0] for v in group])
            fit = multiple_regression(x, y, target)
            if fit is not None:
                yield Influence(population, place, CRITERIA[name], fit)
