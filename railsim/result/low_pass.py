"""Low pass between the time loop and the result, so that slow sampling folds nothing back.

The loop's output comes at a higher rate, a whole multiple of the stored one.  Without phase: a
symmetric filter of finite length (Kaiser window, ripple and stop band 80 dB), flat up to the pass
band's end f_p and zero from output_rate - f_p on, so that what is folded back lies above f_p.
Causal: Butterworth of order 4 with -3 dB at f_p.

Time and distance are taken as they are.  `Y_over_Q` is made of the filtered Y and Q.  What does not
exist while a wheel does not touch is held for the filter, and does not exist there afterwards.
"""

from collections.abc import Iterable, Mapping
from functools import cache

import numpy as np

from railsim.arrays import Floats
from railsim.notation import Quantity
from railsim.result.data import Attributes
from railsim.result.filters import outward_quotient, steady_start
from railsim.result.sinks import ALWAYS, Coordinates, Sink, SinkBefore

ATTENUATION = 80.0  # dB
UNFILTERED = ("time", "distance", "mileage", "curvature", "cant")
WITH_GAPS = ("contact_y", "contact_z")
BLOCK = 32  # rows that are filtered at once
GAPS = " gaps"  # behind the name: where they are


class LowPassSink(SinkBefore):
    """Filters chunks at equal time steps and hands on every n-th instant.

    `sink`: Where the filtered chunks go. `every`: Instants of the input for each one of the
    output. `output_rate`: Instants of the output per second [1/s]. `frequency`: End of the pass
    band, or the corner of the causal filter [Hz]. `causal`: Butterworth of order 4 instead of the
    filter without phase.
    """

    def __init__(
        self, sink: Sink, every: int, output_rate: float, frequency: float, *, causal: bool
    ) -> None:
        super().__init__(sink)
        self._rate = every * output_rate
        self._filter: _Symmetric | _Causal
        if causal:
            self._filter = _Causal(self._rate, frequency, every)
        else:
            self._filter = _Symmetric(self._rate, frequency, output_rate - frequency, every)
        self._names: tuple[str, ...] = ()
        self._last: float | None = None
        self._held: dict[str, Floats] = {}

    def begin(self, coordinates: Coordinates, quantities: Iterable[Quantity] = ALWAYS) -> None:
        """See `Sink.begin`."""
        chosen = tuple(quantities)
        self._names = tuple(q.name for q in chosen if "time" in q.dims)
        super().begin(coordinates, chosen)

    def append(self, chunk: Mapping[str, Floats]) -> None:
        """See `Sink.append`."""
        time = chunk["time"]
        if self._last is not None and time[-1] - (time[-2] if len(time) > 1 else self._last) < (
            0.999 / self._rate
        ):
            # the end of the run, between two instants
            chunk = {name: array[:-1] for name, array in chunk.items() if name != "Q0"}
        if not len(chunk["time"]):
            return
        self._last = float(chunk["time"][-1])
        self._hand_on(self._filter.take(self._needed_arrays(chunk)))

    def _finish(self, attributes: Attributes) -> Attributes:
        self._hand_on(self._filter.end())
        return attributes

    def _needed_arrays(self, chunk: Mapping[str, Floats]) -> dict[str, Floats]:
        names = set(self._names)
        if "Y_over_Q" in names:
            names = names - {"Y_over_Q"} | {"Y", "Q"}
        arrays = {name: np.asarray(chunk[name]) for name in names}
        for name in names.intersection(WITH_GAPS):
            values, valid = arrays[name], ~np.isnan(arrays[name])
            arrays[name + GAPS] = np.where(valid, 0.0, 1.0)
            before = self._held.get(name, np.zeros(values.shape[1:]))
            rows = np.arange(1, len(values) + 1).reshape(-1, *(1 for _ in before.shape))
            last = np.maximum.accumulate(np.where(valid, rows, 0), axis=0)
            arrays[name] = np.take_along_axis(np.concatenate([before[None], values]), last, axis=0)
            self._held[name] = arrays[name][-1]
        return arrays

    def _hand_on(self, filtered: dict[str, Floats]) -> None:
        if not filtered or not len(filtered["time"]):
            return
        if "Y_over_Q" in self._names:
            filtered["Y_over_Q"] = outward_quotient(filtered["Y"], filtered["Q"])
        for name in [name for name in filtered if name.endswith(GAPS)]:
            gaps, quantity = filtered.pop(name) > 0.0, name.removesuffix(GAPS)
            filtered[quantity] = np.where(gaps, np.nan, filtered[quantity])
        self._sink.append(filtered)


