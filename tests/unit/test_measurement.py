"""Measured runs: what files say becomes channels in SI, or one clear fault."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

import railsim
from railsim.definitions.measurement import MeasurementFile
from railsim.measurement.alignment import aligned, common_shift, shift_of
from railsim.measurement.clock import clock_of, delayed
from railsim.measurement.likeness import suspicions
from railsim.measurement.position import position
from railsim.track.alignment import Alignment

RATE, COUNT = 500.0, 3000
HEAD = """format = "railsim-measurement/1"
name = "run"
speed = 50.0
"""
CHANNELS = """[channels]
t = { quantity = "time" }
box = { quantity = "sensor_acceleration:axlebox_1_left:z", unit = "g", reverse = true }
load = { quantity = "Q:1:left", unit = "kN", offset = 1.5 }
"""
t = np.arange(COUNT) / RATE
BOX = 5.0 * np.sin(2 * np.pi * 7.0 * t)  # m/s2
LOAD = 60e3 + 5e3 * np.cos(2 * np.pi * 3.0 * t)  # N


def written(folder: Path, *, cell=lambda row, name, text: text, delimiter=",", text=CHANNELS):
    """Write a CSV and its measurement file; `cell` may spoil cells."""
    columns = {"t": t, "box": -BOX / 9.80665, "load": LOAD / 1e3 + 1.5}
    lines = [delimiter.join(columns)]
    for k in range(COUNT):
        cells = [cell(k, name, f"{column[k]:.9f}") for name, column in columns.items()]
        lines.append(delimiter.join(cells))
    body = "\n".join(lines)
    (folder / "a.csv").write_text(body.replace(".", ",") if delimiter == ";" else body)
    (folder / "m.toml").write_text(HEAD + 'file = "a.csv"\n' + text)
    return folder / "m.toml"


def test_table_of_a_run_shows_the_range_and_the_gaps_of_every_channel(tmp_path):
    def gap(row, name, text):
        return "" if name == "load" and 600 <= row < 750 else text

    measured = railsim.load_measurement(written(tmp_path, cell=gap))
    assert repr(measured) == "<Measurement 'run': 2 channels, 0.3 km>"  # 6 s at 50 m/s
    page = measured._repr_html_()
    rows = [re.findall(r"<td[^>]*>([^<]*)</td>", row) for row in page.split("<tr")]
    found = {row[0]: [float(cell) for cell in row[2:]] for row in rows if len(row) == 5}
    assert found["box"] == pytest.approx([-5.0, 5.0, 0.0], rel=1e-3)
    assert found["load"] == pytest.approx([55e3, 65e3, 5.0], rel=1e-3)  # 150 of 3000


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_units_signs_and_offsets(tmp_path, delimiter):
    run = railsim.load_measurement(written(tmp_path, delimiter=delimiter))
    assert run["box"] == pytest.approx(BOX, abs=1e-7)
    assert run["Q:1:left"] == pytest.approx(LOAD, abs=1e-4)
    assert run.distance == pytest.approx(50.0 * t)
    assert run.rate == pytest.approx(RATE)
    assert run.remarks == ()


def test_binary_files_give_what_csv_gives(tmp_path):
    path = written(tmp_path)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["box"] = t, np.stack([BOX, -BOX / 9.80665], axis=1)
        file["load"] = (LOAD / 1e3 + 1.5)[None]
    savemat(tmp_path / "a.mat", {"t": t, "box": -BOX[:, None] / 9.80665, "load": LOAD / 1e3 + 1.5})
    for name, index in (("a.h5", "[1]"), ("a.mat", "[]")):
        overrides = [f"file={tmp_path / name}", f"channels.box.index={index}"]
        run = railsim.load_measurement(path, overrides)
        assert run["box"] == pytest.approx(BOX), name
        assert run["load"] == pytest.approx(LOAD), name


def test_parquet_in_pieces(tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    frame = pandas.DataFrame({"t": t, "box": -BOX / 9.80665, "load": LOAD / 1e3 + 1.5, "note": "x"})
    frame.loc[10, "box"] = None
    path = written(tmp_path)
    frame.to_parquet(tmp_path / "a.parquet", row_group_size=700)
    run = railsim.load_measurement(path, [f"file={tmp_path / 'a.parquet'}"])
    assert np.flatnonzero(np.isnan(run["box"])).tolist() == [10]
    assert run["load"] == pytest.approx(LOAD)


@pytest.mark.parametrize("kind", [railsim.InputError, ImportError])
def test_what_parquet_needs_is_named(tmp_path, monkeypatch, kind):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    (tmp_path / "a.parquet").touch()
    with pytest.raises(kind, match=re.escape("pip install 'railsim[parquet]'")):
        railsim.load_measurement(written(tmp_path), [f"file={tmp_path / 'a.parquet'}"])


def test_matlab_structures_are_not_opened(tmp_path):
    path = written(tmp_path)
    savemat(tmp_path / "a.mat", {"t": t, "box": {"values": BOX}, "load": LOAD})
    with pytest.raises(railsim.InputError, match="a struct; an array of numbers"):
        railsim.load_measurement(path, [f"file={tmp_path / 'a.mat'}"])


def test_gaps_are_nan_bridged_only_where_short(tmp_path):
    def cell(row, name, text):
        hole = row in (50, 51) or 100 <= row < 120
        return "" if name == "box" and hole else "-9999" if name == "load" and row == 7 else text

    path = written(tmp_path, cell=cell)
    run = railsim.load_measurement(path, ["missing=[-9999.0]", "longest_gap=0.004"])
    assert np.flatnonzero(np.isnan(run["box"])).tolist() == list(range(100, 120))
    curvature = 5.0 * (2 * np.pi * 7.0) ** 2
    assert run["box"][50:52] == pytest.approx(BOX[50:52], abs=curvature * 0.006**2 / 8)
    assert np.isfinite(run["load"]).all()
    assert any("box" in remark and "missing" in remark for remark in run.remarks)


def test_lost_lines_leave_a_gap_in_time(tmp_path):
    path = written(tmp_path)
    lines = (tmp_path / "a.csv").read_text().split("\n")
    (tmp_path / "a.csv").write_text("\n".join(lines[:1000] + lines[1010:]))
    run = railsim.load_measurement(path)
    assert len(run.time) == COUNT
    assert np.flatnonzero(np.isnan(run["box"])).tolist() == list(range(999, 1009))
    assert run["box"][2000] == pytest.approx(BOX[2000])
    assert any("gap" in remark for remark in run.remarks)


def test_a_clock_with_few_digits_is_a_line():
    exact = np.arange(5000) / 300.0
    clock = clock_of("a.csv", np.round(exact, 3))
    assert clock.rate == pytest.approx(300.0, rel=1e-3 / exact[-1])
    assert clock.places is not None
    assert np.abs(clock.time - exact).max() < 1e-3


def test_unequal_steps_are_interpolated_and_said():
    rng = np.random.default_rng(1)
    exact = np.cumsum(0.002 * rng.uniform(0.6, 1.4, 5000))
    clock = clock_of("a.csv", exact)
    assert "unequal" in clock.remarks[0]
    assert abs(clock.time[-1] - exact[-1]) < 0.51 / clock.rate  # it ends where the record ends
    assert np.abs(clock.on_grid(np.sin(exact)) - np.sin(clock.time))[:-1].max() < 1e-5


def test_a_channel_that_lags_is_put_right(tmp_path):
    path = written(tmp_path)
    run = railsim.load_measurement(path, ["channels.box.delay=0.0033"])
    later = 5.0 * np.sin(2 * np.pi * 7.0 * (t + 0.0033))
    assert np.nanmax(np.abs(run["box"] - later)) < 1e-4
    # of a cubic of the index, exactly
    x = np.arange(20.0) ** 3
    assert delayed(x, -0.3)[5] == pytest.approx(4.7**3)


def test_two_files_follow_each_other(tmp_path):
    path = written(tmp_path)
    both = f"file=[{str(tmp_path / 'a.csv')!r}, {str(tmp_path / 'a.csv')!r}]"
    run = railsim.load_measurement(path, [both])
    assert len(run.time) == 2 * COUNT
    assert run.distance[-1] == pytest.approx(50.0 * (2 * COUNT - 1) / RATE)
    assert "begins anew" in run.remarks[0]


def test_coarse_mileage_against_speed(tmp_path):
    text = CHANNELS + 'km = { quantity = "mileage", unit = "km", column = "km" }\n'
    path = written(tmp_path, text=text)
    lines = (tmp_path / "a.csv").read_text().split("\n")
    counter = np.floor((7000.0 - 50.0 * t) / 5.0) * 5e-3  # falls, steps of 5 m
    rows = [f"{line},{km:.3f}" for line, km in zip(lines[1:], counter, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join([lines[0] + ",km", *rows]))
    run = railsim.load_measurement(path, ["start=100.0"])
    assert np.abs(run.distance - 100.0 - 50.0 * t).max() < 5.0
    assert np.diff(run.distance).min() > 0.0


def test_a_clock_0_3_per_cent_off_is_said_beside_distance_and_speed():
    """Both are measured, in their own time; the record's clock runs 0.3 % fast."""
    how = MeasurementFile(
        format="railsim-measurement/1", name="run", file="-", rate=100.0,
        channels={"Q": {"quantity": "Q:1:left"}, "v": {"quantity": "speed"}},
    )  # fmt: skip
    time = np.linspace(0.0, 40.0, 4001)
    for clock, words in ((1.0, []), (1.003, ["differ by -0.30 %"])):
        axes = {"speed": np.full(4001, 50.0), "distance": 50.0 * time}
        said = position("-", how, clock * time, axes, None)[2]
        assert len(said) == len(words)
        assert all(w in s for w, s in zip(words, said, strict=True))


