"""What a study keeps, its tables for pandas and xarray, results for other programs."""

import csv
import pickle
import shutil
import subprocess
import sys
import tracemalloc
from dataclasses import replace
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
import xarray
from example_result import example_result
from scipy.io import loadmat
from test_study import arguments, index, rows
from test_study import simulated as simulated

import railsim
from railsim.cli import main
from railsim.errors import InputError
from railsim.notation import QUANTITIES
from railsim.result import MemorySink, Result, open_run
from railsim.result.export import export, selected
from railsim.result.hdf5 import Storage, write
from railsim.studies.outcome import Outcome

RUN = "coach_manchester_curve_r250_10"


def table(folder):
    """Summary without what differs from run to run of the program."""
    return [{k: v for k, v in row.items() if k != "file"} for row in rows(folder)]


def test_summary_alone_is_kept_and_is_that_of_whole_results(tmp_path, simulated):
    assert main(arguments(tmp_path / "all", 10, 12)) == 0
    assert main(arguments(tmp_path / "kept", 10, 12, more=["--keep", "summary"])) == 0
    assert list((tmp_path / "kept").glob("*.h5")) == []
    assert table(tmp_path / "kept") == table(tmp_path / "all")
    assert main(["validate", str(tmp_path / "kept" / "study.json")]) == 0
    assert main(arguments(tmp_path / "kept", 10, 12, more=["--keep", "summary"])) == 0
    assert simulated == [10.0, 12.0] * 2  # nothing was computed again
    assert main(["study", "--resume", "--out", str(tmp_path / "kept"), "--workers", "1"]) == 0
    assert len(simulated) == 4
    # whole results are wanted now: the runs are computed once more
    assert main(arguments(tmp_path / "kept", 10, 12, more=["--resume"])) == 0
    assert len(simulated) == 6
    assert len(list((tmp_path / "kept").glob("*.h5"))) == 2


def test_chosen_quantities_compressed_and_single_are_kept_and_the_summary_is_whole(
    tmp_path, simulated
):
    assert main(arguments(tmp_path / "all", 10)) == 0
    more = ["--keep", "Q,wheelset_*", "--compress", "--single"]
    assert main(arguments(tmp_path / "kept", 10, more=more)) == 0
    whole, kept = (open_run(tmp_path / name / f"{RUN}.h5") for name in ("all", "kept"))
    assert set(kept) == {"time", "distance", "Q", "Q0", *(n for n in whole if "wheelset_" in n)}
    assert np.array_equal(kept.time, whole.time)
    # 24 bits of mantissa
    assert np.abs(kept.Q / whole.Q - 1.0).max() <= 2.0**-24
    size, before = ((tmp_path / n / f"{RUN}.h5").stat().st_size for n in ("kept", "all"))
    assert size < 0.3 * before
    assert table(tmp_path / "kept") == table(tmp_path / "all")
    assert main(["validate", str(tmp_path / "kept" / f"{RUN}.h5")]) == 0
    assert main(arguments(tmp_path / "kept", 10, more=more)) == 0
    assert simulated == [10.0, 10.0]


def test_compressed_results_stream_to_their_files(tmp_path, simulated, monkeypatch):
    """A long run is not held in memory until it is compressed."""
    assert main(arguments(tmp_path / "all", 10)) == 0
    monkeypatch.setattr("railsim.studies.case.MemorySink", lambda *_: None)
    assert main(arguments(tmp_path / "kept", 10, more=["--compress"])) == 0
    whole, kept = (open_run(tmp_path / name / f"{RUN}.h5") for name in ("all", "kept"))
    assert set(kept) == set(whole)
    assert all(np.array_equal(kept[name], whole[name], equal_nan=True) for name in whole)
    sizes = [(tmp_path / name / f"{RUN}.h5").stat().st_size for name in ("kept", "all")]
    assert sizes[0] < 0.8 * sizes[1]
    assert table(tmp_path / "kept") == table(tmp_path / "all")


def test_a_result_in_memory_is_not_held_twice_as_it_is_closed():
    """Its arrays come one after the other: never more than itself and the largest of them."""
    sink = MemorySink()
    names = ("time", "Q", "Y", "T_gamma")
    sink.begin({"wheelset": ["a", "b"], "body": ()}, [QUANTITIES[name] for name in names])
    chunk = {"time": np.zeros(1000), **{name: np.zeros((1000, 2, 2)) for name in names[1:]}}
    tracemalloc.start()
    for _ in range(100):
        sink.append(chunk)
    held = tracemalloc.get_traced_memory()[0]
    tracemalloc.reset_peak()
    sink.close({"status": "complete"})
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 1.45 * held  # 4 of 13 columns are the largest