class _Symmetric:
    """Symmetric filter over a stream; at both ends it goes on as its odd mirror image.

    About the first and the last value: these two pass as they are, whatever their frequency, and
    what is slow keeps its level and slope (an even image would bend it: a third at 3/4 f_p).
    """

    def __init__(self, rate: float, end_of_pass: float, begin_of_stop: float, every: int) -> None:
        from scipy import signal  # with scipy.stats, a second to import; few runs need it

        length, beta = signal.kaiserord(ATTENUATION, (begin_of_stop - end_of_pass) / (0.5 * rate))
        self._half = max(1, length // 2)
        corner = 0.5 * (end_of_pass + begin_of_stop)
        taps = signal.firwin(2 * self._half + 1, corner, window=("kaiser", beta), fs=rate)
        self._taps = np.asarray(taps)
        self._every = every
        self._window: dict[str, Floats] = {}
        self._started = False
        self._skip = 0  # rows before the middle of the next window

    def take(self, chunk: dict[str, Floats]) -> dict[str, Floats]:
        """Filtered instants that are known with a further chunk."""
        self._window = {
            # copied: the loop writes its next instants into the same memory
            name: np.concatenate([self._window[name], array] if self._window else [array])
            for name, array in chunk.items()
        }
        if not self._started:
            if len(self._window["time"]) <= self._half:
                return {}
            self._window = {name: self._before(array) for name, array in self._window.items()}
            self._started = True
        return self._filtered_windows()

    def end(self) -> dict[str, Floats]:
        """Filtered instants up to the end of the stream."""
        if not self._window or len(self._window["time"]) < 2:
            return {}
        if not self._started:
            self._window = {name: self._before(array) for name, array in self._window.items()}
        last = self._window
        self._window = {name: self._before(array[::-1])[::-1] for name, array in last.items()}
        return self._filtered_windows()

    def _before(self, array: Floats) -> Floats:
        rows = np.minimum(np.arange(self._half, 0, -1), len(array) - 1)
        return np.concatenate([2.0 * array[0] - array[rows], array])

    def _filtered_windows(self) -> dict[str, Floats]:
        """Filter all whole windows and forget what no later one needs."""
        length = len(self._window["time"])
        count = (length - self._skip - 2 * self._half - 1) // self._every + 1
        if count <= 0:
            return {}
        span = slice(self._skip, self._skip + (count - 1) * self._every + len(self._taps))
        output = {}
        for name, array in self._window.items():
            part = array[span]
            if name in UNFILTERED or name.endswith(GAPS):
                output[name] = part[self._half :: self._every][:count]
            else:
                flat = self._filtered_rows(part.reshape(len(part), -1), count)
                output[name] = flat.reshape(count, *part.shape[1:])
        used = self._skip + count * self._every
        drop = min(used, length)
        self._window = {name: array[drop:] for name, array in self._window.items()}
        self._skip = used - drop
        return output

    def _filtered_rows(self, flat: Floats, count: int) -> Floats:
        """Filter columns; in blocks of rows, as most of a large matrix would be zeros."""
        output = np.empty((count, flat.shape[1]))
        for first in range(0, count, BLOCK):
            matrix = _banded(self._taps.tobytes(), min(BLOCK, count - first), self._every)
            begin = first * self._every
            output[first : first + BLOCK] = matrix @ flat[begin : begin + matrix.shape[1]]
        return output


@cache
def _banded(taps: bytes, count: int, every: int) -> Floats:
    """Matrix that filters and thins out: row k holds the taps from column k `every` on."""
    values = np.frombuffer(taps)
    matrix = np.zeros((count, (count - 1) * every + len(values)))
    for row in range(count):
        matrix[row, row * every : row * every + len(values)] = values
    return matrix


class _Causal:
    """Butterworth of order 4 over a stream, started in the steady state of its first values."""

    def __init__(self, rate: float, corner: float, every: int) -> None:
        from scipy import signal

        self._signal = signal
        self._sections = signal.butter(4, corner, fs=rate, output="sos")
        self._every = every
        self._states: dict[str, Floats] = {}
        self._skip = 0

    def take(self, chunk: dict[str, Floats]) -> dict[str, Floats]:
        output = {}
        for name, array in chunk.items():
            passed = array
            if name not in UNFILTERED and not name.endswith(GAPS):
                if name not in self._states:
                    self._states[name] = steady_start(self._sections, array[0])
                passed, self._states[name] = self._signal.sosfilt(
                    self._sections, array, axis=0, zi=self._states[name]
                )
            output[name] = passed[self._skip :: self._every]
        self._skip = (self._skip - len(chunk["time"])) % self._every
        return output

    def end(self) -> dict[str, Floats]:
        return {}
