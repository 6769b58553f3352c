"""Wear and rolling contact fatigue from the wear number and the forces of the patches.

Laws for single values, each with its source; `assessment/wear_report.py` applies them to results.
The wear number T_gamma = T_x xi_x + T_y xi_y [N] is the energy dissipated per metre, without spin.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.loading import load_wear_law
from railsim.definitions.wear_law import ArchardMap, FrictionWork
from railsim.errors import argument_error, input_error

YIELD_IN_SHEAR = 300e6  # yield stress in shear k of rail steel, default value [Pa]

DENSITY = 7850.0  # density of wheel and rail steel [kg/m3]


@dataclass(frozen=True)
class Patches:
    """Contact patches, arrays alike or broadcast; only laws of files need N, friction and speed."""

    T_gamma: Floats  # wear number of each patch [N]
    area: Floats  # its area, zero where it carries nothing [m2]
    diameter: float | Floats  # diameter of its wheel [m]
    N: Floats | float = math.nan  # normal force [N]
    friction: Floats | float = math.nan  # coefficient [1]
    speed: Floats | float = math.nan  # of travel [m/s]


def _pearce_sherratt(patches: Patches) -> Floats:
    return pearce_sherratt_1991(patches.T_gamma, patches.diameter)


def _usfd(patches: Patches) -> Floats:
    mass = usfd(_over(patches.T_gamma, patches.area)) * patches.area
    return np.asarray(mass / (DENSITY * np.pi * patches.diameter))


def _over(part: Floats, whole: Floats | float) -> Floats:
    """Quotient, zero where there is nothing to divide by."""
    whole = np.asarray(whole)
    return np.where(whole > 0.0, part / np.where(whole > 0.0, whole, 1.0), 0.0)


def archard(patches: Patches, law: ArchardMap) -> Floats:
    """Worn area of a wheel profile per distance (Archard 1953, J. Appl. Phys. 24, V = k N s/H).

    Where the patch slides its traction is mu p, and only there energy is lost: N s, the sum of
    pressure times sliding distance, is T_gamma/mu per metre, also in partial slip.  The coefficient
    k is that of the map (Jendel 2002, Wear 253) at the patch's largest pressure and at its sliding
    speed, mean over the load, V T_gamma/(mu N).

    Returns: [m2/m].
    """
    sliding = _over(np.maximum(patches.T_gamma, 0.0), patches.friction)
    speed = _over(patches.speed * sliding, patches.N)
    first, second = law.speeds
    k = np.where(speed < first, law.slow, np.where(speed < second, law.medium, law.fast))
    pressure = _over(1.5 * np.asarray(patches.N), patches.area)
    k = np.where(pressure > law.pressure * law.hardness, law.seizure, k)
    return np.asarray(k * sliding / law.hardness / (np.pi * patches.diameter))


def krause_poll(patches: Patches, law: FrictionWork) -> Floats:
    """Worn area of a wheel profile per distance (Krause and Poll 1986, Wear 113).

    The mass is proportional to the work of friction, by a factor that changes from mild to severe
    wear at a power of friction over the area of the patch.

    Returns: [m2/m].
    """
    work = np.maximum(patches.T_gamma, 0.0)
    severe = _over(patches.speed * work, patches.area) > law.transition
    mass = np.where(severe, law.severe, law.mild) * work
    return np.asarray(mass / (DENSITY * np.pi * patches.diameter))


@dataclass(frozen=True)
class WearLaw:
    """A law for the wear of a wheel."""

    name: str  # in heads of columns
    source: str  # authors and year
    # of the wheel profile per distance, patch by patch [m2/m]
    worn_area: Callable[[Patches], Floats]
    constants: str = ""  # text of its file


LAWS = {
    "pearce_sherratt": WearLaw("Pearce", "Pearce and Sherratt (1991)", _pearce_sherratt),
    "usfd": WearLaw("USFD", "University of Sheffield (Braghin et al. 2006)", _usfd),
}
"""Laws of wear by name: a further law is added here."""
DEFAULT_LAW = "pearce_sherratt"


def wear_law(name: str) -> WearLaw:
    """Law of the table, or of a file.

    `name`: A name of `LAWS`, or the path of a file `railsim-wear-law/1`. Raises InputError: there
    is neither; the file is not one of a law.
    """
    if name in LAWS:
        return LAWS[name]
    if not name.endswith(".toml"):
        allowed = "one of " + ", ".join(LAWS) + ", or a file .toml"
        raise argument_error("law", f"found '{name}'", allowed)
    file = load_wear_law(name)
    if file.archard is not None:
        law: Callable[[Patches], Floats] = partial(archard, law=file.archard)
    elif file.krause_poll is not None:
        law = partial(krause_poll, law=file.krause_poll)
    else:
        allowed = "archard or krause_poll; whole_life_rail_model is only for `railsim assess`"
        raise input_error(name, "no law of wear", allowed)
    return WearLaw(file.name, f"{file.name} ({file.source})", law, file.to_toml())


def laws_and_rail_model(law: str | None) -> tuple[dict[str, WearLaw], "WholeLifeRailModel"]:
    """Laws by name and model of the rail that `law` stands for: None, a name or a file."""
    file = load_wear_law(law) if law and law.endswith(".toml") else None
    rail = file and file.whole_life_rail_model
    model = WholeLifeRailModel(**rail.model_dump()) if rail else WholeLifeRailModel()
    if law is None or (file and file.archard is None and file.krause_poll is None):
        return dict(LAWS), model
    return {law: wear_law(law)}, model


def pearce_sherratt_1991(T_gamma: Floats, diameter: float | Floats) -> Floats:
    """Worn area of a wheel profile per distance (Pearce and Sherratt 1991, Wear 144; from memory).

    In mm2/km, D in mm: 0.25 T/D below 100 N, 25/D to 200 N, (1.19 T - 154)/D above.  The last
    branch begins at 84/D: the law is discontinuous at 200 N.  It holds for one contact: the worn
    areas of several patches are added, not their wear numbers.  Where spin drives the force against
    the creepage, T_gamma below zero, there is no wear.

    `T_gamma`: Wear number [N]. `diameter`: Wheel diameter [m]. Returns: Worn area per distance
    [m2/m].

    >>> worn = pearce_sherratt_1991(np.array([50.0, 150.0, 250.0]), 0.92)
    >>> (1e9 * worn).round(5).tolist()  # mm2/km
    [0.01359, 0.02717, 0.15598]
    """
    T = np.asarray(T_gamma, dtype=np.float64)
    per_km = np.where(
        T < 100.0, 0.25 * np.maximum(T, 0.0), np.where(T <= 200.0, 25.0, 1.19 * T - 154.0)
    )
    return np.asarray(per_km / (diameter * 1e3) * 1e-9)


def usfd(T_gamma_over_A: Floats) -> Floats:
    """Mass loss of a wheel, R8T on 900A (University of Sheffield; Braghin et al. 2006, Wear 261).

    In ug/(m mm2) over x = T_gamma/A in N/mm2, T_gamma and A of one patch: 5.3 x to 10.4; 55.0 to
    77.2; 55.0 + 61.9 (x - 77.2).  None below zero.

    `T_gamma_over_A`: Wear number over the area of the patch [N/m2]. Returns: Mass loss per metre
    rolled and square metre of contact patch [kg/m/m2].

    >>> (1e3 * usfd(1e6 * np.array([5.0, 40.0, 100.0]))).round(1).tolist()  # ug/(m mm2)
    [26.5, 55.0, 1466.3]
    """
    x = np.maximum(np.asarray(T_gamma_over_A, dtype=np.float64), 0.0) * 1e-6
    rate = np.where(x <= 10.4, 5.3 * x, np.where(x <= 77.2, 55.0, 55.0 + 61.9 * (x - 77.2)))
    return np.asarray(rate * 1e-3)


@dataclass(frozen=True)
class WholeLifeRailModel:
    """Fatigue damage of a rail per passing axle (Burstow 2004, RSSB T115), R220 rail.

    Zero up to `threshold`, linear to 10e-6 at 65 N, linear to 0 at 175 N and, on the same line,
    negative above: there wear is faster than crack growth.
    """

    threshold: float = 15.0  # wear number [N]; from memory, 20 in later use
    peak: float = 65.0
    balance: float = 175.0
    damage: float = 10e-6
    counted: str = "against"  # travel, along it or all: direction of the forces on the rail

    def __call__(self, T_gamma: Floats) -> Floats:
        """Damage of one passing axle [1].

        >>> (1e6 * WholeLifeRailModel()(np.array([10.0, 40.0, 65.0, 120.0, 230.0]))).tolist()
        [0.0, 5.0, 10.0, 5.0, -5.0]
        """
        T = np.asarray(T_gamma, dtype=np.float64)
        rising = (T - self.threshold) / (self.peak - self.threshold)
        falling = (self.balance - T) / (self.balance - self.peak)
        growth, removal = np.maximum(np.minimum(rising, falling), 0.0), np.minimum(falling, 0.0)
        return np.asarray(self.damage * growth + self.damage * removal)

    def patch_damage(self, T_gamma: Floats, along: Floats) -> Floats:
        """Damage by patches whose forces on the rail along travel have the sign of `along` [1]."""
        sign = {"against": -1.0, "along": 1.0}.get(self.counted)
        counts = True if sign is None else sign * along > 0.0
        return np.where(counts, self(T_gamma), 0.0)


def surface_fatigue_index(
    traction: Floats, N: Floats, a: Floats, b: Floats, k: float = YIELD_IN_SHEAR
) -> Floats:
    """Fatigue index of the surface (Ekberg, Kabo and Andersson 2002).

    FI_surf = mu_u - 2 pi a b k/(3 N) = mu_u - k/p0, mu_u = T/N: above zero the shakedown limit of
    the surface is exceeded (Johnson 1989).

    `traction`, `N`: Tangential and normal force of the patch [N]. `a`, `b`: Semi-axes [m]. `k`:
    Yield stress in shear [Pa].
    """
    return np.asarray(traction / N - 2.0 * np.pi * a * b * k / (3.0 * N))


def shakedown_limit(mu_u: Floats) -> Floats:
    """Elastic shakedown limit p0/k over the utilised friction, as in the shakedown map.

    The smaller of 4 (yield below the surface: line contact without friction) and 1/mu_u (yield at
    the surface; Johnson 1989).
    """
    mu = np.asarray(mu_u, dtype=np.float64)
    return np.minimum(4.0, 1.0 / np.maximum(mu, 1e-9))
