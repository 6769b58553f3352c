"""Files and folders that commands write: refused before anything is, and never half full."""

import os
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from example_result import ROOT, example_result

from railsim.cli import main
from railsim.errors import InputError
from railsim.files.access import PartialFile, check_folder

FIRST = {"contact": "functions.csv", "compare": "compare.csv", "spring verify": "report.html"}


@pytest.fixture
def inputs(tmp_path):
    results = [tmp_path / f"{name}.h5" for name in "ab"]
    for path in results:
        example_result().to_hdf5(path)
    return {"contact": [], "compare": map(str, results), "spring verify": ["turasas_axlebox"]}


@pytest.mark.parametrize("command", FIRST)
def test_file_in_place_of_the_folder_is_refused(tmp_path, inputs, capsys, command):
    out = tmp_path / "out"
    out.write_text("mine")
    assert main([*command.split(), *inputs[command], "--out", str(out)]) == 2
    assert "is a file; give the name of a folder" in capsys.readouterr().err
    assert out.read_text() == "mine"


@pytest.mark.parametrize("where", ["file/out", "nowhere", "file/a/b"])
def test_folder_that_cannot_be_made_is_refused_before_the_work(tmp_path, capsys, where):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "nowhere").symlink_to(tmp_path / "gone")
    with pytest.raises(InputError, match=r"file is a file|a link that leads nowhere"):
        check_folder(tmp_path / where)
    assert (
        main(["modes", "coach_manchester", "--speed", "nan", "--out", str(tmp_path / where)]) == 2
    )
    assert "--out: " in capsys.readouterr().err


@pytest.fixture
def nobody():
    """Root may write everywhere: while it is asked what is allowed, another user runs this."""
    root = os.getuid() == 0
    if root:
        os.setreuid(65534, -1)
    yield
    if root:
        os.setreuid(0, -1)


@pytest.mark.usefixtures("nobody")
def test_folder_in_one_that_cannot_be_written_to_is_refused():
    with TemporaryDirectory() as folder:  # everybody may look into it, other than into tmp_path
        mine = Path(folder)
        mine.chmod(0o777)
        check_folder(mine / "out")
        mine.chmod(0o555)
        with pytest.raises(InputError, match=f"{mine.name} cannot be written to"):
            check_folder(mine / "out")


@pytest.mark.parametrize("command", FIRST)
def test_full_folder_is_kept_without_overwrite(tmp_path, inputs, capsys, command):
    there = tmp_path / "out" / FIRST[command]
    there.parent.mkdir()
    there.write_text("mine")
    assert main([*command.split(), *inputs[command], "--out", str(there.parent)]) == 2
    assert f"holds {there.name}; give --overwrite" in capsys.readouterr().err
    assert there.read_text() == "mine"
    assert len(list(there.parent.iterdir())) == 1


@pytest.mark.parametrize(
    "given",
    [
        ["contact", "--wheel", "no_such.csv"],
        ["compare", "no_such.h5", "nor_this.h5"],
        ["spring", "verify", "no_such.toml"],
    ],
    ids=lambda given: given[0],
)
def test_bad_input_leaves_no_folder(tmp_path, given):
    assert main([*given, "--out", str(tmp_path / "new")]) == 2
    assert not (tmp_path / "new").exists()


ROUTE = ["--route", "curve_r250", "20", "1", "--distance", "10", "--step", "10"]
TRAFFIC = ["--traffic", "coach_manchester", "20", "1", "--tonnage", "1", "--step", "1"]
OF_STUDY = ["--vehicles", "coach_manchester", "--tracks", "curve_r250", "--speeds", "20"]


@pytest.mark.parametrize(
    ("command", "name", "work"),
    [
        (["spring", "design", "turasas_axlebox", "--search"], "arm.png", "springs.search.search"),
        (["mechanism", "atr95_lift_4", "--optimise"], "kinematics.png",
         "mechanisms.optimisation.optimise"),
        (["wear", "coach_manchester", *ROUTE], "wheel_10_km.csv", "studies.wear_loop.carry_out"),
        (["rail-wear", "curve_r500", *TRAFFIC], "left_1_Mt.csv", "studies.rail_wear.carry_out"),
    ],
    ids=lambda given: " ".join(given[:2]) if isinstance(given, list) else given,
)  # fmt: skip
def test_any_file_that_is_there_is_told_before_the_work(
    tmp_path, capsys, monkeypatch, command, name, work
):
    monkeypatch.setattr(f"railsim.{work}", None)
    (tmp_path / name).write_text("mine")
    assert main([*command, "--out", str(tmp_path)]) == 2
    assert f"--out: {tmp_path} holds {name}; give --overwrite" in capsys.readouterr().err
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


