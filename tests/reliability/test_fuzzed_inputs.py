"""Seeded damage to every kind of input: refused with a reason or used, never anything else.

Some 500 cases in the normal run; RAILSIM_CASES=4000 tries as many of every kind.
"""

import json
import sys
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
from cases import bounded, outcome, tried
from mutations import HOSTILE, bytes_damaged, text_damaged

import railsim.studies.case
from railsim.cli import main
from railsim.errors import InputError
from railsim.result import check_result
from railsim.result.integrity import content_digest, seal

sys.path.append(str(Path(__file__).parents[1] / "interface"))
from example_result import ROOT, example_result, feed

DEFINITIONS = (
    "vehicles/coach_manchester.toml",
    "vehicles/coach_flexicoil.toml",
    "tracks/curve_r250.toml",
    "vehicles/springs/turasas_axlebox.toml",
    "tests/data/vehicles/two_axle_wagon.toml",
    "tests/data/vehicles/articulated_three_bogies.toml",
    "vehicles/mechanisms/atr95_lift_5.toml",
    "scenarios/en14363.toml",
    "limits/en14363.toml",
)
SETTINGS = """format = "railsim-settings/1"
scheme = "fast"
step = 0.001
output_rate = 200.0
fastsim_grid = [10, 10]
creep_law = "table"
drive = {mode = "table", speed_table = [[0.0, 20.0], [300.0, 15.0]]}
outputs = {elements = ["*"], track = true}
initial = {carbody = {y = 0.01}}
"""
TRACK = """format = "railsim-track/1"
name = "recorded"
plan = [{type = "STR", length = 200.0}]
irregularities = [
  {type = "measured", file = "recorded.csv", shift = 2.0, scale = 1.5},
  {type = "dip", s = 20.0, length = 2.0, depth = 0.003},
  {type = "random", spectrum = "erri_b176_low", seed = 7, wavelengths = [3.0, 50.0]},
]
"""


def test_damaged_definitions(tmp_path, capsys):
    texts = [(ROOT / path).read_text(encoding="utf-8") for path in DEFINITIONS] + [SETTINGS]

    def case(seed):
        rng = np.random.default_rng(seed)
        path = tmp_path / "damaged.toml"
        path.write_text(text_damaged(texts[seed % len(texts)], rng), encoding="utf-8")
        command = "info" if seed % 5 == 0 else "validate"
        return outcome([command, path], capsys, f"definition {seed}")

    assert {0, 2} == set(tried(90, case))  # the damage is neither always fatal nor always harmless


def test_damaged_recordings(tmp_path, capsys):
    rows = [f"{s:.2f},{0.002 * np.sin(s):.6f},{0.001 * np.cos(s):.6f}" for s in range(0, 60, 2)]
    clean = "s,z_left,z_right\n" + "\n".join(rows) + "\n"
    (tmp_path / "track.toml").write_text(TRACK)

    def case(seed):
        rng = np.random.default_rng(seed)
        data = text_damaged(clean, rng).encode() if seed % 3 else bytes_damaged(clean.encode(), rng)
        (tmp_path / "recorded.csv").write_bytes(data)
        given = ["validate", tmp_path / "track.toml"]
        return outcome(given, capsys, f"recording {seed}")

    assert {0, 2} == set(tried(40, case))


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    path = tmp_path_factory.mktemp("result") / "run.h5"
    return example_result(duration=2.0, rate=10.0).to_hdf5(path)


def test_damaged_bytes_of_results(result, tmp_path):
    """What is accepted is what was written, to the last bit."""
    whole, clean = result.read_bytes(), check_result(result)

    def case(seed):
        path = tmp_path / "run.h5"
        path.write_bytes(bytes_damaged(whole, np.random.default_rng(seed)))
        with bounded(f"result {seed}"):
            try:
                found = check_result(path)
            except InputError:
                return "refused"
        assert dict(found.attributes) == dict(clean.attributes), seed
        for name in clean:
            np.testing.assert_array_equal(found[name], clean[name], err_msg=f"{seed}: {name}")
        return "accepted"

    outcomes = tried(60, case)
    assert outcomes.count("refused") > 0.9 * len(outcomes)


