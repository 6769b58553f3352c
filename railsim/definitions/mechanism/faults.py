"""What the parts of a mechanism file say together: names, parameters, freedoms, sizes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from railsim.definitions.base import Remark
from railsim.definitions.mechanism.definition import RESULTS, Mechanism
from railsim.definitions.mechanism.expressions import Expression
from railsim.definitions.mechanism.parts import AirSpring, Cam, Cylinder, GasSpring, Link, Reference
from railsim.definitions.mechanism.values import (
    ends,
    number,
    parameter_values,
    part_sizes,
    point_names,
    sizes,
    texts_of,
)
from railsim.errors import Fault, InputError, nearest

LARGEST = 50.0  # m; no mechanism of a vehicle is larger
OUT_OF_PROPORTION = 100.0
MOST_TURNED = 12.5  # rad; two turns
ABSOLUTE_ZERO = -273.15  # C
ROWS = {"revolute": 2, "link": 1, "slot": 1, "prismatic": 2, "cam": 1}


def mechanism_faults(mechanism: Mechanism) -> list[Fault]:
    """Return every fault between the parts of a valid mechanism; the faults' file is left empty."""
    faults = [*_parameter_faults(mechanism), *_reference_faults(mechanism)]
    if faults:
        return faults
    for case in (None, *mechanism.cases):
        faults += _value_faults(mechanism, case)
    if faults:
        # what else is wrong follows from a length in millimetres or an angle in degrees
        return _unit_faults(mechanism) or faults
    return [*_freedom_faults(mechanism), *_size_faults(mechanism)]


def mechanism_remarks(mechanism: Mechanism) -> list[Remark]:
    """Remarks on a valid mechanism."""
    remarks = [Remark("remarks", text) for text in mechanism.remarks]
    stated = {name for names in mechanism.provenance.values() for name in names}
    if silent := [name for name in mechanism.parameters if name not in stated]:
        remarks.append(Remark("provenance", f"not stated for {', '.join(silent)}"))
    return [*remarks, *bounds_remarks(mechanism)]


def bounds_remarks(mechanism: Mechanism) -> list[Remark]:
    """Remarks on bounds of a search that exclude the file's own values."""
    if mechanism.optimise is None:
        return []
    values = parameter_values(mechanism)
    found = []
    for name, (lower, upper) in mechanism.optimise.bounds.items():
        low, high = (number(quantity, values) for quantity in (lower, upper))
        if not low <= values[name] <= high:
            text = f"{low:.6g} to {high:.6g} exclude the file's own {values[name]:.6g}"
            end = "the first start begins at the nearer bound"
            found.append(Remark(f"optimise.bounds.{name}", f"{text}; {end}"))
    return found


def _parameter_faults(mechanism: Mechanism) -> list[Fault]:
    known = {**mechanism.parameters, **mechanism.derived}
    faults: list[Fault] = []
    used: set[str] = set()
    for name in sorted(mechanism.parameters.keys() & mechanism.derived.keys()):
        faults.append(Fault("", f"derived.{name}", "is a parameter too", "another name"))
    for key, expression in texts_of(Expression, mechanism):
        for name in sorted(expression.names - known.keys()):
            hint = nearest(name, known) if known else "there are no parameters"
            faults.append(Fault("", key, f"no parameter '{name}' in '{expression}'", hint))
        if not key.startswith("cases."):
            used |= expression.names
    for name in known:
        if name not in used:
            key = f"parameters.{name}" if name in mechanism.parameters else f"derived.{name}"
            faults.append(Fault("", key, "is used nowhere", "use it or take it out"))
    known = dict(mechanism.parameters)
    lists: list[tuple[str, Any]] = [
        *((f"cases.{case}", names) for case, names in mechanism.cases.items()),
        *((f"provenance.{home}", names) for home, names in mechanism.provenance.items()),
        *((f"units.{unit}", names) for unit, names in mechanism.units.items()),
        ("tolerances", mechanism.tolerances),
    ]
    results = [*RESULTS, *mechanism.angles]
    for name in mechanism.published:
        if name not in results:
            fault = Fault("", f"published.{name}", "no such result", nearest(name, results))
            faults.append(fault)
    if mechanism.optimise is not None:
        lists.append(("optimise.bounds", mechanism.optimise.bounds))
        lists.append(("optimise.assemblies", mechanism.optimise.assemblies))
    for key, names in lists:
        for name in names:
            if name not in known:
                faults.append(Fault("", key, f"no parameter '{name}'", nearest(name, known)))
    return faults


