"""What `critical_speed` returns: linear and non-linear critical speeds, branches, limits."""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.contact.geometry import ContactGeometry, geometry_of
from railsim.errors import optional_package
from railsim.linear.vehicle import Contact, LinearVehicle, laws_in_words
from railsim.plottable import Plottable
from railsim.stability.branches import COLUMNS, Branch, Jump, Limit, Point
from railsim.table import Column, Table

OF_CONICITY = 1e-3 * np.concatenate([np.arange(1, 10) * 0.1, np.arange(4, 33) * 0.25])  # m
TABLE = (
    Column("critical speed"),
    Column("speed", unit="m/s", format=".2f"),
    Column("frequency", unit="Hz", format=".2f"),
    Column("amplitude", unit="mm", format=".2f"),
    Column("mode", " "),
)


@dataclass(frozen=True)
class LinearLoss:
    """Where steady rolling loses its stability."""

    speed: float  # [m/s]
    frequency: float  # [Hz]
    mode: str  # that is undamped there
    speed_of_runs: float | None = None  # with the creep law of runs as it is, cells included [m/s]
    speed_on_rigid_rails: float | None = None  # where those of the track are elastic [m/s]


@dataclass(frozen=True)
class OverAmplitude:
    """Linear critical speed over the amplitude of the contact; None where the vehicle is stable.

    Where it is unstable at the lower end of the search already, that end.
    """

    amplitude: list[float] = field(default_factory=list)  # [m]
    speed: list[float | None] = field(default_factory=list)  # [m/s]
    frequency: list[float | None] = field(default_factory=list)  # [Hz]

    @property
    def smallest(self) -> tuple[float, float] | None:
        """The lowest speed and its amplitude [m/s], [m]."""
        pairs = zip(self.speed, self.amplitude, strict=True)
        return min(((v, a) for v, a in pairs if v is not None), default=None)

    def record(self) -> dict[str, Any]:
        """Return it as plain data."""
        named = zip(("speed", "amplitude"), self.smallest or (), strict=False)
        return {**asdict(self), "smallest": dict(named) or None}


@dataclass(frozen=True)
class Conicity:
    """Equivalent conicity over amplitude on rigid rails (EN 15302)."""

    wheelset: str
    amplitude: list[float]  # [m]
    conicity: list[float]  # [1]


