"""Hunting: limit cycles of wheelsets, distinguished from their response to irregular rails.

A vehicle hunts where its wheelsets swing by themselves, across the track and with their force on
it, with an amplitude that neither the rails nor the start decide.  The criterion, wheelset by
wheelset:

- displacement and sum_Y are band-passed, `LOW` to `HIGH`; a cycle lies between two rising zeros of
  the displacement, its amplitudes are those of the first harmonic over this time;
- over `CYCLES` cycles in a row its length and both amplitudes are regular: standard deviation over
  mean `REGULAR` at most.  The response of a linear vehicle to random rails is a narrow-band normal
  process, whose amplitude follows Rayleigh's distribution (Rice 1944), 0.52 over many cycles; of
  oscillators with a damping ratio of 0.02 no 30 cycles of 48 000 are so regular, with 0.01 a few
  are, 1 % below instability.  Limit cycles on irregular rails have 0.02 to 0.09;
- the amplitude is `LEAST` at least and does not fade: the second half of the cycles has `FADES` of
  the first at least;
- the irregularity under the wheelset is not as regular over these cycles (`SAME_WAVES`): on waves
  of one length a vehicle follows the rails.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from railsim.arrays import Floats
from railsim.result.data import Result
from railsim.result.filters import band_passed

LOW, HIGH = 0.5, 15.0  # Hz
CYCLES = 30
REGULAR = 0.12
FADES = 0.9
LEAST = 0.1e-3  # m
# quartiles of the amplitudes of an irregularity's waves: distance over median, 0.77 of a random
# one; and their size, over that of the swing
SAME_WAVES, OF_SWING = 0.35, 0.01
RATE = 100.0  # samples per second that are enough
PER_CYCLE = 6  # samples per cycle at least
TOO = 0.5  # a wheelset hunts, too, that swings this share of the farthest one

HUNTS = "The vehicle hunts"  # how the sentence begins

SEEN = ("time", "distance", "wheelset_distance", "wheelset_lateral", "sum_Y", "xi_x")
"""Quantities that are looked at; `xi_x` by the remark on wheels that slide."""

Rails = Callable[[Floats], tuple[Floats, Floats]]
"""Arc lengths to displacements of the rails (y_left, z_left, y_right, z_right) and their rates."""


@dataclass(frozen=True)
class Hunting:
    """A limit cycle.

    `frequency`, `amplitude`: Of the wheelset that swings farthest to the side, over its largest
    cycles [Hz], [m]. `begin`, `end`: Where the reference body is when the first one begins and the
    last one ends [m].
    """

    frequency: float
    amplitude: float
    wheelsets: tuple[int, ...]  # which wheelsets swing, from 0
    begin: float
    end: float
    lasts: bool  # whether they swing until the record ends

    @property
    def sentence(self) -> str:
        """Remark for the reader of a result.

        >>> Hunting(4.8, 7.4e-3, (0, 1, 2, 3), 300.0, 900.0, True).sentence
        'The vehicle hunts at 4.8 Hz, 7.4 mm, wheelsets 1 to 4, from s = 300 m.'
        """
        first, *_, last = numbers = [w + 1 for w in (*self.wheelsets, *self.wheelsets[-1:])]
        wheelsets = f"wheelsets {', '.join(map(str, numbers[:-2]))} and {last}"
        if len(self.wheelsets) == 1:
            wheelsets = f"wheelset {first}"
        elif len(self.wheelsets) == last - first + 1 > 2:
            wheelsets = f"wheelsets {first} to {last}"
        until = "" if self.lasts else f" to {self.end:.0f} m"
        return (
            f"{HUNTS} at {self.frequency:.1f} Hz, {1e3 * self.amplitude:.1f} mm, {wheelsets}, "
            f"from s = {self.begin:.0f} m{until}."
        )


def thinned(chunk: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return what `hunting` looks at of a chunk of a run, at `RATE` or a little above."""
    time = chunk["time"]
    step = float(time[1] - time[0]) if len(time) > 1 else math.inf
    every = max(1, int(1.0 / (RATE * step)))
    return {name: chunk[name][::every] for name in SEEN}


