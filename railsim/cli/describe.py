"""What vehicles, tracks and results hold, as plain data and as lines for a screen."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from railsim.cli.common import table

if TYPE_CHECKING:
    from railsim.definitions.elements.base import Element
    from railsim.definitions.irregularity import Irregularity
    from railsim.definitions.layout import Section
    from railsim.definitions.mechanism import Mechanism
    from railsim.definitions.spring import TrailingArmSuspension
    from railsim.definitions.track import Track
    from railsim.definitions.vehicle import Assembly, Vehicle
    from railsim.result import Result
    from railsim.track.curves import Curve


def _point(point: Sequence[float]) -> str:
    return " ".join(f"{value:8.3f}" for value in point)


# vehicles -----------------------------------------------------------------------------------------


def vehicle_data(vehicle: "Vehicle") -> dict[str, Any]:
    """Return a vehicle without assemblies as plain data [SI]."""
    from railsim.definitions.flatten import flatten

    flat = flatten(vehicle)
    bodies = [
        {
            "name": body.name,
            "kind": body.kind,
            "fixed": body.fixed,
            "mass": body.mass,
            "inertia": body.inertia,
            "position": body.position,
            "profile": body.wheelset.profile if body.wheelset else None,
            "radius": body.wheelset.radius if body.wheelset else None,
            "wheelset": body.parent,
            "pitch_inertia": body.pitch_inertia,
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
    return {
        "kind": "vehicle",
        "name": vehicle.name,
        "source": vehicle.source,
        "reference": flat.reference,
        "mass": flat.mass,
        "mean_wheel_load": flat.mean_wheel_load,
        "bodies": bodies,
        "elements": elements,
    }


def vehicle_lines(vehicle: "Vehicle") -> list[str]:
    """Return a vehicle on one screen: bodies, then elements as they are written."""
    data = vehicle_data(vehicle)
    kinds = Counter(body["kind"] for body in data["bodies"])
    counted = ", ".join(f"{n} {_counted_kind(kind, n)}" for kind, n in kinds.items())
    lines = [
        f"{vehicle.name}",
        f"  {counted}, {len(data['elements'])} elements; mass {data['mass'] / 1e3:.3f} t; "
        f"mean wheel load {data['mean_wheel_load'] / 1e3:.2f} kN; "
        f"distance is that of '{data['reference']}'",
    ]
    lines += [f"  source: {vehicle.source}"] if vehicle.source else []
    if vehicle.loads:
        cases = ", ".join(vehicle.loads)
        lines.append(f"  load case: {vehicle.load or 'design'}; also defined: {cases}")
    rows = []
    for body in data["bodies"]:
        inertia = body["inertia"] if body["kind"] != "axlebox" else (0, body["pitch_inertia"], 0)
        wheels = _either(body["profile"]) if body["profile"] else body["wheelset"] or ""
        cells = [f"{value:.0f}" for value in (body["mass"], *inertia)]
        kind = f"{body['kind']}, fixed" if body["fixed"] else body["kind"]
        rows.append([body["name"], kind, wheels, *cells, _point(body["position"])])
    header = ["body", "kind", "wheels", "m kg", "Ixx", "Iyy", "Izz kg m2", "x, y, z m"]
    lines += ["", *table(header, rows, numbers=3), ""]
    lines += table(["element", "kind", "number", "between", "values"], _element_rows(vehicle), 9)
    return [*lines, *_assumption_lines(vehicle)]


def _counted_kind(kind: str, number: int) -> str:
    words = {"body": ("body", "bodies"), "axlebox": ("axlebox", "axleboxes")}
    return words.get(kind, (kind, f"{kind}s"))[number > 1]


def _either(pair: Sequence[object]) -> str:
    return str(pair[0]) if pair[0] == pair[1] else f"{pair[0]} / {pair[1]}"


def _element_rows(
    group: "Vehicle | Assembly", path: tuple[str, ...] = (), copies: int = 1
) -> list[list[str]]:
    rows = []
    for name, element in group.elements.items():
        number = copies * (2 if getattr(element, "sides", None) == "both" else 1)
        between = " - ".join(element.bodies)
        values = _values(element)
        rows.append([".".join((*path, name)), element.kind, str(number), between, values])
    for name, assembly in group.assemblies.items():
        rows += _element_rows(assembly, (*path, name), copies * len(assembly.placements))
    return rows


def _values(element: "Element") -> str:
    """Return the parameters that differ from their defaults, without units."""
    given = element.model_dump(
        exclude_defaults=True, exclude={"kind", "bodies", "points", "point", "sides"}
    )
    return ", ".join(f"{key} {_short(value)}" for key, value in given.items())


def _short(value: object) -> str:
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        return f"{len(value)} rows"
    if isinstance(value, tuple):
        return "[" + " ".join(_short(member) for member in value) + "]"
    return _number(value) if isinstance(value, float) else str(value)


def _number(value: float) -> str:
    """Write a number shortly: 31.391e6 rather than 3.1391e+07."""
    if abs(value) < 1e5:
        return f"{value:.6g}"
    exponent = 3 * int(math.log10(abs(value)) // 3)
    return f"{value / 10**exponent:.6g}e{exponent}"


def _assumption_lines(vehicle: "Vehicle") -> list[str]:
    from railsim.definitions.flatten import flatten

    flat = flatten(vehicle)
    found = [e.name for e in flat.elements if _finds_its_preload(e.definition)]
    if not found:
        return []
    load = " in the design load" if vehicle.loads else ""
    text = f"preload of {len(found)} elements found so that the nominal position is in equilibrium"
    text += load
    return ["", f"assumed: {text}"]


def _finds_its_preload(element: "Element") -> bool:
    stiffness = getattr(element, "stiffness", 1.0)
    vertical = stiffness[2] if isinstance(stiffness, tuple) else stiffness
    return getattr(element, "preload", None) == "auto" and vertical > 0.0


def static_data(vehicle: "Vehicle") -> dict[str, Any]:
    """Return static wheel loads and preloads on straight level track [N]."""
    from railsim.model.statics import static_loads

    return static_loads(vehicle).record()


def static_lines(static: dict[str, Any]) -> list[str]:
    """Return static wheel loads and preloads as tables."""
    rows = [
        [name, f"{left / 1e3:.3f}", f"{right / 1e3:.3f}", f"{(left + right) / 1e3:.3f}"]
        for name, (left, right) in static["Q0"].items()
    ]
    lines = table(["static loads, kN", "Q0 left", "Q0 right", "axle load"], rows)
    rows = [
        [name, " ".join(f"{value / 1e3:10.3f}" for value in preload)]
        for name, preload in static["preload"].items()
    ]
    return [*lines, "", *table(["preload, kN", "tension, or x y z on body 1"], rows)]


# springs ------------------------------------------------------------------------------------------


def mechanism_lines(mechanism: "Mechanism") -> list[str]:
    """Return a mechanism file on one screen: parts, driver, parameters with their provenance."""
    from railsim.definitions.mechanism_values import parameter_values

    values = parameter_values(mechanism)
    driver = mechanism.driver
    moved = driver.angle or driver.coordinate or " to ".join(driver.length or ())
    lines = [f"{mechanism.name}"]
    lines += [f"  source: {mechanism.source}"] if mechanism.source else []
    lines += [
        f"  {len(mechanism.bodies)} bodies: {', '.join(mechanism.bodies)}",
        f"  {len(mechanism.joints)} joints: {', '.join(mechanism.joints)}",
        f"  driven by {moved}",
    ]
    for title, names in (
        ("actuators", mechanism.actuators),
        ("elements", mechanism.elements),
        ("cases", mechanism.cases),
        ("catalogues", mechanism.catalogues),
    ):
        lines += [f"  {title}: {', '.join(names)}"] if names else []
    rows = [
        [
            name,
            "auto" if name in mechanism.automatic else f"{float(values[name]):.8g}",
            mechanism.unit_of(name),
            mechanism.provenance_of(name),
        ]
        for name in mechanism.parameters
    ]
    return [*lines, "", *table(["parameter", "value", "unit", "provenance"], rows)]


def spring_lines(suspension: "TrailingArmSuspension") -> list[str]:
    """Return a spring file on one screen: arm, springs, loads, and what else it holds."""
    arm, material = suspension.arm, suspension.material
    lines = [
        f"{suspension.name}",
        f"  arm {arm.length:g} m, seat {1e3 * arm.seat_height:g} mm above the axle, bush "
        f"{arm.bush_torsional_stiffness:g} N m/rad, moment of the nest by '{arm.equilibrium}'",
        f"  G {material.G / 1e9:g} GPa, E {material.E / 1e9:g} GPa, {material.density:g} kg/m3",
    ]
    lines += [f"  source: {suspension.source}"] if suspension.source else []
    rows = [
        [
            name,
            *(
                "" if value is None else f"{scale * value:.6g}"
                for scale, value in (
                    (1e3, spring.mean_diameter),
                    (1e3, spring.wire_diameter),
                    (1.0, spring.active_coils),
                    (1e3, spring.free_height),
                    (1e3, seat),
                )
            ),
        ]
        for (name, spring), seat in zip(
            suspension.springs.items(), suspension.seat_heights, strict=True
        )
    ]
    header = ["spring", "D mm", "d mm", "active coils", "free height mm", "seat mm"]
    lines += ["", *table(header, rows)]
    if suspension.engagement:
        lines.append(f"the inner spring works from {1e3 * suspension.engagement:g} mm on")
    points = [("mounting", suspension.mounting), ("target", suspension.target)]
    wanted = {point.load: (name, point.deflection) for name, point in points if point is not None}
    loads = [[name, f"{load / 1e3:g}", ""] for name, load in suspension.loads.items()]
    loads += [[name, f"{load / 1e3:g}", f"{1e3 * s:g}"] for load, (name, s) in wanted.items()]
    lines += ["", *table(["load", "kN", "wanted deflection mm"], loads)]
    others = ("fatigue", "search", "tolerances", "vehicle")
    present = [name for name in others if getattr(suspension, name) is not None]
    return [*lines, "", f"tables besides: {', '.join(present) or 'none'}"]


# tracks -------------------------------------------------------------------------------------------


def track_data(track: "Track", speeds: Sequence[float]) -> dict[str, Any]:
    """Return a track's elements with the speeds that suit its curves, as plain data [SI]."""
    from railsim.definitions.layout import cant_sections, curvature_sections, gradient_sections
    from railsim.track.curves import curves

    plan, cant = curvature_sections(track), cant_sections(track)
    bends = {curve.section: curve for curve in curves(track)}
    return {
        "kind": "track",
        "name": track.name,
        "source": track.source,
        "length": track.length,
        "gauge": track.gauge,
        "rail": track.rail,
        "inclination": track.inclination,
        "friction": track.friction,
        "friction_table": track.friction_table,
        "gauge_widening": track.gauge_widening,
        "cant_rotation": track.cant_rotation,
        "friction_falling": track.friction_falling and track.friction_falling.model_dump(),
        "third_body": track.third_body,
        "rounding": track.rounding,
        "plan": [_plan_row(section, cant, bends.get(section), speeds) for section in plan],
        "cant": [_row(section) for section in cant],
        "vertical": [_row(section) for section in gradient_sections(track)],
        "speed": track.speed,
        "mileage": (track.mileage_at(0.0), track.mileage_at(track.length)),
        "irregularities": [_irregularity(part) for part in track.irregularities],
    }