def test_an_axis_is_linear_over_its_gaps_and_constant_beyond_what_is_known():
    how, time = MeasurementFile.model_construct(speed=None, start=0.0), np.linspace(0.0, 10.0, 1001)
    known = (time > 0.3) & ((time < 4.0) | (time > 5.0)) & (time < 9.8)
    speed = 20.0 + 2.0 * time
    read = {"speed": np.where(known, speed, np.nan)}
    _, found, (said,) = position("a.toml", how, time, read, None)
    assert found == pytest.approx(np.clip(speed, *speed[known][[0, -1]]), rel=1e-12)
    assert said == "The speed has gaps (15.3 %): linear over them."


@pytest.mark.parametrize(("gravity", "high_pass"), [(9.81, ""), (0.0, ", high_pass = 0.2")])
def test_mounting_takes_gravity_back(tmp_path, gravity, high_pass):
    """A floor sensor rolled by 20 mrad reads -g p in y, which a high pass keeps back, and z."""
    p = 0.02
    z, y = BOX, 0.3 * np.ones(COUNT)
    read_y, read_z = y + p * (z - gravity), z - p * y
    rows = [f"{a:.9f},{b:.9f}" for a, b in zip(read_y, read_z, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["y,z", *rows]))
    (tmp_path / "m.toml").write_text(
        HEAD + 'file = "a.csv"\nrate = 500.0\nmounting = { floor_front = [0.02, 0.0, 0.0] }\n'
        f'[channels]\ny = {{ quantity = "sensor_acceleration:floor_front:y"{high_pass} }}\n'
        'z = { quantity = "sensor_acceleration:floor_front:z" }\n'
    )
    run = railsim.load_measurement(tmp_path / "m.toml")
    assert run.time == pytest.approx(t)  # of the rate
    assert run.distance == pytest.approx(50.0 * t)
    assert run["y"] == pytest.approx(y, abs=1.5 * p**2 * 15.0)
    assert run["z"] == pytest.approx(z, abs=1.5 * p**2 * 15.0)


