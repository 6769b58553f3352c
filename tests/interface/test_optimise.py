"""`railsim optimise` and the analyses of a study, through the command line and Python."""

import csv
import json
from contextlib import nullcontext as nothing
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import railsim
from railsim.cli import main
from railsim.definitions.loading import load_study, load_vehicle
from railsim.definitions.study.design import Optimise
from railsim.studies import designs as DESIGNS
from railsim.studies.designs import Design, Evaluation
from railsim.studies.optimise import _active
from railsim.studies.spec import Execution

STUDY = """format = "railsim-study/1"
name = "Primary stiffness in a curve"
vehicles = ["mine.toml"]
tracks = ["curve_r250"]
speeds = [20.0]
[analyses.curve]
kind = "curving"
radius = 300.0
cant = 0.15
[optimise]
evaluations = 6
batch = 3
[optimise.variables]
"vehicle.primary.stiffness.x" = { low = 5e6, high = 40e6, scale = "log" }
[[optimise.objectives]]
quantity = "curve.T_gamma"
[[optimise.objectives]]
quantity = "curve.attack"
goal = "maximise"
[[optimise.constraints]]
quantity = "curve.Y_over_Q"
high = 0.9
"""
VEHICLE = 'format = "railsim-vehicle/1"\nname = "mine"\nextends = "coach_manchester"\n'
X = "vehicle.primary.stiffness.x"
UNITS = {X: "N/m"}
HUNTING = '[analyses.hunting]\nkind = "critical_speed"\n'
DAMPER = "vehicle.secondary_vertical_damper.damping"


def written(folder, text=STUDY):
    (folder / "mine.toml").write_text(VEHICLE, encoding="utf-8")
    file = folder / "study.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)


