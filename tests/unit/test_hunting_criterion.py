"""What is called hunting: a limit cycle, in records made up for the purpose.

Responses to random rails are those of a linear oscillator to white noise, solved exactly from
sample to sample; its amplitude follows Rayleigh's distribution (Rice 1944).
"""

import numpy as np
import pytest

from railsim.notation import QUANTITIES
from railsim.result import Result
from railsim.result.hunting import SEEN, hunting

RATE, SPEED, FREQUENCY = 200.0, 40.0, 5.0
COORDINATES = {"wheelset": ("1", "2", "3", "4")}
PUSH = 4e6  # N/m, force on the track per displacement


def record(lateral, sum_Y=None, rate=RATE):
    """Result of one vehicle whose wheelsets all, or each, move like this."""
    lateral = np.asarray(lateral, dtype=float)
    lateral = lateral if lateral.ndim == 2 else np.repeat(lateral[:, None], 4, axis=1)
    time = np.arange(len(lateral)) / rate
    arrays = {
        "time": time,
        "distance": SPEED * time,
        "wheelset_distance": (SPEED * time)[:, None] + np.array([10.0, 8.0, -8.0, -10.0]),
        "wheelset_lateral": lateral,
        "sum_Y": PUSH * lateral if sum_Y is None else sum_Y,
    }
    return Result(arrays, {name: QUANTITIES[name] for name in SEEN}, COORDINATES, {})


def times(duration, rate=RATE):
    return np.arange(round(duration * rate)) / rate


def wave(time, frequency=FREQUENCY):
    return np.sin(2.0 * np.pi * frequency * time)


def response(damping, duration, seed, frequency=FREQUENCY):
    """Displacement of an oscillator under white noise, standard deviation 1."""
    w = 2.0 * np.pi * frequency
    pole = np.exp((-damping + 1j * np.sqrt(1.0 - damping**2)) * w / RATE)
    noise = np.random.default_rng(seed).standard_normal(round(duration * RATE))
    from scipy.signal import lfilter

    y = lfilter([1.0], np.real([1.0, -(pole + pole.conjugate()), abs(pole) ** 2]), noise)
    return y / y.std()


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
@pytest.mark.parametrize(("frequency", "amplitude"), [(0.9, 20e-3), (4.8, 7.4e-3), (7.3, 0.3e-3)])
def test_a_steady_swing_is_told_with_frequency_amplitude_and_wheelsets(rate, frequency, amplitude):
    found = hunting(record(amplitude * wave(times(40.0, rate), frequency), rate=rate))
    assert found.frequency == pytest.approx(frequency, rel=0.01)
    assert found.amplitude == pytest.approx(amplitude, rel=0.03)
    assert found.wheelsets == (0, 1, 2, 3)
    assert found.lasts


@pytest.mark.parametrize("frequency", [0.5, 15.0])
def test_at_both_ends_of_the_band_a_swing_is_told_with_half_of_its_power(frequency):
    found = hunting(
        record(5e-3 * wave(times(40.0 / frequency + 20.0, 400.0), frequency), rate=400.0)
    )
    assert found.frequency == pytest.approx(frequency, rel=0.01)
    assert found.amplitude == pytest.approx(5e-3 / np.sqrt(2.0), rel=0.03)


def test_the_sentence_says_where_it_begins():
    time = times(20.0)
    sentence = hunting(record(7.4e-3 * wave(time, 4.8) * (time > 7.5))).sentence
    assert sentence == "The vehicle hunts at 4.8 Hz, 7.4 mm, wheelsets 1 to 4, from s = 300 m."


def test_the_sentence_says_where_it_ends_and_names_single_wheelsets():
    time = times(20.0)
    lateral = np.zeros((len(time), 4))
    lateral[:, 1] = 5e-3 * wave(time) * ((time > 2.0) & (time < 10.0))
    found = hunting(record(lateral))
    assert found.wheelsets == (1,)
    assert "wheelset 2, from s = 8" in found.sentence
    assert found.sentence.endswith(f"to {SPEED * 10.0:.0f} m.")
    lateral[:, 3] = lateral[:, 1]
    assert "wheelsets 2 and 4" in hunting(record(lateral)).sentence


def test_a_limit_cycle_is_found_on_irregular_rails():
    """A third of its amplitude at random beside it, of another frequency."""
    time = times(30.0)
    lateral = 6e-3 * wave(time) + 0.7e-3 * response(0.2, 30.0, seed=3, frequency=2.0)
    found = hunting(record(lateral))
    assert found.amplitude == pytest.approx(6e-3, rel=0.1)