def soft_link(file, name, rng):
    del file[name]
    file[name] = h5py.SoftLink("/distance" if rng.integers(2) else "/nowhere")


def external_link(file, name, rng):
    del file[name]
    file[name] = h5py.ExternalLink("other.h5", "/x")


def other_rank(file, name, rng):
    data = file[name][()]
    del file[name]
    shape = [(), (1,), (2, 3), (*data.shape, 1), data.shape[:-1] or (3, 3)][rng.integers(5)]
    file.create_dataset(name, data=np.zeros(shape))


def other_type(file, name, rng):
    del file[name]
    kinds = [
        np.array(["a", "b"], dtype="S1"),
        np.zeros(3, dtype=complex),
        np.zeros(4, dtype="i2"),
        np.array([b"x"], dtype=object),
        np.zeros(3, dtype=[("a", "f8")]),
        np.zeros(3, bool),
    ]
    data = kinds[rng.integers(len(kinds))]
    kind = h5py.string_dtype() if data.dtype == object else data.dtype
    file.create_dataset(name, data=data, dtype=kind)


def giant(file, name, rng):
    """Declared, not written: a kilobyte that wants gigabytes of memory."""
    del file[name]
    filters = {"compression": "gzip"} if rng.integers(2) else {}
    file.create_dataset(name, shape=(10**9, 4), dtype="f8", chunks=(2**16, 4), **filters)


def virtual(file, name, rng):
    shape = file[name].shape
    del file[name]
    layout = h5py.VirtualLayout(shape=shape, dtype="f8")
    layout[...] = h5py.VirtualSource("other.h5", "x", shape=shape)
    file.create_virtual_dataset(name, layout)


def in_another_file(file, name, rng):
    shape = file[name].shape
    del file[name]
    file.create_dataset(name, shape=shape, dtype="f8", external=[("/etc/passwd", 0, 10**6)])


def group(file, name, rng):
    del file[name]
    file.create_group(f"{name}/within/another")


def missing(file, name, rng):
    del file[name]


def without_scales(file, name, rng):
    for fact in ("DIMENSION_LIST", "units", "long_name"):
        file[name].attrs.pop(fact, None)


def not_a_number(file, name, rng):
    if file[name].dtype.kind == "f":
        file[name][...] = rng.choice([np.nan, np.inf, -1e300])


def attribute(file, name, rng):
    facts = sorted(set(file.attrs) - {"digest"})
    fact = facts[rng.integers(len(facts))]
    values = ["", "x" * 1000, HOSTILE[0], 1e300, -1, np.nan, [1, 2], "$x^$\x1b[31m", b"\xff", "{}"]
    file.attrs[fact] = values[rng.integers(len(values))]


CHANGES = (
    soft_link, external_link, other_rank, other_type, giant, virtual, in_another_file, group,
    missing, without_scales, not_a_number, attribute, attribute, attribute,
)  # fmt: skip


def test_results_made_up_by_others(result, tmp_path, capsys):
    """Valid HDF5 with valid digest and seal, and contents that mean nothing."""
    whole = result.read_bytes()
    other = tmp_path / "first.h5"
    other.write_bytes(whole)

    def case(seed):
        rng = np.random.default_rng(seed)
        change = CHANGES[seed % len(CHANGES)]
        path = tmp_path / "run.h5"
        path.write_bytes(whole)
        with h5py.File(path, "r+") as file:
            names = [name for name in file if isinstance(file[name], h5py.Dataset)]
            name = names[rng.integers(len(names))]
            change(file, name, rng)
            if change is not giant:
                with suppress(Exception):  # there is no digest of such a thing
                    file.attrs["digest"] = content_digest(file)
        seal(path)
        what = f"{change.__name__} of {name}, {seed}"
        commands = [["validate", path], ["compare", other, path]]
        if seed % 28 == 0:
            commands.append(["plot", path, "--out", tmp_path / "run.png", "--overwrite"])
        for command in commands:
            outcome(command, capsys, what)

    tried(14, case)


