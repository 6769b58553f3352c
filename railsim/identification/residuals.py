"""What is fitted: residuals of measured against simulated channels, weighted by their noise.

``history``
    The difference over time, as its Fourier coefficients in the band: for white noise they are
    independent, so that no filter colours the residuals and their number is that of the
    independent values, but for what gaps and ends take (`Form.independent`).  Means and linear
    drifts do not count, gaps are no difference; both ends fade by half a cosine.
``spectra``
    Logarithms of the rms values in third-octave bands, simulated ones with the noise that is stated
    of a channel: where the place on the track, or the track itself, is known by its spectrum only.
``sections``
    Mean and rms of the channels in sections of 50 m.
"""

from dataclasses import dataclass

import numpy as np

from railsim.arrays import Complexes, Flags, Floats
from railsim.identification.runs import FEWEST, PreparedRun

FORMS = ("history", "spectra", "sections")
FADE = 1.0  # s
SECTION = 50.0  # m
THIRD = 2.0 ** (1.0 / 3.0)


@dataclass(frozen=True, eq=False)
class Form:
    """How series become residuals."""

    kind: str  # one of `FORMS`
    band: tuple[float, float]  # [Hz]

    def features(
        self, prepared: PreparedRun, values: Floats, *, measured: bool = False
    ) -> list[Floats]:
        """Return what is compared of each channel; `values` is float64[channel, time].

        Where nothing is measured, the values do not count.
        """
        valid = np.isfinite(prepared.measured) & np.isfinite(values)
        clean = np.where(valid, values, 0.0)
        if self.kind == "sections":
            return self._sections(prepared, clean, valid)
        n = values.shape[1]
        clean = _without_line(clean, valid)
        coefficients = np.fft.rfft(clean * _fade(n, prepared.step), axis=1)
        f = np.fft.rfftfreq(n, prepared.step)
        # of white noise of standard deviation 1 in the band each part has the variance 1
        in_band = (f >= self.band[0]) & (f <= self.band[1])
        scaled = coefficients[:, in_band] * np.sqrt(2.0 / n)
        if self.kind == "history":
            return [np.concatenate([row.real, row.imag]) for row in scaled]
        edges = self.band[0] * THIRD ** np.arange(
            np.log(self.band[1] / self.band[0]) / np.log(THIRD) + 1.0
        )
        rows = []
        noise = 0.0 if measured else np.nan_to_num(prepared.noise * _density(prepared, self.band))
        for row, level in zip(scaled, np.broadcast_to(noise, len(scaled)), strict=True):
            inside = [row[(f[in_band] >= a) & (f[in_band] < a * THIRD)] for a in edges]
            # both parts of a coefficient have the noise's variance
            power = 2.0 * level**2
            means = [np.mean(np.abs(c) ** 2) + power for c in inside if len(c) >= FEWEST]
            rows.append(0.5 * np.log(np.maximum(means, 1e-300)))
        return rows

    def _sections(self, prepared: PreparedRun, x: Floats, valid: Flags) -> list[Floats]:
        s = prepared.run.at
        number = ((s - s[0]) / SECTION).astype(int)
        rows = []
        for channel, present in zip(x, valid, strict=True):
            count = np.maximum(np.bincount(number, present.astype(float)), 1.0)
            mean = np.bincount(number, channel) / count
            square = np.bincount(number, channel**2) / count
            rows.append(np.concatenate([mean, np.sqrt(np.maximum(square - mean**2, 0.0))]))
        return rows

    def expected(self, prepared: PreparedRun) -> Floats:
        """Return standard deviations of each channel's features by the noise stated, or NaN."""
        if self.kind != "history":
            return np.full(len(prepared.noise), np.nan)
        return prepared.noise * _density(prepared, self.band) * _weights(prepared, 2) ** 0.5

    def independent(self, prepared: PreparedRun) -> Floats:
        """Return the share of independent values in the features of each channel.

        With weights w over time (the faded ends, 0 in gaps) white noise gives N = sum(w^2)^2 /
        sum(w^4) independent values: a mean of squares over them varies as one over N values.
        """
        if self.kind != "history":
            return np.ones(len(prepared.names))
        return _weights(prepared, 2) ** 2 / np.maximum(_weights(prepared, 4), 1e-300)


