"""Waves of one amplitude over a range of wavelengths."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from railsim.arrays import Floats
from railsim.definitions.base import Finite, NonNegative
from railsim.definitions.excitations import base

Wavelength = Annotated[Finite, Field(ge=0.2, le=1000.0)]


class Sweep(base.Stretch):
    """Waves of one amplitude whose wavelength goes from one value to another.

    Each octave of wavelengths takes the same length of track.
    """

    type: Literal["sweep"]
    channel: base.Channel = "vertical"
    """Which of the four irregularities: both rails to the right or down, the left rail higher, or
    the rails apart"""
    amplitude: base.Amplitude
    """Amplitude of the waves; of `cross_level` the difference of heights, of `gauge` that of the
    gauge [m]"""
    wavelengths: tuple[Wavelength, Wavelength]
    """Wavelength at the beginning and at the end, rising or falling [m]"""
    begin: Finite
    """Arc length where it begins, at a zero of the wave [m]"""
    end: Finite
    """Arc length where it ends [m]"""
    fade: NonNegative = 10.0
    """Length over which it fades in and out within its ends [m]"""

    def mirrored(self) -> Self:
        """Return the mirror image: what goes to the right or rises on the left is turned round."""
        return self.model_copy(update={"amplitude": base.MIRROR[self.channel] * self.amplitude})

    def resolution(self) -> float:
        """Return a sixteenth of the shorter wavelength [m]."""
        return min(self.wavelengths) / 16.0

    def summary(self) -> str:
        """Return channel, amplitude and wavelengths."""
        first, last = self.wavelengths
        return f"{self.channel} sweep, {1e3 * self.amplitude:g} mm, {first:g} to {last:g} m"

    def displacement(self, length: float) -> base.Displacement:
        """Return A sin(phase), d phase/ds = 2 pi/wavelength, which changes exponentially.

        With u = (s - begin)/length and r = first/last wavelength: wavelength = first r^-u and
        phase = 2 pi length (r^u - 1)/(first ln r).
        """
        from scipy.special import exprel  # (e^x - 1)/x, also at one wavelength

        first, last = self.wavelengths
        extent, octaves = self.end - self.begin, np.log(first / last)
        shares = self.amplitude * base.rails_moved(self.channel)

        def value_and_rate(s: Floats) -> tuple[Floats, Floats]:
            u = np.clip((s - self.begin) / extent, 0.0, 1.0)
            waves = extent / first * u * exprel(octaves * u)
            rate = 2.0 * np.pi / first * np.exp(octaves * u)
            phase = 2.0 * np.pi * waves
            return shares * np.sin(phase), shares * rate * np.cos(phase)

        return base.faded(value_and_rate, self.begin, self.end, self.fade)
