"""Records kept by studies: only what is as it was written is believed."""

import json

import pytest

from railsim.errors import InputError
from railsim.studies.records import read_record, write_record

RECORD = {"speed": 61.7, "modes": [1.0, None, "hunting"], "nested": {"b": 2, "a": 1e-300}}


@pytest.fixture
def kept(tmp_path):
    path = tmp_path / "points" / "one.json"
    write_record(path, RECORD)
    return path


def test_record_comes_back_as_it_was(kept):
    assert read_record(kept) == RECORD


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
    with pytest.raises(InputError, match=r"one\.json: "):
        read_record(kept)


def test_any_changed_byte_is_noticed_or_means_the_same(kept):
    """Within the white space of JSON a change may mean nothing."""
    whole = kept.read_bytes()
    for i in range(len(whole)):
        kept.write_bytes(whole[:i] + bytes([whole[i] ^ 1]) + whole[i + 1 :])
        try:
            assert read_record(kept) == RECORD
        except InputError:
            continue
