"""What the parts of a mechanism file say together: names, parameters, freedoms, sizes."""

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from railsim.definitions.base import Definition, Remark
from railsim.definitions.mechanism.definition import RESULTS, CatalogueRow, Mechanism
from railsim.definitions.mechanism.expressions import Expression
from railsim.definitions.mechanism.parts import (
    AirSpring,
    Cam,
    Cylinder,
    GasSpring,
    Reference,
    least_values,
)
from railsim.definitions.mechanism.values import (
    body_name,
    ends,
    members,
    number,
    parameter_values,
    part_sizes,
    point_names,
    sizes,
)
from railsim.errors import Fault, Faults, InputError, nearest

LARGEST = 50.0  # m; no mechanism of a vehicle is larger
OUT_OF_PROPORTION = 100.0
MOST_TURNED = 12.5  # rad; two turns
ROWS = {"revolute": 2, "link": 1, "slot": 1, "prismatic": 2, "cam": 1}
_fault = partial(Fault, "")


def mechanism_faults(mechanism: Mechanism) -> list[Fault]:
    """Return every fault between the parts of a valid mechanism; the faults' file is left empty."""
    faults = [*_parameter_faults(mechanism), *_reference_faults(mechanism)]
    if faults:
        return faults
    for case in (None, *mechanism.cases):
        faults += _value_faults(mechanism, case)
    if faults:
        # what else is wrong follows from a length in millimetres or an angle in degrees
        return [*_unit_faults(mechanism)] or faults
    return [*_freedom_faults(mechanism), *_size_faults(mechanism)]


def mechanism_remarks(mechanism: Mechanism) -> Iterator[Remark]:
    """Remarks on a valid mechanism."""
    for text in mechanism.remarks:
        yield Remark("remarks", text)
    stated = {name for names in mechanism.provenance.values() for name in names}
    if unstated := [name for name in mechanism.parameters if name not in stated]:
        yield Remark("provenance", f"not stated for {', '.join(unstated)}")
    yield from bounds_remarks(mechanism)


def bounds_remarks(mechanism: Mechanism) -> Iterator[Remark]:
    """Remarks on bounds of a search that exclude the file's own values."""
    values = parameter_values(mechanism)
    for name, low, high in bounds_of(mechanism):
        if not low <= values[name] <= high:
            text = f"{low:.6g} to {high:.6g} exclude the file's own {values[name]:.6g}"
            end = "the first start begins at the nearer bound"
            yield Remark(f"optimise.bounds.{name}", f"{text}; {end}")


def bounds_of(mechanism: Mechanism) -> Iterator[tuple[str, float, float]]:
    """Name, lower and upper bound of each parameter of a search."""
    if mechanism.optimise is not None:
        values = parameter_values(mechanism)
        for name, (low, high) in mechanism.optimise.bounds.items():
            yield name, number(low, values), number(high, values)


def _parameter_faults(mechanism: Mechanism) -> Iterator[Fault]:
    parameters, derived, optimise = mechanism.parameters, mechanism.derived, mechanism.optimise
    names_known = {**parameters, **derived}
    used: set[str] = set()
    for name in sorted(parameters.keys() & derived.keys()):
        yield _fault(f"derived.{name}", "is a parameter too", "another name")
    for key, expression in members(Expression, mechanism):
        for name in sorted(expression.names - names_known.keys()):
            hint = nearest(name, names_known) if names_known else "there are no parameters"
            yield _fault(key, f"no parameter '{name}' in '{expression}'", hint)
        if not key.startswith("cases."):
            used |= expression.names
    for name in names_known:
        if name not in used:
            home = "parameters" if name in parameters else "derived"
            yield _fault(f"{home}.{name}", "is used nowhere", "use it or take it out")
    results = [*RESULTS, *mechanism.angles]
    for name in mechanism.published:
        if name not in results:
            yield _fault(f"published.{name}", "no such result", nearest(name, results))
    lists: dict[str, Iterable[str]] = {
        **{f"cases.{case}": names for case, names in mechanism.cases.items()},
        **{f"provenance.{home}": names for home, names in mechanism.provenance.items()},
        **{f"units.{unit}": names for unit, names in mechanism.units.items()},
        "choices": mechanism.choices,
        "tolerances": mechanism.tolerances,
        "optimise.bounds": optimise.bounds if optimise else (),
        "optimise.assemblies": optimise.assemblies if optimise else (),
    }
    for key, names in lists.items():
        for name in names:
            if name not in parameters:
                yield _fault(key, f"no parameter '{name}'", nearest(name, parameters))


