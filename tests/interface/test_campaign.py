"""Scenarios: speeds from the service table, sections of the shipped tracks, a small campaign."""

import json
import math
import re
from dataclasses import replace

import h5py
import numpy as np
import pytest
from example_result import feed
from made_record import made
from selection import points

import railsim
import railsim.studies.case
from railsim.assessment import assess
from railsim.assessment.sections import track_sections
from railsim.assessment.track_quality import TrackQuality
from railsim.cli import main
from railsim.definitions.loading import load_running_limits, load_scenario
from railsim.definitions.track.layout import track_remarks
from railsim.definitions.vehicle.flatten import flatten
from railsim.errors import InputError
from railsim.profiles import load_profile
from railsim.studies.campaign import (
    campaign,
    counting_sections,
    omissions,
    part_speed,
    scenario_cases,
    with_fitted_curves,
)


@points("vehicle", ["coach_manchester", "coach_flexicoil"], always=(0,))
def test_campaign_meets_the_conditions_of_the_standard(vehicle):
    """Sections, seeds, quality of the track, profiles, loads and hands, in each condition."""
    limits = load_running_limits("en14363")
    service = railsim.load_vehicle(vehicle).service
    cases = scenario_cases(load_scenario("en14363"), [vehicle])
    assert len({case.name for case in cases}) == len(cases)
    by_condition = {}
    for case in cases:
        by_condition.setdefault(case.labels["condition"], []).append(case)
    wheels, loads, seeds = set(), set(), []
    for state, own in by_condition.items():
        counted = {zone: [] for zone in "1234"}
        for case in own:
            assert case.vehicle.service.condition == state.replace("_", " ")
            # the permitted speed is that of 150 mm in the middle radius, also of scaled ones
            remarks = [r for r in track_remarks(case.track) if "a cant deficiency of" in str(r)]
            deficiencies = [int(re.search(r"deficiency of (\d+) mm", str(r))[1]) for r in remarks]
            assert max(deficiencies, default=0) <= 1.1 * 150.0
            wheels |= set(flatten(case.vehicle).of_kind("wheelset")[0].wheelset.profile)
            loads.add(case.vehicle.load)
            seeds.append(case.labels["seed"])
            covered = (3.0 * case.speed + 11.0, case.track.length - 12.0)
            found = track_sections(case.track, limits, service, covered, lambda _, c=case: c.speed)
            found = [section for section in found if not section.reason]
            quality = TrackQuality(case.track, found[0].begin, found[-1].end)
            deviations = [quality.deviations(s.begin, s.end) for s in found]
            target = limits.track_quality.middle(min(case.speed, service.admissible_speed))
            assert np.percentile(deviations, 90.0, axis=0) == pytest.approx(target, rel=0.02)
            counted[found[0].zone] += found
        for zone, sections in counted.items():
            assert len(sections) >= limits.zones[zone].sections
            radii = [abs(section.radius) for section in sections]
            low, high = limits.zones[zone].mean_radius or (0.0, math.inf)
            assert low <= sum(radii) / len(radii) <= high
            assert {section.turn for section in sections} == ({0} if zone == "1" else {1, -1})
    assert wheels == {"S1002", "S1002_hollow"}
    assert loads == {None, "laden"}
    assert len(set(seeds)) == len(seeds)


@pytest.mark.slow
def test_quiet_records_of_the_whole_campaign_pass_and_one_missing_run_does_not():
    """Made-up records on the tracks and vehicles of the campaign: every condition is met."""
    settings = '{"outputs": {"low_pass": {"frequency": 80.0}}, "output_rate": 200.0}'
    profiles = {name: load_profile(name) for name in ("S1002", "S1002_hollow", "60E1")}
    runs = {
        case.name: made(
            case.track, case.speed, rate=200.0, settings=settings, profiles=profiles,
            vehicle=case.vehicle.to_toml(),
        )
        for case in scenario_cases(load_scenario("en14363"), ["coach_manchester"])
    }  # fmt: skip
    (found,) = assess(runs)
    assert found.reasons == ()
    assert found.verdict == "pass"
    assert {verdict.value for verdict in found.verdicts.values()} == {"pass"}
    assert {condition.state for condition in found.conditions} == {"met"}
    (less,) = assess(dict(list(runs.items())[1:]))
    assert less.verdict == "incomplete"
    assert len(less.reasons) == 1
    assert "zone 1, new empty: number of sections not met: 14" in less.reasons[0]


