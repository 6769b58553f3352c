"""Bad input for elements, tracks, irregularities and settings: file, key, found, allowed; status 2.

Every case is one wrong value in a file that is right otherwise; nothing is computed or written.
"""

import re

import pytest
from example_result import example_result

from railsim.cli import main

DIP = 'type="dip", s=10.0, length=2.0, depth=0.003'
RANDOM = 'type="random", spectrum="erri_b176_low"'
AT = 'bodies=["carbody", "front.frame"], point=[9.5, 1.0, -0.9]'
BETWEEN = 'bodies=["carbody", "front.frame"], points=[[9.5, 1.0, -0.9], [9.5, 1.0, -0.5]]'
PAD = f'kind="friction", {AT}'
AIR = (
    f'kind="airspring", {AT}, bellows_stiffness=4e5, reservoir_stiffness=2e5, '
    "orifice_damping=1e4, horizontal_stiffness=[1e5, 1e5]"
)
LOAD = 'kind="applied_force", bodies=["carbody"]'
STOP = f'kind="bump_stop", {AT}, axis="y"'
LINK = f'kind="spring_damper", {BETWEEN}'

# what is wrong, the key that is named, what is said of it
TRACKS = [
    ("friction_table = [[0.0, -0.1]]", "friction_table.0.1", "-0.1; must be greater than or"),
    ("friction_table = [[9.0, 0.1], [9.0, 0.2]]", "friction_table", "must increase"),
    ('friction_table = [["a", 0.1]]', "friction_table.0.0", "'a'; must be a valid number"),
    ("friction_table = []", "friction_table", "0 values; a list of 1 at least"),
    ("gauge_widening = [[0.0, 15.0]]", "gauge_widening.0.1", "15.0; must be less than or"),
    ('cant_rotation = "outer"', "cant_rotation", "'outer'; must be 'centre' or 'inner_rail'"),
    (
        'vertical = [{type="CST", length=5.0, gradient=12.0}]',
        "vertical.0.gradient",
        "12.0; must be less than or equal to 0.3",
    ),
    ('vertical = [{type="CST", length=-5.0}]', "vertical.0.length", "-5.0; must be greater"),
]
IRREGULARITIES = [
    (
        'type="bump"',
        "",
        "unknown 'type' 'bump'; allowed: dip, kink, law, measured, random, sweep, twist",
    ),
    ("s=3.0", "", "no key 'type'; it tells what the table describes"),
    (DIP.replace("0.003", "3.0"), ".depth", "3.0; must be less than or equal to 0.5"),
    (DIP.replace("2.0", "0.0"), ".length", "0.0; must be greater than 0"),
    (f'{DIP}, rail="middle"', ".rail", "'middle'; must be 'left', 'right' or 'both'"),
    (f'{DIP}, shap="cosine"', ".shap", "unknown key; did you mean 'shape'?"),
    ('type="kink", s=1.0, length=2.0', ".offset", "missing; needed: Displacement in the middle"),
    ('type="twist", s=1.0, length=2.0, height="high"', ".height", "'high'; must be a valid number"),
    (RANDOM.replace("_low", ""), ".spectrum", "'erri_b176'; must be 'erri_b176_low'"),
    (f"{RANDOM}, wavelengths=[70.0, 3.0]", ".wavelengths", "[70.0, 3.0]; [shortest, longest]"),
    (f"{RANDOM}, wavelengths=[3.0, 3.0]", ".wavelengths", "[3.0, 3.0]; [shortest, longest]"),
    (f"{RANDOM}, wavelengths=[0.01, 3.0]", ".wavelengths.0", "0.01; must be greater than or"),
    (f"{RANDOM}, wavelengths=[3.0, 1e9]", ".wavelengths.1", "must be less than or equal to 1000"),
    (f"{RANDOM}, wavelengths=[3.0]", ".wavelengths", "1 value; a list of 2"),
    (f"{RANDOM}, seed=1.5", ".seed", "1.5; must be a valid integer"),
    (f"{RANDOM}, seed=-1", ".seed", "-1; must be greater than or equal to 0"),
    (f"{RANDOM}, channels=[]", ".channels", "0 values; a list of 1 at least"),
    (f'{RANDOM}, channels=["gauge", "gauge"]', "", "'channels' names one irregularity twice"),
    (f'{RANDOM}, channels=["level"]', ".channels.0", "'level'; must be 'lateral', 'vertical'"),
    (f"{RANDOM}, begin=50.0, end=50.0", "", "'end' must lie behind 'begin'"),
    (f"{RANDOM}, coefficients={{lateral=1e-7}}", "", "'coefficients' belong to spectrum"),
    ('type="random", spectrum="own"', "", "'coefficients' belong to spectrum"),
    (
        'type="random", spectrum="own", coefficients={lateral=-1e-7}',
        ".coefficients.lateral",
        "-1e-07; must be greater than or equal to 0",
    ),
    (f"{RANDOM}, fade=-1.0", ".fade", "-1.0; must be greater than or equal to 0"),
    ('type="measured"', "", "either 'file' or 'rows' is needed"),
    ('type="measured", file="none.csv"', ".file", "no file 'none.csv'"),
    ('type="measured", rows=[[0, 0, 0, 0, 0]]', "", "four rows at least"),
]
ELEMENTS = [
    (f"{PAD}, friction_force=[0, 0, 1e3]", "", "friction along z needs 'stick_stiffness' along z"),
    (PAD, "", "'friction_force' or 'friction_coefficient' is needed"),
    (
        f"{PAD}, friction_coefficient=[0, 0, -0.1], stick_stiffness=[0, 0, 1e6]",
        ".friction_coefficient.2",
        "-0.1; must be greater than or equal to 0",
    ),
    (AIR.replace("4e5", "0.0"), ".bellows_stiffness", "0.0; must be greater than 0"),
    (AIR.replace("[1e5, 1e5]", "[1, 1, 1]"), ".horizontal_stiffness", "3 values; a list of 2"),
    (AIR.replace("orifice_damping=1e4, ", ""), ".orifice_damping", "missing; needed: Damping of"),
    (LOAD, "", "'force_table' or 'torque_table' is needed"),
    (
        f"{LOAD}, force_table=[[1, 0, 0, 0], [0, 0, 0, 0]]",
        ".force_table",
        "must increase from row to row",
    ),
    (f"{LOAD}, force_table=[[0, 1]]", ".force_table.0", "2 values; a list of 4"),
    (f'{LOAD}, axes="rail", force_table=[[0, 0, 0, 0]]', ".axes", "'rail'; must be"),
    (f"{STOP}, table=[[0.1, 0.0], [1.0, 2.0]]", ".table", "the first column must begin at 0"),
    (STOP.replace('"y"', '"w"') + ", table=[[0, 0], [1, 2]]", ".axis", "'w'; must be 'x', 'y'"),
    (f"{LINK}, damper_table=[[0, 0], [0.1, 5], [0.2, 4]]", ".damper_table", "must not fall"),
    (f"{LINK}, damper_table=[[0, 0]]", ".damper_table", "[[0, 0]]; a table needs two rows"),
    (f"{LINK}, spring_table=[[0, 0], [0.1, 5]], stiffness=2.0", "", "spring_table"),
    (f"{LINK}, series_stiffness=1e6", "", "series_stiffness"),
    (f'kind="magnet", {AT}', "", "unknown 'kind' 'magnet'"),
]
SETTINGS = [
    ('scheme = "euler"', "scheme", "'euler'; must be 'fast' or 'rk4'"),
    ("output_spacing = -1.0", "output_spacing", "-1.0; must be greater than or equal"),
    ('drive = {mode = "slow"}', "drive.mode", "'slow'; must be 'constant', 'table' or 'free'"),
    ('drive = {mode = "table"}', "drive", "'speed_table' belongs to mode"),
    ("drive = {speed_table = [[0.0, 20.0]]}", "drive", "'speed_table' belongs to mode"),
    ("drive = {resistance = [1.0, 0.0, 0.0]}", "drive", "belong to mode"),
    (
        'drive = {mode = "table", speed_table = [[0.0, -3.0]]}',
        "drive.speed_table.0.1",
        "-3.0; must be greater than 0",
    ),
    (
        'drive = {mode = "table", speed_table = [[9.0, 5.0], [0.0, 5.0]]}',
        "drive.speed_table",
        "must increase",
    ),
    ('drive = {mode = "free", resistance = [1.0]}', "drive.resistance", "1 value; a list of 3"),
    ("outputs = {contact_patch = true}", "outputs.contact_patch", "did you mean 'contact_patches'"),
    ("outputs = {track = 1}", "outputs.track", "1; must be a valid boolean"),
    ('outputs = {elements = "all"}', "outputs.elements", "'all'; a list"),
    ("initial = {carbody = {w = 1.0}}", "initial.carbody.w", "unknown key"),
]