def hunting(record: Result, rails: Rails | None = None) -> Hunting | None:
    """Return the limit cycle of a vehicle; None where it does not hunt.

    `record`: Result with the quantities `SEEN`. `rails`: Irregularities of the track, see
    `railsim.track.irregularity.displacement`.
    """
    time = record["time"]
    duration = float(time[-1] - time[0]) if len(time) else 0.0
    if duration < CYCLES / HIGH or np.max(np.ptp(record["wheelset_lateral"], axis=0)) < LEAST:
        return None
    rate = min(RATE, (len(time) - 1) / duration)
    grid = np.arange(time[0], time[-1], 1.0 / rate)

    def on_grid(name: str) -> Floats:
        columns = record[name].reshape(len(time), -1).T
        return np.stack([np.interp(grid, time, column) for column in columns], axis=-1)

    def band(values: Floats) -> Floats:
        return band_passed(values, rate, LOW, min(HIGH, 0.4 * rate))

    lateral = band(on_grid("wheelset_lateral"))
    cycles_of = [_Cycles(swing) for swing in lateral.T]
    if not any(np.any(cycles.regular()) for cycles in cycles_of):  # most runs
        return None
    force = band(on_grid("sum_Y"))
    cycling: list[tuple[float, float, int, int]] = []  # amplitude, cycles per sample, begin, end
    for w, cycles in enumerate(cycles_of):
        swing = cycles.amplitudes(lateral[:, w])
        hunts = cycles.regular() & _regular(swing) & _regular(cycles.amplitudes(force[:, w]))
        hunts &= _lasting(swing)
        if rails is not None and np.any(hunts):
            y_left, z_left, y_right, z_right = rails(on_grid("wheelset_distance")[:, w])[0]
            for wave in (0.5 * (y_left + y_right), 0.5 * (z_right - z_left)):
                hunts &= ~_same_waves(cycles.amplitudes(band(wave)), swing)
        windows = np.flatnonzero(hunts)
        if len(windows):
            most = windows[np.argmax(_mean(swing)[windows])]
            begin, end = cycles.starts[windows[0]], cycles.starts[windows[-1] + CYCLES]
            largest = float(_mean(swing)[most]), 1.0 / float(_mean(cycles.lengths)[most])
            cycling.append((*largest, int(begin), int(end)))
    if not cycling:
        return None
    amplitude, frequency, *_ = max(cycling)
    begin, end = min(cycle[2] for cycle in cycling), max(cycle[3] for cycle in cycling)
    swings = np.std(lateral[begin:end], axis=0)
    way = on_grid("distance")[[begin, min(end, len(grid) - 1)], 0]
    hunt = tuple(np.flatnonzero(swings >= TOO * np.max(swings)).tolist())
    lasts = end >= len(grid) - 2.0 / frequency
    return Hunting(frequency * rate, amplitude, hunt, float(way[0]), float(way[1]), lasts)


class _Cycles:
    """Cycles of a record between its rising zeros.

    `starts` (int64[n + 1]): Where they begin, and where the last one ends. `lengths` (float64[n]):
    In samples.
    """

    def __init__(self, swing: Floats) -> None:
        self.starts = np.flatnonzero((swing[:-1] < 0.0) & (swing[1:] >= 0.0)) + 1
        self.lengths = np.diff(self.starts).astype(np.float64)

    def amplitudes(self, record: Floats) -> Floats:
        if not len(self.lengths):
            return np.zeros(0)
        first, last = self.starts[0], self.starts[-1]
        number = np.repeat(np.arange(len(self.lengths)), np.diff(self.starts))
        turns = (np.arange(first, last) - self.starts[number]) / self.lengths[number]
        harmonic = record[first:last] * np.exp(-2j * np.pi * turns)
        return np.asarray(
            2.0 * np.abs(np.add.reduceat(harmonic, self.starts[:-1] - first)) / self.lengths
        )

    def regular(self) -> Any:
        """Whether the cycles of each window are of one length, and seen often enough."""
        return _regular(self.lengths) & (_mean(self.lengths) >= PER_CYCLE)


def _windows(values: Floats) -> Floats:
    """Windows of `CYCLES` values, none where there are fewer."""
    if len(values) < CYCLES:
        return np.zeros((0, CYCLES))
    return sliding_window_view(values, CYCLES)


def _mean(values: Floats) -> Any:
    return _windows(values).mean(axis=1)


def _regular(values: Floats) -> Any:
    """Whether the values of each window scatter by a share `REGULAR` of their mean at most."""
    return _windows(values).std(axis=1) <= REGULAR * _mean(values)


def _same_waves(forced: Floats, swing: Floats) -> Any:
    """Whether irregularities of `forced` have waves of one amplitude in most of each window."""
    low, middle, high = np.percentile(_windows(forced), (25.0, 50.0, 75.0), axis=1)
    return (high - low <= SAME_WAVES * middle) & (middle > OF_SWING * _mean(swing))


def _lasting(swing: Floats) -> Any:
    """Whether the amplitude is large enough in each window, and does not fade."""
    windows = _windows(swing)
    before, after = windows[:, : CYCLES // 2].mean(axis=1), windows[:, CYCLES // 2 :].mean(axis=1)
    return (0.5 * (before + after) >= LEAST) & (after >= FADES * before)
