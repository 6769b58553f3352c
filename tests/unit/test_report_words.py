"""Verdicts, tables and files of pages about tests, wear and mechanisms, from plain numbers."""

import csv
from types import SimpleNamespace as Made

import numpy as np
import pytest

from railsim.assessment.verdict import FAIL, INCOMPLETE
from railsim.errors import InputError
from railsim.identification.identified import AT_BOUND
from railsim.mechanisms.links import Course
from railsim.report import limits, measured, mechanisms
from railsim.report.document import Section
from railsim.report.measured import Part, as_section, identification_part, measured_page
from railsim.table import Table


def part(title, *, ok=True, remarks=()):
    return Part(title, f"verdict of {title}.", ok, remarks, [Section("s", ["text"])], ["method"])


def test_a_page_of_one_part_shows_its_verdict_and_of_several_each_by_its_title():
    alone = measured_page([part("one", remarks=["a remark"])])
    assert "<title>one</title>" in alone
    assert "one: verdict of one." not in alone
    assert "a remark" in alone
    both = measured_page([part("one"), part("two", ok=False, remarks=["another"])])
    assert "<title>one; two</title>" in both
    assert "one: verdict of one. two: verdict of two." in both
    assert both.count("method</p>") <= 1  # equal methods once
    assert "<title>mine</title>" in measured_page([part("one")], "mine")


def test_tables_of_a_part_after_the_first_are_folded():
    made = [Section(f"title {k}", [f"text {k}"], [Table(["a"], [[k]])]) for k in range(3)]
    section = as_section(Part("p", "verdict.", True, ["remark"], made, []), 7)
    assert section.id == "measured7"
    assert section.texts == ["verdict.", "remark", "text 0", "text 1", "text 2"]
    captions = [[one.caption for one in some] for some in (section.tables, section.details)]
    assert captions == [["title 0"], ["title 1", "title 2"]]


@pytest.mark.parametrize(
    ("verdict", "words", "ok"),
    [
        (FAIL, "The model does not match the test.", False),
        (INCOMPLETE, "Too few sections.", False),
        ("pass", "The model matches the test within all limits.", True),
    ],
)
def test_a_comparison_is_judged_in_words(monkeypatch, verdict, words, ok):
    monkeypatch.setattr(measured, "validation_figures", lambda _: {})
    one = Table(["a"], [])
    made = Made(
        verdict=verdict,
        title="t",
        remarks=["r"],
        edition="edition",
        table=lambda: one,
        section_table=lambda: one,
    )
    found = measured.validation_part(made)
    assert (found.verdict, found.ok, found.remarks) == (words, ok, ["r"])
    assert found.method[-1] == "edition"


BOUND = f"'a' {AT_BOUND}."


@pytest.mark.parametrize(
    ("unidentified", "remarks", "white", "words", "ok", "left"),
    [
        (
            [],
            ["other"],
            [True, None],
            "All parameters are identified; the residuals are white.",
            True,
            ["other"],
        ),
        (
            ["a is like b"],
            ["other", BOUND],
            [False],
            "Not all parameters can be told apart.",
            False,
            ["other", BOUND],
        ),
        ([], ["other", BOUND], [False], BOUND, False, ["other"]),
        ([], ["other"], [False, True], None, False, ["other"]),
    ],
)
def test_an_identification_is_judged_by_the_worst_of_its_faults(
    monkeypatch, unidentified, remarks, white, words, ok, left
):
    for name in ("parameter_table", "correlation_table", "residual_table"):
        monkeypatch.setattr(measured.identified, name, lambda _: Table(["a"], []))
    channels = [{"channel": f"c{k}", "white": one} for k, one in enumerate(white)]
    record = {
        "unidentified": unidentified,
        "remarks": remarks,
        "channels": channels,
        "vehicle": "coach",
    }
    found = identification_part(record, [])
    if words is None:
        assert "c0" in found.verdict
    else:
        assert found.verdict == words
    assert (found.ok, found.remarks) == (ok, left)
    assert found.title == "coach: identified parameters"


@pytest.mark.parametrize("rails", [True, False])
@pytest.mark.parametrize("ended", ["", "the flange is too thin"])
def test_wear_is_told_in_kilometres_or_megatonnes(monkeypatch, rails, ended):
    monkeypatch.setattr(measured, "wear_tables", lambda *_: [])
    monkeypatch.setattr(measured, "shares_of", lambda runs: ",".join(runs))
    rows = [{"distance": 1e3}, {"distance": 45e9 if rails else 120e3}]
    record = {"remarks": ["r"], "ended": ended, "law": "usfd"}
    if rails:
        record |= {"track": "line", "traffic": ["a", "b"], "left": rows, "right": rows}
    else:
        record |= {"vehicle": "coach", "routes": ["c"], "rows": rows}
    found = measured.wear_part(record, [])
    amount = "45 Mt" if rails else "120 km"
    assert found.verdict == (
        f"Ended after {amount}: the flange is too thin" if ended else f"Computed to {amount}."
    )
    assert found.title == ("line: wear of the rails" if rails else "coach: wear of the wheels")
    assert found.ok is not bool(ended)
    assert found.sections[0].texts == ["a,b" if rails else "c"]


