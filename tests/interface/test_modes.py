"""``railsim modes``: table, root locus, JSON, pictures, and what is refused."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from selection import points

import railsim
from railsim.cli import main
from railsim.errors import InputError
from railsim.linear.modes import Mode, Modes, RootLocus, numbered
from railsim.linear.vehicle import Contact
from railsim.model import assembly
from railsim.profiles import load_profile


def test_modes_at_one_speed(capsys):
    assert main(["modes", "coach_manchester", "--speed", "30", "--quiet"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "30 m/s, straight track" in lines[0]
    assert lines[0].endswith("contact tangent")
    assert any(line.startswith("lower sway") for line in lines)
    assert any(line.startswith("front hunting") for line in lines)


def test_what_was_put_right_in_a_profile_is_told_as_by_run(monkeypatch, capsys):
    turned = replace(load_profile("S1002"), notes=("flange at positive y: mirrored", "sorted by y"))
    profiles = {"S1002": turned, "60E1": load_profile("60E1")}
    monkeypatch.setattr(assembly, "load_profile", lambda name, kind: profiles[name])
    assert main(["modes", "coach_manchester"]) == 0
    words = "Profile S1002: flange at positive y: mirrored; sorted by y."
    assert f"remark: {words}" in capsys.readouterr().out
    coach = railsim.load_vehicle("coach_manchester")
    given = railsim.modes(coach, profiles={"S1002": turned})
    assert not any("mirrored" in one for one in given.remarks)  # its owner has the notes


@pytest.mark.parametrize("command", [["modes"], ["info", "--static"]])
def test_a_vehicle_of_another_gauge_is_told_where_its_track_is_named(command, tmp_path, capsys):
    path = tmp_path / "metre.toml"
    path.write_text(
        'format = "railsim-vehicle/1"\nname = "Metre gauge"\nextends = "coach_manchester"\n'
        "[assemblies.bogie.assemblies.axle.wheelsets.wheelset]\nback_to_back = 0.925\n"
    )
    assert main([*command, str(path)]) == 2
    said = capsys.readouterr().err
    assert "falls between the rails" in said
    assert "the track is 'Straight track, 1000 m', for another gauge name its own (TRACK" in said


def test_what_the_table_leaves_out_is_counted():
    """Above 50 Hz, decaying without oscillation; a mode that a locus lacks here is none."""
    values = [-1.0 + 376.0j, -1.0 + 390.0j, -3.0 + 0.0j, complex(np.nan), -1.0 + 12.0j]
    found = Modes(20.0, Contact(), tuple(Mode("", value, {}, {}) for value in values))
    assert len(found.table().records()) == 1
    assert found.notes == ("2 oscillations above 50 Hz and 1 modes that do not oscillate: --json",)


def test_oscillations_are_numbered_by_rising_frequency_before_what_does_not_oscillate():
    """Of this coach some lateral modes of the bogies do not oscillate, and are slower."""
    found = railsim.modes(railsim.load_vehicle("coach_flexicoil"), speed=44.4)
    names = [mode.name for mode in found.oscillations]
    assert names == numbered([re.sub(r" \d+$", "", name) for name in names])
    still = {mode.name for mode in found if not mode.oscillates}
    assert len(still) + len(names) == len(found.modes)
    assert not still.intersection(names)


def test_modes_of_a_locus_have_names_of_their_own():
    """Numbers of one value say nothing about another: two modes are "lateral 2" at most values."""
    borne = [
        ("lateral", "lateral 2", "pitch"),
        ("lateral", "lateral 2", "roll"),
        ("lateral", "yaw", "lateral 2"),
        ("lateral", "bounce", "lateral 2"),
    ]
    sets = [
        Modes(20.0, Contact(), tuple(Mode(name, 1j, {}, {}) for name in names)) for names in borne
    ]
    found = RootLocus("speed", (10.0, 20.0, 30.0, 40.0), tuple(sets))
    assert found.names == ("lateral", "lateral 2", "lateral 3")
    there = found.record()[3]["modes"]
    assert [mode["name"] for mode in there] == ["lateral", "bounce", "lateral 2"]
    assert [mode["branch"] for mode in there] == list(found.names)


@pytest.mark.parametrize(
    ("key", "places", "words"),
    [
        ("speed", ["straight, upright"], "straight, upright, contact tangent"),
        ("speed", ["straight, mu 0.3", "straight, mu 0.4"], "straight, contact tangent"),
        ("mass", ["radius 300 m", "radius 400 m"], "20 m/s, contact tangent"),
    ],
)
def test_a_title_of_a_locus_says_what_does_not_change_along_it(key, places, words):
    sets = tuple(Modes(20.0, Contact(), (), place=place, vehicle="coach") for place in places)
    values = tuple(range(len(places)))
    assert RootLocus(key, values, sets).title == f"coach: {words}"


def test_a_branch_of_a_locus_keeps_its_name_where_another_one_is_missing():
    """In records, which leave out what is not there at a value."""
    absent = complex(np.nan)
    sets = [
        Modes(20.0, Contact(), tuple(Mode("sway", value, {}, {}) for value in values))
        for values in ((1j, 2j), (absent, 3j))
    ]
    records = RootLocus("speed", (10.0, 20.0), tuple(sets)).record()
    branches = [{m["branch"]: m["eigenvalue"][1] for m in one["modes"]} for one in records]
    assert branches == [{"sway": 1.0, "sway 2": 2.0}, {"sway 2": 3.0}]


def test_root_locus_in_json_and_folder(capsys, tmp_path):
    folder = tmp_path / "modes"
    arguments = [
        "modes",
        "coach_manchester",
        "--speeds",
        "20:30:2",
        "--linearisation",
        "harmonic",
        "--out",
        str(folder),
        "--json",
        "--quiet",
    ]
    assert main(arguments) == 0
    records = json.loads(capsys.readouterr().out)
    assert [record["speed"] for record in records] == [20.0, 30.0]
    mode = records[0]["modes"][0]
    assert set(mode) == {
        "name",
        "branch",
        "frequency",
        "natural_frequency",
        "damping_ratio",
        "eigenvalue",
        "participation",
        "shape",
    }
    assert records[0]["amplitude"] == 3e-3
    assert json.loads((folder / "modes.json").read_text()) == records
    assert (folder / "modes.png").stat().st_size > 1000
    assert main(arguments) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_root_locus_over_a_key(capsys):
    command = ["modes", "coach_manchester", "--over", "track.friction=0.2:0.4:2", "--quiet"]
    assert main([*command, "--json"]) == 0
    records = json.loads(capsys.readouterr().out)
    assert [record["parameter"]["value"] for record in records] == [0.2, 0.4]
    # what varies does not stand among what is the same
    assert main(command) == 0
    words = ": 20 m/s, straight track, rails ballasted, contact tangent; least damped"
    assert words in capsys.readouterr().out
    mass = ["modes", "coach_manchester", "--over", "vehicle.carbody.mass=3e4:4e4:2", "--quiet"]
    assert main(mass) == 0
    assert "\nvehicle.carbody.mass (kg)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--speed", "0"], "--speed"),
        (["--speed", "nan"], "--speed"),
        (["--speeds", "10:20"], "--speeds"),
        (["--speeds", "10:20:0"], "--speeds"),
        (["--speeds", "10:20:2", "--over", "track.friction=0.2:0.4:2"], "--over"),
        (["--over", "track.nothing=0.2:0.4:2"], "--over: nothing"),
        (["--hold", "carbdy"], "carbody"),
        (["--hold", "front.outer.wheelset"], "--held"),
        (["--radius", "2"], "--radius"),
        (["--cant", "2"], "--cant"),
        (["--conicity", "3"], "--conicity"),
        (["--linearisation", "harmonic", "--amplitude", "0.2"], "--amplitude"),
        (["--linearisation", "harmonic", "--amplitude", "-1"], "--amplitude"),
        (["--amplitude", "0.001"], "--amplitude goes with --linearisation harmonic"),
        (["--amplitude", "0.003"], "--amplitude goes with --linearisation harmonic"),  # default
        (["--set", "vehicle.bodies.carbody.mas=3"], "mas"),
        (["--radius", "100", "--speed", "60"], "no steady state"),
        (["--speeds", "10:20:2", "--speed", "20"], "--speed:"),
    ],
)
def test_wrong_input_is_told_in_a_line(capsys, arguments, words):
    assert main(["modes", "coach_manchester", "--quiet", *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error


def test_an_amplitude_of_the_tangent_is_refused_in_python():
    with pytest.raises(InputError, match=r"amplitude: found 0\.001 m; only with"):
        railsim.modes(railsim.load_vehicle("coach_manchester"), speed=20.0, amplitude=1e-3)


@pytest.mark.usefixtures("small_contact_tables")
def test_a_vehicle_of_which_all_is_held_has_no_modes(capsys):
    wheelset = Path(__file__).parents[1] / "data" / "vehicles" / "single_wheelset.toml"
    assert main(["modes", str(wheelset), "--held"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert said[-1] == "--held: nothing is left that moves; hold fewer bodies"


@pytest.mark.parametrize(("cant", "told"), [("0.1", True), ("-0.1", False)])
def test_cant_of_a_left_hand_curve_is_negative(capsys, cant, told):
    """As in track files: with 0.1 m the inner rail would be the higher one."""
    assert main(["modes", "coach_manchester", "--radius", "-600", "--cant", cant]) == 0
    said = "".join(capsys.readouterr())
    assert ("cant on the wrong side" in said) == told
    assert f"cant {1e3 * float(cant):g} mm (positive: left rail higher)" in said


@pytest.fixture
def undrawn():
    """Without the picture beside an animation."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("railsim.plot.style.to_bytes", lambda _: b"")
        yield


