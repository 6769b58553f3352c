"""Clock, place and likeness of measured channels, each against a signal that is known."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, freqs
from scipy.spatial.transform import Rotation

from railsim import load_vehicle
from railsim.errors import InputError
from railsim.measurement.alignment import shift_of
from railsim.measurement.clock import bridged, clock_of, delayed
from railsim.measurement.columns import _length
from railsim.measurement.counterpart import amplified, check_channels, outputs_for
from railsim.measurement.data import Measurement
from railsim.measurement.likeness import Likeness, likeness
from railsim.measurement.position import position
from railsim.measurement.reading import _clipped, _implausible, _without_mounting


def signal(s, shortest=4.0, seed=1, count=40):
    """Waves over a place, or a time, of `shortest` and longer, rms 1."""
    random = np.random.default_rng(seed)
    rates = random.uniform(0.5, 2.0 * np.pi / shortest, count)
    turns = np.multiply.outer(s, rates) + random.uniform(0.0, 6.3, count)
    return np.cos(turns).sum(axis=-1) * np.sqrt(2.0 / count)


@settings(max_examples=30)
@given(st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4), st.floats(-7.0, 7.0))
def test_a_delayed_cubic_is_that_cubic_later(coefficients, steps):
    """Values that would need others from beyond the ends are none."""
    n = np.arange(20.0)

    def cubic(n):
        return np.polynomial.polynomial.polyval(n - 10.0, coefficients)

    found, whole = delayed(cubic(n), steps), np.floor(steps)
    first, last = (0, 0) if steps == whole else (-1, 2)
    there = (n + whole + first >= 0) & (n + whole + last <= 19)
    assert (np.isnan(found) == ~there).all()
    assert found[there] == pytest.approx(cubic(n + steps)[there], abs=1e-8)


@settings(max_examples=40)
@given(st.lists(st.booleans(), min_size=3, max_size=25), st.integers(0, 6))
def test_gaps_are_bridged_by_straight_lines_up_to_a_length(known, longest):
    known = np.array(known)
    values = np.random.default_rng(len(known)).normal(size=len(known))
    found = bridged(np.where(known, values, np.nan), longest)
    there = np.flatnonzero(known)
    for k in range(len(known)):
        before, after = there[there <= k], there[there >= k]
        if known[k]:
            assert found[k] == values[k]
        elif len(before) and len(after) and after[0] - before[-1] - 1 <= longest:
            assert found[k] == pytest.approx(np.interp(k, there, values[there]))
        else:
            assert np.isnan(found[k])


@settings(max_examples=30)
@given(
    step=st.sampled_from([0.001, 0.0025, 0.01]), begin=st.floats(-5.0, 900.0),
    lost=st.sets(st.integers(3, 296), max_size=8), whole=st.integers(0, 40),
)  # fmt: skip
def test_values_lie_at_their_multiples_of_the_step(step, begin, lost, whole):
    """Lost lines and a gap of whole steps leave values without a number there, no others."""
    k = np.array([n + whole * (n >= 150) for n in range(300) if n not in lost])
    written = np.round(begin + step * k, 5)
    clock = clock_of("made", written)
    assert clock.rate == pytest.approx(1.0 / step, rel=1e-3)
    found = clock.on_grid(k.astype(float))
    assert len(found) == k[-1] + 1
    assert np.flatnonzero(np.isfinite(found)).tolist() == k.tolist()
    assert found[k] == pytest.approx(k)
    assert clock.time == pytest.approx(begin + step * np.arange(k[-1] + 1), abs=0.3 * step)
    with pytest.raises(InputError, match="rise"):
        clock_of("made", np.concatenate([written, written[-1:]]))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("late", "drift"), [(0.0, 0.0), (0.23, 0.0), (-0.4, 0.0), (0.1, 0.15)])
def test_likeness_is_the_lag_the_ratio_and_the_correlation(sign, late, drift):
    step, n = 0.01, 6000
    t = step * np.arange(n)
    simulated = signal(t, 0.3)
    measured = 1.7 * sign * signal(t - late - drift * (t - t.mean()) / t[-1], 0.3)
    measured[1000:1050] = np.nan
    found = likeness(measured, simulated, step)
    assert found.lag == pytest.approx(late, abs=0.5 * step + 0.3 * drift)
    # gaps count neither here nor there
    assert found.ratio == pytest.approx(1.7, rel=0.02)
    if sign < 0.0:
        assert found.correlation == pytest.approx(-1.0, abs=0.15 if drift else 0.02)
        return
    assert found.drift == pytest.approx(drift, abs=1.5 * step)
    if not drift:
        assert found.correlation == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("every", "gap"), [(1.0, 0.2), (0.5, 0.1), (0.3, 0.15)])
def test_gaps_draw_no_lag_to_zero(every, gap):
    """Sums over all instants would give 60, 40 and 0 ms between these gaps, not 80 ms."""
    step, late, t = 0.01, 0.08, 0.01 * np.arange(6000)
    rng = np.random.default_rng(0)
    f, phase = np.linspace(0.5, 2.0, 60), rng.uniform(0.0, 2.0 * np.pi, 60)
    simulated, measured = (
        np.cos(2.0 * np.pi * np.outer(t - shift, f) + phase).sum(axis=1) for shift in (0.0, late)
    )
    measured[(t % every) < gap] = np.nan
    found = likeness(measured, simulated, step)
    assert found.lag == pytest.approx(late)
    assert found.correlation == pytest.approx(1.0, abs=5e-3)


def test_a_wheel_load_lags_by_what_its_changes_do():
    """Its mean is alike at any shift: without taking it off the best one would be none."""
    step, late = 0.02, 17
    changes = np.cumsum(np.random.default_rng(5).normal(size=3000 + late))
    load = 50e3 + 2e3 * (changes - changes.mean()) / changes.std()
    assert likeness(load[:3000], load[late:], step).lag == pytest.approx(late * step)


def test_a_channel_that_says_nothing_is_like_none():
    some, none = signal(np.arange(200.0)), np.zeros(200)
    few = np.where(np.arange(200) < 9, some, np.nan)
    for measured, simulated in ((none, some), (some, none), (few, some)):
        assert all(np.isnan(x) for x in vars(likeness(measured, simulated, 0.01)).values())


@pytest.mark.parametrize(
    ("begin", "length", "shift", "stretch"),
    [(0.0, 60.0, 3.3, 0.0), (5000.0, 60.0, -4.2, 0.0), (5000.0, 900.0, 12.6, 1e-3),
     (120.0, 1500.0, -18.3, -2e-3), (0.0, 800.0, 0.0, 5e-4)],
)  # fmt: skip
def test_a_place_is_shifted_and_stretched_as_the_record_was(begin, length, shift, stretch):
    """Right is s + shift + stretch (s - s_0); of the reference more is known at both ends."""
    s = begin + np.arange(0.0, length, 0.3)
    right = s + shift + stretch * (s - s[0])
    x = signal(right) + 5.0
    x[100:110] = np.nan
    reference = np.arange(begin - 40.0, begin + length + 40.0, 0.25)
    found = shift_of(s, x, reference, signal(reference))
    assert found.shift == pytest.approx(shift, abs=0.08)
    assert found.correlation > 0.9
    if length > 100.0:
        assert found.stretch == pytest.approx(stretch, abs=1e-4)
        assert found.windows > 2
    assert shift_of(s, np.random.default_rng(3).normal(size=len(s)), reference,
                    signal(reference)) is None  # fmt: skip


TIME = 0.05 * np.arange(1201)
V = 20.0 + 0.1 * TIME
WAY = 20.0 * TIME + 0.05 * TIME**2


@pytest.mark.parametrize(
    ("axes", "mileage", "start", "expected"),
    [
        ({"speed": V}, None, 70.0, 70.0 + WAY),
        ({"distance": WAY + 30.0}, None, 70.0, WAY + 30.0),
        ({"distance": np.floor((WAY + 33.0) / 5.0) * 5.0}, None, 0.0, WAY + 33.0),
        ({"mileage": 4000.0 + WAY, "speed": V}, None, 70.0, 70.0 + WAY),
        ({"mileage": 4000.0 - WAY}, None, 70.0, 70.0 + WAY),
        ({"mileage": 4000.0 - WAY}, (4100.0, True), 70.0, 100.0 + WAY),
        ({"mileage": 4000.0 + WAY}, (3900.0, False), 70.0, 100.0 + WAY),
    ],
)
def test_arc_length_by_distance_mileage_or_speed(axes, mileage, start, expected):
    """A counter of 5 m is linear in between and beyond: right within the metre from value to value.

    But for its first 5 m, of which it does not say where they began.
    """
    how = SimpleNamespace(speed=None, start=start)
    s, speed, remarks = position("made", how, TIME, axes, mileage)
    coarse = "distance" in axes and axes["distance"][1] == axes["distance"][0]
    own = slice(6 if coarse else 0, None)
    assert s[own] == pytest.approx(expected[own], abs=1.4 if coarse else 1e-9)
    assert np.all(np.diff(s) > 0.0)
    assert speed[5:-5] == pytest.approx(V[5:-5], rel=0.4 if coarse else 1e-7)
    assert not remarks


@pytest.mark.parametrize(
    ("counts", "end"),
    [
        ([0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 3], [30.0, 33.75, 37.5]),  # on at the mean, 30 m in 8 s
        ([0, 1, 2, 3, 4, 4, 4, 4, 4, 4, 4], [40.0 + 10.0 * k / 6.0 for k in (4, 5, 6)]),
    ],
)
def test_behind_the_last_count_the_way_goes_on_by_less_than_another(counts, end):
    """A counter of 10 m, each second."""
    how, time = SimpleNamespace(speed=None, start=None), np.arange(11.0)
    s, _, _ = position("made", how, time, {"distance": 10.0 * np.array(counts)}, None)
    assert s[-3:] == pytest.approx(end)


@pytest.mark.parametrize("share", [0.003, -0.01])
def test_distance_and_speed_that_differ_are_said_with_their_difference(share):
    how = SimpleNamespace(speed=None, start=0.0)
    axes = {"distance": (1.0 + share) * WAY, "speed": V}
    s, _, (remark,) = position("made", how, TIME, axes, None)
    assert s == pytest.approx((1.0 + share) * WAY)
    assert f"differ by {100.0 * share:+.2f} %" in remark
    assert f"{WAY[-1]:.1f} m by speed" in remark


@pytest.mark.parametrize("filters", [{"low_pass": 9.0}, {"high_pass": 2.5},
                                     {"low_pass": 9.0, "high_pass": 2.5}, {}])  # fmt: skip
def test_an_amplifier_passes_tones_with_amplitude_and_phase_of_its_filters(filters):
    """Butterworth of order 4, analogue, as scipy has it; a mean passes the low pass only."""
    channel = SimpleNamespace(**{"low_pass": None, "high_pass": None} | filters)
    t = np.arange(16_000) / 800.0
    inner = slice(4000, -4000)
    for f in (1.0, 2.5, 6.0, 9.0, 14.0):
        H = 1.0 + 0.0j
        for name, corner in filters.items():
            b, a = butter(4, 2.0 * np.pi * corner, name.replace("_", ""), analog=True)
            H *= freqs(b, a, [2.0 * np.pi * f])[1][0]
        found = amplified(np.sin(2.0 * np.pi * f * t), 800.0, channel)
        expected = np.imag(H * np.exp(2j * np.pi * f * t))
        np.testing.assert_allclose(found[inner], expected[inner], atol=2e-3)
    still = amplified(np.full(len(t), 3.0), 800.0, channel)
    assert still[inner] == pytest.approx(0.0 if "high_pass" in filters else 3.0, abs=5e-3)


@pytest.mark.parametrize(
    ("shape", "index", "count"),
    [((5,), (), 5), ((1, 5), (), 5), ((5, 1), (), 5), ((5, 3), (2,), 5), ((5, 3, 2), (2, 1), 5),
     ((5, 2), (), None), ((5, 3), (3,), None), ((5,), (0,), None), ((), (), None)],
)  # fmt: skip
def test_a_series_is_a_row_or_a_column_or_along_the_first_axis(shape, index, count):
    array = np.zeros(shape)
    if count is not None:
        assert _length(Path("made.mat"), array, "a", index) == count
        return
    with pytest.raises(InputError, match="index"):
        _length(Path("made.mat"), array, "a", index)


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.floats(0.4, 0.49))
def test_unequal_steps_leave_nothing_without_a_value(seed, jitter):
    """Interpolated from the first value to the last, and not beyond."""
    random = np.random.default_rng(seed)
    written = 0.01 * (np.arange(200) + jitter * random.uniform(-1.0, 1.0, 200))
    clock = clock_of("made", written)
    if clock.places is not None:  # so even by chance that they are a clock with few digits
        return
    found = clock.on_grid(3.0 * written)
    assert np.isfinite(found).all()
    assert found == pytest.approx(3.0 * clock.time)
    assert written[-1] - clock.time[-1] < 1.0 / clock.rate


def test_shares_of_missing_values_are_plain_numbers():
    how = SimpleNamespace(speed=None, start=0.0)
    gappy = np.where(np.arange(len(V)) < 3, V, np.nan)
    _, _, (remark, *_) = position("made", how, TIME, {"distance": WAY, "speed": gappy}, None)
    assert "gaps (99.8 %)" in remark


@pytest.mark.parametrize(
    ("correlation", "ratio", "lag", "drift", "words"),
    [
        (-0.51, 1.0, 0.0, 0.0, "opposite sign"), (-0.49, 1.0, 0.0, 0.0, ""),
        (0.51, 9.81 * 1.34, 0.0, 0.0, "9.81 (g) times"), (0.51, 9.81 * 1.36, 0.0, 0.0, ""),
        (0.51, 9.81 / 1.34, 0.0, 0.0, "9.81 (g) times"), (0.49, 9.81, 0.0, 0.0, ""),
        (0.51, 1.0 / 9.81, 0.0, 0.0, "1/9.81 (g) times"), (0.1, 1340.0, 0.0, 0.0, "1000 times"),
        (0.1, 1.34e-3, 0.0, 0.0, "1/1000 times"), (0.1, 1.36e-3, 0.0, 0.0, ""),
        (0.9, 1.0, 0.0, 0.021, "drifts by 21 ms"), (0.9, 1.0, 0.0, 0.019, ""),
        (0.9, 1.0, 0.0, -0.021, "drifts by -21 ms"), (0.9, 1.0, 0.0, np.nan, ""),
        (0.81, 1.0, 0.021, 0.0, "comes 21 ms later"), (0.81, 1.0, -0.021, 0.0, "21 ms earlier"),
        (0.81, 1.0, 0.019, 0.0, ""), (0.79, 1.0, 0.021, 0.0, ""),
    ],
)  # fmt: skip
def test_what_looks_wrong_with_a_channel_is_said_from_its_border_on(
    correlation, ratio, lag, drift, words
):
    """35 % around a factor, correlations of 0.5 and 0.8, two steps of 10 ms."""
    said = Likeness(correlation, ratio, lag, drift).remark("Q1", 0.01)
    assert words in said
    assert bool(said) == bool(words)


@pytest.mark.parametrize(("share", "said"), [(1.0021, "+0.21 %"), (1.0019, ""), (0.9979, "-0.21 %"),
                                             (0.9981, "")])  # fmt: skip
def test_distance_and_speed_may_run_apart_by_a_fifth_of_a_percent(share, said):
    how = SimpleNamespace(speed=None, start=0.0)
    axes = {"distance": share * 20.0 * TIME, "speed": np.full(len(TIME), 20.0)}
    s, _, remarks = position("made", how, TIME, axes, None)
    assert [said in remark for remark in remarks] == ([True] if said else [])
    assert s == pytest.approx(axes["distance"])


@pytest.mark.parametrize(
    ("share", "back", "refused"),
    [
        (1.49, 0.0, ""),
        (1.51, 0.0, "by speed"),
        (0.51, 0.0, ""),
        (0.49, 0.0, "by speed"),
        (1.0, 0.9, ""),
        (1.0, 1.1, "falls by 1.1"),
    ],
)
def test_a_distance_that_contradicts_the_speed_or_falls_is_refused(share, back, refused):
    """By half, and by a metre."""
    how = SimpleNamespace(speed=None, start=0.0)
    way = share * 20.0 * TIME
    middle = len(way) // 2
    way[middle] = way[middle - 1] - back if back else way[middle]
    axes = {"distance": way, "speed": np.full(len(TIME), 20.0)}
    if refused:
        with pytest.raises(InputError, match=refused):
            position("made", how, TIME, axes, None)
    else:
        s = position("made", how, TIME, axes, None)[0]
        assert s[-1] == pytest.approx(way[-1])
        assert np.all(np.diff(s) > 0.0)


@pytest.mark.parametrize(("extra", "gap"), [(0.6, True), (0.4, False)])
def test_a_step_of_one_and_a_half_is_a_gap(extra, gap):
    written = 0.01 * (np.arange(200) + extra * (np.arange(200) >= 100))
    said = "".join(clock_of("made", written).remarks)
    assert ("The record has gaps: 1, together 0.016 s" in said) is gap


def test_a_clock_of_too_few_digits_is_refused_with_the_way_out():
    """Of 200 values per second written with two digits every second stands still."""
    with pytest.raises(InputError, match=r"time 86400\.01 s of value 3 .*'rate' in place of them"):
        clock_of("made", np.round(86400.0 + 0.005 * np.arange(100) + 1e-5, 2))


def test_a_clock_that_trembles_has_no_gaps():
    """Steps of 0.2 to 1.8 means, none lost: each above 1.5 was said to be a gap."""
    places = np.arange(2000)
    trembling = places + np.random.default_rng(1).uniform(-0.4, 0.4, 2000)
    found = clock_of("made", 0.005 * trembling)
    assert [words[:15] for words in found.remarks] == ["The time steps "]
    assert np.isfinite(found.on_grid(found.written)).all()
    kept = trembling[(places < 700) | (places >= 900)]
    lost = clock_of("made", 0.005 * kept)
    assert lost.remarks[0].startswith("The record has gaps: 1, together 1 s")
    assert np.isnan(lost.on_grid(lost.written)).sum() == pytest.approx(200, abs=3)


@pytest.mark.parametrize("long", [2, 3])
def test_a_clock_of_few_digits_has_steps_of_one_and_two_digits_and_not_of_three(long):
    """Two digits beside one are equal steps of 1.5, three are not equal to one: interpolated."""
    steps = np.where(np.arange(300) % 2, long, 1.0)
    written = 1e-3 * np.concatenate([[0.0], np.cumsum(steps)])
    found = clock_of("made", written)
    assert found.rate == pytest.approx(2000.0 / (1.0 + long), rel=1e-4)
    assert ("unequal" in "".join(found.remarks)) is (long == 3)
    rounding = 0.3e-3 if long == 2 else 1e-9
    assert found.on_grid(written) == pytest.approx(found.time, abs=rounding)


@pytest.mark.parametrize(("off", "equal"), [(0.24, True), (0.26, False)])
def test_a_clock_may_leave_its_line_by_a_quarter_of_a_step(off, equal):
    number = np.arange(401)
    written = 0.01 * (number + off * np.sin(2.0 * np.pi * number / 40.0))
    found = clock_of("made", written)
    assert ("unequal" in "".join(found.remarks)) is not equal
    if equal:
        assert found.time == pytest.approx(0.01 * number, abs=1e-4)
        assert found.places.tolist() == number.tolist()


@pytest.mark.parametrize(("late", "found"), [(0.95, True), (-0.95, True), (1.1, False)])
def test_a_channel_is_looked_for_within_a_second(late, found):
    time = np.arange(0.0, 40.0, 0.02)
    one = likeness(signal(time - late, 0.5), signal(time, 0.5), 0.02)
    assert (one.lag == pytest.approx(late, abs=0.021) and one.correlation > 0.9) is found
    assert abs(one.lag) <= 1.0 + 1e-9


@pytest.mark.parametrize("end", [1.0, -1.0])
@pytest.mark.parametrize(
    ("value", "lengths", "clipped"),
    [
        (5.0, [3, 3, 3], True), (0.9, [3, 3, 1, 7], True), (0.9, [2, 2, 2, 2, 2], False),
        (5.0, [3, 9], False), (0.0, [3, 3, 3], False), (1.0, [4, 4, 4], True),
    ],
)  # fmt: skip
def test_a_signal_is_clipped_that_rests_thrice_for_three_values_at_its_end(
    value, lengths, clipped, end
):
    """Not at zero: it stands still there."""
    x = [part for n in lengths for part in (*np.full(n, end * value), end * (value - 1.0))]
    said = _clipped(np.array([*x, np.nan, *np.full(20, end * (value - 0.5))]))
    word = "largest" if end > 0.0 else "smallest"
    times = f"rests {len(lengths)} times at its {word} value {end * value:g} and looks clipped"
    assert said == (times if clipped else "")
    assert _clipped(np.array(x[:1] * 30)) == _clipped(np.array(x[:19])) == ""


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("quantity", "least", "most"),
    [
        ("Q:1:left", 500.0, 1e6), ("Y:1:left", 0.0, 1e6), ("sum_Y:1", 0.0, 2e6),
        ("sum_abs_Y:1", 0.0, 2e6), ("Y_over_Q:1:left", 0.0, 10.0), ("speed", 0.1, 170.0),
        ("curvature", 0.0, 0.2), ("yaw_rate", 0.0, 10.0), ("sensor_acceleration:p:z", 0.0, 5e3),
        ("sensor_absolute_acceleration:p:z", 0.0, 5e3), ("sensor_displacement:p:z", 0.0, 1.0),
        ("sensor_velocity:p:z", 0.0, 50.0), ("sensor_roll_rate:p", 0.0, 20.0),
        ("wheelset_lateral:1", 0.0, 0.2), ("element_deflection:e:z", 0.0, 2.0),
    ],
)  # fmt: skip
def test_a_channel_is_refused_outside_of_what_vehicles_do(quantity, least, most, sign):
    """Its largest amount counts, gaps and zeros do not."""

    def faults(largest):
        x = sign * largest * np.array([0.1, np.nan, 1.0])
        return _implausible(how, "a", x)

    channels = {"a": SimpleNamespace(quantity=quantity)}
    how = SimpleNamespace(channels=channels, file=("made.csv",))
    assert faults(most) == faults(max(least, 1e-12)) == faults(0.0) == faults(np.nan) == []
    (fault,) = faults(1.01 * most)
    assert f"{most:g}" in fault.allowed
    assert f"{1.01 * most:.4g}" in fault.found
    assert (len(faults(0.99 * least)) == 1) == (least > 0.0)


@pytest.mark.parametrize("angles", np.vstack([np.eye(3), [[0.5, -1.0, 0.7]]]))
@pytest.mark.parametrize("measured", ["xyz", "xz", "y"])
def test_turned_sensors_are_turned_back_as_the_rotation_says(angles, measured):
    """To first order of the angles; axes that nobody measured count as standing still."""
    true = np.random.default_rng(3).normal(size=(50, 3)) * [axis in measured for axis in "xyz"]
    small = 1e-5 * angles
    gravity = np.array([0.0, 0.0, 9.81])
    read = Rotation.from_rotvec(small).inv().apply(true - gravity) + gravity
    channels = {
        f"channel {axis}": SimpleNamespace(quantity=f"sensor_acceleration:p:{axis}", high_pass=None)
        for axis in measured
    }
    values = {f"channel {axis}": read[:, "xyz".index(axis)] for axis in measured}
    how = SimpleNamespace(channels=channels, mounting={"p": tuple(small)})
    remarks = []
    found = _without_mounting("made", how, values, remarks)
    for axis in measured:
        error = found[f"channel {axis}"] - true[:, "xyz".index(axis)]
        assert np.abs(error).max() < 1e-4 * np.abs(small).max() * 9.81 + 3e-10
    missing = [axis for axis in "xyz" if axis not in measured]
    said = f"p: {', '.join(missing)} is not measured, taken as zero."
    assert remarks == ([said] if missing else [])


def test_a_part_holds_the_first_and_not_the_last_of_its_places():
    s = 0.5 * np.arange(40.0)
    how = SimpleNamespace(channels={"a": SimpleNamespace(quantity="Q:1:left")}, name="run")
    run = Measurement(how, s / 20.0 + 3.0, s + 7.0, np.full(40, 20.0), {"a": s**2})
    part = run.part(10.0, 20.0)
    assert part.distance == pytest.approx(np.arange(10.0, 20.0, 0.5))
    assert part["a"] == pytest.approx((part.distance - 7.0) ** 2)
    assert part.time == pytest.approx((part.distance - 7.0) / 20.0 + 3.0)
    assert run.rate == pytest.approx(40.0) == part.rate
    moved = run.moved(4.0, 0.1)
    assert moved.distance == pytest.approx(11.0 + 1.1 * s)
    assert moved.speed == pytest.approx(np.gradient(moved.distance, moved.time))
    with pytest.raises(KeyError, match="no channel 'b'"):
        run["b"]


@pytest.mark.parametrize(
    ("quantities", "outputs"),
    [
        (["Q:1:left", "Y:2:right"], {"quantities": ["Q", "Y"]}),
        (["element_force:damper:z", "element_power:a", "Q:1:left"],
         {"elements": ["a", "damper"], "quantities": ["Q"]}),
        (["sensor_acceleration:p:z"], {"sensors": "readings", "quantities": ["distance"]}),
        (["sensor_acceleration:p:z", "sensor_roll_rate:p"],
         {"sensors": "readings", "quantities": ["distance"]}),
        (["sensor_acceleration:p:z", "sensor_displacement:p:z"],
         {"sensors": True, "quantities": ["distance"]}),
    ],
)  # fmt: skip
def test_a_run_has_to_output_what_was_measured(quantities, outputs):
    assert outputs_for(quantities) == outputs


def test_channels_of_what_a_vehicle_does_not_have_are_refused_together():
    channels = {
        "a": "Q:5:left", "b": "Q:4:right", "c": "sensor_acceleration:nowhere:z", "d": "speed",
        "e": "element_force:nothing:z", "f": "Q:1:middle",
    }  # fmt: skip
    coach = load_vehicle("coach_manchester")
    with pytest.raises(InputError) as refused:
        check_channels("m.toml", SimpleNamespace(quantities=channels), coach)
    keys = [fault.key.split(".")[1] for fault in refused.value.faults]
    assert keys == ["a", "c", "e", "f"]


@pytest.mark.parametrize(("known", "fine"), [([0, 40], True), ([7], False), ([], False)])
def test_a_speed_is_a_line_through_two_values_at_least(known, fine):
    how = SimpleNamespace(speed=None, start=0.0)
    written = np.full(len(TIME), np.nan)
    written[known] = 20.0 + 0.5 * TIME[known]
    if not fine:
        with pytest.raises(InputError, match="no values; a channel with values"):
            position("made", how, TIME, {"speed": written}, None)
        return
    _, speed, _ = position("made", how, TIME, {"speed": written}, None)
    last = TIME[known[-1]]
    assert speed == pytest.approx(20.0 + 0.5 * np.minimum(TIME, last))
