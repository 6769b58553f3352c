"""What a track holds."""

import math
from collections.abc import Sequence
from typing import Any

from railsim.definitions import Track
from railsim.definitions.excitations import Irregularity
from railsim.definitions.excitations.measured import READING, Measured, largest_between_rows
from railsim.definitions.track.alignment_rules import cant_at
from railsim.definitions.track.check_rail import FAR, CheckRail
from railsim.definitions.track.elements import Section
from railsim.definitions.track.layout import cant_sections, curvature_sections, gradient_sections
from railsim.definitions.track.rail_sections import RailSections
from railsim.description.values import Description, Parts, either, short
from railsim.errors import argument_error
from railsim.table import Column, Table
from railsim.track.curves import Curve, curves
from railsim.units import speed_in_si

_COPIED = (
    "name", "source", "length", "gauge", "rail", "inclination", "friction", "friction_table",
    "gauge_widening", "cant_rotation", "third_body", "rounding", "speed",
)  # fmt: skip

ENDS = ("begin", "end")
ROWS = ("number", "first", "last", "column", "largest_at_rows", "largest_between_rows")


def _speed_in_si(speed: float | str) -> float:
    value = speed_in_si(speed)
    if isinstance(value, str) or not value > 0.0:
        allowed = "above 0, such as 20 or '72 km/h'"
        raise argument_error("speeds", f"found {speed!r}", allowed, option="--speed")
    return float(value)


def describe_track(track: Track, speeds: Sequence[float | str]) -> Description:
    """Return plan with cant, speeds of the curves, crossings, vertical profile, irregularities."""
    speeds_si = [_speed_in_si(speed) for speed in speeds]
    plan, cant = curvature_sections(track), cant_sections(track)
    bends = {curve.section: curve for curve in curves(track)}
    data = {
        "kind": "track",
        **{name: getattr(track, name) for name in _COPIED},
        "friction_falling": track.friction_falling and track.friction_falling.model_dump(),
        "plan": [_plan_row(section, cant, bends.get(section), speeds_si) for section in plan],
        "cant": [_row(section) for section in cant],
        "vertical": [_row(section) for section in gradient_sections(track)],
        "mileage": (track.mileage_at(0.0), track.mileage_at(track.length)),
        "sections": [_sections(part) for part in track.sections],
        "check_rail": [_check_rail(part) for part in track.check_rail],
        "irregularities": [_irregularity(part) for part in track.irregularities],
    }
    parts: Parts = [*_track_lines(track, data), "", _plan_table(data["plan"], speeds_si)]
    if speeds_si and bends:
        parts.append("columns of speeds: cant deficiency in mm")
    ends = [Column("begin", "from", "m", "g"), Column("end", "to", "m", "g")]
    # the plan's table has the cant at the ends of its elements only
    ramps = {round(r[end], 6) for r in data["cant"] if r["type"] == "LIR" for end in ENDS}
    within = ramps - {round(r[end], 6) for r in data["plan"] for end in ENDS}
    if within and bends:
        parts.append("speeds and deficiencies of a curve: with the cant at its middle")
    for name, heading in (("cant", "cant (mm)"), ("vertical", "gradient per mille")):
        if not (within if name == "cant" else data[name]):
            continue
        rows = [[r["type"], r["begin"], r["end"], _range(r["values"], 1e3)] for r in data[name]]
        parts += ["", Table([Column(name), *ends, Column("values", heading, format=">")], rows)]
    irregularity_rows = [[str(part["type"]), _values(part)] for part in data["irregularities"]]
    if irregularity_rows:
        parts += ["", Table(["irregularity", "values"], irregularity_rows)]
    return Description(data, parts)


