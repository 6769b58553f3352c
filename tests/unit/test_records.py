"""Records kept by studies: only what is as it was written is believed."""

import csv
import io
import json
import re

import pytest

from railsim.studies.records import stored_record, write_record
from railsim.studies.summary import _write_rows, summary_row, unit_of

RECORD = {"speed": 61.7, "modes": [1.0, None, "hunting"], "nested": {"b": 2, "a": 1e-300}}


@pytest.fixture
def kept(tmp_path):
    path = tmp_path / "points" / "one.json"
    write_record(path, RECORD)
    return path


def test_record_comes_back_as_it_was(kept):
    assert stored_record(kept, pytest.fail) == RECORD


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text.replace(b'"speed": ', b'"speed": 1', 1),
        lambda text: text.replace(b"null", b"true"),
        lambda text: text[: len(text) // 2],
        lambda _: b"",
        lambda _: b"[" * 100_000,
        lambda _: b'"crc32"',
        lambda _: b"[1, 2]",
        lambda text: b"\xff" + text,
        lambda text: json.dumps(json.loads(text)["record"]).encode(),  # without a checksum
    ],
)
def test_anything_else_is_refused(kept, damage):
    kept.write_bytes(damage(kept.read_bytes()))
    said = []
    assert stored_record(kept, said.append) is None
    assert re.fullmatch(r".*one\.json: .*: it is computed again", *said)
    assert not kept.exists()


def test_any_changed_byte_is_noticed_or_means_the_same(kept):
    """Within the white space of JSON a change may mean nothing."""
    whole = kept.read_bytes()
    for i in range(len(whole)):
        kept.write_bytes(whole[:i] + bytes([whole[i] ^ 1]) + whole[i + 1 :])
        said = []
        found = stored_record(kept, said.append)
        assert found == RECORD if found is not None else said


def test_summary_reads_back_as_what_was_written_whatever_it_holds():
    """Python's csv and float say what the cells mean."""
    texts = [
        "",
        "a,b",
        'say "now"',
        "two\nlines",
        "a\rb",
        "Übergang",
        "back\\slash",
        "null",
        "-0.3",
    ]
    numbers = [1.0, -0.0, 5e-324, 1.234e-5, 0.1 + 0.2, 1e16, 1.7976931348623157e308, 7]
    rows = [
        {"name": "one", **{f"t{i}": text for i, text in enumerate(texts)}},
        {"name": "=2+3", "t3": None, **{f"n{i}": number for i, number in enumerate(numbers)}},
    ]
    stream = io.BytesIO()
    _write_rows(rows, stream)
    text = io.StringIO(stream.getvalue().decode(), newline="")
    one, two = csv.DictReader(text)
    assert [one[f"t{i}"] for i in range(len(texts))] == texts
    assert {one[f"n{i}"] for i in range(len(numbers))} == {""}
    assert [float(two[f"n{i}"]) for i in range(len(numbers))] == numbers
    assert (two["name"], two["t3"]) == ("'=2+3", "")


def test_summary_has_columns_of_each_curve_in_their_order():
    """Those of the first curve without a number, those of further ones with theirs."""
    curves = [{"largest": {"Q": x}, "largest_medians": {"Q": x + 0.5}} for x in (1, 2, 3)]
    record = {"name": "a", "labels": {}, "file": "a.h5", "mid_curves": curves}
    row = {name: cell for name, cell in summary_row(record).items() if name.startswith("Q_")}
    assert row == {
        "Q_mid": 1, "Q_median": 1.5, "Q_mid2": 2, "Q_median2": 2.5, "Q_mid3": 3, "Q_median3": 3.5,
    }  # fmt: skip
    assert [unit_of(name) for name in ("Q_median3", "Q_peak_20hz", "Q_peak_distance")] == [
        "N", "N", "m",
    ]  # fmt: skip


def test_parameters_with_a_unit_are_numbers_in_si_in_the_summary():
    """As all of its columns; names of vehicles and tracks stay, whatever they look like."""
    labels = {"vehicle": "5m", "track.rounding": "900 mm", "track.rail": "60E1", "speed": 20.0}
    row = summary_row({"name": "a", "labels": labels, "file": None})
    assert {name: row[name] for name in labels} == {**labels, "track.rounding": 0.9}