@pytest.fixture(autouse=True)
def undrawn():
    """Pictures are half of the time; those of `found` are made before, and looked at."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("railsim.plot.style.save", lambda *_, **__: None)
        yield


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """An optimisation of six designs, and its file."""
    folder = tmp_path_factory.mktemp("optimise")
    file = written(folder)
    return railsim.optimise(file, out=folder / "o", workers=1), file


def test_front_choice_and_files(found):
    optimised, _ = found
    assert len(optimised.designs) == optimised.computed == 6
    # wear and angle of attack both grow with the stiffness: every design is a compromise
    assert [design.number for design in optimised.front] == sorted(
        range(1, 7), key=lambda number: optimised.designs[number - 1].variables[X]
    )
    record = json.loads((optimised.folder / "optimise.json").read_text())
    assert record["chosen"]["number"] == optimised.chosen.number
    with open(optimised.folder / "designs.csv", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["front"] for row in rows] == ["1"] * 6
    assert {"curve.T_gamma (N)", "curve.attack (rad)", f"{X} (N/m)"} <= set(rows[0])
    assert (optimised.folder / "front.png").stat().st_size > 5000
    wear = optimised.sensitivities[0]
    assert wear.low[X] < optimised.chosen.objectives[0] < wear.high[X]
    assert wear.total == pytest.approx({X: 1.0}, abs=0.05)


def test_chosen_vehicle_extends_its_original(found):
    optimised, _ = found
    (file,) = optimised.vehicles
    stiffness = optimised.chosen.variables[X]
    original = load_vehicle("coach_manchester", [f"primary.stiffness.x={stiffness:.6g}"])
    written_one = load_vehicle(file)
    assert written_one.name == "mine, optimised"
    assert written_one.replace(name=original.name) == original
    assert "bodies" not in file.read_text()  # nothing but what differs
    curve = railsim.curving(
        written_one,
        railsim.load_track("curve_r250"),
        radius=[300.0],
        cant_deficiency=[1.5 * 20.0**2 / (9.81 * 300.0) - 0.15],
    )
    assert float(np.sum(curve.T_gamma)) == pytest.approx(optimised.chosen.objectives[0], rel=1e-6)


def test_repeated_it_computes_nothing_and_more_evaluations_go_on(found, capsys):
    optimised, file = found
    out = str(optimised.folder)
    before = (optimised.folder / "optimise.json").read_bytes()
    again = railsim.optimise(file, out=out, workers=1)
    assert again.computed == 0
    assert (optimised.folder / "optimise.json").read_bytes() == before
    command = ["optimise", file, "--out", out, "--workers", "1", "--quiet"]
    assert main([*command, "--evaluations", "7", "--choose", "2"]) == 0
    words = capsys.readouterr().out
    assert "front of 7 in 7 designs" in words
    error = (
        100.0
        * json.loads((optimised.folder / "optimise.json").read_text())["sensitivities"][0]["error"]
    )
    assert f"depends on: primary.stiffness.x 100 % (surrogate's error {error:.0f} %)" in words
    assert "mine_chosen.toml" in words
    chosen = load_vehicle(optimised.folder / "mine_chosen.toml")
    second = optimised.designs[1].variables[X]
    assert (
        chosen.to_toml()
        == load_vehicle(
            str(optimised.folder.parent / "mine.toml"), [f"primary.stiffness.x={second}"]
        )
        .replace(name=chosen.name)
        .to_toml()
    )


def test_another_file_is_refused(found, capsys):
    optimised, _ = found
    other = written(optimised.folder, STUDY.replace("high = 0.9", "high = 0.8"))
    try:
        assert main(["optimise", other, "--out", str(optimised.folder)]) == 2
    finally:
        written(optimised.folder)
    assert "holds another optimisation" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('goal = "maximise"', 'goal = "most"', "optimise.objectives.1.goal"),
        ("low = 5e6", "low = 5e7", "'low' must be below 'high'"),
        ('"vehicle.primary', '"track.primary', "no key of a vehicle"),
        ("high = 0.9", "", "'low' or 'high' is needed"),
        ("high = 0.9", "high = 0.8\nlow = 0.9", "'low' must not be above 'high'"),
        ("evaluations = 6", 'method = "differential_evolution"', "takes one objective"),
        ('kind = "curving"', 'kind = "curve"', "analyses.curve"),
        ("speeds = [20.0]", "", "'speeds' is needed"),
        ("[optimise]", "[optimize]", "optimize"),
        (
            'scale = "log" }',
            'also = ["vehicle.carbody.mass"] }\n[grid]\n"vehicle.carbody.mass" = [4e4]',
            "'vehicle.carbody.mass' is varied twice",
        ),
        ("primary.stiffness.x", "primary.stiffness.q", "study.toml: vehicle.primary"),
        ("radius = 300.0", "radius = 3.0", "study.toml: analyses.curve.radius: found 3 m; 20 m"),
        ("0.15", "0.15\ncant_deficiency = 90.0", "analyses.curve.cant_deficiency: found 90 m"),
        ("[opt", f"{HUNTING}conicity = 9.0\n[opt", "analyses.hunting.conicity: found 9.0; 0.005"),
        ("[opt", f"{HUNTING}low = 130.0\n[opt", "analyses.hunting.low: found 130 m/s; less than"),
        ("[opt", f"{HUNTING}amplitude = 1e-3\n[opt", "analyses.hunting.amplitude: found 0.001 m;"),
        (
            'low = 5e6, high = 40e6, scale = "log"',
            "low = -5e6, high = 1e6",
            "0: -5000000.0; must be",
        ),
    ],
)
def test_faults_of_the_file(tmp_path, capsys, old, new, words):
    file = written(tmp_path, STUDY.replace(old, new, 1))
    assert main(["optimise", file, "--out", str(tmp_path / "o")]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("curve.attack", "curve.atack", "objectives.1.quantity: no run has 'curve.atack'; did you"),
        ("curve.Y_over_Q", "Y_over_Q_peak", "constraints.0.quantity: no run has 'Y_over_Q_peak'"),
        ("curve.T_gamma", "kurve.T_gamma", "objectives.0.quantity: no run has 'kurve.T_gamma'"),
    ],
)
def test_a_quantity_that_no_run_has_is_found_before_any(tmp_path, capsys, old, new, words):
    """Steady curving alone: the study has no run in the time domain, and no peaks."""
    file = written(tmp_path, STUDY.replace(old, new))
    for command in (["validate"], ["optimise", "--out", str(tmp_path / "o")]):
        assert main([*command, file]) != 0
        assert f"study.toml: optimise.{words}" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("quantity", "there"),
    [
        *((name, True) for name in ("T_gamma_peak", "dQ_over_Q0_min_20hz", "Y_median2", "Y_mid")),
        *((name, True) for name in ("Q_peak_distance", "speed", "step")),
        # a text; by magnitude; no numbers of its own
        *((name, False) for name in ("status", "Q_max", "curve.Q")),
    ],
)
def test_columns_of_a_run_with_a_number_are_quantities(tmp_path, capsys, quantity, there):
    run = 'kind = "run"\n[analyses.judged]\nkind = "assess"'
    text = STUDY.replace('kind = "curving"\nradius = 300.0\ncant = 0.15', run)
    text = text.replace("curve.T_gamma", quantity).replace("curve.attack", "judged.largest_share")
    file = written(tmp_path, text.replace("curve.Y_over_Q", "Y_over_Q_peak"))
    assert main(["validate", file]) == (0 if there else 2)
    assert (f"no run has '{quantity}'" in capsys.readouterr().err) is not there


def test_what_comes_last_is_looked_at_first(tmp_path, capsys, monkeypatch):
    """The number of a design; files that the pictures and tables would replace."""
    command = ["optimise", written(tmp_path), "--workers", "1", "--out", str(tmp_path / "o")]
    monkeypatch.setattr("railsim.studies.carry_out.State", None)
    assert main([*command, "--choose", "7"]) == 2
    assert "--choose: design 7; 1 to 6" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()
    (tmp_path / "o" / "front.png").mkdir(parents=True)
    assert main(command) == 2
    assert "front.png is a folder; rename it, or choose another folder" in capsys.readouterr().err


def test_labels_that_no_run_has_are_found_before_any(tmp_path, capsys):
    file = written(tmp_path, STUDY + 'where = { track = "curve_r500" }\n')
    assert main(["optimise", file, "--out", str(tmp_path / "o")]) == 2
    words = "study.toml: optimise.constraints.0.where: no run has these labels"
    assert words in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


def test_a_key_of_whole_numbers_is_refused_before_any_run(tmp_path, capsys):
    """Both bounds are orders of a polygonal wheel; what lies between them is none."""
    round_ = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.out_of_round"
    text = STUDY.replace(X, f"vehicle.{round_}.w.waves.0.0")
    file = written(tmp_path, text.replace("low = 5e6, high = 40e6", "low = 1, high = 20"))
    waves = f'[{round_}.w]\ntype = "harmonics"\nwaves = [[1.0, 1e-4, 0.0]]\n'
    (tmp_path / "mine.toml").write_text(VEHICLE + waves, encoding="utf-8")
    assert main(["optimise", file, "--out", str(tmp_path / "o")]) == 2
    assert "is no whole number" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("low", [31391234.0, 31391237.0])
def test_designs_are_within_bounds_of_many_digits_and_differ(tmp_path, low):
    text = STUDY.replace("low = 5e6, high = 40e6", f"low = {low}, high = {low + 3.0}")
    optimised = railsim.optimise(written(tmp_path, text), out=tmp_path / "o", workers=1)
    values = {design.variables[X] for design in optimised.designs}
    assert len(values) == 6
    assert all(low <= value <= low + 3.0 for value in values)


@pytest.mark.parametrize("method", ["nsga2", "differential_evolution"])
def test_no_more_designs_than_the_given_number(tmp_path, method):
    """Of a population that is larger by default."""
    pytest.importorskip("pymoo")
    one = '[[optimise.objectives]]\nquantity = "curve.attack"\ngoal = "maximise"\n'
    text = STUDY.replace(one, "").replace("batch = 3", f'method = "{method}"')
    file = written(tmp_path, text)
    with pytest.raises(railsim.InputError, match="5 at least") if method[0] == "d" else nothing():
        railsim.optimise(file, out=tmp_path / "few", evaluations=3, workers=1)
    assert len(railsim.optimise(file, out=tmp_path / "o", workers=1).designs) == 6


def test_a_design_that_derails_has_no_values(tmp_path):
    """Of its constraints neither: those up to where it ended would be other quantities."""
    z = '"vehicle.bodies.carbody.position.2" = { low = -3.5, high = -3.3 }'
    text = STUDY.replace('kind = "curving"\nradius = 300.0\ncant = 0.15', 'kind = "run"')
    text = text.replace("[20.0]", "[31.0]").replace("curve.T_gamma", "Y_peak")
    text = text.replace("curve.attack", "Q_peak").replace("curve.Y_over_Q", "Q_peak")
    start, end = text.index(f'"{X}"'), text.index("[[optimise.objectives]]")
    file = written(tmp_path, text[:start] + z + "\n" + text[end:])
    found = railsim.optimise(file, out=tmp_path / "o", evaluations=1, workers=1)
    (design,) = found.designs
    assert "lifted a wheel" in design.reason
    assert np.isnan(design.values).all()
    header = (tmp_path / "o" / "designs.csv").read_text().splitlines()[0]
    assert header.split(",")[2:4] == ["Y_peak (N)", "Q_peak (N)"]


@pytest.mark.parametrize("more", [["--quiet"], ["--json"], ["--choose", "2"]])
def test_it_fails_where_every_design_does(tmp_path, capsys, more):
    """No steady rolling in a curve of 20 m; the reason is that of the study."""
    file = written(tmp_path, STUDY.replace("radius = 300.0", "radius = 20.0"))
    command = ["optimise", file, "--out", str(tmp_path / "o"), "--workers", "1"]
    assert main([*command, "--evaluations", "2", *more]) == 1
    said = capsys.readouterr()
    assert "none of 2 designs has values: " in said.err
    assert "study.json holds the reasons" in said.err
    reasons = {
        run["status_reason"] for run in json.loads((tmp_path / "o/study.json").read_text())["runs"]
    }
    assert any(f"has values: {reason}; " in said.err for reason in reasons)
    if more == ["--json"]:
        assert json.loads(said.out)["exit_status"] == 1


def test_a_quantity_that_no_variable_changes_is_said_to_be(tmp_path, capsys):
    """The least damped mode is one of the wheelsets on their springs, none of the car.

    Its values differ by round-off of the eigenvalues: that is no front.
    """
    text = STUDY.replace('kind = "curving"\nradius = 300.0\ncant = 0.15', 'kind = "modes"')
    text = text.replace("curve.T_gamma", "curve.damping").replace("curve.attack", "curve.damping")
    text = text.replace("curve.Y_over_Q", "curve.damping").replace(X, DAMPER)
    text = text.replace("5e6", "2e4").replace("40e6", "4e5")
    out = str(tmp_path / "o")
    assert main(["optimise", written(tmp_path, text), "--out", out, "--workers", "1"]) == 0
    said = capsys.readouterr().out
    assert "curve.damping depends on: none of the variables" in said
    assert "front of 1 in 6 designs" in said


def test_the_values_that_decide_are_in_the_table(tmp_path):
    """Two runs: the lower limit is one of the smaller value, the upper one of the larger."""
    text = STUDY.replace("[20.0]", "[20.0, 30.0]").replace('kind = "curving"', 'kind = "modes"')
    text = text.replace("radius = 300.0\ncant = 0.15\n", "").replace(
        "curve.T_gamma", "curve.damping"
    )
    text = text.replace('curve.attack"', 'curve.damping"\nover = "mean"')
    text = text.replace("curve.Y_over_Q", "curve.damping").replace("high = 0.9", "low = 0.0")
    text += '[[optimise.constraints]]\nquantity = "curve.damping"\nhigh = 0.9\n'
    found = railsim.optimise(written(tmp_path, text), out=tmp_path / "o", evaluations=3, workers=1)
    assert [one.quantity for one in found.sensitivities] == [
        "curve.damping",
        "curve.damping, mean",
        "curve.damping, smallest",
    ]
    largest, mean, smallest = (one.low[X] for one in found.sensitivities)
    assert smallest < mean < largest
    with open(tmp_path / "o" / "designs.csv", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    for row, design in zip(rows, found.designs, strict=True):
        largest, mean = design.objectives
        smallest, highest = design.constraints
        assert largest == highest
        assert mean == pytest.approx(0.5 * (smallest + largest), rel=1e-12)
        assert float(row["curve.damping"]) == largest
        assert float(row["curve.damping, mean"]) == mean
        assert float(row["curve.damping, smallest"]) == smallest


def test_a_chosen_design_beyond_a_limit_is_said_to_be(tmp_path, capsys):
    """All of them are: there is no front."""
    file = written(tmp_path, STUDY.replace("high = 0.9", "high = 0.01"))
    command = ["optimise", file, "--out", str(tmp_path / "o"), "--workers", "1"]
    assert main([*command, "--evaluations", "2", "--choose", "2"]) == 0
    words = "design 2 does not keep all constraints"
    assert f"remark: {words}" in capsys.readouterr().out
    record = json.loads((tmp_path / "o" / "optimise.json").read_text())
    assert record["front"] == []
    assert record["chosen"]["feasible"] is False
    assert f"\n# {words}\n" in (tmp_path / "o" / "mine_chosen.toml").read_text()
    # without a choice the one with the smaller Y/Q is shown
    assert main([*command, "--evaluations", "2"]) == 0
    said, *_, row = capsys.readouterr().out.splitlines()
    with open(tmp_path / "o" / "designs.csv", encoding="utf-8") as stream:
        designs = list(csv.DictReader(stream))
    least = min(designs, key=lambda design: float(design["curve.Y_over_Q"]))
    assert said == "none of 2 designs keeps all constraints"
    assert row.split()[:2] == ["nearest", least["design"]]


def test_bounds_and_limits_are_told_with_all_their_digits():
    variable = {"low": 31391234.0, "high": 41391234.0}
    limit = {"quantity": "curve.T_gamma", "high": 1234567.5}
    wanted = Optimise.model_validate(
        {
            "variables": {X: variable},
            "constraints": [limit],
            "objectives": [{"quantity": "curve.T_gamma"}],
        }
    )
    chosen = Design(1, {X: 31391234.0}, (1234567.0,), (1234567.0,), feasible=True)
    assert _active(wanted, chosen, [chosen], UNITS) == (
        f"{X} at its lower bound, 31391234 N/m",
        "curve.T_gamma at its upper limit, 1234567.5 N",
    )


@pytest.mark.parametrize(("share", "reached"), [(0.015, True), (0.025, False), (0.985, True)])
@pytest.mark.parametrize("scale", ["linear", "log"])
def test_bounds_count_as_reached_within_2_per_cent_of_the_range(share, reached, scale):
    value = 1e6 * 100.0**share if scale == "log" else 1e6 + 99e6 * share
    wanted = Optimise.model_validate(
        {
            "variables": {X: {"low": 1e6, "high": 1e8, "scale": scale}},
            "objectives": [{"quantity": "curve.T_gamma"}],
        }
    )
    chosen = Design(1, {X: value}, (0.0,), (), feasible=True)
    assert bool(_active(wanted, chosen, [chosen], UNITS)) is reached


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e6])
@pytest.mark.parametrize(("share", "reached"), [(0.015, True), (0.025, False), (-0.015, True)])
def test_a_limit_of_0_counts_as_reached_within_2_per_cent_of_the_range_of_the_designs(
    unit, share, reached
):
    """In whatever unit; a design without values has no part in the range."""
    limit = {"quantity": "curve.y", "high": 0.0}
    variables, objectives = {X: {"low": 0.0, "high": 1.0}}, [{"quantity": "curve.y"}]
    known = {"variables": variables, "objectives": objectives, "constraints": [limit]}
    values = np.array([-0.7, -share, 0.3, np.nan]) * unit
    designs = [Design(1, {X: 0.5}, (value,), (value,), feasible=True) for value in values]
    found = _active(Optimise.model_validate(known), designs[1], designs, UNITS)
    assert found == (("curve.y at its upper limit, 0",) if reached else ())


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_excess_over_a_limit_of_0_does_not_depend_on_the_unit(tmp_path, monkeypatch, unit):
    """-1, 0, 1 in some unit in the first designs, then 3; over limits of 0 and 5 it is 3/5."""
    limits = "low = -0.0\n[[optimise.constraints]]\nquantity = 'curve.z'\nlow = 0.0\nhigh = 5.0"
    study = load_study(written(tmp_path, STUDY.replace("high = 0.9", limits)))

    def computed(spec, *_):
        values = dict(zip(spec.linked[0][X], [-1.0, 0.0, 1.0, 3.0], strict=False))
        quantities = {"curve.T_gamma": 1.0, "curve.attack": 1.0}
        records = [
            {"labels": {X: text}, "status": "complete",
             "own": {**quantities, "curve.Y_over_Q": unit * value, "curve.z": -value}}
            for text, value in values.items()
        ]  # fmt: skip
        return SimpleNamespace(records=records, computed=len(records))

    monkeypatch.setattr(DESIGNS, "run_study", computed)
    monkeypatch.setattr(DESIGNS, "summary_row", lambda record: record["own"])
    evaluation = Evaluation(study, study.optimise, tmp_path, Execution())
    first = evaluation(np.array([[0.1], [0.2], [0.3]]))
    assert first.constraints == pytest.approx(np.array([[1.0, -0.2], [0.0, 0.0], [-1.0, 0.2]]))
    assert evaluation(np.array([[0.4]])).constraints[3] == pytest.approx([-3.0, 0.6])
    assert [design.feasible for design in evaluation.designs] == [False, True, False, False]
    assert [design.excess for design in evaluation.designs] == pytest.approx([1.0, 0.0, 0.2, 0.6])


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("", True),
        ("magnitude = true", False),
        ('where = { track = "left" }', True),
        ('where = { track = "right" }', False),
    ],
)
def test_a_sign_that_is_a_direction_is_said_to_count(tmp_path, monkeypatch, asked, said):
    """Of the sum of Y in curves to the left and to the right; not between two limits."""
    text = STUDY.replace('"curve.T_gamma"', f'"sum_Y_peak"\n{asked}')
    text = text.replace("curve.Y_over_Q", "sum_Y_peak").replace("high = 0.9", "low = -6\nhigh = 6")
    study = load_study(written(tmp_path, text.replace("curve.attack", "curve.change")))
    records = [
        {"labels": {X: "1", "track": track}, "status": "complete", "sum_Y_peak": value,
         "curve.change": -1.0}
        for track, value in (("left", -5.0), ("right", 2.0))
    ]  # fmt: skip
    outcome = SimpleNamespace(records=records, computed=2)
    monkeypatch.setattr(DESIGNS, "run_study", lambda *_: outcome)
    monkeypatch.setattr(DESIGNS, "summary_row", lambda record: record)
    monkeypatch.setattr(DESIGNS, "_written_value", lambda *_: "1")
    remarks = []
    evaluation = Evaluation(study, study.optimise, tmp_path, Execution(on_remark=remarks.append))
    for _ in range(2):  # once, not for each batch
        evaluation(np.array([[0.0]]))
    assert ["has negative values" in words for words in remarks] == [True] * said


@pytest.mark.parametrize("unknown", [0, 2])
def test_designs_without_values_are_said_to_be_left_out_of_the_sensitivities(found, unknown):
    optimised, _ = found
    lost = [
        Design(7 + k, {X: 1e7}, (np.nan,) * 2, (np.nan,), feasible=False) for k in range(unknown)
    ]
    words = list(map(str, replace(optimised, designs=(*optimised.designs, *lost)).parts()))
    assert ("without the 2 designs that have no values:" in words) == bool(unknown)


def test_a_study_says_that_it_does_not_optimise(tmp_path, capsys):
    command = ["study", written(tmp_path), "--out", str(tmp_path / "s"), "--workers", "1"]
    assert main(command) == 0
    captured = capsys.readouterr()
    assert "the table 'optimise' is not used here" in captured.out + captured.err


def test_a_study_without_the_table(tmp_path, capsys):
    assert main(["optimise", "curving_reference", "--out", str(tmp_path / "o")]) == 2
    assert "optimise: missing" in capsys.readouterr().err


def test_the_example_is_a_study():
    study = load_study("examples/primary_and_yaw_damper.toml")
    assert study.optimise is not None
    (vehicle,) = study.vehicles
    for key in study.optimise.variables:
        load_vehicle(vehicle, [f"{key.removeprefix('vehicle.')}=1e5"])


ANALYSES = {
    "curve": {"kind": "curving", "radius": 300.0, "cant": 0.15, "cant_deficiency": 0.05},
    "hunting": {"kind": "critical_speed", "low": 20.0, "high": 60.0},
    "shape": {"kind": "modes", "linearisation": "harmonic"},
}


@pytest.mark.further
def test_analyses_are_columns_of_the_summary(tmp_path):
    outcome = railsim.study(
        "coach_manchester", "curve_r250", 20.0, analyses=ANALYSES, out=tmp_path, workers=1
    )
    (record,) = outcome.records
    assert record["status"] == "complete"
    assert record["file"] == ""
    assert not list(tmp_path.glob("*.h5"))
    vehicle, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    hunting = railsim.critical_speed(vehicle, track, methods=["linear"], low=20.0, high=60.0)
    assert record["quantities"]["hunting.linear"] == hunting.linear.speed
    least = railsim.modes(vehicle, track, speed=20.0, linearisation="harmonic").least_damped
    assert record["quantities"]["shape.damping"] == least.damping_ratio
    header = (tmp_path / "summary.csv").read_text().splitlines()[0]
    assert "hunting.linear (m/s)" in header
    assert "curve.T_gamma (N)" in header
    again = railsim.study(
        "coach_manchester", "curve_r250", 20.0, analyses=ANALYSES, out=tmp_path, workers=1
    )
    assert again.computed == 0


def test_remarks_on_analyses_stand_with_their_numbers(tmp_path):
    """What steady curving leaves out; that a number is the end of the search."""
    analyses = {
        "curve": ANALYSES["curve"],
        "hunts": {"kind": "critical_speed", "low": 5.0, "high": 10.0},
    }
    outcome = railsim.study(
        "coach_manchester", "straight", None, analyses=analyses, out=tmp_path, workers=1,
        assignments=["track.gauge_widening=[[0.0, 0.01]]"],
    )  # fmt: skip
    (record,) = outcome.records
    assert record["quantities"]["hunts.linear"] == 10.0
    said = [remark.partition(": ")[::2] for remark in record["remarks"]]
    assert any(name == "curve" and "gauge widening" in words for name, words in said)
    assert any(name == "hunts" and "no linear critical speed" in words for name, words in said)
    assert "no linear critical speed" in (tmp_path / "summary.csv").read_text()


def test_analyses_that_no_speed_counts_for_need_none(tmp_path):
    analyses = {"curve": ANALYSES["curve"]}
    outcome = railsim.study(
        "coach_manchester", "straight", None, analyses=analyses, out=tmp_path, workers=1
    )
    assert outcome.records[0]["status"] == "complete"


def test_run_with_an_assessment_is_kept_when_only_the_analysis_changes(tmp_path):
    how = {"out": tmp_path, "workers": 1, "until": 90.0, "resume": True}
    first = {"wear": {"kind": "assess", "standard": "wear"}}
    outcome = railsim.study("coach_manchester", "curve_r250", 20.0, analyses=first, **how)
    (record,) = outcome.records
    assert record["quantities"]["wear.T_gamma"] > 0.0
    file = tmp_path / record["file"]
    written_at = file.stat().st_mtime_ns
    more = {**first, "shape": ANALYSES["shape"]}
    outcome = railsim.study("coach_manchester", "curve_r250", 20.0, analyses=more, **how)
    (second,) = outcome.records
    assert file.stat().st_mtime_ns == written_at
    assert second["quantities"]["wear.T_gamma"] == record["quantities"]["wear.T_gamma"]
    assert "shape.damping" in second["quantities"]
