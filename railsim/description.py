"""What an input file or a result holds: tables for people, plain values for programs.

>>> import railsim
>>> railsim.describe(railsim.load_track("curve_r250")).data["length"]
600.0
"""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from railsim.definitions.alignment_rules import cant_at
from railsim.definitions.base import FileDefinition
from railsim.definitions.element_base import Element
from railsim.definitions.flatten import flatten
from railsim.definitions.irregularity import READING, Irregularity, Measured
from railsim.definitions.layout import Section, cant_sections, curvature_sections, gradient_sections
from railsim.definitions.loading import FORMATS
from railsim.definitions.mechanism import Mechanism
from railsim.definitions.mechanism_values import parameter_values
from railsim.definitions.spring import TrailingArmSuspension
from railsim.definitions.study import Study
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Assembly, Vehicle
from railsim.result.data import Result
from railsim.table import Column, Table
from railsim.text import printable
from railsim.track.curves import Curve, curves

Parts = list[str | Table]


@dataclass(frozen=True, repr=False)
class Description:
    """What an input or a result holds.

    Attributes
    ----------
    data : dict
        Plain values, in SI units.
    parts : sequence of str or Table
        What people read, from top to bottom.
    """

    data: dict[str, Any]
    parts: Sequence[str | Table]

    def __repr__(self) -> str:
        return "\n".join(str(part) for part in self.parts)

    def _repr_html_(self) -> str:
        return "\n".join(
            f"<p>{escape(printable(part))}</p>" if isinstance(part, str) else part.html()
            for part in self.parts
            if part
        )


def describe(item: FileDefinition | Result, speeds: Sequence[float] = ()) -> Description:
    """Return what a vehicle, track, spring, mechanism, study, settings or result holds.

    Parameters
    ----------
    item
        Definition or result.
    speeds : sequence of float
        Of a track: speeds for which the cant deficiency in its curves is given [m/s].
    """
    if isinstance(item, Result):
        return _result(item)
    if isinstance(item, Track):
        return _track(item, speeds)
    if isinstance(item, Vehicle):
        return _vehicle(item)
    content = item.model_dump()
    data = {"kind": FORMATS[content["format"]].kind, **content}
    if isinstance(item, TrailingArmSuspension):
        return Description(data, _spring_parts(item))
    if isinstance(item, Mechanism):
        return Description(data, _mechanism_parts(item))
    if isinstance(item, Study):
        data = {"kind": "study", "runs": item.runs, **item.model_dump(exclude_none=True)}
        return Description(data, [f"{item.name}: {item.runs} runs", "", item.to_toml().rstrip()])
    return Description(data, [item.to_toml().rstrip()])


# vehicles -----------------------------------------------------------------------------------------


_BODY = ("name", "kind", "fixed", "mass", "inertia", "position", "pitch_inertia")


