"""Irregularities as displacements of the rails and their rates over arc length.

A `Displacement` gives, for any arc lengths, the four displacements (y_left, z_left, y_right,
z_right; y to the right, z down) [m] and their derivatives along the track [1].  The spectra (see
`spectra`) are one-sided: the variance of a displacement is the integral of S over omega from
2 pi / longest to 2 pi / shortest wavelength.

Random irregularities are sums of cosines with random phases (Shinozuka and Deodatis 1991, Applied
Mechanics Reviews 44): one cosine for each bin of a fine division of the band, with the amplitude
sqrt(2 integral of S over the bin).  The variance over the whole period is thus exact for every
seed.  The period is as long as the irregularity, and 20 of its longest wavelengths at least.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import singledispatch
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.irregularity import (
    CHANNELS,
    COLUMNS,
    MIRROR,
    Dip,
    Irregularity,
    Kink,
    Measured,
    Random,
    Sweep,
    Twist,
)
from railsim.definitions.section import Section
from railsim.definitions.track import Track
from railsim.track.alignment import RoundedProfile
from railsim.track.spectra import SPECTRA, Spectrum, erri_b176

Array = NDArray[np.float64]
Displacement = Callable[[Array], tuple[Array, Array]]

# rails moved by one unit of each irregularity: y_left, z_left, y_right, z_right; the cross level is
# an angle here, positive = left rail higher, and its unit moves the rails by b
SHARES = {
    "lateral": (1.0, 0.0, 1.0, 0.0),
    "vertical": (0.0, 1.0, 0.0, 1.0),
    "cross_level": (0.0, -1.0, 0.0, 1.0),
    "gauge": (-0.5, 0.0, 0.5, 0.0),
}
RAILS = {"left": (1.0, 0.0), "right": (0.0, 1.0), "both": (1.0, 1.0)}
# Points of the lattice in the shortest wavelength: interpolation error 4e-6 of the amplitude.
POINTS_PER_WAVE = 32
PERIOD_IN_WAVES = 20.0
# Share of the range of the rows around by which a spline between measured rows may leave it.
OVERSHOOT = 0.25
_INNER = np.arange(1, 8) / 8.0  # positions within an interval, over its length
# Largest displacement between the rows over that at the rows, from which on it is remarked on.
BEYOND_ROWS = 1.05


def displacement(track: Track) -> Displacement | None:
    """Sum of all displacements of a track's rails, None where there are none."""
    parts = [_displacement(part, track) for part in track.irregularities]
    if track.gauge_widening is not None:
        parts.append(_widening(track))
    if not parts:
        return None

    def total(s: Array) -> tuple[Array, Array]:
        values, rates = zip(*(part(s) for part in parts), strict=True)
        return np.sum(values, axis=0), np.sum(rates, axis=0)

    return total


def shortest_length(track: Track) -> float:
    """Length that the tables must resolve: a sixteenth of the shortest wave, and so on [m]."""
    return min([np.inf, *(part.resolution() for part in track.irregularities)])


@singledispatch
def _displacement(part: Irregularity, track: Track) -> Displacement:
    raise NotImplementedError(f"no displacement of irregularities '{part.type}'")


# single disturbances ------------------------------------------------------------------------------


@_displacement.register
def _dip(part: Dip, track: Track) -> Displacement:
    left, right = RAILS[part.rail]
    return _single(part, part.depth * np.array([0.0, left, 0.0, right]))


@_displacement.register
def _kink(part: Kink, track: Track) -> Displacement:
    left, right = RAILS[part.rail]
    return _single(part, part.offset * np.array([left, 0.0, right, 0.0]))


@_displacement.register
def _twist(part: Twist, track: Track) -> Displacement:
    return _single(part, 0.5 * part.height * np.array([0.0, -1.0, 0.0, 1.0]))


