"""``railsim spring``: keys of --json, exit status, pages, and the vehicle file it writes."""

import json
import re
from html.parser import HTMLParser

import pytest

from railsim import cli
from railsim.definitions.loading import load_spring, load_vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.files.sources import library_files
from railsim.report.springs import compute, page

MINIMAL = """
format = "railsim-spring/1"
[arm]
length = 0.4
seat_height = 0.1
bush_torsional_stiffness = 5e3
[material]
G = 78.5e9
E = 206e9
[outer]
mean_diameter = 0.23
free_height = 0.34
wire_diameter = 0.04
active_coils = 3.5
[mounting]
load = 60e3
deflection = 0.08
[loads]
tare = 50e3
laden = 70e3
"""


@pytest.fixture
def write(tmp_path):
    def write(text, name="mine.toml"):
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


def answer(capsys, *arguments):
    assert cli.main(["spring", *arguments, "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


def refused(capsys, *arguments):
    """Lines on stderr of a command that ends with status 2 and prints nothing else."""
    assert cli.main(["spring", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    return err.splitlines()


def test_design_gives_stiffnesses_coils_and_angle(capsys):
    data = answer(capsys, "design", "turasas_axlebox")
    assert data["K_V_outer"] == pytest.approx(634694.7, rel=1e-6)
    assert data["K_V_inner"] == pytest.approx(301641.6, rel=1e-6)
    assert data["n_outer"] == pytest.approx(3.58968, abs=1e-5)
    assert data["n_inner"] == pytest.approx(6.03626, abs=1e-5)
    assert 0.0123 < data["theta"] < 0.0124
    wires = {row["wire_diameter"]: row["active_coils"] for row in data["coils"]["outer"]}
    assert wires[0.041] == pytest.approx(data["n_outer"], rel=1e-12)


def test_verify_gives_cases_and_checks(capsys):
    data = answer(capsys, "verify", "turasas_axlebox")
    assert [case["name"] for case in data["cases"]] == ["ODM", "MOUNTING", "CUM", "T.I.", "A.S."]
    keys = "name load theta deflection K_sys lateral_outer height_outer height_inner K_L K_C"
    for case in data["cases"]:
        assert set(keys.split()) <= set(case)
        assert case["theta"] >= 0.0
        assert case["K_sys"] == pytest.approx(case["load"] / case["deflection"], rel=1e-12)
        assert case["K_L"] == pytest.approx(case["K_L_outer"] + case["K_L_inner"], rel=1e-12)
    for check in data["checks"]:
        assert {"name", "value", "limit", "ok"} <= set(check)
        above = check["must_be"] == "above"
        assert check["ok"] is (
            check["value"] > check["limit"] if above else check["value"] < check["limit"]
        )
    assert data["ok"] is True
    assert {"name", "lowest", "highest", "random"} <= set(data["ride_height"][0])


def test_fatigue_gives_stresses_and_margin_by_spring(capsys):
    data = answer(capsys, "fatigue", "turasas_axlebox")
    for spring in ("outer", "inner"):
        assert data[spring]["tau_min"] < data[spring]["tau_max"]
        assert data[spring]["margin"] > 1.0
    assert data["max_load"] == pytest.approx(1.2 * 59865.525)


def test_search_gives_ranked_nests(capsys):
    changes = ["--set", "search.candidates=64", "--set", "search.results=2"]
    wires = ["--set", "search.wire_diameters=[0.024, 0.027, 0.040, 0.041]"]
    data = answer(capsys, "design", "turasas_axlebox", "--search", *changes, *wires)
    nests = data["search"]["nests"]
    assert 1 <= len(nests) <= 2
    assert {"outer", "inner", "mass", "fatigue_margin", "active"} <= set(nests[0])
    assert data["search"]["tried"] == 64


def test_check_not_met_is_a_result_not_an_error(capsys):
    data = answer(capsys, "verify", "turasas_axlebox", "--set", "material.tau_allowable=700e6")
    failed = [check["name"] for check in data["checks"] if not check["ok"]]
    assert failed == ["yield_outer", "yield_inner"]
    assert data["ok"] is False


def test_single_spring_is_verified_without_an_inner_one(write, capsys):
    data = answer(capsys, "verify", write(MINIMAL))
    assert [case["name"] for case in data["cases"]] == ["tare", "laden"]
    assert "height_inner" not in data["cases"][0]


def test_tables_for_people(capsys):
    for name in ("design", "verify", "fatigue"):
        assert cli.main(["spring", name, "turasas_axlebox"]) == 0
        out, err = capsys.readouterr()
        assert "outer" in out
        assert err == ""
        assert max(len(line) for line in out.splitlines()) < 160


@pytest.mark.parametrize(
    ("command", "changes", "key", "advice"),
    [
        ("design", ["target.load=90e3"], "target.load", "reduce target.load"),
        ("design", ["target.load=70e3"], "target.load", "raise target.load"),
        ("design", ["target.deflection=0.07347"], "target.deflection", "choose a target"),
        ("design", ["target.deflection=0.32"], "target.deflection", "reduce it"),
        ("design", ["inner.free_height=1.2", "arm.seat_height=1.0"], "deflection", "buckles"),
        ("verify", ['loads."T.I."=180e3'], "loads.T.I.", "reduce this load"),
        ("verify", ["loads.CUM=1e9"], "loads.CUM", "solid height"),
        ("verify", ["outer.active_coils=9"], "outer.free_height", "raise it"),
        (
            "verify",
            ["inner.free_height=0.9", "inner.mean_diameter=0.09", "arm.seat_height=0.7"],
            "loads.ODM",
            "buckles",
        ),
        ("verify", ["inner.mean_diameter=0.18"], "inner.mean_diameter", "does not fit"),
        ("verify", ["inner.seat_height=0.19"], "inner.seat_height", "lower inner.seat_height"),
        ("verify", ["inner.free_height=0.6"], "inner.free_height", "shorten"),
        ("verify", ["inner.engagement=0.4"], "inner", ""),
        ("verify", ["outer.wire_diameter=0.5"], "outer", "below"),
        ("verify", ["material.G=200e9"], "material", "Poisson"),
        ("verify", ["checks.solid_load=TI"], "checks.solid_load", "did you mean 'T.I.'?"),
        ("verify", ["loads.ODM=-5"], "loads.ODM", "greater than 0"),
        ("verify", ["outer.mean_diametre=0.2"], "outer.mean_diametre", "mean_diameter"),
        ("fatigue", ["fatigue.max_load=30e3"], "fatigue.max_load", "highest"),
        ("fatigue", ["fatigue.max_load=200e3"], "fatigue.max_load", "solid height"),
        (
            "verify",
            ["fatigue.max_load=120e3", "fatigue.min_load=60e3", "fatigue.tare=odm"],
            "fatigue.tare",
            "no load 'odm' in [loads]; allowed: A.S.,",
        ),
        ("fatigue", ["fatigue.goodman=[[0.0, 4e8]]"], "fatigue.goodman", ""),
        # kg/mm2 in place of Pa
        ("verify", ["material.G=8000", "material.E=21000"], "mounting.load", "solid height"),
        # mm in place of m: a coil of 0.0000 turns was designed, an arm of 400 m verified
        ("design", ["outer.mean_diameter=230"], "outer.mean_diameter", "230 m; lengths in metres"),
        ("verify", ["arm.length=400"], "arm.length", "400 m; lengths in metres"),
        ("verify", ["search.free_height=[0.3, 350]"], "search.free_height", "350 m; lengths in"),
        ("verify", ["tolerances.wire_diameter=0.03"], "tolerances.wire_diameter", "0.027; less"),
        ("verify", ["tolerances.active_coils=4"], "tolerances.active_coils", "is 3.6; less"),
    ],
)
def test_bad_input_names_the_key_and_what_to_change(capsys, command, changes, key, advice):
    arguments = [part for change in changes for part in ("--set", change)]
    lines = refused(capsys, command, "turasas_axlebox", *arguments)
    assert any(key in line and advice in line for line in lines), lines


def test_missing_tables_are_named(write, capsys):
    path = write(MINIMAL)
    (target, inner) = refused(capsys, "design", path)
    assert target.startswith(f"{path}: target: missing")
    assert inner.startswith(f"{path}: inner: missing")
    (line,) = refused(capsys, "fatigue", path)
    assert line.startswith(f"{path}: fatigue: missing")
    (line,) = refused(capsys, "vehicle", path)
    assert line.startswith(f"{path}: vehicle: missing")


def test_unsolvable_design_lists_loads_that_would_do(capsys):
    lines = refused(capsys, "design", "turasas_axlebox", "--set", "target.load=90e3")
    low, high = re.search(r"between ([\d.]+) and ([\d.]+) kN", lines[0]).groups()
    for load, status in ((low, 2), (high, 2)):
        beyond = float(load) * 1e3 + (-5.0 if load is low else 5.0)
        assert (
            cli.main(["spring", "design", "turasas_axlebox", "--set", f"target.load={beyond}"])
            == status
        )
    middle = 0.5e3 * (float(low) + float(high))
    assert cli.main(["spring", "design", "turasas_axlebox", "--set", f"target.load={middle}"]) == 0


class Links(HTMLParser):
    def __init__(self):
        super().__init__()
        self.sources = []

    def handle_starttag(self, tag, attrs):
        self.sources += [value for name, value in attrs if name in ("src", "href")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Page and pictures of a spring."""
    path = tmp_path_factory.mktemp("pages") / "suspension"
    assert cli.main(["spring", "verify", "turasas_axlebox", "--out", str(path)]) == 0
    return path


def test_pages_are_self_contained(folder):
    names = {path.name for path in folder.iterdir()}
    assert {
        "report.html",
        "stiffness.png",
        "deflection.png",
        "arm.png",
        "coils.png",
        "goodman_smith.png",
        "ride_height.png",
    } == names
    page = (folder / "report.html").read_text("utf-8")
    links = Links()
    links.feed(page)
    assert len(links.sources) == 6
    assert all(source.startswith("data:image/png;base64,") for source in links.sources)
    for words in ("Load cases", "Checks", "Fatigue", "Design", "Goodman-Smith", "892.579"):
        assert words in page


def test_page_says_what_is_not_met():
    change = ["material.tau_allowable=700e6", "target.load=90e3"]
    found = page(compute(load_spring("turasas_axlebox", change)), {})
    assert "Not met: yield_outer, yield_inner." in found
    assert "has no physical solution" in found


def test_fatigue_that_nothing_is_known_of_is_said_to_be_open(capsys):
    """`All 9 checks are met` is not the whole strength of a spring."""
    assert cli.main(["spring", "verify", "tare_laden_example"]) == 0
    assert "Fatigue is not assessed" in capsys.readouterr().out
    assert "Fatigue is not assessed" in page(compute(load_spring("tare_laden_example")), {})


def test_existing_pages_are_kept_without_overwrite_and_the_same_every_time(
    folder, tmp_path, capsys
):
    arguments = ["fatigue", "turasas_axlebox", "--out", str(tmp_path)]
    (tmp_path / "report.html").write_text("mine")
    (line,) = refused(capsys, *arguments)
    assert "report.html" in line
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    assert cli.main(["spring", *arguments, "--overwrite"]) == 0
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()


def test_nothing_is_written_on_a_fault(tmp_path, capsys):
    folder = tmp_path / "new"
    refused(capsys, "verify", "turasas_axlebox", "--out", str(folder), "--set", "loads.CUM=1e6")
    assert not folder.exists()


def test_vehicle_file_replaces_the_primary_suspension(tmp_path, capsys):
    path = tmp_path / "coach.toml"
    assert cli.main(["spring", "vehicle", "turasas_axlebox", "--out", str(path)]) == 0
    capsys.readouterr()
    flat = flatten(load_vehicle(path))
    elements = {element.name: element for element in flat.elements}
    assert not any(name.endswith(".primary.right") for name in elements)
    nest = elements["front.outer.coil_nest.right"].definition
    assert nest.kind == "shear_spring"
    assert nest.stiffness[2] == pytest.approx(936340.1, rel=1e-6)
    assert nest.stiffness[0] == nest.stiffness[1] == pytest.approx(850679.6, rel=1e-6)
    assert "rear.inner.arm_bush.left" in elements
    assert sum(body.kind == "axlebox" for body in flat.bodies) == 8
    # the arm points to the bogie's centre, on the mirrored axle as well
    hinge = {
        name: elements[f"front.{name}.arm_bush.right"].point1[0] for name in ("outer", "inner")
    }
    centre = 9.5
    assert hinge["outer"] == pytest.approx(centre + 1.28 - 0.3999491, abs=1e-6)
    assert hinge["inner"] == pytest.approx(centre - 1.28 + 0.3999491, abs=1e-6)


def test_vehicle_file_extends_what_it_is_told_to(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    base = tmp_path / "vehicles"
    base.mkdir()
    mine = base / "mine.toml"
    assert cli.main(["spring", "vehicle", "turasas_axlebox", "--out", str(mine)]) == 0
    path = tmp_path / "laden.toml"
    arguments = ["--extends", "vehicles/mine.toml", "--load", "CUM", "--out", str(path)]
    assert cli.main(["spring", "vehicle", "turasas_axlebox", *arguments]) == 0
    text = path.read_text()
    assert 'extends = "vehicles/mine.toml"' in text
    assert "remove" not in text  # the primary is gone in the file that it extends
    flat = flatten(load_vehicle(path))
    (nest,) = [e for e in flat.elements if e.name == "rear.outer.coil_nest.left"]
    assert nest.definition.stiffness[0] == pytest.approx(911.2e3, rel=1e-3)


def test_vehicle_file_refuses_unknown_names(capsys):
    (line,) = refused(capsys, "vehicle", "turasas_axlebox", "--load", "CUMM")
    assert "did you mean 'CUM'?" in line
    (line,) = refused(capsys, "vehicle", "turasas_axlebox", "--extends", "coach_manchestr")
    assert "coach_manchester" in line


def test_vehicle_warns_of_springs_for_another_load(capsys):
    """Springs for 59.9 kN on an axlebox under a wagon with 97.2 kN; none where they belong."""
    assert cli.main(["spring", "vehicle", "turasas_axlebox"]) == 0
    assert "belong together" not in capsys.readouterr().err
    assert cli.main(["spring", "vehicle", "turasas_axlebox", "--extends", "wagon_c62a"]) == 0
    assert "puts 97.2 kN on an axlebox at rest, the springs are taken at 59.9 kN" in (
        capsys.readouterr().err
    )


def test_vehicle_says_that_the_other_primary_suspension_stays(capsys):
    """The springs of wagon_y25 have other names than those of the coach."""
    said = "'wagon_y25' has nothing of vehicle.remove"
    assert cli.main(["spring", "vehicle", "turasas_axlebox", "--extends", "wagon_y25"]) == 0
    assert said in capsys.readouterr().err
    for coach in ("coach_flexicoil", "coach_manchester"):
        assert cli.main(["spring", "vehicle", "turasas_axlebox", "--extends", coach]) == 0
        assert "vehicle.remove" not in capsys.readouterr().err


def test_verify_says_how_far_the_springs_are_from_the_wanted_deflection(capsys):
    """K_V = G d^4 / (8 n D^3) of both springs, loads in kg in place of N."""
    stiffness = 78.48e9 * (0.041**4 / (8 * 3.6 * 0.230**3) + 0.027**4 / (8 * 6.0 * 0.142**3))
    assert cli.main(["spring", "verify", "turasas_axlebox", "--set", "mounting.load=7012.5"]) == 0
    said = (
        f"{7012.5 / stiffness * 1e3:.2f} mm under the mounting load; mounting.deflection is 73.47"
    )
    assert said in capsys.readouterr().out


def test_vehicle_json_gives_the_tables(capsys):
    data = answer(capsys, "vehicle", "turasas_axlebox")
    assert data["elements"]["coil_nest"]["kind"] == "shear_spring"
    assert data["axleboxes"]["arm"]["sides"] == "both"


def test_coach_flexicoil_is_what_the_tool_writes(tmp_path, capsys):
    # equal as flat lists of bodies and elements: the runs are equal to the last bit
    path = tmp_path / "coach.toml"
    assert cli.main(["spring", "vehicle", "turasas_axlebox", "--out", str(path)]) == 0
    written, shipped = (flatten(load_vehicle(name)) for name in (path, "coach_flexicoil"))
    assert written.bodies == shipped.bodies
    assert written.elements == shipped.elements
    assert written.reference == shipped.reference


@pytest.mark.parametrize("name", library_files("spring"))
def test_shipped_springs_are_sound(name, capsys):
    assert cli.main(["validate", name]) == 0
    assert capsys.readouterr().out == f"{name}: spring, no faults\n"
    assert answer(capsys, "verify", name)["ok"] is True
