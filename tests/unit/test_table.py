"""Tables: the same values on a terminal, on a page, for a program and a spreadsheet."""

import csv
import io
import json
import re
import textwrap

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from railsim.assessment.criteria import CRITERIA
from railsim.design_checks import Check, check_table
from railsim.notation import QUANTITIES, REQUESTED, SHOWN_UNITS
from railsim.table import Amount, Column, Table, _fold

WHEEL = "[red]<b>$x^$\x1b[31m=1+1"
PEAKS = Table(
    [
        Column("wheel", "name of the wheel"),
        Column("verdict"),
        Column("Q", "wheel load", "kN", ".2f"),
        Column("n", format="d"),
    ],
    [
        [WHEEL, "pass", np.float64(89123.4), 3],
        ["trailing", "fail", float("nan"), np.int64(4)],
        ["no wheel", "", None, None],
    ],
    "Peaks <of> the run",
)
COLOURS = re.compile(r"\x1b\[\d+m")


def test_numbers_are_shown_in_the_units_of_the_field_and_kept_in_si():
    text = str(PEAKS)
    assert "wheel load (kN)" in text
    assert "89.12" in text
    assert text.splitlines()[3].split() == ["trailing", "fail", "-", "4"]
    assert text.splitlines()[4] == "no wheel"
    assert PEAKS["Q"] == [89123.4, None, None]


@pytest.mark.parametrize("width", [30, 80, 200])
def test_tables_fold_to_the_width_and_lose_nothing(width):
    lines = PEAKS.lines(width)
    assert max(map(len, lines)) <= width
    shown = [line.replace("\x1b", "\\x1b") for line in PEAKS.lines()]
    assert sorted("".join(lines).replace(" ", "")) == sorted("".join(shown).replace(" ", ""))
    if width == 200:
        assert [line.split() for line in lines] == [line.split() for line in shown]


@given(st.lists(st.text("abc,", min_size=1, max_size=12), min_size=1), st.integers(12, 60))
def test_lines_take_as_many_words_as_fit(words, width):
    text = " ".join(words)
    assert _fold(text, width) == textwrap.fill(text, width)


@pytest.mark.parametrize("width", [30, 40, 60])
def test_words_are_broken_only_where_they_are_longer_than_the_table(width):
    words = ["wheelset", "leading", "establishment", "of", "guidance"]
    short = "to and fro " * 5
    table = Table(["name", "here", "there"], [[short, " ".join(words), short]] * 2)
    lines = table.lines(width)
    assert max(map(len, lines)) <= width
    shown = " ".join(lines).split()
    assert all(shown.count(word) == 2 for word in words)


def test_numbers_are_not_folded():
    columns = [Column("name"), *(Column(f"length {k}", unit="mm", format=".3f") for k in range(6))]
    table = Table(columns, [["a long name of a body " * 3, *(12.3456 + k for k in range(6))]])
    lines = table.lines(80)
    assert max(map(len, lines)) <= 80
    numbers = [table.columns[1 + k].text(12.3456 + k) for k in range(6)]
    assert any(all(number in line.split() for number in numbers) for line in lines)


def test_only_colours_steer_the_terminal():
    assert "\x1b" not in str(PEAKS)
    coloured = PEAKS.lines(80, colour=True)
    assert any("\x1b[31mfail" in line for line in coloured)
    assert any("\x1b[32mpass" in line for line in coloured)
    assert [COLOURS.sub("", line).split() for line in coloured] == [
        line.split() for line in PEAKS.lines(80)
    ]


def test_pages_show_texts_literally():
    page = PEAKS.html()
    assert page == PEAKS._repr_html_()
    assert "[red]&lt;b&gt;$x^$\\x1b[31m=1+1" in page
    assert "<caption>Peaks &lt;of&gt; the run</caption>" in page
    assert page.count("<tr") == 4
    assert '<tr class="failed"><td class="words">trailing</td>' in page


def test_programs_get_plain_values():
    data = json.loads(json.dumps(PEAKS.records(), allow_nan=False))
    assert data[0] == {"wheel": WHEEL, "verdict": "pass", "Q": 89123.4, "n": 3}
    assert data[1] == {"wheel": "trailing", "verdict": "fail", "Q": None, "n": 4}
    rows = list(csv.reader(io.StringIO(PEAKS.csv())))
    assert rows[0] == ["wheel", "verdict", "Q (N)", "n"]
    assert float(rows[1][2]) == 89123.4
    formula = Table(["name"], [["=1+1"]]).csv()
    assert formula == "name\n'=1+1\n"


@pytest.mark.parametrize("columns", [[], ["name", Column("Q", unit="kN", format=".1f")]])
def test_a_table_may_be_empty(columns):
    empty = Table(columns, [])
    assert str(empty) == "  ".join(column.heading for column in empty.columns)
    assert empty.records() == []
    assert len(empty.csv().splitlines()) == 1
    assert "<tbody></tbody>" in empty.html()
    assert empty.lines(80, colour=True)
    assert len(empty) == 0


def test_rows_may_be_mappings_and_quantities():
    by_name = Table(["b", "a"], [{"a": "1", "b": "2", "c": "3"}, {"a": "4"}])
    assert by_name.texts() == [["2", "1"], ["", "4"]]
    upright = PEAKS.transposed("quantity")
    assert [row[0] for row in upright.rows] == ["verdict", "wheel load (kN)", "n"]
    assert upright.texts()[1] == ["wheel load (kN)", "89.12", "-", ""]
    cell = Amount(0.0021, Column("y", unit="mm", format=".1f"))
    assert Table(["value"], [[cell]]).records() == [{"value": 0.0021}]


@pytest.mark.parametrize(
    ("value", "shown"),
    [(0.0332, "33.2"), (0.03302, "33.02"), (0.033, "33.0"), (0.0, "0.0"), (np.nan, "-")],
)
def test_a_value_reads_like_its_limit_only_where_it_is_equal(value, shown):
    column = Column("Sd", unit="mm", format=".1f")
    (row,) = Table([column], [[Amount(value, column, limit=0.033)]]).texts()
    assert row == [shown]


def test_a_check_that_fails_does_not_read_like_its_limit():
    clearance = Check("radial_clearance", 3.997e-3, 4e-3, "above", "m", "")
    assert check_table([clearance]).texts() == [
        ["radial_clearance", "3.997", ">= 4.00", "mm", "fail"]
    ]


def test_units_of_the_quantities_are_those_of_tables():
    for quantity in [*QUANTITIES.values(), *REQUESTED.values()]:
        if "," not in quantity.unit:
            column = Column.of(quantity)
            assert column.text(1.0) == quantity.text(1.0)
            assert column.si_unit in (quantity.unit, "" if quantity.unit == "1" else None)
    assert all(scale > 0.0 for _, scale in SHOWN_UNITS.values())


def test_assessed_wear_numbers_have_the_decimals_of_peaks():
    assert CRITERIA["T_qst"].text(73.536) == QUANTITIES["T_gamma"].text(73.536)


def test_names_are_broken_at_their_dots_and_numbers_nowhere():
    rows = [["front.outer.wheelset", -10.78, "stiffness 31.391e6"]]
    table = Table(["body", Column("x", unit="m", format=".3f"), "values"], rows)
    assert [line.split() for line in table.lines(32)[1:]] == [
        ["front.", "-10.780", "stiffness"],
        ["outer.", "31.391e6"],
        ["wheelset"],
    ]
    assert any("-10.780" in line for line in table.lines(12))