FAULTS = """format = "railsim-scenario/1"
name = "faults"
standard = "en14363"
[conditions.whole]
[conditions.no_lateral_damper]
fault = true
remove = ["assemblies.bogie.elements.secondary_lateral_damper"]
[conditions.soft]
fault = true
assignments = ["vehicle.assemblies.bogie.elements.secondary_vertical_damper.damping=1.0"]
[conditions.crushed]
load = "crushed"
[parts.one]
track = "straight"
speed = { fixed = 20.0 }
"""


def test_fault_modes_change_the_vehicle_and_load_cases_that_are_unknown_are_left_out(tmp_path):
    scenario = tmp_path / "faults.toml"
    scenario.write_text(FAULTS)
    cases = scenario_cases(load_scenario(scenario), ["coach_manchester"])
    assert [case.labels["condition"] for case in cases] == ["whole", "no_lateral_damper", "soft"]
    (said,) = omissions(load_scenario(scenario), ["coach_manchester"], cases)
    needed = "which needs a load case 'crushed' (it has laden)"
    assert said.endswith(f"not tested in the condition 'crushed', {needed}")
    whole, removed, soft = (case.vehicle for case in cases)
    dampers = [len(flatten(v).elements) for v in (whole, removed, soft)]
    assert dampers[1] == dampers[0] - 4
    assert [v.service.fault for v in (whole, removed, soft)] == [False, True, True]
    assert soft.assemblies["bogie"].elements["secondary_vertical_damper"].damping == 1.0
    scenario.write_text(FAULTS.replace("secondary_lateral_damper", "no_such_damper"))
    with pytest.raises(InputError, match=r"remove: assemblies.bogie.elements.no_such_damper"):
        scenario_cases(load_scenario(scenario), ["coach_manchester"])


def test_runs_without_a_section_that_counts_are_told_before_they_are_run():
    """11 m/s, 100 mm: 1.5 V^2/(g R) is 35 mm at 600 m and 47 mm at 480 m; 75 mm are required."""
    scenario = load_scenario("en14363")
    slow = ["vehicle.service.admissible_speed=11.0", "vehicle.service.cant_deficiency=0.1"]
    cases = scenario_cases(scenario, ["coach_manchester"], slow)
    said = [words.split(": at ")[0] for words in omissions(scenario, ["coach_manchester"], cases)]
    conditions = {case.labels["condition"] for case in cases}
    assert {words.split("_seed")[0] for words in said} == {
        f"coach_manchester_{state}_{zone}" for state in conditions for zone in ("zone2", "zone3")
    }


def test_no_two_conditions_share_a_seed_of_a_part_that_is_repeated_often(tmp_path):
    """One to two sections a run of 25 needed: more than ten seeds for each condition."""
    scenario = tmp_path / "often.toml"
    head = "single = true\nto_standard = true\n[conditions.a]\n[conditions.b]"
    scenario.write_text(SMALL.replace("560.0", "400.0").replace("single = true", head))
    cases = scenario_cases(load_scenario(scenario), ["coach_manchester"])
    seeds = [case.labels["seed"] for case in cases]
    assert len(seeds) > 20
    assert len(set(seeds)) == len(seeds)


def test_speed_from_the_cant_deficiency():
    """V^2 = g R (h + I)/1.5: LIBRARY's 23.0 m/s at R 300 m, cant 120 mm, 150 mm."""
    service = railsim.load_vehicle("coach_manchester").service
    speeds = {name: part_speed(part.speed, service)
              for name, part in load_scenario("en14363").parts.items()}  # fmt: skip
    assert speeds["zone4"] == pytest.approx(math.sqrt(9.81 * 300.0 * 0.27 / 1.5))
    assert speeds["zone1"] == pytest.approx(1.1 * 33.33333)
    assert [round(v, 1) for v in speeds.values()] == [36.7, 35.0, 29.7, 23.0]