def _irregularity(part: "Irregularity") -> dict[str, Any]:
    """Return an irregularity; of a measured one what its rows hold instead of the rows."""
    from railsim.definitions.irregularity import READING, Measured

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


def _row(section: "Section") -> dict[str, Any]:
    return {
        "type": section.type,
        "begin": section.begin,
        "end": section.end,
        "values": (section.start_value, section.end_value),
    }


def _plan_row(
    section: "Section", cant: Sequence["Section"], curve: "Curve | None", speeds: Sequence[float]
) -> dict[str, Any]:
    from railsim.definitions.alignment_rules import cant_at

    row = _row(section)
    row["radii"] = tuple(1.0 / k if k else math.inf for k in row.pop("values"))
    row["cant"] = tuple(cant_at(cant, s) for s in (section.begin, section.end))
    if curve is not None:
        row["balanced_speed"] = curve.balanced_speed
        row["usual_speed"] = curve.usual_speed
        row["cant_deficiency"] = {speed: curve.cant_deficiency(speed) for speed in speeds}
    return row


def track_lines(track: "Track", speeds: Sequence[float]) -> list[str]:
    """Return a track on one screen: plan with cant, speeds of the curves, vertical profile."""
    data = track_data(track, speeds)
    lines = [
        f"{track.name}",
        f"  {track.length:g} m, gauge {1e3 * track.gauge:g} mm, rail {_either(track.rail)} "
        f"1:{1.0 / track.inclination if track.inclination else math.inf:g}, "
        f"friction {'by table' if track.friction_table else _either(track.friction)}, "
        f"rounded over {track.rounding:g} m",
    ]
    if track.speed is not None:
        lines.append(f"  permitted speed {track.speed:g} m/s ({3.6 * track.speed:.0f} km/h)")
    if track.mileage or track.falling_mileage:
        begin, end = (f"{1e-3 * value:.3f}" for value in data["mileage"])
        lines.append(f"  mileage from km {begin} to km {end}")
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
    lines += [f"  source: {track.source}"] if track.source else []
    header = ["plan", "from m", "to m", "radius m", "cant mm", "equilibrium speed", "150 mm at"]
    header += [f"{speed:g} m/s" for speed in speeds]
    rows = [_plan_cells(row, speeds) for row in data["plan"]]
    lines += ["", *table(header, rows)]
    if speeds and any("cant_deficiency" in row for row in data["plan"]):
        lines.append("columns of speeds: cant deficiency in mm")
    vertical = [
        [row["type"], f"{row['begin']:g}", f"{row['end']:g}", _range(row["values"], 1e3)]
        for row in data["vertical"]
    ]
    if vertical:
        lines += ["", *table(["vertical", "from m", "to m", "gradient per mille"], vertical)]
    irregular = [
        [str(part.pop("type")), ", ".join(f"{key} {_short(value)}" for key, value in part.items())]
        for part in data["irregularities"]
    ]
    if irregular:
        lines += ["", *table(["irregularity", "values"], irregular, numbers=2)]
    return lines


