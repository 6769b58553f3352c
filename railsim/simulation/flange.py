"""The vehicle in tight curves and beside the middle of the track, for judging the time step there.

In a flange the contact is stiff laterally, and its damping and its friction couple the motions of a
wheelset in another way than on the treads.

What is sought is a state of rest.  A short way into the curve gives Newton's method a beginning: a
third of the time of settling.  Friction elements hold what the way left in them; with these, and
where Newton's method finds nothing, the vehicle settles over a long way.

On straight track wheels with hollow treads have further states of rest beside the middle, some of
them in flange contact, and given forces press vehicles aside.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial

import numpy as np

from railsim.arrays import Floats
from railsim.contact.geometry import geometry_of
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import curvature_sections
from railsim.kernels.contact_columns import W_Q
from railsim.kernels.internal import PAD
from railsim.kernels.state import ARC_LENGTH, LAST_STEP, SPEED, TIME
from railsim.kernels.status import RUNNING
from railsim.kernels.support import DOF
from railsim.kernels.system import System
from railsim.kernels.time_loop import FAST
from railsim.kernels.track_frame import MU_LEFT, MU_RIGHT, Y_LEFT, Y_RIGHT
from railsim.linear.steady import NotConverged, SteadyRolling, follow
from railsim.model.assembly import Model
from railsim.model.check_rails import standing_at
from railsim.model.equilibrium import tracks_under
from railsim.model.time_step import Situation, empty_recorder, record_state
from railsim.model.work import CONSTANT_SPEED, uneven_rigid_rails, without_loads
from railsim.notation import ROLL, YAW, Y, Z
from railsim.profiles.profile import Profile
from railsim.simulation.auxiliary_track import DOING, Progress, advance, curve_to_settle_in
from railsim.track.alignment import alignment_of
from railsim.track.tables import track_tables

WIDEST = 1500.0  # m; in wider curves wheelsets run on their treads
WIDER = 0.9  # curvature of the next curve over that of one where the vehicle leaves or wheels lift
IN_THE_MIDDLE = 1e-6  # m, rad, of steady rolling on straight track
TIMES = 3.0, 3.0  # in transition and curve, at least, where the vehicle settles [s]
# the same before Newton's method, and lengths [m]: the last wheelset has to be well in the curve
SHORT, SHORT_LENGTHS = (0.5, 0.0), (20.0, 10.0)
# m/s, no slower on the way to Newton's method, which ends at the speed in question: where speeds
# are low the state of rest hardly depends on them, and the time of the way goes with 1/V
BEGIN = 2.0
# The state sought is one of rest and does not depend on the contact damping: with more of it, it is
# reached also where the wheelset would vibrate.
MORE_DAMPING = 4.0
ASIDE = (5e-3, 4e-3, 3e-3)  # m, where a vehicle on hollow treads is set down, until one stays aside
TREAD, HOLLOW = 0.04, 2e-5  # m, half its width, least rise of a hollow one
LEAST_ASIDE = 1e-3  # m, of wheelsets of a state of rest that is another one than the middle


def tight_curves(track: Track) -> list[tuple[float, float]]:
    """Curvature [1/m] and cant [m] of the curves that are not wide, from the tightest on."""
    sections = curvature_sections(track)
    place = {}
    for section in sections:
        place[section.start_value] = section.begin
        place[section.end_value] = section.end
    for section in reversed(sections):
        if section.start_value == section.end_value:
            place[section.end_value] = 0.5 * (section.begin + section.end)
    tight = sorted((value for value in place if abs(value) >= 1.0 / WIDEST), key=abs)
    alignment = alignment_of(track)
    return [(value, float(alignment.cant(place[value]))) for value in reversed(tight)]


def in_flange_contact(
    model: Model, track: Track, rolling: Floats, step: float, progress: Progress | None = None
) -> list[Situation]:
    """Systems on curves as tight as the tightest ones of the track, and the settled vehicle there.

    To the right and to the left, where that makes a difference: the tightest in which the vehicle
    stays on the track at this speed, and where wheels lift there, wider ones until all are loaded.
    Runs may pass tighter curves slower, or end before them.

    `rolling`: steady rolling on straight track at the speed in question; `step`: of the fast
    scheme, stable on straight track [s]; `progress`: called repeatedly with the time simulated so
    far and the time to simulate [s].
    """
    found = []
    curves = tight_curves(track)
    if curves:
        DOING.info("settling in flange contact, for judging the time step")
    hands = [[curve for curve in curves if hand * curve[0] > 0.0] for hand in (1.0, -1.0)]
    for of_hand in [curves] if _symmetric(model, track, rolling) else hands:
        below = math.inf
        for curve in of_hand:
            if abs(curve[0]) >= below:
                continue
            run_into_curve = partial(_run_into_curve, model, track, curve, progress)
            at = _settle_in_curve(model, rolling, step, run_into_curve)
            if at is not None:
                found.append(at)
                if _all_loaded(model, *at):
                    break
            below = WIDER * abs(curve[0])
    return found


def off_centre(model: Model, track: Track, system: System, rolling: Floats) -> list[Situation]:
    """States of rest beside the middle of straight track, as vehicles on hollow treads have.

    `system`, `rolling`: of steady rolling on straight track.
    """
    wheelsets = [body.wheelset for body in model.flat.of_kind("wheelset") if body.wheelset]
    if not any(_is_hollow(model.profiles[name]) for each in wheelsets for name in each.profile):
        return []
    shapes = [geometry_of(wheelset, track, model.profiles) for wheelset in wheelsets]
    found = []
    for side in (1.0,) if _symmetric(model, track, rolling) else (1.0, -1.0):
        for aside in ASIDE:
            guess = rolling.copy()
            positions = guess[: 6 * model.index.n_bodies].reshape(-1, 6)
            positions[:, Y] += side * aside
            for body, shape in zip(system.contact.body, shapes, strict=True):
                if shape is not None:
                    k = int(np.searchsorted(shape.lateral, side * aside))
                    positions[body, [Z, ROLL]] += shape.centre_z[k], shape.roll[k]
            with suppress(NotConverged):  # then from another place, or the others decide alone
                state = SteadyRolling(model, system).solve(guess, float(rolling[SPEED]))
                if _aside(model, state, rolling):
                    found.append((system, state))
                    break
    return found


def _is_hollow(wheel: Profile) -> bool:
    """Whether its radius rises again towards the field side on the tread."""
    tread = wheel.z[np.abs(wheel.y) < TREAD]
    return bool(np.max(tread - np.minimum.accumulate(tread)) > HOLLOW)


def under_forces(model: Model, system: System, rolling: Floats, step: float) -> list[Situation]:
    """State of rest under the given forces and torques, each at its largest, if they push aside.

    `system`, `rolling`: of steady rolling on straight track, without any; `step`: stable there.
    """
    loads = model.system.loads
    if not len(loads.body):
        return []
    ends = zip(loads.start[:-1], loads.start[1:], strict=True)
    rows = [max(loads.table[i:j], key=lambda row: np.abs(row[1:]).max()) for i, j in ends]
    state = rolling.copy()

    def rising(begin: float) -> System:
        table = [[(begin, 0.0, 0.0, 0.0), (begin + TIMES[0], *row[1:])] for row in rows]
        start, over_time = 2 * np.arange(len(rows) + 1), loads.flags * np.array([1, 1, 0])
        given = loads._replace(start=start, table=np.reshape(table, (-1, 4)), flags=over_time)
        return system._replace(loads=given)

    if not _advance(model, rising(state[TIME]), state, 0.25 * step, sum(TIMES)):
        return []
    constant = rising(rolling[TIME] - TIMES[0])
    with suppress(NotConverged):  # then where the vehicle is at the end of the time
        state = _at_rest(model, constant, state, rolling)
    return [(constant, state)] if _aside(model, state, rolling) else []


def _aside(model: Model, state: Floats, rolling: Floats) -> bool:
    """Whether a state of rest is another one than the middle."""
    moved = (state - rolling)[: 6 * model.index.n_bodies].reshape(-1, 6)
    return bool(np.abs(moved[model.system.contact.body, Y]).max() > LEAST_ASIDE)


def _symmetric(model: Model, track: Track, rolling: Floats) -> bool:
    """Whether vehicle and rails are the same to the left and to the right."""
    friction = np.array(track.friction_table or ((0.0, *track.friction),))
    aside = rolling[: 6 * model.index.n_bodies].reshape(-1, 6)[:, [Y, ROLL, YAW]]
    same = np.array_equal(friction[:, 1], friction[:, 2]) and not track.check_rail
    return same and bool(np.abs(aside).max() < IN_THE_MIDDLE)


def _all_loaded(model: Model, system: System, state: Floats) -> bool:
    """Whether every wheel carries load."""
    recorder = empty_recorder(model, 1)
    record_state(system, state, recorder)
    return bool(np.all(recorder.wheel[0, :, :, W_Q] > 0.0))


def _settle_in_curve(
    model: Model, rolling: Floats, step: float, run_into_curve: Callable[..., Situation | None]
) -> Situation | None:
    """System on a curve and the settled vehicle; None where it does not stay on the track.

    `brought`: brings the vehicle into the curve, as `_brought`.
    """
    if not (model.system.internal.kind == PAD).any():
        start = rolling.copy()
        start[SPEED] = max(start[SPEED], BEGIN)
        found = run_into_curve(start, step, SHORT, SHORT_LENGTHS)
        with suppress(NotConverged):
            if found is not None:
                return found[0], _at_rest(model, *found, rolling)
    return run_into_curve(rolling, 0.5 * step, TIMES)


def at_rest_with(
    model: Model, situation: Situation, speed: float, less: float | Floats
) -> Situation:
    """System and state of rest at another speed and with less friction, by Newton's method.

    `at`: system and vehicle at rest on a curve; `speed`: [m/s]; `less`: taken from the coefficients
    of friction, of both rails or float64[2].  Raises NotConverged: there is no state of rest near
    the known one.
    """
    system, state = situation
    rail = system.track.rail.copy()
    friction = rail[:, MU_LEFT : MU_RIGHT + 1, 0]
    np.maximum(friction - less, 0.0, out=friction)
    system = system._replace(track=system.track._replace(rail=rail))
    return system, SteadyRolling(model, system).solve(state, speed)


def at_check_rails(model: Model, track: Track, situation: Situation) -> list[Situation]:
    """Return a situation with the check rails where each of the track's is nearest to its rail."""
    found = []
    system, state = situation
    for rail in track.check_rail:
        s, _ = min(rail.flangeway, key=lambda row: row[1])
        check = standing_at(model.check, s)
        contact = system.contact._replace(**check._asdict())
        found.append((system._replace(contact=contact), state))
    return found


