"""`critical_speed`: from which speed a vehicle hunts, linear and non-linear, and how it begins."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from numbers import Integral, Real

import numpy as np

from railsim.arrays import Floats
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.limits import Situation
from railsim.definitions.loading import load_running_limits, load_track
from railsim.definitions.vehicle.tables import Service
from railsim.errors import Faults, InputError, ModelError
from railsim.linear.eigenmodes import SEARCHED, Eigenmodes, eigenmodes, oscillations
from railsim.linear.harmonic import ContactPath
from railsim.linear.modes import SPEED_RANGE
from railsim.linear.naming import divergence, mode_name, parts_of
from railsim.linear.stability_loss import LossOfStability, loss_of_stability
from railsim.linear.vehicle import AMPLITUDE, Contact, LinearVehicle, conditions, smooth_law
from railsim.notation import COMPONENTS
from railsim.profiles import Profile
from railsim.simulation.auxiliary_track import DOING
from railsim.stability.branches import RESOLUTION, Branch, Point, first_beyond, jumps, lowest_of
from railsim.stability.continuation import followed_branches
from railsim.stability.diagram import diagram, speeds_about, unresolved
from railsim.stability.motion import LeftRange, VehicleMotion
from railsim.stability.ramp import (
    EXCITATIONS,
    SMALL,
    Progress,
    below,
    far_above,
    lasts_in_shorter_steps,
    ramp,
    tops_above,
)
from railsim.stability.result import (
    CriticalSpeed,
    LinearLoss,
    OverAmplitude,
    conicity_over_amplitude,
)
from railsim.units import speed_in_si

METHODS = ("linear", "ramp", "bifurcation", "continuation")
AMPLITUDE_LIMIT = 3e-3  # m
POINTS = 16  # speeds of a diagram
LARGEST_EXCITATION = 20e-3  # m
MARGIN = 1.1  # over the admissible speed, to which a search should go
# damping of friction that slides, at least: with stuck friction sways of shipped wagons have -0.022
SLIDING = 0.03
AGAIN = 1.25  # ratio of speeds at which is looked whether rest is stable again
NO_FRICTION = "the friction is 0: without creep forces there is no hunting, and none is sought"
AMPLITUDES = (0.1e-3, 0.2e-3, 0.3e-3, 0.5e-3, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3)  # m


def critical_speed(
    vehicle: Vehicle,
    track: Track | None = None,
    *,
    methods: str | Sequence[str] = ("linear", "ramp"),
    low: float | str = 5.0,
    high: float | str = 120.0,
    points: int = POINTS,
    linearisation: str = "tangent",
    amplitude: float = AMPLITUDE,
    conicity: float | None = None,
    excitations: float | Sequence[float] = EXCITATIONS,
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
    methods : str or sequence of str
        One or several of `METHODS`; the linear one is always used.
    low : float or str
        Lower end of the search [m/s], or with units: ``"20 km/h"``.
    high : float or str
        Its upper end.
    points : int
        Speeds of a bifurcation diagram; refused where there is none.
    linearisation : tangent or harmonic
        Of the linear critical speed, as in `railsim.modes`, and so is `amplitude`.
    amplitude : float
        Lateral amplitude of the wheelsets [m].
    conicity : float, optional
        Straight cones of this slope as wheels, for all methods [1].
    excitations : float or sequence of float
        Sizes of the disturbances from which hunting is sought: lateral displacement of a wheelset
        in the shape of the hunting mode [m].
    over_amplitude : bool
        Find the linear critical speed over amplitude and on rigid rails too, 10 to 20 s of CPU.
    settings, profiles, progress : optional
        As in `railsim.simulate`.

    Raises
    ------
    InputError : an argument is out of range.
    ModelError : there is no equilibrium, or no stable step.
    """
    methods = [methods] if isinstance(methods, str) else methods
    excitations = np.ravel(excitations).tolist()
    contact = Contact(linearisation, amplitude, conicity)
    low, high = checked(contact, methods, low, high, points, excitations)
    settings, track = settings or Settings(), track or load_track("straight")
    law = smooth_law(settings)

    def linear_vehicle(settings: Settings, contact: Contact, track: Track = track) -> LinearVehicle:
        return LinearVehicle(vehicle, track, contact=contact, settings=settings, profiles=profiles)

    smooth = linear_vehicle(law, contact)
    result = CriticalSpeed(contact, vehicle.name_with_load, conditions(track, settings), low, high)
    result.remarks += smooth.remarks
    result.conicity_over_amplitude = conicity_over_amplitude(smooth)
    result.linear, stuck = _linear(result, smooth)
    result.remarks += smooth.path_remarks
    tell = progress or (lambda _: None)
    tell(0.02)
    if over_amplitude:
        result.linear_over_amplitude = _over_amplitude(smooth, result)
        if result.linear is not None and smooth.system.support.elastic:
            try:
                rigid = linear_vehicle(law, contact, track.replace(support={"preset": "rigid"}))
                lost = _loss_of_hunting(rigid, low, high)
                result.linear = replace(result.linear, speed_on_rigid_rails=lost.parameter)
                result.remarks += [f"on rigid rails: {one}" for one in rigid.path_remarks]
                if lost.parameter is None:
                    words = f"unstable at {low:g}" if lost.already else f"stable up to {high:g}"
                    result.remarks.append(f"on rigid rails: {words} m/s")
            except ModelError as error:
                result.remarks.append(f"on rigid rails: {error}")
    tell(0.05)
    wanted = [method for method in METHODS if method in methods and method != "linear"]
    if not any(track.frictions):
        result.remarks.append(NO_FRICTION)
        wanted, result.nonlinear = [], dict.fromkeys(wanted)
    if not wanted:
        return result
    of_runs = linear_vehicle(settings, Contact(conicity=conicity))
    begins = _loss_of_hunting(of_runs, low, high)
    if result.linear is not None:
        result.linear = replace(result.linear, speed_of_runs=begins.parameter)
    shape = _hunting_shape(of_runs, begins.parameter or high)
    motion = VehicleMotion(of_runs, settings.scheme, shape)
    for number, method in enumerate(wanted):
        DOING.info(f"{method}, method {number + 1} of {len(wanted)}")

        def share(fraction: float, number: int = number) -> None:
            tell(0.05 + 0.95 * (number + fraction) / len(wanted))

        def search(motion: VehicleMotion, method: str = method, share: Progress = share) -> None:
            try:
                if method == "ramp":
                    _by_ramp(result, motion, begins, stuck, excitations, share)
                elif method == "bifurcation":
                    unstable = [v for v in (stuck, begins.parameter) if v is not None]
                    _by_diagram(result, motion, unstable, points, excitations, share)
                else:
                    _by_continuation(result, motion, begins, share)
            except (LeftRange, ModelError) as error:
                result.remarks.append(f"{method}: {error}")

        before = len(result.branches), len(result.remarks)
        search(motion)
        slowest = result.nonlinear.get(method)
        if slowest and method != "continuation" and not lasts_in_shorter_steps(motion, slowest):
            del result.branches[before[0] :], result.remarks[before[1] :], result.nonlinear[method]
            search(motion.in_shorter_steps())
    _conclude(result, vehicle, of_runs, begins)
    _remark_range(result, vehicle)
    return result


