"""Borders of the test zones of EN 14363, and where their sections lie."""

import math

import numpy as np
import pytest

from railsim.assessment.sections import section_length, track_sections, zone_of
from railsim.assessment.statistics import one_dimensional
from railsim.assessment.zones import _largest
from railsim.cant import curve_speed
from railsim.definitions.loading import load_running_limits
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.tables import Service

FULL = 0.150  # cant deficiency, m


@pytest.mark.parametrize(
    ("radius", "zone"),
    [
        (249.9, ""),
        (250.0, "4"),
        (399.9, "4"),
        (400.0, "3"),
        (600.0, "3"),
        (600.1, "2"),
        (math.inf, "1"),
    ],
)
def test_ends_of_zone_3_belong_to_it(radius, zone):
    """UIC 518: small radii 400 m <= R <= 600 m, very small ones 250 m <= R < 400 m."""
    for standard in ("en14363", "uic518"):
        limits = load_running_limits(standard)
        assert zone_of(radius, FULL, limits) == zone_of(-radius, FULL, limits) == zone


@pytest.mark.parametrize(
    ("zone", "km_h", "length"),
    [
        ("1", 220.0, 250.0),
        ("1", 221.0, 500.0),
        ("2", 140.0, 100.0),
        ("2", 141.0, 250.0),
        ("2", 220.0, 250.0),
        ("2", 221.0, 500.0),
    ],
)
def test_lengths_of_sections_hold_up_to_their_speeds(zone, km_h, length):
    """UIC 518: 100 m up to 140, 250 m up to 220 km/h: 1.1 times 200 km/h is still of these."""
    for standard in ("en14363", "uic518"):
        assert section_length(load_running_limits(standard).zones[zone], km_h / 3.6) == length


def test_sections_end_before_the_cant_changes():
    """Full curves of constant cant alone: a ramp inside a curve lies in no section."""
    limits = load_running_limits("en14363")
    service = Service(admissible_speed=40.0, cant_deficiency=0.15)
    plan = [{"type": "CIR", "length": 1000.0, "radius": 500.0}]
    cant = [
        {"type": "CST", "length": 405.0, "cant": 0.10},
        {"type": "LIR", "length": 95.0},
        {"type": "CST", "length": 500.0, "cant": 0.12},
    ]
    track = Track(format="railsim-track/1", name="t", plan=plan, cant=cant, rounding=20.0)
    found = track_sections(track, limits, service, (0.0, 1000.0), lambda _: 20.0)
    # 100 m each, from 10 m, half of the rounding, behind a change to 10 m in front of the next
    assert [s.begin for s in found] == [10.0, 110.0, 210.0, 510.0, 610.0, 710.0, 810.0]
    (short,) = track_sections(track, limits, service, (0.0, 60.0), lambda _: 20.0)
    assert (short.begin, short.end) == (10.0, 60.0)
    assert short.reason == "50 m of a curve of 500 m, a section needs 100 m"


def test_curves_drawn_in_several_elements_are_cut_as_one_and_a_ramp_divides_them():
    """Two elements of 120 m hold two sections of 100 m, not one each: they follow one another."""
    limits = load_running_limits("en14363")
    service = Service(admissible_speed=40.0, cant_deficiency=0.15)
    plan = [{"type": "CIR", "length": 480.0, "radius": 500.0}]
    level = {"type": "CST", "length": 120.0, "cant": 0.10}
    # a ramp there and back: 0.10 m again behind it
    ramps = [{"type": "LIR", "length": 120.0, "cant_end": c} for c in (0.05, 0.10)]
    for cant, begins in (
        ([level] * 4, [0.05, 100.05, 200.05, 300.05]),
        ([level, *ramps, level], [0.05, 360.05]),
    ):
        track = Track(format="railsim-track/1", name="t", plan=plan, cant=cant, rounding=0.1)
        found = track_sections(track, limits, service, (0.0, 480.0), lambda _: 20.0)
        assert [s.begin for s in found] == pytest.approx(begins, abs=1e-9)
    halves = [{"type": "CIR", "length": 120.0, "radius": 500.0}] * 2
    track = Track(format="railsim-track/1", name="t", plan=halves, cant=[level] * 2, rounding=0.1)
    found = track_sections(track, limits, service, (0.0, 240.0), lambda _: 20.0)
    assert [s.begin for s in found] == pytest.approx([0.05, 100.05], abs=1e-9)


def of_curve(radius, cant, speed, length=1000.0):
    """Sections of a circle at a speed."""
    limits = load_running_limits("en14363")
    service = Service(admissible_speed=50.0, cant_deficiency=0.15)
    plan = [{"type": "CIR", "length": length, "radius": radius}]
    table = [{"type": "CST", "length": length, "cant": cant}]
    track = Track(format="railsim-track/1", name="t", plan=plan, cant=table, rounding=0.1)
    return track_sections(track, limits, service, (0.0, length), lambda _: speed)


@pytest.mark.parametrize("radius", [3000.0, 3500.0, 4300.0, 5700.0, 7900.0])
def test_a_cant_deficiency_asked_for_at_the_end_of_zone_1_belongs_to_it(radius):
    """V^2 = g R (h + 40 mm)/1.5 m: rounding puts it on either side of the end."""
    for cant in (0.01, 0.02, 0.03, 0.06):
        speed = curve_speed(radius, cant + 0.04)
        assert {s.zone for s in of_curve(radius, cant, speed)} == {"1"}
        assert {s.zone for s in of_curve(radius, cant, speed + 0.01)} == {"2"}


def test_what_misses_a_condition_by_little_does_not_read_like_the_condition():
    """Zone 4: 0.75 x 150 mm at least; zone 2: 50 m/s at least, sections of 250 m."""
    slow = of_curve(300.0, 0.1, curve_speed(300.0, 0.1 + 0.11246))
    assert slow[0].reason == "cant deficiency 112.46 mm, required 112.5 to 165 mm"
    late = of_curve(1500.0, 0.1, 49.97)
    assert "speed 49.97 m/s, required 50 to 55 m/s" in late[0].reason
    (short,) = of_curve(1500.0, 0.1, 50.0, length=249.8)
    assert short.reason == "249.7 m of a curve of 1500 m, a section needs 250 m"


def test_of_the_two_signs_of_one_section_the_larger_is_shown_whatever_the_hand():
    """One value has no estimate: left and right exchanged, its mean is the same."""
    signs = [one_dimensional(np.array([x]), 3.0) for x in (1.1, 1.7)]
    assert all(np.isnan(one.value) for one in signs)
    assert _largest(signs).mean == _largest(signs[::-1]).mean == 1.7