def test_a_dead_sensor_is_said(tmp_path):
    path = written(tmp_path, cell=lambda row, name, text: "0.25" if name == "box" else text)
    (words,) = railsim.load_measurement(path).remarks
    assert words == "box is 0.25 from its first value to its last: a dead sensor?"


def test_clipped_signals_are_said_and_left_out(tmp_path):
    def cell(row, name, text):
        return f"{np.clip(float(text), -0.4, 0.4):.9f}" if name == "box" else text

    path = written(tmp_path, cell=cell)
    assert "looks clipped" in railsim.load_measurement(path).remarks[0]
    run = railsim.load_measurement(path, ["channels.box.range=[-0.4, 0.4]"])
    inside = np.isfinite(run["box"])
    assert run["box"][inside] == pytest.approx(BOX[inside], abs=1e-7)
    assert 0.4 < inside.mean() < 0.6


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, []),
        ({"a": {"factor": -1.0}}, ["a has the opposite sign"]),
        ({"b": {"factor": 1e3}}, ["b is 1000 times the simulated one"]),
        ({"b": {"factor": 1.0 / 9.81}}, ["b is 1/9.81 (g) times"]),
        ({"c": {"late": 0.1}}, ["c comes 100 ms later"]),
        ({"c": {"late": -0.1}}, ["c comes 100 ms earlier"]),
        ({name: {"late": 0.1} for name in "abc"}, []),  # of the place, not of the channels
        ({"a": {"drift": 0.2}}, ["a: its clock drifts by "]),
        ({name: {"drift": 0.2} for name in "abc"}, ["All channels drift from the simulation by "]),
    ],
)
def test_signs_units_delays_and_clocks_that_look_wrong_are_said(changes, words):
    """Signals of 0.3 s and longer, put right or wrong; nothing of clocks where none are judged."""
    step = 0.01
    time = step * np.arange(4000)
    rng = np.random.default_rng(4)
    phases, rates = rng.uniform(0.0, 6.3, (3, 60)), rng.uniform(0.3, 20.0, (3, 60))

    def signal(k, at):
        return np.cos(np.multiply.outer(at, rates[k]) + phases[k]).sum(axis=-1)

    simulated = {name: signal(k, time) for k, name in enumerate("abc")}
    measured = {}
    for k, name in enumerate("abc"):
        own = {"factor": 1.0, "late": 0.0, "drift": 0.0, **changes.get(name, {})}
        at = time - own["late"] - own["drift"] * time / time[-1]
        measured[name] = own["factor"] * signal(k, at)
    quantities = {"a": "Q:1:left", "b": "Q:1:right", "c": "Y:1:right"}
    found = suspicions(measured, simulated, quantities, step)
    assert len(found) == min(len(words), 1)
    assert all(word in text for word in words for text in found)
    for milliseconds in re.findall(r"drifts? .*by (\S+) ms", " ".join(found)):
        assert float(milliseconds) == pytest.approx(200.0, abs=1e3 * step)
    of_clocks = any("drift" in own or "late" in own for own in changes.values())
    without = suspicions(measured, simulated, quantities, step, clocks=False)
    assert without == ([] if of_clocks else found)


