"""The assessed quantities (EN 14363:2016 with A2:2022, UIC 518): one row of `CRITERIA` each.

A row says what is measured in a section (signal, filter, value), how the values of the sections
become an estimate, and which verdict it belongs to; its limit stands under its name in the limits
file, with the law by which it depends on vehicle and track (`railsim.definitions.limits`).  Filters
are of order 4 and zero phase by default.

Signs: in curves an outward force is positive, and so is the lateral acceleration with cant
deficiency; the outer wheel is assessed; left and right curves are pooled.  On straight track both
percentiles of a signed quantity are values.  A window of 2 m lies within its section.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from railsim.arrays import Floats
from railsim.assessment import signals as signal
from railsim.assessment.sections import TestSection
from railsim.assessment.signals import Band, Signal, Signals
from railsim.definitions.vehicle.flatten import flatten
from railsim.notation import DECIMALS
from railsim.result.filters import distance_means, window_centres
from railsim.table import beside

if TYPE_CHECKING:
    from railsim.contact.geometry import ContactGeometry

SAFETY, LOADING, RIDE, INFORMATION = "safety", "loading", "ride", "information"
VERDICTS = (SAFETY, LOADING, RIDE)
DYNAMIC = (SAFETY, LOADING)  # of groups and kinds: what is given for transitions
WORDS = {
    SAFETY: "running safety", LOADING: "track loading", RIDE: "ride",
    INFORMATION: "for information",
}  # fmt: skip
LOW, HIGH = 0.15, 99.85  # per cent
FORCES: Band = (None, 20.0)  # Hz
RIDE_BAND: Band = (0.4, 10.0)
HALF_BAND, LOWEST = 2.0, 0.4  # Hz, of the instability filter
HUNTING_ZONES = ("1", "2")
RMS_LENGTH, RMS_STEP = 100.0, 10.0  # m
FLANGE = 0.5  # rad, contact angle from which the flange counts as touching
OUTER, INNER, ALL = ("", "outer", "left", "right"), ("inner",), ("outer", "inner", "left", "right")

Values = dict[str, list[float]]
"""By place: one value of a section, or both percentiles on straight track [SI]."""


def both_ends(x: Floats, _: int) -> list[float]:
    """Both percentiles, upwards, also in curves."""
    low, high = np.percentile(x, (LOW, HIGH))
    return [float(-low), float(high)]


def outer_end(x: Floats, turn: int) -> list[float]:
    """Percentile to the outside of a curve; both on straight track."""
    return high(x, turn) if turn else both_ends(x, turn)


def high(x: Floats, _: int) -> list[float]:
    """99.85 % value."""
    return [float(np.percentile(x, HIGH))] if len(x) else []


def low(x: Floats, _: int) -> list[float]:
    """0.15 % value."""
    return [float(np.percentile(x, LOW))]


def middle(x: Floats, _: int) -> list[float]:
    """50 % value."""
    return [float(np.median(x))]


def mean_of_known(x: Floats, _: int) -> list[float]:
    """Mean where there is a value."""
    known = x[~np.isnan(x)]
    return [float(np.mean(known))] if len(known) else []


def rms(x: Floats, _: int) -> list[float]:
    """Root mean square."""
    return [float(np.sqrt(np.mean(x**2)))]


def outward_high(x: Floats, turn: int) -> list[float]:
    """99.85 % value of what has moved outwards, on straight track to either side."""
    return high(x if turn else np.abs(x), turn)


@dataclass(frozen=True)
class Measured:
    """What is measured of a signal in a section."""

    # of the filtered quantities, see `railsim.assessment.signals`
    signal: Callable[[Signals, Band | None], Signal | None]
    band: Band | None  # filter [Hz]
    # of a section: from the values over time, outwards positive where the signal has a sense, and
    # its turn (1 right, -1 left, 0 straight)
    value: Callable[[Floats, int], list[float]]
    window: float = 0.0  # means over this length are taken before [m]; 0: none
    wheels: tuple[str, ...] = OUTER  # wheels that are assessed
    curves: bool = False  # in curves only
    outwards: int = 0  # sense that is outwards in right-hand curves: -1 of forces on the rails

    def __call__(self, signals: Signals, section: TestSection) -> Values:
        """Values of a section by place."""
        signal = signals.signal(self.signal, self.band)
        if signal is None or (self.curves and not section.turn):
            return {}
        by_place = {}
        for k, (label, side) in enumerate(signal.places):
            wheel = section.wheel(side)
            if side is not None and wheel not in self.wheels:
                continue
            values = signal.in_section(k, section, self.window)
            if len(values) and (value := self.evaluate(values, section.turn)):
                by_place[f"{label} {wheel}".rstrip()] = value
        return by_place

    def evaluate(self, x: Floats, turn: int) -> list[float]:
        """Value of a section from those of its signal over time."""
        return self.value((self.outwards * turn or 1) * x, turn)


@dataclass(frozen=True)
class Instability:
    """Largest rms over 100 m of a signal within 2 Hz of f0, in zones 1 and 2.

    The window has the length of the section where this is shorter.
    """

    signal: Callable[[Signals, Band | None], Signal | None]

    def __call__(self, signals: Signals, section: TestSection) -> Values:
        """Value of a section by place."""
        if (f0 := signals.f0) is None or section.zone not in HUNTING_ZONES:
            return {}
        signal = signals.signal(self.signal, (max(f0 - HALF_BAND, LOWEST), f0 + HALF_BAND))
        if signal is None:
            return {}
        length = min(RMS_LENGTH, section.end - section.begin)
        centres = window_centres(section.begin, section.end, length, RMS_STEP)
        by_place = {}
        for k, (place, _) in enumerate(signal.places):
            rows = signal.rows(k, section)
            s, square = signal.s[rows, k], np.square(signal.values[rows, k])
            largest = np.max(distance_means(s, square, centres, length))
            by_place[place] = [math.sqrt(max(float(largest), 0.0))]
        return by_place


def steering(signals: Signals, section: TestSection) -> Values:
    """Steering index of the leading wheelset, with the gauge in the middle of a curve's section."""
    if not section.turn:
        return {}
    rows = np.array(signals.record.result.track().gauge_widening or [[0.0, 0.0, 0.0]])
    middle = 0.5 * (section.begin + section.end)
    geometry = signals.record.geometry_with(
        float(np.interp(middle, rows[:, 0], rows[:, 1:].sum(1)))
    )
    wheelset = flatten(signals.record.result.vehicle()).of_kind("wheelset")[0].wheelset
    if geometry is None or wheelset is None:
        return {}
    index = steering_index(geometry, section.radius, float(np.mean(wheelset.radius)))
    return {} if math.isnan(index) else {"wheelset 1": [index]}