@pytest.mark.usefixtures("undrawn")
def test_a_mode_is_animated(capsys, tmp_path):
    folder = tmp_path / "modes"
    arguments = [
        "modes",
        "coach_manchester",
        "--speed",
        "30",
        "--quiet",
        "--out",
        str(folder),
        "--overwrite",
    ]
    assert main([*arguments, "--animate", "front hunting"]) == 0
    assert str(folder / "mode.html") in capsys.readouterr().out
    assert "front hunting" in (folder / "mode.html").read_text()
    assert main([*arguments, "--animate", "front huntin"]) == 2
    assert "front hunting" in capsys.readouterr().err


@pytest.mark.usefixtures("undrawn")
def test_all_modes_of_one_speed_are_animated_and_named_after_what_moves(capsys, tmp_path):
    out = ["--speed", "30", "--quiet", "--out", str(tmp_path)]
    assert main(["modes", "wagon_y25", *out, "--overwrite"]) == 0
    assert str(tmp_path / "modes.html") in capsys.readouterr().out
    data = json.loads(
        re.search(r'id="data">(.*?)</script>', (tmp_path / "modes.html").read_text())[1]
    )
    names = [mode["name"].split(" · ")[0] for mode in data["modes"]]
    told = [mode["name"] for mode in json.loads((tmp_path / "modes.json").read_text())["modes"]]
    assert set(names) <= set(told)
    assert len(names) == len(set(names)) > 20
    assert {"lower sway", "car body bounce", "bogie pitch, in phase"} < set(names)
    assert {"wheelsets longitudinal, front", "wheelsets longitudinal, rear"} < set(names)
    assert not [name for name in names if "." in name or "_" in name]
    assert {len(mode["pose"]) for mode in data["modes"]} == {40}
    # the file says which vehicle these modes are of
    again = [
        str(tmp_path / "modes.json"),
        "--mode",
        "lower sway",
        "--out",
        str(tmp_path / "a.html"),
    ]
    assert main(["animate", *again]) == 0
    assert "lower sway" in (tmp_path / "a.html").read_text()


