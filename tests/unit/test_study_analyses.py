"""Which speed the analyses of a study begin with, and what they give as numbers."""

from importlib import import_module
from types import SimpleNamespace

import pytest

from railsim.definitions.study.analyses import CriticalSpeedAnalysis
from railsim.studies.analyses import numbers_and_remarks
from railsim.studies.case import Loader
from railsim.studies.spec import RunSpec

CRITICAL = {"c": CriticalSpeedAnalysis(kind="critical_speed", low=10.0, high=90.0)}


@pytest.mark.parametrize(
    ("analyses", "speed", "table", "expected", "said"),
    [
        ({}, 20.0, False, 20.0, []),
        ({}, None, False, None, ["no speed is given"]),
        ({}, None, True, 25.0, []),
        ({}, 25.0, True, 25.0, []),
        ({}, 20.0, True, None, ["found 20 m/s"]),
        (CRITICAL, None, False, None, []),
        (CRITICAL, None, True, None, []),  # of all speeds, whatever the table says
        (CRITICAL, 20.0, False, 20.0, []),
    ],
)
def test_a_run_begins_with_the_speed_that_is_given_or_that_of_its_table(
    analyses, speed, table, expected, said
):
    """From 20 to 30 m/s over the first 100 m, of which the run begins at 50 m."""
    drive = "settings.drive={mode='table', speed_table=[[0, 20.0], [100, 30.0]]}"
    loader = Loader(analyses=analyses)
    run = RunSpec("coach", "straight", speed, start=50.0, assignments=(drive,) if table else ())
    assert loader.first_speed(run) == expected
    assert [fault.found for fault in loader.faults] == said


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
    numbers, remarks = numbers_and_remarks(case, None)
    assert numbers == {f"own.{name}": value for name, value in expected.items()}
    assert remarks == ["own: a remark"]