@pytest.mark.parametrize("shared", [0.0, -0.95])
def test_exchanged_channels_are_told_from_reversed_ones(shared):
    """Loads of both sides are opposite in curves: their correlation is `shared`.

    Two channels of one quantity with each other's values are exchanged; two of other signs are
    not, nor is one alone, nor what two quantities read of each other.
    """
    a, noise, c = np.random.default_rng(5).standard_normal((3, 4000))
    b = shared * a + np.sqrt(1.0 - shared**2) * noise
    simulated = {"QL": a, "QR": b, "YL": c}
    quantities = {"QL": "Q:1:left", "QR": "Q:1:right", "YL": "Y:1:left"}
    exchanged = suspicions({"QL": b, "QR": a, "YL": c}, simulated, quantities, 0.01)
    assert exchanged == ["QL is like the simulated QR, not its own: exchanged?",
                         "QR is like the simulated QL, not its own: exchanged?"]  # fmt: skip
    reversed_ = suspicions({"QL": -a, "QR": -b, "YL": c}, simulated, quantities, 0.01)
    assert [words[:25] for words in reversed_] == [
        "QL has the opposite sign ",
        "QR has the opposite sign ",
    ]
    one = suspicions({"QL": -a, "QR": b, "YL": c}, simulated, quantities, 0.01)
    assert [words[:25] for words in one] == ["QL has the opposite sign "]
    other = suspicions({"QL": c, "QR": b, "YL": a}, simulated, quantities, 0.01)
    assert not [words for words in other if "exchanged" in words]


@pytest.mark.parametrize(("late", "pair"), [("Q", "Q, R against Y, Z"), ("Y", "Y against Z")])
def test_whose_clock_is_wrong_is_open_where_as_many_channels_are_late_as_not(late, pair):
    """Each was said to be off by half of it, the late ones and the others."""
    series = dict(zip("QRYZ", np.random.default_rng(6).standard_normal((4, 4000)), strict=True))
    chosen = "QRYZ" if late == "Q" else "YZ"
    simulated = {name: np.convolve(series[name], np.hanning(9), "same") for name in chosen}
    behind = pair.split(" ")[0] if late == "Y" else "QR"
    measured = {n: np.roll(x, 10 * (n in behind)) for n, x in simulated.items()}
    (found,) = suspicions(measured, simulated, dict.fromkeys(chosen, "sum_Y:1"), 0.01)
    assert found.startswith(f"{pair}: 100 ms later than simulated.")


