"""Measured against simulated channels: wrong signs, units and clocks, exchanged channels.

Both series lie at the same places and in the same band.  Of each channel: the correlation at the
best shift in time, the ratio of the rms values, and how the shift changes over the record.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from statistics import median_high, median_low

import numpy as np

from railsim.arrays import Floats
from railsim.notation import SIDES

Series = Mapping[str, Floats]
OPPOSITE = -0.5  # correlation
UNITS = (("1000", 1e3), ("1/1000", 1e-3), ("9.81 (g)", 9.81), ("1/9.81 (g)", 1 / 9.81))
NEAR = 1.35  # ratio to such a factor, of signals that are alike
ALIKE = 0.5
SURE = 0.8  # correlation from which a shift in time is trusted
PARTS = 5  # of a record, for the drift
APART = 2.0  # of a sampling step
LONGEST = 1.0  # s
SHARED = 0.25  # of the energy, below which what both have at a lag is too little


@dataclass(frozen=True)
class Likeness:
    """How alike a measured and a simulated channel are."""

    correlation: float  # at the shift with the largest magnitude [1]
    ratio: float  # rms measured over simulated [1]
    lag: float  # by which the measured one comes later [s]
    drift: float  # change of the lag over the record [s]; nan where it is not clear

    def remark(self, name: str, step: float, *, sided: bool = False) -> str:
        """Return what looks wrong, empty if nothing does; `sided`: the other side has one too."""
        if self.correlation < OPPOSITE:
            other = ", or that of the other side" * sided  # loads of both are opposite
            found = f"the opposite sign (correlation {self.correlation:.2f})"
            return f"{name} has {found}: 'reverse'{other}?"
        for times, factor in UNITS:
            if 1.0 / NEAR < self.ratio / factor < NEAR and (
                self.correlation > ALIKE or max(factor, 1.0 / factor) > 100.0
            ):
                return f"{name} is {times} times the simulated one: another 'unit'?"
        if abs(self.drift) > APART * step:
            return f"{name}: its clock drifts by {1e3 * self.drift:.3g} ms over the record."
        if self.correlation > SURE and abs(self.lag) > APART * step:
            late = f"{1e3 * abs(self.lag):.3g} ms {'later' if self.lag > 0.0 else 'earlier'}"
            return f"{name} comes {late} than simulated: 'delay', or its place on the vehicle?"
        return ""


def likeness(measured: Floats, simulated: Floats, step: float) -> Likeness:
    """Return how alike two series are, float64[time] with NaN where there is no value.

    `step`: between two values [s].
    """
    valid = np.isfinite(measured) & np.isfinite(simulated)
    a, b = np.where(valid, measured, 0.0), np.where(valid, simulated, 0.0)
    energy = float(np.sqrt(np.sum(a**2))), float(np.sqrt(np.sum(b**2)))
    if valid.sum() < 10 or not all(energy):
        return Likeness(np.nan, np.nan, np.nan, np.nan)
    correlation, lag = _best(measured, simulated, step)
    return Likeness(correlation, energy[0] / energy[1], lag, _drift(measured, simulated, step))


def _drift(a: Floats, b: Floats, step: float) -> float:
    """Change of the lag over the record by a line through that of each part; NaN if unclear."""
    size = len(a) // PARTS
    lags_found = [_best(a[k * size : (k + 1) * size], b[k * size : (k + 1) * size], step)
             for k in range(PARTS)]  # fmt: skip
    if min(correlation for correlation, _ in lags_found) < SURE:
        return np.nan
    lags = np.array([lag for _, lag in lags_found])
    slope, middle = np.polyfit(np.arange(PARTS), lags, 1)
    deviation = float(np.max(np.abs(lags - middle - slope * np.arange(PARTS))))
    drift = float(slope * PARTS)
    return drift if deviation < max(step, 0.2 * abs(drift)) else np.nan


def _best(a: Floats, b: Floats, step: float) -> tuple[float, float]:
    """Correlation and lag where its magnitude is largest, each over what both have at that lag.

    Sums over all instants would shrink with every gap that meets a value, least without a lag: an
    estimate of the lag between gaps would be drawn to zero (Padfield 2012, masked correlation).
    """
    size = 2 * len(a)
    reach = min(int(LONGEST / step), len(a) // 4)
    lags = np.arange(-reach, reach + 1)

    def products(x: Floats, y: Floats) -> Floats:
        product = np.fft.irfft(np.fft.rfft(x, size) * np.conj(np.fft.rfft(y, size)), size)
        return np.asarray(product[lags])

    in_a, in_b = np.isfinite(a), np.isfinite(b)
    # a wheel load is alike at any shift but for its changes
    a, b = (
        np.where(k, x - (x[k].mean() if k.any() else 0.0), 0.0) for k, x in ((in_a, a), (in_b, b))
    )
    values = products(a, b)
    for energy in (products(a**2, 1.0 * in_b), products(1.0 * in_a, b**2)):
        values /= np.sqrt(np.maximum(energy, max(SHARED * float(energy.max()), 1e-300)))
    k = int(np.argmax(np.abs(values)))
    return float(values[k]), float(lags[k] * step)


def suspicions(
    measured: Series,
    simulated: Series,
    quantities: Mapping[str, str],
    step: float,
    *,
    clocks: bool = True,
) -> list[str]:
    """Return remarks on all channels; delays that all share are one of the place, not said here.

    `quantities`: with their labels, by channel. Without `clocks` not on clocks: of a model whose
    phases are not right yet.
    """
    likenesses = {name: likeness(measured[name], simulated[name], step) for name in measured}
    clear = {name: like.lag for name, like in likenesses.items() if like.correlation > SURE}
    low, high = (median(clear.values() or [0.0]) for median in (median_low, median_high))
    drifts = [like.drift for like in likenesses.values() if np.isfinite(like.drift)]
    drift = float(np.median(drifts)) if len(drifts) > 1 else 0.0
    lags = {n: k.lag - (high if k.lag >= high else low) for n, k in likenesses.items()}
    exchanged = _exchanged(likenesses, lags, measured, simulated, quantities, step)
    texts = []
    for name, like in likenesses.items():
        if name in exchanged:
            texts.append(f"{name} is like the simulated {exchanged[name]}, not its own: exchanged?")
            continue
        corrected = {"lag": clocks * lags[name], "drift": clocks * (like.drift - drift)}
        sided = quantities[name].endswith(SIDES)
        texts.append(replace(like, **corrected).remark(name, step, sided=sided))
    if clocks and high - low > APART * step and not exchanged:  # half of them, half of them
        earlier, later = (
            ", ".join(n for n, lag in clear.items() if abs(lag - end) <= APART * step)
            for end in (low, high)
        )
        texts.append(
            f"{later} against {earlier}: {1e3 * (high - low):.3g} ms later than simulated. With as "
            "many channels on either side it cannot be told which are wrong: 'delay'?"
        )
    if clocks and abs(drift) > APART * step:
        texts.append(
            f"All channels drift from the simulation by {1e3 * drift:.3g} ms over the "
            "record: the mileage or the clock drifts."
        )
    return [remark for remark in texts if remark]


def _exchanged(
    likenesses: Mapping[str, Likeness],
    lags: Mapping[str, float],
    measured: Series,
    simulated: Series,
    quantities: Mapping[str, str],
    step: float,
) -> dict[str, str]:
    """Return pairs of channels of one quantity that are each like the other's simulated one.

    They are less like their own, of either sign: loads of both sides are opposite in curves; or
    they come too early and too late by `lags`, as of two places one behind the other.
    """
    pairs: dict[str, str] = {}
    unlike = [
        name
        for name, like in likenesses.items()
        if like.correlation < ALIKE or abs(lags[name]) > APART * step
    ]
    for pair in combinations(unlike, 2):
        kinds = {quantities[name].partition(":")[0] for name in pair}
        if len(kinds) == 1 and all(
            _best(measured[a], simulated[b], step)[0] > max(SURE, abs(likenesses[a].correlation))
            for a, b in (pair, pair[::-1])
        ):
            pairs |= {pair[0]: pair[1], pair[1]: pair[0]}
    return pairs
