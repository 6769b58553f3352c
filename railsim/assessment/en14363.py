"""Running tests after EN 14363 (2016 with A2:2022) and UIC 518: section values of a run.

Filters and section values (order 4, zero phase by default):

====================================  ================  ==============  =====================
quantity                              filter            then            value of a section
====================================  ================  ==============  =====================
``sum_Y``, ``Y_over_Q``               low pass 20 Hz    2 m mean        0.15 and 99.85 %
``Q``, ``Q_low``                      low pass 20 Hz                    99.85 %; 0.15 %
``Y_max``, ``B_max``                  low pass 20 Hz                    99.85 %
``Y_qst``, ``Q_qst``, ``B_qst``,      low pass 20 Hz                    50 %
``T_qst``, ``body_y_qst``
``overturning``                       low pass 1.5 Hz                   99.85 %
``body_y``, ``body_z``, ``..._rms``   0.4 to 10 Hz                      0.15, 99.85 %; rms
``body_y_safety``                     low pass 6 Hz                     0.15, 99.85 %
``body_z_safety``                     0.4 to 4 Hz                       0.15, 99.85 %
``frame_y``                           low pass 10 Hz                    0.15, 99.85 %
``instability``                       f0 +- 2 Hz        rms over 100 m  largest
====================================  ================  ==============  =====================

Y/Q: both forces are filtered, divided, then averaged.  Where the filtered Q <= 0 the wheel is
lifted: Y/Q has no value there, its percentile is that of the other windows, and the length over
which the wheel is lifted is kept for the verdict.  B = |Y| + 0.83 |Q|.  Signs: in curves an outward
force is positive, and so is the lateral acceleration with cant deficiency; the outer wheel is
assessed; left and right curves are pooled.  On straight track both percentiles of a signed quantity
are values.  A window of 2 m lies within its section.  The instability is judged in zones 1 and 2;
its window has the length of the section where this is shorter than 100 m, and f0 is that of the
vehicle, see `hunting_frequency`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from railsim.assessment.record import Record
from railsim.assessment.safety import overturning
from railsim.assessment.sections import TestSection
from railsim.result.filters import Floats, band_passed, distance_means, low_passed, window_centres

LOW, HIGH = 0.15, 99.85
FORCE_FILTER = 20.0  # Hz
MEAN, STEP = 2.0, 0.5  # m
RIDE = (0.4, 10.0)  # Hz
SAFETY_Y, SAFETY_Z, FRAME = 6.0, (0.4, 4.0), 10.0  # Hz
HALF_BAND, LOWEST = 2.0, 0.4  # Hz, of the instability filter
HUNTING = (0.4, 20.0)  # Hz, range of the dominant frequency
FREQUENCIES = np.arange(HUNTING[0], HUNTING[1], 0.01)  # Hz, of mean spectra
HUNTING_ZONES = ("1", "2")
ROLLING_OVER = 1.5  # Hz
RAIL_LOADING = 0.83  # B = |Y| + 0.83 |Q|
RMS_LENGTH, RMS_STEP = 100.0, 10.0  # m
MARGIN = 16.0  # s on either side of a part, for the filter of 0.4 Hz
LONGEST = 60.0  # s, duration of the sections that are evaluated together

NEEDED = ("Q", "Y", "wheelset_distance")
Key = tuple[str, str]


@dataclass
class SectionValues:
    """Values of one section.

    Attributes
    ----------
    section : TestSection
    values : dict
        By quantity and wheelset, wheel or sensor: one value, or both percentiles on straight track
        [SI].
    lifted : dict
        Length without load by wheel [m].
    frequencies : dict
        Middle of the band of the instability by wheelset [Hz].
    """

    section: TestSection
    values: dict[Key, list[float]] = field(default_factory=dict)
    lifted: dict[str, float] = field(default_factory=dict)
    frequencies: dict[str, float] = field(default_factory=dict)


def section_values(
    record: Record,
    sections: Sequence[TestSection],
    *,
    f0: float | None = None,
    causal: bool = False,
) -> list[SectionValues]:
    """Values of the given sections of a run.

    Parameters
    ----------
    record : Record
        Run with all that is `NEEDED`, and accelerations or body motions.
    sections : sequence of TestSection
        In the order of the track.
    f0 : float, optional
        Frequency of the instability [Hz]; without it the instability is not judged.
    causal : bool
        Use causal filters, as in a measuring amplifier, instead of zero-phase filters.
    """
    found = []
    for group in _stretches(sections):
        part = _Part(record, group[0].begin, group[-1].end, causal=causal)
        for section in group:
            values = SectionValues(section)
            _forces(part, values)
            _overturning(part, values)
            if f0 is not None and section.zone in HUNTING_ZONES:
                _instability(part, values, f0)
            _accelerations(part, values)
            found.append(values)
    return found


def _stretches(sections: Sequence[TestSection]) -> list[list[TestSection]]:
    """Neighbouring sections that are read and filtered together."""
    groups: list[list[TestSection]] = []
    for section in sections:
        last = groups[-1] if groups else None
        if (
            last
            and section.begin - last[-1].end < 1.0
            and section.turn == last[-1].turn
            and (section.end - last[0].begin) / section.speed <= LONGEST
        ):
            last.append(section)
        else:
            groups.append([section])
    return groups


class _Part:
    """Filtered signals of a part of a run."""

    def __init__(self, record: Record, begin: float, end: float, *, causal: bool) -> None:
        self.record, self.causal = record, causal
        rows = record.rows_between(begin, end, MARGIN)
        rate = self.rate = record.rate
        self.wheelsets = range(len(record.offsets))
        self.s_wheelset = record.result.part("wheelset_distance", rows)
        inner = self._near(record, begin, end, rows)
        Q = record.result.part("Q", rows)
        Y = record.result.part("Y", rows)
        self.sum_Y_raw = Y.sum(axis=-1)
        n = Q.shape[1]
        both = np.concatenate([Q.reshape(len(Q), -1), Y.reshape(len(Y), -1)], axis=1)[inner]
        both = low_passed(both, rate, FORCE_FILTER, causal=causal)
        self.Q = both[:, : 2 * n].reshape(-1, n, 2)
        self.Y = both[:, 2 * n :].reshape(-1, n, 2)
        known = "T_gamma" in record.result
        self.T_gamma = record.result.part("T_gamma", rows)[inner] if known else None
        self.rolling_over = self._overturning(Q)[inner]
        self.s_forces = self.s_wheelset[inner]
        self.sum_Y = self.Y.sum(axis=-1)
        self._accelerations(record, rows, inner)

    def _overturning(self, Q: Floats) -> Floats:
        """Overturning coefficient of each bogie."""
        bogies: dict[str, list[int]] = {}
        for w, name in enumerate(self.record.result.wheelsets):
            bogies.setdefault(name.split(".")[0], []).append(w)
        self.bogies = bogies
        low = low_passed(Q.reshape(len(Q), -1), self.rate, ROLLING_OVER, causal=self.causal)
        low = low.reshape(Q.shape)
        return np.stack([overturning(low[:, own]) for own in bogies.values()], axis=-1)

    def _near(self, record: Record, begin: float, end: float, rows: slice) -> slice:
        """Rows of this part with a margin that suffices for 20 Hz."""
        near = record.rows_between(begin, end, 0.5)
        return slice(near.start - rows.start, near.stop - rows.start)

    def _accelerations(self, record: Record, rows: slice, inner: slice) -> None:
        names = list(record.sensors)
        self.floor = [k for k, name in enumerate(names) if not name.startswith("frame_")]
        self.frames = [k for k, name in enumerate(names) if name.startswith("frame_")]
        self.names = names
        self.s_sensor = {k: record.distance[rows] + record.sensor_offset(name)
                         for k, name in enumerate(names)}  # fmt: skip
        self.inner = inner
        if not names:
            return
        a = record.readings(rows)[0]
        rate, causal = self.rate, self.causal
        y, z = a[:, self.floor, 1], a[:, self.floor, 2]
        self.ride_y = band_passed(y, rate, *RIDE, causal=causal)
        self.ride_z = band_passed(z, rate, *RIDE, causal=causal)
        self.safety_z = band_passed(z, rate, *SAFETY_Z, causal=causal)
        self.qst_y = low_passed(y[inner], rate, FORCE_FILTER, causal=causal)
        near = slice(max(0, inner.start - round(rate)), inner.stop + round(rate))
        short = slice(inner.start - near.start, inner.stop - near.start)
        self.safety_y = low_passed(y[near], rate, SAFETY_Y, causal=causal)[short]
        self.frame_y = low_passed(a[near][:, self.frames, 1], rate, FRAME, causal=causal)[short]


def _between(s: Floats, begin: float, end: float) -> slice:
    return slice(int(np.searchsorted(s, begin)), int(np.searchsorted(s, end, side="right")))


def _around(s: Floats, begin: float, end: float) -> slice:
    """Rows from the last before `begin` to the first after `end`, for means over distance."""
    inside = _between(s, begin, end)
    return slice(max(0, inside.start - 1), min(len(s), inside.stop + 1))


def _signed(values: Floats, sign: int, percentiles: Sequence[float] = (LOW, HIGH)) -> list[float]:
    """Values of a signed quantity: outwards in curves, both signs on straight track."""
    if sign:
        return [float(np.percentile(sign * values, HIGH))]
    low, high = np.percentile(values, percentiles)
    return [float(-low), float(high)]


def _forces(part: _Part, found: SectionValues) -> None:
    section = found.section
    begin, end, turn = section.begin, section.end, section.turn
    centres = window_centres(begin, end, MEAN, STEP)
    for w in part.wheelsets:
        label = f"wheelset {w + 1}"
        s = part.s_forces[:, w]
        around, inside = _around(s, begin, end), _between(s, begin, end)
        means = distance_means(s[around], part.sum_Y[around, w], centres, MEAN)
        # the force on the rails points outwards where it points away from the curve's centre
        found.values["sum_Y", label] = _signed(means, -turn)
        for side in (0, 1):
            outer = turn == 0 or side == (0 if turn > 0 else 1)
            where = ("outer" if outer else "inner") if turn else ("left", "right")[side]
            wheel = f"{label} {where}"
            Q = part.Q[inside, w, side]
            found.values["Q_low", wheel] = [float(np.percentile(Q, LOW))]
            _lifted(part, found, w, side, wheel)
            if not outer:
                continue
            guiding = (-1.0, 1.0)[side] * part.Y[inside, w, side]
            loading = np.abs(guiding) + RAIL_LOADING * np.abs(Q)
            for name, values in (("Q", Q), ("Y_max", guiding), ("B_max", loading)):
                found.values[name, wheel] = [float(np.percentile(values, HIGH))]
            if turn:
                found.values["B_qst", wheel] = [float(np.median(loading))]
                if part.T_gamma is not None:
                    found.values["T_qst", wheel] = [float(np.median(part.T_gamma[inside, w, side]))]
            _quotient(part, found, w, side, centres, wheel)
        if turn:
            _quasi_static(part, found, w, inside, label)


def _lifted(part: _Part, found: SectionValues, w: int, side: int, wheel: str) -> None:
    """Length over which a wheel is without load [m]."""
    s = part.s_forces[:, w]
    around = _around(s, found.section.begin, found.section.end)
    unloaded = part.Q[around, w, side] <= 0.0
    if unloaded.any():
        found.lifted[wheel] = float(np.sum(np.gradient(s[around])[unloaded]))


def _quotient(
    part: _Part, found: SectionValues, w: int, side: int, centres: Floats, wheel: str
) -> None:
    """Y/Q of one wheel: 2 m means, without windows in which it has no load."""
    if not found.section.turn:
        return
    s = part.s_forces[:, w]
    around = _around(s, found.section.begin, found.section.end)
    Q, Y, s = part.Q[around, w, side], part.Y[around, w, side], s[around]
    loaded = Q > 0.0
    quotient = np.where(loaded, (1.0, -1.0)[side == 0] * Y / np.where(loaded, Q, 1.0), 0.0)
    means = distance_means(s, quotient, centres, MEAN)
    if not loaded.all():
        share = distance_means(s, np.where(loaded, 0.0, 1.0), centres, MEAN)
        means = means[share <= 0.0]
    if len(means):
        found.values["Y_over_Q", wheel] = [float(np.percentile(means, HIGH))]


def _overturning(part: _Part, found: SectionValues) -> None:
    """Share of the load that has moved to one side: in curves the outer one."""
    section = found.section
    for k, (name, own) in enumerate(part.bogies.items()):
        s = np.mean(part.s_forces[:, own], axis=1)
        there = part.rolling_over[_between(s, section.begin, section.end), k]
        # positive on the left, which is outside in a right-hand curve
        values = section.turn * there if section.turn else np.abs(there)
        found.values["overturning", name] = [float(np.percentile(values, HIGH))]


def _quasi_static(part: _Part, found: SectionValues, w: int, inside: slice, label: str) -> None:
    turn = found.section.turn
    outer = 0 if turn > 0 else 1
    Q, Y = part.Q[inside, w], part.Y[inside, w]
    outwards = (-1.0, 1.0)
    guiding = float(np.percentile(outwards[outer] * Y[:, outer], 50.0))
    inner = 1 - outer
    loaded = Q[:, inner] > 0.0
    quotient = outwards[inner] * Y[loaded, inner] / Q[loaded, inner]
    found.values["Y_qst", f"{label} outer"] = [guiding]
    found.values["Q_qst", f"{label} outer"] = [float(np.percentile(Q[:, outer], 50.0))]
    inner_mean = float(np.mean(quotient)) if len(quotient) else math.nan
    found.values["Y_over_Q_inner", f"{label} inner"] = [inner_mean]


def _instability(part: _Part, found: SectionValues, f0: float) -> None:
    section = found.section
    begin, end = section.begin, section.end
    length = min(RMS_LENGTH, end - begin)
    centres = window_centres(begin, end, length, RMS_STEP)
    for w in part.wheelsets:
        s = part.s_wheelset[:, w]
        # two seconds on either side, for a band of 4 Hz
        near = _between(s, begin - 2.0 * section.speed, end + 2.0 * section.speed)
        force = part.sum_Y_raw[near, w]
        band = band_passed(
            force, part.rate, max(f0 - HALF_BAND, LOWEST), f0 + HALF_BAND, causal=part.causal
        )
        around = _around(s[near], begin, end)
        square = distance_means(s[near][around], np.square(band[around]), centres, length)
        label = f"wheelset {w + 1}"
        found.values["instability", label] = [float(np.sqrt(np.max(np.maximum(square, 0.0))))]
        found.frequencies[label] = f0


def _spectrum(x: Floats, rate: float) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and power: Hann window, zero-padded to four times the length."""
    n = len(x)
    power = np.abs(np.fft.rfft((x - np.mean(x)) * np.hanning(n), 4 * n)) ** 2 / n
    return np.asarray(np.fft.rfftfreq(4 * n, 1.0 / rate), dtype=np.float64), power


