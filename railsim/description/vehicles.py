"""What a vehicle holds."""

from collections import Counter
from collections.abc import Iterable
from typing import Any

from railsim.definitions import Vehicle
from railsim.definitions.elements.base import Element
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.tables import Assembly
from railsim.description.values import Description, Parts, either, short
from railsim.table import Column, Table

PLURALS = {"body": "bodies", "axlebox": "axleboxes"}
_BODY = ("name", "kind", "fixed", "mass", "inertia", "position", "pitch_inertia")


def describe_vehicle(vehicle: Vehicle) -> Description:
    """Return bodies as placed and mirrored, and elements: in the data likewise, else as written."""
    flat = flatten(vehicle)
    bodies = [
        {name: getattr(body, name) for name in _BODY}
        | {name: getattr(body.wheelset, name, None) for name in ("profile", "radius")}
        | {"wheelset": body.parent}
        for body in flat.bodies
    ]
    elements = [
        {
            "name": element.name,
            "bodies": (element.body1, element.body2),
            "points": (element.point1, element.point2),
            **element.definition.model_dump(exclude={"bodies", "points", "point", "sides"}),
        }
        for element in flat.elements
    ]
    service, loads = vehicle.service, list(vehicle.loads)
    data: dict[str, Any] = {"kind": "vehicle", "name": vehicle.name, "source": vehicle.source}
    data |= {name: getattr(flat, name) for name in ("reference", "mass", "mean_wheel_load")}
    data |= {"service": service and service.model_dump(), "load": vehicle.load, "loads": loads}
    data |= {"bodies": bodies, "elements": elements}
    kinds = Counter(body.kind for body in flat.bodies)
    counts = ", ".join(
        f"{n} {PLURALS.get(kind, f'{kind}s') if n > 1 else kind}" for kind, n in kinds.items()
    )
    parts: Parts = [
        vehicle.name,
        f"  {counts}, {len(elements)} elements; mass {flat.mass / 1e3:.3f} t; mean wheel load "
        f"{flat.mean_wheel_load / 1e3:.2f} kN; distance is that of '{flat.reference}'",
    ]
    parts += [f"  source: {vehicle.source}"] if vehicle.source else []
    if service is not None:
        speed, height = 3.6 * service.admissible_speed, 1e3 * service.cant_deficiency
        limits = f"up to {speed:.4g} km/h and {height:g} mm of cant deficiency"
        parts.append(f"  service: {service.category.replace('_', ' ')}, {limits}")
    if loads:
        parts.append(f"  load case: {vehicle.load or 'design'}; also defined: {', '.join(loads)}")
    lines = _element_rows(vehicle)
    number = Column("number", format="<d")
    columns: list[Column | str] = ["element", "kind", number, "between", "values"]
    parts += ["", _body_table(bodies)]
    if lines:
        parts += ["", Table(columns, lines)]
    parts += _preload_note(vehicle)
    return Description(data, parts)


def _body_table(bodies: Iterable[dict[str, Any]]) -> Table:
    inertias = [Column(f"I{axis}{axis}", unit="kg m2", format=".0f") for axis in "xyz"]
    positions = [Column(axis, unit="m", format=".3f") for axis in "xyz"]
    columns = [*map(Column, ("body", "kind", "wheels")), Column("m", unit="kg", format=".0f")]
    rows = []
    for body in bodies:
        axlebox = body["kind"] == "axlebox"
        inertia = (0.0, body["pitch_inertia"], 0.0) if axlebox else body["inertia"]
        wheels = either(body["profile"]) if body["profile"] else body["wheelset"]
        kind = f"{body['kind']}, fixed" if body["fixed"] else body["kind"]
        rows.append([body["name"], kind, wheels, body["mass"], *inertia, *body["position"]])
    return Table([*columns, *inertias, *positions], rows)


def _element_rows(
    group: Vehicle | Assembly, path: tuple[str, ...] = (), copies: int = 1
) -> list[list[object]]:
    rows: list[list[object]] = []
    for name, element in group.elements.items():
        number = copies * (2 if getattr(element, "sides", None) == "both" else 1)
        between = " - ".join(element.bodies)
        rows.append(
            [".".join((*path, name)), vars(element)["kind"], str(number), between, _values(element)]
        )
    for name, assembly in group.assemblies.items():
        rows += _element_rows(assembly, (*path, name), copies * len(assembly.placements))
    return rows


def _values(element: Element) -> str:
    """Return the parameters that differ from their defaults, without units."""
    changed = element.model_dump(
        exclude_defaults=True, exclude={"kind", "bodies", "points", "point", "sides"}
    )
    return ", ".join(f"{key} {short(value)}" for key, value in changed.items())


def _preload_note(vehicle: Vehicle) -> list[str]:
    """Say where the springs hold the vehicle in its nominal position, and where they may not."""
    springs = [e.definition for e in flatten(vehicle).elements]
    auto = [s for s in springs if getattr(s, "preload", None) == "auto" and s.vertical_stiffness]
    if any(getattr(spring, "has_free_length", False) for spring in springs):
        return ["", "heights follow from the lengths of the springs: see --static"]
    if not auto:
        return []
    design = " in the design load" if vehicle.loads else ""
    text = f"preload of {len(auto)} elements found so that the nominal position is in equilibrium"
    heights = f"; heights with load '{vehicle.load}': see --static" if vehicle.load else ""
    return ["", f"assumed: {text}{design}{heights}"]