def _plan_cells(row: dict[str, Any], speeds: Sequence[float]) -> list[str]:
    cells = [row["type"], f"{row['begin']:g}", f"{row['end']:g}"]
    cells += [_range(row["radii"], 1.0), _range(row["cant"], 1e3)]
    if "balanced_speed" not in row:
        return [*cells, "", "", *("" for _ in speeds)]
    cells += [f"{row['balanced_speed']:.1f} m/s", f"{row['usual_speed']:.1f} m/s"]
    return [*cells, *(f"{1e3 * row['cant_deficiency'][speed]:.0f}" for speed in speeds)]


def _range(values: Sequence[float], scale: float) -> str:
    written = [f"{scale * value:g}" for value in values]
    return written[0] if written[0] == written[1] else " to ".join(written)


# results -----------------------------------------------------------------------------


def result_data(result: "Result") -> dict[str, Any]:
    """Return what a result holds, without its arrays."""
    inputs = ("vehicle_toml", "track_toml", "settings_json")
    attributes = {k: v for k, v in result.attributes.items() if k not in (*inputs, "remarks")}
    coordinates = {name: list(labels) for name, labels in result.coordinates.items()}
    # by the dimensions: the arrays of a long run are not read for their shapes
    lengths = {"time": len(result["time"])} | {
        dim: len(names) for dim, names in coordinates.items()
    }
    quantities = {
        name: {
            "dims": quantity.dims,
            "shape": tuple(lengths[dim] for dim in quantity.dims),
            "unit": quantity.unit,
        }
        for name, quantity in result.quantities.items()
    }
    return {
        "kind": "result",
        "attributes": attributes,
        "remarks": list(result.remarks),
        "coordinates": coordinates,
        "quantities": quantities,
    }


def result_lines(result: "Result") -> list[str]:
    """Return a result on one screen: facts about the run, dimensions, quantities."""
    data = result_data(result)
    lines = [f"{name:18} {value}" for name, value in data["attributes"].items()]
    lines += [f"{'remark':18} {remark}" for remark in data["remarks"]]
    lines += ["", *(f"{k:18} {', '.join(names)}" for k, names in data["coordinates"].items())]
    rows = [
        [name, ", ".join(q["dims"]), " x ".join(str(n) for n in q["shape"]), q["unit"]]
        for name, q in data["quantities"].items()
    ]
    return [*lines, "", *table(["quantity", "dimensions", "shape", "unit"], rows, numbers=4)]
