"""Mechanisms built twice and a quarter as large behave alike: Froude's law for all results at once.

With lengths times k, forces and masses times k^2 pressures and the acceleration of gravity stay as
they are, angles too, and times grow by k^(1/2); each result by what its unit says.
"""

import numpy as np
import pytest
from selection import points

from railsim.definitions.loading import load_mechanism
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.summary import analysis_data

K = 2.25
OF_UNIT = {
    "m": 1.0, "rad": 0.0, "1": 0.0, "C": 0.0, "°C": 0.0, "Pa": 0.0, "kg": 2.0, "N": 2.0,
    "N m": 3.0, "s": 0.5, "m/s": 0.5, "N s/m": 1.5,
}  # fmt: skip
"""Powers of k by which parameters grow."""
LENGTHS = "from to length stroke height x rate length_start length_end front_length rear_length"
FORCES = "force force_back max_force min_force peak_force force_zeros effective_weight"
OF_RESULT = {
    **dict.fromkeys(LENGTHS.split(), 1.0),
    **dict.fromkeys(FORCES.split(), 2.0),
    **dict.fromkeys(("effective_mass", "front_force", "rear_force", "contact", "reactions"), 2.0),
    **dict.fromkeys(("time", "duration", "velocity_x", "velocity_y"), 0.5),
    **{"speed": -0.5, "acceleration": -1.0},  # of the driver, an angle
    **{"actuators first": 1.0, "actuators second": 1.0, "pressure": 0.0},
    **{"actuators speed": 0.5, "actuators acceleration": 0.0},
}
"""Powers by which results grow, by their own name or that of their table; others stay."""
LEFT_OUT = {
    "name", "case", "source", "remarks", "parameters", "provenance", "published", "selection",
    "lid", "front_pressure", "pin_to_pin",  # catalogues have their sizes, the rod is no parameter
    "release",  # at instants of the integration
}  # fmt: skip


def leaves(node, path=()):
    """Numbers of nested results with the names that lead to them."""
    if isinstance(node, dict):
        path = (*path, "unit", node["unit"]) if "unit" in node else path
        for name, value in node.items():
            if name not in LEFT_OUT and node.get("name") not in LEFT_OUT:
                yield from leaves(value, (*path, name))
    elif isinstance(node, list | tuple | np.ndarray) and len(node):
        numbers = np.asarray(node, dtype=object)
        if all(isinstance(x, int | float) for x in numbers.ravel()):
            yield path, np.asarray(node, dtype=float)
        else:
            for k, value in enumerate(node):
                yield from leaves(value, (*path, str(k)))
    elif isinstance(node, int | float) and not isinstance(node, bool):
        yield path, np.float64(node)


def power(path):
    """That of its unit, or of the innermost name of a result; places of the driver are angles."""
    if "unit" in path:
        return OF_UNIT[path[path.index("unit") + 1]]
    if "actuators" in path and f"actuators {path[-1]}" in OF_RESULT:
        return OF_RESULT[f"actuators {path[-1]}"]
    if path[-1] in ("at", "travel") or path[-1].endswith("_at"):
        return 0.0
    return next((OF_RESULT[name] for name in reversed(path) if name in OF_RESULT), 0.0)


def enlarged(name):
    plain = load_mechanism(name)

    def grown(values):
        return {
            key: value if isinstance(value, str) else value * K ** OF_UNIT[plain.unit_of(key)]
            for key, value in values.items()
        }

    tables = {"parameters": grown(plain.parameters), "tolerances": grown(plain.tolerances)}
    return plain, plain.model_copy(update=tables)


@points("name", ["tilting_two_springs", "atr95_lift_5", "atr95_lift_1", "atr95_lift_2",
                 "atr95_lift_3", "atr95_lift_4", "atr95_lift_6"], always=(0, 1))  # fmt: skip
def test_an_enlarged_mechanism_has_every_result_enlarged_by_its_unit(name):
    both = [dict(leaves(analysis_data(analyse(one)))) for one in enlarged(name)]
    assert both[0].keys() == both[1].keys()
    assert len(both[0]) > 40
    for path, values in both[0].items():
        expected = values * K ** power(path)
        size = np.nanmax(np.abs(expected), initial=1e-9)
        assert both[1][path] == pytest.approx(expected, rel=2e-6, abs=2e-6 * size), path
