"""The end of a run: its result with all facts about it."""

import json
import logging
import math
import time

from railsim.definitions.vehicle.definition import Vehicle
from railsim.kernels.state import TIME
from railsim.kernels.status import DERAILED, LAW_NOT_FINITE, ROLL_RANGE, STATUS, WHEEL_LIFT
from railsim.kernels.system import DIVIDED_STEPS, EVALUATIONS, REPEATS, STEPS
from railsim.notation import ROLL, Z
from railsim.result import Result
from railsim.result.hunting import hunting
from railsim.simulation.advance import Run
from railsim.simulation.conditions import Inputs, TakenUp
from railsim.simulation.outputs import run_extremes
from railsim.simulation.remarks import beyond_experience, run_remarks
from railsim.simulation.sampling import low_pass_remark

FLANGE_HEIGHT = 0.028  # m, of wheel profiles of EN 13715

_LOG = logging.getLogger(__name__)


def end(run: Run, vehicle: Vehicle, inputs: Inputs, before: TakenUp | None) -> Result:
    """Close a run: its result, with all facts about it."""
    began = time.perf_counter()
    prepared, settings = run.prepared, inputs.settings
    simulated = float(run.state[TIME] - prepared.state[TIME])
    # a run that ended before its evaluation began is evaluated as a whole
    evaluates = run.state[TIME] > prepared.evaluation
    of_peaks = run.evaluated if evaluates else run.extremes
    seen = run.swings.close({})
    swings = hunting(seen, run.plan.irregularity)
    of_swings = ("frequency", "amplitude") if swings else ()
    asked = {"duration": inputs.duration, "until": inputs.until}
    attributes: dict[str, str | float | int] = {
        **verdict(run),
        "remarks": "\n".join(run_remarks(run, swings, seen)),
        "vehicle_toml": vehicle.to_toml(),
        "track_toml": inputs.track.to_toml(),
        "settings_json": json.dumps(settings.model_dump(mode="json")),
        "speed": float(inputs.speed),
        "start": float(inputs.start),
        "duration": simulated,
        "evaluation_start": prepared.evaluation if evaluates else float(prepared.state[TIME]),
        **{f"requested_{name}": float(value) for name, value in asked.items() if value is not None},
        **{f"hunting_{name}": getattr(swings, name) for name in of_swings},
        "step": prepared.steps.smallest,
        "scheme": settings.scheme,
        "wall_time": run.wall_time + time.perf_counter() - began,
        "cpu_time": run.cpu_time,
        "patches_evaluated": int(run.events[0]),
        "patches_out_of_range": int(run.events[1]),
        "steps": int(run.work.counts[STEPS]),
        "steps_divided": int(run.work.counts[DIVIDED_STEPS]),
        "evaluations": int(run.work.counts[EVALUATIONS]),
        "contacts_evaluated_again": int(run.work.events[:, REPEATS].sum()),
        "real_time_factor": simulated / run.cpu_time if run.cpu_time > 0.0 else math.inf,
    }
    Q0, groups = prepared.balance.Q0, {"state": {"end": run.state}}
    if before is not None:
        groups["state"] |= {"start": before.motion, "start_memory": prepared.memory}
    if len(run.work.memory) > 1:
        groups["state"]["memory"] = run.work.memory
    if settings.outputs.low_pass is None:  # else the peaks are those of what is stored, filtered
        groups["peaks"] = run_extremes(of_peaks, Q0)
    result = run.sink.close(attributes, {"Q0": Q0}, prepared.model.profiles, groups)
    for remark in result.remarks:
        # what was asked for is no warning, and others were given at the start
        if remark != low_pass_remark(settings) and remark not in prepared.remarks:
            _LOG.warning(remark)
    return result


def verdict(run: Run) -> dict[str, str]:
    """How a run ended, and why: attributes `status` and `status_reason`.

    A wheelset is derailed if it stands over its rail, which the loop has looked at, or far above
    it, as where a vehicle overturns, and if the forces on the way there can have been those of a
    railway.
    """
    model, Q0 = run.prepared.model, run.prepared.balance.Q0
    if run.stopped:
        return {"status": "stopped", "status_reason": run.stopped}
    if run.status == DERAILED or is_off_a_rail(run):
        where = model.index.wheelsets[run.where]
        thrown = beyond_experience(run_extremes(run.extremes, Q0), Q0, model.index.wheelsets)
        if run.status == DERAILED and thrown:
            why = "left its rail under forces beyond all experience"
            cause = "the step is too long or the model is unstable"
            return {"status": "stopped", "status_reason": f"{where} {why}: {cause}"}
        if run.status != DERAILED and not thrown:
            below = run.state[6 * model.system.contact.body[run.where] + Z] > 0.0
            way = "let a wheel down deeper below" if below else "lifted a wheel higher above"
            why = f"{way} its rail than its flange reaches"
            return {"status": "derailed", "status_reason": f"{where} {why}"}
    return {
        "status": STATUS[run.status][0],
        "status_reason": model.index.sentence(run.status, run.where)
        + (f" at {run.state[TIME]:.6g} s" if run.status == LAW_NOT_FINITE else ""),
    }


def is_off_a_rail(run: Run) -> bool:
    """Whether the run ended with a wheel further off its rail than its flange reaches."""
    if run.status != ROLL_RANGE:
        return run.status == WHEEL_LIFT
    system = run.prepared.model.system
    roll = run.state[6 * system.contact.body[run.where] + ROLL]
    return bool(abs(roll) * system.track.rail_base > FLANGE_HEIGHT)