def test_peaks_over_all_steps_are_kept_of_the_chosen_quantities(tmp_path):
    result = example_result(duration=1.0)
    shape = {"Q": (2, 4, 2), "sum_Y": (2, 4)}
    peaks = {
        f"{name}{ending}": np.arange(np.prod(size), dtype=float).reshape(size)
        for name, size in shape.items()
        for ending in ("", "_time", "_distance")
    }
    whole = railsim.Result(
        {n: result[n] for n in result}, result.quantities, result.coordinates, result.attributes,
        groups={"peaks": peaks},
    )  # fmt: skip
    path = write(whole, tmp_path / "r.h5", names=["time", "distance", "Q", "Q0"])
    again = open_run(path)
    assert set(again.groups["peaks"]) == {"Q", "Q_time", "Q_distance"}
    assert railsim.peaks(again)[0].value == 15.0
    assert open_run(write(whole, tmp_path / "s.h5", names=["time", "distance"])).status


def test_unknown_quantity_to_keep_is_refused(tmp_path, capsys):
    assert main(arguments(tmp_path / "s", 10, more=["--keep", "Q,Z"])) == 2
    assert "--keep: Z: no such quantity" in capsys.readouterr().err
    assert not (tmp_path / "s").exists()


def test_header_of_the_summary_names_the_units(tmp_path, simulated):
    assert main(arguments(tmp_path, 20)) == 0
    with open(tmp_path / "summary.csv", encoding="utf-8") as file:
        header = next(csv.reader(file))
    wanted = {"speed (m/s)", "Q_peak (N)", "Q_peak_time (s)", "Q_peak_distance (m)", "Q_peak_side",
              "Y_over_Q_peak", "wheelset_yaw_mid (rad)", "wall_time (s)"}  # fmt: skip
    assert wanted <= set(header)


def test_outcome_is_a_table_and_a_grid(tmp_path, simulated):
    pytest.importorskip("pandas")
    grid = {"track.friction": "0.3:0.5:3"}
    how = {"workers": 1, "keep": "summary"}
    outcome = railsim.study(
        "coach_manchester", "curve_r250", [10.0, 12.0], grid=grid, out=tmp_path, **how
    )
    frame = outcome.to_dataframe()
    assert frame["Q_peak"].notna().sum() == 6
    data = outcome.to_xarray()
    assert dict(data.sizes) == {"speed": 2, "track.friction": 3}
    assert data.Q_peak.attrs["units"] == "N"
    assert outcome.results() == {}  # complete, but none is kept
    one = frame[(frame["speed"] == 12.0) & (frame["track.friction"] == 0.4)]
    assert data.Q_peak.sel({"speed": 12.0, "track.friction": 0.4}) == one["Q_peak"].item()
    spread = {"track.friction": {"low": 0.2, "high": 0.4}, "speed": {"low": 10.0, "high": 11.0}}
    sample = {"number": 4, "parameters": spread}
    drawn = railsim.study(
        "coach_manchester", "curve_r250", None, sample=sample, out=tmp_path / "s", **how
    )
    found = drawn.to_xarray()
    assert dict(found.sizes) == {"run": 4}
    assert np.all((found["track.friction"] > 0.2) & (found["track.friction"] < 0.4))
    assert index(tmp_path / "s")["inputs"]["sample"]["number"] == 4


def test_result_survives_pickling_also_from_a_file(tmp_path):
    result = example_result()
    path = result.to_hdf5(tmp_path / "r.h5")
    for one in (result, railsim.open_result(path)):
        again = pickle.loads(pickle.dumps(one))
        assert set(again) == set(result)
        assert np.array_equal(again.Q, result.Q)
        assert again.quantities == result.quantities
        assert again.coordinates == result.coordinates
        assert again.vehicle() == result.vehicle()
        assert set(again.profiles) == set(result.profiles)


def test_names_are_fixed_length_ascii_where_they_can_be(tmp_path):
    path = example_result().to_hdf5(tmp_path / "r.h5")
    with h5py.File(path) as file:
        for name in ("wheelset", "side", "body", "component"):
            info = h5py.check_string_dtype(file[name].dtype)
            assert (info.encoding, info.length is not None) == ("ascii", True)
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert data.side.values.tolist() == ["left", "right"]


