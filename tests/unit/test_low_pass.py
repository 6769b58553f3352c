"""The low pass between the time loop and the result."""

import numpy as np
import pytest
from scipy import signal

import railsim
from railsim.definitions.settings import Settings
from railsim.errors import InputError
from railsim.notation import QUANTITIES
from railsim.result import MemorySink, low_pass
from railsim.result.low_pass import LowPassSink
from railsim.simulation.sampling import instants_for_each, low_pass_remark, with_loop_rate

NAMES = ("time", "distance", "Q", "Y", "Y_over_Q")
COORDINATES = {"wheelset": ("only",), "body": ()}


def passed(Y, *, causal=False, frequency=80.0, chunks=7, rate=1000.0, every=5, extra=0.0):
    """What a sink keeps of Y(t) at both wheels, Q = 50 kN, over ten seconds."""
    t = np.arange(round(10.0 * rate) + 1) / rate
    if extra:
        t = np.append(t, t[-1] + extra)
    wheels = np.repeat(Y(t)[:, None, None], 2, axis=2)
    sink = LowPassSink(MemorySink(), every, rate / every, frequency, causal=causal)
    sink.begin(COORDINATES, [QUANTITIES[name] for name in NAMES])
    given = {"time": t, "distance": 20.0 * t, "Q": np.full_like(wheels, 50e3), "Y": wheels,
             "Y_over_Q": np.full_like(wheels, np.nan)}  # fmt: skip
    for rows in np.array_split(np.arange(len(t)), chunks):
        sink.append({name: array[rows] for name, array in given.items()})
    return sink.close({"status": "complete"})


def test_what_lies_in_the_pass_band_stays_as_it_is():
    found = passed(lambda t: 1e3 * np.sin(2 * np.pi * 60.0 * t))
    inner = (found.time > 0.2) & (found.time < 9.8)
    wave = 1e3 * np.sin(2 * np.pi * 60.0 * found.time)
    np.testing.assert_allclose(found.Y[inner, 0, 1], wave[inner], atol=0.2)
    np.testing.assert_allclose(found.Y_over_Q[:, 0, 0], -found.Y[:, 0, 0] / 50e3, rtol=1e-12)


@pytest.mark.parametrize("f", [121.0, 150.0, 199.0, 340.0])
def test_what_would_be_folded_back_is_gone(f):
    found = passed(lambda t: 1e3 * np.sin(2 * np.pi * f * t + 0.3))
    inner = (found.time > 0.2) & (found.time < 9.8)
    assert np.max(np.abs(found.Y[inner])) < 0.2


def test_the_first_and_the_last_instant_are_stored_as_computed_and_the_remark_says_so():
    """The odd mirror image about x_0: sum h_k (x_k + 2 x_0 - x_k) = x_0 for every symmetric h."""
    found = passed(lambda t: 1e3 + 500.0 * np.cos(2 * np.pi * 340.0 * t)).Y[:, 0, 0] - 1e3
    np.testing.assert_allclose(found[[0, -1]], 500.0, rtol=1e-9)
    assert np.max(np.abs(found[1:-1])) < 0.2 * 500.0
    assert np.max(np.abs(found[6:-6])) < 0.02 * 500.0
    remark = low_pass_remark(Settings(outputs={"low_pass": {"frequency": 80.0}}))
    assert "the first and the last instant are as computed" in remark


