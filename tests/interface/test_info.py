"""``railsim info``: what files hold, on one screen."""

import json
import math
import re

import pytest
from example_result import example_result

from railsim import cli
from railsim.cli import main
from railsim.definitions.loading import load_track, load_vehicle
from railsim.description.tracks import describe_track
from railsim.plot.vehicle import vehicle_figure


def lines_of(capsys, *arguments):
    assert cli.main(["info", *arguments]) == 0
    return capsys.readouterr().out.splitlines()


def data_of(capsys, *arguments):
    return json.loads("\n".join(lines_of(capsys, "--json", *arguments)))


def test_vehicle_fits_on_a_screen(capsys):
    lines = lines_of(capsys, "coach_manchester")
    assert len(lines) < 40
    text = "\n".join(lines)
    for part in ("56.110 t", "front.outer.wheelset", "S1002", "bogie.axle.primary", "bump_stop"):
        assert part in text
    assert "preload of 12 elements" in lines[-1]


def test_speed_in_kilometres_an_hour_is_seen(capsys):
    """80, meant as km/h, is read as m/s."""
    lines = lines_of(capsys, "coach_manchester", "--set", "service.admissible_speed=80")
    assert "  service: passenger, up to 288 km/h and 150 mm of cant deficiency" in lines


def test_axleboxes_and_elements_of_a_vehicle_are_told_with_their_numbers(capsys):
    """Two bogies of two wheelsets with two axleboxes each, which only pitch."""
    lines = lines_of(capsys, "coach_25t")
    cells = [line.split() for line in lines]
    box = ["axlebox", "rear.outer.wheelset", "0", "0", "8", "0", "-10.300"]  # 8.43 kg m2
    assert ["rear.outer.arm.left", *box, "-1.000", "-0.458"] in cells
    body = ["carbody", "body", "38600", "92800", "2821000", "2795000", "0.000", "0.000", "-2.081"]
    assert body in cells
    numbers = {row[0]: int(row[2]) for row in cells if row and row[0].startswith("bogie.")}
    assert numbers["bogie.axle.arm_bush"] == 8
    assert f" {sum(numbers.values())} elements" in lines[1]


def test_vehicle_as_json_is_placed_and_mirrored(capsys):
    data = data_of(capsys, "coach_manchester")
    assert data["mass"] == pytest.approx(56110.0)
    # all of the weight on eight wheels
    assert data["mean_wheel_load"] == pytest.approx(56110.0 * 9.81 / 8.0)
    wheelsets = [body["name"] for body in data["bodies"] if body["kind"] == "wheelset"]
    assert wheelsets[0] == "front.outer.wheelset"
    assert len(data["elements"]) == 34