@dataclass(repr=False)
class CriticalSpeed(Plottable):
    """Critical speeds of a vehicle.

    - `contact`: how the contact was linearised
    - `vehicle`: name of the vehicle
    - `conditions`: ``rails``, creep ``law`` of the runs, ``linear_law`` of the linearisation,
      ``friction``
    - `low`, `high`: range of the search [m/s]
    - `nonlinear`: slowest motion of sustained hunting by method, None where there is none
    - `branches`: amplitude over speed
    - `type`: whether anything hunts below the speed at which rest loses its stability, in the runs'
      own law; empty where it was not looked for, rest is unstable at the lower end already, or
      nothing was seen to hunt where it becomes so
    - `divergence`: remark on a rest that is left without an oscillation
    - `unstable_at_low`: whether rest is unstable at the lower end, as linearised for `linear`
    - `onset`: how the small motions begin there, whatever else is possible
    - `amplitude_limit`, `instability_limit`: amplitude of 3 mm, and half the limit of the
      track-shifting force as rms
    - `conicity_over_amplitude`: of the leading wheelset; None where it does not fit between the
      rails
    - `remarks`: remarks for the reader
    """

    contact: Contact
    vehicle: str = ""
    conditions: dict[str, str] = field(default_factory=dict)
    low: float = 0.0
    high: float = 0.0
    linear: LinearLoss | None = None
    unstable_at_low: bool = False
    divergence: tuple[str, ...] = ()
    linear_over_amplitude: OverAmplitude | None = None
    nonlinear: dict[str, Point | None] = field(default_factory=dict)
    branches: list[Branch] = field(default_factory=list)
    jumps: list[Jump] = field(default_factory=list)
    type: str = ""
    onset: str = ""
    amplitude_limit: Limit | None = None
    instability_limit: Limit | None = None
    conicity_over_amplitude: Conicity | None = None
    remarks: list[str] = field(default_factory=list)

    @property
    def title(self) -> str:
        """Vehicle and critical speeds in words."""
        linear = f"linear {self.linear.speed:.4g} m/s" if self.linear else "no linear one"
        lowest = self.lowest
        words = "slowest sustained hunting" if lowest and lowest.stable else "unstable motion at"
        found = f"{words} {lowest.speed:.4g} m/s" if lowest else "none that lasts"
        return ", ".join([self.vehicle, linear, *([found] if self.nonlinear else [])])

    @property
    def lowest(self) -> Point | None:
        """Slowest hunting of all methods, unstable only by continuation; None: there is none."""
        known = [point for point in self.nonlinear.values() if point is not None]
        return min(known, key=lambda point: point.speed, default=None)

    @property
    def searched_to(self) -> float:
        """Highest speed at which hunting was sought, less than `high` where it derails [m/s]."""
        speeds = [point.speed for branch in self.branches for point in branch.points]
        return max(speeds, default=self.high)

    def record(self) -> dict[str, Any]:
        """Return everything as plain data."""
        lowest, nonlinear = self.lowest, None
        if self.nonlinear:
            nonlinear = {
                **(lowest.record() if lowest else {"speed": None}),
                "reached": lowest is not None,
                "searched_to": self.searched_to,
            }
        line = self.linear_over_amplitude
        by_method = {name: point and point.record() for name, point in self.nonlinear.items()}
        return {
            **self.contact.record(),
            "linear": self.linear and asdict(self.linear),
            "unstable_at_low": self.unstable_at_low,
            "nonlinear": nonlinear,
            "nonlinear_by_method": by_method,
            "amplitude_limit": self.amplitude_limit and asdict(self.amplitude_limit),
            "instability_limit": self.instability_limit and asdict(self.instability_limit),
            "type": self.type,
            "branches": [branch.record() for branch in self.branches],
            "conicity_over_amplitude": self.conicity_over_amplitude
            and asdict(self.conicity_over_amplitude),
            "remarks": self.remarks,
            "conditions": self.conditions,
            "searched": [self.low, self.high],
            "onset": self.onset,
            "jumps": [asdict(jump) for jump in self.jumps],
            "linear_over_amplitude": line and line.record(),
        }

    def to_xarray(self) -> Any:
        """Return the branches as an `xarray.Dataset` over ``branch`` and ``point``; needs xarray.

        Branches of fewer points than the longest are filled with NaN.
        """
        xarray = optional_package("xarray", "to_xarray", "'railsim[xarray]'")
        most = max((len(branch.points) for branch in self.branches), default=0)
        filled = {name: np.full((len(self.branches), most), np.nan) for name in COLUMNS}
        for row, branch in enumerate(self.branches):
            for name, values in filled.items():
                values[row, : len(branch.points)] = branch.column(name)
        return xarray.Dataset(
            {name: (("branch", "point"), values) for name, values in filled.items()},
            {"branch": [branch.direction for branch in self.branches]},
        )

    def table(self) -> Table:
        """Return all critical speeds with their method, jumps and limits."""
        where = self.conditions
        caption = (
            f"{self.vehicle}, rails {where['rails']}, friction {where['friction']}, "
            f"{laws_in_words(where)}, searched from {self.low:g} to {self.high:g} m/s"
        )
        return Table(TABLE, self._rows(), caption)

    def _rows(self) -> Iterator[tuple[str, float | None, float | None, float | None, str]]:
        how, lost, line = self.contact.words(), self.linear, self.linear_over_amplitude
        none = f"none up to {self.searched_to:.4g} m/s"
        if lost is None:
            words = "unstable at its lower end" if self.unstable_at_low else "none in this range"
            yield f"linear, {how}", None, None, None, words
        else:
            yield f"linear, {how}", lost.speed, lost.frequency, None, lost.mode
            for words, speed in (
                ("the same on rigid rails", lost.speed_on_rigid_rails),
                ("the same with the cells of the runs", lost.speed_of_runs),
            ):
                if speed is not None:
                    yield words, speed, None, None, ""
        if line is not None and line.smallest is not None:
            name, (speed, amplitude) = "linear, harmonic, smallest over amplitude", line.smallest
            if speed > self.low:
                yield name, speed, None, amplitude, ""
            else:
                yield name, None, None, amplitude, "unstable at its lower end"
        for method, point in self.nonlinear.items():
            if point is None:
                yield f"non-linear, {method}", None, None, None, none
            else:
                frequency = point.frequency if math.isfinite(point.frequency) else None
                words = "" if point.stable else "unstable"
                yield f"non-linear, {method}", point.speed, frequency, point.amplitude, words
        for jump in self.jumps:
            words = "rising" if jump.direction == "up" else "falling"
            to = f"to {1e3 * jump.to:.2f} mm"
            yield f"jump, speed {words}", jump.speed, None, jump.amplitude, to
        for words, scale, limit in (
            ("amplitude above {:.3g} mm", 1e3, self.amplitude_limit),
            ("rms of sum_Y above {:.3g} kN", 1e-3, self.instability_limit),
        ):
            if limit is not None:
                more = "" if limit.reached else f"not reached up to {limit.searched_to:.4g} m/s"
                yield words.format(scale * limit.limit), limit.speed, None, None, more

    def verdict(self) -> str:
        """Return in words how hunting begins; empty where it was not looked for."""
        if self.type in ("", "none"):
            return ""
        words = f"the bifurcation is {self.type}"
        if self.onset and self.onset != self.type:
            words += f"; small motions begin as in a {self.onset} one"
        return words


def conicity_over_amplitude(linear: LinearVehicle) -> Conicity | None:
    """Equivalent conicity of the leading wheelset at the amplitudes that its profiles allow.

    Where it falls with the amplitude below 3 mm, small limit cycles come first (Polach 2006).
    """
    body = linear.model.flat.of_kind("wheelset")[0]
    assert body.wheelset is not None
    if (geometry := geometry_of(body.wheelset, linear.track, linear.model.profiles)) is None:
        return None
    values = _conicities(geometry)
    known = np.isfinite(values)
    return Conicity(body.name, OF_CONICITY[known].tolist(), values[known].tolist())


@lru_cache(8)  # maps and optimisations ask for the same geometry over and over
def _conicities(geometry: ContactGeometry) -> Floats:
    return geometry.equivalent_conicity(OF_CONICITY)
