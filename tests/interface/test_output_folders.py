"""Folders that commands write to: refused before anything is written, and never half full."""

import pytest
from example_result import example_result

from railsim.cli import main

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