def test_vehicle_as_json_has_what_the_screen_says_of_service_and_load(capsys):
    """120 km/h, 150 mm of cant deficiency; design load, or laden."""
    assert main(["info", "coach_manchester", "--load", "laden", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert 3.6 * data["service"]["admissible_speed"] == pytest.approx(120.0)
    assert data["service"]["cant_deficiency"] == 0.15
    assert (data["load"], data["loads"]) == ("laden", ["laden"])


def test_value_can_be_replaced_before_looking(capsys):
    data = data_of(capsys, "coach_manchester", "--set", "bodies.carbody.mass=40000")
    assert data["bodies"][0]["mass"] == 40000.0


def test_track_shows_curves_with_their_speeds(capsys):
    lines = lines_of(capsys, "curve_r250", "--speed", "20")
    circle = next(line for line in lines if line.startswith("CIR"))
    # balanced: sqrt(0.15 * 9.81 / 1.5 * 250) = 15.66 m/s; at 20 m/s 244.6 - 150 mm are missing
    assert circle.split() == ["CIR", "360", "420", "250", "150", "56.4", "79.7", "95"]


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_cant_deficiency_is_positive_outwards_on_either_hand(capsys, direction):
    sets = [f"plan.2.radius={250.0 * direction}", f"cant.2.cant={0.15 * direction}"]
    options = [text for pair in sets for text in ("--set", pair)]
    data = data_of(capsys, "curve_r250", "--speed", "20", *options)
    circle = data["plan"][2]
    assert circle["cant_deficiency"]["20.0"] == pytest.approx(1.5 * 400 / 250 / 9.81 - 0.15)
    assert circle["balanced_speed"] == pytest.approx(math.sqrt(0.15 * 9.81 / 1.5 * 250.0))
    assert data["plan"][0]["radii"] == [None, None]  # infinite


def test_gradients_are_shown(capsys, tmp_path):
    path = tmp_path / "hill.toml"
    path.write_text(
        'format = "railsim-track/1"\nname = "hill"\nplan = [{type="STR", length=300.0}]\n'
        'vertical = [{type="CST", length=100.0, gradient=0.0}, {type="LIR", length=100.0},'
        '{type="CST", length=100.0, gradient=0.01}]\n'
    )
    assert any("0 to 10" in line for line in lines_of(capsys, str(path)))


def test_cant_within_an_element_of_the_plan_is_shown(capsys):
    lines = lines_of(capsys, "twist")  # 50 mm on one straight
    assert lines[lines.index("CST          0      50           0") + 2].split() == [
        "LIR", "65", "67.5", "32.5", "to", "50",
    ]  # fmt: skip
    assert not any(line.startswith("LIR") for line in lines_of(capsys, "curve_r250"))


def test_speeds_of_a_curve_in_which_a_cant_ramp_ends_are_told_with_the_cant_they_take(capsys):
    # the ramp of 150 mm goes on for 30 m of the circle of 60 m: 100 mm at its begin
    ramp = ["--set", "cant.1.length=90.0", "--set", "cant.2.length=30.0"]
    lines = lines_of(capsys, "curve_r250", "--speed", "20", *ramp)
    circle = next(line for line in lines if line.startswith("CIR"))
    assert circle.split()[3:] == ["250", "100", "to", "150", "56.4", "79.7", "95"]
    assert "speeds and deficiencies of a curve: with the cant at its middle" in lines
    thirds = ["--set", "cant.1.length=70.0", "--set", "cant.2.length=50.0"]
    lines = lines_of(capsys, "curve_r250", *thirds)
    assert any("  0 to 128.57" in line for line in lines if line.startswith("CLO"))


def test_irregularities_are_shown(capsys):
    option = 'irregularities=[{type="random", spectrum="erri_b176_low", seed=7}]'
    lines = lines_of(capsys, "straight", "--set", option)
    assert lines[-1].startswith("random")
    assert "seed 7" in lines[-1]


def test_friction_and_widening_along_the_track_are_shown(capsys, tmp_path):
    path = tmp_path / "t.toml"
    path.write_text(
        'format = "railsim-track/1"\nname = "t"\ncant_rotation = "inner_rail"\n'
        'plan = [{type="STR", length=50.0}]\nfriction_table = [[0.0, 0.3]]\n'
        "gauge_widening = [[0.0, 0.0], [50.0, 0.012]]\n"
    )
    text = "\n".join(lines_of(capsys, str(path)))
    assert "friction 0.3," in text
    assert "gauge widened by up to 12 mm" in text
    assert "about the inner rail" in text


def test_what_a_track_file_gives_is_told_in_the_units_of_the_trade(capsys, tmp_path):
    """Arc lengths in m, mileage in km, an inclination of 0.025 as 1:40."""
    path = tmp_path / "t.toml"
    given = [
        'format = "railsim-track/1"', 'name = "t"', 'source = "survey"', "gauge = 1.435",
        'plan = [{type="STR", length=250.0}]', "inclination = 0.025", "friction = [0.3, 0.4]",
        "rounding = 8.0", "speed = 25.0", "mileage = 12300.0", "falling_mileage = true",
        "friction_falling = {rest = 0.4, decay = 0.6}", "third_body = [1.0, 0.5]",
    ]  # fmt: skip
    rows = [[float(s), 0.0, 1e-3, 0.0, 1e-3] for s in range(20, 60, 10)]
    measured = f'irregularities = [{{type = "measured", rows = {rows}, shift = 5.0}}]'
    path.write_text("\n".join([*given, measured]))
    lines = lines_of(capsys, str(path))
    assert lines[:9] == [
        "t",
        "  250 m, gauge 1435 mm, rail 60E1 1:40, friction 0.3 / 0.4, rounded over 8 m",
        "  rails elastic, ballasted",
        "  permitted speed 25 m/s (90 km/h)",
        "  mileage from km 12.300 to km 12.050",
        "  friction with slip down to 0.4 of it, 0.6 s/m",
        "  third body: Kalker's coefficients times 1.0 / 0.5",
        "  source: survey",
        "",
    ]
    track = load_track(path)
    data = describe_track(track, []).data
    assert data["mileage"] == (12300.0, 12050.0)
    (part,) = data["irregularities"]
    assert (part["number"], part["first"], part["last"]) == (4, 25.0, 55.0)
    assert "rows" not in part
    assert "4 rows from s = 25 to 55 m, z_left up to 1.00 mm, 1.00 mm between" in "\n".join(lines)
    rising = describe_track(track.replace(falling_mileage=False), [0.5])  # m/s
    assert "  mileage from km 12.300 to km 12.550" in rising.parts
    # what is not given is not told
    plain = track.replace(falling_mileage=False, mileage=0.0, third_body=1.0)
    text = "\n".join(map(str, describe_track(plain, []).parts))
    assert "friction 0.3 / 0.4" in text
    assert "mileage" not in text
    assert "rail 60E1 upright," in describe_track(track.replace(inclination=0.0), []).parts[1]
    assert "third body" not in text


def test_crossings_and_check_rails_are_told():
    """The list has 91 sections in its range; the narrowest flangeway is 41 mm."""
    found = describe_track(load_track("crossing_56e1_r245_1in9.25"), [])
    assert "  right rail of 91 sections from s = 49.45 to 51.68 m" in found.parts
    (words,) = (line for line in found.parts if "check rail" in str(line))
    assert words == (
        "  check rail beside the left rail from s = 47.103 to 52.793 m, flangeway 41 mm at least"
    )
    expected = {"rail": "left", "begin": 47.103, "end": 52.793, "flangeway": 0.041}
    assert found.data["check_rail"] == [expected]
    track = load_track("curve_r250", ["check_rail=[{rail='left',flangeway=0.045}]"])
    assert "beside the left rail all along, flangeway 45 mm" in str(describe_track(track, []).parts)


def test_remarks_are_shown(capsys):
    lines = lines_of(capsys, "curve_r250", "--set", "rounding=80.0")
    assert any(line.startswith("remark: plan.1") for line in lines)


def test_spring_file_fits_on_a_screen(capsys):
    lines = lines_of(capsys, "turasas_axlebox")
    assert len(lines) < 25
    assert max(map(len, lines)) < 110
    cells = [line.split() for line in lines]
    assert ["inner", "142", "27", "6", "338", "159"] in cells  # mm
    for row in (["CUM", "75.8264"], ["target", "75.8264", "78.39"]):  # kN, mm
        assert row in cells
    assert lines[-1].startswith("tables besides: fatigue, search")


def test_mechanism_file_is_told_with_its_parameters(capsys):
    lines = lines_of(capsys, "watt_axlebox_guide")
    assert lines[0] == "Watt axlebox guide"
    assert [line.partition(": ")[2] for line in lines[2:4]] == ["coupler", "left_arm, right_arm"]
    assert lines[4:6] == ["  driven by coupler.axle", ""]
    assert [line.split() for line in lines[7:]] == [
        ["arm", "0.4", "m", "new"], ["coupler", "0.2", "m", "new"], ["lift", "0.06", "m", "new"],
    ]  # fmt: skip
    lines = lines_of(capsys, "tilting_two_springs")
    assert "  actuators: operator, piston" in lines
    assert "  elements: front, rear" in lines


def test_spring_as_json_holds_the_whole_file(capsys):
    assert cli.main(["info", "turasas_axlebox", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["kind"] == "spring"
    assert {"arm", "outer", "loads", "search"} <= set(data)


@pytest.mark.parametrize("name", ["coach_manchester", "curve_r250"])
def test_vehicles_and_tracks_can_be_drawn(capsys, tmp_path, name):
    path = tmp_path / "drawing.png"
    lines_of(capsys, name, "--draw", str(path))
    assert path.read_bytes().startswith(b"\x89PNG")
    assert cli.main(["info", name, "--draw", str(path)]) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_a_track_without_the_forces_at_rest_is_refused(capsys):
    assert cli.main(["info", "coach_manchester", "--track", "straight"]) == 2
    assert "--track goes with --static" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["curve_r250", "--static"], "--static goes with vehicles"),
        (["coach_manchester", "--speed", "20"], "--speed goes with tracks"),
        (["run.h5", "--load", "laden", "--set", "mass=1"], "--load and --set go with vehicles"),
    ],
)
def test_options_that_would_do_nothing_are_refused(capsys, arguments, words):
    assert cli.main(["info", *arguments]) == 2
    assert words in capsys.readouterr().err


def test_drawing_of_a_spring_is_refused(capsys, tmp_path):
    path = tmp_path / "drawing.png"
    assert cli.main(["info", "turasas_axlebox", "--draw", str(path)]) == 2
    assert not path.exists()


def test_vehicle_drawing_shows_every_body_and_kind_of_element():
    figure = vehicle_figure(load_vehicle("coach_manchester"))
    texts = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert {"carbody", "front.frame", "rear.frame"} <= texts
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "bushing (8)" in labels
    assert "shear spring (4)" in labels


def test_leading_end_of_a_drawing_holds_the_whole_bogie_of_three_axles():
    """Co-Co, 2.16 m between axles, the front bogie's middle axle at x = 5.39 m."""
    low, high = vehicle_figure(load_vehicle("locomotive_coco_b")).axes[2].get_xlim()
    assert low < 5.39 - 2.16
    assert high > 5.39 + 2.16


def test_static_loads_add_up_to_the_weight(capsys):
    static = data_of(capsys, "coach_manchester", "--static")["static"]
    total = sum(sum(pair) for pair in static["Q0"].values())
    assert total == pytest.approx(56110.0 * 9.81, rel=1e-9)
    # the car on four springs
    assert static["preload"]["front.secondary_spring.left"][2] == pytest.approx(
        43628.0 * 9.81 / 4.0
    )


@pytest.mark.usefixtures("small_contact_tables")
def test_every_load_case_has_its_own_tables(capsys):
    data = data_of(capsys, "metro_b_motor", "--static")
    assert list(data["load_cases"]) == ["design", "laden"]
    for case in data["load_cases"].values():
        # both stages carry the same load case: the primary springs the weight of all but wheelsets
        masses = {row["body"]: row["mass"] for row in case["masses"]}
        sprung = masses["carbody"] + masses["front.frame"] + masses["rear.frame"]
        forces = {row["element"]: row["force"] for row in case["springs"]}
        primary = sum(force for name, force in forces.items() if "primary" in name)
        secondary = sum(force for name, force in forces.items() if "secondary." in name)
        assert primary == pytest.approx(sprung * 9.81, rel=1e-4)
        assert secondary == pytest.approx(masses["carbody"] * 9.81, rel=1e-4)
        assert all(0.5 < row["bounce"] < 20.0 for row in case["frequencies"])
    laden = data["load_cases"]["laden"]
    # the air springs level the car over frames whose springs of 1.7 kN/mm carry 25.4 kN more
    (car, frame, _) = laden["heights"]
    assert frame["raised"] == pytest.approx(-0.0162, abs=2e-4)
    assert car["raised"] == pytest.approx(frame["raised"], abs=1e-4)
    text = "\n".join(lines_of(capsys, "metro_b_motor", "--static", "--load", "laden"))
    assert "carbody stands 16 mm below its nominal height" in text
    assert "load 'design'" not in text


def test_springs_and_stops_of_a_loaded_wagon(capsys):
    data = data_of(capsys, "wagon_y25", "--static", "--load", "laden")["static"]
    springs = {row["element"]: row for row in data["springs"]}
    spring = springs["front.outer.springs.left"]
    assert spring["length"] + spring["shortened"] == pytest.approx(0.23993, abs=1e-4)
    stops = {row["element"]: row for row in data["stops"]}
    # the inner spring begins to carry 5.9 mm below the nominal position
    assert stops["front.outer.springs.left"]["backward"] == pytest.approx(
        0.0059 - spring["shortened"], abs=1e-4
    )
    assert stops["front.outer.guide_lateral.left"]["forward"] == pytest.approx(0.01, abs=1e-6)


def test_runs_of_a_folder_are_listed_whichever_way_it_is_given(capsys, tmp_path):
    for name, gain in (("one", 1.0), ("two", 0.9)):
        example_result(gain=gain, speed=100.0 / 3.6).to_hdf5(tmp_path / f"{name}.h5")
    lines = lines_of(capsys, str(tmp_path))
    assert lines[0].endswith("2 runs, 2 complete")
    assert "27.7778" in lines[3].split()
    assert [line.split()[0] for line in lines[3:5]] == ["one", "two"]
    data = data_of(capsys, str(tmp_path))
    assert [run["status"] for run in data["runs"]] == ["complete", "complete"]
    (tmp_path / "two.h5").unlink()
    assert lines_of(capsys, str(tmp_path))[0].endswith(": 1 run, 1 complete")


def test_wrong_file_is_status_2(capsys, tmp_path):
    assert cli.main(["info", str(tmp_path)]) == 2
    assert cli.main(["info", "curve_r250", "--speed", "0"]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_result_shows_status_dimensions_and_units(capsys, tmp_path):
    path = str(example_result().to_hdf5(tmp_path / "example.h5"))
    lines = lines_of(capsys, path)
    assert any(line.split() == ["status", "complete"] for line in lines)
    row = next(line for line in lines if line.startswith("Q "))
    assert "time, wheelset, side" in row
    assert row.endswith("N")
    data = data_of(capsys, path)
    assert data["quantities"]["sum_Y"]["dims"] == ["time", "wheelset"]
    assert "vehicle_toml" not in data["attributes"]


@pytest.mark.usefixtures("small_contact_tables")
def test_a_vehicle_of_another_gauge_stands_on_the_rails_of_a_track(tmp_path, capsys):
    metre = ["--set", "assemblies.bogie.assemblies.axle.wheelsets.wheelset.back_to_back=0.925"]
    track = tmp_path / "metre.toml"
    track.write_text(
        'format = "railsim-track/1"\nname = "metre gauge"\ngauge = 1.0\n'
        'plan = [{ type = "STR", length = 100.0 }]\n'
    )
    asked = ["info", "wagon_y25", "--static", *metre]
    assert cli.main(asked) == 2
    assert "check gauge" in capsys.readouterr().err
    assert cli.main([*asked, "--track", str(track)]) == 0
    shown = capsys.readouterr().out
    assert "At rest, load 'design'" in shown
    assert re.search(r"^Natural frequencies; \d+ friction elements stick: ", shown, re.MULTILINE)


def test_one_wheelset_has_no_empty_tables_and_no_floor_to_assess(tmp_path, capsys):
    (tmp_path / "lone.toml").write_text(
        'format = "railsim-vehicle/1"\nname = "one wheelset"\n'
        "[wheelsets.axle]\nmass = 4000.0\ninertia = [800.0, 90.0, 800.0]\n"
        'position = [0.0, 0.0, -0.46]\nradius = 0.46\nprofile = "S1002"\n'
    )
    path = str(tmp_path / "lone.toml")
    assert cli.main(["info", path, "--static"]) == 0
    shown = capsys.readouterr().out
    assert "Static wheel loads" in shown
    assert "between" not in shown
    assert "Natural frequencies" not in shown
    run, sensors = str(tmp_path / "run.h5"), "settings.outputs.sensors=true"
    rate = "settings.output_rate=1000"
    more = ["--speed", "5", "--duration", "1", "--set", sensors, "--set", rate, "--out", run]
    assert cli.main(["run", path, "straight", *more]) == 0
    assert cli.main(["assess", run, "--standard", "comfort"]) == 2
    assert "wheelsets alone" in capsys.readouterr().err


def test_a_study_is_said_to_have_its_runs_and_an_optimisation_its_designs(tmp_path, capsys):
    text = """format = "railsim-study/1"
name = "one"
vehicles = ["coach_manchester"]
tracks = ["curve_r250"]
speeds = [20.0]
"""
    search = "[optimise.variables]\n'vehicle.primary.stiffness.x' = { low = 1e6, high = 2e6 }\n"
    search += "[[optimise.objectives]]\nquantity = 'Q_peak'\n"
    for more, words in (("", "one: 1 run\n"), (search, "one: up to 80 designs, 1 run each\n")):
        (tmp_path / "study.toml").write_text(text + more, encoding="utf-8")
        assert main(["info", str(tmp_path / "study.toml")]) == 0
        assert capsys.readouterr().out.startswith(words)
