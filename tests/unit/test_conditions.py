"""Conditions of a test after EN 14363, from runs and sections that are made up."""

from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railsim.assessment.conditions import (
    MET,
    NOT_MET,
    SectionRow,
    _independent_count,
    _quality_condition,
    missing_zones,
    vehicle_conditions,
    zone_conditions,
)
from railsim.assessment.running import _remarks
from railsim.assessment.sections import TestSection
from railsim.assessment.verdict import Verdict, overall
from railsim.definitions.loading import load_running_limits
from railsim.definitions.vehicle.tables import Service

LIMITS = load_running_limits("en14363")
SERVICE = Service(admissible_speed=50.0, cant_deficiency=0.15)


def row(number, *, zone="4", begin=None, length=70.0, radius=300.0, realisation="a", **more):
    first = 100.0 * number if begin is None else begin
    section = TestSection(zone, first, first + length, radius, 0.13, more.pop("speed", 30.0))
    given = {"alignment": 0.8e-3, "level": 1.5e-3, "quality": "better than QN1", "conicity": 0.1}
    return SectionRow("run", "", section, **{**given, **more}, realisation=realisation, counts=True)


class Run(dict):
    """A run on a track of some friction and gauge."""

    def __init__(self, friction, gauge):
        super().__init__(distance=None)
        self.on = SimpleNamespace(friction_at=lambda s: np.array(friction), gauge=gauge)

    def track(self):
        return self.on


@pytest.mark.parametrize(
    ("frictions", "gauges", "words", "met"),
    [
        (([0.37, 0.5], [0.4, 0.41]), (1.435, 1.435), ("0.37 to 0.5", "1435 mm"), (True, True)),
        (([0.36], [0.36]), (1.435, 1.465), ("0.36", "1435 mm to 1465 mm"), (True, True)),
        (([0.5, 0.6], [0.35, 0.9]), (1.466, 1.435), ("0.35 to 0.9", "1435 mm to 1466 mm"),
         (False, False)),
        (([0.5], [0.6]), (1.0, 1.0), ("0.5 to 0.6", "1000 mm"), (True, False)),
    ],
)  # fmt: skip
def test_friction_and_gauge_of_all_runs_are_held_against_dry_standard_rails(
    frictions, gauges, words, met
):
    runs = [Run(*pair) for pair in zip(frictions, gauges, strict=True)]
    found = {c.name: c for c in vehicle_conditions([], [], runs, LIMITS, SERVICE)}
    for name, said, state in zip(("friction", "gauge"), words, met, strict=True):
        assert found[name].found == said
        assert found[name].state == (MET if state else NOT_MET)
    assert found["friction"].required == "0.36 at least"


@settings(max_examples=40)
@given(st.lists(st.tuples(st.integers(0, 12), st.sampled_from("ab")), min_size=1, max_size=8))
def test_independent_sections_are_the_most_that_share_no_irregularities(given):
    """The largest set without an overlap of 0.1 m, of all sets."""
    rows = [row(0, begin=23.0 * place, realisation=name) for place, name in given]

    def apart(one, other):
        a, b = one.section, other.section
        shared = min(a.end, b.end) - max(a.begin, b.begin)
        return one.realisation != other.realisation or shared < 0.1

    sizes = range(len(rows), 0, -1)
    most = next(n for n in sizes for chosen in combinations(rows, n)
                if all(apart(*pair) for pair in combinations(chosen, 2)))  # fmt: skip
    assert _independent_count(rows) == most


@pytest.mark.parametrize(
    ("change", "name", "met"),
    [
        ({}, "mean radius", True), ({"radius": 360.0}, "mean radius", False),
        ({"radius": 279.0}, "mean radius", False), ({}, "curves to both hands", True),
        ({"hands": 1.0}, "curves to both hands", False), ({}, "independent sections", True),
        ({"begin": 30.0}, "independent sections", False), ({}, "number of sections", True),
        ({"count": 24}, "number of sections", False),
        ({"reason": "slow"}, "number of sections", False),
        ({}, "track quality", True), ({"alignment": 1.1e-3}, "track quality", False),
        ({"alignment": 0.6e-3}, "track quality", False),
        ({"level": 1.2e-3}, "track quality", False),
        # beyond the admissible speed it is that of the admissible one
        ({"speed": 55.0, "alignment": 0.75e-3, "level": 1.3e-3}, "track quality", True),
        # of ten sections one may be worse
        ({"alignment": 0.8e-3, "worst": 9e-3}, "track quality", True),
    ],
)  # fmt: skip
def test_conditions_of_a_zone(change, name, met):
    change = dict(change)
    count, hands = change.pop("count", 25), change.pop("hands", -1.0)
    radius, reason = change.pop("radius", 310.0), change.pop("reason", "")
    worst = change.pop("worst", None)
    change.setdefault("speed", 43.0)
    rows = [row(k, radius=radius * (hands if k % 2 else 1.0), **change) for k in range(count)]
    if worst is not None:
        rows[7] = replace(rows[7], alignment=worst, quality="worse than QN2")
    values = [SimpleNamespace(section=replace(one.section, reason=reason)) for one in rows]
    report = SimpleNamespace(
        zone="4", title="zone 4", values=values, radius=radius, sections=[v.section for v in values]
    )
    found = {one.name: one for one in zone_conditions(report, rows, LIMITS, SERVICE)}
    assert found[name].state == (MET if met else NOT_MET), found[name]
    if name == "track quality":
        both = [np.percentile([getattr(r, k) for r in rows], 90.0) for k in ("alignment", "level")]
        assert (
            f"below {1e3 * both[0]:.2f} mm alignment and {1e3 * both[1]:.2f} mm"
            in found[name].found
        )
        share = 0 if worst is None else 100 / count
        assert f"{share:.0f} % worse than QN2" in found[name].found


def test_curves_tighter_than_all_zones_are_told_with_the_nearest_one():
    why = "no zone has the radius 120 m"
    outside = TestSection("", 85.0, 275.0, -120.0, 0.13, 8.0, why)
    sound = SimpleNamespace(name="laden", fault=False)
    found = {c.place: c.found for c in missing_zones(sound, [], LIMITS, [outside])}
    assert found["zone 4, laden"] == f"none; 1 section outside the conditions: {why}"
    assert {found[f"zone {number}, laden"] for number in "123"} == {"none"}
    (fault,) = missing_zones(SimpleNamespace(name="", fault=True), [], LIMITS, [outside])
    assert fault.found == found["zone 4, laden"]
    run = SimpleNamespace(sections=[outside], record=SimpleNamespace(name="r", remarks=list))
    assert _remarks([run], (), LIMITS)[0] == f"r: section 85 to 275 m outside all zones: {why}"


def test_nine_sections_of_ten_have_the_quality_that_is_stated():
    """0.1 to 1.1 mm in steps of 0.1 mm: one of eleven is above 1.0 mm."""
    rows = [row(k, alignment=1e-4 * (k + 1), level=2e-4 * (k + 1)) for k in range(11)]
    found = _quality_condition("zone 4", rows, None, SERVICE).found
    assert found.startswith("90 % of the sections below 1.00 mm alignment and 2.00 mm level; 0 %")


@pytest.mark.parametrize("place", range(4))
def test_overall_verdict_is_the_worst_one(place):
    order = "derailed", "fail", "not assessed", "incomplete", "pass"
    verdicts = {name: Verdict(name, ()) for name in order[place:]}
    assert overall(verdicts, order[:place:-1]) == order[place + 1]
    assert overall(verdicts, order[place:][::-1]) == order[place]
