"""What the analyses of a study give as numbers."""

from importlib import import_module
from types import SimpleNamespace

import pytest

from railsim.definitions.study.analyses import CriticalSpeedAnalysis
from railsim.studies.analyses import analysed


@pytest.mark.parametrize(
    ("linear", "unstable_at_low", "expected"),
    [
        (SimpleNamespace(speed=40.0, frequency=5.0), False, {"linear": 40.0, "frequency": 5.0}),
        (None, False, {"linear": 90.0}),
        (None, True, {"linear": 10.0}),
    ],
)
def test_where_there_is_no_critical_speed_the_end_of_the_range_stands_for_it(
    linear, unstable_at_low, expected, monkeypatch
):
    """The upper end where nothing hunts, the lower one where it hunts everywhere."""
    found = SimpleNamespace(
        linear=linear,
        unstable_at_low=unstable_at_low,
        nonlinear={"ramp": None, "bifurcation": SimpleNamespace(speed=33.0)},
        remarks=["a remark"],
    )
    module = import_module("railsim.stability.critical_speed")
    monkeypatch.setattr(module, "critical_speed", lambda *_, **__: found)
    asked = CriticalSpeedAnalysis(kind="critical_speed", low=10.0, high=90.0)
    case = SimpleNamespace(vehicle=None, track=None, settings=None, analyses={"own": asked})
    expected = expected | {"ramp": 90.0, "bifurcation": 33.0}
    numbers, remarks = analysed(case, None)
    assert numbers == {f"own.{name}": value for name, value in expected.items()}
    assert remarks == ["own: a remark"]