@pytest.mark.parametrize("damping", [0.02, 0.10])
def test_the_response_to_random_rails_is_no_hunting(damping):
    """Four wheelsets over 12 000 cycles each."""
    lateral = [3e-3 * response(damping, 2400.0, seed) for seed in range(4)]
    assert hunting(record(np.stack(lateral, axis=-1))) is None


@pytest.mark.parametrize("damping", [0.003, 0.05])
def test_an_oscillation_that_decays_is_no_hunting(damping):
    time = times(30.0)
    decaying = 6e-3 * wave(time) * np.exp(-2.0 * np.pi * FREQUENCY * damping * time)
    assert hunting(record(decaying)) is None


def test_a_displacement_without_its_force_is_no_hunting():
    lateral = 6e-3 * wave(times(30.0))
    noise = 1e4 * np.random.default_rng(1).standard_normal((len(lateral), 4))
    assert hunting(record(lateral, sum_Y=noise)) is None


@pytest.mark.parametrize("lateral", [np.zeros(4000), np.full(4000, 6e-3), [], [0.0, 1e-3]])
def test_rest_and_records_of_no_length_are_no_hunting(lateral):
    assert hunting(record(lateral)) is None


def test_waves_of_one_length_are_followed():
    """As regular as a limit cycle, but the rails below are as well; random ones are not."""
    length = SPEED / FREQUENCY

    def waves(s):
        moved = 1e-3 * np.sin(2.0 * np.pi * s / length)
        return np.stack([moved, 0.0 * s, moved, 0.0 * s]), np.zeros((4, len(s)))

    def random(s):
        moved = np.interp(s, np.arange(-50.0, 2000.0), rough)
        return np.stack([moved, 0.0 * s, moved, 0.0 * s]), np.zeros((4, len(s)))

    rough = 1e-3 * np.random.default_rng(2).standard_normal(2050)
    swinging = record(6e-3 * wave(times(30.0)))
    assert hunting(swinging, waves) is None
    assert hunting(swinging, random).wheelsets == (0, 1, 2, 3)


@pytest.mark.parametrize(("amplitude", "ratio", "hunts"), [
    (0.09e-3, 1.0, False), (0.11e-3, 1.0, True), (6e-3, 0.86, False), (6e-3, 0.94, True),
])  # fmt: skip
def test_a_limit_cycle_has_a_tenth_of_a_millimetre_and_keeps_nine_tenths(amplitude, ratio, hunts):
    """Of 30 cycles of 0.2 s the second half is 3 s behind the first."""
    time = times(30.0)
    found = hunting(record(amplitude * wave(time) * ratio ** (time / 3.0)))
    assert (found is not None) == hunts


@pytest.mark.parametrize(("rate", "hunts"), [(28.0, False), (34.0, True)])
def test_a_cycle_of_fewer_than_six_instants_is_not_judged(rate, hunts):
    found = hunting(record(6e-3 * wave(times(30.0, rate)), rate=rate))
    assert (found is not None) == hunts


def test_the_farthest_wheelset_gives_frequency_and_amplitude():
    """What swings less than half as far does not hunt; 1 s before the end all is over."""
    time = times(20.0)
    swings = time < 19.0
    waves = wave(time, 4.0), wave(time), 0.6 * wave(time), 0.4 * wave(time)
    amplitudes = np.array([4e-3, 6e-3, 6e-3, 6e-3])
    found = hunting(record(np.stack(waves, axis=-1) * amplitudes * swings[:, None]))
    assert found.frequency == pytest.approx(5.0, rel=0.01)
    assert found.amplitude == pytest.approx(6e-3, rel=0.03)
    assert found.wheelsets == (0, 1, 2)
    assert not found.lasts


@pytest.mark.parametrize("right", [-1.0, 1.0])
def test_waves_of_the_cross_level_are_followed_and_those_of_the_level_not(right):
    def waves(s):
        moved = 1e-3 * np.sin(2.0 * np.pi * s / (SPEED / FREQUENCY))
        return np.stack([0.0 * s, moved, 0.0 * s, right * moved]), np.zeros((4, len(s)))

    found = hunting(record(6e-3 * wave(times(30.0))), waves)
    assert (found is None) == (right < 0.0)
