"""Results as plain numbers by name, in SI: what ``--json`` prints and the report page reads.

The keys are part of the interface and documented in docs/user/mechanisms.md.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from railsim.definitions.mechanism import Mechanism
from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.checks import checks
from railsim.mechanisms.comparison import Comparison
from railsim.mechanisms.contact import Contact
from railsim.mechanisms.dynamics import FreeMotion
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


def provenance_data(definition: Mechanism) -> dict[str, str]:
    """Where every parameter is from."""
    return {name: definition.provenance_of(name) for name in definition.parameters}


def analysis_data(result: Analysis, *, courses: bool = True) -> Data:
    """One analysis as plain numbers, with `courses` also those of every link and actuator."""
    definition = result.definition
    data: Data = {
        "name": definition.name,
        "case": result.case,
        "source": definition.source,
        "remarks": remarks(result),
        "parameters": parameter_data(result),
        "provenance": provenance_data(definition),
        "travel": result.travel,
    }
    if "length" in result.output:
        length = result.output["length"]
        data["stroke"] = result.stroke
        data["length_start"], data["length_end"] = float(length[0]), float(length[-1])
    if "force" in result.output:
        force = result.extremes("force")
        data["max_force"], data["min_force"] = force.most, force.least
        data["max_force_at"], data["min_force_at"] = force.most_at, force.least_at
        data["peak_force"] = result.peak_force
        data["force_zeros"] = list(result.force_zeros)
    if result.rests:
        data["equilibria"] = [
            {"travel": rest.at, "stable": rest.stable, "from": rest.low, "to": rest.high}
            for rest in result.rests
        ]
    data["min_transmission_angles"] = result.min_angles
    data["published"] = published_data(result)
    data["output"] = {name: _list(array) for name, array in result.output.items()}
    if result.zone:
        names = next(iter(result.zone.values()))
        data["zone"] = {
            name: {at: values[name] for at, values in result.zone.items()} for name in names
        }
    parts = (("links", links(result.motion)), ("actuators", actuators(result.motion)))
    for key, found in parts if courses else ():
        data[key] = course_data(found, "angle" if key == "links" else "length")
    if result.timed is not None:
        data["motion"] = motion_data(result, courses=courses)
    if result.contact is not None:
        data["contact"] = contact_data(result.contact)
    if result.release is not None:
        data["release"] = release_data(result.release)
    data["reactions"] = {
        name: {"max": r.max, "at": r.at, "components": [_list(row) for row in r.components.T]}
        for name, r in result.reactions.items()
    }
    data["transitions"] = [dict(vars(one)) for one in result.transitions]
    data["selection"] = [
        {
            "catalogue": c.catalogue,
            "name": c.name,
            "fits": c.fits,
            "reasons": list(c.reasons),
            **c.values,
        }
        for c in selection(result)
    ]
    if definition.tolerances:
        data["scatter"] = [dict(vars(one)) for one in scatter(definition)]
    made = checks(result)
    data["checks"] = [
        {
            "name": check.name,
            "value": check.value,
            "limit": check.limit,
            "ok": check.ok,
            "unit": check.unit,
            "must_be": check.sense,
            "note": check.note,
        }
        for check in made
    ]
    data["ok"] = all(check.ok for check in made)
    return data


def contact_data(contact: Contact) -> Data:
    """The static contact force as plain numbers."""
    equilibria = zip(contact.equilibria, contact.heights, strict=True)
    return {
        "pressure": contact.pressure,
        "force": dict(contact.force),
        "force_rising": dict(contact.rising),
        "force_falling": dict(contact.falling),
        "curve": _list(contact.curve),
        "equilibria": [
            {"height": y, "stable": stable, "from": low, "to": high}
            for (y, stable), (low, high) in equilibria
        ],
        "reason": contact.reason or None,
    }


def release_data(released: FreeMotion) -> Data:
    """The free motion as plain numbers."""
    return {
        "time": _list(released.time),
        "travel": _list(released.s),
        "speed": _list(released.speed),
        "reached": released.reached,
        "duration": float(released.time[-1]),
    }


def published_data(result: Analysis) -> dict[str, Data]:
    """Results that the source prints beside ours; none with parameters that are not the file's."""
    definition = result.definition
    changed = {"set", "optimised"} & {definition.provenance_of(p) for p in definition.parameters}
    if changed or result.case is not None:
        return {}
    ours: dict[str, float] = {"travel": result.travel, **result.min_angles}
    if "length" in result.output:
        length = result.output["length"]
        ours |= {"stroke": result.stroke, "length_start": float(length[0])}
        ours["length_end"] = float(length[-1])
    if "force" in result.output:
        ours |= {"max_force": result.max_force, "min_force": result.min_force}
    return {
        name: {"published": float(result.model.number(value)), "ours": ours[name]}
        for name, value in definition.published.items()
        if name in ours
    }


def motion_data(result: Analysis, *, courses: bool = True) -> Data:
    """The motion in time as plain numbers."""
    timed = result.timed
    assert timed is not None
    data: Data = {
        "time": _list(timed.time),
        "travel": _list(timed.motion.s),
        "speed": _list(timed.speed),
        "acceleration": _list(timed.acceleration),
        "force": _list(timed.force),
        "max_force": float(np.max(timed.force)),
        "min_force": float(np.min(timed.force)),
    }
    parts = (("links", links(timed.motion)), ("actuators", actuators(timed.motion)))
    for key, found in parts if courses else ():
        moving = {n: c.in_time(timed.speed, timed.acceleration) for n, c in found.items()}
        value = "angle" if key == "links" else "length"
        data[key] = course_data(moving, value, "speed", "acceleration")
    if result.definition.output is not None:
        v, a = timed.point(result.definition.output.point)
        data["velocity_x"], data["velocity_y"] = _list(v[:, 0]), _list(v[:, 1])
        data["acceleration_x"], data["acceleration_y"] = _list(a[:, 0]), _list(a[:, 1])
    return data


def course_data(
    courses: Mapping[str, Course], value: str, first: str = "first", second: str = "second"
) -> Data:
    """Angles or lengths with two derivatives as plain numbers, by the names given."""
    return {
        name: {value: _list(c.value), first: _list(c.first), second: _list(c.second)}
        for name, c in courses.items()
    }


def comparison_data(comparison: Comparison) -> list[Data]:
    """Mechanisms side by side as plain numbers; the first is the reference."""
    return [{"name": row.name, **row.values, "error": row.error} for row in comparison.rows]


def optimum_data(optimum: "Optimum") -> Data:
    """A search as plain numbers, and everything about the optimum."""
    return {
        **analysis_data(optimum.after),
        "objective": optimum.objective,
        "objective_before": optimum.objective_before,
        "feasible": optimum.feasible,
        "breaches": dict(optimum.breaches),
        "active": [dict(vars(active)) for active in optimum.active],
        "starts": [
            {
                "number": start.number,
                "begin": start.begin,
                "parameters": start.end,
                "objective": start.objective,
                "violation": start.violation,
                "feasible": start.feasible,
                "evaluations": start.evaluations,
            }
            for start in optimum.starts
        ],
        "seed": optimum.seed,
    }


def _list(array: Any) -> list[float]:
    return [float(x) for x in np.asarray(array)]
