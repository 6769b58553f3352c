"""The result file and the result in memory, as INTERFACE.md describes them."""

import os
import weakref

import h5py
import numpy as np
import pytest
import xarray
from example_result import BODIES, COORDINATES, PROFILES, WHEELSETS, arrays, example_result, feed

from railsim.errors import InputError
from railsim.notation import COMPONENTS, QUANTITIES, Quantity
from railsim.result import Hdf5Sink, MemorySink, open_result, open_run, reading
from railsim.result.integrity import content_digest


@pytest.fixture
def written(tmp_path):
    with Hdf5Sink(tmp_path / "run.h5") as sink:
        feed(sink)
    return tmp_path / "run.h5"


def test_file_holds_every_quantity_with_its_dimensions_and_units(written):
    with h5py.File(written) as file:
        for name, quantity in QUANTITIES.items():
            dataset = file[name]
            assert dataset.attrs["units"] == quantity.unit
            assert dataset.attrs["long_name"] == quantity.long_name
            scales = [dim.keys()[0] for dim in dataset.dims if len(dim)]
            assert tuple(scales) == (() if name == "time" else quantity.dims)
            np.testing.assert_array_equal(dataset[()], arrays()[name])


def test_names_are_read_as_text(written):
    expected = {
        "wheelset": WHEELSETS,
        "side": ("left", "right"),
        "body": BODIES,
        "component": COMPONENTS,
    }
    with h5py.File(written) as file:
        for name, labels in expected.items():
            assert tuple(file[name].asstr()[()]) == labels
            assert file[name].dtype.kind == "S"  # fixed length: no pointers for other readers


def test_names_along_dimensions_are_reached_like_arrays(written):
    result = open_result(written)
    for name, names in result.coordinates.items():
        assert tuple(result[name]) == tuple(getattr(result, name)) == names


def test_root_attributes_are_plain_text_and_numbers(written):
    with h5py.File(written) as file:
        for name in ("format", "railsim_version", "status", "status_reason", "created"):
            assert isinstance(file.attrs[name], str)
        for name in ("vehicle_toml", "track_toml", "settings_json"):
            assert isinstance(file.attrs[name], str)
        for name in ("wall_time", "cpu_time", "real_time_factor"):
            assert isinstance(file.attrs[name], float)
        assert file.attrs["format"] == "railsim-result/2"


def test_file_opens_in_xarray_with_coordinates_by_name(written):
    with xarray.open_dataset(written, engine="h5netcdf") as data:
        assert data.Q.dims == ("time", "wheelset", "side")
        outer = data.Y_over_Q.sel(wheelset="front.outer.wheelset", side="left")
        np.testing.assert_array_equal(outer, arrays()["Y_over_Q"][:, 0, 0])
        yaw = data.body_position.sel(body="carbody", component="yaw")
        np.testing.assert_array_equal(yaw, arrays()["body_position"][:, 0, 5])
        assert data.Q.units == "N"


def test_dataset_in_memory_equals_the_one_from_the_file(written):
    with xarray.open_dataset(written, engine="h5netcdf") as data:
        xarray.testing.assert_equal(
            open_result(written).to_xarray().reset_coords("distance"), data.load()
        )
        assert open_result(written).to_xarray().Y.attrs["comment"] == data.Y.comment


def test_chunks_make_no_difference(tmp_path):
    one = feed(MemorySink(), chunks=1)
    many = feed(MemorySink(), chunks=13)
    with Hdf5Sink(tmp_path / "many.h5") as sink:
        streamed = feed(sink, chunks=800)  # three or four instants each
    for name in QUANTITIES:
        np.testing.assert_array_equal(one[name], many[name])
        np.testing.assert_array_equal(one[name], streamed[name])


def test_result_survives_the_file_unchanged(tmp_path):
    result = example_result()
    again = open_result(result.to_hdf5(tmp_path / "run.h5"))
    assert dict(again.attributes) == dict(result.attributes)
    assert dict(again.coordinates) == dict(result.coordinates)
    assert dict(again.quantities) == dict(result.quantities)
    assert dict(again.profiles) == PROFILES
    assert again.vehicle() == result.vehicle()
    assert again.track() == result.track()


def test_same_result_gives_the_same_bytes(tmp_path):
    result = example_result()
    first = result.to_hdf5(tmp_path / "a.h5").read_bytes()
    assert result.to_hdf5(tmp_path / "b.h5").read_bytes() == first


def test_digest_is_that_of_what_the_file_holds(written):
    """It is formed while the file is written, and found again by reading all of it."""
    with h5py.File(written) as file:
        assert file.attrs["digest"] == content_digest(file)


