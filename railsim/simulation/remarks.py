"""Remarks on a run for the reader of its result, one sentence each.

`status` says how a run ended; remarks say what to keep in mind when its numbers are used.  The root
attribute ``remarks`` holds them, one a line; tables, summaries and comparisons repeat them.  A
remark is added here, from what the run has counted, or to `Run.remarks` while it is computed.
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from railsim.arrays import Floats, first_largest
from railsim.contact.table import TableGrid
from railsim.kernels.actuators import ABOUT, ACTION, BY_DAMPER, COMMAND, LARGEST, MODE
from railsim.kernels.state import ARC_LENGTH, SPEED, TIME
from railsim.kernels.support import FORCE_TOLERANCE, MAX_CORRECTIONS
from railsim.kernels.system import DIVIDED_STEPS, UNSETTLED_RAILS, Support, System
from railsim.kernels.vibration import (
    ALTERNATES_AT,
    ALTERNATION,
    AMPLITUDE,
    CUT_OFF,
    FREQUENCY,
    POSITION,
)
from railsim.notation import SIDES
from railsim.result.data import Result
from railsim.result.hunting import Hunting
from railsim.simulation.advance import Run
from railsim.simulation.outputs import run_extremes

# Vertical impacts: twice the ratio at which North American wagons are taken out of service (AAR
# Rule 41: 400 kN on wheels of 159 kN)
MOST_Q = 5.0  # times the static wheel load
# Track shift forces: this many times the limit 10 kN + P0/3 of EN 14363, P0 the axle load
MOST_SUM_Y = 3.0
VIBRATES = 0.05  # amplitude of a wheel load over the static one
# amplitude of a guiding force from step to step over the static wheel load; the second where steps
# are divided: flanges that strike have part of it
ALTERNATES = 0.005, 0.02
# h c/m of a commanded damper, m of the lighter body: a pair of yaw dampers alternates from there on
COMMANDED = 0.3
UNDISTURBED = 1e-5  # m, largest displacement of a wheelset that nothing has moved
SLIDES, SLIDING = 0.05, 0.2  # longitudinal creepage, and s for which it is above that
LONG = 1.0  # s: what is shorter is not taken for a test of stability
YAW_MAX = TableGrid().yaw_max
START_ALONE = "; all within the start of the run, which tables of peaks leave out"


@contextmanager
def silent() -> Iterator[None]:
    """Do not report the remarks of runs within the block: those of variants."""
    log = logging.getLogger("railsim")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)


def run_remarks(run: Run, swings: Hunting | None, seen: Result) -> tuple[str, ...]:
    """Return the remarks on a run that has ended, each once.

    `swings` is its limit cycle, `seen` what showed that, see `railsim.result.hunting`.
    """
    prepared, extremes = run.prepared, run_extremes(run.extremes, run.prepared.balance.Q0)
    model, Q0 = prepared.model, prepared.balance.Q0
    wheelsets, support = model.index.wheelsets, model.system.support
    uneven, hunts = model.wheels.uneven, swings is not None
    irregular = bool(model.system.track.has_irregularity or len(model.rails.ends))
    duration = float(run.state[TIME] - prepared.state[TIME])
    found = [
        *run.remarks,
        *prepared.remarks,
        evaluated_whole(prepared.evaluation - float(prepared.state[TIME]), duration),
        ended_by_the_track(
            prepared.end_time - float(run.state[TIME]),
            prepared.end_distance - float(run.state[ARC_LENGTH]),
            float(run.state[SPEED]),
        ),
        *beyond_experience(extremes, Q0, wheelsets),
        lifted_wheels(extremes, run.work.unloaded, run.unloaded, wheelsets),
        stability(swings, extremes, duration) if hunts or not uneven else "",
        vibration(
            run.work.vibration,
            Q0,
            wheelsets,
            vibration_cause(
                hunts=hunts,
                uneven=uneven,
                irregular=irregular,
                varying=len(support.variation) > 1,
                struck=bool(model.check.check.size),
                centred=_is_centred(extremes),
                slides=bool(model.system.track.rail[:, 4:, 0].any()),  # of both rails, in its cells
                elastic=bool(support.elastic),
            ),
        ),
        alternation(run.work.vibration, Q0, wheelsets, int(run.work.counts[DIVIDED_STEPS])),
        commanded_dampers(
            model.system, model.index.actuators, run.work.memory, prepared.steps.smallest
        ),
        sliding(seen["time"], seen["xi_x"], wheelsets),
        long_for_slip_control(
            prepared.steps.smallest,
            prepared.steps.too_long_below,
            float(min(prepared.state[SPEED], run.state[SPEED])),
        ),
        creep_range(int(run.events[1]), int(run.events[0])),
        yaw_range(int(run.events[2]), float(np.sqrt(model.rails.arrays.w[-1]))),
        unsettled_rails(int(run.work.counts[UNSETTLED_RAILS])),
        uneven_wheels_on(support) if uneven else "",
    ]
    return tuple(dict.fromkeys(filter(None, found)))


def evaluated_whole(left_out: float, duration: float) -> str:
    """Remark on a run that is over before its peaks were to be evaluated [s]."""
    if duration > left_out or not left_out:
        return ""
    return (
        f"The run ended within the {left_out:.3g} s after the start that tables of peaks leave out "
        "(settings.outputs.evaluate_after): they hold the peaks of all of it."
    )


def ended_by_the_track(time_left: float, way_left: float, speed: float) -> str:
    """Remark on a run shorter than the duration asked for [s], no way being left [m]."""
    if not 0.1 < time_left < np.inf or way_left > 0.1 * speed:
        return ""
    return f"The track's plan, and the run, ended {time_left:.3g} s before the duration asked for."


def beyond_experience(
    extremes: Mapping[str, Floats], Q0: Floats, wheelsets: Sequence[str]
) -> tuple[str, ...]:
    """Remarks on forces larger than any that are known from railways.

    `extremes`: see `railsim.simulation.outputs.run_extremes`; `Q0`: static wheel loads [N].
    """
    found = []
    ratio = extremes["Q"][0] / Q0
    w, side = first_largest(ratio)
    if ratio[w, side] > MOST_Q:
        where = _where(extremes, "Q", (0, w, side), f"{wheelsets[w]}, {SIDES[side]}")
        found.append(
            f"The largest Q is {ratio[w, side]:.3g} times the static wheel load ({where}), beyond "
            f"all experience (limit {MOST_Q:g}): the forces of this run are not to be relied upon."
        )
    limit = 10e3 + Q0.sum(axis=1) / 3.0
    ratio = np.abs(extremes["sum_Y"]) / limit
    row, w = first_largest(ratio)
    if ratio[row, w] > MOST_SUM_Y:
        where = _where(extremes, "sum_Y", (row, w), wheelsets[w])
        found.append(
            f"The largest sum_Y is {abs(extremes['sum_Y'][row, w]) / 1e3:.4g} kN ({where}), "
            f"{ratio[row, w]:.3g} times the limit 10 kN + P0/3 of EN 14363, beyond all experience "
            f"(limit {MOST_SUM_Y:g}): the forces of this run are not to be relied upon."
        )
    return tuple(found)


def lifted_wheels(
    extremes: Mapping[str, Floats], unloaded: Floats, before: Floats, wheelsets: Sequence[str]
) -> str:
    """Remark on wheels `unloaded` for some time [s], `before` the evaluation of peaks began [s]."""
    number = int(np.count_nonzero(unloaded))
    if number == 0:
        return ""
    w, side = first_largest(unloaded)
    where = _where(extremes, "Q", (1, w, side), "first at")
    who = f"{wheelsets[w]}, {SIDES[side]}"
    others = "" if number == 1 else f"; {number} wheels in all were off their rails"
    return (
        f"A wheel lifts off its rail: {who}, for {1e3 * unloaded[w, side]:.3g} ms altogether "
        f"({where}){others}{'' if np.any(unloaded > before) else START_ALONE}."
    )


def _is_centred(extremes: Mapping[str, Floats]) -> bool:
    """Whether no wheelset has left the middle of the track."""
    return bool(np.max(np.abs(extremes["wheelset_lateral"])) < UNDISTURBED)


def stability(swings: Hunting | None, extremes: Mapping[str, Floats], duration: float) -> str:
    """Remark on a vehicle that hunts, or that nothing has disturbed laterally in the run [s]."""
    if swings is not None:
        return swings.sentence
    if duration < LONG or not _is_centred(extremes):
        return ""
    return (
        "Nothing disturbs the vehicle laterally: its wheelsets stay in the middle of the track, "
        "and the run proves nothing about its stability."
    )


def _where(extremes: Mapping[str, Floats], name: str, index: tuple[int, ...], words: str) -> str:
    """Say when and where an extreme value occurs."""
    time, s = (float(extremes[f"{name}_{fact}"][index]) for fact in ("time", "distance"))
    return f"{words}{'' if words.endswith('at') else ','} t = {time:.2f} s, s = {s:.1f} m"


def unsettled_rails(evaluations: int) -> str:
    """Remark on evaluations that took all corrections that `kernels.support` allows.

    Whether the last of them was enough is not evaluated.
    """
    if evaluations == 0:
        return ""
    return (
        f"In {_evaluations(evaluations)} the forces between wheels and elastic rails used all "
        f"{MAX_CORRECTIONS} iterations and may not have converged; their error may exceed "
        f"{FORCE_TOLERANCE:.2%} of the static wheel load: --check-step shows whether that matters."
    )


def _evaluations(number: int) -> str:
    return f"{number} evaluation{'s' * (number > 1)}"


def uneven_wheels_on(support: Support) -> str:
    """Remark on wheels that are not round on a track without masses."""
    if support.elastic and not support.massless:
        return ""
    rails = "has no masses" if support.elastic else "is rigid"
    return (
        f"Wheels are not round, and the track {rails}: "
        "what flats and short waves do to it above 50 Hz depends on the mass of the rails; "
        'preset = "co-running" or "p2" of [support] has one.'
    )


def creep_range(outside: int, patches: int) -> str:
    """Remark on loaded contact patches outside the creep law's range of a/b."""
    if outside == 0:
        return ""
    return (
        f"{outside} of {patches} contact patches in the time loop ({outside / patches:.1e}) were "
        "narrower or wider than the creep law's range of a/b; the force at the end of the range "
        "was used."
    )