def test_channels_of_two_places_one_behind_the_other_are_exchanged_and_not_late():
    """What the rear one reads comes 0.2 s later; both were said to have another clock."""
    a, noise = np.random.default_rng(7).standard_normal((2, 4000))
    front = np.convolve(a, np.hanning(9), "same")
    rear = np.roll(front, 20) + 0.3 * np.convolve(noise, np.hanning(9), "same")
    simulated = {"f": front, "r": rear, "Y": np.convolve(noise, np.hanning(9), "same")}
    quantities = {"f": "sum_Y:1", "r": "sum_Y:2", "Y": "Y:1:left"}
    found = suspicions(simulated | {"f": rear, "r": front}, simulated, quantities, 0.01)
    assert found == ["f is like the simulated r, not its own: exchanged?",
                     "r is like the simulated f, not its own: exchanged?"]  # fmt: skip
    late = suspicions(simulated | {"r": np.roll(rear, 20)}, simulated, quantities, 0.01)
    assert late == ["r comes 200 ms later than simulated: 'delay', or its place on the vehicle?"]


def test_resampling_keeps_what_is_slow_and_folds_nothing(tmp_path):
    run = railsim.load_measurement(written(tmp_path)).resampled(50.0)
    inner = slice(20, -20)
    assert run.rate == pytest.approx(50.0)
    assert run["load"][inner] == pytest.approx(LOAD[::10][inner], rel=1e-3)


def test_high_pass_alone_is_a_butterworth_one(tmp_path):
    """Of order 4: tones of 3 and 7 Hz by 1/sqrt(1 + (corner/f)^8)."""
    run = railsim.load_measurement(written(tmp_path)).filtered(low=3.0)
    inner = slice(1000, 2000)
    assert run["load"][inner] == pytest.approx((LOAD - 60e3)[inner] / np.sqrt(2.0), abs=30.0)
    gain = 1.0 / np.sqrt(1.0 + (3.0 / 7.0) ** 8)
    assert run["box"][inner] == pytest.approx(gain * BOX[inner], abs=0.01)


def test_resampling_at_its_own_rate_changes_nothing(tmp_path):
    """Nor is the last value lost where its time, times the rate, is a little less than whole."""
    whole = railsim.load_measurement(written(tmp_path))
    for count in range(2, 300):
        run = replace(
            whole, time=whole.time[:count], distance=whole.distance[:count],
            speed=whole.speed[:count], channels={"load": whole["load"][:count]},
        )  # fmt: skip
        assert run.resampled(RATE)["load"] == pytest.approx(run["load"], rel=1e-9)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("channels.load.unit=N", "65 N at most; larger values; is its 'unit' another"),
        ("channels.load.unit=mm", "no unit of Q: N, kN"),
        ("channels.load.column=Q1", "no column 'Q1'"),
        ("channels.box.quantity=sensor_acceleration:axlebox_1_left", "a label for each"),
        ("channels.box={quantity='Q:1:left'}", "two channels of Q:1:left"),
        ("file=gone.csv", "cannot be read"),
        ("file=m.toml", "the name ends in '.toml'"),
        ("rate=100.0", "either a channel of the quantity 'time' or 'rate'"),
        ("channels.box.zero=[100.0, 200.0]", "m.toml: channels.box.zero: no value between 100"),
        ("channels.box.range=[1.0, -1.0]", "'range' must rise"),
        ("encoding=klingon", "unknown encoding"),
        ("channels.box.index=[0]", "leave 'index' out"),
    ],
)
def test_bad_input_is_one_clear_line(tmp_path, override, words):
    with pytest.raises(railsim.InputError) as caught:
        railsim.load_measurement(written(tmp_path), [override])
    assert len(caught.value.faults) == 1
    assert words in str(caught.value)


def test_text_among_numbers_names_its_line(tmp_path):
    path = written(tmp_path, cell=lambda row, name, text: "off" if row == 70 else text)
    with pytest.raises(railsim.InputError, match=r"line 72: not a number \('off'\)"):
        railsim.load_measurement(path)


