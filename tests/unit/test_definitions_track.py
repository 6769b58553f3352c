"""Track and settings definitions: open ends, contradictions, and what is worth a remark."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from railsim.definitions.loading import load_track, load_track_text
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import (
    cant_sections,
    curvature_sections,
    track_faults,
    track_remarks,
)
from railsim.errors import InputError
from railsim.track.alignment import Alignment

STRAIGHT = {"type": "STR", "length": 100.0}
CLOTHOID = {"type": "CLO", "length": 50.0}
CIRCLE = {"type": "CIR", "length": 80.0, "radius": 300.0}
LEVEL = {"type": "CST", "length": 100.0, "cant": 0.0}
RAMP = {"type": "LIR", "length": 50.0}
CANTED = {"type": "CST", "length": 80.0, "cant": 0.1}
DIP = {"type": "dip", "s": 500.0, "length": 4.0, "depth": 0.01}
RECORDED = {
    "type": "measured",
    "rows": [[s, *4 * [0.0]] for s in (12000.0, 12020.0, 12040.0, 12050.0)],
    "shift": 100.0,
}
RANDOM = {"type": "random", "spectrum": "erri_b176_low"}


def track(plan, cant=(), **more):
    return Track(format="railsim-track/1", name="t", plan=plan, cant=cant, **more)


def test_transition_takes_its_ends_from_its_neighbours():
    sections = curvature_sections(track([STRAIGHT, CLOTHOID, CIRCLE]))
    assert (sections[1].start_value, sections[1].end_value) == (0.0, 1.0 / 300.0)
    assert (sections[1].begin, sections[1].end) == (100.0, 150.0)


def test_transition_between_two_curves_leads_from_one_to_the_other():
    left = {**CIRCLE, "radius": -500.0}
    section = curvature_sections(track([CIRCLE, CLOTHOID, left]))[1]
    assert (section.start_value, section.end_value) == (1.0 / 300.0, -1.0 / 500.0)


def test_two_transitions_meet_at_a_given_radius():
    first = {**CLOTHOID, "radius_end": 600.0}
    sections = curvature_sections(track([STRAIGHT, first, CLOTHOID, CIRCLE]))
    assert sections[2].start_value == 1.0 / 600.0


@pytest.mark.parametrize(
    ("plan", "cant", "expected"),
    [
        ([CLOTHOID, CIRCLE], [], "plan.0: the start of the CLO is open"),
        ([CIRCLE, CLOTHOID], [], "plan.1: the end of the CLO is open"),
        ([STRAIGHT, CLOTHOID, CLOTHOID, CIRCLE], [], "plan.1: the end of the CLO is open"),
        (
            [STRAIGHT, {**CLOTHOID, "radius_end": 250.0}, CIRCLE],
            [],
            "plan.1.radius_end: 250 m, the element behind has 300 m",
        ),
        (
            [STRAIGHT, {**CLOTHOID, "radius_start": 900.0}, CIRCLE],
            [],
            "plan.1.radius_start: 900 m, the element before has inf",
        ),
        ([STRAIGHT], [LEVEL, CANTED], "cant.1: the cant steps from 0 to 0.1 m"),
        ([STRAIGHT], [LEVEL, {**RAMP, "cant_end": 0.2}, CANTED], "cant.1.cant_end: 0.2"),
        ([STRAIGHT], [LEVEL, RAMP], "cant.1: the end of the LIR is open"),
    ],
)
def test_contradicting_track_is_refused(plan, cant, expected):
    faults = [str(fault) for fault in track_faults(track(plan, cant))]
    assert any(expected in fault for fault in faults), faults
    with pytest.raises(InputError):
        Alignment(track(plan, cant))


@pytest.mark.parametrize(
    ("plan", "cant", "more", "expected"),
    [
        ([STRAIGHT, CIRCLE], [], {}, "without a transition"),
        ([STRAIGHT], [CANTED], {}, "cant without curve: 100 mm"),
        ([CIRCLE], [{**CANTED, "cant": -0.1}], {}, "cant on the wrong side"),
        ([CIRCLE], [{**CANTED, "cant": 0.25}], {}, "a cant of 250 mm"),
        ([CIRCLE], [{**CANTED, "length": 90.0}], {}, "longer (90 m) than the plan (80 m)"),
        ([CIRCLE], [CANTED, {**RAMP, "length": 20.0, "cant_end": 0.0}], {}, "5.00 mm/m"),
        ([STRAIGHT, CLOTHOID, CIRCLE], [], {"rounding": 60.0}, "shorter (50 m) than the rounding"),
        (
            [STRAIGHT],
            [],
            {"vertical": [{"type": "CST", "length": 50.0, "gradient": g} for g in (0.0, 0.01)]},
            "the gradient steps",
        ),
        ([STRAIGHT], [], {"support": {"pad_vertical": [80.0, 60.0]}}, "a stiffness of 80 N/m"),
        (
            [STRAIGHT],
            [],
            {"support": {"variation": [[10.0, 140e6], [20.0, 70e6]]}},
            "support.variation: a factor of 1.4e+08; rows hold factors",
        ),
        (
            [STRAIGHT],
            [],
            {"support": {"preset": "slab", "variation": [[10.0, 1.0, 1.0], [20.0, 1.0, 0.2]]}},
            "support.variation: the factors of ballast have no effect",
        ),
        ([STRAIGHT], [], {"speed": 160.0}, "speed: 160 m/s are 576 km/h"),
        # 2 x 20 mm over 100 mm
        (
            [STRAIGHT],
            [],
            {
                "irregularities": [
                    {**DIP, "s": 20.0, "length": 0.1, "depth": 0.02, "shape": "triangle"}
                ]
            },
            "irregularities.0: 400 mm/m steep",
        ),
        (
            [STRAIGHT],
            [],
            {
                "check_rail": [
                    {"rail": "left", "flangeway": [[begin, 0.05], [begin + 20.0, 0.05]]}
                    for begin in (5.0, 15.0)
                ]
            },
            "check_rail.1: from 15 to 25 m beside check_rail.0: their forces add up",
        ),
        ([STRAIGHT], [], {"friction": 4.0}, "friction: a coefficient of 4 is beyond"),
        ([STRAIGHT], [], {"friction": [0.4, 1.1]}, "friction: a coefficient of 1.1 is beyond"),
        ([STRAIGHT], [], {"friction_table": [[0.0, 0.3], [9.0, 3.0]]}, "friction_table: a coeff"),
        # asin(100/1500) between rails 1065 mm apart: 71 mm
        ([CIRCLE], [CANTED], {"gauge": 1.0}, "100 mm here are 71 mm between rails 1.065 m apart"),
        ([STRAIGHT], [], {"irregularities": [DIP]}, "irregularities.0: from 498 to 502 m"),
        ([STRAIGHT], [], {"irregularities": [{**RANDOM, "begin": 100.0, "end": 200.0}]}, "beyond"),
        ([STRAIGHT], [], {"irregularities": [{**RANDOM, "begin": 200.0}]}, "from 200 m on, beyond"),
        (
            [STRAIGHT],
            [],
            {"irregularities": [{**RANDOM, "begin": 10.0, "end": 30.0, "fade": 50.0}]},
            "irregularities.0.fade: 50 m at either end of 20 m",
        ),
        (
            [STRAIGHT],
            [],
            {"check_rail": [{"rail": "left", "flangeway": [[200.0, 0.05], [220.0, 0.05]]}]},
            "check_rail.0: from 200 to 220 m, beyond the track's",
        ),
        (
            [STRAIGHT],
            [],
            {"gauge_widening": [[5200.0, 0.0], [5220.0, 0.01]]},
            "gauge_widening: from 5200 to 5220 m, beyond",
        ),
        # over a window of 10 m the curvature is 0.6/R at most
        (
            [STRAIGHT, {**CIRCLE, "length": 6.0}, STRAIGHT],
            [],
            {},
            "plan.1: 6 m are shorter than the rounding (10 m), over which it is averaged",
        ),
        # from 12100 to 12150 m with its shift of 100 m; its first row is at 12000 m
        ([STRAIGHT], [], {"irregularities": [RECORDED]}, "shift = -12000 puts its start at s = 0"),
        (  # the track begins at km 11.95
            [STRAIGHT],
            [],
            {"irregularities": [RECORDED], "mileage": 11_950.0},
            "shift = -11950 puts its start at s = 50",
        ),
        (
            [STRAIGHT],
            [],
            {"irregularities": [{**RECORDED, "shift": -12000.0}], "mileage": 11_950.0},
            "begins at km 12.0000, which is put at s = 0 m, km 11.9500 of the track; "
            "shift = -11950 makes them agree",
        ),
    ],
)
def test_unusual_track_is_remarked_on(plan, cant, more, expected):
    unusual = track(plan, cant, **more)
    assert track_faults(unusual) == []
    remarks = [str(remark) for remark in track_remarks(unusual)]
    assert any(expected in remark for remark in remarks), remarks


def test_usual_supports_dips_and_check_rails_are_not_remarked_on():
    """A hanging sleeper, stiffer pads, a dipped joint, check rails on both sides."""
    rows = [[10.0, 1.0, 1.0], [10.6, 1.0, 0.01], [11.2, 2.0, 1.0]]
    flangeways = [("left", 5.0), ("right", 5.0), ("left", 25.0)]
    usual = track(
        [STRAIGHT],
        support={"preset": "co-running", "variation": rows},
        irregularities=[{**DIP, "s": 20.0, "length": 2.0, "depth": 0.02}],
        check_rail=[
            {"rail": rail, "flangeway": [[begin, 0.05], [begin + 20.0, 0.05]]}
            for rail, begin in flangeways
        ],
        speed=97.0,
    )
    assert [*track_remarks(usual)] == []


def test_a_radius_of_5_m_is_the_smallest():
    for radius in (5.0, -5.0):
        (section,) = curvature_sections(track([{**CIRCLE, "radius": radius}]))
        assert section.start_value == 1.0 / radius
        with pytest.raises(InputError, match="5 m at least"):
            track([{**CIRCLE, "radius": math.nextafter(radius, 0.0)}])


@pytest.mark.parametrize("name", ["straight", "curve_r500"])
def test_shipped_track_gives_no_cause_for_remarks(name):
    assert [*track_remarks(load_track(name))] == []


def test_cant_of_the_curving_study_is_high_for_its_radius():
    (remark,) = track_remarks(load_track("curve_r250"))
    assert str(remark) == "plan.2: a cant of 150 mm is more than (R - 100 m)/2 = 75 mm"


def test_circle_of_infinite_radius_is_straight_to_the_rules():
    straight = [{"type": "CIR", "length": 90.0, "radius": -math.inf}]
    assert [*track_remarks(track(straight, speed=20.0))] == []


def into_curve(radius, cant, length, speed):
    """Straight track, a transition with a ramp of cant, and a curve."""
    return track(
        [
            {"type": "STR", "length": 50.0},
            {"type": "CLO", "length": length},
            {"type": "CIR", "length": 90.0, "radius": radius},
        ],
        [{"type": "CST", "length": 50.0, "cant": 0.0}, {"type": "LIR", "length": length},
         {"type": "CST", "length": 90.0, "cant": cant}] if cant else [],
        speed=speed,
    )  # fmt: skip


def test_a_half_wave_in_short_elements_is_one_transition():
    """(1 - cos(pi x/L))/2 of curvature and cant: 120 m, elements of 2 m, rounded over 5 m."""
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(61) / 60)
    ends = [*zip(share[:-1].tolist(), share[1:].tolist(), strict=True)]
    radii = [(1000.0 / a if a else math.inf, 1000.0 / b) for a, b in ends]
    bend = [{**CLOTHOID, "length": 2.0, "radius_start": a, "radius_end": b} for a, b in radii]
    rise = [{**RAMP, "length": 2.0, "cant_start": 0.1 * a, "cant_end": 0.1 * b} for a, b in ends]
    plan = [STRAIGHT, *bend, {**CIRCLE, "radius": 1000.0}]
    cant = [{**LEVEL, "length": 100.0}, *rise, {**CANTED, "length": 80.0}]
    assert [*track_remarks(track(plan, cant, rounding=5.0, speed=30.0))] == []
    # 100 mm of cant at 144 km/h ask for 80 m: of a shorter one there is one remark
    short = [{**part, "length": 1.0} for part in bend], [{**part, "length": 1.0} for part in rise]
    plan[1:-1], cant[1:-1] = short
    remarks = map(str, track_remarks(track(plan, cant, rounding=5.0, speed=40.0)))
    assert [text for text in remarks if "a transition of" in text] == [
        "plan.1: a transition of 60 m is shorter than 80 m, "
        "the largest of d V/180, I V/270 and 60 m"
    ]


NEAR = st.sampled_from([0.95, 1.05])  # of a limit


@settings(max_examples=150)
@given(
    st.floats(150.0, 3000.0), st.sampled_from([0.0, 0.4, -0.7]),
    st.sampled_from([20, 40, 80, 120, 160, 229, 230, 300]), st.sampled_from([-1.0, 1.0]),
    st.integers(0, 4), NEAR, st.integers(0, 4), NEAR,
)  # fmt: skip
def test_rules_of_alignment_are_those_of_the_instructions(
    radius, before, V, hand, of_cant, cant_near, of_length, length_near
):
    """Printed rules, worked out with V in km/h, d and I in mm, on either hand.

    A curve, or straight track, with `before` times the curvature and cant of the one that follows;
    cant and length of the transition lie near one of their limits each.
    """
    v, most = V / 3.6, 180.0 if V >= 230 else 160.0
    both = 1500.0 * v**2 / (9.81 * radius)  # cant and deficiency
    limits = most, (radius - 100.0) / 2.0, both - 160.0, both + 110.0, 0.0
    d = min(max(cant_near * limits[of_cant], 0.0), 300.0)
    ramp, change = (1.0 - before) * d, abs(1.0 - before) * abs(both - d)
    lengths = ramp * V / 180.0, change * V / 270.0, 60.0, change * v / 75.0, change * v / 90.0
    length = max(length_near * lengths[of_length], 1.0)
    curves = [
        (share * d, share * (both - d), radius / share) for share in {1.0, abs(before)} - {0.0}
    ]
    rules = {
        f"mm is more than {most:g} mm": [(own, most) for own, _, _ in curves],
        "(R - 100 m)/2": [(own, max(0.5 * (R - 100.0), 0.0)) for own, _, R in curves],
        "a cant deficiency of": [(lack, 160.0) for _, lack, _ in curves],
        "a cant excess of": [(-lack, 110.0) for _, lack, _ in curves],
        "180/V": [(ramp / length, 180.0 / V)],
        "216/V": [(ramp / length, 216.0 / V)],
        "the cant deficiency changes": [(change / length * v, 75.0)],
        "and than 90": [(change / length * v, 90.0)],
        "is shorter than": [(max(lengths[:3]), length)],
    }
    kinds = [
        {"type": "CIR", "length": 70.0, "radius": hand * radius / before}
        if before else {"type": "STR", "length": 70.0},
        {"type": "CLO", "length": length},
        {"type": "CIR", "length": 90.0, "radius": hand * radius},
    ]  # fmt: skip
    heights = [
        {"type": "CST", "length": 70.0, "cant": hand * before * 1e-3 * d},
        {"type": "LIR", "length": length},
        {"type": "CST", "length": 90.0, "cant": hand * 1e-3 * d},
    ]
    said = [str(remark) for remark in track_remarks(track(kinds, heights if d else [], speed=v))]
    found = {words for words in rules if any(words in one for one in said)}
    assert found == {words for words, pairs in rules.items() if any(x > y for x, y in pairs)}


# R 300 m at 20 m/s: I + d = 1500 * 400/(9.81 * 300) = 203.9 mm
@pytest.mark.parametrize(
    ("radius", "words"),
    [
        (2996.0, None),
        (2990.0, "than 0.35 V2 = 2995 m at 92 km/h: 0.22 m/s2"),
        (2145.0, "than 0.35 V2 = 2995 m at 92 km/h: 0.31 m/s2"),
        (2100.0, "at 92 km/h, and than 0.25 V2: 0.31 m/s2"),
    ],
)
@pytest.mark.parametrize("sense", [1, -1])
def test_vertical_curves_too_sharp_for_the_speed_are_remarked_on(radius, words, sense):
    """At 92.5 km/h EN 13803 has 0.35 V^2 = 2995 m, exceptionally 0.25 V^2 = 2139 m."""
    change = sense * 30.0 / radius
    vertical = [
        {"type": "CST", "length": 50.0, "gradient": 0.0},
        {"type": "LIR", "length": 30.0},
        {"type": "CST", "length": 120.0, "gradient": change},
    ]
    plan = [{"type": "STR", "length": 200.0}]
    track = load_track("straight").replace(plan=plan, cant=[], vertical=vertical, speed=92.5 / 3.6)
    said = [str(r) for r in track_remarks(track) if r.key.startswith("vertical")]
    assert len(said) == (words is not None)
    assert all(words in one and f"radius of {radius:.0f} m" in one for one in said)


@pytest.mark.parametrize(
    ("cant", "length", "speed", "expected"),
    [
        (0.10, 80.0, 20.0, None),  # 100/80 mm/m, I 104 mm, 26 mm/s: within all rules
        (0.10, 59.0, 20.0, "a transition of 59 m is shorter than 60 m"),
        (0.10, 35.0, 20.0, "a ramp of 2.86 mm/m is steeper than 180/V = 2.50 mm/m at 72 km/h"),
        (0.10, 30.0, 20.0, "216/V"),
        (0.10, 80.0, 24.0, "a cant deficiency of 194 mm at 86 km/h is more than 160 mm"),
        (0.10, 60.0, 24.0, "changes by 77 mm/s, more than 75"),
        (0.11, 80.0, 20.0, "more than (R - 100 m)/2 = 100 mm"),
        (0.17, 80.0, 20.0, "a cant of 170 mm is more than 160 mm"),
        (0.16, 100.0, 7.0, "a cant excess of 135 mm at 25 km/h is more than 110 mm"),
    ],
)
def test_rules_of_alignment_at_the_permitted_speed(cant, length, speed, expected):
    curve = into_curve(300.0, cant, length, speed)
    metre = [str(remark) for remark in track_remarks(curve.replace(gauge=1.0))]
    assert not any(str(expected) in remark for remark in metre)  # a network of 1435 mm
    remarks = [str(remark) for remark in track_remarks(curve)]
    if expected is None:
        assert remarks == []
    else:
        assert any(expected in remark for remark in remarks), remarks


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize(
    ("speed", "expected"),
    [
        (18.0, "a cant deficiency of 165 mm"),  # I + d = 1500 * 324/(9.81 * 300) = 165.1 mm
        (4.0, "a cant excess of 112 mm"),  # 8.2 mm less the cant of 120 mm
    ],
)
def test_a_curve_is_judged_where_its_cant_is_worst(speed, expected, sense):
    """No cant at the begin of the circle, 120 mm a third along it, 60 mm in its middle."""
    plan = [{"type": "CIR", "length": 300.0, "radius": sense * 300.0}]
    cant = [
        {"type": "CST", "length": 50.0, "cant": 0.0},
        {"type": "LIR", "length": 50.0},
        {"type": "LIR", "length": 100.0, "cant_start": sense * 0.12, "cant_end": 0.0},
    ]
    remarks = [str(remark) for remark in track_remarks(track(plan, cant, speed=speed))]
    assert [r for r in remarks if expected in r and "plan.0" in r]


def test_cant_list_shorter_than_the_plan_is_usual():
    track_ = track([CIRCLE, {**CIRCLE, "length": 500.0}], [CANTED])
    assert [*track_remarks(track_)] == []
    assert cant_sections(track_)[-1].end == 80.0


@pytest.mark.parametrize(
    "change",
    [
        {"plan": []},
        {"plan": [{**STRAIGHT, "length": 0.0}]},
        {"plan": [{**STRAIGHT, "length": -5.0}]},
        {"plan": [{**STRAIGHT, "length": float("inf")}]},
        {"plan": [{**STRAIGHT, "radius": 100.0}]},
        {"plan": [{**CIRCLE, "radius": 0.0}]},
        {"plan": [{**CIRCLE, "radius": float("nan")}]},
        {"plan": [{"type": "CIR", "length": 3.0}]},
        {"cant": [{**CANTED, "cant": 150.0}]},
        {"gauge": 1435.0},
        {"inclination": 40.0},
        {"friction": -0.1},
        {"friction": [0.1, 0.2, 0.3]},
        {"rounding": -1.0},
        {"cant_rotation": "outer"},
        {"vertical": [{"type": "CST", "length": 5.0, "gradient": 12.0}]},
        {"friction_table": []},
        {"friction_table": [[0.0]]},
        {"friction_table": [[0.0, -0.1]]},
        {"friction_table": [[10.0, 0.1], [10.0, 0.2]]},
        {"friction_table": [["a", 0.1]]},
        {"friction_table": 0.3},
        {"gauge_widening": [[0.0, 15.0]]},
        {"gauge_widening": [[0.0, 0.01, 0.02, 0.03]]},
        {"irregularities": [{"type": "bump"}]},
        {"irregularities": [{**DIP, "depth": 10.0}]},
        {"irregularities": [{**DIP, "length": 0.0}]},
        {"irregularities": [{**DIP, "rail": "middle"}]},
        {"irregularities": [{"type": "kink", "s": 5.0, "length": 4.0}]},
        {"irregularities": [{"type": "measured"}]},
        {"irregularities": [{"type": "measured", "rows": [[0, 0, 0, 0, 0]]}]},
        {"irregularities": [{"type": "measured", "rows": [[s, 0, 0, 0, 0] for s in (1, 2, 2, 3)]}]},
        {"irregularities": [{**RANDOM, "spectrum": "erri"}]},
        {"irregularities": [{**RANDOM, "spectrum": "own"}]},
        {"irregularities": [{**RANDOM, "spectrum": "own", "coefficients": {"vertical": 0.0}}]},
        {"irregularities": [{**RANDOM, "coefficients": {"lateral": 1e-7}}]},
        {"irregularities": [{**RANDOM, "seed": -1}]},
        {"irregularities": [{**RANDOM, "seed": 1.5}]},
        {"irregularities": [{**RANDOM, "wavelengths": [70.0, 3.0]}]},
        {"irregularities": [{**RANDOM, "wavelengths": [0.01, 3.0]}]},
        {"irregularities": [{**RANDOM, "channels": ["lateral", "lateral"]}]},
        {"irregularities": [{**RANDOM, "begin": 50.0, "end": 50.0}]},
        {"irregularities": [{**RANDOM, "fade": -1.0}]},
        {"third_body": 0.0},
        {"third_body": 1.1},
        {"third_body": [0.3, 0.5]},  # softer in adhesion than in slip
        {"third_body": [0.3, 0.2, 0.1]},
        {"friction_falling": 0.4},
        {"friction_falling": {"rest": 0.4}},
        {"friction_falling": {"rest": 0.0, "decay": 0.6}},
        {"friction_falling": {"rest": 1.2, "decay": 0.6}},
        {"friction_falling": {"rest": 0.4, "decay": -0.6}},
        {"friction_falling": {"rest": 0.4, "decay": 0.6, "static": 0.5}},
    ],
)
def test_wrong_value_is_refused_for_it_alone(change):
    with pytest.raises(InputError) as caught:
        track(**{"plan": [STRAIGHT], **change})
    assert {fault.key.partition(".")[0] for fault in caught.value.faults} == set(change)


@pytest.mark.parametrize(
    "change",
    [
        {"scheme": "euler"},
        {"creep_law": "kalker"},
        {"step": 0.0},
        {"output_rate": -1.0},
        {"fastsim_grid": [3, 10]},
        {"fastsim_grid": [10.5, 10]},
        {"poisson": 0.5},
        {"contact_damping": -1.0},
        {"initial": {"frame": {"w": 1.0}}},
        {"drive": {"mode": "table"}},
        {"drive": {"speed_table": [[0.0, 20.0]]}},
        {"drive": {"mode": "table", "speed_table": []}},
        {"drive": {"mode": "table", "speed_table": [[0.0, 0.0]]}},
        {"drive": {"mode": "table", "speed_table": [[10.0, 5.0], [0.0, 5.0]]}},
        {"drive": {"resistance": [1.0, 0.0, 0.0]}},
        {"output_spacing": 0.5, "output_rate": 500.0},
        {"drive": {"mode": "free", "resistance": [-1.0, 0.0, 0.0]}},
        {"drive": {"mode": "free", "traction_table": [[-1.0, 5.0]]}},
    ],
)
def test_wrong_setting_is_refused_for_it_alone(change):
    with pytest.raises(ValidationError) as caught:
        Settings.model_validate(change)
    for error in caught.value.errors():
        assert error["loc"][:1] == tuple(change) or f"'{next(iter(change))}'" in error["msg"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"creep_law": "table", "fastsim_grid": [20, 20]}, ["fastsim_grid"]),
        ({"creep_law": "fastrip", "fastsim_grid": [20, 20]}, []),
        ({"output_spacing": 0.5, "creep_law": "polach"}, []),
    ],
)
def test_setting_that_another_makes_useless_is_said(given, said):
    remarks = Settings.model_validate(given).unusual()
    assert [remark.key for remark in remarks] == said
    assert all("has no effect: " in remark.text for remark in remarks)


def test_settings_have_defaults_and_read_back():
    assert Settings().fastsim_grid == (10, 10)
    assert "fastsim_grid" in Settings().to_toml()


def test_rows_given_for_both_sides_are_kept_as_pairs():
    wide = track([STRAIGHT], friction_table=[[0.0, 0.3]], gauge_widening=[[0.0, 0.01]])
    assert wide.friction_table == ((0.0, 0.3, 0.3),)
    assert wide.gauge_widening == ((0.0, 0.005, 0.005),)
    assert load_track_text(wide.to_toml()) == wide


def test_friction_that_falls_and_a_third_body_are_read_back():
    wet = track([STRAIGHT], friction_falling={"rest": 0.4, "decay": 0.6}, third_body=0.7)
    assert wet.third_body == (0.7, 0.7)
    assert (wet.friction_falling.rest, wet.friction_falling.decay) == (0.4, 0.6)
    assert load_track_text(wet.to_toml()) == wet


def test_falling_friction_may_be_assigned_key_by_key():
    changes = ["friction_falling.rest=0.5", "friction_falling.decay=0.2", "third_body=[0.3, 0.1]"]
    changed = load_track("straight", changes)
    assert (changed.friction_falling.rest, changed.friction_falling.decay) == (0.5, 0.2)
    assert changed.third_body == (0.3, 0.1)
    with pytest.raises(InputError, match="decay"):
        load_track("straight", changes[:1])


def test_settings_for_a_table_and_for_free_running():
    ramp = {"mode": "table", "speed_table": [[0.0, 20.0], [500.0, 40.0]]}
    assert Settings.model_validate({"drive": ramp}).drive.speed_table[1] == (500.0, 40.0)
    free = {"mode": "free", "traction_table": [[0.0, 1e5]], "resistance": [1e3, 10.0, 5.0]}
    assert Settings.model_validate({"drive": free}).drive.mode == "free"


def test_replace_validates_the_copy():
    straight = track([STRAIGHT])
    assert straight.replace(friction=0.2).friction == (0.2, 0.2)
    with pytest.raises(InputError, match=r"friction: -0.2; must be greater than or equal to 0"):
        straight.replace(friction=-0.2)


@pytest.mark.parametrize(("length", "told"), [(50.0, True), (60.0, False)])
def test_sections_of_rails_that_reach_beyond_the_track_are_remarked_on(length, told):
    """The shipped crossing is from 49.45 to 51.68 m."""
    crossing = load_track("crossing_56e1_r245_1in9.25")
    cut = crossing.replace(plan=[{"type": "STR", "length": length}], check_rail=[])
    said = [str(remark) for remark in track_remarks(cut)]
    words = "sections.0: from 49.45 to 51.68 m, partly beyond the track's 50 m"
    assert (words in said) == told