def yaw_range(look_ups: int, of_sections: float) -> str:
    """Remark on wheels that were yawed against their rails beyond the contact table.

    `of_sections`: where that of rails with sections ends [rad], zero without any.
    """
    if look_ups == 0:
        return ""
    within = f" ({1e3 * of_sections:.3g} mrad within track.sections)" if of_sections else ""
    return (
        f"In {_evaluations(look_ups)} a wheel was yawed against its rail by more than "
        f"{1e3 * YAW_MAX:g} mrad{within}, where the contact table ends: it was continued linearly "
        "in the square of the yaw."
    )


def alternation(vibrations: Floats, Q0: Floats, wheelsets: Sequence[str], divided: int) -> str:
    """Remark on a guiding force that alternates from step to step.

    Arguments as of `vibration`; `divided`: number of divided steps.
    """
    if not len(vibrations):
        return ""
    amplitude = 0.25 * np.sqrt(vibrations[..., ALTERNATION])
    w, side = first_largest(amplitude / Q0)
    if not amplitude[w, side] > ALTERNATES[divided > 0] * Q0[w, side]:
        return ""
    return (
        f"The guiding force of the {SIDES[side]} wheel of {wheelsets[w]} alternates from step to "
        f"step by {1e-3 * amplitude[w, side]:.1f} kN, vehicle at s = "
        f"{vibrations[w, side, ALTERNATES_AT]:.0f} m: the step is too long there, and the vehicle "
        f"may be held in a state that is not its own; compare with half the step "
        f"(--check-step)."
    )