def _vehicle(vehicle: Vehicle) -> Description:
    """Return bodies as placed and mirrored, and elements: in the data likewise, else as written."""
    flat = flatten(vehicle)
    bodies = [
        {
            **{name: getattr(body, name) for name in _BODY},
            "profile": body.wheelset.profile if body.wheelset else None,
            "radius": body.wheelset.radius if body.wheelset else None,
            "wheelset": body.parent,
        }
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
    data = {
        "kind": "vehicle",
        "name": vehicle.name,
        "source": vehicle.source,
        "reference": flat.reference,
        "mass": flat.mass,
        "mean_wheel_load": flat.mean_wheel_load,
        "bodies": bodies,
        "elements": elements,
    }
    kinds = Counter(body.kind for body in flat.bodies)
    counted = ", ".join(f"{n} {_counted_kind(kind, n)}" for kind, n in kinds.items())
    parts: Parts = [
        vehicle.name,
        f"  {counted}, {len(elements)} elements; mass {flat.mass / 1e3:.3f} t; mean wheel load "
        f"{flat.mean_wheel_load / 1e3:.2f} kN; distance is that of '{flat.reference}'",
    ]
    parts += [f"  source: {vehicle.source}"] if vehicle.source else []
    if vehicle.loads:
        cases = ", ".join(vehicle.loads)
        parts.append(f"  load case: {vehicle.load or 'design'}; also defined: {cases}")
    lines = _element_rows(vehicle)
    columns = [
        *map(Column, ("element", "kind")),
        Column("number", format="<d"),
        *map(Column, ("between", "values")),
    ]
    parts += ["", _body_table(bodies), "", Table(columns, lines), *_preload_note(vehicle)]
    return Description(data, parts)


def _body_table(bodies: Iterable[dict[str, Any]]) -> Table:
    inertias = [Column(f"I{axis}{axis}", unit="kg m2", format=".0f") for axis in "xyz"]
    positions = [Column(axis, unit="m", format=".3f") for axis in "xyz"]
    columns = [*map(Column, ("body", "kind", "wheels")), Column("m", unit="kg", format=".0f")]
    rows = []
    for body in bodies:
        axlebox = body["kind"] == "axlebox"
        inertia = (0.0, body["pitch_inertia"], 0.0) if axlebox else body["inertia"]
        wheels = _either(body["profile"]) if body["profile"] else body["wheelset"]
        kind = f"{body['kind']}, fixed" if body["fixed"] else body["kind"]
        rows.append([body["name"], kind, wheels, body["mass"], *inertia, *body["position"]])
    return Table([*columns, *inertias, *positions], rows)


def _counted_kind(kind: str, number: int) -> str:
    words = {"body": ("body", "bodies"), "axlebox": ("axlebox", "axleboxes")}
    return words.get(kind, (kind, f"{kind}s"))[number > 1]


def _either(pair: Sequence[Any]) -> str:
    return str(pair[0]) if pair[0] == pair[1] else f"{pair[0]} / {pair[1]}"


def _element_rows(
    group: Vehicle | Assembly, path: tuple[str, ...] = (), copies: int = 1
) -> list[list[object]]:
    rows: list[list[object]] = []
    for name, element in group.elements.items():
        number = copies * (2 if getattr(element, "sides", None) == "both" else 1)
        between = " - ".join(element.bodies)
        rows.append([".".join((*path, name)), element.kind, str(number), between, _values(element)])
    for name, assembly in group.assemblies.items():
        rows += _element_rows(assembly, (*path, name), copies * len(assembly.placements))
    return rows


def _values(element: Element) -> str:
    """Return the parameters that differ from their defaults, without units."""
    changed = element.model_dump(
        exclude_defaults=True, exclude={"kind", "bodies", "points", "point", "sides"}
    )
    return ", ".join(f"{key} {_short(value)}" for key, value in changed.items())


def _short(value: object) -> str:
    """Write a value shortly: 31.391e6 rather than 3.1391e+07."""
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        return f"{len(value)} rows"
    if isinstance(value, tuple):
        return "[" + " ".join(_short(member) for member in value) + "]"
    if not isinstance(value, float):
        return str(value)
    if abs(value) < 1e5:
        return f"{value:.6g}"
    exponent = 3 * int(math.log10(abs(value)) // 3)
    return f"{value / 10**exponent:.6g}e{exponent}"


def _preload_note(vehicle: Vehicle) -> list[str]:
    """Say where the springs hold the vehicle in its nominal position, and where they may not."""
    springs = [e.definition for e in flatten(vehicle).elements]
    auto = [s for s in springs if getattr(s, "preload", None) == "auto" and s.vertical_stiffness]
    if any(getattr(spring, "has_free_length", False) for spring in springs):
        return ["", "heights follow from the lengths of the springs: see --static"]
    if not auto:
        return []
    design = " in the design load" if vehicle.loads else ""
    found = f"preload of {len(auto)} elements found so that the nominal position is in equilibrium"
    moved = f"; heights with load '{vehicle.load}': see --static" if vehicle.load else ""
    return ["", f"assumed: {found}{design}{moved}"]


# design files -------------------------------------------------------------------------------------


def _mechanism_parts(mechanism: Mechanism) -> Parts:
    values = parameter_values(mechanism)
    driver = mechanism.driver
    moved = driver.angle or driver.coordinate or " to ".join(driver.length or ())
    parts: Parts = [mechanism.name]
    parts += [f"  source: {mechanism.source}"] if mechanism.source else []
    parts += [
        f"  {len(mechanism.bodies)} bodies: {', '.join(mechanism.bodies)}",
        f"  {len(mechanism.joints)} joints: {', '.join(mechanism.joints)}",
        f"  driven by {moved}",
    ]
    for title in ("actuators", "elements", "cases", "catalogues"):
        names = getattr(mechanism, title)
        parts += [f"  {title}: {', '.join(names)}"] if names else []
    right = [Column(name, format=">") for name in ("value", "unit", "provenance")]
    rows = [
        [
            name,
            "auto" if name in mechanism.automatic else f"{float(values[name]):.8g}",
            mechanism.unit_of(name),
            mechanism.provenance_of(name),
        ]
        for name in mechanism.parameters
    ]
    return [*parts, "", Table([Column("parameter"), *right], rows)]


def _spring_parts(suspension: TrailingArmSuspension) -> Parts:
    arm, material = suspension.arm, suspension.material
    parts: Parts = [
        suspension.name,
        f"  arm {arm.length:g} m, seat {1e3 * arm.seat_height:g} mm above the axle, bush "
        f"{arm.bush_torsional_stiffness:g} N m/rad, moment of the nest by '{arm.equilibrium}'",
        f"  G {material.G / 1e9:g} GPa, E {material.E / 1e9:g} GPa, {material.density:g} kg/m3",
    ]
    parts += [f"  source: {suspension.source}"] if suspension.source else []
    columns = [
        Column("spring"),
        Column("mean_diameter", "D", "mm", ".6g"),
        Column("wire_diameter", "d", "mm", ".6g"),
        Column("active_coils", "active coils", "", ".6g"),
        Column("free_height", "free height", "mm", ".6g"),
        Column("seat", "seat", "mm", ".6g"),
    ]
    seats = zip(suspension.springs.items(), suspension.seat_heights, strict=True)
    rows = [{"spring": name, **vars(spring), "seat": seat} for (name, spring), seat in seats]
    parts += ["", Table(columns, rows)]
    if suspension.engagement:
        parts.append(f"the inner spring works from {1e3 * suspension.engagement:g} mm on")
    points = [("mounting", suspension.mounting), ("target", suspension.target)]
    wanted = {point.load: (name, point.deflection) for name, point in points if point is not None}
    loads = [[name, load, None] for name, load in suspension.loads.items()]
    loads += [[name, load, deflection] for load, (name, deflection) in wanted.items()]
    force = Column("force", unit="kN", format="g")
    deflection = Column("deflection", "wanted deflection", "mm", "g")
    parts += ["", Table([Column("load"), force, deflection], loads)]
    others = ("fatigue", "search", "tolerances", "vehicle")
    present = [name for name in others if getattr(suspension, name) is not None]
    return [*parts, "", f"tables besides: {', '.join(present) or 'none'}"]


# tracks -------------------------------------------------------------------------------------------

_COPIED = (
    "name", "source", "length", "gauge", "rail", "inclination", "friction", "friction_table",
    "gauge_widening", "cant_rotation", "third_body", "rounding", "speed",
)  # fmt: skip


def _track(track: Track, speeds: Sequence[float]) -> Description:
    plan, cant = curvature_sections(track), cant_sections(track)
    bends = {curve.section: curve for curve in curves(track)}
    data = {
        "kind": "track",
        **{name: getattr(track, name) for name in _COPIED},
        "friction_falling": track.friction_falling and track.friction_falling.model_dump(),
        "plan": [_plan_row(section, cant, bends.get(section), speeds) for section in plan],
        "cant": [_row(section) for section in cant],
        "vertical": [_row(section) for section in gradient_sections(track)],
        "mileage": (track.mileage_at(0.0), track.mileage_at(track.length)),
        "irregularities": [_irregularity(part) for part in track.irregularities],
    }
    parts: Parts = [*_track_lines(track, data["mileage"]), "", _plan_table(data["plan"], speeds)]
    if speeds and any("cant_deficiency" in row for row in data["plan"]):
        parts.append("columns of speeds: cant deficiency in mm")
    ends = [Column("begin", "from", "m", "g"), Column("end", "to", "m", "g")]
    vertical = [
        [row["type"], row["begin"], row["end"], _range(row["values"], 1e3)]
        for row in data["vertical"]
    ]
    gradient = Column("gradient", "gradient per mille", format=">")
    if vertical:
        parts += ["", Table([Column("vertical"), *ends, gradient], vertical)]
    irregular = [
        [str(part["type"]), ", ".join(f"{k} {_short(v)}" for k, v in part.items() if k != "type")]
        for part in data["irregularities"]
    ]
    if irregular:
        parts += ["", Table(["irregularity", "values"], irregular)]
    return Description(data, parts)


def _track_lines(track: Track, mileage: tuple[float, float]) -> list[str]:
    slope = 1.0 / track.inclination if track.inclination else math.inf
    friction = "by table" if track.friction_table else _either(track.friction)
    lines = [
        track.name,
        f"  {track.length:g} m, gauge {1e3 * track.gauge:g} mm, rail {_either(track.rail)} "
        f"1:{slope:g}, friction {friction}, rounded over {track.rounding:g} m",
    ]
    if track.speed is not None:
        lines.append(f"  permitted speed {track.speed:g} m/s ({3.6 * track.speed:.0f} km/h)")
    if track.mileage or track.falling_mileage:
        lines.append("  mileage from km {:.3f} to km {:.3f}".format(*(m / 1e3 for m in mileage)))
    if track.cant_rotation == "inner_rail":
        lines.append("  cant turns the track about the inner rail")
    if track.gauge_widening:
        widest = max(left + right for _, left, right in track.gauge_widening)
        lines.append(f"  gauge widened by up to {1e3 * widest:g} mm")
    if track.friction_falling:
        falling = track.friction_falling
        lines.append(f"  friction with slip down to {falling.rest:g} of it, {falling.decay:g} s/m")
    if track.third_body != (1.0, 1.0):
        lines.append(f"  third body: Kalker's coefficients times {_either(track.third_body)}")
    return [*lines, f"  source: {track.source}"] if track.source else lines


def _irregularity(part: Irregularity) -> dict[str, Any]:
    """Return an irregularity; of a measured one what its rows hold instead of the rows."""
    data = part.model_dump(exclude_none=True, exclude={"rows"})
    if isinstance(part, Measured) and part.rows is not None:
        from railsim.track.irregularity import largest_between_rows

        found = largest_between_rows(part)
        data = {key: value for key, value in data.items() if key not in READING}
        data |= {
            "number": len(part.rows),
            "first": part.rows[0][0] + part.shift,
            "last": part.rows[-1][0] + part.shift,
            "column": found.column,
            "largest_at_rows": found.at_rows,
            "largest_between_rows": found.between,
        }
    return data


def _row(section: Section) -> dict[str, Any]:
    return {
        "type": section.type,
        "begin": section.begin,
        "end": section.end,
        "values": (section.start_value, section.end_value),
    }


def _plan_row(
    section: Section, cant: Sequence[Section], curve: Curve | None, speeds: Sequence[float]
) -> dict[str, Any]:
    row = _row(section)
    row["radii"] = tuple(1.0 / k if k else math.inf for k in row.pop("values"))
    row["cant"] = tuple(cant_at(cant, s) for s in (section.begin, section.end))
    if curve is not None:
        row["balanced_speed"] = curve.balanced_speed
        row["usual_speed"] = curve.usual_speed
        row["cant_deficiency"] = {speed: curve.cant_deficiency(speed) for speed in speeds}
    return row


def _plan_table(plan: Sequence[dict[str, Any]], speeds: Sequence[float]) -> Table:
    columns = [
        Column("type", "plan"),
        Column("begin", "from", "m", "g"),
        Column("end", "to", "m", "g"),
        Column("radii", "radius m", format=">"),
        Column("cant", "cant mm", format=">"),
        Column("balanced_speed", "equilibrium speed", "km/h", ".1f"),
        Column("usual_speed", "speed at 150 mm deficiency", "km/h", ".1f"),
        *(Column(f"{speed:g}", f"{speed:g} m/s", "", ".0f") for speed in speeds),
    ]
    rows = [
        {
            **row,
            "radii": _range(row["radii"], 1.0),
            "cant": _range(row["cant"], 1e3),
            **{f"{v:g}": 1e3 * lack for v, lack in row.get("cant_deficiency", {}).items()},
        }
        for row in plan
    ]
    return Table(columns, rows)


def _range(values: Sequence[float], scale: float) -> str:
    return " to ".join(dict.fromkeys(f"{scale * value:g}" for value in values))


# results ------------------------------------------------------------------------------------------


def _result(result: Result) -> Description:
    """Return what a result holds, without its arrays."""
    inputs = ("vehicle_toml", "track_toml", "settings_json")
    attributes = {k: v for k, v in result.attributes.items() if k not in (*inputs, "remarks")}
    coordinates = {name: list(labels) for name, labels in result.coordinates.items()}
    # by the dimensions: the arrays of a long run are not read for their shapes
    lengths = {"time": len(result["time"])} | {dim: len(n) for dim, n in coordinates.items()}
    quantities: dict[str, dict[str, Any]] = {
        name: {
            "dims": quantity.dims,
            "shape": tuple(lengths[dim] for dim in quantity.dims),
            "unit": quantity.unit,
        }
        for name, quantity in result.quantities.items()
    }
    data = {
        "kind": "result",
        "attributes": attributes,
        "remarks": list(result.remarks),
        "coordinates": coordinates,
        "quantities": quantities,
    }
    rows = [
        [name, ", ".join(q["dims"]), " x ".join(map(str, q["shape"])), q["unit"]]
        for name, q in quantities.items()
    ]
    return Description(
        data,
        [
            *(f"{name:18} {value}" for name, value in attributes.items()),
            *(f"{'remark':18} {remark}" for remark in result.remarks),
            "",
            *(f"{name:18} {', '.join(labels)}" for name, labels in coordinates.items()),
            "",
            Table(["quantity", "dimensions", "shape", "unit"], rows),
        ],
    )
