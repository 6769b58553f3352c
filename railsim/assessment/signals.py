"""Filtered signals of a part of a run; each filter is applied once, each signal formed once."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np

from railsim.arrays import Floats
from railsim.assessment.record import Record
from railsim.assessment.safety import overturning
from railsim.assessment.sections import TestSection
from railsim.result.filters import band_passed, distance_means, window_centres

T = TypeVar("T")

Band = tuple[float | None, float]
"""Lower and upper corner of a filter [Hz]; without the lower one a low pass."""

MARGINS = ((20.0, 0.5), (5.0, 1.5), (0.0, 16.0))
"""Rows [lowest corner of the filter from Hz, seconds on either side of a part]."""
WIDEST = MARGINS[-1][1]
STEP = 0.5  # m, between the windows of means over distance
OUTWARDS = np.array([-1.0, 1.0])  # of the forces on the left and the right rail


@dataclass(frozen=True)
class Signal:
    """A signal at several places of the vehicle."""

    values: Floats  # nan where there is no value, float64[time, place]
    s: Floats  # arc length of the place [m], float64[time, place]
    places: Sequence[tuple[str, int | None]]  # wheelset, bogie or sensor, and the side of a wheel

    def rows(self, place: int, section: TestSection) -> slice:
        """Rows from the last before a section to the first after it."""
        inside = between(self.s[:, place], section.begin, section.end)
        return slice(max(0, inside.start - 1), min(len(self.s), inside.stop + 1))

    def in_section(self, place: int, section: TestSection, window: float) -> Floats:
        """Values of one place in a section, or means over windows of `window` metres in it.

        A window that holds an instant without value has no mean.
        """
        if not window:
            return self.values[between(self.s[:, place], section.begin, section.end), place]
        rows = self.rows(place, section)
        s, x = self.s[rows, place], self.values[rows, place]
        centres = window_centres(section.begin, section.end, window, STEP)
        unknown = np.isnan(x)
        means = distance_means(s, np.where(unknown, 0.0, x), centres, window)
        if not unknown.any():
            return means
        return means[distance_means(s, unknown.astype(float), centres, window) <= 0.0]


def between(s: Floats, begin: float, end: float) -> slice:
    """Rows between two arc lengths."""
    return slice(int(np.searchsorted(s, begin)), int(np.searchsorted(s, end, side="right")))


def in_band(x: Floats, rate: float, band: Band, *, causal: bool = False) -> Floats:
    """Values over time through the filter of a band."""
    low, high = band
    return band_passed(x, rate, low or 0.0, high, causal=causal)


class Signals:
    """Signals of a part of a run.

    `begin`, `end`: Arc lengths of the part [m]; it is read with the margins of the filters. `f0`:
    Frequency of the instability of the vehicle [Hz]. `causal`: Use causal filters, as in a
    measuring amplifier, instead of zero-phase filters.
    """

    def __init__(
        self, record: Record, begin: float, end: float, *, f0: float | None, causal: bool
    ) -> None:
        self.record, self.f0, self.causal = record, f0, causal
        self._begin, self._end = begin, end
        self._rows = record.rows_between(begin, end, WIDEST)
        # not caches of methods: these hold their object, and its arrays stay until the next search
        # for garbage
        self._cache: dict[Hashable, Any] = {}

    def _once(self, key: Hashable, compute: Callable[[], T]) -> T:
        if key not in self._cache:
            self._cache[key] = compute()
        value: T = self._cache[key]
        return value

    def signal(
        self, form: "Callable[[Signals, Band | None], Signal | None]", band: Band | None
    ) -> Signal | None:
        """Return the signal that `form` forms of this part, once."""
        return self._once((form, band), lambda: form(self, band))

    def raw(self, name: str) -> Floats:
        """Quantity over the rows of the widest margin; ``acceleration`` is that of all sensors."""
        if name == "acceleration":
            return self._once(name, lambda: self.record.readings(self._rows)[0])
        return self._once(name, lambda: self.record.part(name, self._rows))

    def filtered(self, name: str, band: Band | None) -> Floats:
        """Quantity over the rows of the part with the margin of the filter, filtered once."""
        return self._once((name, band), lambda: self.in_band(self.near(self.raw(name), band), band))

    def near(self, x: Floats, band: Band | None) -> Floats:
        """Of values over the rows of the widest margin those of the part with that of a filter."""
        corner = np.inf if band is None else band[1] if band[0] is None else band[0]
        margin = next(seconds for lowest, seconds in MARGINS if corner >= lowest)
        rows = self.record.rows_between(self._begin, self._end, margin)
        return x[rows.start - self._rows.start : rows.stop - self._rows.start]

    def in_band(self, x: Floats, band: Band | None) -> Floats:
        """Values over time through a filter, if there is one."""
        if band is None:
            return x
        flat = in_band(x.reshape(len(x), -1), self.record.rate, band, causal=self.causal)
        return flat.reshape(x.shape)

    def s_wheelset(self, band: Band | None) -> Floats:
        """Arc lengths of the wheelsets over the rows of `filtered` [m]."""
        return self.near(self.raw("wheelset_distance"), band)

    def s_sensor(self, name: str, band: Band | None) -> Floats:
        """Arc length of a sensor over the same rows [m]."""
        s = self.near(self.record.distance[self._rows], band)
        return np.asarray(s + self.record.sensor_offset(name))


def _labels(signals: Signals) -> list[str]:
    return [f"wheelset {w + 1}" for w in range(len(signals.record.offsets))]


def _wheel_signal(signals: Signals, values: Floats, band: Band | None) -> Signal:
    """Signal of [time, wheelset, side]."""
    places = [(label, side) for label in _labels(signals) for side in (0, 1)]
    s = np.repeat(signals.s_wheelset(band), 2, axis=1)
    return Signal(values.reshape(len(values), -1), s, places)


def track_shifting_force(signals: Signals, band: Band | None) -> Signal:
    """Sum of the lateral forces of a wheelset on both rails [N]."""
    total = signals.filtered("Y", band).sum(axis=-1)
    return Signal(total, signals.s_wheelset(band), [(label, None) for label in _labels(signals)])


def wheel_load(signals: Signals, band: Band | None) -> Signal:
    """Q [N]."""
    return _wheel_signal(signals, signals.filtered("Q", band), band)


def guiding_force(signals: Signals, band: Band | None) -> Signal:
    """Y of each wheel, outwards positive [N]."""
    return _wheel_signal(signals, OUTWARDS * signals.filtered("Y", band), band)


def quotient(signals: Signals, band: Band | None) -> Signal:
    """Y/Q, both filtered before; none where the wheel carries no load [1]."""
    Q = signals.filtered("Q", band)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = np.where(Q > 0.0, OUTWARDS * signals.filtered("Y", band) / Q, np.nan)
    return _wheel_signal(signals, values, band)


def rail_loading(signals: Signals, band: Band | None) -> Signal:
    """B = |Y| + 0.83 |Q| [N]."""
    values = np.abs(signals.filtered("Y", band)) + 0.83 * np.abs(signals.filtered("Q", band))
    return _wheel_signal(signals, values, band)


def wear_number(signals: Signals, band: Band | None) -> Signal | None:
    """T_gamma, where the result has it [N]."""
    if "T_gamma" not in signals.record.result:
        return None
    return _wheel_signal(signals, signals.filtered("T_gamma", band), band)


def load_transfer(signals: Signals, band: Band | None) -> Signal:
    """(sum Q_left - sum Q_right)/(sum Q) of each bogie: positive outside right-hand curves [1]."""
    bogies = signals.record.bogies
    Q, s = signals.filtered("Q", band), signals.s_wheelset(band)
    values = np.stack([overturning(Q[:, columns]) for columns in bogies.values()], axis=-1)
    middles = np.stack([s[:, columns].mean(axis=1) for columns in bogies.values()], axis=-1)
    return Signal(values, middles, [(name, None) for name in bogies])


def _acceleration(signals: Signals, band: Band | None, axis: int, *, frames: bool) -> Signal | None:
    names = list(signals.record.sensors)
    columns = [k for k, name in enumerate(names) if name.startswith("frame_") == frames]
    if not columns:
        return None
    raw = signals.near(signals.raw("acceleration"), band)[:, columns, axis]
    s = np.stack([signals.s_sensor(names[k], band) for k in columns], axis=-1)
    return Signal(signals.in_band(raw, band), s, [(names[k], None) for k in columns])


body_lateral = partial(_acceleration, axis=1, frames=False)
"""Lateral acceleration on the floor of the body [m/s2]."""

body_vertical = partial(_acceleration, axis=2, frames=False)
"""Vertical acceleration on the floor of the body [m/s2]."""

frame_lateral = partial(_acceleration, axis=1, frames=True)
"""Lateral acceleration of the bogie frames above the wheelsets [m/s2]."""