def _single(part: Dip | Kink | Twist, shares: Array) -> Displacement:
    shape = _cosine if part.shape == "cosine" else _triangle
    value_and_rate = shape(part.s, part.length)

    def moved(s: Array) -> tuple[Array, Array]:
        value, rate = value_and_rate(s)
        return shares[:, None] * value, shares[:, None] * rate

    return moved


def _cosine(middle: float, length: float) -> Displacement:
    wave = 2.0 * np.pi / length

    def shape(s: Array) -> tuple[Array, Array]:
        u = s - middle
        inside = np.abs(u) < 0.5 * length
        value = np.where(inside, 0.5 + 0.5 * np.cos(wave * u), 0.0)
        return value, np.where(inside, -0.5 * wave * np.sin(wave * u), 0.0)

    return shape


def _triangle(middle: float, length: float) -> Displacement:
    half = 0.5 * length
    sections = [Section("", "", 0.0, half, 0.0, 1.0), Section("", "", half, length, 1.0, 0.0)]
    profile = RoundedProfile(sections, length / 10.0)

    def shape(s: Array) -> tuple[Array, Array]:
        return profile(s - middle + half), profile.rate(s - middle + half)

    return shape


# measured and widening ----------------------------------------------------------------------------


@_displacement.register
def _measured(part: Measured, track: Track) -> Displacement:
    from scipy.interpolate import CubicHermiteSpline  # a quarter of a second; most need none

    positions, values, slopes = _interpolation(part)
    spline = CubicHermiteSpline(positions, values, slopes, axis=1)
    slope = spline.derivative()
    window = _window(positions[0], positions[-1], part.fade)

    def moved(s: Array) -> tuple[Array, Array]:
        at = np.clip(s, positions[0], positions[-1])
        return _windowed(spline(at), slope(at), *window(s))

    return moved


def _interpolation(part: Measured) -> tuple[Array, Array, Array]:
    """Positions of the rows [m], and displacements [m] and slopes [1] there by columns."""
    rows = np.array(part.rows)
    positions = rows[:, 0] + part.shift
    values = part.scale * rows[:, 1:].T
    return positions, values, np.stack([shape_preserving_slopes(positions, row) for row in values])


def _between(positions: Array, values: Array, slopes: Array) -> Array:
    """Cubic Hermite interpolation at seven positions within every interval between the rows."""
    h = np.diff(positions)
    t = _INNER
    basis = np.stack(
        ((1.0 + 2.0 * t) * (1.0 - t) ** 2, t * (1.0 - t) ** 2, t**2 * (3.0 - 2.0 * t),
         t**2 * (t - 1.0))
    )  # fmt: skip
    ends = (values[..., :-1], h * slopes[..., :-1], values[..., 1:], h * slopes[..., 1:])
    return np.asarray(np.stack(ends, axis=-1) @ basis)


@dataclass(frozen=True)
class Between:
    """Largest displacement of a record at its rows, and of the rails between them [m]."""

    column: str
    at_rows: float
    between: float
    s: float


def largest_between_rows(part: Measured) -> Between:
    """Return the largest displacement between the rows, of the column where it differs most.

    A record that does not resolve the shortest wave that it holds lets the rails go further than
    any row says.
    """
    positions, values, slopes = _interpolation(part)
    found = np.abs(_between(positions, values, slopes)).reshape(4, -1)
    inner = positions[:-1, None] + np.diff(positions)[:, None] * _INNER
    at_rows = np.abs(values).max(axis=1)
    further = np.where(at_rows > 0.0, found.max(axis=1) - at_rows, -np.inf)
    column = int(np.argmax(further))
    index = int(np.argmax(found[column]))
    return Between(
        COLUMNS[column],
        float(at_rows[column]),
        float(found[column, index]),
        float(inner.ravel()[index]),
    )


def measured_remarks(track: Track) -> list[str]:
    """Remark on records between whose rows the rails go further than the rows by 5 % or more."""
    remarks = []
    for index, part in enumerate(track.irregularities):
        if not isinstance(part, Measured):
            continue
        found = largest_between_rows(part)
        if found.between > BEYOND_ROWS * found.at_rows:
            remarks.append(
                f"The rails go further between the rows of irregularities.{index} than at them: "
                f"{found.column} reaches {1e3 * found.between:.3g} mm at s = {found.s:.1f} m, "
                f"the largest row is {1e3 * found.at_rows:.3g} mm."
            )
    return remarks


