"""`critical_speed`: from which speed a vehicle hunts, linear and non-linear, and how it begins."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.creep_law import CREEP_LAWS
from railsim.definitions.loading import load_track
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import InputError, ModelError, argument_fault
from railsim.linear.eigenmodes import (
    SEARCHED,
    Eigenmodes,
    LossOfStability,
    eigenmodes,
    loss_of_stability,
    oscillations,
)
from railsim.linear.modes import SPEED_RANGE
from railsim.linear.naming import mode_name, parts_of
from railsim.linear.vehicle import AMPLITUDE, Contact, LinearVehicle, smooth_law
from railsim.plottable import Plottable
from railsim.profiles import Profile
from railsim.stability.conicity import conicity_over_amplitude
from railsim.stability.continuation import followed_branches
from railsim.stability.diagram import DROP, diagram, jumps
from railsim.stability.motion import LeftRange, VehicleMotion
from railsim.stability.over_amplitude import linear_over_amplitude
from railsim.stability.ramp import EXCITATIONS, RESOLUTION, SMALL, Diagram, Sustained, ramp

Floats = NDArray[np.float64]
Progress = Callable[[float], None]

METHODS = ("linear", "ramp", "bifurcation", "continuation")
AMPLITUDE_LIMIT = 3e-3  # m
LARGEST_EXCITATION = 20e-3  # m
MARGIN = 1.1  # over the admissible speed, to which a search should go
NEAR = (0.8, 1.25)  # times the linear critical speed: where most speeds of a diagram stand ...
SHARE = 0.75  # ... this share of them


@dataclass
class CriticalSpeed(Plottable):
    """Critical speeds of a vehicle.

    Attributes
    ----------
    contact : Contact
        How the contact was linearised.
    conditions : dict of str to str
        ``rails``, creep ``law`` of the runs, ``linear_law`` of the linearisation, ``friction``.
    low, high : float
        Range of the search [m/s].
    linear : dict or None
        ``speed``, ``frequency``, ``mode`` of the loss of stability, ``speed_of_runs``, the same
        with the coarser cells of the runs; None where there is none.
    linear_over_amplitude : dict or None
        See `railsim.stability.over_amplitude`.
    nonlinear : dict of str to Sustained
        Lowest speed of sustained hunting by method.
    branches : list of Diagram
        Amplitude over speed.
    jumps : list of dict
        Where the motion changes to another branch or to rest, see `railsim.stability.diagram`.
    type : "subcritical", "supercritical", "none" or ""
        Whether anything hunts below the speed at which rest loses its stability, in the runs' own
        law; empty where it was not looked for.
    onset : "subcritical", "supercritical" or ""
        How the small motions begin there, whatever else is possible.
    amplitude_limit, instability_limit : dict or None
        Lowest ``speed`` at which an amplitude of 3 mm is exceeded, or half the limit of the
        track-shifting force as rms, and that ``limit``; ``reached`` and ``searched_to``.
    conicity_over_amplitude : dict or None
        Equivalent conicity of the leading wheelset, see `railsim.stability.conicity`.
    remarks : list of str
        Remarks for the reader.
    """

    contact: Contact
    conditions: dict[str, str] = field(default_factory=dict)
    low: float = 0.0
    high: float = 0.0
    linear: dict[str, Any] | None = None
    linear_over_amplitude: dict[str, Any] | None = None
    nonlinear: dict[str, Sustained] = field(default_factory=dict)
    branches: list[Diagram] = field(default_factory=list)
    jumps: list[dict[str, Any]] = field(default_factory=list)
    type: str = ""
    onset: str = ""
    amplitude_limit: dict[str, Any] | None = None
    instability_limit: dict[str, Any] | None = None
    conicity_over_amplitude: dict[str, Any] | None = None
    remarks: list[str] = field(default_factory=list)

    @property
    def lowest(self) -> Sustained | None:
        """Lowest speed of sustained hunting of all methods; None where there is none."""
        known = [one for one in self.nonlinear.values() if one.speed is not None]
        return min(known, key=lambda one: one.speed or 0.0, default=None)

    def record(self) -> dict[str, Any]:
        """Return everything as plain data."""
        speeds = {name: found.record() for name, found in self.nonlinear.items()}
        lowest = self.lowest
        nonlinear = None
        if self.nonlinear:
            nonlinear = {
                **((lowest.record() if lowest else None) or {"speed": None}),
                "reached": lowest is not None,
                "searched_to": self.high,
            }
        return {
            "linearisation": self.contact.linearisation,
            "amplitude": (
                self.contact.amplitude if self.contact.linearisation == "harmonic" else None
            ),
            "conicity": self.contact.conicity,
            "linear": self.linear,
            "nonlinear": nonlinear,
            "nonlinear_by_method": speeds,
            "amplitude_limit": self.amplitude_limit,
            "instability_limit": self.instability_limit,
            "type": self.type,
            "branches": [branch.record() for branch in self.branches],
            "conicity_over_amplitude": self.conicity_over_amplitude,
            "remarks": self.remarks,
            "conditions": self.conditions,
            "searched": [self.low, self.high],
            "onset": self.onset,
            "jumps": self.jumps,
            "linear_over_amplitude": self.linear_over_amplitude,
        }

    def to_xarray(self) -> Any:
        """Return the branches as an `xarray.Dataset` over ``branch`` and ``point``; needs xarray.

        Branches of fewer points than the longest are filled with NaN.
        """
        import xarray

        most = max((len(branch.speed) for branch in self.branches), default=0)
        filled = {
            name: np.array(
                [
                    getattr(branch, name) + [np.nan] * (most - len(branch.speed))
                    for branch in self.branches
                ],
                dtype=float,
            ).reshape(len(self.branches), most)
            for name in ("speed", "amplitude", "frequency", "sum_Y_rms", "stable")
        }
        return xarray.Dataset(
            {name: (("branch", "point"), values) for name, values in filled.items()},
            {"branch": [branch.direction for branch in self.branches]},
        )


def critical_speed(
    vehicle: Vehicle,
    track: Track | None = None,
    *,
    methods: Sequence[str] = ("linear", "ramp"),
    low: float = 5.0,
    high: float = 120.0,
    points: int = 16,
    linearisation: str = "tangent",
    amplitude: float = AMPLITUDE,
    conicity: float | None = None,
    excitations: Sequence[float] = EXCITATIONS,
    over_amplitude: bool = True,
    settings: Settings | None = None,
    profiles: Mapping[str, Profile] | None = None,
    progress: Progress | None = None,
) -> CriticalSpeed:
    """Find from which speed a vehicle hunts on ideal straight track.

    Parameters
    ----------
    vehicle : Vehicle
        See `load_vehicle`.
    track : Track, optional
        Whose rails, gauge, friction and support count; by default ``straight``.
    methods : sequence of str
        Of `METHODS`; the linear one is always used.
    low, high : float
        Range of the search [m/s].
    points : int
        Speeds of a bifurcation diagram.
    linearisation, amplitude, conicity
        Of the linear critical speed, as in `railsim.modes`; given cones hold for all methods.
    excitations : sequence of float
        Sizes of the disturbances from which hunting is sought: lateral displacement of a wheelset
        in the shape of the hunting mode [m].
    over_amplitude : bool
        Find the linear critical speed over amplitude too, 3 s of CPU time.
    settings : Settings, optional
        Scheme, creep law, contact.
    profiles : mapping of str to Profile, optional
        Profiles that take precedence over built-in ones and files.
    progress : callable, optional
        Called repeatedly with the finished fraction.

    Returns
    -------
    CriticalSpeed

    Raises
    ------
    InputError
        An argument is out of range.
    ModelError
        There is no equilibrium, or no stable step.
    """
    _check(methods, low, high, points, excitations)
    settings, track = settings or Settings(), track or load_track("straight")

    def prepared(settings: Settings, contact: Contact) -> LinearVehicle:
        return LinearVehicle(vehicle, track, contact=contact, settings=settings, profiles=profiles)

    contact, law = Contact(linearisation, amplitude, conicity), smooth_law(settings)
    smooth = prepared(law, contact)
    found = CriticalSpeed(contact, conditions(track, settings), low, high)
    found.remarks += smooth.remarks
    found.conicity_over_amplitude = conicity_over_amplitude(smooth)
    lost = loss_of_stability(smooth.linearised, low, high)
    _linear(found, smooth, lost)
    if over_amplitude:
        found.linear_over_amplitude = linear_over_amplitude(
            lambda size: prepared(law, Contact("harmonic", size, conicity)), low, high
        )
    tell = progress or (lambda _: None)
    tell(0.05)
    wanted = [method for method in METHODS if method in methods and method != "linear"]
    if not wanted:
        return found
    own = prepared(settings, Contact(conicity=conicity))
    begins = loss_of_stability(own.linearised, low, high)
    if found.linear is not None:
        found.linear["speed_of_runs"] = begins.parameter
    shape = _hunting_shape(own, begins.parameter or high)
    motion = VehicleMotion(own, settings.scheme, shape)
    search = _Search(found, motion, begins, points, excitations)
    for number, method in enumerate(wanted):

        def share(fraction: float, number: int = number) -> None:
            tell(0.05 + 0.95 * (number + fraction) / len(wanted))

        try:
            _ACTIONS[method](search, share)
        except (LeftRange, ModelError) as error:
            found.remarks.append(f"{method}: {error}")
    _conclude(found, own, begins.parameter)
    _remark_range(found, vehicle)
    return found


def conditions(track: Track, settings: Settings) -> dict[str, str]:
    """Return in words on what rails, with which creep law and friction."""

    def words(settings: Settings) -> str:
        law = CREEP_LAWS[settings.creep_law]
        cells = " {} x {} cells".format(*settings.fastsim_grid) if law.grid else ""
        return f"{law.label}{cells}"

    sides = np.unique(track.friction)
    friction = "from a table" if track.friction_table else "/".join(f"{mu:g}" for mu in sides)
    return {
        "rails": track.support.preset,
        "law": words(settings),
        "linear_law": words(smooth_law(settings)),
        "friction": friction,
    }


def _check(
    methods: Sequence[str], low: float, high: float, points: int, excitations: Sequence[float]
) -> None:
    faults = []
    unknown = [method for method in methods if method not in METHODS]
    if unknown:
        faults.append(
            argument_fault("methods", "", f"found '{unknown[0]}'", " or ".join(METHODS), "--method")
        )
    least, most = SPEED_RANGE
    for name, option, value in (("low", "--from", low), ("high", "--to", high)):
        if not (math.isfinite(value) and least <= value <= most):
            faults.append(
                argument_fault(
                    name, "", f"found {value:g} m/s", f"{least:g} to {most:g} m/s", option
                )
            )
    if not faults and low >= high:
        faults.append(
            argument_fault(
                "low", "", f"found {low:g} m/s", f"less than the highest, {high:g} m/s", "--from"
            )
        )
    if not 2 <= points <= 200:
        faults.append(argument_fault("points", "", f"found {points}", "2 to 200"))
    most = LARGEST_EXCITATION
    wrong = [size for size in excitations if not SMALL <= size <= most]
    if wrong or not len(excitations):
        told = f"found {wrong[0]:g} m" if wrong else "no size"
        allowed = f"{SMALL:g} to {most:g} m"
        faults.append(argument_fault("excitations", "", told, allowed, "--excitation"))
    if faults:
        raise InputError(faults)


def _linear(found: CriticalSpeed, prepared: LinearVehicle, lost: LossOfStability) -> None:
    """Put the linear critical speed into the result, or why there is none."""
    parts = parts_of(prepared.model, prepared.coordinates)

    def words(number: int) -> str:
        modes = lost.modes[number]
        value = complex(modes.eigenvalues[0])
        name = mode_name(parts, modes.shapes[0], value, modes.linearisation.parameter)
        return (
            f"{name}, {modes.frequencies[0]:.3g} Hz, damping "
            f"{100.0 * modes.damping_ratios[0]:.3g} % at {modes.linearisation.parameter:g} m/s"
        )

    if lost.parameter is not None:
        mode = lost.modes[0]
        found.linear = {
            "speed": lost.parameter,
            "frequency": float(mode.frequencies[0]),
            "mode": mode_name(parts, mode.shapes[0], complex(mode.eigenvalues[0]), lost.parameter),
        }
    elif lost.already:
        found.remarks.append(f"unstable at the lower end of the range: {words(0)}")
    else:
        found.remarks.append(
            f"no linear critical speed from {found.low:g} to {found.high:g} m/s; least damped: "
            f"{words(0)}; {words(1)}"
        )


def _hunting_shape(prepared: LinearVehicle, speed: float) -> Eigenmodes:
    """The mode in whose shape hunting is excited: of several the least damped.

    Where none is a hunting mode, the one whose wheelsets move most against all else.
    """
    found = oscillations(eigenmodes(prepared.linearised(speed)), SEARCHED[1])
    parts = parts_of(prepared.model, prepared.coordinates)
    named = [
        k
        for k, value in enumerate(found.eigenvalues)
        if mode_name(parts, found.shapes[k], complex(value), speed).endswith("hunting")
    ]
    if named:
        return found.taken([min(named, key=lambda k: found.damping_ratios[k])])
    names = found.linearisation.names
    lateral = [names.index(f"{wheelset}.y") for wheelset in prepared.model.index.wheelsets]
    positions = [k for k, name in enumerate(names) if name.endswith(".y")]
    size = np.abs(found.shapes)
    share = np.max(size[:, lateral], axis=1) / np.max(size[:, positions], axis=1)
    return found.taken([int(np.argmax(share))])


@dataclass(frozen=True)
class _Search:
    """What the non-linear methods work on."""

    found: CriticalSpeed
    motion: VehicleMotion
    begins: LossOfStability
    points: int
    excitations: Sequence[float]


def _by_ramp(search: _Search, progress: Progress) -> None:
    found = search.found
    lowest, branch = ramp(search.motion, found.low, found.high, progress, search.excitations)
    found.nonlinear["ramp"] = lowest
    found.branches.append(branch)
    if lowest.speed is None:
        found.remarks.append(f"ramp: nothing hunts from {found.low:g} to {found.high:g} m/s")
    elif lowest.below:
        found.remarks.append(f"ramp: hunts still at the lower end, {found.low:g} m/s")
    if branch.top < found.high:
        found.remarks.append(f"ramp: the vehicle derails above {branch.top:.4g} m/s")


def _speeds(found: CriticalSpeed, begins: float | None, points: int) -> list[float]:
    """Speeds of a diagram: most of them where branches begin and end, the others above."""
    low, high = found.low, found.high
    if begins is None:
        return [float(speed) for speed in np.linspace(low, high, points)]
    least, most = max(low, NEAR[0] * begins), min(high, NEAR[1] * begins)
    if most >= high or points < 4:
        return [float(speed) for speed in np.linspace(least, high, points)]
    near = round(SHARE * points)
    above = np.linspace(most, high, points - near + 1)[1:]
    return [*np.linspace(least, most, near).tolist(), *above.tolist()]


def _by_diagram(search: _Search, progress: Progress) -> None:
    found, begins = search.found, search.begins.parameter
    speeds = _speeds(found, begins, search.points)
    branches, lowest = diagram(
        search.motion, speeds, progress, excitations=search.excitations, closer=True
    )
    found.nonlinear["bifurcation"] = lowest
    found.branches += branches
    found.jumps = jumps(branches)
    reached = max(branches[0].speed, default=found.low)
    if reached < speeds[-1]:
        found.remarks.append(
            f"bifurcation: the vehicle derails above {reached:.4g} m/s"
            if branches[0].speed
            else "bifurcation: the vehicle derails at the lower end"
        )


def _by_continuation(search: _Search, progress: Progress) -> None:
    found, begins = search.found, search.begins
    lines, folds, remarks = followed_branches(
        search.motion, begins, found.branches, (found.low, found.high), progress
    )
    found.branches += lines
    found.remarks += remarks
    born = begins.parameter
    if born is not None and lines and lines[0].speed:
        found.onset = "subcritical" if lines[0].speed[0] < born else "supercritical"
        frequency = float(begins.modes[0].frequencies[0])
        folds = [*folds, Sustained(born, 0.0, frequency)]
    if folds:
        found.nonlinear["continuation"] = min(folds, key=lambda fold: fold.speed or 0.0)


_ACTIONS = {"ramp": _by_ramp, "bifurcation": _by_diagram, "continuation": _by_continuation}


def _conclude(found: CriticalSpeed, prepared: LinearVehicle, begins: float | None) -> None:
    """Find type and limits from all branches."""
    lowest = found.lowest
    if not found.nonlinear:
        return  # every method failed, as the remarks say
    if lowest is None or lowest.speed is None:
        found.type = "none"
    elif begins is None or lowest.speed < begins - RESOLUTION or found.onset == "subcritical":
        found.type = "subcritical"
    else:
        found.type = "supercritical"
    # EN 14363: sum_Y 10 kN + 2 Q0/3, of which the instability criterion takes half as rms
    force = 0.5 * (10e3 + 2.0 * float(np.min(prepared.Q0)) / 3.0)
    found.amplitude_limit = _first_beyond(found, AMPLITUDE_LIMIT, "amplitude")
    found.instability_limit = _first_beyond(found, force, "sum_Y_rms")


def _first_beyond(found: CriticalSpeed, limit: float, attribute: str) -> dict[str, Any]:
    """The lowest speed of stable hunting beyond a limit, between the points of a branch too."""
    beyond = []
    for branch in found.branches:
        points = branch
        if branch.direction == "ramp":  # it undershoots the end of the branch
            end = found.nonlinear["ramp"].speed or np.inf
            points = branch.taken([k for k, v in enumerate(branch.speed) if v >= end])
        values, alive = getattr(points, attribute), points.alive
        for k in (k for k in alive if values[k] > limit):
            beyond.append(points.speed[k])
            for n in (k - 1, k + 1):  # a neighbour within the limit: the branch passes it between
                if n in alive and DROP * values[k] < values[n] <= limit:
                    share = (limit - values[n]) / (values[k] - values[n])
                    beyond.append(points.speed[n] + share * (points.speed[k] - points.speed[n]))
    return {
        "speed": min(beyond, default=None),
        "limit": limit,
        "reached": bool(beyond),
        "searched_to": found.high,
    }


def _remark_range(found: CriticalSpeed, vehicle: Vehicle) -> None:
    """Say where the search ends below the speed that a vehicle is to be judged at."""
    if vehicle.service is None:
        return
    needed = MARGIN * vehicle.service.admissible_speed
    if found.high < needed:
        found.remarks.append(
            f"searched to {found.high:g} m/s, less than {needed:.4g} m/s, {MARGIN:g} times the "
            "admissible speed: hunting above is not seen"
        )