def commanded_dampers(system: System, names: Sequence[str], memory: Floats, step: float) -> str:
    """Remark on a damper with a command too large for the step [s], chosen without commands."""
    acts, bodies = system.actuators, system.bodies
    for i in np.flatnonzero(acts.codes[:, MODE] == BY_DAMPER).tolist():
        about, of, unit = acts.codes[i, ACTION] - ABOUT, bodies.mass, "N s/m"
        if about >= 0:  # x, y, z or an axle
            of, unit = bodies.inertia[:, (0, 1, 2, 1)[about]], "N m s"
        constant = memory[acts.codes[i, COMMAND] + LARGEST]
        if step * constant > COMMANDED * of[acts.body[i]].min():
            return (
                f"The damper {names[i]} was commanded up to {constant:.3g} {unit}. The step "
                f"of {1e3 * step:.3g} ms was chosen without commands, and the force of such a "
                "damper may alternate from step to step: compare with half the step (--check-step)."
            )
    return ""


def sliding(time: Floats, creepage: Floats, wheelsets: Sequence[str]) -> str:
    """Remark on wheelsets that turn far slower or faster than they roll.

    `time`: equal steps [s]; `creepage`: longitudinal, float64[time, wheelset, side], whose mean
    over the wheels counts: curves and flanges make it differ between them.
    """
    mean = creepage.mean(axis=-1)
    share = (np.abs(mean) > SLIDES).mean(axis=0) if len(time) else np.zeros(1)
    w = int(np.argmax(share))
    if not len(time) or share[w] * (time[-1] - time[0]) < SLIDING:
        return ""
    most = mean[np.nanargmax(np.abs(mean[:, w])), w]
    verb, how = ("slide", "slower") if most > 0.0 else ("spin", "faster")
    number = int(np.count_nonzero(share))
    others = "" if number == 1 else f"; {number} wheelsets in all slide or spin"
    return (
        f"Wheels {verb}: {wheelsets[w]} turns more than {100.0 * SLIDES:.0f} % {how} than it rolls "
        f"for {100.0 * share[w]:.3g} % of the run, up to {100.0 * abs(most):.0f} %{others}."
    )