def _track_lines(track: Track, data: dict[str, Any]) -> list[str]:
    slope = f"1:{1.0 / track.inclination:g}" if track.inclination else "upright"
    lines = [
        track.name,
        f"  {track.length:g} m, gauge {1e3 * track.gauge:g} mm, rail {either(track.rail)} "
        f"{slope}, friction {track.friction_words}, rounded over {track.rounding:g} m",
        f"  rails {track.support.words}",
    ]
    if track.speed is not None:
        lines.append(f"  permitted speed {track.speed:g} m/s ({3.6 * track.speed:.0f} km/h)")
    if track.mileage or track.falling_mileage:
        ends = (m / 1e3 for m in data["mileage"])
        lines.append("  mileage from km {:.3f} to km {:.3f}".format(*ends))
    if track.cant_rotation == "inner_rail":
        lines.append("  cant turns the track about the inner rail")
    if track.gauge_widening:
        lines.append(f"  gauge widened by up to {1e3 * track.widest:g} mm")
    if track.friction_falling:
        falling = track.friction_falling
        lines.append(f"  friction with slip down to {falling.rest:g} of it, {falling.decay:g} s/m")
    if track.third_body != (1.0, 1.0):
        lines.append(f"  third body: Kalker's coefficients times {either(track.third_body)}")
    template = "  {rail} rail of {number} sections from s = {begin:g} to {end:g} m"
    lines += [template.format(**part) for part in data["sections"]]
    for part in data["check_rail"]:
        along = "from s = {begin:g} to {end:g} m" if part["begin"] > -FAR else "all along"
        least = f"flangeway {1e3 * part['flangeway']:g} mm at least"
        lines.append(f"  check rail beside the {part['rail']} rail {along.format(**part)}, {least}")
    return [*lines, f"  source: {track.source}"] if track.source else lines


def _sections(part: RailSections) -> dict[str, Any]:
    """Return a range of sections; of what was read the number of sections in it."""
    places = [contour.s + part.shift for contour in part.contours or ()]
    number = sum(part.begin <= s <= part.end for s in places)
    return {"rail": part.rail, "begin": part.begin, "end": part.end, "number": number}


def _check_rail(part: CheckRail) -> dict[str, Any]:
    """Return ends and least flangeway of a check rail."""
    s, widths = zip(*part.rows, strict=True)
    return {"rail": part.rail, "begin": s[0], "end": s[-1], "flangeway": min(widths)}


def _irregularity(part: Irregularity) -> dict[str, Any]:
    """Return an irregularity; of a measured one what its rows hold instead of the rows."""
    data = part.model_dump(exclude_none=True, exclude={"rows"})
    if isinstance(part, Measured) and part.rows is not None:
        column, at_rows, between, _ = largest_between_rows(part)
        data = {key: value for key, value in data.items() if key not in READING}
        first, last = (part.rows[k][0] + part.shift for k in (0, -1))
        facts = len(part.rows), first, last, column, at_rows, between
        data |= dict(zip(ROWS, facts, strict=True))
    return data


def _values(part: dict[str, Any]) -> str:
    """Return an irregularity in words; rows that were read with their range in mm."""
    plain = {key: short(value) for key, value in part.items() if key not in ("type", *ROWS)}
    texts = [f"{key} {value}" for key, value in plain.items()]
    if "number" in part:
        first, last, column = (part[key] for key in ("first", "last", "column"))
        largest = [1e3 * part[key] for key in ("largest_at_rows", "largest_between_rows")]
        texts.append(f"{part['number']} rows from s = {first:g} to {last:g} m")
        texts.append("{} up to {:.2f} mm, {:.2f} mm between the rows".format(column, *largest))
    return ", ".join(texts)


def _row(section: Section) -> dict[str, Any]:
    values = section.start_value, section.end_value
    return {"type": section.type, "begin": section.begin, "end": section.end, "values": values}


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
        Column("radii", "radius (m)", format=">"),
        Column("cant", "cant (mm)", format=">"),
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
    return " to ".join(dict.fromkeys(f"{round(scale * value, 2):g}" for value in values))
