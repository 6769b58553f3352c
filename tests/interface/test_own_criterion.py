"""A new assessed quantity is one module and a limit: the example of `docs/extending.md`."""

import json
from pathlib import Path

import pytest
from made_record import Q0, curve, made, track
from own_criterion import LIMITS, UNLOADING

from railsim.assessment import assess
from railsim.assessment.criteria import CRITERIA
from railsim.cli import main
from railsim.errors import InputError


@pytest.fixture
def limits(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(LIMITS)
    return file


def test_new_quantity_is_assessed_printed_and_reported(limits, monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(CRITERIA, "unloading", UNLOADING)
    run = made(track(*curve(300.0, 800.0), cant=0.12), 23.0)
    (found,) = assess(run, limits=limits)
    rows = [r for z in found.zones for r in z.rows if r.criterion is UNLOADING]
    assert {r.place for r in rows} >= {"wheelset 1 outer", "wheelset 4 inner"}
    assert rows[0].estimate.value == pytest.approx(60e3 - Q0)
    assert (rows[0].limit, rows[0].source, rows[0].checked) == (5e3, "an example", True)
    assert found.verdicts["safety"].value == "fail"
    path = str(run.to_hdf5(tmp_path / "run.h5"))
    assert main(["assess", path, "--limits", str(limits), "--fail"]) == 4
    assert "load missing to 60 kN" in capsys.readouterr().out
    assert main(["assess", path, "--limits", str(limits), "--json"]) == 0
    names = {q["name"] for z in json.loads(capsys.readouterr().out)[0]["zones"]
             for q in z["quantities"]}  # fmt: skip
    assert "unloading" in names


def test_limit_without_its_quantity_is_refused(limits):
    with pytest.raises(InputError, match=r"limits\.unloading: unknown quantity"):
        assess(made(track(*curve(300.0, 800.0)), 23.0), limits=limits)


def test_quantity_without_its_limit_is_refused(monkeypatch):
    monkeypatch.setitem(CRITERIA, "unloading", UNLOADING)
    with pytest.raises(InputError, match=r"limits\.unloading: missing"):
        assess(made(track(*curve(300.0, 800.0)), 23.0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('law = "share"\nvalue = 0.5\nof = "nothing"', "'nothing'"),
        ('law = "by_moon"\nvalue = 0.5', "by_moon"),
        ('law = "constant"\nvalues = [1.0]', "value"),
    ],
)
def test_wrong_laws_are_refused(text, words, tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(
        f'format = "railsim-limits/1"\nextends = "en14363"\n[limits.Q_qst]\n{text}\nsource = "x"\n'
    )
    with pytest.raises(InputError, match=words):
        assess(made(track(*curve(300.0, 800.0)), 23.0), limits=file)


def test_page_shows_this_example():
    page = (Path(__file__).parents[2] / "docs" / "extending.md").read_text("utf-8")
    example = Path(__file__).with_name("own_criterion.py").read_text("utf-8")
    assert example[example.index("UNLOADING = ") : example.index("LIMITS = ")].strip() in page
    assert LIMITS[LIMITS.index("[limits") :].strip() in page