def test_the_place_is_found_by_the_level_of_the_rails():
    """The shipped run: its counter is 3 m and 0.8 m/km ahead."""
    run = railsim.load_measurement("coach_25t_run")
    track = railsim.load_track(run.definition.track)
    moved = aligned(run, track)
    assert "elsewhere" not in moved.remarks[-1]
    late = moved.distance - run.distance + 3.0 + 8e-4 * run.distance
    assert np.abs(late).max() < 0.6
    other = [{"type": "random", "spectrum": "fra_4", "seed": 9}]
    elsewhere = track.replace(irregularities=other)
    with pytest.raises(railsim.InputError, match="matches nowhere"):
        aligned(run, elsewhere)


@pytest.mark.parametrize(("wave", "alike"), [(0.9, True), (6.0, False)])
def test_the_level_is_looked_for_in_waves_of_3_to_40_m_alone(wave, alike):
    """A wave of 0.9 m that shakes the axlebox ten times as much hides no place; one of 6 m does."""
    run = railsim.load_measurement("coach_25t_run")
    track = railsim.load_track(run.definition.track)
    channels = dict(run.channels)
    boxes = [n for n, q in run.quantities.items() if ":axlebox" in q and q.endswith(":z")]
    assert boxes
    for name in boxes:
        size = 10.0 * np.nanstd(channels[name])
        channels[name] = channels[name] + size * np.sin(2.0 * np.pi * run.distance / wave)
    shaken = replace(run, channels=channels)
    if not alike:
        with pytest.raises(railsim.InputError, match="matches nowhere"):
            aligned(shaken, track)
        return
    late = aligned(shaken, track).distance - run.distance + 3.0 + 8e-4 * run.distance
    assert np.abs(late).max() < 0.6


@pytest.mark.parametrize(
    ("jump", "begin", "words"),
    [
        (20.0, 0.35, "are not at one shift and drift"),
        (40.0, 0.2, "lie elsewhere: does the counter"),
    ],
)
def test_a_counter_that_jumps_is_not_aligned_in_silence(jump, begin, words):
    """A line through both parts is near neither of them: -10.8 m/km where the drift is -0.8."""
    run = railsim.load_measurement("coach_25t_run")
    track = railsim.load_track(run.definition.track)
    later = np.arange(len(run.distance)) > begin * len(run.distance)
    jumped = replace(run, distance=run.distance + jump * later)
    if words.startswith("lie"):
        assert words in aligned(jumped, track).remarks[-1]
    else:
        with pytest.raises(railsim.InputError, match=words):
            aligned(jumped, track)


def test_the_place_is_found_by_curvature(tmp_path):
    """A yaw velocity with noise, 12 m late, on a counter that is 0.2 % long."""
    track = railsim.load_track("curve_r500")
    s = np.arange(20.0, track.length - 20.0, 0.1)
    written = (s - s[0]) * 1.002
    noise = np.random.default_rng(2).standard_normal(len(s))
    rate = 25.0 * (Alignment(track).curvature(s) + 2e-5 * noise)
    rows = np.column_stack([np.arange(len(s)) / 250.0, written, rate, noise])
    header = "t,s,yaw,box"
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=header, comments="")
    (tmp_path / "m.toml").write_text(
        'format = "railsim-measurement/1"\nname = "run"\nfile = "a.csv"\n[channels]\n'
        't = { quantity = "time" }\ns = { quantity = "distance" }\n'
        'yaw = { quantity = "yaw_rate" }\nbox = { quantity = "sensor_acceleration:box:z" }\n'
    )
    run = railsim.load_measurement(tmp_path / "m.toml")
    moved = aligned(run, track)
    assert np.abs(moved.distance - s).max() < 2.0


@pytest.mark.parametrize("late", [-45.0, 5.0, 45.0])
def test_yaw_velocity_is_a_curvature_at_the_speed_of_each_place(late):
    """From 8 to 32 m/s and back along the curve: alike but for round-off, as far off as it may."""
    track = railsim.load_track("curve_r500")
    s = np.arange(20.0, track.length - 20.0, 0.1)
    speed = 20.0 - 12.0 * np.cos(2.0 * np.pi * s / 90.0)
    time = np.concatenate([[0.0], np.cumsum(0.1 / (0.5 * (speed[1:] + speed[:-1])))])
    how = MeasurementFile.model_validate({
        "format": "railsim-measurement/1", "name": "run", "file": "a.csv", "rate": 200.0,
        "speed": 20.0, "channels": {"yaw": {"quantity": "yaw_rate"}, "q": {"quantity": "Q:1:left"}},
    })  # fmt: skip
    channels = {"yaw": speed * Alignment(track).curvature(s), "q": 0.0 * s}
    run = railsim.Measurement(how, time, s - late, speed, channels)
    moved = aligned(run, track)
    assert np.abs(moved.distance - s).max() < 0.1
    assert "correlation 1.00 in 4 windows" in moved.remarks[-1]  # as many as it is long