def _reference_faults(mechanism: Mechanism) -> list[Fault]:
    points = point_names(mechanism)
    bodies = ["ground", *mechanism.bodies]
    faults = []
    if "ground" in mechanism.bodies:
        faults.append(Fault("", "bodies.ground", "the ground is no body", "it is [ground]"))
    elements = mechanism.elements.items()
    allowed: dict[str, Any] = {
        "point": points,
        "body": bodies,
        "actuator": mechanism.actuators,
        "gas spring": [name for name, part in elements if isinstance(part, GasSpring)],
        "catalogue": mechanism.catalogues,
    }
    found: list[tuple[str, str, str]] = [
        (key, name.kind, name) for key, name in texts_of(Reference, mechanism)
    ]
    found += [(f"start.{name}", "body", name) for name in mechanism.start]
    faults += [
        Fault("", key, f"no {kind} '{name}'", nearest(name, allowed[kind]))
        for key, kind, name in found
        if name not in allowed[kind]
    ]
    for body, part in mechanism.bodies.items():
        for name in part.outline:
            if name not in part.points:
                key = f"bodies.{body}.outline"
                faults.append(Fault("", key, f"no point '{name}'", nearest(name, part.points)))
    if not faults:
        faults = [*_end_faults(mechanism), *_actuator_faults(mechanism)]
    return faults


def _end_faults(mechanism: Mechanism) -> list[Fault]:
    faults = []
    for name, joint in mechanism.joints.items():
        pair = ends(joint)
        if pair is None:
            assert isinstance(joint, Cam)
            pair = (joint.cam, joint.path or f"{joint.body}.")
        first, second = (point.partition(".")[0] for point in pair)
        if first == second:
            found = f"both points are on '{first}'"
            faults.append(Fault("", f"joints.{name}", found, "points of two bodies"))
    return faults


def _actuator_faults(mechanism: Mechanism) -> list[Fault]:
    """Actuators that do not suit what they are named for."""
    faults = []
    solve, motion = mechanism.solve, mechanism.motion
    for key, table in (("solve", solve), ("motion", motion)):
        name = table.actuator if table is not None else None
        if name is not None and ends(mechanism.actuators[name]) is None:
            found = f"'{name}' has no length"
            faults.append(Fault("", f"{key}.actuator", found, "an actuator between two points"))
    if motion is not None and (motion.actuator or motion.unknown or solve) is None:
        found = "nothing drives the motion of an angle"
        faults.append(Fault("", "motion.unknown", found, "an actuator, here or in [solve]"))
    needs = [
        ("zone", mechanism.zone, "output", mechanism.output),
        ("contact", mechanism.contact, "zone", mechanism.zone),
        ("contact", mechanism.contact, "solve", mechanism.solve),
        ("optimise", mechanism.optimise, "solve", mechanism.solve),
    ]
    for key, there, other, needed in needs:
        if there is not None and needed is None:
            faults.append(Fault("", key, f"no [{other}]", f"[{key}] needs it"))
    if mechanism.contact is not None and mechanism.solve is not None:
        held = mechanism.actuators[mechanism.solve.unknown]
        if not isinstance(held, Cylinder | AirSpring):
            found = f"'{mechanism.solve.unknown}' has no pressure"
            faults.append(Fault("", "contact", found, "a cylinder or an air spring"))
    if (optimise := mechanism.optimise) is not None:
        kinds = optimise.objective
        kinds = {kinds: 1.0} if isinstance(kinds, str) else kinds
        if "follow" in kinds and optimise.reference is None:
            faults.append(Fault("", "optimise.reference", "missing", "'follow' needs one"))
        for kind in ("constant", "linear"):
            if kind in kinds and optimise.target is None:
                faults.append(Fault("", "optimise.target", "missing", f"'{kind}' needs one"))
        if optimise.range == "zone" and mechanism.zone is None:
            faults.append(Fault("", "optimise.range", "no [zone]", "'travel', or a [zone]"))
    return faults