def steering_index(geometry: "ContactGeometry", radius: float, rolling_radius: float) -> float:
    """Radius difference for rolling without creep, over that before the flange; nan if unknown [1].

    e r0/R with the distance e of the contact points (Redtenbacher 1855), over the largest one that
    the profiles offer before the flange makes contact: above 1 the wheelset cannot steer without
    its flange.

    `geometry`: Contact functions of the leading wheelset. `radius`: Of the curve, positive to the
    right: there the wheelset moves to the left [m]. `rolling_radius`: Of the wheels [m].
    """
    outwards = -math.copysign(1.0, radius)
    y, difference = outwards * geometry.lateral, outwards * np.asarray(geometry.delta_r)
    ahead = np.flatnonzero((y >= 0.0) & np.isfinite(difference))
    ahead = ahead[np.argsort(y[ahead])]
    touching = ahead[np.abs(geometry.contact_angle[ahead]).max(axis=1) > FLANGE]
    free = ahead[y[ahead] < y[touching[0]]] if len(touching) else ahead[:0]
    if not len(free) or difference[free[-1]] <= 0.0:
        return math.nan
    contact_distance = float(np.ptp(geometry.contact_y[ahead[0]]))
    return float(contact_distance * rolling_radius / abs(radius) / difference[free[-1]])


@dataclass(frozen=True)
class Criterion:
    """An assessed quantity."""

    name: str  # key of its limit in the limits file
    words: str  # in tables
    unit: str  # in tables
    group: str  # verdict: ``safety``, ``loading`` or ``ride``; ``information``: none
    kind: str  # statistics of the limits file; ``largest``, ``smallest``: the extreme value
    # signals of a part and a section to values by place
    measure: Callable[[Signals, TestSection], Values]
    # ``normal``: with wheel forces; ``simplified``: with accelerations
    methods: tuple[str, ...] = ("normal",)
    meaning: str = ""  # what its limit is about

    @property
    def scale(self) -> float:
        """Factor from SI to the unit in tables."""
        return 1e-3 if self.unit == "kN" else 1.0

    def text(self, value: float, limit: float = math.nan) -> str:
        """Value in the unit of tables, see `beside`; a hyphen where there is none."""
        if math.isnan(value):
            return "-"
        return beside(self.scale * value, self.scale * limit, self.decimals)

    @property
    def decimals(self) -> int:
        """Decimals in tables."""
        return DECIMALS.get(self.unit, 3)


