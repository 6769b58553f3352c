"""Scenarios: speeds from the service table, sections of the shipped tracks, a small campaign."""

import json
import math

import pytest

import railsim
from railsim.assessment.sections import track_sections
from railsim.cli import main
from railsim.definitions.loading import load_running_limits, load_scenario
from railsim.errors import InputError
from railsim.studies.campaign import campaign, part_speed, scenario_cases


def test_campaign_has_all_zones_sections_and_both_irregularities():
    """25, 25, 50, 25 sections at least that count, over both spectra."""
    limits = load_running_limits("en14363")
    service = railsim.load_vehicle("coach_manchester").service
    counted = dict.fromkeys("1234", 0)
    radii = {zone: [] for zone in "1234"}
    cases = scenario_cases(load_scenario("en14363"), ["coach_manchester"])
    for case in cases:
        covered = (3.0 * case.speed + 11.0, case.track.length - 11.0)
        found = track_sections(case.track, limits, service, covered, lambda _, c=case: c.speed)
        for section in found:
            if not section.reason:
                counted[section.zone] += 1
                radii[section.zone].append(abs(section.radius))
    assert counted == {"1": 28, "2": 30, "3": 50, "4": 30}
    for zone in "34":
        low, high = limits.zones[zone].mean_radius
        assert low <= sum(radii[zone]) / len(radii[zone]) <= high
    assert len({case.name for case in cases}) == 8


def test_speed_from_the_cant_deficiency():
    """V^2 = g R (h + I)/1.5: LIBRARY's 23.0 m/s at R 300 m, cant 120 mm, 150 mm."""
    service = railsim.load_vehicle("coach_manchester").service
    speeds = {name: part_speed(part.speed, service)
              for name, part in load_scenario("en14363").parts.items()}  # fmt: skip
    assert speeds["zone4"] == pytest.approx(math.sqrt(9.81 * 300.0 * 0.27 / 1.5))
    assert speeds["zone1"] == pytest.approx(1.1 * 44.44444)
    assert [round(v, 1) for v in speeds.values()] == [48.9, 44.3, 29.7, 23.0]


SMALL = """format = "railsim-scenario/1"
name = "small"
standard = "en14363"
assignments = ["settings.output_rate=200", "settings.outputs.low_pass={ frequency = 80.0 }",
               "settings.outputs.sensors=true",
               "settings.outputs.quantities=['Q', 'Y', 'wheelset_distance']"]
[parts.zone4]
track = "en14363_zone4"
speed = { cant_deficiency = 1.0, radius = 300.0, cant = 0.12 }
until = 560.0
"""


@pytest.mark.slow
def test_small_campaign_ends_in_its_assessment_and_is_not_done_twice(tmp_path, capsys):
    (tmp_path / "small.toml").write_text(SMALL)
    arguments = ["study", "--scenario", str(tmp_path / "small.toml"), "--vehicles",
                 "coach_manchester", "--out", str(tmp_path / "out"), "--workers", "1", "--quiet"]
    assert main(arguments) == 0
    assert "zone 4: 3 of 25 sections" in capsys.readouterr().out
    data = json.loads((tmp_path / "out" / "assessment.json").read_text())
    assert data[0]["verdict"] in ("incomplete", "fail")
    again = campaign(tmp_path / "small.toml", "coach_manchester", out=tmp_path / "out", workers=1)
    assert again.computed == 0


def test_wrong_campaigns_are_refused(tmp_path, capsys):
    bare = tmp_path / "bare.toml"
    bare.write_text('format = "railsim-vehicle/1"\nextends = "coach_manchester"\n'
                    'remove = ["service"]\nname = "bare"\n')
    with pytest.raises(InputError, match="service"):
        scenario_cases(load_scenario("en14363"), [bare])
    for wrong in (
        ["--vehicles", "coach_manchester", "--speeds", "20"], [], ["--vehicles", "nobody"],
    ):  # fmt: skip
        assert main(["study", "--scenario", "en14363", "--out", str(tmp_path / "o"), *wrong]) == 2
        assert "Traceback" not in capsys.readouterr().err
    assert not (tmp_path / "o").exists()