def checked(
    contact: Contact,
    methods: Sequence[str],
    low: float | str,
    high: float | str,
    points: int = POINTS,
    excitations: Sequence[float] = EXCITATIONS,
) -> tuple[float, float]:
    """Return lowest and highest speed [m/s]; raise InputError with all faults of the arguments."""
    slowest, fastest = map(speed_in_si, (low, high))
    faults = Faults()
    odd = next((one for one in methods if one not in METHODS), None)
    faults.require(odd is None, "methods", f"found '{odd}'", " or ".join(METHODS), "--method")
    least, most = SPEED_RANGE
    for name, option, value in (("low", "--from", slowest), ("high", "--to", fastest)):
        inside = isinstance(value, Real) and least <= float(value) <= most
        faults.require(inside, name, f"found {value!r}", f"{least:g} to {most:g} m/s", option)
    if not faults:
        words = f"less than the highest, {fastest:.12g} m/s"
        faults.require(slowest < fastest, "low", f"found {slowest:.12g} m/s", words, "--from")
    whole = isinstance(points, Integral) and points in range(2, 201)
    faults.require(whole, "points", f"found {points!r}", "a whole number, 2 to 200")
    fits = [isinstance(a, Real) and SMALL <= float(a) <= LARGEST_EXCITATION for a in excitations]
    words = "no size" if all(fits) else f"found {excitations[fits.index(False)]} m"
    allowed, fine = f"{SMALL:g} to {LARGEST_EXCITATION:g} m", bool(fits) and all(fits)
    faults.require(fine, "excitations", words, allowed, "--excitation")
    used = "bifurcation" in methods or points == POINTS
    faults.require(used, "points", "has no effect", "only with the method bifurcation")
    used = "bifurcation" in methods or "ramp" in methods or tuple(excitations) == EXCITATIONS
    faults.require(used, "excitations", "has no effect", "only with ramp or bifurcation")
    faults += contact.faults()
    faults.check()
    return float(slowest), float(fastest)