def _value_faults(mechanism: Mechanism, case: str | None) -> list[Fault]:
    """Faults of the values of parameters and expressions in a case."""
    chosen = mechanism.in_case(case)
    try:
        values = parameter_values(chosen)
    except InputError as error:
        return list(error.faults)
    faults = []
    for key, expression in texts_of(Expression, chosen):
        if key.startswith(("parameters.", "derived.", "cases.")):
            continue
        if automatic := expression.names & chosen.automatic:
            if key != "contact.pressure":
                names = ", ".join(sorted(automatic))
                faults.append(Fault("", key, f"{names} is 'auto'", "a number is needed here"))
            continue
        try:
            number(expression, values, key)
        except InputError as error:
            faults += [
                Fault("", f.key, f.found + (f" in case '{case}'" if case else ""), f.allowed)
                for f in error.faults
            ]
    if faults:
        return faults
    return _positive_faults(chosen, values)


POSITIVE: dict[Any, tuple[str, ...]] = {
    Link: ("length",),
    Cylinder: ("bore", "count", "supply_pressure"),
    GasSpring: ("F1", "progression", "stroke", "extended"),
}
POSITIVE_OF = {
    "motion": ("speed", "duration"),
    "release": ("speed", "duration"),
    "lid": ("mass", "centre", "lever", "springs", "factor"),
}
NOT_NEGATIVE = {
    "mass",
    "inertia",
    "stiffness",
    "damping",
    "friction",
    "moment",
    "rod",
    "end_damping",
}


def _positive_faults(mechanism: Mechanism, values: Mapping[str, Any]) -> list[Fault]:
    faults = []
    for table in ("bodies", "joints", "actuators", "elements"):
        for name, part in getattr(mechanism, table).items():
            positive = POSITIVE.get(type(part), ())
            for field in type(part).model_fields:
                quantity = getattr(part, field)
                if (field not in positive and field not in NOT_NEGATIVE) or quantity is None:
                    continue
                value = number(quantity, values)
                if value < 0.0 or (field in positive and value == 0.0):
                    allowed = "greater than 0" if field in positive else "0 or greater"
                    faults.append(_value_fault(f"{table}.{name}.{field}", quantity, value, allowed))
            if isinstance(part, GasSpring):
                faults += _gas_faults(f"{table}.{name}", part, values)
            if isinstance(part, Cam):
                faults += _arc_faults(f"joints.{name}", part, values)
            if getattr(part, "table", None) is not None:
                faults += _spring_table_faults(f"{table}.{name}", part, values)
            if isinstance(part, AirSpring):
                faults += _table_faults(f"{table}.{name}", part, values)
    for table, fields in POSITIVE_OF.items():
        for field in fields:
            quantity = getattr(getattr(mechanism, table), field, None)
            if quantity is not None and not (value := number(quantity, values)) > 0.0:
                faults.append(_value_fault(f"{table}.{field}", quantity, value, "greater than 0"))
    driver = mechanism.driver
    begin, end = number(driver.start, values), number(driver.end, values)
    if begin == end:
        faults.append(Fault("", "driver.end", f"{end:g}", "another value than driver.start"))
    if (zone := mechanism.zone) is not None:
        low, work, high = (number(getattr(zone, k), values) for k in ("low", "work", "high"))
        if not low <= work <= high or low == high:
            faults.append(Fault("", "zone", f"{low:g}, {work:g}, {high:g}", "low <= work <= high"))
    if (optimise := mechanism.optimise) is not None:
        for name, (lower, upper) in optimise.bounds.items():
            low, high = number(lower, values), number(upper, values)
            if not low < high:
                key = f"optimise.bounds.{name}"
                faults.append(Fault("", key, f"{low:g}, {high:g}", "the second above the first"))
    return faults


def _value_fault(key: str, quantity: float | str, value: float, allowed: str) -> Fault:
    """A value out of its range, at the parameter that says it where there is just one."""
    if isinstance(quantity, Expression):
        if str(quantity) in quantity.names:
            return Fault("", f"parameters.{quantity}", f"{value:g} (as {key})", allowed)
        return Fault("", key, f"'{quantity}' is {value:g}", allowed)
    return Fault("", key, f"{value:g}", allowed)