def _reference_faults(mechanism: Mechanism) -> Iterator[Fault]:
    """Names that mean nothing; where there are none, parts that do not suit each other."""
    allowed: dict[str, Any] = {
        "point": point_names(mechanism),
        "body": ["ground", *mechanism.bodies],
        "actuator": mechanism.actuators,
        "gas spring": [k for k, part in mechanism.elements.items() if isinstance(part, GasSpring)],
        "catalogue": mechanism.catalogues,
    }
    faults = []
    if "ground" in mechanism.bodies:
        faults.append(_fault("bodies.ground", "the ground is no body", "it is [ground]"))
    found = [(key, name.kind, str(name)) for key, name in members(Reference, mechanism)]
    found += [(f"start.{name}", "body", name) for name in mechanism.start]
    for key, kind, name in found:
        if name not in allowed[kind]:
            faults.append(_fault(key, f"no {kind} '{name}'", nearest(name, allowed[kind])))
    for body, part in mechanism.bodies.items():
        for name in part.outline:
            if name not in part.points:
                hint = nearest(name, part.points)
                faults.append(_fault(f"bodies.{body}.outline", f"no point '{name}'", hint))
    yield from faults or (*_end_faults(mechanism), *_actuator_faults(mechanism))


def _end_faults(mechanism: Mechanism) -> Iterator[Fault]:
    for name, joint in mechanism.joints.items():
        pair = ends(joint)
        if isinstance(joint, Cam):
            pair = (joint.cam, joint.path or f"{joint.body}.")
        assert pair is not None
        first, second = map(body_name, pair)
        if first == second:
            yield _fault(f"joints.{name}", f"both points are on '{first}'", "points of two bodies")


def _actuator_faults(mechanism: Mechanism) -> Iterator[Fault]:
    """Actuators that do not suit what they are named for."""
    solve, motion = mechanism.solve, mechanism.motion
    for key, table in (("solve", solve), ("motion", motion)):
        name = table.actuator if table is not None else None
        if name is not None and ends(mechanism.actuators[name]) is None:
            found = f"'{name}' has no length"
            yield _fault(f"{key}.actuator", found, "an actuator between two points")
    if motion is not None and (motion.actuator or motion.unknown or solve) is None:
        found = "nothing drives the motion of an angle"
        yield _fault("motion.unknown", found, "an actuator, here or in [solve]")
    for key, other in (
        ("zone", "output"),
        ("contact", "zone"),
        ("contact", "solve"),
        ("optimise", "solve"),
    ):
        if getattr(mechanism, key) is not None and getattr(mechanism, other) is None:
            yield _fault(key, f"no [{other}]", f"[{key}] needs it")
    held = mechanism.actuators[solve.unknown] if solve is not None else None
    if mechanism.contact is not None and solve and not isinstance(held, Cylinder | AirSpring):
        found = f"'{solve.unknown}' has no pressure"
        yield _fault("contact", found, "a cylinder or an air spring")
    if (optimise := mechanism.optimise) is not None:
        kinds = optimise.objective
        kinds = {kinds: 1.0} if isinstance(kinds, str) else kinds
        if "follow" in kinds and optimise.reference is None:
            yield _fault("optimise.reference", "missing", "'follow' needs one")
        for kind in ("constant", "linear"):
            if kind in kinds and optimise.target is None:
                yield _fault("optimise.target", "missing", f"'{kind}' needs one")
        if optimise.range == "zone" and mechanism.zone is None:
            yield _fault("optimise.range", "no [zone]", "'travel', or a [zone]")


