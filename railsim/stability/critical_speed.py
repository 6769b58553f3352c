"""`critical_speed`: from which speed a vehicle hunts, linear and non-linear, and how it begins."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.loading import load_track
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.drawn import Drawn
from railsim.errors import InputError, ModelError, argument_fault
from railsim.linear.eigenmodes import LossOfStability, loss_of_stability
from railsim.linear.modes import SPEED_RANGE
from railsim.linear.naming import mode_name, parts_of
from railsim.linear.vehicle import AMPLITUDE, Contact, LinearVehicle
from railsim.profiles import Profile
from railsim.stability.conicity import conicity_over_amplitude
from railsim.stability.motion import LeftRange, VehicleMotion
from railsim.stability.periodic import Branch, PeriodicMotion
from railsim.stability.ramp import RESOLUTION, Diagram, Sustained, bifurcation_type, diagram, ramp
from railsim.stability.vehicle_flow import VehicleFlow

Floats = NDArray[np.float64]
Progress = Callable[[float], None]

METHODS = ("linear", "ramp", "bifurcation", "continuation")
AMPLITUDE_LIMIT = 3e-3  # m
LARGEST_AMPLITUDE = 5.5e-3  # m, at which a branch is followed no further
ARC_STEP = 1.0  # units of the arc length, about 1 mm or 1 m/s
MOST_MOTIONS = 80
FIRST = 0.2e-3  # m, amplitude at which a branch's first shape is taken
ABOVE = 5.0  # m/s above the linear critical speed at which a ramp begins


@dataclass
class CriticalSpeed(Drawn):
    """Critical speeds of a vehicle.

    Attributes
    ----------
    contact : Contact
        How the contact was linearised.
    linear : dict or None
        ``speed``, ``frequency``, ``mode`` of the loss of stability; None where there is none.
    nonlinear : dict of str to Sustained
        Lowest speed of sustained hunting by method.
    branches : list of Diagram
        Amplitude over speed.
    type : "subcritical", "supercritical", "none" or ""
        How hunting begins; empty where it was not looked for.
    amplitude_limit, instability_limit : dict or None
        Lowest ``speed`` at which an amplitude of 3 mm is exceeded, or half the limit of the
        track-shifting force as rms, and that ``limit``.
    conicity_over_amplitude : dict or None
        Equivalent conicity of the leading wheelset, see `railsim.stability.conicity`.
    remarks : list of str
        Remarks for the reader.
    """

    contact: Contact
    linear: dict[str, Any] | None = None
    nonlinear: dict[str, Sustained] = field(default_factory=dict)
    branches: list[Diagram] = field(default_factory=list)
    type: str = ""
    amplitude_limit: dict[str, float] | None = None
    instability_limit: dict[str, float] | None = None
    conicity_over_amplitude: dict[str, Any] | None = None
    remarks: list[str] = field(default_factory=list)

    FIGURE: ClassVar = "railsim.plot.stability:bifurcation_figure"

    def record(self) -> dict[str, Any]:
        """Return everything as plain data."""
        speeds = {name: found.record() for name, found in self.nonlinear.items()}
        known = [found for found in speeds.values() if found is not None]
        return {
            "linearisation": self.contact.linearisation,
            "amplitude": (
                self.contact.amplitude if self.contact.linearisation == "harmonic" else None
            ),
            "conicity": self.contact.conicity,
            "linear": self.linear,
            "nonlinear": known[0] if known else None,
            "nonlinear_by_method": speeds,
            "amplitude_limit": self.amplitude_limit,
            "instability_limit": self.instability_limit,
            "type": self.type,
            "branches": [branch.record() for branch in self.branches],
            "conicity_over_amplitude": self.conicity_over_amplitude,
            "remarks": self.remarks,
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
    _check(methods, low, high, points)
    settings = settings or Settings()
    prepared = LinearVehicle(
        vehicle,
        track or load_track("straight"),
        contact=Contact(linearisation, amplitude, conicity),
        settings=settings,
        profiles=profiles,
    )
    found = CriticalSpeed(prepared.contact, remarks=list(prepared.remarks))
    found.conicity_over_amplitude = conicity_over_amplitude(prepared)
    lost = loss_of_stability(prepared.linearised, low, high)
    _linear(found, prepared, lost, low, high)
    tell = progress or (lambda _: None)
    tell(0.05)
    wanted = [method for method in METHODS if method in methods and method != "linear"]
    if not wanted:
        return found
    top = min(high, lost.parameter + ABOVE) if lost.parameter else high
    motion = VehicleMotion(prepared, settings.scheme, (low, top))
    for number, method in enumerate(wanted):

        def share(fraction: float, number: int = number) -> None:
            tell(0.05 + 0.95 * (number + fraction) / len(wanted))

        try:
            _ACTIONS[method](found, motion, lost, (low, top), points, share)
        except (LeftRange, ModelError) as error:
            found.remarks.append(f"{method}: {error}")
    _limits(found, prepared)
    return found


def _check(methods: Sequence[str], low: float, high: float, points: int) -> None:
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
    if faults:
        raise InputError(faults)


def _linear(
    found: CriticalSpeed, prepared: LinearVehicle, lost: LossOfStability, low: float, high: float
) -> None:
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
            f"no linear critical speed from {low:g} to {high:g} m/s; least damped: {words(0)}; "
            f"{words(1)}"
        )


Range = tuple[float, float]


def _by_ramp(
    found: CriticalSpeed,
    motion: VehicleMotion,
    lost: LossOfStability,
    speeds: Range,
    points: int,
    progress: Progress,
) -> None:
    lowest, branch = ramp(motion, speeds[0], speeds[1], progress)
    found.nonlinear["ramp"] = lowest
    found.branches.append(branch)
    if lowest.speed is None:
        found.remarks.append(f"ramp: nothing hunts from {speeds[0]:g} to {speeds[1]:g} m/s")
    elif lowest.below:
        found.remarks.append(f"ramp: hunts still at the lower end, {speeds[0]:g} m/s")


def _by_diagram(
    found: CriticalSpeed,
    motion: VehicleMotion,
    lost: LossOfStability,
    speeds: Range,
    points: int,
    progress: Progress,
) -> None:
    low = speeds[0]
    if lost.parameter is not None:  # most of the diagram is where something happens
        low = max(low, lost.parameter - max(2.0 * ABOVE, 0.2 * lost.parameter))
    branches, lowest = diagram(motion, np.linspace(low, speeds[1], points).tolist(), progress)
    found.nonlinear["bifurcation"] = lowest
    found.branches += branches
    found.type = bifurcation_type(branches)
    if lost.parameter and lowest.speed and lowest.speed < lost.parameter - RESOLUTION:
        found.type = "subcritical"  # the hysteresis may lie between two steps
    if len(branches[0].speed) < points:
        found.remarks.append(
            f"bifurcation: the vehicle derails above {branches[0].speed[-1]:.4g} m/s"
            if branches[0].speed
            else "bifurcation: the vehicle derails at the lower end"
        )


def _by_continuation(
    found: CriticalSpeed,
    motion: VehicleMotion,
    lost: LossOfStability,
    speeds: Range,
    points: int,
    progress: Progress,
) -> None:
    if lost.parameter is None:
        found.remarks.append("continuation: it begins at a linear critical speed; there is none")
        return
    flow = VehicleFlow(motion, lost.parameter)
    branch, start = _birth(flow, motion, lost)
    line = Diagram("continuation")
    folds: list[PeriodicMotion] = []

    def within(now: PeriodicMotion) -> bool:
        share = now.amplitude / LARGEST_AMPLITUDE
        progress(min(0.99, max(share, len(line.speed) / MOST_MOTIONS)))
        inside = speeds[0] < now.speed < speeds[1] and now.amplitude < LARGEST_AMPLITUDE
        return inside and len(line.speed) < MOST_MOTIONS

    before = start
    try:
        for now in branch.followed(start, ARC_STEP, within):
            if before.tangent[-1] * now.tangent[-1] < 0.0 and before is not start:
                length = float(np.linalg.norm(now.tangent)) * ARC_STEP
                folds.append(branch.fold(before, now, length))
            _append(line, now)
            before = now
    except ModelError as error:
        found.remarks.append(f"continuation: ended at {before.speed:.4g} m/s: {error}")
    found.branches.append(line)
    if not line.speed:
        return
    found.type = "subcritical" if line.speed[0] < lost.parameter else "supercritical"
    lowest = min(folds, key=lambda fold: fold.speed, default=None)
    if lowest is not None and lowest.speed < lost.parameter:
        found.nonlinear["continuation"] = Sustained(
            lowest.speed, lowest.amplitude, lowest.frequency
        )
    else:
        found.nonlinear["continuation"] = Sustained(
            lost.parameter, 0.0, float(lost.modes[0].frequencies[0])
        )


def _append(line: Diagram, now: PeriodicMotion) -> None:
    line.speed.append(now.speed)
    line.amplitude.append(now.amplitude)
    line.frequency.append(now.frequency)
    line.sum_Y_rms.append(float("nan"))
    line.stable.append(now.is_stable)


def _birth(
    flow: VehicleFlow, motion: VehicleMotion, lost: LossOfStability
) -> tuple[Branch, PeriodicMotion]:
    """The branch at the bifurcation; its first shape is that of a small motion in the time loop."""
    speed, mode = float(lost.parameter or 0.0), lost.modes[0]
    frequency = float(mode.frequencies[0])
    period = 1.0 / frequency
    prepared = motion.prepared
    state = motion.rest(speed, 0.0)
    names = prepared.coordinates.names
    indices = prepared.coordinates.indices[[names.index(n) for n in mode.linearisation.names]]
    wheelsets = [f"{w}.y" for w in motion.model.index.wheelsets]
    size = max(abs(mode.shapes[0, mode.linearisation.names.index(w)]) for w in wheelsets)
    state[indices] += FIRST * (mode.shapes[0] / size).real
    state = motion.stretch(state, speed, speed, 2.0 * period).state  # the scheme's memory settles
    rest = flow.reduced(motion.prepared.steady(speed).state)
    begin = flow.reduced(state) - rest
    quarter = flow.after((rest + begin)[None], np.array([0.25 * period]), np.array([speed]))[0]
    scale = flow.scale(rest + begin, period, speed, FIRST)
    branch = Branch(flow, scale, period_scale=0.05 * period, speed_scale=1.0)
    return branch, branch.beginning(rest, begin - 1j * (quarter - rest), frequency, speed)


_ACTIONS = {"ramp": _by_ramp, "bifurcation": _by_diagram, "continuation": _by_continuation}


def _limits(found: CriticalSpeed, prepared: LinearVehicle) -> None:
    """Lowest speeds at which amplitude and track-shifting force exceed their limits."""
    # EN 14363: sum_Y 10 kN + 2 Q0/3, of which the instability criterion takes half as rms
    force = 0.5 * (10e3 + 2.0 * float(np.min(prepared.Q0)) / 3.0)
    for name, limit, attribute in (
        ("amplitude_limit", AMPLITUDE_LIMIT, "amplitude"),
        ("instability_limit", force, "sum_Y_rms"),
    ):
        beyond = [
            speed
            for branch in found.branches
            for speed, value in zip(branch.speed, getattr(branch, attribute), strict=True)
            if value > limit
        ]
        if beyond:
            setattr(found, name, {"speed": min(beyond), "limit": limit})