def test_names_beyond_ascii_stay_as_they_are(tmp_path):
    result = example_result()
    names = {**result.coordinates, "wheelset": tuple(f"Radsatz für {i}" for i in range(4))}
    other = railsim.Result(
        {n: result[n] for n in result}, result.quantities, names, result.attributes
    )
    path = other.to_hdf5(tmp_path / "r.h5")
    assert railsim.open_result(path).wheelsets == names["wheelset"]


@pytest.mark.skipif(shutil.which("octave") is None, reason="no octave")
def test_octave_reads_every_dataset(tmp_path):
    path = example_result().to_hdf5(tmp_path / "r.h5")
    text = f"s = load('-hdf5', '{path}'); disp(size(s.Q)); disp(class(s.side))"
    done = subprocess.run(["octave", "--quiet", "--eval", text], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_damage_to_a_compressed_file_is_found(tmp_path):
    path = write(example_result(), tmp_path / "r.h5", storage=Storage(compress=True, single=True))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(InputError, match="damaged"):
        railsim.open_result(path)


def test_export_to_csv_and_matlab_holds_every_value(tmp_path):
    result = example_result(duration=2.0)
    with open(export(result, tmp_path / "r.csv"), encoding="utf-8") as file:
        reader = csv.reader(file)
        header, first = next(reader), next(reader)
        count = 1 + sum(1 for _ in reader)
    assert count == len(result.time)
    column = header.index("Q:front.outer.wheelset:left (N)")
    assert float(first[column]) == result.Q[0, 0, 0]
    assert "body_position:carbody:yaw (rad)" in header
    assert "Y_over_Q:front.outer.wheelset:left" in header
    data = loadmat(export(result, tmp_path / "r.mat"), squeeze_me=True)
    assert np.array_equal(data["Q"], result.Q)
    assert data["units"]["Q"].item() == "N"
    assert data["names"]["side"].item().tolist() == ["left", "right"]
    assert data["run"]["status"].item() == "complete"


@pytest.mark.parametrize("name", ["_x", "a-b", "run", "units", "names", "u" * 64])
def test_a_name_that_matlab_files_cannot_hold_is_refused(tmp_path, name):
    """A letter, then letters, digits, underscores, 63 at most; some names the file has itself."""
    result = example_result(duration=1.0)
    quantity = replace(result.quantities["distance"], name=name)
    own = Result(
        {**{q: result[q] for q in result}, name: result["distance"]},
        {**result.quantities, name: quantity},
        result.coordinates,
        result.attributes,
        result.profiles,
    )
    with pytest.raises(InputError, match=f"{name}: no name of a MATLAB file"):
        export(own, tmp_path / "r.mat")
    assert list(tmp_path.iterdir()) == []
    assert export(own, tmp_path / "r.csv").exists()
    assert "Q" in loadmat(export(selected(own, ["Q"]), tmp_path / "r.mat"))


def test_export_command_names_its_formats(tmp_path, capsys):
    path = example_result(duration=1.0).to_hdf5(tmp_path / "r.h5")
    assert main(["export", str(path), "--out", str(tmp_path / "r.mat")]) == 0
    assert main(["export", str(path), "--out", str(tmp_path / "r.xls")]) == 2
    assert ".csv or .mat or .parquet" in capsys.readouterr().err
    assert main(["export", str(path), "--out", str(tmp_path / "r.mat")]) == 2


def test_parquet_holds_every_value(tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    result = example_result(duration=1.0)
    frame = pandas.read_parquet(export(result, tmp_path / "r.parquet"))
    assert np.array_equal(frame["Q:front.outer.wheelset:left"], result.Q[:, 0, 0])


def test_missing_package_is_named_and_no_file_begun(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match="pip install pandas pyarrow"):
        export(example_result(duration=1.0), tmp_path / "r.parquet")
    assert list(tmp_path.iterdir()) == []


def test_what_only_some_runs_were_given_is_a_coordinate_of_them():
    """A value and none are two; what all runs have alike is none."""
    pandas = pytest.importorskip("pandas")
    columns = {"name": ["a", "b"], "speed": [10.0] * 2, "seed": [1.0, np.nan], "Q_peak": [5.0, 6.0]}
    outcome = SimpleNamespace(
        to_dataframe=lambda: pandas.DataFrame(columns), _labels=lambda: ["speed", "seed"]
    )
    data = Outcome.to_xarray(outcome)
    assert dict(data.sizes) == {"run": 2}
    assert "speed" not in data.coords
    assert list(data.seed.isnull()) == [False, True]
    assert list(data.Q_peak) == [5.0, 6.0]