def test_damaged_files_of_studies(tmp_path, capsys, monkeypatch):
    def simulate(*_, sink, progress, **how):
        return feed(sink, duration=1.0, rate=10.0)

    monkeypatch.setattr(railsim.studies.case, "simulate", simulate)
    folder = tmp_path / "study"
    given = ["study", "--vehicles", "coach_manchester", "--tracks", "straight", "--quiet"]
    given += ["--speeds", "20", "21", "--out", str(folder), "--workers", "1"]
    assert main(given) == 0
    names = ("study.json", "study.journal")
    whole = {name: (folder / name).read_bytes() for name in names}
    capsys.readouterr()

    def case(seed):
        rng = np.random.default_rng(seed)
        for name in names:
            (folder / name).write_bytes(whole[name])
        name = names[seed % 2]
        if seed % 4 == 1:
            (folder / name).write_bytes(bytes_damaged(whole[name], rng))
        elif seed % 4 == 3:  # a journal whose sums are right again
            (folder / name).write_bytes(journal_changed(whole[name], rng))
        else:
            text = whole[name].decode()
            (folder / name).write_text(text_damaged(text, rng), encoding="utf-8")
        outcome(["validate", folder / "study.json"], capsys, f"study {seed}")
        with bounded(f"study {seed}"):
            status = main(["study", "--resume", "--out", str(folder), "--workers", "1", "--quiet"])
        error = capsys.readouterr().err
        assert status in (0, 2), f"{seed}: {error}"
        if status == 0 and seed % 4 != 3:
            index = json.loads((folder / "study.json").read_text())
            assert index["status"] == "complete"

    tried(16, case)


def journal_changed(data, rng):
    import zlib

    lines = data.splitlines()
    at = int(rng.integers(len(lines)))
    text = text_damaged(lines[at][9:].decode(), rng).strip("\n").replace("\n", " ").encode()
    lines[at] = b"%08x\t%s" % (zlib.crc32(text), text)
    return b"\n".join(lines) + b"\n"


WORDS = (
    "run", "study", "compare", "plot", "info", "validate", "contact", "spring", "list", "--speed",
    "20", "--out", "x.h5", "--set", "track.friction=0.3", "--grid", "--until", "1e-3", "--json",
    "coach_manchester", "curve_r250", "--help", "--version", "-5", "nan", "1e999", "", " ", "--",
    "\x1b[2J", "é" * 200, "x" * 5000, "/dev/zero", "/proc/self/environ", "/", ".", "..", "a\nb",
    "vehicle.bodies.carbody.mass=1e400", "settings.step=" + "9" * 5000, "track.plan.0.length=nan",
    "--duration", "--start", "--resume", "--vehicles", "--tracks", "--speeds", "--continue",
    "--wheel", "--rail", "S1002", "60E1", "--gauge", "--overwrite", "--quiet", "=", "a=b", "$x^$",
    "vehicle.x" + ".y" * 2000 + "=1", "track.rail=" + "x" * 400 + ".csv", "track.rail=/dev/zero",
)  # fmt: skip


def test_arguments(tmp_path, capsys, monkeypatch):
    """Any words in any order, with runs cut short: never a traceback."""
    monkeypatch.chdir(tmp_path)

    def refuse(*_, **how):
        raise InputError([])

    for module in ("railsim.studies.case.simulate", "railsim.contact.contact_geometry"):
        monkeypatch.setattr(module, refuse, raising=False)

    def case(seed):
        rng = np.random.default_rng(seed)
        words = [WORDS[rng.integers(9)], *rng.choice(WORDS, rng.integers(0, 9))]
        words = [str(word) for word in words if word != "--workers"]
        if words[0] == "study":
            words += ["--workers", "1"]
        with bounded(f"arguments {seed}"):
            status = main(words)
        error = capsys.readouterr().err
        assert "should not happen" not in error, f"{seed}: {words}\n{error}"
        assert "Traceback" not in error, f"{seed}: {words}"
        assert status in (0, 1, 2, 3), f"{seed}: {words}"

    tried(60, case)
