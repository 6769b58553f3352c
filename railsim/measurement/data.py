"""A measured run: channels over time, arc length and speed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.measurement import Channel, MeasurementFile
from railsim.errors import nearest
from railsim.result.filters import band_passed, low_passed
from railsim.table import Table


@dataclass(frozen=True, eq=False)
class Measurement:
    """A measured run; everything over equal time steps, in SI, with railsim's signs.

    Attributes
    ----------
    definition : MeasurementFile
        What the file says.
    time : float64[time]
        [s]
    distance : float64[time]
        Arc length of the reference body along the track [m].
    speed : float64[time]
        [m/s]
    channels : mapping of str to float64[time]
        By names of the file; NaN where there is no value.
    remarks : tuple of str
        What a reader should know about the data.
    """

    definition: MeasurementFile
    time: Floats
    distance: Floats
    speed: Floats
    channels: Mapping[str, Floats]
    remarks: tuple[str, ...] = field(default=())

    @property
    def name(self) -> str:
        """What the run is called."""
        return self.definition.name

    @property
    def rate(self) -> float:
        """Values per second [1/s]."""
        return (len(self.time) - 1) / float(self.time[-1] - self.time[0])

    @property
    def quantities(self) -> dict[str, str]:
        """Quantity with its labels by channel: ``Q:1:left``."""
        return {name: self.definition.channels[name].quantity for name in self.channels}

    def channel(self, name: str) -> Channel:
        """Return what the file says about a channel, by its name or quantity."""
        return self.definition.channels[self._channel_name(name)]

    def __getitem__(self, name: str) -> Floats:
        """Return the values of a channel, by its name or its quantity [SI]."""
        return self.channels[self._channel_name(name)]

    def __contains__(self, name: object) -> bool:
        return name in self.channels or name in self.quantities.values()

    def _channel_name(self, name: str) -> str:
        if name in self.channels:
            return name
        for channel, quantity in self.quantities.items():
            if quantity == name:
                return channel
        names = [*self.channels, *self.quantities.values()]
        raise KeyError(f"no channel '{name}'; {nearest(name, names)}")

    def part(self, begin: float, end: float) -> "Measurement":
        """Return the values between two arc lengths [m]."""
        rows = slice(*np.searchsorted(self.distance, [begin, end]).tolist())
        axes: Any = {name: getattr(self, name)[rows] for name in ("time", "distance", "speed")}
        return replace(self, channels={n: x[rows] for n, x in self.channels.items()}, **axes)

    def resampled(self, rate: float) -> "Measurement":
        """Return the run at another rate [1/s]; filtered before where it becomes lower.

        The low pass has its corner at 0.4 times the new rate; values next to a gap are lost with
        it.
        """
        count = int((self.time[-1] - self.time[0]) * rate * (1.0 + 1e-12)) + 1
        time = self.time[0] + np.arange(count) / rate
        lower = rate < self.rate * (1.0 - 1e-9)

        def resample(x: Floats) -> Floats:
            bridged = _bridged(x)
            bridged = low_passed(bridged, self.rate, 0.4 * rate) if lower else bridged
            missing = np.interp(time, self.time, np.isnan(x).astype(float)) > 0.0
            return np.where(missing, np.nan, np.interp(time, self.time, bridged))

        distance, speed = (np.interp(time, self.time, x) for x in (self.distance, self.speed))
        channels = {name: resample(x) for name, x in self.channels.items()}
        return replace(self, time=time, distance=distance, speed=speed, channels=channels)

    def filtered(self, low: float = 0.0, high: float = np.inf) -> "Measurement":
        """Return the run with all channels through a Butterworth band pass without phase [Hz].

        Gaps are bridged for the filter and left out again.
        """
        channels = {
            name: np.where(np.isnan(x), np.nan, band_passed(_bridged(x), self.rate, low, high))
            for name, x in self.channels.items()
        }
        return replace(self, channels=channels)

    def moved(self, shift: float, stretch: float = 0.0) -> "Measurement":
        """Return the run with other arc lengths: s + shift + stretch (s - s of the first value)."""
        s = self.distance
        distance = s + shift + stretch * (s - s[0])
        return replace(self, distance=distance, speed=(1.0 + stretch) * self.speed)

    def with_remarks(self, *remarks: str) -> "Measurement":
        """Return the run with further remarks."""
        return replace(self, remarks=(*self.remarks, *remarks))

    def _repr_html_(self) -> str:
        rows: list[list[object]] = []
        for name, x in self.channels.items():
            finite = x[np.isfinite(x)]
            spread = [finite.min(), finite.max()] if len(finite) else [np.nan, np.nan]
            share = 100.0 * (1.0 - len(finite) / len(x))
            rows.append([name, self.quantities[name], *spread, share])
        columns = ["channel", "quantity", "least (SI)", "largest (SI)", "missing (%)"]
        return Table(columns, rows, self.name).html()

    def __repr__(self) -> str:
        length = (self.distance[-1] - self.distance[0]) / 1e3
        return f"<Measurement {self.name!r}: {len(self.channels)} channels, {length:.3g} km>"


def _bridged(x: Floats) -> Floats:
    """Return values with straight lines over the gaps."""
    valid = np.flatnonzero(np.isfinite(x))
    return np.interp(np.arange(len(x)), valid, x[valid]) if 0 < len(valid) < len(x) else x