@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize("kind", range(3))
def test_a_record_is_known_by_its_name_alone_or_in_its_folder(monkeypatch, tmp_path, kind, inside):
    """With the pictures beside it that are pictures."""
    parts = "validation_part", "identification_part", "wear_part"
    for k, name in enumerate(parts):
        monkeypatch.setattr(measured, name, lambda record, pictures, k=k: (k, record, pictures))
    monkeypatch.setattr(measured.ModelValidation, "of", lambda record: record)
    monkeypatch.setattr(measured, "pictures", lambda given, captions, names: sorted(given))
    assert not measured.is_measured(tmp_path)
    path = tmp_path / ("model_validation.json", "identified.json", "wear.json")[kind]
    assert not measured.is_measured(path)
    path.write_text('{"a": 1}')
    for name in ("overlays", "residuals", "wear"):
        (tmp_path / f"{name}.png").write_bytes(b"\x89PNG\r\n\x1a\n and so on")
    (tmp_path / "fits.png").write_bytes(b"\x89PNG\r\n\x1a? no picture")
    given = tmp_path if inside else path
    assert measured.is_measured(given)
    pictures = (["overlays"], ["residuals"], ["wear"])[kind]
    assert measured.read_part(given) == (kind, {"a": 1}, pictures)
    path.rename(tmp_path / "other.json")
    assert not measured.is_measured(tmp_path / "other.json")
    with pytest.raises(InputError, match=r"model_validation\.json or identified\.json or wear"):
        measured.read_part(tmp_path)


def test_a_multiple_regression_is_shown_in_its_units():
    """Y = 20 kN + 0.2 kN per mm + 3 kN per 1/km: coefficients are of 1/m and of m."""
    rule = Made(words="guiding force", unit="kN", scale=1e-3, text=lambda x: f"{1e-3 * x:.1f}")
    solved = Made(
        N=17, coefficients=(20e3, 200e3, 3e6), error=1500.0, determination=0.876, value=61e3
    )
    one = Made(criterion=rule, regression=solved, place="axle 1", population="laden")
    two = Made(criterion=rule, regression=solved, place="axle 1", population="")
    table = limits._influences(Made(vehicle="coach", influences=[one, two]))
    shown = ["kN", "17", "20", "0.2", "3", "1.5", "0.88", "61.0"]
    assert table.rows == [
        [("guiding force", "axle 1, laden"), *shown],
        [("guiding force", "axle 1"), *shown],
    ]


def columns(data):
    head, *rows = csv.reader(data.decode().splitlines())
    return dict(zip(head, np.array(rows, dtype=float).T.tolist(), strict=True))


def test_motions_are_written_in_si_with_their_units(monkeypatch):
    """Angles in rad, lengths in m, of the driver's unit and in time."""
    course = Course(np.array([0.1, 0.2]), np.array([0.3, 0.4]), np.array([0.5, 0.6]))
    monkeypatch.setattr(mechanisms, "links", lambda _: {"rod": course})
    monkeypatch.setattr(mechanisms, "actuators", lambda _: {"ram": course})
    monkeypatch.setattr(mechanisms, "driving_actuator", lambda _: "ram")
    monkeypatch.setattr(mechanisms, "force_unit", lambda *_: "N m")
    definition = Made(driver=Made(angle=0.0), angles={}, solve=None, output=Made(point="pan"))
    output = {"travel": [0.0, 1.0], "height": [0.0, 0.5], "ratio": [1.0, 2.0]}
    found = columns(mechanisms.positions(Made(definition=definition, output=output, motion=None)))
    assert found["travel [rad]"] == [0.0, 1.0]
    assert found["height [m]"] == [0.0, 0.5]
    assert found["ratio [1]"] == [1.0, 2.0]
    for name, unit in (("rod angle", "rad"), ("ram length", "m")):
        assert found[f"{name} [{unit}]"] == [0.1, 0.2]
        assert found[f"{name} first [{unit}/rad]"] == [0.3, 0.4]
        assert found[f"{name} second [{unit}/rad2]"] == [0.5, 0.6]
    velocity = np.array([[1.0, 2.0], [3.0, 4.0]])
    timed = Made(
        time=[0.0, 0.1],
        motion=Made(s=[0.0, 1.0]),
        force=[5.0, 6.0],
        in_time=lambda given: given,
        point=lambda _: (velocity, -velocity),
    )
    found = columns(mechanisms.motion_table(Made(definition=definition, timed=timed)))
    assert found["time [s]"] == [0.0, 0.1]
    assert found["travel [rad]"] == [0.0, 1.0]
    assert found["force [N m]"] == [5.0, 6.0]
    assert found["rod angle speed [rad/s]"] == found["ram length speed [m/s]"] == [0.3, 0.4]
    assert found["ram length acceleration [m/s2]"] == [0.5, 0.6]
    assert found["output speed x [m/s]"] == [1.0, 3.0]
    assert found["output speed y [m/s]"] == [2.0, 4.0]
    assert found["output acceleration y [m/s2]"] == [-2.0, -4.0]
    definition.output = None
    found = columns(mechanisms.motion_table(Made(definition=definition, timed=timed)))
    assert not [name for name in found if name.startswith("output")]


def test_mechanisms_side_by_side_have_a_label_each():
    def result(name, case=""):
        return Made(definition=Made(name=name), case=case)

    plain = [result("a"), result("a", "laden"), result("a"), result("b")]
    found = mechanisms._side_by_side(Made(optimum=None, results=plain))
    assert list(found) == ["a", "a, laden", "a (3)", "b"]
    assert mechanisms._side_by_side(Made(optimum=None, results=plain[:1])) == {}
    before = Made(before=1, after=2)
    found = mechanisms._side_by_side(Made(optimum=before, results=plain[:1]))
    assert found == {"as in the file": 1, "optimised": 2}
    before.before = None
    assert mechanisms._side_by_side(Made(optimum=before, results=plain[:1])) == {}
