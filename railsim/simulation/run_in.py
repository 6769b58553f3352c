"""The initial state of a run: anywhere along a track, in curves and on irregular rails.

The equilibrium on straight smooth track is not a suitable initial state in a curve or on irregular
rails: the wheelsets would climb or fall.  Therefore the vehicle runs in:

- into a curve over an auxiliary track, which begins straight, reaches curvature and cant of the
  starting position over a transition, and keeps them until the vehicle has settled; the state at
  its end, relative to the track frames, is the initial state; or, if requested, the initial state
  is the steady state found by Newton's method;
- on a straight gradient, where the support of the rails varies, or the speed changes, it is in the
  steady state there, by Newton's method;
- into a transition, a ramp, a vertical curve or a range over which sections, support, friction or
  check rails change, over the real track, from the last position before it where the track under
  the vehicle is uniform, since its state depends on the twist, or the rails, passed;
- onto irregular rails over the last seconds of the real track before the start;
- where it does not stay on the rails that way, over the whole track from its beginning: so it can
  start wherever a run passes.

The wheels are round up to there; on wheels that are not, the wheelsets are put as they stand.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.track.definition import Track
from railsim.errors import InputError, ModelError, argument_error
from railsim.kernels.internal import PAD
from railsim.kernels.rails import (
    MIDDLE_Y,
    MIDDLE_Z,
    ROLL,
    ROLL_SLOPE,
    SHIFT,
    SHIFT_SLOPE,
    SINE,
    SLOPE_Y,
    SLOPE_Z,
    locate_rails,
)
from railsim.kernels.rhs import locate_frames
from railsim.kernels.state import ARC_LENGTH, LAST_STEP, SPEED, velocity_begin
from railsim.kernels.status import RUNNING
from railsim.kernels.system import CONSTANT, RADIUS, TABLE, System, Work
from railsim.kernels.time_loop import FAST
from railsim.kernels.track_frame import FRAME_SIZE
from railsim.linear.circle import POSITION, at_middle, circle
from railsim.linear.steady import NotConverged, SteadyRolling, follow
from railsim.model.assembly import Model
from railsim.model.check_rails import CheckRails, standing_at
from railsim.model.equilibrium import Equilibrium, initial_state
from railsim.model.uneven_wheels import ROUND, rolling
from railsim.model.work import CONSTANT_SPEED, without_loads, work_arrays
from railsim.simulation.auxiliary_track import (
    DOING,
    NEGLIGIBLE,
    Progress,
    advance,
    curve_to_settle_in,
)
from railsim.track.alignment import Alignment, alignment_of
from railsim.track.tables import track_tables

TIMES = 4.0, 6.0  # s in transition and curve; several periods of the car body
APPROACH_TIME, APPROACH = 4.0, 30.0  # s and m at least of irregular rails before the start
LONGEST_APPROACH_TIME, LONGEST_APPROACH = 30.0, 500.0  # s and m at least of changing alignment
UNCHANGING = 1e-9  # change of curvature (1/m2), cant and grade angle (1/m) below which it is none
SMOOTH = 10.0  # m before the track's beginning where the approach may begin, beside the vehicle


def start_state(
    model: Model,
    balance: Equilibrium,
    track: Track,
    start: float,
    step: float,
    scheme: int,
    progress: Progress | None = None,
    remark: Callable[[str], None] | None = None,
) -> tuple[Floats, int]:
    """State of the undisturbed vehicle at time 0 and exactly at `start`, and the steps before it.

    The state is float64[n_state], with what the scheme remembers of the way, if that goes on in the
    run; the steps are those of `approach`, over the track as it is.

    `start`: arc length of the reference body [m]; `step`, `scheme`: time step [s] and scheme of the
    run; `progress`: called repeatedly with the time simulated so far and the time to simulate [s];
    `remark`: where it is given, the vehicle is in its steady state in a curve; called with a
    sentence where it is not. Raises InputError: the vehicle does not stay on the track there.
    ModelError: the vehicle is longer than the track's table.
    """
    speed = float(balance.state[SPEED])

    def state_after(steps: int) -> Floats:
        """State at `start` after so many steps over the real track."""
        s = start - steps * speed * step
        before = 0.0

        def settling(done: float, whole: float) -> None:
            nonlocal before
            before = whole
            if progress is not None:
                progress(done, whole + steps * step)

        def approaching(done: float, whole: float) -> None:
            if progress is not None:
                progress(before + done, before + whole)

        frames = _frames(model, s)
        state = None if remark is None else _steady(model, balance, track, s, remark)
        if state is None:
            state = settle_in_curve(model, balance, track, s, step, settling)
        if state is None:
            standing = _standing(model, balance, track, s, at_start=not steps)
            state = initial_state(model, standing, s, frames)
        state[ARC_LENGTH] = s
        if steps:
            follow_rails(model, state)
            # round on the way, but with a row for each wheel: changing rails are looked up by it
            round_ones = ROUND._replace(surface_of=np.full_like(model.wheels.surface_of, -1))
            system = rolling(without_loads(model.system), round_ones, model.check, model.rails)
            system = system._replace(drive=CONSTANT_SPEED)
            _run(model, system, state, step, steps, scheme, start, "on its way there", approaching)
        state[-3:] = 0.0, start, speed
        if model.wheels.uneven:
            follow_wheels(model, state, track.rail_base)
        pushed = model.system.loads, model.system.drives, model.system.actuators
        if model.wheels.uneven or any(len(part.body) for part in pushed):
            state[LAST_STEP] = 0.0  # what the scheme remembers of the way was without them
        return state

    steps = approach(model, track, start, speed, step)
    whole = math.floor(start / (speed * step))
    try:
        return state_after(steps), steps
    except InputError:
        if whole <= steps:
            raise
    return state_after(whole), whole


def _with_check_rails(system: System, check: CheckRails) -> System:
    """Return the system with check rails."""
    return system._replace(contact=system.contact._replace(**check._asdict()))


def _standing(
    model: Model, balance: Equilibrium, track: Track, s: float, *, at_start: bool
) -> Equilibrium:
    """Return the balance on the gradient and rails at `s`; at the start with the change of speed.

    Where drives or brakes of axles change the speed too, it is that at constant speed.
    """
    drive = model.system.drive
    driven = len(model.system.drives.body) > 0
    accelerated = at_start and drive.mode != CONSTANT and not driven
    if not (len(model.system.support.variation) or _gradient(track, s) or accelerated):
        return balance
    there = _inclined(circle(track, at=s), track, s)
    if drive.mode == TABLE:
        drive = drive._replace(table=drive.table + np.array([POSITION - s, 0.0]))
    system = _with_support_at(without_loads(model.system), s)._replace(
        track=track_tables(there), drive=drive
    )
    speed = float(balance.state[SPEED])
    try:
        solver = SteadyRolling(model, system, accelerated=accelerated)
        state = solver.solve(at_middle(balance.state), speed)
    except NotConverged:  # vehicle and rails settle as the run begins
        return balance
    state[-3:] = balance.state[-3:]
    return replace(balance, state=state)


def _with_support_at(system: System, s: float) -> System:
    """Return the system with the support of the rails at `s` moved to `POSITION`."""
    moved = system.support.variation + np.array([POSITION - s, 0.0, 0.0])
    return system._replace(support=system.support._replace(variation=moved))


def _friction(track: Track, s: float) -> tuple[float, float]:
    """Coefficients of friction of the left and right rail at `s`."""
    left, right = track.friction_at(s).tolist()
    return left, right


def approach(model: Model, track: Track, start: float, speed: float, step: float) -> int:
    """Steps to run on the real track before the start.

    Irregular rails need a certain time.  A transition, a ramp, a vertical curve or a range of
    `_changing`, at the start or at the beginning of that time, is entered as in a run over the
    whole track: from the last position before it where curvature, cant, gradient and rails under
    the whole vehicle are constant.
    """
    system = model.system
    room = start + float(np.min(system.frame_offset)) - system.track.s_start - SMOOTH
    along = alignment_of(track), _changing_ranges(model.rails.ends, system.support.variation, track)
    way = max(APPROACH_TIME * speed, APPROACH) if _is_displaced(model, start) else 0.0
    way += _way_from_constant(*along, start - way, system.frame_offset, room - way, speed)
    return max(0, math.floor(min(way, room) / (speed * step)))


def _changing_ranges(sections: Floats, support: Floats, track: Track) -> Floats:
    """Ranges over which section, support or friction of the rails or check rails change [m].

    `sections`: begin and end of the ranges of sections; `support`: rows of `Support.variation`.
    """
    tables = [support, track.friction_table or (), *(rail.rows for rail in track.check_rail)]
    rows = [pair for table in tables for pair in pairwise(np.asarray(table).tolist())]
    ranges = [(one[0], two[0]) for one, two in rows if one[1:] != two[1:]]
    ranges += [(s, s) for rail in track.check_rail for s, _ in (rail.rows[0], rail.rows[-1])]
    return np.vstack([sections.reshape(-1, 2), np.array(ranges).reshape(-1, 2)])


def _is_displaced(model: Model, start: float) -> bool:
    """Whether an irregularity moves the rails under the wheelsets."""
    if not model.system.track.has_irregularity:
        return False
    work = _rails_at(model, start)
    moved = [MIDDLE_Y, MIDDLE_Z, SLOPE_Y, SLOPE_Z, SINE, ROLL_SLOPE]
    return bool(work.plane[:, moved].any() or work.rail[:, :, SHIFT : SHIFT_SLOPE + 1].any())


def _way_from_constant(
    alignment: Alignment, ranges: Floats, start: float, offsets: Floats, room: float, speed: float
) -> float:
    """Way to the start from where the track under the vehicle does not change [m].

    0 where the start is such a point; where there is none, as far as one goes back at most.
    """
    farthest = min(max(LONGEST_APPROACH_TIME * speed, LONGEST_APPROACH), room)
    ways = np.arange(0.0, max(farthest, 0.0) + 0.5, 0.5)
    under = np.arange(float(np.min(offsets)), float(np.max(offsets)) + 0.5, 0.5)
    for distances in (ways[:1], ways):  # most runs begin where nothing changes
        s = start - distances[:, None] + under
        changes = [
            alignment.curvature.rate(s),
            alignment.cant_angle_rate(s),
            alignment.grade_angle_rate(s),
        ]
        constant = np.all(np.abs(changes) < UNCHANGING, axis=(0, 2))
        constant &= ~((ranges[:, 0] < s[:, -1:]) & (s[:, :1] < ranges[:, 1])).any(axis=1)
        if constant.any():
            return float(distances[int(np.argmax(constant))])
    return float(farthest)


def _rails_at(model: Model, s: float) -> Work:
    """Work arrays with the rails under a vehicle at `s`."""
    work = work_arrays(model.system)
    locate_rails(model.system, work, s)
    return work


def _frames(model: Model, s: float) -> Floats:
    """Track frames of a vehicle at `s`."""
    system, count = model.system, len(model.system.frame_offset)
    reference = system.bodies.frame[system.bodies.reference]
    frames, cell = np.zeros((count, FRAME_SIZE)), np.zeros(count, dtype=np.int64)
    track = system.track, system.frame_offset, reference
    if locate_frames(*track, s, frames, cell, np.zeros(count)) != RUNNING:
        raise ModelError("the vehicle is longer than the track's table allows")
    return frames


def follow_rails(model: Model, state: Floats) -> None:
    """Put the wheelsets on irregular rails, moving as the rails lead them."""
    speed, n = state[SPEED], model.index.n_bodies
    before = state.copy()
    plane = _rails_at(model, float(state[ARC_LENGTH])).plane
    for w, body in enumerate(model.system.contact.body):
        first, rate = 6 * body, velocity_begin(n) + 6 * body
        height = model.system.bodies.nominal[body, 1]
        # the centre of the wheelset leans over with the rails
        state[first + 1] += plane[w, MIDDLE_Y] - height * plane[w, SINE]
        state[first + 2] += plane[w, MIDDLE_Z]
        state[first + 3] += plane[w, ROLL]
        state[first + 5] += plane[w, SLOPE_Y]
        state[rate + 1] += speed * (plane[w, SLOPE_Y] - height * plane[w, ROLL_SLOPE])
        state[rate + 2] += speed * plane[w, SLOPE_Z]
        state[rate + 3] += speed * plane[w, ROLL_SLOPE]
    _turn_arms(model, state, state - before)


def _turn_arms(model: Model, state: Floats, displacement: Floats) -> None:
    """Turn the arms of axleboxes so that their springs give way least to what `moved` wheelsets.

    With the points (x, y) and vertical stiffnesses k of an arm's springs, counted from the middle
    of the axle, the pitch is sum k x (z + y roll) / sum k x^2: a stiff bush stays where it is.
    """
    bodies, mounts, n = model.system.bodies, model.system.mounts, model.index.n_bodies
    for arm in bodies.axleboxes:
        on_arm = mounts.body == arm
        k = np.broadcast_to(mounts.stiffness[:, 2:], on_arm.shape)[on_arm]
        x, y, _ = mounts.point[on_arm].T
        if not k @ x**2:
            continue
        for first in (0, velocity_begin(n)):
            z, roll = displacement[first + 6 * bodies.parent[arm] + np.array([2, 3])]
            state[first + 6 * arm + 4] += k @ (x * (z + y * roll)) / (k @ x**2)


def follow_wheels(model: Model, state: Floats, base: float) -> None:
    """Put the wheelsets on wheels that are not round, moving as these lead them.

    z = -(e_l + e_r)/2 and roll = -(e_r - e_l)/`base` [m] about the rails, e and its rate e_phi V/r0
    as in `railsim.kernels.wheel_surface`.
    """
    system, n, before = model.system, model.index.n_bodies, state.copy()
    for w, body in enumerate(system.contact.body):
        radius, first = system.bodies.row[body, RADIUS], 6 * body
        s = state[ARC_LENGTH] + system.frame_offset[system.bodies.frame[body]]
        e = model.wheels.heights(w, s / radius - state[first + 4])
        e[:, 1] *= state[SPEED] / radius
        for at, left, right in zip((first, velocity_begin(n) + first), e[0], e[1], strict=True):
            roll = (left - right) / base
            state[at + 1] -= system.bodies.nominal[body, 1] * roll
            state[at + 2] -= 0.5 * (left + right)
            state[at + 3] += roll
    _turn_arms(model, state, state - before)


def _run(
    model: Model,
    system: System,
    state: Floats,
    step: float,
    steps: int,
    scheme: int,
    start: float,
    where: str,
    progress: Progress | None = None,
) -> None:
    """Advance a state; InputError if the vehicle leaves the track."""
    DOING.info("on the way to the start")
    if advance(model, system, state, step, steps, scheme, progress) != RUNNING:
        words = f"the vehicle does not stay on the track at s = {start:g} m, "
        found = f"{words}{where}, at {state[SPEED]:g} m/s"
        raise argument_error("start", found, "a start on straight track or a lower speed")


def _curve(track: Track, s: float) -> tuple[float, float]:
    """Curvature [1/m] and cant [m] at `s`, 0 where negligible."""
    alignment = alignment_of(track)
    curvature, cant = float(alignment.curvature(s)), float(alignment.cant(s))
    return (
        curvature if abs(curvature) >= NEGLIGIBLE else 0.0,
        cant if abs(cant) >= NEGLIGIBLE else 0.0,
    )


def _gradient(track: Track, s: float) -> float:
    """Gradient at `s`, 0 where negligible."""
    gradient = float(alignment_of(track).gradient(s))
    return gradient if abs(gradient) >= NEGLIGIBLE else 0.0


def _inclined(level: Track, track: Track, s: float) -> Track:
    """Return a level track on the gradient that another one has at `s`."""
    gradient = _gradient(track, s)
    slope = [{"type": "CST", "length": level.length, "gradient": gradient}]
    return level.replace(vertical=slope) if gradient else level


def _steady(
    model: Model, balance: Equilibrium, track: Track, start: float, remark: Callable[[str], None]
) -> Floats | None:
    """State as of `settled` by Newton's method; None, and a remark in a curve, where there is none.

    Friction elements hold what the way into the curve left in them: no steady state tells that.
    """
    curvature, cant = _curve(track, start)
    if not (curvature or cant):
        return None
    if (model.system.internal.kind == PAD).any():
        remark(
            "The run begins with a run-in: the forces of friction elements depend on the history."
        )
        return None
    speed, friction = float(balance.state[SPEED]), _friction(track, start)
    there = _with_support_at(without_loads(model.system), start)
    level = _with_check_rails(there, standing_at(model.check, start))

    def along(share: float) -> tuple[System, float]:
        part = circle(track, curvature=share * curvature, cant=share * cant, friction=friction)
        return level._replace(track=track_tables(_inclined(part, track, start))), speed

    try:
        state = follow(model, along, at_middle(balance.state))[0]
    except NotConverged as error:
        remark(f"The run begins with a run-in, as Newton's method found {error}.")
        return None
    state[-3:] = balance.state[-3:]
    return state


def settle_in_curve(
    model: Model,
    balance: Equilibrium,
    track: Track,
    start: float,
    step: float,
    progress: Progress | None = None,
) -> Floats | None:
    """State of a vehicle that has settled into the curve at `start`, None on straight track.

    `start`: arc length of the reference body [m]; `step`: of the fast scheme [s]; `progress`: as of
    `start_state`. Returns float64[n_state] relative to the track frames; time, position and speed
    are those of `balance`. Raises InputError: the vehicle does not stay on the track there.
    """
    curvature, cant = _curve(track, start)
    if not (curvature or cant):
        return None
    speed = float(balance.state[SPEED])
    auxiliary = curve_to_settle_in(
        model, track, speed, curvature, cant, _friction(track, start), TIMES
    )
    auxiliary = _inclined(auxiliary, track, start)
    there = without_loads(model.system)
    if len(rows := there.support.variation):
        everywhere = np.array([[start, *(np.interp(start, rows[:, 0], f) for f in rows.T[1:])]])
        there = there._replace(support=there.support._replace(variation=everywhere))
    system = _with_check_rails(there, standing_at(model.check, start))._replace(
        track=track_tables(auxiliary), drive=CONSTANT_SPEED
    )
    state = balance.state.copy()
    steps = math.ceil(auxiliary.length / speed / step)
    where = f"R {1.0 / curvature:.0f} m" if curvature else "on cant"
    _run(model, system, state, step, steps - 1, FAST, start, where, progress)
    state[-3:] = balance.state[-3:]
    return state