@pytest.mark.parametrize("causal", [False, True])
def test_chunks_do_not_matter_and_times_are_equal_steps(causal):
    def noise(t):
        return np.random.default_rng(1).normal(size=len(t)).cumsum()

    frequency = 20.0 if causal else 80.0
    one = passed(noise, causal=causal, frequency=frequency, chunks=1)
    many = passed(noise, causal=causal, frequency=frequency, chunks=301)
    np.testing.assert_allclose(one.Y, many.Y, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(many.time, np.arange(2001) / 200.0, atol=1e-12)
    np.testing.assert_allclose(many.distance, 20.0 * many.time, atol=1e-9)


def test_symmetric_filter_is_a_convolution_and_multiplies_few_zeros(monkeypatch):
    """By matrices of some rows: one of a whole chunk, here 120 rows, is zeros to nine tenths."""
    made, banded = [], low_pass._banded
    monkeypatch.setattr(low_pass, "_banded", lambda *a: made.append(banded(*a)) or made[-1])
    found = passed(lambda t: np.sin(500.0 * t), frequency=80.0, chunks=15)
    taps = made[0][0][made[0][0] != 0.0]
    t = np.arange(10001) / 1000.0
    expected = np.convolve(np.sin(500.0 * t), taps, mode="same")[:: 1000 // 200]
    inside = slice(len(taps), -len(taps))
    np.testing.assert_allclose(found.Y[inside, 0, 0], expected[inside], atol=1e-12)
    assert max(one.size for one in made) <= 3 * max(np.count_nonzero(one) for one in made)


def test_a_loop_that_writes_into_the_same_memory_spoils_no_instants():
    """The filter's half length, 1255 instants, is longer than the loop's first 800."""
    t = np.arange(8001) / 1000.0
    sink = LowPassSink(MemorySink(), 100, 10.0, 4.0, causal=False)
    sink.begin(COORDINATES, [QUANTITIES[name] for name in NAMES])
    memory = {name: np.zeros(800) for name in ("time", "distance")}
    memory |= {name: np.full((800, 1, 2), 50e3) for name in ("Q", "Y", "Y_over_Q")}
    for start in range(0, len(t), 800):
        rows = t[start : start + 800]
        memory["time"][: len(rows)] = rows
        memory["distance"][: len(rows)] = 20.0 * rows
        memory["Y"][: len(rows)] = (1e3 * np.sin(2.0 * np.pi * rows))[:, None, None]
        sink.append({name: array[: len(rows)] for name, array in memory.items()})
    found = sink.close({"status": "complete"})
    np.testing.assert_allclose(found.time, np.arange(81) / 10.0, atol=1e-12)
    np.testing.assert_allclose(found.Y[:, 0, 0], 1e3 * np.sin(2.0 * np.pi * found.time), atol=3.0)


def test_causal_filter_is_scipys_butterworth_of_order_4():
    def noise(t):
        return np.random.default_rng(2).normal(size=len(t)).cumsum()

    found = passed(noise, causal=True, frequency=20.0)
    b, a = signal.butter(4, 20.0, fs=1000.0)
    x = noise(np.arange(10_001))
    whole, _ = signal.lfilter(b, a, x, zi=signal.lfilter_zi(b, a) * x[0])
    np.testing.assert_allclose(found.Y[:, 0, 0], whole[::5], atol=1e-6)


@pytest.mark.parametrize("causal", [False, True])
@pytest.mark.parametrize("chunks", [1, 7, 301])
def test_a_wheel_that_lifts_spoils_no_other_instants(causal, chunks):
    """Its contact exists nowhere for 0.1 s; before and afterwards it is where it was."""
    t = np.arange(10_001) / 1000.0
    place = np.full((len(t), 1, 2), 0.75)
    place[4000:4100, 0, 0] = np.nan
    sink = LowPassSink(MemorySink(), 5, 200.0, 20.0 if causal else 80.0, causal=causal)
    names = ("time", "distance", "contact_y")
    sink.begin(COORDINATES, [QUANTITIES[name] for name in names])
    given = {"time": t, "distance": 20.0 * t, "contact_y": place}
    for rows in np.array_split(np.arange(len(t)), chunks):
        sink.append({name: array[rows] for name, array in given.items()})
    found = sink.close({"status": "complete"})
    missing = np.isnan(found.contact_y)
    np.testing.assert_array_equal(missing, np.isnan(place[::5]))
    np.testing.assert_allclose(found.contact_y[~missing], 0.75, rtol=1e-6)


def test_end_of_a_run_between_two_instants_is_left_out():
    found = passed(lambda t: 1e3 + 0.0 * t, extra=4e-4)
    assert len(found.time) == 2001
    np.testing.assert_allclose(found.Y, 1e3, rtol=1e-9)


@pytest.mark.parametrize(("outputs", "rate", "message"), [
    ({"low_pass": {"frequency": 90.0}}, 200.0, "'output_rate' must be 225"),
    ({"low_pass": {"frequency": 40.0, "phase": "causal"}}, 200.0, "'output_rate' must be 268"),
])  # fmt: skip
def test_a_rate_that_folds_back_is_refused(outputs, rate, message):
    with pytest.raises(InputError, match=message):
        Settings(outputs=outputs, output_rate=rate)


def test_low_passed_run_has_the_percentiles_of_the_fine_one():
    """Dips 0.6 m long and 0.8 mm deep: 200 instantaneous samples a second would be far off."""
    dips = [{"type": "dip", "s": s, "length": 0.6, "depth": 0.8e-3} for s in range(30, 190, 11)]
    track = railsim.load_track("straight").replace(irregularities=dips, support={"preset": "rigid"})
    vehicle = railsim.load_vehicle("coach_manchester")
    outputs = {"quantities": ["Q", "wheelset_distance"], "sensors": True}
    fine = Settings(output_rate=1000.0, outputs=outputs, step=0.5e-3)
    slow = Settings(
        output_rate=200.0, step=0.5e-3, outputs={**outputs, "low_pass": {"frequency": 80.0}}
    )
    from railsim.result.filters import low_passed

    runs = {
        rate: railsim.simulate(vehicle, track, speed=40.0, until=220.0, settings=settings)
        for rate, settings in ((1000.0, fine), (200.0, slow))
    }
    values = [
        np.percentile(low_passed(run.Q, rate, 20.0)[round(rate) : -round(rate / 2)], 99.85, axis=0)
        for rate, run in runs.items()
    ]
    np.testing.assert_allclose(values[1], values[0], rtol=3e-3)
    assert set(runs[200.0]) == {
        "time",
        "distance",
        "curvature",
        "cant",
        "mileage",
        "Q",
        "Q0",
        "wheelset_distance",
        "sensor_acceleration",
        "sensor_absolute_acceleration",
        "sensor_displacement",
        "sensor_velocity",
        "sensor_roll_rate",
    }
    assert "flat to 80 Hz" in runs[200.0].remarks[0]
    middle = runs[1000.0].coordinates["sensor"].index("floor_middle")
    assert np.std(runs[1000.0].sensor_acceleration[300:, middle, 2]) > 1e-3


def test_unknown_quantity_is_refused_with_the_nearest_name():
    settings = Settings(outputs={"quantities": ["sum_YY"]})
    with pytest.raises(InputError, match=r"outputs.quantities.*sum_Y"):
        railsim.simulate(
            railsim.load_vehicle("coach_manchester"),
            railsim.load_track("straight"),
            speed=20.0,
            duration=0.1,
            settings=settings,
        )


@pytest.mark.parametrize("rate", [1.0, 30.0, 100.0, 200.0, 333.0, 500.0, 700.0, 1000.0, 2000.0])
def test_the_loop_puts_out_the_fewest_whole_parts_that_make_1000_a_second(rate):
    """At least 1000 a second before the low pass, and at least two for each stored value."""
    settings = Settings(output_rate=rate, outputs={"low_pass": {"frequency": 0.2 * rate}})
    every = instants_for_each(settings)
    assert every >= 2
    assert every * rate >= 1000.0
    assert (every - 1) * rate < 1000.0 or every == 2
    assert with_loop_rate(settings).output_rate == every * rate
    assert with_loop_rate(Settings(output_rate=rate)).output_rate == rate