def _value_faults(mechanism: Mechanism, case: str | None) -> list[Fault]:
    """Faults of the values of parameters and expressions in a case."""
    chosen, faults = mechanism.in_case(case), Faults()
    with faults.caught():
        values = parameter_values(chosen)
    if faults:
        return faults
    for key, expression in members(Expression, chosen):
        if key.startswith(("parameters.", "derived.", "cases.")):
            continue
        if automatic := expression.names & chosen.automatic:
            if key != "contact.pressure":
                names = ", ".join(sorted(automatic))
                faults.append(_fault(key, f"{names} is 'auto'", "a number is needed here"))
            continue
        try:
            number(expression, values, key)
        except InputError as error:
            suffix = f" in case '{case}'" if case else ""
            faults += [_fault(f.key, f.found + suffix, f.allowed) for f in error.faults]
    return faults or [*_range_faults(chosen, values)]


def _range_faults(mechanism: Mechanism, values: Mapping[str, Any]) -> Iterator[Fault]:
    """Values out of their ranges, and tables that do not rise."""
    yield from _least_faults(mechanism, values)
    for key, row in members(CatalogueRow, mechanism):
        yield from _row_faults(key, row, values)
    for table in ("actuators", "elements"):
        for name, part in getattr(mechanism, table).items():
            key = f"{table}.{name}"
            if isinstance(part, GasSpring) and part.rod_end not in (None, *part.gas_spring):
                allowed = " or ".join(part.gas_spring)
                yield _fault(f"{key}.rod_end", f"'{part.rod_end}' is no end of it", allowed)
            if getattr(part, "table", None) is not None:
                first = [number(row[0], values) for row in part.table]
                if not np.all(np.diff(first) > 0.0):
                    found, allowed = "first column not rising", "rising from row to row"
                    yield _fault(f"{key}.table", found, allowed)
            if isinstance(part, Cylinder):
                rod, bore = number(part.rod, values), number(part.bore, values)
                if not rod < bore:
                    yield _fault(f"{key}.rod", f"{rod:g}", f"less than the bore, {bore:g}")
            if isinstance(part, AirSpring):
                yield from _air_spring_faults(key, part, values)
    begin, end = (number(q, values) for q in (mechanism.driver.start, mechanism.driver.end))
    if begin == end:
        yield _fault("driver.end", f"{end:g}", "another value than driver.start")
    if (zone := mechanism.zone) is not None:
        low, work, high = (number(getattr(zone, k), values) for k in ("low", "work", "high"))
        if not low <= work <= high or low == high:
            yield _fault("zone", f"{low:g}, {work:g}, {high:g}", "low <= work <= high")
    optimise = mechanism.optimise
    if optimise is not None and optimise.min_transmission_angle is not None:
        angle = number(optimise.min_transmission_angle, values)
        if not 0.0 < angle < 0.5 * np.pi:
            allowed = "above 0 and below pi/2 rad: angles are folded to it"
            yield _fault("optimise.min_transmission_angle", f"{angle:g}", allowed)
    for name, choices in mechanism.choices.items():
        if (found := values.get(name, "auto")) not in choices:
            yield _fault(f"parameters.{name}", str(found), " or ".join(map("{:g}".format, choices)))
    for name, tolerance in mechanism.tolerances.items():
        if not (value := number(tolerance, values)) >= 0.0:
            yield _fault(f"tolerances.{name}", f"{value:g}", "0 or greater: it is plus and minus")
    for name, low, high in bounds_of(mechanism):
        if not low < high:
            found, allowed = f"{low:g}, {high:g}", "the second above the first"
            yield _fault(f"optimise.bounds.{name}", found, allowed)