MAP = "coach_manchester --conicity 0.1,0.2"
MASSES = "coach_manchester --over vehicle.bodies.carbody.mass=3e4,-1"
RUN = "coach_25t coach_25t_run"


def check(tmp_path, capsys, monkeypatch, texts, wrong, key, words):
    """Run files of `texts` and expect one fault of file `wrong` about `key`."""
    monkeypatch.chdir(tmp_path)
    names = {"vehicle": "coach_manchester", "track": "straight"}
    options = ["--speed", "20", "--out", "run.h5"]
    for kind, text in texts.items():
        (tmp_path / f"{kind}.toml").write_text(text)
        names[kind] = f"{kind}.toml"
    if "settings" in names:
        options += ["--settings", names["settings"]]
    before = {path.name for path in tmp_path.iterdir()}
    assert main(["run", names["vehicle"], names["track"], *options]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert f"{wrong}: {key}" in err, err
    assert words in err, err
    assert "Traceback" not in err
    assert {path.name for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize(("text", "key", "words"), TRACKS)
def test_wrong_track_is_told(tmp_path, capsys, monkeypatch, text, key, words):
    head = 'format = "railsim-track/1"\nname = "t"\nplan = [{type="STR", length=200.0}]\n'
    check(tmp_path, capsys, monkeypatch, {"track": head + text}, "track.toml", f"{key}: ", words)


@pytest.mark.parametrize(("text", "key", "words"), IRREGULARITIES)
def test_wrong_irregularity_is_told(tmp_path, capsys, monkeypatch, text, key, words):
    head = 'format = "railsim-track/1"\nname = "t"\nplan = [{type="STR", length=200.0}]\n'
    text = f"{head}irregularities = [{{{DIP}}}, {{{text}}}]\n"
    check(
        tmp_path,
        capsys,
        monkeypatch,
        {"track": text},
        "track.toml",
        f"irregularities.1{key}: ",
        words,
    )


@pytest.mark.parametrize(("text", "key", "words"), ELEMENTS)
def test_wrong_element_is_told(tmp_path, capsys, monkeypatch, text, key, words):
    head = 'format = "railsim-vehicle/1"\nname = "v"\nextends = "coach_manchester"\n'
    text = f"{head}[elements]\nadded = {{{text}}}\n"
    check(
        tmp_path,
        capsys,
        monkeypatch,
        {"vehicle": text},
        "vehicle.toml",
        f"elements.added{key}: ",
        words,
    )


@pytest.mark.parametrize(("text", "key", "words"), SETTINGS)
def test_wrong_setting_is_told(tmp_path, capsys, monkeypatch, text, key, words):
    text = f'format = "railsim-settings/1"\n{text}\n'
    check(tmp_path, capsys, monkeypatch, {"settings": text}, "settings.toml", f"{key}: ", words)


@pytest.mark.parametrize(
    ("csv", "words"),
    [
        ("", "empty"),
        ("s,z_lefft\n0,1\n", "did you mean 'z_left'?"),
        ("s,z\n0,0\n1,x\n2,0\n3,0\n", "line 3: not a number ('x')"),
        ("s,z\n0,0\n1,0\n1,0\n3,0\n", "line 4: s = 1 m does not increase"),
        ("s,z\n0,0\n1,0\n2,5\n3,0\n", "line 4: a displacement of 5 m"),
        ("s,z\n0,0\n1,0\n", "four rows at least"),
        ("\x00\x01\x02", "m.csv"),
    ],
)
def test_wrong_measured_track_is_told(tmp_path, capsys, monkeypatch, csv, words):
    (tmp_path / "m.csv").write_text(csv)
    text = (
        'format = "railsim-track/1"\nname = "t"\nplan = [{type="STR", length=200.0}]\n'
        'irregularities = [{type="measured", file="m.csv"}]\n'
    )
    check(tmp_path, capsys, monkeypatch, {"track": text}, f"{tmp_path / 'm.csv'}", "", words)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--start", "-5"], "--start: found -5 m; 0 to less than 1000 m"),
        (["--start", "1000"], "--start: found 1000 m"),
        (["--start", "nan"], "--start: found nan m"),
        (["--start", "50", "--until", "40"], "--until: found 40 m; more than the start, 50 m"),
        (["--until", "1001"], "--until: found 1001 m"),
        (["--duration", "0"], "--duration: found 0 s; a positive number"),
        (["--duration", "1", "--until", "40"], "--duration: given together with --until"),
        (
            ["--set", 'settings.outputs.elements=["nothing*"]'],
            "outputs.elements: no element is called 'nothing*'",
        ),
        (
            [
                "--set",
                "settings.outputs.elements=['wind']",
                "--set",
                'vehicle.elements.wind={kind="applied_force", bodies=["carbody"], '
                "force_table=[[0,0,1e3,0]]}",
            ],
            "outputs.elements: 'wind' in vehicle 'coach_manchester' has no deflection; torques:",
        ),
        (
            ["--set", "settings.initial.carbdy.y=0.1"],
            "no such body in vehicle 'coach_manchester'; did you mean",
        ),
        (["--set", "settings.drive.mode=fast"], "drive.mode: 'fast'; must be 'constant'"),
        (
            ["--set", "settings.step=0.0007"],
            "step: found 0.0007 s; an integer fraction of the output",
        ),
        (
            ["--set", "settings.outputs.low_pass={frequency=80}", "--set", "settings.step=1.25e-3"],
            "fraction of the output interval 0.001 s, at which outputs.low_pass takes values",
        ),
        (["--set", "track.irregularities.0.seed=2"], "no member '0' in irregularities"),
        (["--set", "settings.step=1e-12"], "settings.step: 1e-12; must be greater than or equal"),
        (["--set", "settings.step=5"], "settings.step: 5; must be less than or equal to 0.1"),
        (["--set", "settings.output_rate=1e9"], "output_rate: 1000000000.0; must be less than"),
        (["--set", "settings.output_rate=1e-9"], "output_rate: 1e-09; must be greater than"),
        (["--set", "settings.fastsim_grid.1=100000"], "fastsim_grid.1: 100000; must be less than"),
        (["--set", "track.plan.0.length=1e300"], "plan.0.length: 1e+300; must be less than"),
        (["--set", "track.plan.0.length=1e7"], "1e+07 m of track with details of 2.5 m; a shorter"),
        (["--set", "vehicle.bodies.carbody.mass=1e300"], "no static equilibrium of 'Passenger"),
    ],
)
def test_wrong_option_is_told(tmp_path, capsys, monkeypatch, options, words):
    monkeypatch.chdir(tmp_path)
    given = ["run", "coach_manchester", "straight", "--speed", "20", "--out", "run.h5", *options]
    assert main([*given, "--quiet"]) == 2
    err = capsys.readouterr().err
    assert words in err, err
    assert "Traceback" not in err
    assert not list(tmp_path.iterdir())


