"""Results as plain numbers by name, in SI: what ``--json`` prints and the report page reads.

The keys are part of the interface and documented in docs/user/mechanisms.md.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.checks import checks
from railsim.mechanisms.comparison import compare
from railsim.mechanisms.contact import Rest
from railsim.mechanisms.dynamics import TimedMotion
from railsim.mechanisms.links import Course, actuators, links
from railsim.mechanisms.remarks import remarks
from railsim.mechanisms.selection import selection
from railsim.mechanisms.tolerance import scatter

if TYPE_CHECKING:
    from railsim.mechanisms.optimum import Optimum

Data = dict[str, Any]


def parameter_data(result: Analysis) -> Data:
    """Values of all parameters, with what was left to the program."""
    definition = result.definition
    values = {name: float(result.model.values[name]) for name in definition.parameters}
    for name in definition.automatic:
        values[name] = result.contact.pressure if result.contact is not None else np.nan
    return values


def analysis_data(result: Analysis, *, courses: bool = True) -> Data:
    """One analysis as plain numbers, with `courses` also those of every link and actuator."""
    definition = result.definition
    data: Data = {
        "name": definition.name, "case": result.case, "source": definition.source,
        "remarks": remarks(result), "parameters": parameter_data(result),
        "provenance": {name: definition.provenance_of(name) for name in definition.parameters},
        "travel": result.travel, **_extremes(result),
    }  # fmt: skip
    if "force" in result.output:
        force = result.extremes("force")
        data |= {"max_force_at": force.most_at, "min_force_at": force.least_at}
        data |= {"peak_force": result.peak_force, "force_zeros": list(result.force_zeros)}
    if result.rests:
        data["equilibria"] = _rests(result.rests, "travel")
    data["min_transmission_angles"] = result.min_angles
    data["published"] = published_data(result)
    data["output"] = {name: _list(array) for name, array in result.output.items()}
    if result.zone:
        names = next(iter(result.zone.values()))
        data["zone"] = {
            name: {at: values[name] for at, values in result.zone.items()} for name in names
        }
    if courses:
        data["links"] = _courses(links(result.motion), "angle")
        data["actuators"] = _courses(actuators(result.motion), "length")
    if result.timed is not None:
        data["motion"] = _motion_data(result, result.timed, courses=courses)
    if (contact := result.contact) is not None:
        data["contact"] = {
            "pressure": contact.pressure, "force": dict(contact.force),
            "force_rising": dict(contact.rising), "force_falling": dict(contact.falling),
            "curve": _list(contact.curve), "equilibria": _rests(contact.rests, "height"),
            "reason": contact.reason or None,
        }  # fmt: skip
    if (released := result.release) is not None:
        time, travel, speed = map(_list, (released.time, released.s, released.speed))
        data["release"] = {"time": time, "travel": travel, "speed": speed}
        data["release"] |= {"reached": released.reached, "duration": time[-1]}
    data["reactions"] = {
        name: {"max": r.max, "at": r.at, "components": [_list(row) for row in r.components.T]}
        for name, r in result.reactions.items()
    }
    data["transitions"] = [asdict(one) for one in result.transitions]
    chosen = [dict(vars(choice)) for choice in selection(result)]
    data["selection"] = [one | one.pop("values") for one in chosen]
    if definition.tolerances:
        data["scatter"] = [asdict(one) for one in scatter(definition)]
    made = checks(result)
    data["checks"] = [check.data for check in made]
    data["ok"] = all(check.ok for check in made)
    return data


def _extremes(result: Analysis) -> Data:
    """Stroke, lengths at both ends and extreme forces, where there are any."""
    data: Data = {}
    if "length" in result.output:
        length = result.output["length"]
        data |= {"stroke": result.stroke, "length_start": float(length[0])}
        data["length_end"] = float(length[-1])
    if "force" in result.output:
        data |= {"max_force": result.max_force, "min_force": result.min_force}
    return data


def published_data(result: Analysis) -> dict[str, Data]:
    """Results that the source prints beside the computed ones; none with changed parameters."""
    definition = result.definition
    changed = {"set", "optimised"} & {definition.provenance_of(p) for p in definition.parameters}
    if changed or result.case is not None:
        return {}
    computed: Data = {"travel": result.travel, **result.min_angles, **_extremes(result)}
    printed = {n: float(result.model.number(v)) for n, v in definition.published.items()}
    return {n: {"published": v, "ours": computed[n]} for n, v in printed.items() if n in computed}


def _rests(rests: Sequence[Rest], key: str) -> list[Data]:
    """Positions of rest as plain numbers, the middle of each under a name."""
    return [{key: r.at, "stable": r.stable, "from": r.low, "to": r.high} for r in rests]


def _motion_data(result: Analysis, timed: TimedMotion, *, courses: bool) -> Data:
    """The motion in time as plain numbers."""
    arrays = {"time": timed.time, "travel": timed.motion.s, "speed": timed.speed}
    arrays |= {"acceleration": timed.acceleration, "force": timed.force}
    data: Data = {name: _list(values) for name, values in arrays.items()}
    data |= {"max_force": float(np.max(timed.force)), "min_force": float(np.min(timed.force))}
    if courses:
        rates = ("speed", "acceleration")
        data["links"] = _courses(timed.in_time(links(timed.motion)), "angle", *rates)
        data["actuators"] = _courses(timed.in_time(actuators(timed.motion)), "length", *rates)
    if result.definition.output is not None:
        moving = timed.point(result.definition.output.point)
        for name, values in zip(("velocity", "acceleration"), moving, strict=True):
            data |= {f"{name}_{axis}": _list(values[:, k]) for k, axis in enumerate("xy")}
    return data


def _courses(courses: Mapping[str, Course], *names: str) -> Data:
    """Angles or lengths with two derivatives as plain numbers, by the names given."""
    names = names if len(names) == 3 else (*names, "first", "second")
    return {
        course: dict(zip(names, map(_list, vars(values).values()), strict=True))
        for course, values in courses.items()
    }


def optimum_data(optimum: "Optimum") -> Data:
    """A search as plain numbers, and everything about the optimum."""
    starts = [asdict(start) | {"feasible": start.feasible} for start in optimum.starts]
    for start in starts:
        start["parameters"] = start.pop("end")
    return {
        **analysis_data(optimum.after), "objective": optimum.objective,
        "objective_before": optimum.objective_before,
        "feasible_before": optimum.feasible_before, "feasible": optimum.feasible,
        "breaches": dict(optimum.breaches), "active": [asdict(active) for active in optimum.active],
        "starts": starts, "seed": optimum.seed,
    }  # fmt: skip


def data_of(
    results: Sequence[Analysis],
    cases: Mapping[str, Analysis],
    values_at: Sequence[list[Data]],
    optimum: "Optimum | None" = None,
) -> Data:
    """Some mechanisms with their comparison, or one with its cases, or its optimum.

    `values_at`: For each mechanism its results where one of them has a value.
    """
    data = [optimum_data(optimum)] if optimum else [analysis_data(result) for result in results]
    for entry, values in zip(data, values_at, strict=True):
        if values:
            entry["at"] = values
    if len(data) > 1:
        return {"mechanisms": data, "comparison": compare(results)}
    others = {name: case for name, case in cases.items() if name != "base"}
    data[0]["cases"] = {name: analysis_data(r, courses=False) for name, r in others.items()}
    return data[0]


def _list(array: Any) -> list[float]:
    return np.asarray(array, dtype=float).tolist()  # type: ignore[no-any-return]
