"""Values of a section, all criteria at once, of forces and accelerations that are sums of tones.

A tone passes a zero-phase Butterworth filter with its gain alone, so that every filtered signal is
known in closed form; percentiles and means over distance are taken of that.
"""

import gc
import weakref
from unittest.mock import Mock

import numpy as np
import pytest
from example_result import BODIES, OFFSETS
from made_record import FINE, Q0, curve, made, track
from scipy import signal
from selection import points

from railsim.assessment.criteria import CRITERIA, steering
from railsim.assessment.en14363 import section_values
from railsim.assessment.record import Record
from railsim.assessment.sections import TestSection
from railsim.assessment.signals import Signals, wheel_load

RATE, G = 1000.0, 9.81
TONES = np.array([0.2, 0.9, 3.1, 5.3, 8.7, 13.0, 21.0])  # Hz
OUT = (-1.0, 1.0)  # outwards, of the left and the right rail
FORCE, RIDE = (None, 20.0), (0.4, 10.0)
F0 = 4.6
SENSORS = {  # body, place before the middle and below the centre of gravity [m]
    "floor_front": (0, 9.5, -1.2 + 1.8), "floor_middle": (0, 0.0, -1.2 + 1.8),
    "floor_rear": (0, -9.5, -1.2 + 1.8),
    **{f"frame_{k + 1}": (1 + k // 2, x, 0.0) for k, x in enumerate(OFFSETS)},
}  # fmt: skip


class Tones:
    """Signals float64[..., tone] of an amplitude, a phase and a mean each."""

    def __init__(self, seed, shape, mean, size, tones=TONES):
        random, self.tones = np.random.default_rng(seed), tones
        self.mean = mean + 0.1 * size * random.normal(size=shape)
        self.size = size * random.uniform(0.3, 1.0, (*shape, len(TONES)))
        self.phase = random.uniform(0.0, 2.0 * np.pi, (*shape, len(TONES)))

    def __call__(self, t, band=None, of=...):
        """At times float64[n], float64[n, ...]; `of`: of some of the signals."""
        size, phase, mean = self.size[of], self.phase[of], self.mean[of]
        waves = np.repeat(mean[None] * gain(np.zeros(1), band), len(t), axis=0)
        for k, (f, passed) in enumerate(zip(self.tones, gain(self.tones, band), strict=True)):
            turns = 2.0 * np.pi * f * t.reshape(-1, *(1 for _ in mean.shape))
            waves += passed * size[..., k] * np.sin(turns + phase[..., k])
        return waves


def gain(f, band):
    """Of the analogue filter of order 4, by scipy."""
    if band is None:
        return np.ones(len(f))
    low, high = band
    corners, kind = (high, "lowpass") if low is None else ((low, high), "bandpass")
    b, a = signal.butter(4, 2.0 * np.pi * np.array(corners), kind, analog=True)
    return np.abs(signal.freqs(b, a, 2.0 * np.pi * f)[1])


Y, Q, T = Tones(1, (4, 2), 3e3, 4e3), Tones(2, (4, 2), Q0, 3e3), Tones(3, (4, 2), 200.0, 9.0)
A = Tones(4, (len(BODIES), 3), 0.3, 0.2)


def run(turn, speed):
    straight = [{"type": "STR", "length": 700.0}]
    on = (
        track(*curve(300.0 * turn, 440.0, 40.0, 40.0), cant=0.12 * turn)
        if turn
        else track(*straight)
    )
    given = {"Y": lambda t, s: Y(t), "Q": lambda t, s: Q(t), "T_gamma": lambda t, s: T(t)}
    return Record(made(on, speed, accelerations=A, **given, **FINE), "made")


def reading(name, t, band, turn, speed):
    """Acceleration less gravity at a sensor of a body that stays in the axes of the track."""
    body, x, z = SENSORS[name]
    phi = np.arcsin(0.12 * turn / 1.5)
    omega = speed * turn / 300.0 * np.array([0.0, np.sin(phi), np.cos(phi)])
    still = np.cross(omega, np.cross(omega, [x, 0.0, z])) if turn else np.zeros(3)
    still -= G * np.array([0.0, np.sin(phi), np.cos(phi) - 1.0])
    return A(t, band, body) + still * gain(np.zeros(1), band)


class Expected:
    """Values of one section by criterion and place."""

    def __init__(self, section, turn, speed):
        self.section, self.turn, self.speed = section, turn, speed
        self.names = {0: "left", 1: "right"}
        if turn:
            self.names = {0: "outer", 1: "inner"} if turn > 0 else {0: "inner", 1: "outer"}

    def times(self, offset):
        t = np.arange(60_000) / RATE
        s = self.speed * t + offset
        return t[(s >= self.section.begin) & (s <= self.section.end)]

    def windows(self, of, offset, length=2.0, step=0.5):
        """Means over windows, by Gauss and Legendre's formula."""
        first, last = self.section.begin + 0.5 * length, self.section.end - 0.5 * length
        centres = np.arange(first, last + 1e-6, step)
        places, weights = np.polynomial.legendre.leggauss(16 if length < 10.0 else 200)
        t = (centres[:, None] + 0.5 * length * places - offset) / self.speed
        return of(t.ravel()).reshape(t.shape) @ weights / 2.0

    def ends(self, x, sense):
        if sense:
            return [np.percentile(sense * x, 99.85)]
        return [-np.percentile(x, 0.15), np.percentile(x, 99.85)]

    def of_wheels(self):
        found, turn = {}, self.turn
        for w, offset in enumerate(OFFSETS):
            t, place = self.times(offset), f"wheelset {w + 1}"
            moved = self.windows(lambda t, w=w: Y(t, FORCE, w).sum(axis=-1), offset)
            found["sum_Y", place] = self.ends(moved, -turn)
            for side in (0, 1):
                own = f"{place} {self.names[side]}"
                y, q = OUT[side] * Y(t, FORCE, (w, side)), Q(t, FORCE, (w, side))
                found["Q_low", own] = [np.percentile(q, 0.15)]
                if self.names[side] == "inner":
                    found["Y_over_Q_inner", own] = [np.mean(y / q)]
                    continue
                both = np.abs(y) + 0.83 * np.abs(q)
                found["Q", own] = [np.percentile(q, 99.85)]
                found["Y_max", own] = [np.percentile(y, 99.85)]
                found["B_max", own] = [np.percentile(both, 99.85)]
                if turn:
                    found["Q_qst", own] = [np.median(q)]
                    found["Y_qst", own] = [np.median(y)]
                    found["B_qst", own] = [np.median(both)]
                    found["T_qst", own] = [np.median(T(t, None, (w, side)))]

                    def over(t, w=w, side=side):
                        return OUT[side] * Y(t, FORCE, (w, side)) / Q(t, FORCE, (w, side))

                    found["Y_over_Q", own] = [np.percentile(self.windows(over, offset), 99.85)]
        for name, columns in (("front", slice(0, 2)), ("rear", slice(2, 4))):
            q = Q(self.times(OFFSETS[columns].mean()), (None, 1.5), columns).sum(axis=1)
            share = (q[:, 0] - q[:, 1]) / q.sum(axis=1)
            moved = turn * share if turn else np.abs(share)
            found["overturning", name] = [np.percentile(moved, 99.85)]
        return found

    def of_sensors(self):
        found, turn = {}, self.turn
        for name, (_, x, _) in SENSORS.items():
            t = self.times(x)

            def read(band, axis, name=name, t=t):
                return reading(name, t, band, turn, self.speed)[:, axis]

            if name.startswith("frame"):
                found["frame_y", name] = self.ends(read((None, 10.0), 1), turn)
                continue
            y = read(RIDE, 1)
            found["body_y_safety", name] = self.ends(read((None, 6.0), 1), turn)
            found["body_z_safety", name] = self.ends(read((0.4, 4.0), 2), 0)
            found["body_y", name] = self.ends(turn * y if turn else y, 0)
            found["body_z", name] = self.ends(read(RIDE, 2), 0)
            found["body_y_rms", name] = [np.sqrt(np.mean(y**2))]
            found["body_z_rms", name] = [np.sqrt(np.mean(read(RIDE, 2) ** 2))]
            if turn:
                found["body_y_qst", name] = [np.median(turn * read(FORCE, 1))]
        return found

    def of_instability(self):
        """Largest rms over 100 m, every 10 m, of what is within 2 Hz of the frequency."""
        found, band = {}, (F0 - 2.0, F0 + 2.0)
        length = min(100.0, self.section.end - self.section.begin)
        for w, offset in enumerate(OFFSETS):

            def square(t, w=w):
                return Y(t, band, w).sum(axis=-1) ** 2

            def of_frame(t, w=w):
                return reading(f"frame_{w + 1}", t, band, self.turn, self.speed)[:, 1] ** 2

            both = ("instability", f"wheelset {w + 1}"), ("frame_instability", f"frame_{w + 1}")
            for key, of in zip(both, (square, of_frame), strict=True):
                found[key] = [np.sqrt(np.max(self.windows(of, offset, length, 10.0)))]
        return found


@points(
    ("turn", "zone", "speed", "begin", "length"),
    [(1, "4", 23.0, 265.0, 70.0), (-1, "4", 23.0, 265.0, 70.0), (0, "1", 23.0, 270.0, 160.0)],
    always=(1, 2),
)
def test_every_value_of_a_section_is_that_of_its_filtered_tones(turn, zone, speed, begin, length):
    radius = 300.0 * turn if turn else np.inf
    section = TestSection(zone, begin, begin + length, radius, 0.1, speed)
    (found,) = section_values(run(turn, speed), [section], f0=F0)
    expected = Expected(section, turn, speed)
    wanted = expected.of_wheels() | expected.of_sensors()
    wanted |= {} if turn else expected.of_instability()
    values = {key: value for key, value in found.values.items() if key[0] != "steering"}
    assert values.keys() == wanted.keys()
    if turn:  # no criterion is without a value here, but for these three
        without = {"steering", "instability", "frame_instability"}
        assert {name for name, _ in wanted} == CRITERIA.keys() - without
    scales = {"N": 1e4, "kN": 1e4, "m/s2": 0.5, "-": 0.1}
    for key, value in values.items():
        near = 1e-3 * scales[CRITERIA[key[0]].unit]
        assert value == pytest.approx(wanted[key], rel=1e-3, abs=near), key


@pytest.mark.parametrize(("speed", "begin"), [(20.0, 60.0 + 10.78), (5.0, 2 * 10.78 + 10.78)])
def test_a_record_covers_what_the_whole_vehicle_passed_after_the_start(speed, begin):
    """Axles 10.78 m ahead and behind; after 3 s, and where the last one was the first had been.

    The last instant, which may lie between two outputs, does not count.
    """
    record = Record(made(track({"type": "STR", "length": 200.0}), speed, **FINE), "run")
    assert record.covered_range() == pytest.approx((begin, 200.0 - speed / RATE - 10.78))


def test_signals_of_a_part_need_no_search_for_garbage():
    """A campaign would hold all that it has filtered: commands search seldom for garbage."""
    record = Record(made(track({"type": "STR", "length": 200.0}), 20.0, **FINE), "run")
    signals = Signals(record, 80.0, 150.0, f0=None, causal=False)
    kept = signals.signal(wheel_load, FORCE)
    assert signals.signal(wheel_load, FORCE) is kept
    assert signals.filtered("Q", FORCE) is signals.filtered("Q", FORCE)
    gone = weakref.ref(signals)
    gc.disable()
    try:
        del signals
        assert gone() is None
    finally:
        gc.enable()


def test_steering_index_is_that_of_the_gauge_in_the_middle_of_the_section():
    """Both rails moved apart: 6 and 4 mm at 300 m, nothing at 200 m; the middle is at 250 m."""
    widening = [[200.0, 0.0, 0.0], [300.0, 6e-3, 4e-3]]
    on = track({"type": "CIR", "length": 400.0, "radius": 300.0}).replace(gauge_widening=widening)
    record = Record(made(on, 20.0, **FINE), "run")
    asked = []
    record.geometry_with = asked.append
    section = TestSection("4", 220.0, 280.0, 300.0, 0.1, 20.0)
    assert steering(Mock(record=record), section) == {}
    assert asked == [pytest.approx(5e-3)]