def shape_preserving_slopes(positions: Array, values: Array) -> Array:
    """Slopes at the rows for piecewise cubic interpolation without false waves.

    Those of the cubic spline where the rows resolve the wave; where the spline leaves the range of
    the four rows around an interval by more than a quarter of that range, the monotone ones of
    Fritsch and Butland (1984, SIAM J. Sci. Stat. Comput. 5) at both its ends.  A sine of six rows a
    wave leaves it by 0.15 at most.

    Parameters
    ----------
    positions : ndarray, shape (n,)
        Increasing arc lengths [m].
    values : ndarray, shape (n,)
        Displacements [m].

    Returns
    -------
    ndarray, shape (n,)
        Slopes [1].
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    slopes = CubicSpline(positions, values)(positions, 1)
    monotone = PchipInterpolator(positions, values)(positions, 1)
    padded = np.concatenate((values[:1], values, values[-1:]))
    around = np.stack([padded[i : i + len(values) - 1] for i in range(4)])
    low, high = around.min(axis=0), around.max(axis=0)
    allowed = OVERSHOOT * (high - low)
    while True:
        inside = _between(positions, values, slopes)
        lowest, highest = inside.min(axis=1), inside.max(axis=1)
        wrong = (lowest < low - allowed) | (highest > high + allowed)
        ends = np.zeros(len(positions), dtype=bool)
        ends[:-1] |= wrong
        ends[1:] |= wrong
        if not np.any(ends & (slopes != monotone)):
            return np.asarray(slopes)
        slopes = np.where(ends, monotone, slopes)


def _widening(track: Track) -> Displacement:
    rows = track.gauge_widening or ()
    left = _profile([(row[0], -row[1]) for row in rows], track.rounding)
    right = _profile([(row[0], row[2]) for row in rows], track.rounding)

    def moved(s: Array) -> tuple[Array, Array]:
        zero = np.zeros_like(s)
        return (
            np.stack((left(s), zero, right(s), zero)),
            np.stack((left.rate(s), zero, right.rate(s), zero)),
        )

    return moved


def _profile(points: Sequence[tuple[float, float]], rounding: float) -> RoundedProfile:
    """Rounded profile through points (s, value), constant beyond them."""
    first, value = points[0]
    sections = [
        Section("", "", begin[0] - first, end[0] - first, begin[1], end[1])
        for begin, end in pairwise(points)
    ]
    return RoundedProfile(sections or [Section("", "", 0.0, 1.0, value, value)], rounding, first)


# random -------------------------------------------------------------------------------------------


@_displacement.register
def _random(part: Random, track: Track) -> Displacement:
    from scipy.fft import next_fast_len

    spectrum = erri_b176(part.coefficients) if part.coefficients else SPECTRA[part.spectrum]
    end = track.length if part.end is None else part.end
    longest, shortest = part.wavelengths[1], part.wavelengths[0]
    period = max(end - part.begin, PERIOD_IN_WAVES * longest)
    n_points = next_fast_len(int(np.ceil(POINTS_PER_WAVE * period / shortest)), real=True)
    lattice = np.zeros((2, 4, n_points))
    for channel in part.channels or spectrum.channels:
        shares = part.scale * np.array(SHARES[channel])
        shares *= MIRROR[channel] if part.mirror else 1.0
        shares *= spectrum.half_base if channel == "cross_level" else 1.0
        amplitudes = _amplitudes(spectrum, channel, part.wavelengths, period)
        waves = _waves(amplitudes, _phases(part.seed, channel, amplitudes.size), period, n_points)
        for k in np.flatnonzero(shares):
            lattice[:, k] += shares[k] * waves
    window = _window(part.begin, end, part.fade)

    def moved(s: Array) -> tuple[Array, Array]:
        value, rate = _periodic(lattice, period, s - part.begin)
        return _windowed(value, rate, *window(s))

    return moved


def _amplitudes(
    spectrum: Spectrum, channel: str, wavelengths: Sequence[float], period: float
) -> Array:
    """Amplitude of each harmonic of the period, from the one of index 0 on."""
    step = 2.0 * np.pi / period
    low, high = 2.0 * np.pi / wavelengths[1], 2.0 * np.pi / wavelengths[0]
    middle = step * np.arange(int(np.ceil(high / step)) + 1)
    begin, end = np.clip([middle - 0.5 * step, middle + 0.5 * step], low, high)
    return np.sqrt(2.0 * spectrum.bin_variances(channel, begin, end))


def _phases(seed: int, channel: str, number: int) -> Array:
    """Random phases of a channel: the same for a seed whatever the other channels [rad]."""
    generator = np.random.default_rng([seed, CHANNELS.index(channel)])
    return generator.uniform(0.0, 2.0 * np.pi, number)


def _waves(amplitudes: Array, phases: Array, period: float, n_points: int) -> Array:
    """Sum of all harmonics and its rate on a lattice over the period, shape (2, n_points)."""
    harmonics = np.zeros(n_points // 2 + 1, dtype=complex)
    harmonics[: amplitudes.size] = 0.5 * n_points * amplitudes * np.exp(1j * phases)
    omega = 2.0 * np.pi / period * np.arange(harmonics.size)
    return np.fft.irfft(np.stack((harmonics, 1j * omega * harmonics)), n_points)


def _periodic(lattice: Array, period: float, u: Array) -> tuple[Array, Array]:
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


# sweep --------------------------------------------------------------------------------------------


@_displacement.register
def _sweep(part: Sweep, track: Track) -> Displacement:
    """A sin(phase) with d phase/ds = 2 pi/wavelength, the wavelength changing exponentially.

    With u = (s - begin)/length and r = first/last wavelength: wavelength = first r^-u and
    phase = 2 pi length (r^u - 1)/(first ln r).
    """
    from scipy.special import exprel  # (e^x - 1)/x, also at one wavelength

    first, last = part.wavelengths
    length, octaves = part.end - part.begin, np.log(first / last)
    shares = part.amplitude * np.array(SHARES[part.channel])
    if part.channel == "cross_level":
        shares *= 0.5  # each rail has half of the difference
    window = _window(part.begin, part.end, part.fade)

    def moved(s: Array) -> tuple[Array, Array]:
        u = np.clip((s - part.begin) / length, 0.0, 1.0)
        waves = length / first * u * exprel(octaves * u)
        rate = 2.0 * np.pi / first * np.exp(octaves * u)
        value = shares[:, None] * np.sin(2.0 * np.pi * waves)
        slope = shares[:, None] * rate * np.cos(2.0 * np.pi * waves)
        return _windowed(value, slope, *window(s))

    return moved


# fading -------------------------------------------------------------------------------------------


def _window(begin: float, end: float, fade: float) -> Displacement:
    """Window that rises from 0 to 1 behind `begin` and falls to 0 before `end`, with its rate."""
    length = min(fade, 0.5 * (end - begin))

    def window(s: Array) -> tuple[Array, Array]:
        inside = ((s >= begin) & (s < end)).astype(float)
        if length == 0.0:
            return inside, np.zeros_like(s)
        depth = np.minimum(s - begin, end - s)
        angle = np.pi * np.clip(depth / length, 0.0, 1.0)
        side = np.where(s - begin < end - s, 1.0, -1.0)
        rate = side * 0.5 * np.pi / length * np.sin(angle)
        return inside * 0.5 * (1.0 - np.cos(angle)), inside * rate

    return window


def _windowed(value: Array, rate: Array, window: Array, slope: Array) -> tuple[Array, Array]:
    return window * value, window * rate + slope * value