@pytest.mark.parametrize("offset", [0.0, 40.0])
def test_place_and_correlation_do_not_depend_on_an_offset(offset):
    """A signal 7 m late: found to a tenth of the grid, alike to the last digits."""
    s = np.arange(0.0, 600.0, 0.1)
    x = np.convolve(np.random.default_rng(4).standard_normal(len(s)), np.ones(50), mode="same")
    found = shift_of(s + 7.0, x + offset, s, x)
    assert found.shift == pytest.approx(-7.0, abs=0.01)
    assert found.stretch == pytest.approx(0.0, abs=1e-6)
    assert found.correlation == pytest.approx(1.0, abs=1e-6)


def test_halves_that_are_shifted_apart_have_no_common_shift():
    """20 m back in one half, 20 m ahead in the other: no window is near the median of all."""
    s = np.arange(0.0, 1000.0, 0.1)
    x = np.convolve(np.random.default_rng(4).standard_normal(len(s)), np.ones(50), mode="same")
    torn = np.where(s < 500.0, np.roll(x, 200), np.roll(x, -200))
    found = shift_of(s, torn, s, x)
    assert found.windows >= 4
    assert found.share <= 0.5
    assert found.stretch == 0.0
    assert common_shift([(s, torn, s, x)]) is None


@pytest.mark.parametrize("rate", [512.0, 700.0, 800.0, 900.0])
def test_a_clock_in_milliseconds_of_a_rate_near_1_khz_is_a_line(rate):
    """No value is lost where all lie within half a step of a line."""
    exact = np.arange(4000) / rate
    clock = clock_of("a.csv", np.round(exact, 3))
    assert clock.rate == pytest.approx(rate, rel=1e-5)
    assert len(clock.time) == 4000
    assert np.abs(clock.time - exact).max() < 5e-5
    assert clock.remarks == ()
    lost = clock_of("a.csv", np.round(np.delete(exact, 1700), 3))
    assert lost.remarks


@pytest.mark.parametrize("digit", [0.1, 0.001])
def test_a_vehicle_that_stands_at_the_end_goes_no_further(digit):
    time = np.arange(0.0, 60.0, 0.01)
    way = np.round(20.0 * np.minimum(time, 40.0), 6)
    how = MeasurementFile.model_construct(speed=None, start=0.0)
    s, _, _ = position("a.toml", how, time, {"distance": np.floor(way / digit) * digit}, None)
    assert np.abs(s - way).max() < 0.2 + 2.0 * digit  # a step of the record and one of the counter
    assert np.diff(s).min() > 0.0


