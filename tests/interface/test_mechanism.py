"""``railsim mechanism``: keys of --json, exit status, files of --out, every kind of bad input."""

import contextlib
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image, ImageSequence

from railsim import cli
from railsim.definitions.loading import load_mechanism
from railsim.files.sources import find_file, library_files
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.model import build
from railsim.mechanisms.optimum import optimised_text
from railsim.plot.mechanisms import angles_figure
from railsim.report.mechanisms import GIF_FRAMES, animation

FEW = ["--set", "sampling.points=51"]
BASE = [*FEW, "--set", "cases={}"]
FOUR_BAR = """
format = "railsim-mechanism/1"
[parameters]
ground = {ground}
crank = {crank}
coupler = {coupler}
rocker = {rocker}
[ground.points]
left = [0.0, 0.0]
right = ["ground", 0.0]
[bodies.crank]
points = {{ pin = [0.0, 0.0], end = ["crank", 0.0] }}
[bodies.rocker]
points = {{ pin = [0.0, 0.0], end = ["rocker", 0.0] }}
[joints.left]
revolute = ["ground.left", "crank.pin"]
[joints.right]
revolute = ["ground.right", "rocker.pin"]
[joints.coupler]
link = ["crank.end", "rocker.end"]
length = "coupler"
[start]
crank = {{ angle = 1.0 }}
rocker = {{ angle = 1.0 }}
[driver]
angle = "crank"
start = {start}
end = {end}
"""


@pytest.fixture
def write(tmp_path):
    def write(text, name="mine.toml"):
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


def four_bar(write, ground=1.0, crank=0.4, coupler=1.0, rocker=0.8, start=1.0, end=2.0):
    return write(FOUR_BAR.format(**locals()))