def test_result_of_writing_is_the_one_that_is_read(tmp_path):
    with Hdf5Sink(tmp_path / "run.h5") as sink:
        one = feed(sink)
    other = open_result(tmp_path / "run.h5")
    assert list(one) == list(other)
    assert dict(one.attributes) == dict(other.attributes)
    for name in one:
        np.testing.assert_array_equal(one[name], other[name])


def test_arrays_that_were_read_do_not_fill_the_memory(written, monkeypatch):
    """The last ones are held; what was let go is read again, and the same."""
    held = arrays()["Q"].nbytes + arrays()["Y"].nbytes
    monkeypatch.setattr(reading, "_recent", reading._Recent(held))
    result = open_result(written)
    Q, Y = (weakref.ref(result[name]) for name in ("Q", "Y"))
    assert result["Q"] is Q()
    assert result["Y_over_Q"].shape == arrays()["Y"].shape
    assert Q() is None
    assert result["Y"] is Y()
    np.testing.assert_array_equal(result["Q"], arrays()["Q"])
    mine = result["body_position"]
    assert Y() is None
    assert result["body_position"] is mine


def test_whether_a_result_has_a_quantity_is_known_without_reading_it(written, monkeypatch):
    monkeypatch.setattr(reading.StoredArrays, "_read", None)
    result = open_result(written)
    assert "Q" in result
    assert "nothing" not in result
    assert set(result) >= {"Q", "Y"}


def test_profiles_keep_names_that_are_paths(tmp_path):
    with Hdf5Sink(tmp_path / "run.h5") as sink:
        sink.begin(COORDINATES, [QUANTITIES["time"]])
        sink.append({"time": np.zeros(1)})
        sink.close({"status": "complete"}, {}, {"../wheels/worn é.csv": PROFILES["S1002"]})
    assert list(open_result(tmp_path / "run.h5").profiles) == ["../wheels/worn é.csv"]


def test_further_groups_survive_the_file(tmp_path):
    with Hdf5Sink(tmp_path / "run.h5") as sink:
        sink.begin(COORDINATES, [QUANTITIES["time"]])
        sink.append({"time": np.zeros(1)})
        result = sink.close({"status": "complete"}, groups={"state": {"state": np.arange(5.0)}})
    again = open_result(result.to_hdf5(tmp_path / "again.h5"))
    np.testing.assert_array_equal(again.groups["state"]["state"], np.arange(5.0))
    assert dict(again.profiles) == {}


def test_further_quantities_come_with_their_own_dimensions(tmp_path):
    force = Quantity(
        "element_force", "force of the element", "F", "N", ("time", "element"), "kN", 1e-3
    )
    with Hdf5Sink(tmp_path / "run.h5") as sink:
        sink.begin({"element": ["damper.left", "damper.right"]}, [QUANTITIES["time"], force])
        sink.append({"time": np.arange(2.0), "element_force": np.eye(2)})
        result = sink.close({"status": "complete"})
    assert result.quantities["element_force"] == force
    np.testing.assert_array_equal(result.series("element_force", element="damper.right"), [0, 1])


def test_arrays_cannot_be_written_to(written):
    for result in (example_result(), open_result(written)):
        with pytest.raises(ValueError, match="read-only"):
            result.Q[0] = 0.0


def test_instants_count_from_both_ends(written):
    result = open_result(written)
    last = len(result.time) - 1
    for instant, same in ((-1, last), (-1 - last, 0)):
        expected = result["Q"][same]
        np.testing.assert_array_equal(result.series("Q", time=instant), expected)
    for beyond in (-2 - last, last + 1):
        with pytest.raises(KeyError, match=f"no instant {beyond}; 0 to {last}"):
            result.series("Q", time=beyond)


def test_unknown_names_are_answered_with_the_nearest(written):
    result = open_result(written)
    with pytest.raises(AttributeError, match="did you mean 'wheelset_yaw'"):
        _ = result.wheelset_jaw
    with pytest.raises(KeyError, match=r"did you mean 'front\.inner\.wheelset'"):
        result.series("Q", wheelset="front.iner.wheelset")
    with pytest.raises(KeyError, match=r"no instant 'x'; 0 to \d"):
        result.series("Q", time="x")
    with pytest.raises(KeyError, match="no instant 1000000;"):
        result.series("Q", time=1_000_000)


def test_series_takes_names_and_indices():
    result = example_result()
    by_name = result.series("Q", wheelset="rear.outer.wheelset", side="right")
    np.testing.assert_array_equal(by_name, result.Q[:, 3, 1])
    np.testing.assert_array_equal(result.series("Q", wheelset=3, side=1), by_name)