def _hunts(linear: LinearVehicle) -> Callable[[Eigenmodes], bool]:
    """Whether a mode is hunting: by its name, or as it grows by more than sliding would damp.

    Well above the critical speed the body moves with the bogies, and the mode is called after it.
    """
    parts = parts_of(linear.model, linear.coordinates)

    def hunts(mode: Eigenmodes) -> bool:
        return mode.damping_ratios[0] < -SLIDING or mode_name(parts, mode).endswith("hunting")

    return hunts


def _loss_of_hunting(
    linear: LinearVehicle, low: float, high: float, path: ContactPath | None = None
) -> LossOfStability:
    """Where steady rolling loses its stability; of vehicles whose friction sticks to hunting only.

    Friction that sticks damps nothing: the sway of such a vehicle is slightly undamped at speeds at
    which friction, once it slides, damps it.
    """
    counts = _hunts(linear) if linear.sticking else None
    return loss_of_stability(lambda speed: linear.linearised(speed, path), low, high, counts)


def _linear(result: CriticalSpeed, linear: LinearVehicle) -> tuple[LinearLoss | None, float | None]:
    """The linear critical speed; a remark where there is none, or where friction sticks.

    Besides: from which speed another mode is undamped as long as friction sticks [m/s].
    """
    parts, low, high = parts_of(linear.model, linear.coordinates), result.low, result.high

    def words(mode: Eigenmodes) -> str:
        damping = 100.0 * mode.damping_ratios[0].round(9) + 0.0  # no rounding, nor a zero's sign
        return (
            f"{mode_name(parts, mode)}, {mode.frequencies[0]:.3g} Hz, damping {damping:.3g} % at "
            f"{mode.linearisation.parameter:g} m/s"
        )

    lost, stuck = _loss_of_hunting(linear, low, high), None
    # on hollow treads it grows about as the speed: at walking pace it may pass for none
    ends = (divergence(parts, eigenmodes(linear.linearised(speed))) for speed in (low, high))
    result.divergence = next(filter(None, ends), ())
    result.remarks += result.divergence
    if linear.sticking:
        other = loss_of_stability(linear.linearised, low, lost.parameter or high)
        mode = other.modes[0]
        begins = other.parameter is not None and other.parameter != lost.parameter
        if (begins or other.already) and not _hunts(linear)(mode):
            stuck = float(mode.linearisation.parameter)
            result.remarks.append(
                f"{mode_name(parts, mode)}, {mode.frequencies[0]:.3g} Hz, is undamped from "
                f"{mode.linearisation.parameter:.4g} m/s or less as long as all friction elements "
                "stick; sliding limits it, so that it does not count as loss of stability"
            )
    if lost.already or lost.parameter is not None:
        result.remarks += _stable_again(linear, lost.parameter or low, high)
    if lost.parameter is not None:
        mode = lost.modes[0]
        frequency = float(mode.frequencies[0])
        return LinearLoss(lost.parameter, frequency, mode_name(parts, mode)), stuck
    result.unstable_at_low = lost.already
    why = f"no linear critical speed from {low:g} to {high:g} m/s; least damped"
    why = "unstable at the lower end of the range" if lost.already else why
    result.remarks.append(f"{why}: {'; '.join(map(words, lost.modes))}")
    return None, stuck


def _stable_again(linear: LinearVehicle, lost: float, high: float) -> list[str]:
    """Remark where rest is stable above the speed at which it is not: the sway of a body hunts."""
    at, before, speed = linear.linearised, lost, AGAIN * lost
    while speed < high and (above := loss_of_stability(at, speed, high)).already:  # by any mode
        before, speed = speed, AGAIN * speed
    if speed >= high:
        return []
    downwards = loss_of_stability(lambda x: at(before + speed - x), before, speed)
    again = lost if downwards.parameter is None else before + speed - downwards.parameter
    to = high if above.parameter is None else above.parameter
    return [
        f"rest is unstable from {lost:.4g} m/s on, but no longer above {again:.4g} m/s: it is "
        f"stable from there to {to:.4g} m/s"
    ]