@points("vehicle", ["metro_b_motor", "wagon_uic_link", "locomotive_coco_a"], always=(0,))
def test_slow_vehicle_is_tested_in_every_zone_and_not_faster_than_it_may_run(vehicle):
    """80 and 100 km/h: radii scaled to the deficiency are below zone 2; it takes lower cants."""
    scenario, limits = load_scenario("en14363"), load_running_limits("en14363")
    service = railsim.load_vehicle(vehicle).service
    for number, part in enumerate(scenario.parts.values(), start=1):
        speed = part_speed(part.speed, service)
        assert speed <= 1.1 * service.admissible_speed + 1e-9
        drawn = railsim.load_track(part.track)
        track = with_fitted_curves(drawn, part.speed, service, limits)
        found = track_sections(track, limits, service, (100.0, track.length), lambda _, v=speed: v)
        counted = [one for one in found if not one.reason]
        assert {one.zone for one in counted} == {str(number)}
        if number > 1:
            middle = 1.0 / (9.81 * part.speed.radius)  # of the curves, whose radius may be scaled
            ratio = track.plan[2].radius / drawn.plan[2].radius
            cant = part.speed.cant * track.cant[2].cant / drawn.cant[2].cant
            deficiency = 1.5 * speed**2 * middle / ratio - cant
            assert deficiency == pytest.approx(service.cant_deficiency)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("radius = 300.0", "radius = 500.0", "radius: 500 m; 286 to 340 m in the"),
        ("cant = 0.12", "cant = 0.15", "cant: 150 mm; 120 mm in the curves of"),
        ("en14363_zone4", "straight", "radius: 300 m; 'straight' has no curve"),
        ("en14363_zone4", "flat.toml", "radius: 300 m; 'flat' has no curve"),
    ],
)
def test_curve_of_a_part_is_one_of_its_track(tmp_path, capsys, monkeypatch, old, new, words):
    """Zone 4 has curves of 286 to 340 m with 120 mm: 23 m/s on R 300 m is a mean of them."""
    file = tmp_path / "small.toml"
    file.write_text(SMALL.replace(old, new))
    flat = '{type = "CIR", length = 100.0, radius = inf}'
    text = f'format = "railsim-track/1"\nname = "flat"\nplan = [{flat}]\n'
    (tmp_path / "flat.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    command = ["study", "--scenario", str(file), "--vehicles", "coach_manchester", "--out"]
    for arguments in (["validate", str(file)], [*command, str(tmp_path / "out")]):
        assert main(arguments) == 2
        assert f"small.toml: parts.zone4.speed.{words}" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


SPEEDS = """format = "railsim-scenario/1"
name = "speeds"
standard = "comfort"
{more}
[parts.one]
track = "straight"
speed = {{ admissible = 1.2 }}
"""
SLOW = "vehicle.service.admissible_speed=20.0"


@pytest.mark.parametrize(
    ("more", "assignments"),
    [
        (f'assignments = ["{SLOW}"]', []),
        ('[grid]\n"vehicle.service.admissible_speed" = ["20.0"]', []),
        (f'[conditions.slow]\nassignments = ["{SLOW}"]', []),
        ("", [SLOW]),
    ],
)
def test_speed_of_a_part_follows_the_service_table_however_it_is_changed(
    tmp_path, more, assignments
):
    """1.2 times 20 m/s, whether file, grid, condition or command says so; 40 m/s before."""
    (tmp_path / "speeds.toml").write_text(SPEEDS.format(more=more))
    scenario = load_scenario(tmp_path / "speeds.toml")
    (case,) = scenario_cases(scenario, ["coach_manchester"], assignments)
    assert case.vehicle.service.admissible_speed == 20.0
    assert case.speed == case.labels["speed"] == pytest.approx(24.0)


@pytest.mark.parametrize("how", ["set", "grid"])
def test_curve_of_a_part_is_that_of_the_track_as_it_is_changed(tmp_path, capsys, how):
    """The speed is after R 250 m, and a command or a grid makes R 400 m of the curve."""
    grid = '[grid]\n"track.plan.2.radius" = ["400.0"]' if how == "grid" else ""
    text = SPEEDS.format(more=grid).replace("straight", "curve_r250")
    curve = "cant_deficiency = 1.0, radius = 250.0, cant = 0.15"
    file = tmp_path / "curve.toml"
    file.write_text(text.replace("admissible = 1.2", curve))
    command = ["study", "--scenario", str(file), "--vehicles", "coach_manchester"]
    more = ["--set", "track.plan.2.radius=400.0"] if how == "set" else []
    assert main([*command, *more, "--out", str(tmp_path / "out")]) == 2
    assert "parts.one.speed.radius: 250 m; 400 m in the curves" in capsys.readouterr().err


WRONG = """format = "railsim-scenario/1"
name = "wrong"
standard = "comfort"
assignments = ["settings.output_rat=200"]
[conditions.worn]
wheels = { S1002 = "no_wheel.csv" }
[parts.one]
track = "no_track"
speed = { fixed = 20.0 }
"""


def test_scenario_is_checked_as_it_is_run(tmp_path, capsys):
    """`validate` found nothing wrong in it; the run said that --set was, which nobody gave."""
    file = tmp_path / "wrong.toml"
    file.write_text(WRONG)
    command = ["study", "--scenario", str(file), "--vehicles", "coach_manchester", "--out"]
    for arguments in (["validate", str(file)], [*command, str(tmp_path / "out")]):
        assert main(arguments) == 2
        found = capsys.readouterr().err.splitlines()
        words = (
            "no_track: no file 'no_track'",
            f"{file}: settings.output_rat: unknown key",
            f"{file}: conditions.worn.wheels.S1002: profile 'no_wheel.csv': ",
        )
        assert all(sum(line.startswith(one) for line in found) == 1 for one in words), found


def test_files_beside_a_scenario_are_found_from_anywhere(tmp_path, monkeypatch):
    """As those beside a study or a vehicle."""
    folder, elsewhere = tmp_path / "mine", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    track = railsim.load_track("straight")
    track.replace(name="Mine").save(folder / "mine.toml")
    wheel = load_profile("S1002")
    rows = "\n".join(f"{y:.6f},{z:.6f}" for y, z in zip(wheel.y, wheel.z, strict=True))
    (folder / "wheel.csv").write_text(f"y,z\n{rows}\n")
    head = WRONG.replace("output_rat=", "output_rate=").replace("no_track", "mine.toml")
    (folder / "scenario.toml").write_text(head.replace("no_wheel", "wheel"))
    monkeypatch.chdir(elsewhere)
    assert main(["validate", str(folder / "scenario.toml")]) == 0
    (case,) = scenario_cases(load_scenario(folder / "scenario.toml"), ["coach_manchester"])
    assert case.track.name == "Mine"
    wheels = set(flatten(case.vehicle).of_kind("wheelset")[0].wheelset.profile)
    assert wheels == {str((folder / "wheel.csv").resolve())}


SMALL = """format = "railsim-scenario/1"
name = "small"
standard = "en14363"
assignments = ["settings.output_rate=200", "settings.outputs.low_pass={ frequency = 80.0 }",
               "settings.outputs.sensors='readings'",
               "settings.outputs.quantities=['Q', 'Y', 'wheelset_distance']"]
single = true
[parts.zone4]
track = "en14363_zone4"
speed = { cant_deficiency = 1.0, radius = 300.0, cant = 0.12 }
until = 560.0
"""


@pytest.mark.slow
def test_small_campaign_ends_in_its_assessment_and_is_not_done_twice(tmp_path, capsys):
    (tmp_path / "small.toml").write_text(SMALL)
    arguments = [
        "study",
        "--scenario",
        str(tmp_path / "small.toml"),
        "--vehicles",
        "coach_manchester",
        "--out",
        str(tmp_path / "out"),
        "--workers",
        "1",
        "--quiet",
    ]
    assert main(arguments) == 0
    assert "zone 4: 3 of 25 sections" in capsys.readouterr().out
    data = json.loads((tmp_path / "out" / "assessment.json").read_text())
    assert data[0]["verdict"] in ("incomplete", "fail")
    with h5py.File(next((tmp_path / "out").glob("*.h5"))) as file:
        assert {name for name in file if name.startswith("sensor_")} == {
            "sensor_acceleration", "sensor_roll_rate"
        }  # fmt: skip
        assert file["Q"].dtype == "f4"
        assert file["distance"].dtype == "f8"
    again = campaign(tmp_path / "small.toml", "coach_manchester", out=tmp_path / "out", workers=1)
    assert again.computed == 0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ('settings.outputs.quantities=["Q"]', "outputs.quantities: without Y, wheelset_distance;"),
        ("settings.outputs={}", "output_rate: 200 samples per second; at least 1000"),
    ],
)
def test_outputs_that_cannot_be_assessed_are_refused_before_any_run(
    tmp_path, capsys, monkeypatch, change, words
):
    monkeypatch.setattr("railsim.studies.campaign.carry_out_cases", None)
    (tmp_path / "small.toml").write_text(SMALL)
    given = ["study", "--scenario", str(tmp_path / "small.toml"), "--vehicles", "coach_manchester"]
    assert main([*given, "--out", str(tmp_path / "out"), "--set", change]) == 2
    assert f"--set: settings.{words}" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_wrong_campaigns_are_refused(tmp_path, capsys):
    bare = tmp_path / "bare.toml"
    bare.write_text(
        'format = "railsim-vehicle/1"\nextends = "coach_manchester"\n'
        'remove = ["service"]\nname = "bare"\n'
    )
    with pytest.raises(InputError, match="service"):
        scenario_cases(load_scenario("en14363"), [bare])
    for wrong in (
        ["--vehicles", "coach_manchester", "--speeds", "20"], [], ["--vehicles", "nobody"],
    ):  # fmt: skip
        assert main(["study", "--scenario", "en14363", "--out", str(tmp_path / "o"), *wrong]) == 2
        assert "Traceback" not in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


