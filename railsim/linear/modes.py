"""`modes`: eigenfrequencies, damping and shapes of a vehicle, at one speed or over many."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from numbers import Real
from typing import Any, ClassVar

import numpy as np

from railsim.arrays import Complexes
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.loading import load_track
from railsim.errors import argument_error, nearest, optional_package
from railsim.linear.eigenmodes import SEARCHED, SLOWEST, Eigenmodes, eigenmodes, follow_modes
from railsim.linear.naming import apart, divergence, mode_name, parts_of
from railsim.linear.vehicle import AMPLITUDE, Contact, LinearVehicle, smooth_law
from railsim.plottable import Plottable
from railsim.profiles import Profile
from railsim.table import Column, Table
from railsim.units import speed_in_si

SPEED_RANGE = (0.5, 150.0)  # m/s
LEAST_SHARE = 0.005  # of the kinetic energy that is listed
FOLLOWED = 100.0  # Hz, largest undamped frequency in a root locus
SHOWN = 50.0  # Hz, up to which modes are tabulated
FREQUENCY = Column("frequency", "f", "Hz", ".3f")
DAMPING = Column("damping_ratio", "damping", "%", ".2f")


@dataclass(frozen=True)
class Mode:
    """One mode of a vehicle; with an empty name and NaN where a root locus has no such mode."""

    name: str  # after the field, see `railsim.linear.naming`
    eigenvalue: complex  # lambda [1/s]
    # share of the kinetic energy by ``body.component``, largest first
    participation: dict[str, float]
    shape: dict[str, complex]  # displacements by ``body.component``, the largest 1 [m, rad]

    @property
    def frequency(self) -> float:
        """Damped frequency Im(lambda)/2pi [Hz]."""
        return self.eigenvalue.imag / (2.0 * math.pi)

    @property
    def natural_frequency(self) -> float:
        """|lambda|/2pi [Hz]."""
        return abs(self.eigenvalue) / (2.0 * math.pi)

    @property
    def damping_ratio(self) -> float:
        """-Re(lambda)/|lambda|."""
        size = abs(self.eigenvalue)
        return -self.eigenvalue.real / size if size else 0.0

    @property
    def exists(self) -> bool:
        """Whether there is this mode here."""
        return not math.isnan(self.eigenvalue.real)

    @property
    def oscillates(self) -> bool:
        """Whether it is an oscillation."""
        return self.frequency > SLOWEST

    def record(self) -> dict[str, Any]:
        """Return the mode as plain data."""
        names = ("name", "frequency", "natural_frequency", "damping_ratio")
        return {
            **{name: getattr(self, name) for name in names},
            "eigenvalue": [self.eigenvalue.real, self.eigenvalue.imag],
            "participation": self.participation,
            "shape": {name: [value.real, value.imag] for name, value in self.shape.items()},
        }


@dataclass(frozen=True, repr=False)
class Modes(Plottable):
    """Modes of a vehicle at one speed."""

    speed: float  # [m/s]
    contact: Contact  # how it was linearised
    modes: tuple[Mode, ...]  # by rising |lambda|, or in the order of the root locus
    remarks: tuple[str, ...] = ()
    parameter: tuple[str, float] | None = None  # key and value of another one than the speed
    vehicle: str = ""  # its name
    place: str = ""  # the track in words

    def __iter__(self) -> Any:
        return iter(self.modes)

    def __getitem__(self, name: str) -> Mode:
        for mode in self.modes:
            if mode.name == name:
                return mode
        names = [mode.name for mode in self.modes]
        similar = [known for known in names if str(name) in known]
        raise KeyError(f"no mode '{name}'; {nearest(str(name), similar or names)}")

    @property
    def oscillations(self) -> tuple[Mode, ...]:
        """Modes that oscillate, by rising frequency."""
        found = (mode for mode in self.modes if mode.exists and mode.oscillates)
        return tuple(sorted(found, key=lambda mode: mode.natural_frequency))

    @property
    def least_damped(self) -> Mode | None:
        """Least damped oscillation between 0.3 and 40 Hz."""
        low, high = SEARCHED
        inside = [mode for mode in self.oscillations if low <= mode.frequency <= high]
        return min(inside, key=lambda mode: mode.damping_ratio, default=None)

    def record(self) -> dict[str, Any]:
        """Return speed, kind of linearisation and modes as plain data."""
        data: dict[str, Any] = {
            "speed": self.speed,
            **self.contact.record(),
            "remarks": list(self.remarks),
            "modes": [mode.record() for mode in self.modes if mode.exists],
        }
        if self.parameter is not None:
            data["parameter"] = {"key": self.parameter[0], "value": self.parameter[1]}
        return data

    def to_xarray(self) -> Any:
        """Return what `RootLocus.to_xarray` gives, at this speed."""
        return RootLocus("speed", (self.speed,), (self,)).to_xarray()

    @property
    def notes(self) -> tuple[str, ...]:
        """What the table leaves out, in words."""
        above = sum(mode.natural_frequency > SHOWN for mode in self.oscillations)
        still = sum(mode.exists and not mode.oscillates for mode in self.modes)
        return (
            f"{above} oscillations above {SHOWN:g} Hz and {still} modes that do not oscillate: "
            "--json",
        )

    def table(self) -> Table:
        """Return the oscillations up to 50 Hz with the largest shares of their kinetic energy."""
        columns = [
            Column("mode"),
            FREQUENCY,
            Column("natural_frequency", "f0", "Hz", ".3f"),
            DAMPING,
            Column("participation", "kinetic energy"),
        ]
        rows = []
        for mode in self.oscillations:
            if mode.natural_frequency <= SHOWN:
                largest = list(mode.participation.items())[:3]
                shares = ", ".join(f"{name} {100 * share:.0f} %" for name, share in largest)
                numbers = mode.frequency, mode.natural_frequency, mode.damping_ratio
                rows.append([mode.name, *numbers, shares])
        return Table(columns, rows, self.title)

    @property
    def title(self) -> str:
        """Vehicle, speed, track and contact in words."""
        return f"{self.vehicle}: {self.speed:g} m/s, {self.place}, contact {self.contact.words()}"


@dataclass(frozen=True, repr=False)
class RootLocus(Plottable):
    """Oscillations of a vehicle over a parameter, each at the same index throughout."""

    key: str  # ``speed`` or the key of the parameter
    values: tuple[float, ...]  # of it
    sets: tuple[Modes, ...]  # one for each value
    unit: str = ""  # of the values

    @property
    def eigenvalues(self) -> Complexes:
        """Eigenvalues, complex128[value, mode], NaN where a mode does not exist [1/s]."""
        return np.array([[mode.eigenvalue for mode in modes.modes] for modes in self.sets])

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each mode: the one that it bears at most values, numbered where it is not alone.

        Of equally frequent names the one at the higher value.
        """
        chosen = []
        for k in range(len(self.sets[0].modes)):
            borne = [modes.modes[k].name for modes in self.sets if modes.modes[k].exists]
            borne = [re.sub(r" \d+$", "", name) for name in borne]  # as numbered at one value
            chosen.append(max(reversed(borne), key=borne.count) if borne else "")
        return tuple(numbered(chosen))

    def to_xarray(self) -> Any:
        """Return eigenvalues, frequencies and damping as an `xarray.Dataset`; needs xarray."""
        xarray = optional_package("xarray", "to_xarray", "'railsim[xarray]'")
        values = self.eigenvalues
        size = np.abs(values)
        dims = (self.key, "mode")
        return xarray.Dataset(
            {
                "eigenvalue": (dims, values),
                "frequency": (dims, values.imag / (2.0 * np.pi)),
                "natural_frequency": (dims, size / (2.0 * np.pi)),
                "damping_ratio": (dims, -values.real / size),
            },
            {self.key: list(self.values), "mode": list(self.names)},
        )

    def record(self) -> list[dict[str, Any]]:
        """Return one record a value; `branch` of a mode is its name of `names`."""
        records, names = [modes.record() for modes in self.sets], self.names
        for modes, record in zip(self.sets, records, strict=True):
            branches = (name for name, m in zip(names, modes.modes, strict=True) if m.exists)
            for mode, branch in zip(record["modes"], branches, strict=True):
                mode["branch"] = branch
        return records

    notes: ClassVar[tuple[str, ...]] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks for the reader."""
        return tuple(dict.fromkeys(remark for modes in self.sets for remark in modes.remarks))

    def table(self) -> Table:
        """Return the least damped oscillation from 0.3 to 40 Hz at every value."""
        columns = [Column(self.key, unit=self.unit, format="g"), Column("mode"), FREQUENCY, DAMPING]
        rows: list[list[Any]] = []
        for value, modes in zip(self.values, self.sets, strict=True):
            least = modes.least_damped
            if least is None:
                rows.append([value, "no oscillation", None, None])
            else:
                name = self.names[modes.modes.index(least)]
                rows.append([value, name, least.frequency, least.damping_ratio])
        return Table(columns, rows, f"{self.title}; least damped oscillation from 0.3 to 40 Hz")

    @property
    def title(self) -> str:
        """Vehicle, track and contact in words, without what changes along the locus."""
        first, places = self.sets[0], [modes.place.split(", ") for modes in self.sets]
        same = [part for part in places[0] if all(part in place for place in places)]
        speed = [] if self.key == "speed" else [f"{first.speed:g} m/s"]
        words = ", ".join([*speed, *same, f"contact {first.contact.words()}"])
        return f"{first.vehicle}: {words}"


def numbered(names: Sequence[str]) -> list[str]:
    """Names with a number from the second of the same on.

    >>> numbered(["front hunting", "bogie roll", "front hunting"])
    ['front hunting', 'bogie roll', 'front hunting 2']
    """
    seen: dict[str, int] = {}
    found = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        found.append(f"{name} {seen[name]}" if seen[name] > 1 else name)
    return found


def modes(
    vehicle: Vehicle,
    track: Track | None = None,
    *,
    speed: float | str = 20.0,
    linearisation: str = "tangent",
    amplitude: float = AMPLITUDE,
    conicity: float | None = None,
    radius: float = math.inf,
    cant: float = 0.0,
    held: bool = False,
    hold: Sequence[str] = (),
    settings: Settings | None = None,
    profiles: Mapping[str, Profile] | None = None,
) -> Modes:
    """Return the modes of a vehicle that rolls steadily.

    Parameters
    ----------
    vehicle : Vehicle
        See `load_vehicle`.
    track : Track, optional
        Whose rails, gauge and friction count; by default ``straight``.
    speed : float or str
        [m/s], or with a unit: ``"72 km/h"``.
    linearisation : "tangent" or "harmonic"
        Of the contact: its derivative, or its first harmonic for `amplitude`.
    amplitude : float
        Lateral amplitude of the wheelsets [m].
    conicity : float, optional
        Wheels replaced by straight cones of this slope [1].
    radius : float
        Of the track on which the vehicle rolls, negative in left-hand curves [m].
    cant : float
        Positive where the left rail is higher [m].
    held : bool
        Hold the wheelsets: modes of the suspended masses alone.
    hold : sequence of str
        Bodies that are fixed to the moving track frame, such as the car above a single bogie.
    settings : Settings, optional
        Creep law and contact.
    profiles : mapping of str to Profile, optional
        Profiles that take precedence over built-in ones and files.

    Raises
    ------
    InputError
        An argument is out of range, or the amplitude larger than the contact table.
    ModelError
        There is no equilibrium.

    Examples
    --------
    >>> import railsim
    >>> found = railsim.modes(railsim.load_vehicle("coach_manchester"), speed=30.0)
    >>> mode = found["car body bounce"]
    >>> print(f"{mode.natural_frequency:.2f} Hz, {100 * mode.damping_ratio:.0f} %")
    0.90 Hz, 11 %
    """
    contact = Contact(linearisation, amplitude, conicity)
    where = {"radius": radius, "cant": cant, "held": held, "hold": hold}
    prepared = _linear_vehicle(vehicle, track, contact, settings, profiles=profiles, **where)
    (speed,) = checked_speeds([speed])
    return _with_names(prepared, eigenmodes(prepared.linearised(speed)), speed)


def root_locus(
    vehicle: Vehicle, track: Track | None = None, *, speeds: Sequence[float | str], **how: Any
) -> RootLocus:
    """Return the modes of a vehicle over speed, each followed.

    Parameters
    ----------
    vehicle : Vehicle
        As in `modes`.
    track : Track, optional
        As in `modes`.
    speeds : sequence of float or str
        [m/s], or with a unit: ``"72 km/h"``.
    **how
        The other arguments of `modes`: linearisation, amplitude, conicity, radius, cant, held,
        hold, settings, profiles.
    """
    speeds = checked_speeds(speeds, "speeds")
    names = ("linearisation", "amplitude", "conicity")
    contact = Contact(**{name: how.pop(name) for name in names if name in how})
    prepared = _linear_vehicle(vehicle, track, contact, **how)
    sets = follow_modes(prepared.linearised, speeds, FOLLOWED)
    named = [_with_names(prepared, found, speed) for found, speed in zip(sets, speeds, strict=True)]
    return RootLocus("speed", tuple(speeds), tuple(named), "m/s")


def _linear_vehicle(
    vehicle: Vehicle,
    track: Track | None,
    contact: Contact,
    settings: Settings | None = None,
    **how: Any,
) -> LinearVehicle:
    track, settings = track or load_track("straight"), smooth_law(settings)
    return LinearVehicle(vehicle, track, contact=contact, settings=settings, **how)


def parameter_locus(
    linear_vehicle: Callable[[float], LinearVehicle],
    key: str,
    values: Sequence[float],
    speed: float,
    unit: str = "",
) -> RootLocus:
    """Return the modes of a vehicle over any parameter of its files, called `key`, at a speed.

    `prepared`: value of the parameter to the vehicle.
    """
    (speed,) = checked_speeds([speed])
    of = cache(linear_vehicle)
    sets = follow_modes(lambda value: of(value).linearised(speed), list(values), FOLLOWED)
    each = zip(sets, values, strict=True)
    named = [_with_names(of(value), found, speed, (key, value)) for found, value in each]
    return RootLocus(key, tuple(values), tuple(named), unit)


def checked_speeds(speeds: Sequence[float | str], name: str = "speed") -> list[float]:
    """Return speeds, perhaps texts with units [m/s]; raises InputError: out of range, or none."""
    low, high = SPEED_RANGE
    if isinstance(speeds, str | Real):
        raise argument_error(name, f"found {speeds!r}", "several, such as [20.0, 40.0]")
    values = [speed_in_si(speed) for speed in speeds]
    bad = [v for v in values if not (isinstance(v, Real) and low <= float(v) <= high)]
    if bad or not values:
        found = f"found {bad[0]!r}" if bad else "no speed"
        raise argument_error(name, found, f"{low:g} to {high:g} m/s, or a text such as '72 km/h'")
    return [float(value) for value in values]


def _with_names(
    linear: LinearVehicle,
    found: Eigenmodes,
    speed: float,
    parameter: tuple[str, float] | None = None,
) -> Modes:
    c, parts = linear.coordinates, parts_of(linear.model, linear.coordinates)
    found = apart(parts, found)
    there = ~np.isnan(found.eigenvalues)
    # oscillations are numbered before the modes that no table shows
    order = np.argsort(found.frequencies <= SLOWEST, kind="stable")
    names = numbered([mode_name(parts, found, k) if there[k] else "" for k in order])
    name_of = dict(zip(order, names, strict=True))
    moving = [name.rstrip("'") for name in c.names[c.velocities]]
    listed = []
    for k, (value, shape) in enumerate(zip(found.eigenvalues, found.shapes, strict=True)):
        if np.isnan(value):
            listed.append(Mode("", complex(np.nan, np.nan), {}, {}))
            continue
        positions = shape[c.positions]
        largest = positions[int(np.argmax(np.abs(positions)))]
        shown = (positions / largest if largest else positions).tolist()
        shapes = dict(zip(c.names[: c.n_positions], shown, strict=True))
        energy = parts.energy_shares(shape)[c.bodies[c.velocities], c.components[c.velocities]]
        largest_first = np.argsort(-energy, kind="stable")
        shares = {moving[j]: float(energy[j]) for j in largest_first if energy[j] >= LEAST_SHARE}
        listed.append(Mode(name_of[k], complex(value), shares, shapes))
    remarks = (*linear.remarks, *linear.path_remarks, *divergence(parts, found))
    about = remarks, parameter, linear.name, linear.place
    return Modes(speed, linear.contact, tuple(listed), *about)