def _over_amplitude(linear: LinearVehicle, result: CriticalSpeed) -> OverAmplitude:
    """Linear critical speeds with harmonic linearisation, up to the width of the contact table."""
    found, low, high = OverAmplitude(), result.low, result.high
    for amplitude in AMPLITUDES:
        path = ContactPath(amplitude)
        try:
            lost = _loss_of_hunting(linear, low, high, path)
        except InputError:
            break
        result.remarks += path.remarks
        critical = lost.modes[0] if lost.parameter is not None else None
        found.amplitude.append(amplitude)
        found.speed.append(low if lost.already else lost.parameter)
        found.frequency.append(float(critical.frequencies[0]) if critical else None)
    return found


def _hunting_shape(linear: LinearVehicle, speed: float) -> Eigenmodes:
    """The mode in whose shape hunting is excited: of several the least damped.

    Where none is a hunting mode, one whose wheelsets move across by half of all else at least.
    """
    found = oscillations(eigenmodes(linear.linearised(speed)), SEARCHED[1])
    hunts, names = _hunts(linear), found.linearisation.names
    hunting = [k for k in range(len(found.eigenvalues)) if hunts(found.taken([k]))]
    lateral = [names.index(f"{wheelset}.y") for wheelset in linear.model.index.wheelsets]
    # m and rad: a symmetric mode has lateral motions by rounding only
    positions = [k for k, name in enumerate(names) if name.rpartition(".")[2] in COMPONENTS]
    most, all_else = (np.abs(found.shapes)[:, at].max(axis=1) for at in (lateral, positions))
    hunting = hunting or np.flatnonzero(most / all_else > 0.5 * np.max(most / all_else)).tolist()
    return found.taken([min(hunting, key=lambda k: found.damping_ratios[k])])


def _by_ramp(
    result: CriticalSpeed,
    motion: VehicleMotion,
    begins: LossOfStability,
    stuck: float | None,
    excitations: Sequence[float],
    progress: Progress,
) -> None:
    lowest, branch = ramp(motion, result.low, result.high, progress, excitations)
    result.branches.append(branch)
    result.nonlinear["ramp"] = lowest  # kept if a further one leaves the rails
    unstable = result.low if begins.already else begins.parameter
    end = result.high if lowest is None else lowest.speed
    above = (v for v in (stuck, unstable) if v and end > (v if v is stuck else far_above(v)))
    for at in sorted(above):  # the sway of stuck friction is another motion, however near
        # hunting dies above speeds at which rest is unstable: what it becomes there is sought too
        for top in (tops := tops_above(at, end)):
            slower, further = ramp(motion, result.low, top, excitations=excitations)
            result.branches.append(further)
            if slower is not None:
                result.nonlinear["ramp"] = lowest = slower
                break
        if lowest is not None and lowest.speed < end:
            break
        if at == unstable:
            words = " and ".join(f"{top:.4g}" for top in tops)
            result.remarks.append(
                f"ramp: rest is unstable at {at:.4g} m/s, but what is excited at {words} m/s dies "
                "or derails (bifurcation)"
            )
    top = branch.points[0].speed
    end = lowest.speed if lowest else top
    for slower, further in below(motion, end, result.low, max(excitations)):
        result.branches.append(further)
        result.nonlinear["ramp"] = lowest = slower
    if lowest is None:
        result.remarks.append(f"ramp: nothing hunts {_after(excitations)} at {top:.4g} m/s")
    if top < result.high:
        result.remarks.append(f"ramp: the vehicle derails above {top:.4g} m/s")


def _after(excitations: Sequence[float]) -> str:
    """Say what was tried: another disturbance may end in hunting."""
    size = 1e3 * max(excitations)
    return f"after disturbances of up to {size:g} mm in the shape of the hunting mode"


def _by_diagram(
    result: CriticalSpeed,
    motion: VehicleMotion,
    unstable: Sequence[float],
    points: int,
    excitations: Sequence[float],
    progress: Progress,
) -> None:
    speeds = speeds_about(unstable, result.low, result.high, points)
    result.remarks += filter(None, [unresolved(speeds, unstable)])
    branches = diagram(motion, speeds, progress, excitations, result.low)
    if not branches[0].points:
        raise LeftRange(f"the vehicle derails at {speeds[0]:.4g} m/s, the lowest speed")
    result.nonlinear["bifurcation"] = lowest = lowest_of(branches)
    result.branches += branches
    result.jumps = jumps(branches)
    reached, tried = max(p.speed for p in branches[0].points), _after(excitations)
    if reached < speeds[-1]:
        result.remarks.append(f"bifurcation: the vehicle derails above {reached:.4g} m/s")
    if lowest is None:
        result.remarks.append(f"bifurcation: nothing hunts {tried} at any of the {points} speeds")