TWO = """format = "railsim-scenario/1"
name = "two"
standard = "wear"
assignments = ["settings.output_rate=1000"]
[grid]
"track.name" = ["../../outside", "b c"]
[parts.one]
track = "straight"
speed = { fixed = 20.0 }
"""
RUNS = ["coach_manchester_one_..-..-outside", "coach_manchester_one_bc"]


@pytest.fixture
def simulated(monkeypatch):
    """Number of runs before Ctrl-C; results are made up, and nothing is assessed."""
    left = [99]

    def simulate(*_, sink, **how):
        if not left[0]:
            raise KeyboardInterrupt
        left[0] -= 1
        return feed(sink, duration=1.0, rate=10.0)

    monkeypatch.setattr(railsim.studies.case, "simulate", simulate)
    monkeypatch.setattr(railsim.studies.campaign, "assess", lambda *_, **how: [])
    return left


def test_report_of_a_scenario_is_titled_by_its_name(tmp_path, simulated):
    out = tmp_path / "comfort"
    given = ["study", "--scenario", "comfort_speeds", "--vehicles", "coach_manchester", "--report"]
    assert main([*given, "--out", str(out), "--workers", "1", "--quiet"]) == 0
    text = (out / "report.html").read_text(encoding="utf-8")
    assert "<h1>Comfort over speed</h1>" in text
    assert "10 runs" in text