@pytest.mark.parametrize(
    "arguments",
    [
        ["--animate", "front hunting"],
        ["--animate", "front hunting", "--speeds", "10:20:2", "--out", "modes"],
    ],
)
def test_an_animation_needs_one_speed_and_a_folder(capsys, arguments):
    assert main(["modes", "coach_manchester", "--quiet", *arguments]) == 2
    assert "--animate" in capsys.readouterr().err


def test_a_root_locus_as_named_arrays():
    locus = railsim.root_locus(railsim.load_vehicle("coach_manchester"), speeds=[20.0, 30.0])
    data = locus.to_xarray()
    mode = data.sel(speed=30.0, mode="front hunting")
    there = locus.sets[1].modes[locus.names.index("front hunting")]
    assert float(mode["damping_ratio"]) == pytest.approx(there.damping_ratio)
    assert float(mode["frequency"]) == pytest.approx(there.frequency)
    rate = 2.0 * np.pi * data["natural_frequency"]
    np.testing.assert_allclose(rate, np.abs(data["eigenvalue"]))  # NaN where a mode is not
    alone = locus.sets[1].to_xarray().sel(speed=30.0, mode="front hunting")
    assert float(alone["damping_ratio"]) == pytest.approx(there.damping_ratio)


@points(
    "found",
    [
        lambda coach: railsim.modes(coach),
        lambda coach: railsim.root_locus(coach, speeds=[20.0, 25.0]),
        lambda coach: railsim.curving(coach, radius=[600.0]),
        lambda coach: railsim.critical_speed(coach, methods=("linear",), low=20.0, high=30.0),
    ],
    always=(1, 2),
)
def test_results_draw_themselves(found, tmp_path):
    result = found(railsim.load_vehicle("coach_manchester"))
    figure = result.plot(tmp_path / "picture.png", title="What was analysed")
    assert "What was analysed" in (figure._suptitle or figure.axes[0].title).get_text()
    assert (tmp_path / "picture.png").stat().st_size > 1000
    with pytest.raises(railsim.InputError, match="exists"):
        result.plot(tmp_path / "picture.png")