def _by_continuation(
    result: CriticalSpeed, motion: VehicleMotion, begins: LossOfStability, progress: Progress
) -> None:
    followed = followed_branches(
        motion, begins, result.branches, (result.low, result.high), progress
    )
    result.branches += followed.branches
    result.remarks += followed.remarks
    # a branch that is left unfinished ends at its slowest motion or further down
    ends = [*followed.folds, *(point for one in followed.branches for point in one.points)]
    if begins.parameter is not None and followed.begins is not None:
        rising = followed.begins.speed > begins.parameter - 0.5 * RESOLUTION
        result.onset = "supercritical" if rising else "subcritical"
        ends.append(Point(begins.parameter, 0.0, float(begins.modes[0].frequencies[0])))
    if ends:
        result.nonlinear["continuation"] = slowest = min(ends, key=lambda point: point.speed)
        if not slowest.stable:
            result.remarks.append(
                f"continuation: the motion of {1e3 * slowest.amplitude:.2f} mm at "
                f"{slowest.speed:.4g} m/s is unstable, no run stays at it: a larger disturbance "
                "grows to another one, which was not followed from there"
            )


def _unstable_force(vehicle: Vehicle, Q0: Floats) -> float:
    """Limit of the rms of a wheelset's lateral force (EN 14363), of the lightest one [N].

    Without a service table that of a passenger vehicle.
    """
    laws = load_running_limits("en14363").limits
    service = vehicle.service or Service(admissible_speed=1.0, cant_deficiency=0.1)
    lightest = int(np.argmin(Q0.sum(axis=1)))
    at = Situation(vehicle, service, "1", math.inf, lightest, float(Q0[lightest].mean()), laws)
    return float(laws["instability"].at(at))


def _conclude(
    result: CriticalSpeed, vehicle: Vehicle, linear: LinearVehicle, begins: LossOfStability
) -> None:
    """Find type and limits from all branches.

    Where rest is unstable at the lower end already, nothing was seen to hunt where it becomes so,
    or hunting on other branches was not sought, the type is not known.
    """
    lowest, at = result.lowest, begins.parameter
    already = begins.already or result.divergence
    if not result.nonlinear:
        return  # every method failed, as the remarks say
    if only_from_rest := result.nonlinear.keys() == {"continuation"}:
        result.remarks.append(
            "continuation: only what begins where rest loses its stability was followed; other "
            "motions, as on the flange, may last to lower speeds (bifurcation, ramp)"
        )
    if lowest is None:
        result.type = "" if already or at is not None else "none"
    elif already or (at is not None and lowest.speed > far_above(at)):
        result.type = result.onset
    elif at is None or lowest.speed < at - RESOLUTION or result.onset == "subcritical":
        result.type = "subcritical"
    elif not only_from_rest:
        result.type = "supercritical"
    # a ramp passes the end of a branch late
    only_ramp = "ramp" in result.nonlinear and "bifurcation" not in result.nonlinear
    branches = [
        Branch(one.direction, [point for point in one.points if point.speed >= one.end])
        for one in result.branches
        if only_ramp or one.direction != "ramp"
    ]
    branches += [Branch("sustained", [point]) for point in result.nonlinear.values() if point]
    result.amplitude_limit = first_beyond(
        branches, AMPLITUDE_LIMIT, "amplitude", result.searched_to
    )
    if not only_from_rest:  # shooting knows no forces
        force = _unstable_force(vehicle, linear.Q0)
        result.instability_limit = first_beyond(branches, force, "sum_Y_rms", result.searched_to)
    if only_ramp and lowest is not None:
        result.remarks.append(
            "limits: on the falling ramp alone; at constant speed they are exceeded from up to "
            "2 m/s above, after other disturbances perhaps where this motion does not (bifurcation)"
        )


def _remark_range(result: CriticalSpeed, vehicle: Vehicle) -> None:
    """Say what hunts below the range, or where a vehicle is to be judged above it."""
    for method, point in result.nonlinear.items():
        if point is not None and point.speed <= result.low:
            result.remarks.append(f"{method}: hunts still at the lower end, {result.low:g} m/s")
    if vehicle.service is None:
        return
    needed = MARGIN * vehicle.service.admissible_speed
    if result.high < needed:
        result.remarks.append(
            f"searched to {result.high:g} m/s, less than {needed:.4g} m/s, {MARGIN:g} times the "
            "admissible speed: hunting above is not seen"
        )