def _least_faults(mechanism: Mechanism, values: Mapping[str, Any]) -> Iterator[Fault]:
    """Values that are too small, at the parameter that says it where there is just one."""
    for table, part in members(Definition, mechanism):
        for field, least in least_values(type(part)).items():
            given = getattr(part, field)
            for quantity in given if isinstance(given, tuple) else (given,):
                if quantity is None:
                    continue
                value = number(quantity, values)
                if value > least.value or (value == least.value and not least.excluded):
                    continue
                key, found = f"{table}.{field}", f"{value:g}"
                if isinstance(quantity, Expression):
                    if str(quantity) in quantity.names:
                        key, found = f"parameters.{quantity}", f"{value:g} (as {key})"
                    else:
                        found = f"'{quantity}' is {value:g}"
                yield _fault(key, found, least.allowed)


def _row_faults(key: str, row: CatalogueRow, values: Mapping[str, Any]) -> Iterator[Fault]:
    """Ranges and lists of a series of gas springs that cannot be."""
    pair, several = "smallest and largest, greater than 0", "one or more, greater than 0"
    for field, allowed in {"stroke": pair, "strokes": several, "F1": pair}.items():
        if (quantities := getattr(row, field)) is not None:
            found = [number(q, values) for q in quantities]
            if not found or min(found) <= 0.0 or (allowed is pair and found != sorted(found)):
                yield _fault(f"{key}.{field}", ", ".join(map("{:g}".format, found)), allowed)
    if row.extended is not None and (factor := number(row.extended[0], values)) < 1.0:
        allowed = "1 or greater: pressed by its stroke, it still has a length"
        yield _fault(f"{key}.extended.0", f"{factor:g}", allowed)
    for k, band in enumerate(row.F1_tolerance or ()):
        found = [number(q, values) for q in band]
        if found[0] <= 0.0 or min(found) < 0.0:
            allowed = "up to a force greater than 0, minus and plus 0 or greater"
            yield _fault(f"{key}.F1_tolerance.{k}", ", ".join(map("{:g}".format, found)), allowed)


def _air_spring_faults(key: str, table: AirSpring, values: Mapping[str, Any]) -> Iterator[Fault]:
    for field in ("heights", "pressures"):
        if np.any(np.diff([number(q, values) for q in getattr(table, field)]) <= 0.0):
            yield _fault(f"{key}.{field}", "not rising", "rising from value to value")
            return
    forces = np.array([[number(q, values) for q in row] for row in table.forces])
    if not np.all(np.diff(forces, axis=1) > 0.0):
        yield _fault(f"{key}.forces", "not rising with pressure", "rising along each row")


def _unit_faults(mechanism: Mechanism) -> Iterator[Fault]:
    """Parameters that look like millimetres or degrees: named if there is a fault."""
    limits = {"m": (LARGEST, "lengths in metres"), "rad": (MOST_TURNED, "angles in radians")}
    for name, value in mechanism.parameters.items():
        unit = mechanism.unit_of(name)
        if not isinstance(value, str) and unit in limits and abs(value) >= limits[unit][0]:
            found = f"{value:g} {unit}, out of proportion"
            yield _fault(f"parameters.{name}", found, limits[unit][1])


def _freedom_faults(mechanism: Mechanism) -> Iterator[Fault]:
    rows = sum(
        ROWS[kind] for joint in mechanism.joints.values() for kind in ROWS if hasattr(joint, kind)
    )
    bodies = len(mechanism.bodies)
    freedoms = 3 * bodies - rows
    if freedoms != 1:
        remedy = "a joint too many" if freedoms < 1 else "a joint too few"
        found = f"{freedoms} degrees of freedom: {bodies} bodies with 3 each, {rows} held by joints"
        yield _fault("joints", found, f"1 is needed: {remedy}")


def _size_faults(mechanism: Mechanism) -> list[Fault]:
    values = parameter_values(mechanism)
    lengths = sizes(mechanism, values)
    if not lengths:
        return [_fault("bodies", "no lengths", "points at different positions")]
    middle = float(np.median(list(lengths.values())))
    faults = [
        _fault(key, f"{size:g} m, the others about {middle:.3g} m", "lengths in metres")
        for key, size in (lengths | part_sizes(mechanism, values)).items()
        if size > LARGEST or size > OUT_OF_PROPORTION * middle
    ]
    # the parameters that a user wrote, where they are the cause
    return faults and ([*_unit_faults(mechanism)] or faults)
