"""Rules of a campaign by hand: where sections count, seeds, speeds, cants."""

import math
from types import SimpleNamespace

import pytest

from railsim.assessment.sections import TestSection
from railsim.definitions.excitations.random import Random
from railsim.definitions.loading import load_running_limits
from railsim.definitions.track.elements import CantRamp, ConstantCant
from railsim.studies import campaign
from railsim.studies.campaign import _lowered, counting_sections, part_speed, repetitions
from railsim.studies.case import Case

LIMITS = load_running_limits("en14363")


def section(zone, k, reason=""):
    return TestSection(zone, 100.0 * k, 100.0 * k + 70.0, 500.0, 0.1, 30.0, reason)


@pytest.mark.parametrize(
    ("wheelsets", "points", "start", "until", "speed", "interval"),
    [
        # 3 s of 30 m/s; the last wheelset 20 m behind, a metre for round-off
        ([0.0, -20.0], [-1.0], 10.0, None, 30.0, (100.0, 979.0)),
        ([9.0, -9.0], [12.0], 10.0, None, 30.0, (112.0, 990.0)),
        ([9.0, -9.0], [-13.0], 0.0, 600.0, 30.0, (99.0, 586.0)),
        # slowly the whole vehicle has to have passed the start
        ([9.0, -9.0], [12.0], 10.0, 600.0, 2.0, (10.0 + 21.0 + 12.0, 590.0)),
        ([5.0, 3.0], [], 0.0, 600.0, 2.0, (11.0, 599.0)),
        ([-3.0, -5.0], [], 0.0, 600.0, 1.0, (5.0, 594.0)),
    ],
)
def test_sections_lie_where_all_wheelsets_and_points_pass_while_a_run_is_assessed(
    monkeypatch, wheelsets, points, start, until, speed, interval
):
    flat = SimpleNamespace(along=list, of_kind=lambda kind: wheelsets)
    sensors = {str(x): SimpleNamespace(along=x) for x in points}
    seen = []

    def sections(track, limits, service, between, speed_at):
        seen.append((*between, speed_at(123.0)))
        return []

    monkeypatch.setattr(campaign, "flatten", lambda vehicle: flat)
    monkeypatch.setattr(campaign, "sensors", lambda vehicle: sensors)
    monkeypatch.setattr(campaign, "track_sections", sections)
    case = SimpleNamespace(vehicle=None, start=start, until=until, speed=speed)
    assert counting_sections(SimpleNamespace(length=1000.0), case, LIMITS, None) == []
    assert seen == [pytest.approx((*interval, speed))]


def test_sections_that_count_are_those_of_the_zone_with_most_of_them(monkeypatch):
    """A section without a zone, or with a reason why it does not count, is none."""
    found = [section("2", k) for k in range(2)] + [section("3", k) for k in range(2, 5)]
    found += [section("4", k, "a switch") for k in range(5, 9)] + [section("", 9)] * 5
    flat = SimpleNamespace(along=list, of_kind=lambda kind: [1.0])
    monkeypatch.setattr(campaign, "flatten", lambda vehicle: flat)
    monkeypatch.setattr(campaign, "sensors", lambda vehicle: {})
    monkeypatch.setattr(campaign, "track_sections", lambda *_: found)
    case = SimpleNamespace(vehicle=None, start=0.0, until=None, speed=30.0)
    assert counting_sections(SimpleNamespace(length=1e3), case, LIMITS, None) == found[2:5]


@pytest.mark.parametrize(
    ("zone", "each", "runs"), [("2", 24, 2), ("2", 25, 1), ("2", 13, 2), ("2", 1, 20), ("2", 0, 1)]
)
@pytest.mark.parametrize("condition", [0, 3])
def test_a_run_has_as_many_seeds_as_its_zone_needs_sections(
    monkeypatch, zone, each, runs, condition
):
    """25 of them, of at most 20 seeds; seeds lie 10 apart and 200 from condition to condition."""
    assert LIMITS.zones[zone].sections == 25
    part = Random.model_construct(seed=7)
    track = SimpleNamespace(
        irregularities=(part,),
        model_copy=lambda update: SimpleNamespace(irregularities=update["irregularities"]),
    )
    monkeypatch.setattr(campaign, "counting_sections", lambda *_: [section(zone, 1)] * each)
    monkeypatch.setattr(campaign, "to_target", lambda track, part, *_: (track, part.seed))
    case = Case.__new__(Case)
    fields = {name: None for name in Case.__dataclass_fields__}
    for name, value in (fields | {"name": "r", "track": track, "labels": {"a": 1}}).items():
        object.__setattr__(case, name, value)
    found = repetitions(case, LIMITS, None, condition)
    seeds = [7 + 10 * (20 * condition + k) for k in range(runs)]
    assert [one.name for one in found] == [f"r_seed{seed}" for seed in seeds]
    assert [one.labels for one in found] == [{"a": 1, "seed": seed} for seed in seeds]
    assert [one.track[1] for one in found] == seeds
    assert [one.track[0].irregularities[0].seed for one in found] == seeds


@pytest.mark.parametrize("parts", [(), (SimpleNamespace(seed=1),), (Random.model_construct(),) * 2])
def test_runs_on_other_tracks_than_one_random_one_are_not_repeated(parts):
    case = SimpleNamespace(track=SimpleNamespace(irregularities=parts))
    assert repetitions(case, LIMITS, None, 0) == [case]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"fixed": 12.0}, 12.0), ({"admissible": 1.1}, 44.0), ({"admissible": 0.5}, 20.0),
        # V^2 = g R (h + share of 0.15 m)/1.5 m
        ({"cant_deficiency": 1.0, "radius": 300.0, "cant": 0.1}, math.sqrt(9.81 * 300.0 / 6.0)),
        ({"cant_deficiency": 1.1, "radius": 400.0, "cant": 0.0}, math.sqrt(9.81 * 44.0)),
        ({"cant_deficiency": 1.0, "radius": 3000.0, "cant": 0.1}, 44.0),
    ],
)  # fmt: skip
def test_speed_of_a_part_is_fixed_or_a_share_or_that_of_a_curve(given, expected):
    """At most 1.1 times the admissible speed of 40 m/s."""
    speed = {"fixed": None, "admissible": None, "cant_deficiency": None, "radius": None, **given}
    service = SimpleNamespace(admissible_speed=40.0, cant_deficiency=0.15)
    assert part_speed(SimpleNamespace(**speed), service) == pytest.approx(expected)


def test_lowered_cants_keep_their_places():
    flat = ConstantCant(type="CST", length=50.0, cant=0.12)
    ramp = CantRamp(type="LIR", length=30.0, cant_start=0.04, cant_end=0.08)
    open_ramp = CantRamp(type="LIR", length=30.0)
    assert _lowered(flat, 0.25) == ConstantCant(type="CST", length=50.0, cant=0.03)
    lower = CantRamp(type="LIR", length=30.0, cant_start=0.01, cant_end=0.02)
    assert _lowered(ramp, 0.25) == lower
    assert _lowered(open_ramp, 0.25) == open_ramp
