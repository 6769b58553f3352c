"""Power spectral densities of track irregularities, by name.

A spectrum is a function with its own variable (angular wave number omega = 2 pi / wavelength in
rad/m, or spatial frequency f = 1 / wavelength in 1/m), unit and form.  All are taken **one-sided**:
the variance is the integral of S over the positive variable.  `Spectrum.density` converts each to
S(omega) in m2/(rad/m); the cross level, whatever the form in the source, to that of the angle
(height difference over the rails' distance) in rad2/(rad/m).

Source quality of the coefficients: [R] table re-entered in public code that names its source, [M]
from memory and confirmed in one value only.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.base import Definition, NonNegative, Positive, check
from railsim.definitions.excitations.base import CHANNELS

Density = Callable[[Floats], Floats]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


class Coefficients(Definition):
    """Coefficients of the spectra; form and meaning in the manual."""

    lateral: NonNegative = 0.0
    """A_a of the alignment [m rad]"""
    vertical: NonNegative = 0.0
    """A_v of the longitudinal level [m rad]"""
    cross_level: NonNegative = 0.0
    """Coefficient of the cross level, A_v in ERRI B176; 0: no cross level [m rad]"""
    gauge: NonNegative = 0.0
    """A_g of the gauge [m rad]"""
    omega_c: Positive = 0.8246
    """[rad/m]"""
    omega_r: Positive = 0.0206
    """[rad/m]"""
    omega_s: Positive = 0.4380
    """[rad/m]"""
    b: Positive = 0.75
    """Half the distance of the rails that the cross level refers to [m]"""

    @check
    def _not_all_zero(self) -> None:
        if not any((self.lateral, self.vertical, self.cross_level, self.gauge)):
            raise ValueError("all are 0: give 'lateral', 'vertical', 'cross_level' or 'gauge'")


@dataclass(frozen=True)
class Spectrum:
    """One-sided spectra of the irregularities that a source describes."""

    label: str  # in tables and plots
    source: str  # of the coefficients, with its quality
    # by channel (`lateral`, `vertical`, `cross_level`, `gauge`): S over the source's variable
    densities: Mapping[str, Density]
    per_cycle: bool = False  # the variable is the spatial frequency f [1/m]; else omega [rad/m]
    unit: float = 1.0  # of the source's S, in m2 per unit of the variable (1e-6 for mm2)
    # half the distance between the rails to which the cross level refers [m]
    half_base: float = 0.75
    # the source gives the cross level as a height difference; else as an angle
    cross_level_is_height: bool = True

    @property
    def channels(self) -> tuple[str, ...]:
        """Irregularities that the source describes."""
        return tuple(channel for channel in CHANNELS if channel in self.densities)

    def density(self, channel: str, omega: Floats) -> Floats:
        """One-sided power spectral density over the angular wave number.

        `channel`: one of `channels`; `omega`: angular wave number [rad/m]. Returns: S(omega)
        [m2/(rad/m)], of the cross level [rad2/(rad/m)].
        """
        factor = 1.0 / (2.0 * np.pi) if self.per_cycle else 1.0
        variable = factor * omega
        if channel == "cross_level" and self.cross_level_is_height:
            factor /= (2.0 * self.half_base) ** 2
        return np.asarray(factor * self.unit * self.densities[channel](variable))

    def bin_variances(self, channel: str, begin: Floats, end: Floats) -> Floats:
        """Integrals of S over the bins from `begin` to `end` [rad/m]: m2, of the cross level rad2.

        Gauss and Legendre with five nodes a bin.
        """
        half = 0.5 * (end - begin)
        omega = (begin + half)[:, None] + half[:, None] * _NODES
        return np.asarray(half * (self.density(channel, omega) @ _WEIGHTS))

    def band_variance(self, channel: str, wavelengths: Sequence[float]) -> float:
        """Variance between the shortest and longest wavelength [m]: m2, of the cross level rad2."""
        low, high = 2.0 * np.pi / wavelengths[1], 2.0 * np.pi / wavelengths[0]
        edges = np.geomspace(low, high, 201)
        return float(np.sum(self.bin_variances(channel, edges[:-1], edges[1:])))


# forms --------------------------------------------------------------------------------------------


def erri_b176(coefficients: Coefficients, label: str = "own coefficients") -> Spectrum:
    """Spectra of the form of ERRI B176 (1993), over omega.

    S(omega) = A omega_c^2 / ((omega^2 + omega_r^2)(omega^2 + omega_c^2)) for lateral and vertical;
    the same times omega^2 / (omega^2 + omega_s^2) for the gauge, and divided by b^2 for the cross
    level, an angle.  The form of the gauge's spectrum is that of the cross level without 1/b^2, as
    in the German spectra (assumed).
    """
    c = coefficients

    def level(A: float) -> Density:
        return lambda w: A * c.omega_c**2 / ((w**2 + c.omega_r**2) * (w**2 + c.omega_c**2))

    def steep(A: float) -> Density:
        return lambda w: level(A)(w) * w**2 / (w**2 + c.omega_s**2)

    return Spectrum(
        label,
        "ERRI B176 (1993), three agreeing public re-entries [R]",
        {
            "lateral": level(c.lateral),
            "vertical": level(c.vertical),
            "cross_level": steep(c.cross_level / c.b**2),
            "gauge": steep(c.gauge),
        },
        half_base=c.b,
        cross_level_is_height=False,
    )


def fra(A_v: float, A_a: float, omega_s: float, label: str) -> Spectrum:
    """Spectra of the American track classes, over omega, coefficients in 1e-4 m2 rad/m.

    S = 0.25 A omega_c^2 / (omega^2 (omega^2 + omega_c^2)) for level (A_v) and alignment (A_a),
    S = A_v omega_c^2 / ((omega^2 + omega_c^2)(omega^2 + omega_s^2)) for cross level (a height) and
    gauge, omega_c = 0.8245 rad/m.
    """
    omega_c = 0.8245

    def level(A: float) -> Density:
        return lambda w: 0.25e-4 * A * omega_c**2 / (w**2 * (w**2 + omega_c**2))

    def cross(w: Floats) -> Floats:
        return 1e-4 * A_v * omega_c**2 / ((w**2 + omega_c**2) * (w**2 + omega_s**2))

    return Spectrum(
        label,
        "Federal Railroad Administration, from memory, one value confirmed [M]",
        {"lateral": level(A_a), "vertical": level(A_v), "cross_level": cross, "gauge": cross},
    )


def fra_1983(A_level: float, A_alignment: float, A_cross: float, label: str) -> Spectrum:
    """Spectra of the American track classes in the form of 1983, over f, 1e-7 m2/(1/m).

    S = A f2^2 (f^2 + f1^2) / (f^4 (f^2 + f2^2)) for level and alignment,
    S = A f2^2 / ((f^2 + f1^2)(f^2 + f2^2)) for cross level (a height) and gauge, the latter with
    the alignment's A.
    """

    def level(A: float, f1: float, f2: float) -> Density:
        return lambda f: 1e-7 * A * f2**2 * (f**2 + f1**2) / (f**4 * (f**2 + f2**2))

    def cross(A: float, f1: float, f2: float) -> Density:
        return lambda f: 1e-7 * A * f2**2 / ((f**2 + f1**2) * (f**2 + f2**2))

    return Spectrum(
        label,
        "Federal Railroad Administration (1983), re-entered in public code [R]",
        {
            "lateral": level(A_alignment, 0.0328, 0.1837),
            "vertical": level(A_level, 0.0233, 0.1312),
            "cross_level": cross(A_cross, 0.0233, 0.1312),
            "gauge": cross(A_alignment, 0.0292, 0.2329),
        },
        per_cycle=True,
    )


def power_laws(breaks: Sequence[float], A: Sequence[float], n: Sequence[float]) -> Density:
    """S = A_i / f^n_i, the i-th law up to the i-th break and the last one beyond."""
    edges, factors, powers = np.array(breaks), np.array(A), np.array(n)

    def density(f: Floats) -> Floats:
        piece = np.searchsorted(edges, f)
        return np.asarray(factors[piece] / f ** powers[piece])

    return density


def rational(A: float, B: float, C: float, D: float, E: float, F: float, G: float) -> Density:
    """S = A (f^2 + B f + C) / (f^4 + D f^3 + E f^2 + F f + G)."""
    return lambda f: A * (f**2 + B * f + C) / (f**4 + D * f**3 + E * f**2 + F * f + G)


# what stands under a name -------------------------------------------------------------------------

ERRI_B176 = {
    "erri_b176_low": Coefficients(
        lateral=2.119e-7, vertical=4.032e-7, cross_level=4.032e-7, gauge=5.32e-8
    ),
    "erri_b176_high": Coefficients(
        lateral=6.125e-7, vertical=1.080e-6, cross_level=1.080e-6, gauge=1.032e-7
    ),
}
# class 1 to 6: A_v, A_a [1e-4 m2 rad/m], omega_s [rad/m]
_FRA = (
    (1.2107, 3.3634, 0.6046),
    (1.0181, 1.2107, 0.9308),
    (0.6816, 0.4128, 0.8520),
    (0.5376, 0.3027, 1.1312),
    (0.2095, 0.0762, 0.8209),
    (0.0339, 0.0339, 0.4380),
)
# class 1 to 6: A of level, alignment, cross level [1e-7 m2/(1/m)]
_FRA_1983 = (
    (16.7217, 10.5833, 4.8683),
    (9.525, 5.9267, 3.3867),
    (5.2917, 3.3867, 2.3283),
    (2.9633, 1.8838, 1.5663),
    (1.6722, 1.0583, 1.0583),
    (0.9525, 0.5927, 0.7197),
)

SPECTRA: dict[str, Spectrum] = {
    "erri_b176_low": erri_b176(ERRI_B176["erri_b176_low"], "ERRI B176, low"),
    "erri_b176_high": erri_b176(ERRI_B176["erri_b176_high"], "ERRI B176, high"),
    **{f"fra_{i}": fra(*row, label=f"FRA class {i}") for i, row in enumerate(_FRA, 1)},
    **{
        f"fra_1983_{i}": fra_1983(*row, label=f"FRA class {i}, form of 1983")
        for i, row in enumerate(_FRA_1983, 1)
    },
    "china_high_speed": Spectrum(
        "Chinese high-speed ballastless track",
        "TB/T 3352, re-entered in public code [R]",
        {
            "lateral": power_laws(
                (0.045, 0.1234), (3.9513e-3, 1.1047e-2, 7.5633e-4), (1.867, 1.5354, 2.8171)
            ),
            "vertical": power_laws(
                (0.0187, 0.0474, 0.1533),
                (1.0544e-5, 3.5588e-3, 1.9784e-2, 3.9488e-4),
                (3.3891, 1.9271, 1.3643, 3.4516),
            ),
            "cross_level": power_laws(
                (0.0258, 0.1163), (3.6148e-3, 4.3685e-2, 4.5867e-3), (1.7278, 1.0461, 2.0939)
            ),
            "gauge": power_laws(
                (0.109, 0.2938), (5.4978e-2, 5.0701e-3, 1.8778e-4), (0.8282, 1.9037, 4.5948)
            ),
        },
        per_cycle=True,
        unit=1e-6,
    ),
    # of the left rail in the source; here of both rails
    "china_trunk": Spectrum(
        "Chinese trunk lines",
        "spectra of three Chinese trunk lines, re-entered in public code [R]",
        {
            "lateral": rational(0.2244, -1.5746, 0.6683, -2.1466, 1.7665, -0.1506, 0.0052),
            "vertical": rational(1.1029, -1.4709, 0.5941, 0.8480, 3.8016, -0.2500, 0.0112),
            "cross_level": rational(0.1214, -2.1603, 2.0214, 4.5089, 2.2227, -0.0396, 0.0073),
        },
        per_cycle=True,
        unit=1e-6,
    ),
}