def state(folder):
    return {run["name"]: run["status"] for run in json.loads(folder.read_text())["runs"]}


def test_interrupted_campaign_loses_nothing_and_goes_on(tmp_path, simulated, capsys):
    scenario, out = tmp_path / "two.toml", tmp_path / "deep" / "out"
    scenario.write_text(TWO)
    given = ["study", "--scenario", str(scenario), "--vehicles", "coach_manchester"]
    given += ["--out", str(out), "--workers", "1"]
    simulated[0] = 1
    assert main(given) == 130
    assert state(out / "study.json") == dict(zip(RUNS, ["complete", "waiting"], strict=True))
    assert {path.name for path in tmp_path.iterdir()} == {"two.toml", "deep"}
    # neither the scenario nor the vehicles need be given again
    simulated[0] = 1
    assert main(["study", "--resume", "--out", str(out), "--workers", "1"]) == 0
    assert state(out / "study.json") == dict.fromkeys(RUNS, "complete")
    assert len((out / "summary.csv").read_text().splitlines()) == 3
    (out / f"{RUNS[0]}.h5").write_bytes(b"damaged")
    simulated[0] = 1
    assert main([*given, "--resume"]) == 0
    assert "computed again" in capsys.readouterr().err
    simulated[0] = 0
    assert main(given) == 0
    # another campaign does not go into the same folder
    assert main([*given, "--set", "track.friction=0.3"]) == 2
    assert "holds a study with other assignments" in capsys.readouterr().err