@pytest.mark.parametrize(
    ("command", "name"),
    [
        (["wear", "coach_manchester", *ROUTE], "steps"),
        (["identify", "coach_25t", "no_such.toml", "-p", "bodies.carbody.mass"], "evaluations"),
        (["study", *OF_STUDY], "study.json/"),
        (["optimise", "examples/primary_and_yaw_damper.toml"], "study.json/"),
    ],
    ids=lambda given: given[0] if isinstance(given, list) else given,
)
def test_file_in_place_of_a_folder_or_the_reverse_is_told_before_the_work(
    tmp_path, capsys, monkeypatch, command, name
):
    monkeypatch.chdir(ROOT)
    there = tmp_path / name
    there.mkdir() if name.endswith("/") else there.touch()
    assert main([*command, "--out", str(tmp_path), "--overwrite"]) == 2
    kind = "folder" if name.endswith("/") else "file"
    assert f"--out: {there} is a {kind}; rename it, or choose" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [there]


@pytest.fixture
def commands(tmp_path):
    """Commands that write a file, and the option that names it."""
    result = tmp_path / "a.h5"
    example_result().to_hdf5(result)
    return {
        "run": ["run", "coach_manchester", "curve_r250", "--speed", "20", "--out"],
        "plot": ["plot", str(result), "--out"],
        "info": ["info", "coach_manchester", "--draw"],
        "spring vehicle": ["spring", "vehicle", "turasas_axlebox", "--out"],
    }


@pytest.mark.parametrize(
    ("command", "name", "found", "allowed"),
    [
        ("run", "x.csv", "x.csv ends in '.csv'", "the name must end in .h5 or .hdf5"),
        ("run", "x", "x has no ending", ".h5 or .hdf5"),
        ("run", "x.png", "x.png ends in '.png'", ".h5 or .hdf5"),
        ("plot", "x.h5", "x.h5 ends in '.h5'", "the name must end in .png or .svg or .pdf"),
        ("plot", "x", "x has no ending", ".png or .svg or .pdf"),
        ("info", "x.csv", "x.csv ends in '.csv'", ".png or .svg or .pdf"),
        ("spring vehicle", "x.json", "x.json ends in '.json'", "the name must end in .toml"),
    ],
)
def test_file_of_another_kind_is_refused(tmp_path, commands, capsys, command, name, found, allowed):
    before = sorted(tmp_path.iterdir())
    assert main([*commands[command], str(tmp_path / name)]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"{commands[command][-1]}: {found}; ")
    assert allowed in error
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("name", ["RUN.H5", "run.hdf5", "a b.h5", "Lauf über Köln.h5"])
def test_result_may_be_called_so(tmp_path, name):
    given = ["run", "coach_manchester", "curve_r250", "--speed", "20", "--until", "1", "--quiet"]
    assert main([*given, "--out", str(tmp_path / name)]) == 0
    assert main(["info", str(tmp_path / name)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["x.csv", "x.h5", "X.PNG", "x.html"])
@pytest.mark.parametrize("command", [*FIRST, "study"])
def test_folder_is_not_called_like_a_file(tmp_path, inputs, capsys, command, name):
    inputs["study"] = ["--vehicles", "coach_manchester", "--tracks", "straight", "--speeds", "20"]
    assert main([*command.split(), *inputs[command], "--out", str(tmp_path / name)]) == 2
    assert f"--out: {name} is the name of a file; give the name of a folder" in (
        capsys.readouterr().err
    )
    assert not (tmp_path / name).exists()


def test_picture_that_cannot_be_finished_leaves_nothing(tmp_path, monkeypatch, commands):
    from matplotlib.figure import Figure

    def full_disk(figure, path, **_):
        path.write_bytes(b"half")
        raise OSError("no space left on device")

    monkeypatch.setattr(Figure, "savefig", full_disk)
    assert main([*commands["plot"], str(tmp_path / "x.png")]) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]


def test_a_file_in_the_current_folder_is_not_in_its_own_way(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with PartialFile(Path("run.h5"), alone=True) as partial:
        partial.path.write_text("whole")
        assert partial.finish() == Path("run.h5")


@pytest.mark.parametrize(
    ("option", "name"),
    [("--report", "report.html"), ("--plots", "coach_manchester_straight_20.png")],
)
def test_new_study_keeps_the_page_and_the_picture_of_somebody_else(tmp_path, capsys, option, name):
    there = tmp_path / name
    there.write_text("mine")
    given = ["--vehicles", "coach_manchester", "--tracks", "straight", "--speeds", "20", option]
    assert main(["study", *given, "--duration", "1", "--out", str(tmp_path)]) == 2
    assert f"{name}: is not of a study" in capsys.readouterr().err
    assert there.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [there]
