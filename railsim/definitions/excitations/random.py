"""Random irregularities from power spectral densities.

Sums of cosines with random phases (Shinozuka and Deodatis 1991, Applied Mechanics Reviews 44): one
cosine for each bin of a fine division of the band, with the amplitude sqrt(2 integral of S over the
bin).  The variance over the whole period is thus exact for every seed.  The period is as long as
the irregularity, and 20 of its longest wavelengths at least.  The spectra (see `spectra`) are
one-sided: the variance of a displacement is the integral of S over omega from 2 pi / longest to
2 pi / shortest wavelength.
"""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from railsim.arrays import Floats
from railsim.definitions.base import Finite, Flag, NonNegative, Whole, check
from railsim.definitions.excitations import base
from railsim.definitions.excitations.spectra import SPECTRA, Coefficients, Spectrum, erri_b176

SpectrumName = Literal[(*SPECTRA, "own")]  # type: ignore[valid-type]
# Points of the lattice in the shortest wavelength: interpolation error 4e-6 of the amplitude.
POINTS_PER_WAVE = 32
PERIOD_IN_WAVES = 20.0
LONG = 3.0  # m: EN 13848-1 measures no shorter waves


class Random(base.Stretch):
    """Stationary random irregularities from power spectral densities."""

    type: Literal["random"]
    spectrum: SpectrumName
    """Which spectra, by name; `own` needs `coefficients`"""
    coefficients: Coefficients | None = None
    """Own coefficients"""
    seed: Whole = 1
    """Seed of the random phases: the same seed gives the same track"""
    wavelengths: base.Wavelengths = (3.0, 70.0)
    """Shortest and longest wavelength [m]; the variance is the integral of the spectrum between"""
    channels: Annotated[tuple[base.Channel, ...], Field(min_length=1)] | None = None
    """Which of the four irregularities are generated; by default all that the spectra describe"""
    begin: Finite = 0.0
    """Arc length where it begins [m]"""
    end: Finite | None = None
    """Arc length where it ends [m]; by default the end of the plan"""
    scale: NonNegative = 1.0
    """Factor on all displacements"""
    fade: NonNegative = 10.0
    """Length over which it fades in and out within its ends [m]"""
    mirror: Flag = False
    """The mirror image of the same realisation: left and right exchanged"""

    @check
    def _complete(self) -> None:
        if (self.spectrum == "own") != (self.coefficients is not None):
            raise ValueError("'coefficients' belong to spectrum = \"own\" and only to it")
        channels = self.channels or ()
        if len(set(channels)) < len(channels):
            raise ValueError("'channels' names one irregularity twice")
        if self.spectrum == "china_trunk" and "gauge" in channels:
            raise ValueError("the spectra 'china_trunk' do not describe the gauge")

    def mirrored(self) -> Self:
        """Return the mirror image of the same realisation."""
        return self.model_copy(update={"mirror": not self.mirror})

    def resolution(self) -> float:
        """Return a sixteenth of the shortest wavelength [m]."""
        return self.wavelengths[0] / 16.0

    def sets_wheels_ringing(self) -> bool:
        """Return whether there are shorter waves than 3 m, or ends as short."""
        return min(self.wavelengths[0], self.fade) < LONG

    def summary(self) -> str:
        """Return spectrum, channels, seed, band and scale."""
        low, high = self.wavelengths
        chosen = f" of {' and '.join(self.channels)}" if self.channels else ""
        times = "" if self.scale == 1.0 else f", times {self.scale:g}"
        mirrored = ", mirrored" if self.mirror else ""
        return f"{self.spectrum}{chosen}, seed {self.seed}, {low:g} to {high:g} m{times}{mirrored}"

    def displacement(self, length: float) -> base.Displacement:
        """Return the sum of cosines of all channels, by interpolation on a periodic lattice."""
        from scipy.fft import next_fast_len

        coefficients = self.coefficients
        spectrum = erri_b176(coefficients) if coefficients else SPECTRA[self.spectrum]
        begin, end = self.extent(length)
        shortest, longest = self.wavelengths
        period = max(end - begin, PERIOD_IN_WAVES * longest)
        n_points = next_fast_len(int(np.ceil(POINTS_PER_WAVE * period / shortest)), real=True)
        lattice = np.zeros((2, 4, n_points))
        for channel in self.channels or spectrum.channels:
            shares = self.scale * np.array(base.SHARES[channel])
            shares *= base.MIRROR[channel] if self.mirror else 1.0
            shares *= spectrum.half_base if channel == "cross_level" else 1.0
            amplitudes = _amplitudes(spectrum, channel, self.wavelengths, period)
            # the same for a seed whatever the other channels
            generator = np.random.default_rng([self.seed, base.CHANNELS.index(channel)])
            phases = generator.uniform(0.0, 2.0 * np.pi, amplitudes.size)
            waves = _waves(amplitudes, phases, period, n_points)
            for k in np.flatnonzero(shares):
                lattice[:, k] += shares[k] * waves

        def value_and_rate(s: Floats) -> tuple[Floats, Floats]:
            return _periodic(lattice, period, s - begin)

        return base.faded(value_and_rate, begin, end, self.fade)


def _amplitudes(
    spectrum: Spectrum, channel: str, wavelengths: Sequence[float], period: float
) -> Floats:
    """Amplitude of each harmonic of the period, from the one of index 0 on."""
    step = 2.0 * np.pi / period
    low, high = 2.0 * np.pi / wavelengths[1], 2.0 * np.pi / wavelengths[0]
    middle = step * np.arange(int(np.ceil(high / step)) + 1)
    begin, end = np.clip([middle - 0.5 * step, middle + 0.5 * step], low, high)
    return np.sqrt(2.0 * spectrum.bin_variances(channel, begin, end))


def _waves(amplitudes: Floats, phases: Floats, period: float, n_points: int) -> Floats:
    """Sum of all harmonics and its rate on a lattice over the period, shape (2, n_points)."""
    harmonics = np.zeros(n_points // 2 + 1, dtype=complex)
    harmonics[: amplitudes.size] = 0.5 * n_points * amplitudes * np.exp(1j * phases)
    omega = 2.0 * np.pi / period * np.arange(harmonics.size)
    return np.fft.irfft(np.stack((harmonics, 1j * omega * harmonics)), n_points)


def _periodic(lattice: Floats, period: float, u: Floats) -> tuple[Floats, Floats]:
    """Hermite interpolation of values and rates on a periodic lattice, shapes (4, len(u))."""
    n_points = lattice.shape[2]
    h = period / n_points
    cell = np.floor(u / h)
    t = u / h - cell
    i = cell.astype(np.int64) % n_points
    j = (i + 1) % n_points
    value0, value1 = lattice[0][:, i], lattice[0][:, j]
    rate0, rate1 = h * lattice[1][:, i], h * lattice[1][:, j]
    step = value1 - value0
    c2, c3 = 3.0 * step - 2.0 * rate0 - rate1, rate0 + rate1 - 2.0 * step
    value = value0 + t * (rate0 + t * (c2 + t * c3))
    return value, (rate0 + t * (2.0 * c2 + 3.0 * t * c3)) / h