def _density(prepared: PreparedRun, band: tuple[float, float]) -> float:
    """Standard deviation of white noise over all frequencies for 1 in the band [1]."""
    return float(np.sqrt(0.5 / prepared.step / (band[1] - band[0])))


def _without_line(x: Floats, valid: Flags) -> Floats:
    """Series that are 0 in gaps, less the straight line through their values.

    Offset and drift of a sensor: faded and with gaps they would reach into the band.
    """
    count = np.maximum(valid.sum(axis=-1, keepdims=True), 1)
    t = np.linspace(-1.0, 1.0, x.shape[-1])
    t = np.where(valid, t - (valid * t).sum(axis=-1, keepdims=True) / count, 0.0)
    square = np.maximum((t**2).sum(axis=-1, keepdims=True), 1e-300)
    line = x.sum(axis=-1, keepdims=True) / count + (t * x).sum(axis=-1, keepdims=True) / square * t
    return np.where(valid, x - line, 0.0)


def _weights(prepared: PreparedRun, power: int) -> Floats:
    """Mean over time of a power of what each channel is multiplied by: the fade, 0 in gaps."""
    valid = np.isfinite(prepared.measured)
    means: Floats = np.mean(valid * _fade(valid.shape[1], prepared.step) ** power, axis=1)
    return means


def _fade(n: int, step: float) -> Floats:
    edge = min(max(1, round(FADE / step)), n // 4)
    window: Floats = np.ones(n)
    ramp = 0.5 - 0.5 * np.cos(np.pi * (np.arange(edge) + 0.5) / edge)
    window[:edge], window[-edge:] = ramp, ramp[::-1]
    window /= np.sqrt(np.mean(window**2))
    return window


def banded(x: Floats, step: float, band: tuple[float, float]) -> Floats:
    """Return a series in a band of frequencies [Hz], both ends faded; NaN where it has no value."""
    f, spectrum = spectrum_of(x, step)
    spectrum[(f < band[0]) | (f > band[1])] = 0.0
    return np.where(np.isfinite(x), np.fft.irfft(spectrum, len(x)), np.nan)


def spectrum_of(x: Floats, step: float) -> tuple[Floats, Complexes]:
    """Return frequencies [Hz] and Fourier coefficients of a series, without its line, faded."""
    valid = np.isfinite(x)
    faded = _without_line(np.where(valid, x, 0.0), valid) * _fade(len(x), step)
    return np.asarray(np.fft.rfftfreq(len(x), step)), np.fft.rfft(faded)


def whiteness(residual: Floats, independent: float = 1.0) -> tuple[float, float]:
    """Return statistic and probability of white residuals, by their cumulative periodogram.

    Of Fourier coefficients (real parts, then imaginary parts): the largest distance of the sum of
    their squares over frequency from a straight line, times the root of their number, has the
    distribution of Kolmogorov and Smirnov where the residuals are white (Bartlett 1955, An
    Introduction to Stochastic Processes, section 9.2).  `independent`: share of independent ones.

    >>> rng = np.random.default_rng(1)
    >>> whiteness(rng.standard_normal(2000))[1] > 0.05
    True
    >>> whiteness(rng.standard_normal(2000) * np.tile(np.linspace(0.5, 1.5, 1000), 2))[1] < 1e-6
    True
    """
    from scipy.stats import kstwobign

    power = np.sum(np.reshape(residual, (2, -1)) ** 2, axis=0)
    total = float(power.sum())
    if not total:
        return 0.0, 1.0
    cumulative = np.cumsum(power) / total
    line = np.arange(1, len(power) + 1) / len(power)
    statistic = float(np.max(np.abs(cumulative - line)) * np.sqrt(independent * len(power)))
    return statistic, float(kstwobign.sf(statistic))