def at_narrowest_gauge(model: Model, track: Track, situation: Situation) -> list[Situation]:
    """Return a situation led to the track's narrowest gauge, if that is narrower than usual."""
    system, state = situation
    _, left, right = min(track.gauge_widening or ((0.0, 0.0, 0.0),), key=lambda row: sum(row[1:]))
    if left + right >= 0.0:
        return []

    def with_gauge(share: float) -> tuple[System, float]:
        rail = system.track.rail.copy()
        rail[:, Y_LEFT, 0], rail[:, Y_RIGHT, 0] = -share * left, share * right
        table = system.track._replace(rail=rail, has_irregularity=1)
        return system._replace(track=table), float(state[SPEED])

    with suppress(NotConverged):  # then the usual gauge decides alone
        return [(with_gauge(1.0)[0], follow(model, with_gauge, state)[0])]
    return []


def _run_into_curve(
    model: Model,
    track: Track,
    curve: tuple[float, float],
    progress: Progress | None,
    rolling: Floats,
    step: float,
    times: tuple[float, float],
    *lengths: tuple[float, float],
) -> Situation | None:
    """System on the curve, and the vehicle at the end of its way; None where it leaves the rails.

    `times`, `lengths`: of `curve_to_settle_in`.
    """
    system = model.system
    speed = float(rolling[SPEED])
    rail = system.track.rail
    friction = float(np.max(rail[:, MU_LEFT, 0])), float(np.max(rail[:, MU_RIGHT, 0]))
    auxiliary = curve_to_settle_in(model, track, speed, *curve, friction, times, *lengths)
    tables = track_tables(auxiliary)._replace(has_irregularity=uneven_rigid_rails(system))
    smooth = without_loads(system)._replace(track=tables, drive=CONSTANT_SPEED)
    state = rolling.copy()
    time = auxiliary.length / speed
    return (smooth, state) if _advance(model, smooth, state, step, time, progress) else None


def _advance(
    model: Model,
    system: System,
    state: Floats,
    step: float,
    time: float,
    progress: Progress | None = None,
) -> bool:
    """Advance a state with more contact damping; return whether the vehicle stays on the rails."""
    contact = system.contact
    damped = system._replace(contact=contact._replace(damping=MORE_DAMPING * contact.damping))
    status = advance(model, damped, state, step, math.floor(time / step), FAST, progress)
    state[LAST_STEP] = 0.0  # of the last step's length: steps of any length are judged from here
    return status == RUNNING


def _at_rest(model: Model, system: System, state: Floats, rolling: Floats) -> Floats:
    """State of rest near one of a run: Newton's method begins with the positions alone.

    Dampers do not pull at rest; and slopes of contact forces that were learnt in vibrations would
    decide on the stability of a step.
    """
    guess = rolling.copy()
    positions = 6 * model.index.n_bodies
    guess[:positions], guess[ARC_LENGTH] = state[:positions], state[ARC_LENGTH]
    if system.support.elastic:
        tracks_under(system, guess)[:, :DOF] = tracks_under(system, state)[:, :DOF]
    return SteadyRolling(model, system).solve(guess, float(rolling[SPEED]))