def test_run_without_speed_is_told(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "coach_manchester", "straight"]) == 2
    assert "--speed: no speed is given; a speed in m/s" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["validate-model", "coach_25t_run", "coach_25t_run"], "MEASURED.toml: two runs named"),
        (["validate-model", "coach_25t_run", "a.h5", "b.h5"], "RESULT.h5: 2 results for 1 "),
        (["validate-model", "coach_25t_run", "--limits", "none"], "none: no file 'none'"),
        (["identify", "coach_25t", *2 * ["coach_25t_run"], "-p", "x"], "MEASURED.toml: coach_25t"),
    ],
)
def test_files_without_an_option_are_not_called_by_one(given, words, tmp_path, monkeypatch, capsys):
    """And what is wrong with them is said before a run is simulated."""
    monkeypatch.setattr("railsim.identification.runs.simulated_run", None)
    monkeypatch.chdir(tmp_path)
    for name in ("a.h5", "b.h5"):
        example_result().to_hdf5(name)
    assert main(given) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("work", "given", "words"),
    [
        (
            "studies.stability_map._compute",
            f"critical-speed {MAP} --method all --points 0",
            "--points: found 0",
        ),
        ("studies.stability_map._compute", f"critical-speed {MAP},9", "--conicity: found 9"),
        ("linear.modes.parameter_locus", f"modes {MASSES}", "--over: bodies.carbody.mass: -1"),
        ("identification.fit.Problem", f"identify {RUN} -p x", "--parameters: x: no value 'x'"),
        ("contact.summary.contact_summary", "contact --gauges 1.4,9", "--gauges: found 9; 0.3 to"),
    ],
)
def test_what_is_wrong_is_said_before_long_work(work, given, words, tmp_path, monkeypatch, capsys):
    """And nothing is left behind."""
    monkeypatch.setattr(f"railsim.{work}", None)
    monkeypatch.chdir(tmp_path)
    assert main([*given.split(), "--out", "out"]) == 2
    assert words in capsys.readouterr().err
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("command", "found"),
    [
        (["stationary", "coach_manchester", "--cant", "0.5000001"], "found 0.5000001 m; above 0"),
        (["contact", "--gauge", "2.5000001"], "found 2.5000001; 0.3 to 2.5 m"),
        (["contact", "--creep", "--friction", "1.0000001"], "found 1.0000001; above 0"),
        (["run", "coach_manchester", "straight", "--speed", "20", "--until", "1000.00001"],
         "found 1000.00001 m; more than the start, 0 m, and at most 1000 m"),
        (["curving", "coach_manchester", "--radius", "300", "--friction", "2.0000001"],
         "found 2.0000001; above 0, at most 2"),
    ],
)  # fmt: skip
def test_a_refused_number_does_not_read_like_its_limit(command, found, capsys):
    assert main(command) == 2
    assert found in capsys.readouterr().err


REQUIRED = [
    "fmu coach straight --out x.fmu",
    "export r.h5 --out x.csv",
    "identify coach m.toml --parameters p.toml",
    "curving coach --radius 300",
    "wear coach --route straight 20 1 --distance 1 --step 1",
    "rail-wear straight --traffic coach 20 1 --tonnage 1 --step 1",
    "assess-track r.csv --vehicles coach --speeds 20 --out x",
]


@pytest.mark.parametrize("line", REQUIRED, ids=lambda line: line.split()[0])
def test_an_option_without_which_a_command_has_no_task_is_asked_for(line, capsys):
    command, *options = re.split(" (?=--)", line)
    for name in (option.split()[0] for option in options):
        rest = [
            word for option in options if not option.startswith(name) for word in option.split()
        ]
        assert main([*command.split(), *rest]) == 2
        assert f"Missing option '{name}'" in capsys.readouterr().err