@pytest.mark.parametrize(("status", "left"), [("complete", 0), ("derailed", 3), ("stopped", 3)])
def test_exit_status_tells_of_runs_that_ended_early(tmp_path, simulated, monkeypatch, status, left):
    """As of a study without a scenario."""

    def simulate(*_, sink, **how):
        return feed(sink, duration=1.0, rate=10.0, status=status)

    monkeypatch.setattr(railsim.studies.case, "simulate", simulate)
    (tmp_path / "two.toml").write_text(TWO)
    given = ["study", "--scenario", str(tmp_path / "two.toml"), "--vehicles", "coach_manchester"]
    given += ["--out", str(tmp_path / "out"), "--workers", "1", "--quiet"]
    assert main(given) == left
    assert main(given) == left


def test_failed_run_of_a_campaign_is_a_line(tmp_path, monkeypatch, capsys):
    def simulate(*_, **how):
        raise railsim.errors.ModelError("no equilibrium")

    monkeypatch.setattr(railsim.studies.case, "simulate", simulate)
    scenario = tmp_path / "two.toml"
    scenario.write_text(TWO)
    given = ["study", "--scenario", str(scenario), "--vehicles", "coach_manchester", "--quiet"]
    assert main([*given, "--out", str(tmp_path / "out"), "--workers", "1"]) == 1
    error = capsys.readouterr().err
    assert error.startswith("railsim: 2 of 2 runs failed: ")
    assert error.count("\n") == 1
    assert set(state(tmp_path / "out" / "study.json").values()) == {"failed"}


def test_campaign_of_a_million_runs_is_told_at_once(tmp_path, capsys):
    many = [f"{k}" for k in range(1000)]
    scenario = tmp_path / "many.toml"
    scenario.write_text(
        TWO.split("[grid]")[0] + f'[grid]\n"track.friction" = {many}\n'
        f'"track.gauge" = {many}\n' + TWO[TWO.index("[parts") :]
    )
    given = ["study", "--scenario", str(scenario), "--vehicles", "coach_manchester"]
    assert main([*given, "--out", str(tmp_path / "out")]) == 2
    assert "1,000,000 runs, some" in capsys.readouterr().err


def test_runs_of_one_name_are_refused(tmp_path, capsys):
    scenario = tmp_path / "two.toml"
    scenario.write_text(TWO.replace("b c", "../../outside "))
    given = ["study", "--scenario", str(scenario), "--vehicles", "coach_manchester"]
    assert main([*given, "--out", str(tmp_path / "out")]) == 2
    assert "2 runs of this name" in capsys.readouterr().err


def test_sections_that_count_do_not_depend_on_the_origin_of_the_vehicle():
    """The x of the origin is arbitrary: the same coach drawn 40 m further ahead."""
    limits = load_running_limits("en14363")
    case = scenario_cases(load_scenario("en14363"), ["coach_manchester"])[0]
    bogies = "assemblies.bogie.placements"
    ahead = {f"{bogies}.front.position.0": 49.5, f"{bogies}.rear.position.0": 30.5}
    moved = case.vehicle.with_values({"bodies.carbody.position.0": 40.0, **ahead})
    found = [
        counting_sections(case.track, replace(case, vehicle=vehicle), limits, vehicle.service)
        for vehicle in (case.vehicle, moved)
    ]
    assert found[0] == found[1]