def long_for_slip_control(step: float, below: float, slowest: float) -> str:
    """Remark on a step [s] that slip control does not hold `below` a speed.

    `slowest`: at the beginning or at the end of the run [m/s].
    """
    if slowest >= below:
        return ""
    return (
        f"The step of {1e3 * step:.3g} ms is too long for slip control below {below:.3g} m/s: the "
        "torque may alternate from step to step there; without settings.step the step follows."
    )


def vibration(vibrations: Floats, Q0: Floats, wheelsets: Sequence[str], cause: str) -> str:
    """Remark on wheel loads that vibrate, as a high pass at 40 Hz shows them.

    `measured`: see `railsim.kernels.vibration`; `Q0`: static wheel loads [N]; `cause`: see
    `vibration_cause`.
    """
    if not len(vibrations):
        return ""
    share = vibrations[..., AMPLITUDE] / Q0
    w, side = first_largest(share)
    if not share[w, side] > VIBRATES:
        return ""
    frequency, position = vibrations[w, side, FREQUENCY], vibrations[w, side, POSITION]
    return (
        f"The wheel loads vibrate at {frequency:.0f} Hz: {100.0 * share[w, side]:.0f} % of Q0 "
        f"(high pass {CUT_OFF:g} Hz) on the {SIDES[side]} wheel of {wheelsets[w]}, "
        f"vehicle at s = {position:.0f} m; {cause}."
    )


def vibration_cause(
    *,
    hunts: bool = False,
    uneven: bool = False,
    irregular: bool = False,
    varying: bool = False,
    struck: bool = False,
    centred: bool = False,
    slides: bool = True,
    elastic: bool = True,
) -> str:
    """What wheel loads vibrate from, in words.

    `hunts`: the vehicle; `uneven`: wheels are not round; `irregular`: the rails; `varying`: their
    support; `struck`: there are check rails, whose blow or friction may be the cause; `centred`: no
    wheelset leaves the middle of the track; `slides`: there is friction; `elastic`: the rails.  Of
    what is there only it is not known how much it excites, nor on rigid rails whether the vehicle
    excites itself besides; where none of it is, what is left must be the cause.
    """
    perhaps = {
        "wheels that are not round": uneven,
        "the irregularities or sections of the rails": irregular,
        "the support of the rails, which varies along the track": varying,
    }
    by = next((words for words, there in perhaps.items() if there), "")
    if hunts:
        cause = "the vehicle hunts"
    elif by:
        cause = f"perhaps excited by {by}"
        if slides and not elastic:
            cause += ", or self-excited by sliding friction in flange contact: then smooth rails "
            cause += "show it, too"
    elif centred:
        cause = "excited by the gradient, by applied forces or by the start, on smooth rails"
    elif not slides:
        by = "a check rail or " if struck else ""
        cause = f"excited by {by}blows of the flanges, on smooth rails without friction"
    else:
        by = "excited by a check rail, or" if struck else "self-excited by"
        cause = f"{by} sliding friction in flange contact, on smooth rails"
    rigid = "; the rails are rigid, [support] of the track makes them elastic"
    return cause if elastic else cause + rigid