def answer(capsys, *arguments):
    assert cli.main(["mechanism", *arguments, "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


def answered(*arguments):
    """The same for several tests."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        assert cli.main(["mechanism", *arguments, "--json"]) == 0
    return json.loads(out.getvalue())


@pytest.fixture(scope="module")
def lift():
    return answered("atr95_lift_5", *FEW)


@pytest.fixture(scope="module")
def tilting():
    return answered("tilting_one_spring", *BASE)


def refused(capsys, *arguments):
    """Lines on stderr of a command that ends with status 2 and prints nothing else."""
    assert cli.main(["mechanism", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    return err.splitlines()


def test_every_shipped_mechanism_is_valid_and_listed(capsys):
    names = library_files("mechanism")
    wanted = {"atr95", *(f"atr95_lift_{i}" for i in range(1, 7)), "tilting_one_spring",
              "tilting_two_springs", "watt_axlebox_guide"}  # fmt: skip
    assert wanted <= set(names)
    assert cli.main(["validate", *names]) == 0
    assert capsys.readouterr().out.count("mechanism, no faults") == len(names)
    for name in names:
        mechanism = load_mechanism(name)
        for parameter in mechanism.parameters:
            assert mechanism.provenance_of(parameter) != "not stated"


def test_json_of_a_lift_has_the_promised_keys(lift):
    data = lift
    keys = "parameters travel stroke length_start length_end max_force max_force_at force_zeros"
    keys += " min_transmission_angles output zone motion contact reactions cases selection checks"
    assert set(keys.split()) <= set(data)
    arrays = "travel length height x ratio ratio_x force pressure effective_weight effective_mass"
    assert set(arrays.split()) <= set(data["output"])
    assert {len(array) for array in data["output"].values()} == {51}
    assert {"mu", "mu_prime", "mu_s"} == set(data["min_transmission_angles"])
    for name in ("travel", "ratio", "force"):
        assert set(data["zone"][name]) == {"low", "work", "high"}
    assert set(data["contact"]["force"]) == {"low", "work", "high"}
    assert {"time", "travel", "force", "max_force", "min_force"} <= set(data["motion"])
    pin = data["reactions"]["boom_pin"]
    x, y = pin["components"]
    assert len(x) == len(y) == 51
    assert pin["max"] == pytest.approx(np.max(np.hypot(x, y)), rel=1e-3)  # at more positions
    assert abs(pin["at"]) <= abs(data["parameters"]["travel"])
    for check in data["checks"]:
        assert {"name", "value", "limit", "ok"} <= set(check)
    assert data["parameters"]["held_pressure"] == data["contact"]["pressure"]
    assert data["provenance"]["a1"] == "printed"
    assert data["provenance"]["upper_a"] == "reconstructed"


def test_json_of_the_tilting_machine_has_springs_and_cases(capsys):
    case = "--set", "cases={bordolese_5000={m_bottle=2.950,x_bottle=-0.011,y_bottle=0.221}}"
    data = answer(capsys, "tilting_two_springs", *FEW, *case)
    assert {"travel", "force", "front_length", "rear_length", "front_force"} <= set(data["output"])
    assert data["output"]["travel"][0] == pytest.approx(np.radians(-35.0))
    heavy = data["cases"]["bordolese_5000"]
    assert heavy["force_zeros"]
    assert not data["force_zeros"]
    alone = answer(capsys, "tilting_two_springs", "--case", "bordolese_5000", *FEW)
    assert alone["output"]["force"] == heavy["output"]["force"]


def test_at_gives_all_results_where_one_has_a_value(capsys):
    data = answer(capsys, "atr95_lift_5", "--at", "height=0.8955", "--at", "length=0.2", *FEW)
    work, length = data["at"]
    assert work["ratio"] == pytest.approx(data["zone"]["ratio"]["work"], rel=1e-9)
    assert length["length"] == pytest.approx(0.2, rel=1e-12)


def test_a_set_parameter_says_so(capsys):
    data = answer(capsys, "atr95_lift_5", "--set", "parameters.a1=0.165", *FEW)
    assert data["parameters"]["a1"] == 0.165
    assert data["provenance"]["a1"] == "set"


def test_several_files_are_compared_with_the_first(capsys):
    data = answer(capsys, "atr95_lift_5", "atr95_lift_2", *FEW)
    assert [row["name"] for row in data["comparison"]] == ["ATR95 lift 5", "ATR95 lift 2"]
    assert data["comparison"][0]["error"] == pytest.approx(0.0, abs=1e-20)
    assert data["comparison"][1]["error"] == pytest.approx(0.2823, rel=5e-3)
    # A23: of the whole zone, not of its three heights alone
    assert data["comparison"][0]["zone_spread"] == pytest.approx(0.1041, abs=5e-5)


@pytest.mark.parametrize("by", ["travel", "length", "time"])
def test_one_quantity_is_sampled_evenly(capsys, by):
    changes = ["--set", f"sampling.by={by}", "--set", "sampling.points=21"]
    data = answer(capsys, "atr95_lift_4", *changes)
    # the lifts move at constant speed of the length: equal times are equal lengths
    steps = np.diff(data["output"]["travel" if by == "travel" else "length"])
    assert steps == pytest.approx(np.full(20, steps.mean()), rel=1e-9)


class Text(HTMLParser):
    def __init__(self):
        super().__init__()
        self.tags, self.text = [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.text.append(data)


def test_a_film_runs_to_the_end_and_back_without_showing_an_end_twice(monkeypatch):
    monkeypatch.setattr("railsim.report.mechanisms.GIF_FRAMES", 4)
    mechanism = load_mechanism("atr95_lift_5")
    shown = SimpleNamespace(model=build(mechanism), definition=mechanism)
    with Image.open(io.BytesIO(animation(shown))) as film:
        seen = [np.asarray(one.convert("L")) for one in ImageSequence.Iterator(film)]
    order = [next(k for k, one in enumerate(seen) if np.array_equal(one, each)) for each in seen]
    assert order == [0, 1, 2, 3, 2, 1]


@pytest.mark.slow
def test_out_writes_a_self_contained_page_pictures_and_positions(tmp_path, capsys):
    folder = tmp_path / "out"
    assert cli.main(["mechanism", "atr95", "--out", str(folder), *FEW]) == 0
    capsys.readouterr()
    names = {path.name for path in folder.iterdir()}
    pictures = "drawing kinematics path angles cam ratio_force pressure contact carpet time"
    assert {f"{name}.png" for name in pictures.split()} <= names
    assert {"report.html", "animation.gif", "positions.csv"} <= names
    with Image.open(folder / "animation.gif") as film:  # forth and back
        pictures = [np.asarray(one.convert("L")) for one in ImageSequence.Iterator(film)]
    assert len(pictures) == 2 * GIF_FRAMES - 2
    assert np.array_equal(pictures[1], pictures[-1])
    assert not np.array_equal(pictures[0], pictures[1])
    page = Text()
    html = (folder / "report.html").read_text()
    page.feed(html)
    sources = [attributes.get("src", "") for _, attributes in page.tags]
    assert not [source for source in sources if source and not source.startswith("data:")]
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", html)
    text = " ".join(page.text)
    assert "reconstructed" in text
    assert "printed" in text
    assert any(tag == "svg" for tag, _ in page.tags)
    rows = (folder / "positions.csv").read_text().splitlines()
    assert len(rows) == 52
    assert rows[0].startswith("travel [rad],length [m]")
    lines = refused(capsys, "atr95", "--out", str(folder), *FEW)
    assert "--overwrite" in lines[0]


def test_optimised_file_has_what_was_in_force_and_says_where_it_is_from(write):
    changes, found = ["parameters.bore=0.2", "parameters.a1=0.16"], {"a1": 0.17}
    searched = load_mechanism("atr95_lift_5", changes)
    optimum = SimpleNamespace(
        definition=searched, parameters=found, starts=(None,), seed=1, objective=1.0, feasible=True
    )
    again = load_mechanism(write(optimised_text("atr95_lift_5", optimum, changes, None)))
    assert again.parameters == {**searched.parameters, **found}
    homes = {name: again.provenance_of(name) for name in ("bore", "a1", "a2")}
    assert homes == {"bore": "set", "a1": "optimised", "a2": "printed"}


@pytest.mark.slow
@pytest.mark.further
def test_optimised_file_extends_the_searched_one_and_runs_to_the_same(tmp_path, capsys):
    folder = tmp_path / "out"
    changes = ["--set", "parameters.bore=0.2", *FEW]
    search = ["--optimise", "--starts", "1", "--out", str(folder)]
    data = answer(capsys, "atr95_lift_2", *search, *changes)
    assert {"objective", "active", "starts", "seed"} <= set(data)
    assert data["objective"] <= data["objective_before"]
    again = answer(capsys, str(folder / "optimised.toml"))
    for name in ("stroke", "max_force", "parameters"):
        assert again[name] == pytest.approx(data[name])
    assert again["provenance"]["c"] == "optimised"
    assert again["provenance"]["bore"] == "set"
    assert (folder / "search.png").exists()


@pytest.mark.slow
def test_search_without_a_solution_gives_the_least_broken_compromise(capsys):
    # the crank's angle is the rod's less mu: with both angles at L or more it can change by
    # 4 (90 deg - L) at most, and it must change by the travel
    wanted, possible = 1.45, 0.5 * np.pi - 0.25 * np.radians(43.5525)
    changes = ["--set", f"optimise.min_transmission_angle={wanted}"]
    data = answer(capsys, "atr95_lift_4", "--optimise", "--starts", "4", *changes, *FEW)
    assert data["feasible"] is False
    angles = data["min_transmission_angles"]
    broken = {name: wanted - angles[name] for name in ("mu", "mu_prime")}
    assert data["breaches"] == pytest.approx(broken)
    least = min(angles["mu"], angles["mu_prime"])
    assert least <= possible
    assert least == pytest.approx(possible, abs=np.radians(8.0))  # within the bounds of lengths


@pytest.mark.parametrize(
    ("name", "changes", "key", "words"),
    [
        ("atr95_lift_5", ["parameters.a2=0.02"], "derived.rocker_angle", "assembled at the start"),
        ("atr95_lift_5", ["parameters.travel=1.4"], "joints.rod", "57.04"),
        ("atr95", ["parameters.cam_length_1=0.05"], "joints.cam", "leaves the cam"),
        ("atr95_lift_5", ["joints.x={link=['ground.foot','coupler.end'],length=0.2}"], "joints",
         "0 degrees of freedom"),
        ("atr95_lift_5", ["bodies.more={points={a=[0,0]}}"], "joints", "4 degrees of freedom"),
        ("atr95_lift_5", ["derived.unused='a1*2'"], "derived.unused", "is used nowhere"),
        ("atr95_lift_5", ["joints.rocker.length='a33'"], "joints.rocker.length", "mean 'a3'"),
        ("atr95_lift_5", ["joints.rocker.length='open(a1)'"], "joints.rocker.length", "allowed"),
        ("atr95_lift_5", ["joints.rocker.length='a1.real'"], "joints.rocker.length", "allowed"),
        ("atr95_lift_5", ["joints.rocker.length='9**9**9'"], "joints.rocker.length", "finite"),
        ("atr95_lift_5", ["parameters.a3=285.1563"], "parameters.a3", "lengths in metres"),
        ("atr95_lift_2", ["ground.points.line=[0.0,120.0]"], "ground.points.line", "metres"),
        ("tilting_one_spring", ["parameters.front_stroke=0.1"], "elements.front", "17.40 mm"),
        ("atr95", ["parameters.m_head=300"], "actuators.lift", "outside the table"),
        ("atr95_lift_5", ["parameters.zone_high=3.0"], "zone.high", "never reached"),
        ("atr95_lift_5", ["joints.rocker.link=['ground.rock','coupler.end']"],
         "joints.rocker.link.0", "did you mean 'ground.rocker'"),
        ("atr95_lift_5", ["joints.rocker={link=['ground.rocker','coupler.end']}"],
         "joints.rocker.length", "missing"),
        ("atr95_lift_5", ["joints.rocker={bolt=1}"], "joints.rocker", "revolute, link, slot"),
        ("atr95_lift_5", ["provenance.printed=['nothing']"], "provenance.printed", "nothing"),
        ("atr95_lift_5", ["parameters.m_head=-1"], "parameters.m_head", "0 or greater"),
        ("atr95_lift_2", ["optimise.min_transmission_angle=40"],
         "optimise.min_transmission_angle", "below pi/2 rad"),
        ("atr95_lift_2", ["optimise.min_transmission_angle=0"],
         "optimise.min_transmission_angle", "above 0"),
        ("atr95_lift_2", ["actuators.lift.rod=0.2"], "actuators.lift.rod", "the bore, 0.16"),
        ("tilting_two_springs", ["tolerances.front_F1=-20"], "tolerances.front_F1", "or greater"),
        ("atr95", ["actuators.lift.heights=[0.1,0.2]"], "actuators.lift", "rows of 'forces'"),
        ("atr95_lift_5", ["optimise.objective=constant"], "optimise.target", "needs one"),
        ("tilting_one_spring", ["parameters.release_at=2.0"], "release.start", "114.59"),
        ("tilting_one_spring", ["release.until=1.2", "release.duration=1"],
         "release: it swings past the end of",
         "the travel at -35.0000 deg; a release that reaches 68.7549 deg"),
        ("watt_axlebox_guide", ["parameters.lift=0.5"], "joints.", "cannot be assembled"),
        ("atr95_lift_5", ["parameters.travel=-1.2"], "joints.rod", "from here on"),
        ("tilting_one_spring", ["parameters.front_stroke=120"], "parameters.front_stroke",
         "lengths in metres"),
        ("atr95_lift_5", ["parameters.bore=160"], "parameters.bore", "lengths in metres"),
        ("atr95_lift_5", ["parameters.alpha1_in=-46.2091"], "parameters.alpha1_in", "radians"),
        ("atr95_lift_5", ["parameters.zone_low=595.5"], "parameters.zone_low", "metres"),
        ("atr95_lift_5", ["parameters.lift_speed=0"], "parameters.lift_speed", "greater than 0"),
        ("tilting_one_spring", ["parameters.duration=0"], "parameters.duration", "motion.duration"),
        ("tilting_one_spring", ["parameters.temperature=-300"], "parameters.temperature",
         "-257 C or above"),
        ("tilting_one_spring", ["parameters.front_progression=0.5"],
         "parameters.front_progression", "1 or greater"),
        ("tilting_one_spring", ["parameters.front_extended=0.29"], "elements.front",
         "in extension"),
        ("atr95_lift_4", ["parameters.a2=0.01"], "derived.slide_in",
         "the links cannot be assembled"),
        ("atr95_lift_4", ["parameters.assembly=0.5"], "parameters.assembly", "0.5; 1 or -1"),
        ("atr95_lift_5", ["optimise.objective=best"], "optimise.objective", "'peak_force'"),
        ("atr95_lift_5", [f"joints.rocker.length='{'9' * 400}'"],
         "joints.rocker.length", "allowed"),
        ("tilting_one_spring",
         ["lid={element='frnt',mass=20,centre=0.4,lever=0.15}"], "lid.element", "'front'"),
        ("tilting_one_spring",
         ["lid={element='front',mass=20,centre=0.4,lever=0}"], "lid.lever", "greater than 0"),
    ],
)  # fmt: skip
def test_bad_input_is_told_in_a_line(capsys, name, changes, key, words):
    options = [part for change in changes for part in ("--set", change)]
    (line,) = refused(capsys, name, *options)
    assert f": {key}" in line
    assert words in line


def test_reference_that_is_not_there_is_told_at_its_key(capsys):
    (line,) = refused(
        capsys, "atr95_lift_5", "--optimise", "--starts", "1", "--set", "optimise.reference=atr96"
    )
    assert "optimise.reference: no file 'atr96'" in line
    assert "did you mean 'atr95'" in line


def test_bounds_that_exclude_every_assembly(capsys):
    bounds = ["--set", "optimise.bounds.a2=[0.01,0.011]"]
    (line,) = refused(capsys, "atr95_lift_5", "--optimise", "--starts", "2", *bounds)
    assert "optimise.bounds: exclude every assembly" in line


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--at", "height=9"], "never reached"),
        (["--at", "hight=0.5"], "did you mean 'height'"),
        (["--at", "height"], "NAME=VALUE"),
        (["--case", "x"], "lift 5' has no cases"),
        (["--starts", "3"], "--optimise"),
        (["--out", "page.html"], "is the name of a file"),
    ],
)
def test_bad_options_are_told(capsys, options, words):
    assert words in " ".join(refused(capsys, "atr95_lift_5", *options))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--at", "hight=0.5"], "--at: hight: no result 'hight'; did you mean 'height'"),
        (["--at", "height"], "--at: 'height'; NAME=VALUE"),
        ([], "--out: . holds optimised.toml; give --overwrite"),
    ],
)
def test_bad_options_are_told_before_the_search(capsys, monkeypatch, tmp_path, options, words):
    monkeypatch.setattr("railsim.mechanisms.optimisation.optimise", None)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "optimised.toml").touch()
    out = [] if options else ["--out", "."]
    assert words in " ".join(refused(capsys, "atr95_lift_4", "--optimise", *options, *out))


def test_crank_that_cannot_turn_round_is_told_where(write, capsys):
    # Grashof: 0.9 + 1.3 > 1.0 + 0.8, no crank turns; lost where coupler and rocker stretch
    file = four_bar(write, crank=0.9, coupler=1.3, rocker=0.8, start=1.0, end=6.0)
    (line,) = refused(capsys, file)
    assert line.startswith(f"{file}: joints.")
    cosine = (1.0 + 0.9**2 - 2.1**2) / (2 * 0.9)
    stretched = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    found = float(re.search(r"driver at ([\d.]+) deg", line).group(1))
    folded = np.degrees(2 * np.pi - np.arccos((1.0 + 0.81 - 0.25) / 1.8))
    assert found in (pytest.approx(stretched, abs=0.01), pytest.approx(folded, abs=0.01))


def test_parallelogram_at_its_change_point_is_no_branch_to_trust(write, capsys):
    file = four_bar(write, ground=1.0, crank=0.4, coupler=1.0, rocker=0.4, start=1.0, end=4.0)
    (line,) = refused(capsys, file)
    assert "driver at 1" in line  # 180 deg: all links in one line
    assert "dead point" in line or "another branch" in line or "cannot be assembled" in line


def test_redundant_joint_is_named(write, capsys):
    text = FOUR_BAR.format(ground=1.0, crank=0.4, coupler=1.0, rocker=0.4, start=1.0, end=2.0)
    text += (
        '[bodies.third]\npoints = { pin = [0.0, 0.0], end = ["crank", 0.0] }\n'
        '[joints.a]\nlink = ["crank.end", "third.end"]\nlength = 0.5\n'
        '[joints.b]\nlink = ["ground.left", "third.pin"]\nlength = 0.5\n'
        '[joints.c]\nlink = ["crank.pin", "third.pin"]\nlength = 0.5\n'
    ).replace("[bodies.third]", "[start.third]\nx = 0.5\nangle = 1.0\n[bodies.third]")
    (line,) = refused(capsys, write(text))
    assert "hold the same freedom twice" in line
    assert "b, c" in line


def test_actuator_through_its_dead_point(capsys, write):
    text = FOUR_BAR.format(ground=1.0, crank=0.4, coupler=1.0, rocker=0.8, start=1.0, end=5.0)
    text += '[actuators.ram]\npiston = ["ground.right", "crank.end"]\n[solve]\nunknown = "ram"\n'
    (line,) = refused(capsys, write(text))
    assert "actuators.ram" in line
    assert "dead point" in line


def test_catalogue_without_a_fit_is_a_result_with_reasons(capsys):
    data = answer(capsys, "tilting_one_spring", "--set", "parameters.front_F1=5000", *BASE)
    rows = [row for row in data["selection"] if row["catalogue"] == "vapsint"]
    assert rows
    assert not any(row["fits"] for row in rows)
    assert all("F1 5000 N" in row["reasons"][0] for row in rows)


def test_lid_formula_is_a_rule_of_thumb_and_service_temperature_a_check(capsys):
    # 20 kg at 400 mm, two springs at 150 mm, factor 1.1: 287.467 N (B8)
    lid = "lid={element='front',mass=20,centre=0.4,lever=0.15,springs=2,factor=1.1}"
    changes = ["--set", lid, "--set", "parameters.temperature=90", *BASE]
    data = answer(capsys, "tilting_one_spring", *changes)
    checks = {c["name"]: c for c in data["checks"]}
    assert checks["lid_front"]["limit"] == pytest.approx(287.467, abs=1e-3)
    # approximate: said, but not failed
    assert (checks["lid_front"]["value"], checks["lid_front"]["ok"]) == (50.0, True)
    assert any("rule of thumb" in r and "287.5 N; here 50.0 N" in r for r in data["remarks"])
    assert (checks["front_temperature"]["limit"], checks["front_temperature"]["ok"]) == (80, False)


def test_joint_friction_parts_the_pressures_that_raise_and_lower(capsys, lift):
    rub = "elements.rub={joint_friction='boom',moment=60}"
    rubbed = answer(capsys, "atr95_lift_5", *FEW, "--set", rub)
    rate = np.array(lift["output"]["rate"])
    area = 0.25 * np.pi * 0.16**2
    for name, sign in (("pressure", 1), ("pressure_back", -1)):
        found = np.array(rubbed["output"][name]) - lift["output"]["pressure"]
        assert found == pytest.approx(sign * 60.0 / rate / area, rel=1e-9)


def test_changes_of_arcs_are_told(capsys):
    data = answer(capsys, "atr95", *FEW)
    assert [(c["before"], c["after"]) for c in data["transitions"]] == [(1, 2), (2, 3)]
    assert cli.main(["mechanism", "atr95", *FEW]) == 0
    assert "cam: from arc 1 to 2 at 9.156" in capsys.readouterr().out


def test_pressure_in_a_gas_spring_is_its_force_over_its_rod(tilting):
    output = tilting["output"]
    area = 0.25 * np.pi * 0.006**2
    assert output["front_pressure"] == pytest.approx(np.array(output["front_force"]) / area)


def test_a_case_that_cannot_be_computed_is_named(capsys):
    """The spring's bracket at 200 mm is out of its stroke; the base itself is right."""
    bad = "cases={bad={r_E=0.2}}"
    (line,) = refused(capsys, "tilting_one_spring", "--set", bad, *FEW)
    assert "elements.front: case 'bad': driver at -35" in line


def test_scatter_says_which_dimension_matters(capsys, lift):
    stroke = next(one for one in lift["scatter"] if one["name"] == "stroke")
    assert 0.0 < stroke["random"] < stroke["worst"]
    assert stroke["worst"] == pytest.approx(sum(abs(v) for v in stroke["single"].values()))
    assert cli.main(["mechanism", "atr95_lift_5", *FEW]) == 0
    assert re.search(r"stroke \(mm\) +113\.6682 .* d \(", capsys.readouterr().out)


WITHOUT_UNIT = ("ratio", "rate of the driver", "objective", "start")


def unit_stated(label):
    return label.endswith(")") or label.startswith(WITHOUT_UNIT)


def test_every_axis_of_every_picture_says_its_unit():
    from railsim.mechanisms.analysis import analyse
    from railsim.report.mechanisms import PageResults, figures

    one, two, cam = (
        analyse(load_mechanism(name, ["sampling.points=51"]))
        for name in ("atr95_lift_5", "tilting_two_springs", "atr95")
    )
    full = analyse(load_mechanism("tilting_two_springs", ["sampling.points=51"]), "bordolese_5000")
    collections = [
        PageResults([cam, one], {}, None),
        PageResults([two], {"base": two, "bordolese_5000": full}),
    ]
    seen = set()
    for collected in collections:
        for name, figure in figures(collected).items():
            seen.add(name)
            for axes in figure.axes:
                labels = [axes.get_xlabel() or "(shared)", axes.get_ylabel() or "(shared)"]
                assert all(unit_stated(label) for label in labels), (name, labels)
            assert any(axes.get_xlabel() for axes in figure.axes)
    wanted = "drawing kinematics path angles cam ratio_force pressure contact carpet time"
    assert set(wanted.split()) | {"gas_springs", "cases", "comparison", "comparison_zone"} <= seen


def test_air_spring_outside_its_table_is_no_value_in_the_contact_force(capsys):
    data = answer(capsys, "atr95", "--set", "parameters.held_pressure=0.15e6", *FEW)
    assert data["contact"]["force"]["work"] is None
    assert "table" in data["contact"]["reason"]


def test_files_of_the_manual_run_and_give_the_forces_it_states(capsys, write):
    page = (Path(__file__).parents[2] / "docs" / "user" / "mechanisms.md").read_text()
    flap, gas = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    assert answer(capsys, write(flap))["max_force"] > 0.0
    file = write(gas, "flap.toml")
    for case, said in (([], "15.9 N"), (["--case", "winter"], "32.0 N")):
        assert f"{answer(capsys, file, *case)['output']['force'][0]:.1f} N" == said
        assert said in page


def test_info_shows_parameters_with_their_provenance(capsys):
    assert cli.main(["info", "atr95_lift_5"]) == 0
    out = capsys.readouterr().out
    assert re.search(r"a1 +0.1641893 +m +printed", out)


def test_faults_name_the_file_of_their_key_in_one_way(capsys, write):
    """Found when loading and when computing, of a shipped name and of a file that extends one."""
    shipped = find_file("atr95_lift_5", "mechanism")
    # a negative arm is found when loading, a rocker that is too long when computing
    for change, key in (("a1=-1", "derived.rocker_angle"), ("a3=0.40", "joints.rocker")):
        (line,) = refused(capsys, "atr95_lift_5", "--set", f"parameters.{change}")
        assert line.startswith(f"{shipped}: {key}: ")
    mine = write(
        'format = "railsim-mechanism/1"\nextends = "atr95_lift_5"\n[parameters]\na3 = 0.40\n'
    )
    (line,) = refused(capsys, mine)
    assert line.startswith(f"{shipped}: joints.rocker: ")  # the file that holds the key


def test_a_motion_is_written_with_every_link_and_actuator(tmp_path, capsys):
    folder = tmp_path / "out"
    names = ["tilting_one_spring", "tilting_two_springs"]
    assert cli.main(["mechanism", *names, "--out", str(folder), *FEW]) == 0
    capsys.readouterr()
    written = {path.name for path in folder.iterdir()}
    assert {"motion.csv", "actuators.png", "drawing.png", "drawing_2.png"} <= written
    head, *rows = (folder / "motion.csv").read_text().splitlines()
    columns = head.split(",")
    assert len(rows) == 401
    assert {"plate angle speed [rad/s]", "piston length acceleration [m/s2]"} <= set(columns)
    # the 3-4-5 polynomial: fastest in the middle, 15/8 h/T
    speed = [float(row.split(",")[columns.index("piston length speed [m/s]")]) for row in rows]
    assert max(speed) == pytest.approx(15 / 8 * 0.434 / 2.0, rel=1e-4)
    data = answer(capsys, names[0], *FEW)
    assert set(data["links"]) == {"plate"}
    assert set(data["motion"]["actuators"]["piston"]) == {"length", "speed", "acceleration"}


def test_equal_reasons_of_a_catalogue_are_one_row_on_the_terminal_only(capsys, tilting):
    assert cli.main(["mechanism", "tilting_one_spring", *BASE]) == 0
    out = capsys.readouterr().out
    assert "front: 3ML p 30 % ... front: 4SL p 100 % (30 rows)" in out
    assert sum(row["catalogue"] == "rigid_lock" for row in tilting["selection"]) == 30


def test_limit_in_the_picture_of_angles_names_those_that_it_limits():
    """mu_s is smaller than the limit at the start, and not limited."""
    (axes,) = angles_figure(analyse(load_mechanism("atr95_lift_5"))).axes
    assert [text.get_text() for text in axes.texts] == ["limit of mu, mu_prime"]


@pytest.mark.filterwarnings("error")
def test_pictures_do_without_an_output_or_the_length_of_an_actuator(tmp_path):
    """A pressure over the length, a torque over the driver; each was a traceback."""
    from railsim.plot.mechanisms import drawing_figure, force_figure, held_figure, pressure_figure

    text = """
    format = "railsim-mechanism/1"
    ground.points = { h = [0, 0], f = [0.2, -0.4] }
    bodies.arm = { points = { h = [0, 0], e = [0.5, 0] }, mass = 2, centre = [0.3, 0] }
    joints.h.revolute = ["ground.h", "arm.h"]
    driver = { angle = "arm", end = 1.0 }
    solve.unknown = "a"
    """
    path, results = tmp_path / "arm.toml", []
    for actuator in (
        'actuators.a = { cylinder = ["ground.f", "arm.e"], bore = 0.05, supply_pressure = 1e6 }',
        'actuators.a.turn = "arm"',
    ):
        path.write_text(f"{text}\n{actuator}")
        results.append(analyse(load_mechanism(path)))
    (panel,), (over,) = pressure_figure(results[0]).axes, force_figure(results[1]).axes
    area, (pressure, *_) = 0.25 * np.pi * 0.05**2, panel.lines
    assert pressure.get_ydata() == pytest.approx(results[0].output["force"] / area / 1e6)
    assert over.lines[0].get_ydata() == pytest.approx(
        2.0 * 9.81 * 0.3 * np.cos(np.radians(over.lines[0].get_xdata()))
    )
    drawing_figure(results[1])  # warned of a box without a size
    held_figure({"a": results[0], "b": results[0]})  # and of a legend of nothing