def dominant_frequency(x: Floats, rate: float) -> float:
    """Frequency of the largest spectral component between 0.4 and 20 Hz [Hz]."""
    f, power = _spectrum(x, rate)
    searched = np.flatnonzero((f >= HUNTING[0]) & (f <= HUNTING[1]))
    return float(f[searched[np.argmax(power[searched])]])


def hunting_spectrum(record: Record, sections: Sequence[TestSection]) -> Floats:
    """Power of the track shift forces of all wheelsets in zones 1 and 2, over `FREQUENCIES`."""
    found = np.zeros(len(FREQUENCIES))
    for group in _stretches([s for s in sections if s.zone in HUNTING_ZONES]):
        rows = record.rows_between(group[0].begin, group[-1].end, 0.0)
        for force in record.result.part("Y", rows).sum(axis=-1).T:
            found += np.interp(FREQUENCIES, *_spectrum(force, record.rate))
    return found


def hunting_frequency(spectra: Sequence[Floats]) -> float | None:
    """Frequency f0 of a vehicle: the largest component of all its runs [Hz].

    None where it has no sections in zones 1 and 2.
    """
    power = np.sum(spectra, axis=0) if len(spectra) else np.zeros(1)
    return float(FREQUENCIES[np.argmax(power)]) if np.any(power) else None


def _accelerations(part: _Part, found: SectionValues) -> None:
    section = found.section
    begin, end, turn = section.begin, section.end, section.turn
    for column, k in enumerate(part.floor if part.names else []):
        name = part.names[k]
        whole = _between(part.s_sensor[k], begin, end)
        near = _between(part.s_sensor[k][part.inner], begin, end)
        y, z = part.ride_y[whole, column], part.ride_z[whole, column]
        found.values["body_y", name] = _signed(y, 0)
        found.values["body_z", name] = _signed(z, 0)
        found.values["body_y_rms", name] = [float(np.sqrt(np.mean(y**2)))]
        found.values["body_z_rms", name] = [float(np.sqrt(np.mean(z**2)))]
        if turn:
            middle = float(np.percentile(turn * part.qst_y[near, column], 50.0))
            found.values["body_y_qst", name] = [middle]
        found.values["body_y_safety", name] = _signed(part.safety_y[near, column], turn)
        found.values["body_z_safety", name] = _signed(part.safety_z[whole, column], 0)
    for column, k in enumerate(part.frames if part.names else []):
        near = _between(part.s_sensor[k][part.inner], begin, end)
        values = _signed(part.frame_y[near, column], turn)
        found.values["frame_y", part.names[k]] = values
