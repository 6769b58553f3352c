"""What a recording car writes into what a track needs: chord offsets, bands of wavelengths.

Both work on rows at equal steps, by their discrete Fourier transform.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.arrays import Floats

Gain = Callable[[Floats], NDArray[Any]]

# Bands of wavelengths of EN 13848-1 [m].
BANDS = {"D1": (3.0, 25.0), "D2": (25.0, 70.0), "D3": (70.0, 150.0)}
ORDER = 4  # of the Butterworth band pass
# Share of its largest value below which a chord's response is taken as blind: there the space curve
# cannot be recovered, and stays zero.
BLIND = 0.1


def band_passed(values: Floats, step: float, wavelengths: tuple[float, float]) -> Floats:
    """Butterworth band pass of order 4 by its magnitude alone: no phase.

    |H| = 1 / sqrt((1 + (l/f)^8)(1 + (f/h)^8)) with the band's limits l, h and the spatial
    frequency f (EN 13848-1: order 4 and the bands D1 to D3).

    `values`, shape (n_columns, n): rows at equal steps [m]; `step`: distance between rows [m];
    `wavelengths`: shortest and longest wavelength [m].
    """
    reflected = np.concatenate((values, values[:, ::-1]), axis=1)
    return _filtered(reflected, step, band_gain(wavelengths))[:, : values.shape[1]]


def band_gain(wavelengths: tuple[float, float]) -> Gain:
    """Magnitude of the band pass of `band_passed` over the spatial frequency [1/m]."""
    low, high = 1.0 / wavelengths[1], 1.0 / wavelengths[0]

    def gain(f: Floats) -> Floats:
        with np.errstate(divide="ignore"):
            below = np.where(f > 0.0, low / f, np.inf) ** (2 * ORDER)
        return np.asarray(1.0 / np.sqrt((1.0 + below) * (1.0 + (f / high) ** (2 * ORDER))))

    return gain


def from_chord(values: Floats, step: float, chord: tuple[float, float]) -> Floats:
    """Space curve of offsets measured at a chord.

    The offset at s over a chord from s - a to s + b is v(s) = y(s) - (b y(s - a) + a y(s + b))/(a +
    b), hence V(f) = Y(f) (1 - (b exp(-i 2 pi f a) + a exp(i 2 pi f b))/(a + b)); inverted where the
    response exceeds a tenth of its largest value, zero elsewhere (EN 13848-1 on decolouring).

    `values`, shape (n_columns, n): offsets at equal steps [m]; `step`: distance between rows [m];
    `chord`: parts a behind and b ahead of the measuring point [m].
    """
    a, b = chord

    def gain(f: Floats) -> NDArray[np.complex128]:
        turn = 2j * np.pi * f
        response = 1.0 - (b * np.exp(-turn * a) + a * np.exp(turn * b)) / (a + b)
        blind = np.abs(response) < BLIND * np.max(np.abs(response))
        return np.where(blind, 0.0, 1.0 / np.where(blind, 1.0, response))

    # without the reflection at the ends, which would turn an unsymmetrical chord round
    return _filtered(values, step, gain)


def _filtered(values: Floats, step: float, gain: Gain) -> Floats:
    n = values.shape[1]
    factors = gain(np.fft.rfftfreq(n, step).astype(float))
    return np.asarray(np.fft.irfft(np.fft.rfft(values, axis=1) * factors, n, axis=1))