def _gas_faults(key: str, gas: GasSpring, values: Mapping[str, Any]) -> list[Fault]:
    faults = []
    if gas.rod_end is not None and gas.rod_end not in gas.gas_spring:
        allowed = " or ".join(gas.gas_spring)
        faults.append(Fault("", f"{key}.rod_end", f"'{gas.rod_end}' is no end of it", allowed))
    for field, least, allowed in (
        ("progression", 1.0, "1 or greater: the gas is compressed"),
        ("temperature", ABSOLUTE_ZERO, f"above {ABSOLUTE_ZERO:g} C"),
    ):
        quantity = getattr(gas, field)
        value = number(quantity, values)
        if value < least or (field == "temperature" and value == least):
            faults.append(_value_fault(f"{key}.{field}", quantity, value, allowed))
    return faults


def _arc_faults(key: str, cam: Cam, values: Mapping[str, Any]) -> list[Fault]:
    faults = []
    for i, arc in enumerate(cam.arcs):
        for field in ("radius", "length"):
            quantity = getattr(arc, field)
            if quantity is not None and not number(quantity, values) > 0.0:
                found = f"{number(quantity, values):g}"
                faults.append(Fault("", f"{key}.arcs.{i}.{field}", found, "greater than 0"))
    return faults


def _spring_table_faults(key: str, spring: Any, values: Mapping[str, Any]) -> list[Fault]:
    steps = np.diff([number(row[0], values) for row in spring.table])
    if np.all(steps > 0.0):
        return []
    return [Fault("", f"{key}.table", "first column not rising", "rising from row to row")]


def _table_faults(key: str, table: AirSpring, values: Mapping[str, Any]) -> list[Fault]:
    for field in ("heights", "pressures"):
        if np.any(np.diff([number(q, values) for q in getattr(table, field)]) <= 0.0):
            return [Fault("", f"{key}.{field}", "not rising", "rising from value to value")]
    forces = np.array([[number(q, values) for q in row] for row in table.forces])
    if not np.all(np.diff(forces, axis=1) > 0.0):
        return [Fault("", f"{key}.forces", "not rising with pressure", "rising along each row")]
    return []


def _unit_faults(mechanism: Mechanism) -> list[Fault]:
    """Parameters that look like millimetres or degrees: named if there is a fault."""
    limits = {"m": (LARGEST, "lengths in metres"), "rad": (MOST_TURNED, "angles in radians")}
    found = []
    for name, value in mechanism.parameters.items():
        unit = mechanism.unit_of(name)
        if not isinstance(value, str) and unit in limits and abs(value) >= limits[unit][0]:
            words = f"{value:g} {unit}, out of proportion"
            found.append(Fault("", f"parameters.{name}", words, limits[unit][1]))
    return found


def _freedom_faults(mechanism: Mechanism) -> list[Fault]:
    rows = sum(
        ROWS[kind] for joint in mechanism.joints.values() for kind in ROWS if hasattr(joint, kind)
    )
    freedoms = 3 * len(mechanism.bodies) - rows
    if freedoms == 1:
        return []
    bodies = len(mechanism.bodies)
    remedy = "a joint too many" if freedoms < 1 else "a joint too few"
    found = f"{freedoms} degrees of freedom: {bodies} bodies with 3 each, {rows} held by joints"
    return [Fault("", "joints", found, f"1 is needed: {remedy}")]


def _size_faults(mechanism: Mechanism) -> list[Fault]:
    values = parameter_values(mechanism)
    found = sizes(mechanism, values)
    if not found:
        return [Fault("", "bodies", "no lengths", "points at different positions")]
    middle = float(np.median(list(found.values())))
    faults = [
        Fault("", key, f"{size:g} m, the others about {middle:.3g} m", "lengths in metres")
        for key, size in (found | part_sizes(mechanism, values)).items()
        if size > LARGEST or size > OUT_OF_PROPORTION * middle
    ]
    # the parameters that a user wrote, where they are the cause
    return (_unit_faults(mechanism) or faults) if faults else []
