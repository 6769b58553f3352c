"""What decides a verdict: one made-up record for every rule."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from example_result import BODIES
from made_record import FINE, Q0, curve, made, track
from selection import points

import railsim
from railsim.assessment import assess
from railsim.assessment.conditions import Condition, sentences
from railsim.assessment.verdict import all_verdicts
from railsim.cli import main
from railsim.errors import InputError
from railsim.profiles import load_profile
from railsim.report.limits import assess_runs

STRAIGHT = {"type": "STR", "length": 1700.0}
FAST = 1.1 * 33.33333
ON_ZONE_4 = track(*curve(300.0, 400.0), cant=0.12)


def random(seed, spectrum="erri_b176_low"):
    return {"type": "random", "spectrum": spectrum, "seed": seed}


def sides(outer, inner):
    """Guiding forces in a right-hand curve: outwards on the left, and inwards on the right."""
    return lambda t, s: np.stack([np.full(s.shape, -outer), np.full(s.shape, inner)], axis=-1)


def rows_of(assessment, zone, name):
    reports = [z for z in assessment.zones if z.zone == zone]
    return {row.place: row for z in reports for row in (*z.rows, *z.information)
            if row.criterion.name == name}  # fmt: skip


def condition(assessment, name, place=""):
    return next(c for c in assessment.conditions if c.name == name and c.place.startswith(place))


# ends of runs -------------------------------------------------------------------------------------


def test_standstill_is_no_derailment():
    """Only `derailed` is one; every other early end is not assessed, with its reason."""
    (found,) = assess(made(track(STRAIGHT), FAST, status="stopped"))
    assert found.verdict == "not assessed"
    assert {v.value for v in found.verdicts.values()} == {"not assessed"}
    assert found.reasons == ("run: stopped, made up: not assessed",)


def test_one_stopped_run_among_others_is_no_pass_and_named():
    whole, ended = made(ON_ZONE_4, 23.0), made(ON_ZONE_4, 23.0, status="stopped")
    (found,) = assess({"whole": whole, "ended": ended})
    assert found.verdict == "incomplete"
    assert "ended: stopped, made up: not assessed" in found.reasons
    # the other run is assessed all the same
    assert len(found.zones[0].values) == len(assess(whole)[0].zones[0].values)


def test_derailment_is_of_running_safety():
    (found,) = assess({"a": made(ON_ZONE_4, 23.0), "b": made(ON_ZONE_4, 23.0, status="derailed")})
    assert (found.verdict, found.verdicts["safety"].value) == ("derailed", "derailed")
    assert found.verdicts["loading"].value == "incomplete"


# lifting ------------------------------------------------------------------------------------------


def test_wheel_off_the_rail_5_m_in_every_70_m_fails():
    """No percentile of Y/Q shows it: the windows without load have no value."""

    def Q(t, s):
        loads = np.full((*s.shape, 2), Q0)
        loads[(s[:, 0] % 70.0) < 5.0, 0, 0] = -1e3
        return loads

    (found,) = assess(made(ON_ZONE_4, 23.0, Q=Q, Y=sides(20e3, 0.0)))
    assert rows_of(found, "4", "Y_over_Q")["wheelset 1 outer"].share < 0.75
    assert found.verdicts["safety"].value == found.verdict == "fail"
    assert any("wheelset 1 outer without load over" in why for why in found.reasons)
    assert found.verdicts["loading"].value == "incomplete"
    low = rows_of(found, "4", "Q_low")
    assert low["wheelset 1 outer"].estimate.value < 0.0
    assert low["wheelset 2 outer"].estimate.value == pytest.approx(Q0, rel=1e-6)


def test_wheel_above_nadals_limit_before_it_lifts_is_said_to_exceed_it():
    """Y/Q 1.5 over 10 m, then 2 m without load; S1002, 70 degrees, and friction 0.4: 1.12."""

    def Q(t, s):
        loads = np.full((*s.shape, 2), Q0)
        loads[(s[:, 0] > 410.0) & (s[:, 0] < 412.0), 0, 0] = 0.0
        return loads

    def Y(t, s):
        forces = np.zeros((*s.shape, 2))
        forces[(s[:, 0] > 400.0) & (s[:, 0] <= 410.0), 0, 0] = -1.5 * Q0
        return forces

    profiles = {name: load_profile(name) for name in ("S1002", "60E1")}
    run = made(ON_ZONE_4, 23.0, Q=Q, Y=Y, profiles=profiles, **FINE)
    (found,) = assess(run, "safety")
    wheel, *others = found.safety["run"].wheels
    assert (wheel.Y_over_Q, wheel.lifted) == (pytest.approx(1.5), True)
    assert wheel.limit < 1.2
    assert wheel.climb_distance == pytest.approx(12.0, abs=0.1)
    assert not any(other.lifted for other in others)
    verdicts, page = assess_runs({"run": run, "again": run})
    above = "; ".join(f"{name}: Nadal's limit, wheelset 1 left" for name in ("run", "again"))
    assert ("failed", f"Limits exceeded: {above}.") in verdicts
    table = next(t for t in page.tables if t.caption.startswith("Derailment"))
    rows = [(row[0], row[1], row[-1]) for row in table.rows]
    assert rows == [(name, "wheelset 1 left", "wheelset 1 left") for name in ("run", "again")]


# three verdicts -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "without", "words"),
    [
        ("normal", ("body_acceleration",), "ride"),
        ("simplified", ("body_acceleration",), "running safety"),
        ("simplified", (), "track loading"),
    ],
)
def test_what_was_not_measured_is_no_pass(method, without, words):
    """Also where all conditions of the test are met, which are left out here."""
    run = made(ON_ZONE_4, 23.0, without=without)
    (found,) = assess(run, method=method)
    verdicts = all_verdicts({"run": run}, found.zones, [])
    names = {"ride": "ride", "running safety": "safety", "track loading": "loading"}
    assert verdicts[names[words]].value == "incomplete"
    assert verdicts[names[words]].reasons == (f"{words}: none of its quantities has values",)


def test_ride_alone_fails_uic_518_but_not_en_14363(tmp_path, capsys):
    run = made(track(STRAIGHT), FAST, lateral=lambda t: 4.0 * np.sin(2 * np.pi * t))
    path = str(run.to_hdf5(tmp_path / "run.h5"))
    assert main(["assess", path, "--fail"]) == 0
    assert "ride (for information): fail" in capsys.readouterr().out
    assert main(["assess", path, "--fail", "--standard", "uic518"]) == 4
    capsys.readouterr()
    assert main(["assess", path, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)[0]
    assert data["verdict"] == "incomplete"
    assert {name: one["verdict"] for name, one in data["verdicts"].items()} == {
        "safety": "incomplete", "loading": "incomplete", "ride": "fail"
    }  # fmt: skip
    assert "lateral body acceleration" in data["verdicts"]["ride"]["reasons"][0]


# very large radii ---------------------------------------------------------------------------------


@points("hand", [1.0, -1.0], always=(1,))
def test_very_large_radii_of_zone_1_are_pooled_with_straight_track(hand):
    """R 4000 m, 36.7 m/s, cant 20 mm: 31 mm deficiency; the sections are those of zone 1."""
    plan = [{"type": "STR", "length": 900.0}, *curve(hand * 4000.0, 600.0)[1:4], STRAIGHT]
    to_the_right = lambda t, s: np.full((*s.shape, 2), 4e3)  # noqa: E731
    (found,) = assess(made(track(*plan, cant=hand * 0.02), FAST, Y=to_the_right))
    (zone,) = (z for z in found.zones if z.zone == "1")
    assert sorted({v.section.radius for v in zone.values}) == sorted([hand * 4000.0, np.inf])
    row = rows_of(found, "1", "sum_Y")["wheelset 1"]
    assert row.estimate.N == len(zone.values) == 3 + 2 + 6
    assert row.estimate.value == pytest.approx(8e3, rel=1e-6)
    assert not rows_of(found, "1", "Y_over_Q")
    assert set(rows_of(found, "1", "Q")) == {f"wheelset {w} {side}" for w in (1, 2, 3, 4)
                                            for side in ("left", "right")}  # fmt: skip


# correction for high friction ---------------------------------------------------------------------


@pytest.mark.parametrize("outer", [60e3, 70e3])
def test_guiding_force_is_corrected_only_above_its_limit(outer):
    """65 kN at R 300 m; Y/Q of the inner wheel 0.458 instead of 0.40: 2.9 kN less."""
    (found,) = assess(made(ON_ZONE_4, 23.0, Y=sides(outer, 25e3)))
    row = rows_of(found, "4", "Y_qst")["wheelset 1 outer"]
    if outer < 65e3:
        assert row.uncorrected is None
        assert row.estimate.value == pytest.approx(outer, rel=1e-6)
        return
    assert row.uncorrected.value == pytest.approx(outer, rel=1e-6)
    assert row.estimate.value == pytest.approx(outer - 50e3 * (25e3 / Q0 - 0.40), rel=1e-6)
    assert row.record()["uncorrected"] == row.uncorrected.value


# what may be pooled -------------------------------------------------------------------------------


def test_results_on_low_and_high_irregularities_are_not_pooled():
    runs = {
        name: made(track(STRAIGHT, irregularities=[random(3, f"erri_b176_{name}")]), FAST)
        for name in ("low", "high")
    }
    (found,) = assess(runs)
    zones = [(z.population.name, len(z.values)) for z in found.zones]
    assert zones == [("erri_b176_low", 6), ("erri_b176_high", 6)]


def test_sections_outside_the_conditions_are_no_pass_even_if_asked_for():
    """30 sections of zone 1 at 20 m/s where 36.7 are required: enough only by number."""
    on = track({"type": "STR", "length": 7700.0})
    slow, right = (made(on, speed, rate=100.0) for speed in (20.0, FAST))
    for run, state in ((slow, "not met"), (right, "met")):
        (found,) = assess(run, coarse=True, all_sections=True)
        about = condition(found, "number of sections", "zone 1")
        assert about.state == state
        assert about.found.startswith("30, 30 of them outside" if run is slow else "30")


def test_the_same_irregularities_twice_are_not_independent():
    def pair(second):
        on = [track(STRAIGHT, irregularities=[random(seed)]) for seed in (3, second)]
        (found,) = assess({"a": made(on[0], FAST), "b": made(on[1], FAST)})
        return condition(found, "independent sections")

    assert pair(4).state == "met"
    again = pair(3)
    assert again.state == "not met"
    assert again.found.startswith("6 of 12")


def test_sections_that_overlap_on_the_same_irregularities_are_not_independent():
    """A faster run begins to count further on: its sections lie beside those of the other."""
    on = track(STRAIGHT, irregularities=[random(3)])
    (found,) = assess({"a": made(on, FAST), "b": made(on, 1.01 * FAST)})
    begins = {round(row.section.begin, 1) for row in found.sections}
    assert len(begins) == len(found.sections) == 12
    about = condition(found, "independent sections")
    assert about.state == "not met"
    assert about.found.startswith("6 of 12")


def vehicle(**service):
    import railsim

    coach = railsim.load_vehicle("coach_manchester")
    table = coach.service.model_copy(update=service)
    return coach.model_copy(update={"service": table}).to_toml()


def test_conditions_of_one_vehicle_are_assessed_together_and_apart():
    runs = {n: made(ON_ZONE_4, 23.0, vehicle=vehicle(condition=n)) for n in ("new", "worn")}
    (found,) = assess(runs)
    assert [z.population.name for z in found.zones if z.zone == "4"] == ["new", "worn"]


def test_loads_in_one_condition_are_not_pooled():
    import railsim

    coach = railsim.load_vehicle("coach_manchester")
    texts = {}
    for state, load in (("new", "design"), ("worn", "design"), ("worn", "laden")):
        service = coach.service.model_copy(update={"condition": state})
        changed = coach.model_copy(update={"service": service, "load": load})
        texts[f"{state} {load}"] = changed.to_toml()
    (found,) = assess({name: made(ON_ZONE_4, 23.0, vehicle=text) for name, text in texts.items()})
    names = [z.population.name for z in found.zones if z.zone == "4"]
    assert names == ["new", "worn", "worn, laden"]


def test_loads_of_one_vehicle_are_assessed_together():
    """Runs with `--load` of a vehicle without conditions are its two load states."""
    coach = railsim.load_vehicle("coach_manchester")
    texts = {load: coach.replace(load=load).to_toml() for load in ("design", "laden")}
    runs = {load: made(ON_ZONE_4, 23.0, vehicle=text) for load, text in texts.items()}
    (found,) = assess(runs)
    assert condition(found, "load states").state == "met"
    places = {c.place for c in found.conditions if c.name == "number of sections"}
    assert {"zone 4, design", "zone 4, laden"} <= places
    assert len(assess(runs, "wear")) == 2


def test_fault_mode_is_assessed_for_running_safety_only():
    run = made(ON_ZONE_4, 23.0, vehicle=vehicle(condition="failed damper", fault=True))
    (found,) = assess(run)
    assert {row.criterion.group for z in found.zones for row in z.rows} == {"safety"}
    assert not any(c.name == "number of sections" for c in found.conditions)


def test_fault_mode_without_a_section_that_counts_is_no_pass():
    """At 20 m/s no straight section is one of zone 1: nothing of the fault mode is judged."""
    fault = vehicle(condition="failed damper", fault=True)
    whole = made(ON_ZONE_4, 23.0, vehicle=fault)
    slow = made(track(STRAIGHT), 20.0, vehicle=fault)
    name = "sections of the fault mode"
    (found,) = assess({"whole": whole, "slow": slow})
    assert not any(c.name == name for c in found.conditions)
    (found,) = assess({"new": made(ON_ZONE_4, 23.0, vehicle=vehicle(condition="new")),
                       "slow": slow})  # fmt: skip
    assert condition(found, name, "failed damper").state == "not met"
    assert any(name in why for why in found.verdicts["safety"].reasons)


# conditions of the test ---------------------------------------------------------------------------


def test_conditions_are_met_not_met_or_not_checked():
    profiles = {name: load_profile(name) for name in ("S1002", "60E1")}
    on = track(STRAIGHT, irregularities=[random(3)])
    (found,) = assess(made(on, FAST, profiles=profiles))
    states = {c.name: c.state for c in found.conditions if not c.place.startswith("zone 2")}
    assert states["track quality"] == "not met"  # level 0.98 mm, TL90 asks for 1.4 mm
    assert states["independent sections"] == "met"
    assert states["high conicity in zone 1"] == "not met"
    assert states["low conicity in zone 1"] == "met"
    # S1002 on 60E1 1:40, as in EN 15302: 0.177
    assert condition(found, "low conicity in zone 1").found == "0.18 to 0.18"
    assert found.sections[0].conicity == pytest.approx(0.177, abs=2e-3)
    assert states["friction"] == "met"
    assert states["load states"] in ("not met", "not checked")
    assert all(c.sentence in found.reasons for c in found.conditions if c.state != "met")


def test_what_a_limits_file_does_not_hold_is_not_checked_and_said(tmp_path):
    text = (Path(railsim.__file__).parent.parent / "limits/en14363.toml").read_text("utf-8")
    own = tmp_path / "own.toml"
    own.write_text(re.sub(r"(?ms)^\[(conicity|track_quality|friction|gauge)\].*?(?=^\[)", "", text))
    profiles = {name: load_profile(name) for name in ("S1002", "60E1")}
    run = made(track(STRAIGHT, irregularities=[random(3)]), FAST, profiles=profiles)
    (found,) = assess(run, limits=own)
    for name, lacks in (
        ("low conicity in zone 1", "classes"),
        ("high conicity in zone 1", "classes"),
        ("track quality", "a target"),
        ("friction", "a value"),
        ("gauge", "a value"),
    ):
        one = condition(found, name)
        assert (one.state, one.required) == ("not checked", f"{lacks} in the limits file")
        assert one.sentence.endswith(f"not checked: {one.found}; required {one.required}")
        assert one.sentence in found.reasons


@pytest.mark.parametrize("gauge", [1.0, 1.435, 1.45, 1.668])
def test_limits_of_the_normal_gauge_pass_no_run_on_another(gauge):
    """EN 14363, scope: standard gauge tracks (nominally 1 435 mm)."""
    (found,) = assess(made(ON_ZONE_4.replace(gauge=gauge), 23.0))
    normal = gauge in (1.435, 1.45)  # the second is a widened one
    assert condition(found, "gauge").state == ("met" if normal else "not met")
    said = f"gauge not met: {1e3 * gauge:.0f} mm; required 1435 mm, for which the limits hold"
    assert (said in found.reasons) == (not normal)


def test_load_cases_of_the_vehicle_count_also_where_no_section_does():
    text = railsim.load_vehicle("coach_manchester").to_toml()  # has a load case `laden`
    (found,) = assess(made(track({"type": "STR", "length": 60.0}), 1.0, vehicle=text))
    loads = condition(found, "load states")
    assert (loads.state, loads.found) == ("not met", "none, as no section counts")


def test_curves_to_one_hand_only_do_not_meet_the_conditions():
    (found,) = assess(made(ON_ZONE_4, 23.0))
    assert condition(found, "curves to both hands", "zone 4").state == "not met"
    both = [*curve(300.0, 400.0), *curve(-300.0, 400.0)]
    on = track(*both)
    (found,) = assess(made(on, 18.0), all_sections=True)
    assert condition(found, "curves to both hands", "zone 4").state == "met"


# instability --------------------------------------------------------------------------------------


def test_instability_is_judged_on_straights_with_one_frequency_for_the_vehicle():
    def hunting(f, amplitude):
        def Y(t, s):
            wave = 0.5 * amplitude * np.sin(2 * np.pi * f * t)[:, None] + 0.0 * s
            return np.stack([wave, wave], axis=-1)

        return Y

    runs = {
        "hunts": made(track(STRAIGHT), FAST, Y=hunting(5.0, 20e3)),
        "rolls": made(track(STRAIGHT, irregularities=[random(3)]), FAST, Y=hunting(9.0, 5e3)),
        "curve": made(ON_ZONE_4, 23.0),
    }
    (found,) = assess(runs)
    assert found.hunting_frequency == pytest.approx(5.0, abs=0.02)
    # 9 Hz are outside the band about 5 Hz, at which the other straight is judged too
    means = [max(r.estimate.mean for r in z.rows if r.criterion.name == "instability")
             for z in found.zones if z.zone == "1"]  # fmt: skip
    assert min(means) < 1e3 < 14e3 < max(means)
    assert not rows_of(found, "4", "instability")
    assert rows_of(found, "1", "instability")


# input --------------------------------------------------------------------------------------------


def test_result_without_static_wheel_loads_is_an_input_error():
    run = made(track(STRAIGHT), FAST)
    arrays = {name: np.asarray(run[name]) for name in run if name != "Q0"}
    bare = run.__class__(
        arrays, run.quantities, run.coordinates, run.attributes, run.profiles
    )  # fmt: skip
    with pytest.raises(InputError, match="Q0: is not in the result"):
        assess(bare)


@pytest.mark.parametrize(
    ("name", "stored", "standards"),
    [
        ("Q", "Q", ["en14363"]),
        ("Y", "Y", ["en14363"]),
        ("T_gamma", "T_gamma", ["wear"]),
        ("accelerations", "body_acceleration", ["en14363", "comfort"]),
    ],
)
def test_values_that_are_no_numbers_are_an_input_error(name, stored, standards):
    """Also of accelerations, which had no estimate "of too few values", and comfort no words."""

    def broken(t, *of_wheels):
        last = (4, 2) if of_wheels else (len(BODIES), 3)
        values = np.full((len(t), *last), Q0 if of_wheels else 0.0)
        values[4_000, 0, 0] = np.nan
        return values

    run = made(ON_ZONE_4, 23.0, **{name: broken})
    for standard in standards:
        with pytest.raises(InputError, match=f"{stored}: holds values that are no numbers"):
            assess(run, standard)


def test_a_run_without_a_section_is_named_beside_others():
    """80 m of a run: it reaches no section, and was left out in silence."""
    runs = {"whole": made(ON_ZONE_4, 23.0), "short": made(ON_ZONE_4, 23.0, until=80.0)}
    (found,) = assess(runs)
    assert "not assessed: short: has no section" in found.remarks
    assert not any("whole" in remark for remark in found.remarks)


# for information ----------------------------------------------------------------------------------


def test_regression_over_cant_deficiency_and_curvature_of_all_curves():
    """Three radii at one cant: the deficiency follows from the curvature, and nothing is solved;
    with other cants it is."""

    def run(radius, cant):
        return made(
            track(*curve(radius, 500.0), cant=cant), 23.0, Y=sides(20e3 + 6e6 / radius, 0.0)
        )

    (found,) = assess({"a": run(290.0, 0.12), "b": run(320.0, 0.12), "c": run(340.0, 0.12)})
    assert found.influences == ()
    (found,) = assess({"a": run(290.0, 0.12), "b": run(300.0, 0.11), "c": run(290.0, 0.125)})
    row = next(
        one for one in found.influences if one.criterion.name == "Y_qst" and "1 outer" in one.place
    )
    assert row.regression.value == pytest.approx(40e3, rel=1e-4)
    assert row.regression.coefficients[2] == pytest.approx(6e6, rel=1e-3)
    assert found.record()["regression"][0]["radius"] == 300.0


def test_regression_takes_curves_of_both_hands_and_no_straight_track():
    """Right-hand ones of zone 4 and left-hand ones, 20 kN + 6 kN m/R; 9 kN on the straight."""

    def run(radius, cant):
        def Y(t, s):
            outer = np.where((s > 640.0) & (s < 1300.0), 20e3 + 6e6 / abs(radius), 9e3)
            each = (-outer, 0.0 * s) if radius > 0.0 else (0.0 * s, outer)
            return np.stack(each, axis=-1)

        return made(track(*curve(radius, 500.0, run=600.0), cant=cant), 23.0, Y=Y)

    radii = {"a": (290.0, 0.12), "b": (-300.0, -0.11), "c": (-290.0, -0.125)}
    (found,) = assess({name: run(*one) for name, one in radii.items()}, all_sections=True)
    rows = {(one.criterion.name, one.place): one.regression for one in found.influences}
    for row in rows["Y_qst", "wheelset 1 outer"], rows["sum_Y", "wheelset 1"]:
        assert row.value == pytest.approx(40e3, rel=1e-4)


def test_what_many_populations_lack_alike_is_one_sentence():
    """A study over friction, load and rails had its reasons on three screens, zone by zone."""
    places = [f"zone {zone}, friction {mu}" for mu in range(5) for zone in (2, 3)]
    lacking = [Condition("number of sections", p, "not met", "none", "25") for p in places]
    words = "number of sections not met: none; required 25"
    assert sentences(lacking) == [f"zone {zone}, 5 populations: {words}" for zone in (2, 3)]
    assert sentences(lacking[:8]) == [
        f"zone {zone}, friction {mu}: {words}" for zone in (2, 3) for mu in range(4)
    ]
    alone = [replace(lacking[0], place=place) for place in ("zone 2", "zone 4", "")]
    assert sentences(alone) == [f"zone 2: {words}", f"zone 4: {words}", words]