BOTH = ("normal", "simplified")
SIMPLIFIED = ("simplified",)
_ROWS = (
    Criterion("sum_Y", "track shift force, 2 m", "kN", SAFETY, "safety",
              Measured(signal.track_shifting_force, FORCES, outer_end, window=2.0, outwards=-1),
              meaning="shifting of ballasted track: k1 (10 kN + 2 Q0/3), 2 Q0 the static axle load "
              "(Prud'homme)"),
    Criterion("Y_over_Q", "derailment quotient, 2 m", "-", SAFETY, "safety",
              Measured(signal.quotient, FORCES, high, window=2.0, curves=True),
              meaning="flange climbing of the outer wheel"),
    Criterion("instability", "rms of track shift force, 100 m", "kN", SAFETY, "largest",
              Instability(signal.track_shifting_force),
              meaning="instability: half of the limit of the track shift force"),
    Criterion("Q", "wheel load", "kN", LOADING, "loading",
              Measured(signal.wheel_load, FORCES, high),
              meaning="track loading: 90 kN + Q0, at most a value that depends on the speed"),
    Criterion("Q_qst", "quasi-static wheel load", "kN", LOADING, "quasi_static",
              Measured(signal.wheel_load, FORCES, middle, curves=True),
              meaning="quasi-static vertical wheel force on the outer rail in curves"),
    Criterion("Y_qst", "quasi-static guiding force", "kN", LOADING, "quasi_static",
              Measured(signal.guiding_force, FORCES, middle, curves=True),
              meaning="quasi-static guiding force on the outer rail, by the mean radius of the "
              "sections"),
    Criterion("body_y_safety", "lateral body acceleration, 6 Hz", "m/s2", SAFETY, "safety",
              Measured(signal.body_lateral, (None, 6.0), outer_end, outwards=1), SIMPLIFIED,
              "lateral acceleration of the body, safety"),
    Criterion("body_z_safety", "vertical body acceleration, 0.4 to 4 Hz", "m/s2", SAFETY, "safety",
              Measured(signal.body_vertical, (0.4, 4.0), both_ends), SIMPLIFIED,
              "vertical acceleration of the body, safety"),
    Criterion("frame_y", "lateral bogie frame acceleration, 10 Hz", "m/s2", SAFETY, "safety",
              Measured(signal.frame_lateral, (None, 10.0), outer_end, outwards=1), SIMPLIFIED,
              "lateral acceleration of the bogie frame, by its mass"),
    Criterion("frame_instability", "rms of bogie frame acceleration, 100 m", "m/s2", SAFETY,
              "largest", Instability(signal.frame_lateral), SIMPLIFIED,
              "instability: half of the limit of the acceleration of the bogie frame"),
    Criterion("body_y", "lateral body acceleration", "m/s2", RIDE, "ride",
              Measured(signal.body_lateral, RIDE_BAND, both_ends, outwards=1), BOTH,
              "lateral acceleration of the body, ride"),
    Criterion("body_z", "vertical body acceleration", "m/s2", RIDE, "ride",
              Measured(signal.body_vertical, RIDE_BAND, both_ends), BOTH,
              "vertical acceleration of the body, ride"),
    Criterion("body_y_rms", "lateral body acceleration, rms", "m/s2", RIDE, "ride",
              Measured(signal.body_lateral, RIDE_BAND, rms), BOTH,
              "lateral acceleration of the body, ride, rms"),
    Criterion("body_z_rms", "vertical body acceleration, rms", "m/s2", RIDE, "ride",
              Measured(signal.body_vertical, RIDE_BAND, rms), BOTH,
              "vertical acceleration of the body, ride, rms"),
    Criterion("body_y_qst", "lateral body acceleration, quasi-static", "m/s2", RIDE, "quasi_static",
              Measured(signal.body_lateral, FORCES, middle, curves=True, outwards=1), BOTH,
              "quasi-static lateral acceleration of the body in curves"),
    Criterion("Q_low", "smallest wheel load, 0.15 %", "kN", INFORMATION, "smallest",
              Measured(signal.wheel_load, FORCES, low, wheels=ALL)),
    Criterion("Y_max", "guiding force", "kN", INFORMATION, "loading",
              Measured(signal.guiding_force, FORCES, high)),
    Criterion("B_max", "rail loading |Y| + 0.83 |Q|", "kN", INFORMATION, "loading",
              Measured(signal.rail_loading, FORCES, high)),
    Criterion("B_qst", "quasi-static rail loading", "kN", INFORMATION, "quasi_static",
              Measured(signal.rail_loading, FORCES, middle, curves=True)),
    Criterion("Y_over_Q_inner", "derailment quotient, mean", "-", INFORMATION, "quasi_static",
              Measured(signal.quotient, FORCES, mean_of_known, wheels=INNER, curves=True)),
    Criterion("T_qst", "quasi-static wear number", "N", INFORMATION, "quasi_static",
              Measured(signal.wear_number, None, middle, curves=True)),
    Criterion("overturning", "overturning coefficient, 1.5 Hz", "-", INFORMATION, "safety",
              Measured(signal.load_transfer, (None, 1.5), outward_high, outwards=1)),
    Criterion("steering", "steering index", "-", INFORMATION, "quasi_static", steering, BOTH),
)  # fmt: skip
CRITERIA = {criterion.name: criterion for criterion in _ROWS}
"""Assessed quantities by name, in the order of tables."""