def test_the_mean_between_two_times_is_taken_off_the_speed_too(tmp_path):
    text = CHANNELS + 'v = { quantity = "speed", unit = "km/h", zero = [0.0, 1.0] }\n'
    path = written(tmp_path, text=text)
    lines = (tmp_path / "a.csv").read_text().split("\n")
    speed = 3.6 * np.where(t < 2.0, 0.0, 20.0) + 5.0
    rows = [f"{line},{v:.3f}" for line, v in zip(lines[1:], speed, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join([lines[0] + ",v", *rows]))
    run = railsim.load_measurement(path)
    assert run.speed == pytest.approx(np.where(t < 2.0, 0.0, 20.0), abs=1e-6)


def test_a_mileage_against_that_of_the_track_is_said(tmp_path):
    how = MeasurementFile.model_construct(speed=None, start=0.0)
    for counter, falling, words in ((5e3 - 20.0 * t, False, "falls"), (5e3 + t, True, "rises")):
        with pytest.raises(railsim.InputError, match=f"mileage: {words}; as on the track"):
            position("a.toml", how, t, {"mileage": counter}, (4e3, falling))


def test_an_array_of_matlab_7_3_is_that_of_the_older_format(tmp_path):
    """MATLAB's files of version 7.3 are HDF5 with the dimensions in the opposite order."""
    path = written(tmp_path)
    columns = {"t": t[:, None], "box": np.stack([BOX, -BOX / 9.80665, t], axis=1)}
    columns["load"] = (LOAD / 1e3 + 1.5)[:, None]
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        for name, x in columns.items():
            file[name] = x.T
    with open(tmp_path / "a.mat", "r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512))
    savemat(tmp_path / "b.mat", columns)
    how = ["channels.box.index=[1]"]
    newer, older = (
        railsim.load_measurement(path, [f"file={tmp_path / name}", *how])
        for name in ("a.mat", "b.mat")
    )
    assert newer["box"] == pytest.approx(BOX)
    for name in newer.channels:
        np.testing.assert_array_equal(newer[name], older[name])


def test_two_columns_of_one_name_are_refused(tmp_path):
    path = written(tmp_path)
    text = (tmp_path / "a.csv").read_text().replace("t,box,load", "t,load,load", 1)
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(railsim.InputError, match="2 columns 'load'"):
        railsim.load_measurement(path, ["channels.box.column=t"])


def test_single_precision_has_the_same_gaps_as_text(tmp_path):
    """-999.9 and 9.99 of a file in single precision are -999.9000244 and 9.9899998."""
    load = LOAD / 1e4 + 1.5
    load[[20, 21]], load[70:80] = -999.9, 9.99
    path = written(
        tmp_path, cell=lambda row, name, text: f"{load[row]:.9f}" if name == "load" else text
    )
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["box"], file["load"] = t, -BOX / 9.80665, load.astype(np.float32)
    how = ["missing=[-999.9]", "channels.load.range=[-5.0, 9.99]"]
    text, single = (
        railsim.load_measurement(path, [f"file={tmp_path / name}", *how])
        for name in ("a.csv", "a.h5")
    )
    gaps = [20, 21, *range(70, 80)]
    for run in (text, single):
        assert np.flatnonzero(np.isnan(run["load"])).tolist() == gaps


@pytest.mark.parametrize(
    ("time", "distance", "words"),
    [(1e3, None, "0.5 values per second"), (1.0, 1e-3, "0.05 m/s from"), (1.0, 1e3, "5e+04 m/s")],
)
def test_a_clock_in_ms_and_a_distance_in_km_taken_for_si_are_refused(
    tmp_path, time, distance, words
):
    """No speed is measured: only distance over time says that a unit is wrong."""
    text = CHANNELS + ("" if distance is None else 's = { quantity = "distance" }\n')
    path = written(tmp_path, text=text)
    columns = [time * t, -BOX / 9.80665, LOAD / 1e3 + 1.5]
    names = ["t", "box", "load"]
    if distance is not None:
        columns, names = [*columns, distance * 50.0 * t], [*names, "s"]
        path.write_text(path.read_text().replace("speed = 50.0\n", ""))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, x in zip(names, columns, strict=True):
            file[name] = x
    with pytest.raises(railsim.InputError, match=re.escape(words)):
        railsim.load_measurement(path, [f"file={tmp_path / 'a.h5'}"])


def test_a_run_that_is_moved_keeps_its_speed_the_rate_of_its_place(tmp_path):
    run = railsim.load_measurement(written(tmp_path)).moved(7.0, 0.05)
    assert run.distance == pytest.approx(7.0 + 1.05 * 50.0 * t)
    assert run.speed == pytest.approx(np.gradient(run.distance, run.time))


@pytest.mark.parametrize("f", [7.0, 20.0, 30.0])
def test_a_lower_rate_is_taken_behind_a_low_pass_at_two_fifths_of_it(tmp_path, f):
    """|H|^2 = 1/(1 + (f/20 Hz)^8) of a tone at 50 values a second; what is in a gap is lost."""
    run = railsim.load_measurement(written(tmp_path))
    tone = np.cos(2.0 * np.pi * f * t)
    tone[1000] = np.nan
    thin = replace(run, channels={**run.channels, "box": tone}).resampled(50.0)
    assert thin.rate == pytest.approx(50.0)
    assert thin.time == pytest.approx(np.arange(300) / 50.0)
    there = (np.abs(thin.time - 2.0) > 0.5) & (thin.time > 0.5) & (thin.time < 5.5)
    gain = 1.0 / np.sqrt(1.0 + (f / 20.0) ** 8)
    wanted = gain * np.cos(2.0 * np.pi * f * thin.time)
    assert thin["box"][there] == pytest.approx(wanted[there], abs=0.02)
    assert np.flatnonzero(np.isnan(thin["box"])).tolist() == [100]
