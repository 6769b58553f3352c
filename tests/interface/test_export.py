"""``railsim export``: choice of quantities, section, rate and units."""

import csv

import numpy as np
import pytest
from example_result import example_result
from scipy.io import loadmat

import railsim
from railsim.cli import main
from railsim.errors import InputError
from railsim.result.export import selected


@pytest.fixture(scope="module")
def result():
    return example_result()


def test_a_section_of_some_quantities_in_the_units_of_tables(result, tmp_path):
    file, out = result.to_hdf5(tmp_path / "run.h5"), tmp_path / "part.csv"
    begin, end = 0.25 * result.distance[-1], 0.5 * result.distance[-1]
    arguments = ["export", str(file), "Q", "wheelset_yaw", "--between", str(begin), str(end)]
    assert main([*arguments, "--units", "shown", "--out", str(out)]) == 0
    with out.open(encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    assert header[:3] == ["time (s)", "distance (m)", f"Q:{result.wheelsets[0]}:left (kN)"]
    assert header[-1] == f"wheelset_yaw:{result.wheelsets[-1]} (mrad)"
    inside = (result.distance >= begin) & (result.distance <= end)
    values = np.array(rows, dtype=float)
    np.testing.assert_allclose(values[:, 1], result.distance[inside])
    np.testing.assert_allclose(values[:, 2], 1e-3 * result.Q[inside, 0, 0])


def test_both_ends_of_a_section_belong_to_it(result):
    ends = result.distance[5], result.distance[20]
    part = selected(result, ["Q"], between=ends)
    np.testing.assert_array_equal(part.time, result.time[5:21])


def test_single_wheels_are_columns_as_plot_takes_them(result, tmp_path, capsys):
    file = str(result.to_hdf5(tmp_path / "run.h5"))
    command = ["export", file, "Y:1:left", "Q:2", "sum_Y", "Q:2:left", "--out"]  # that is in Q:2
    assert main([*command, str(tmp_path / "part.csv")]) == 0
    with (tmp_path / "part.csv").open(encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    first, second = result.wheelsets[:2]
    assert header[2:5] == [f"Y:{first}:left (N)", f"Q:{second}:left (N)", f"Q:{second}:right (N)"]
    assert header[5:] == [f"sum_Y:{name} (N)" for name in result.wheelsets]
    np.testing.assert_allclose(np.array(rows, dtype=float)[:, 4], result.Q[:, 1, 1])
    assert main([*command, str(tmp_path / "part.mat")]) == 2
    assert "QUANTITY: Y:1:left: a part of a quantity; a MATLAB" in capsys.readouterr().err
    assert not (tmp_path / "part.mat").exists()
    assert main(["export", file, "Y:lef", "--out", str(tmp_path / "a.csv")]) == 2
    assert "Y:lef: no label 'lef'; did you mean 'left'?" in capsys.readouterr().err


def test_what_is_no_function_of_time_is_refused_where_columns_are(result, tmp_path, capsys):
    command = ["export", str(result.to_hdf5(tmp_path / "run.h5")), "Q", "Q0", "--out"]
    assert main([*command, str(tmp_path / "part.csv")]) == 2
    assert "QUANTITY: Q0: no function of time; a MATLAB" in capsys.readouterr().err
    assert not (tmp_path / "part.csv").exists()
    assert main([*command, str(tmp_path / "part.mat")]) == 0
    found = loadmat(tmp_path / "part.mat")
    np.testing.assert_array_equal(found["Q0"], result.Q0)


def test_units_of_positions_and_angles_are_shown_ones_too(result):
    part = selected(result, ["body_position"], shown_units=True)
    assert part.quantities["body_position"].component("yaw").unit == "mrad"
    np.testing.assert_array_equal(part.body_position, 1e3 * result.body_position)


def test_a_result_file_holds_si_units_alone(result, tmp_path):
    shown = selected(result, ["Q"], shown_units=True)
    with pytest.raises(InputError, match="Q in kN; SI"):
        shown.to_hdf5(tmp_path / "r.h5")
    assert list(tmp_path.iterdir()) == []


def test_values_at_a_lower_rate_are_filtered(result):
    part = selected(result, ["sum_Y"], rate=5.0)
    np.testing.assert_allclose(np.diff(part.time), 0.2)
    assert part.sum_Y.shape == (len(part.time), *result.sum_Y.shape[1:])
    # a slow quantity stays what it is
    inner = part.time[5:-5]
    expected = np.interp(inner, result.time, result.distance)
    np.testing.assert_allclose(part.distance[5:-5], expected, rtol=1e-3)


def test_a_wheel_that_lifts_spoils_no_other_values_at_a_lower_rate(result):
    """Y/Q is that of the filtered forces; other values are missing where they do not exist."""
    arrays = {name: np.array(result[name]) for name in result}
    middle = len(result.time) // 2
    for name in ("Y_over_Q", "contact_y"):
        arrays[name][middle : middle + 3, 0, 0] = np.nan
    about = result.quantities, result.coordinates, result.attributes, result.profiles
    lifts = railsim.Result(arrays, *about)
    part, whole = (selected(one, rate=5.0) for one in (lifts, result))
    Y, Q = part.Y, part.Q
    inner = slice(5, -5)
    np.testing.assert_allclose(part.Y_over_Q[inner], ([-1.0, 1.0] * Y / Q)[inner], rtol=1e-3)
    assert np.isnan(part.contact_y[:, 0, 0]).sum() <= 2
    there = ~np.isnan(part.contact_y)
    np.testing.assert_allclose(part.contact_y[there], whole.contact_y[there], atol=1e-3)


def test_a_lower_rate_is_a_butterworth_at_two_fifths_of_it_up_to_the_end(result):
    """At 18 Hz and 40 a second, corner 16 Hz, 1/sqrt(1 + (18/16)^8) is left of a tone."""
    time = np.arange(0.0, 10.0 + 1e-9, 1.0 / 400.0)
    tone, gap = np.sin(36.0 * np.pi * time), (time > 4.0) & (time < 6.0)
    arrays = {
        "time": time, "distance": 20.0 * time, "sum_Y": np.tile(tone[:, None], 4),
        "contact_y": np.where(gap[:, None, None], np.nan, 0.75 * np.ones((len(time), 4, 2))),
    }  # fmt: skip
    about = {n: result.quantities[n] for n in arrays}, result.coordinates, result.attributes
    part = selected(railsim.Result(arrays, *about), rate=40.0)
    np.testing.assert_allclose(part.time, np.arange(401) / 40.0, atol=1e-9)
    left = np.sin(36.0 * np.pi * part.time) / np.sqrt(1.0 + 1.125**8)
    inner = slice(20, -20)
    np.testing.assert_allclose(part.sum_Y[inner, 0], left[inner], atol=2e-3)
    there = (part.time <= 4.0 + 1e-9) | (part.time >= 6.0 - 1e-9)
    np.testing.assert_array_equal(np.isnan(part.contact_y[:, 0, 0]), ~there)
    np.testing.assert_allclose(part.contact_y[there], 0.75, rtol=1e-6)


def test_uneven_times_are_filtered_too(result):
    """Outputs at equal distances of a run that speeds up: 60 Hz would be one of 20 at 40 a second.

    Between two values a straight line takes up to 1 % of a tone of 2 Hz at 200 a second.
    """
    distance = np.arange(2.0, 200.0, 0.05)
    time = np.sqrt(distance)  # from 2.8 to 28 m/s, every 18 to 1.8 ms
    slow, fast = (np.sin(2.0 * np.pi * f * time) for f in (2.0, 60.0))
    fast *= np.clip(time - 7.0, 0.0, 1.0)  # where there are four values in a period at least
    arrays = {"time": time, "distance": distance, "sum_Y": np.tile((slow + fast)[:, None], 4)}
    about = {n: result.quantities[n] for n in arrays}, result.coordinates, result.attributes
    part = selected(railsim.Result(arrays, *about), rate=40.0)
    inner = slice(20, -20)
    left = np.sin(4.0 * np.pi * part.time)
    np.testing.assert_allclose(part.sum_Y[inner, 0], left[inner], atol=0.02)


def test_a_rate_of_more_values_than_a_file_should_hold_is_refused(result):
    with pytest.raises(InputError, match=r"instants; 1e\+07 at most"):
        selected(result, ["Q"], rate=1e9)


def test_a_run_that_ended_at_its_start_has_columns_and_no_rows(result, tmp_path, capsys):
    over_time = {name for name, one in result.quantities.items() if one.dims[0] == "time"}
    arrays = {name: result[name][: 0 if name in over_time else None] for name in result}
    parts = result.quantities, result.coordinates, result.attributes, result.profiles
    file = str(railsim.Result(arrays, *parts).to_hdf5(tmp_path / "run.h5"))
    out = tmp_path / "run.csv"
    assert main(["export", file, "Q", "sum_Y", "--out", str(out)]) == 0
    (header,) = out.read_text().splitlines()
    assert header.count("Q:") == 8
    for part in (["--between", "0", "10"], ["--rate", "10"]):
        assert main(["export", file, "--out", str(out), "--overwrite", *part]) == 2
        assert capsys.readouterr().err.startswith("result: time: holds no instants: complete; ")
    assert out.read_text().splitlines() == [header]


def test_all_that_is_wrong_is_named_at_once(result, tmp_path, capsys):
    file = result.to_hdf5(tmp_path / "run.h5")
    wrong = ["export", str(file), "QQ", "--between", "1e6", "2e6", "--rate", "-1"]
    assert main([*wrong, "--out", str(tmp_path / "a.csv")]) == 2
    words = capsys.readouterr().err
    assert "A below B" in words
    for part in ("QQ: no such quantity", "--between: ", "--rate: "):
        assert part in words
    with pytest.raises(railsim.InputError, match="rate"):
        selected(result, rate=np.nan)