@pytest.mark.parametrize("end", ["left before it is whole", "error", "interrupt"])
def test_unfinished_file_leaves_nothing(tmp_path, end):
    def run():
        with Hdf5Sink(tmp_path / "run.h5") as sink:
            sink.begin(COORDINATES)
            if end == "error":
                raise ZeroDivisionError
            if end == "interrupt":
                raise KeyboardInterrupt

    if end == "left before it is whole":
        run()
    else:
        with pytest.raises((ZeroDivisionError, KeyboardInterrupt)):
            run()
    assert list(tmp_path.iterdir()) == []


def test_file_has_no_name_before_it_is_whole(tmp_path):
    with Hdf5Sink(tmp_path / "run.h5") as sink:
        sink.begin(COORDINATES)
        assert not (tmp_path / "run.h5").exists()


def test_unfinished_overwriting_keeps_the_old_file(tmp_path, written):
    old = written.read_bytes()
    with Hdf5Sink(written, overwrite=True) as sink:
        sink.begin(COORDINATES)
    assert written.read_bytes() == old


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("run.h5", "exists.*overwrite"),
        (".", "is a folder"),
        ("missing/run.h5", "no folder"),
        ("run.h5/run.h5", "no folder"),
    ],
)
def test_output_that_cannot_be_written_is_refused_at_the_door(written, path, words):
    with pytest.raises(InputError, match=words) as caught:
        Hdf5Sink(written.parent / path)
    assert caught.value.faults[0].option == "--out"
    assert os.listdir(written.parent) == ["run.h5"]


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        ({"note": "a\0b"}, r"attributes: 'note': holds a zero byte; a text without"),
        ({"n\0te": "b"}, r"attributes: 'n\\x00te': holds a zero byte"),
        ({"note": {"a": 1}}, "attributes: 'note': found a dict; a text or a number"),
    ],
)
def test_facts_that_a_file_cannot_hold_are_refused_at_the_door(tmp_path, facts, words):
    with pytest.raises(InputError, match=words):
        Hdf5Sink(tmp_path / "run.h5", attributes=facts)
    with MemorySink(facts) as sink, pytest.raises(InputError, match=words):
        feed(sink).to_hdf5(tmp_path / "run.h5")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (lambda file: file.attrs.pop("track_toml"), "track_toml: missing"),
        (lambda file: file.attrs.pop("status"), "status: missing"),
        (lambda file: file.pop("distance"), "distance: missing"),
        (lambda file: file.pop("wheelset"), "wheelset: missing"),
        (lambda file: file.attrs.__setitem__("format", [1, 2]), "format: found [1 2]"),
    ],
)
def test_result_that_lacks_something_is_refused(written, tmp_path, change, found):
    path = tmp_path / "run.h5"
    path.write_bytes(written.read_bytes())
    with h5py.File(path, "r+") as file:
        change(file)
        file.attrs["digest"] = content_digest(file)
    with pytest.raises(InputError) as caught:
        open_run(path)
    assert f"{path}: {found}" in str(caught.value)


def test_older_format_is_read_with_a_remark_on_what_has_changed(written, tmp_path):
    """Until railsim-result/1 `wheelset_lateral` was relative to the design track."""
    path, again = tmp_path / "old.h5", tmp_path / "again.h5"
    path.write_bytes(written.read_bytes())
    with h5py.File(path, "r+") as file:
        file.attrs["format"] = "railsim-result/1"
        file.attrs["digest"] = content_digest(file)
    result = open_run(path)
    (remark,) = result.remarks
    assert "railsim-result/1" in remark
    assert "relative to the design track" in remark
    # a copy keeps format and remark
    result.to_hdf5(again)
    assert open_run(again).remarks == (remark,)
    assert open_run(again).attributes["format"] == "railsim-result/1"


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "no such file"), (b"no HDF5", "not an HDF5 file"), ("hdf5", "'railsim-result/2'")],
)
def test_what_is_not_a_result_is_refused(tmp_path, content, words):
    path = tmp_path / "other.h5"
    if content == "hdf5":
        h5py.File(path, "w").close()
    elif content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=words):
        open_result(path)


@pytest.mark.parametrize("how", ["replaced", "changed", "removed"])
def test_open_result_does_not_mix_two_runs(tmp_path, how):
    """Arrays are read when they are asked for: from the file that was opened, or not at all."""
    path = example_result().to_hdf5(tmp_path / "run.h5")
    opened = open_result(path)
    time = opened["time"]
    if how == "replaced":  # same names and shapes
        example_result(gain=2.0).to_hdf5(path, overwrite=True)
    elif how == "changed":
        with h5py.File(path, "r+") as file:
            file["Q"][0] = 0.0
    else:
        path.unlink()
    words = "cannot be read" if how == "removed" else "was replaced or changed after it was opened"
    for read in (lambda: opened["Q"], lambda: opened.part("Y", slice(0, 3))):
        with pytest.raises(InputError, match=words):
            read()
    np.testing.assert_array_equal(opened["time"], time)  # read before
