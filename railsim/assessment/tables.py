"""Assessments as tables: estimates of each zone, comfort, wear and safety of each run."""

import csv
import io
import math
from collections.abc import Iterator, Sequence
from typing import Any

from railsim.assessment.assessment import Assessment
from railsim.assessment.comfort_report import PointComfort
from railsim.assessment.criteria import CRITERIA, WORDS
from railsim.assessment.record import LEFT_OUT
from railsim.assessment.safety import SafetyReport
from railsim.assessment.sections import TestSection
from railsim.assessment.wear import LAWS
from railsim.assessment.wear_report import WheelWear
from railsim.assessment.zones import Assessed, ZoneReport
from railsim.table import Amount, Column, Table
from railsim.text import merge_remarks, spreadsheet_cell

_SHARE = Column("share", "% of limit", format=".1f")
SHORT = {"one": "1-dim.", "two": "2-dim.", "largest": "largest", "smallest": "smallest"}


def tables(assessment: Assessment) -> list[Table]:
    """Return the tables of an assessment."""
    return [
        *(zone_table(zone) for zone in assessment.zones if zone.nearest),
        *([transition_table(assessment)] if any(assessment.transitions.values()) else []),
        *(_comfort(run, points) for run, points in assessment.comfort.items()),
        *(_wear(run, wheels) for run, wheels in assessment.wear.items()),
        *(table for run, report in assessment.safety.items() for table in _safety(run, report)),
    ]


def zone_table(zone: ZoneReport) -> Table:
    """Of each quantity the estimate that is nearest to its limit."""
    title = f"{zone.title}: {len(zone.values)} of {zone.needed} sections"
    columns = [
        Column("quantity", title), Column("location"), Column("unit"), Column("N", format="d"),
        Column("mean", format=">"), Column("s", format=">"), Column("method"),
        Column("estimate", format=">"), Column("limit", format=">"),
        _SHARE,
    ]  # fmt: skip
    return Table(columns, map(_row, zone.nearest))


def transition_table(assessment: Assessment) -> Table:
    """Of each quantity the largest value on all transitions, and where it is."""
    largest: dict[str, tuple[float, str, str, TestSection]] = {}
    for run, x in assessment.transitions.items():
        for v in x:
            for (name, place), values in v.values.items():
                entry = max(values), place, run, v.section
                largest[name] = max(largest.get(name, entry), entry, key=lambda row: row[0])
    number = sum(map(len, assessment.transitions.values()))
    head = f"{number} transition{'s' * (number > 1)}, in no statistics"
    rows = []
    for name, (value, place, run, s) in largest.items():
        c, radius = CRITERIA[name], "reverse" if math.isinf(s.radius) else f"{s.radius:.0f}"
        part = f"{s.begin:.0f} to {s.end:.0f}"
        rows.append([c.words, place, c.unit, c.text(value), run, part, radius])
    columns = [Column("quantity", head), *map(Column, ("location", "unit", "largest", "run")),
               Column("part", unit="m"), Column("radius", "R", "m")]  # fmt: skip
    return Table(columns, rows)


def _row(row: Assessed) -> list[object]:
    c, estimate = row.criterion, row.estimate
    limited = row.limit == row.limit
    column = Column(c.name, unit=c.unit, format=f".{c.decimals}f")
    limit = row.limit if limited else None
    value: object = Amount(estimate.value, column, limit=limit)
    if row.uncorrected is not None:
        before = c.text(row.uncorrected.value)
        value = f"{c.text(estimate.value, row.limit)} (uncorrected {before})"
    return [
        c.words, row.place, c.unit, estimate.N, Amount(estimate.mean, column),
        Amount(estimate.deviation, column), SHORT[estimate.method], value,
        Amount(limit, column), Amount(100.0 * row.share, _SHARE, limit=100.0) if limited else None,
    ]  # fmt: skip


def _comfort(run: str, points: Sequence[PointComfort]) -> Table:
    columns = [
        Column("place", run), Column("x", unit="m", format=".2f"),
        *(Column(name, format=".2f") for name in ("N_MV", "N_VA", "N_VD")),
        Column("iso2631_total", "ISO a_v", "m/s2", ".3f"),
        Column("MTVV", unit="m/s2", format=".3f"), Column("VDV", unit="m/s1.75", format=".2f"),
        Column("lateral", "Wz lateral", format=".2f"),
        Column("vertical", "Wz vertical", format=".2f"),
        Column("P_CT", "P_CT standing (%)", format=".1f"),
        Column("P_DE", "P_DE standing (%)", format=".1f"),
    ]  # fmt: skip
    rows = [
        {
            "place": p.sensor, "x": p.place, "N_MV": p.mean.N_MV, "N_VA": p.mean.N_VA,
            "N_VD": p.mean.N_VD, "iso2631_total": float((p.iso_rms**2).sum() ** 0.5), **p.sperling,
            "MTVV": p.MTVV.max(), "VDV": p.VDV.max(),
            "P_CT": max((t.standing for t in p.transitions), default=None),
            "P_DE": p.events["standing"],
        }
        for p in points
    ]  # fmt: skip
    return Table(columns, rows)


def _wear(run: str, wheels: Sequence[WheelWear]) -> Table:
    columns = [
        Column("place", run), Column("T_gamma", unit="N", format=".1f"),
        Column("95", "95 %", "N", ".0f"), Column("99.85", "99.85 %", "N", ".0f"),
        *(Column(law, f"{LAWS[law].name if law in LAWS else law} (mm2/1000 km)", format=".2f")
          for law in wheels[0].worn_area),
        Column("rail_damage", "WLRM (1e-6)", format=".2f"),
        Column("fatigue_index", "FI_surf", format=".3f"),
    ]  # fmt: skip
    rows = [
        {
            **w.record(), **w.percentiles, "rail_damage": 1e6 * w.rail_damage,
            **{law: None if area is None else 1e12 * area for law, area in w.worn_area.items()},
        }
        for w in wheels
    ]  # fmt: skip
    return Table(columns, rows)


def _safety(run: str, report: SafetyReport) -> list[Table]:
    wheels = [
        Column("place", run), Column("limit", "Nadal", format=".3f"),
        Column("Y_over_Q", "largest Y/Q", format=".3f"),
        Column("climb_distance", "climb", "m", ".2f"), Column("rise", "rise on it", "mm", ".2f"),
        Column("lifted", "off its rail"),
    ]  # fmt: skip
    rows = [
        vars(w)
        | {"Y_over_Q": Amount(w.Y_over_Q, wheels[2], limit=w.limit)}
        | {"lifted": "yes" if w.lifted else ""}
        for w in report.wheels
    ]
    bogies = [Column("bogie"), Column("overturning", format=".3f")]
    return [Table(wheels, rows), Table(bogies, list(report.overturning.items()))]


def assessment_csv(assessments: Sequence[Assessment]) -> str:
    """Return one line for each zone, quantity and location, for spreadsheets; SI."""
    rows = [row for assessment in assessments for row in _csv_rows(assessment)]
    text = io.StringIO()
    columns = list(dict.fromkeys(column for row in rows for column in row))
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: spreadsheet_cell(cell) for name, cell in row.items()} for row in rows)
    return text.getvalue()


def _csv_rows(assessment: Assessment) -> Iterator[dict[str, Any]]:
    head = {"vehicle": assessment.vehicle, "standard": assessment.standard}
    for zone in assessment.zones:
        for row in (*zone.rows, *zone.information):
            yield {**head, "zone": zone.zone, "population": zone.population.name, **row.record()}
    data: Any = assessment.record()
    for kind in ("comfort", "wear"):
        for run, points in data[kind].items():
            for point in points:
                yield {**head, "run": run, **_flat(point)}
    for run, report in data["safety"].items():
        for wheel in report["wheels"]:
            yield {**head, "run": run, **wheel}


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, list):
            value = dict(enumerate(value))
        if isinstance(value, dict):
            flat |= {f"{name}_{key}": member for key, member in value.items()}
        else:
            flat[name] = value
    return flat


def assessment_lines(assessment: Assessment, *, quiet: bool) -> list[str | Table]:
    """Return what is printed of an assessment: verdict, each of its parts with reasons, tables."""
    edition = f", {assessment.limits.edition}" if assessment.limits else ""
    runs = f"{len(assessment.runs)} run{'s' * (len(assessment.runs) > 1)}"
    lines: list[str | Table] = [f"{assessment.vehicle}{edition}, {runs}"]
    if assessment.verdict:
        deciding = getattr(assessment.limits, "deciding", ())
        lines.append(f"verdict: {assessment.verdict}")
        for name, verdict in assessment.verdicts.items():
            note = "" if name in deciding else " (for information)"
            lines.append(f"  {WORDS[name]}{note}: {verdict.value}")
        lines += [f"    {reason}" for reason in assessment.reasons]
    for table in tables(assessment):
        lines += ["", table]
    left_out = [remark for remark in assessment.remarks if remark.startswith(LEFT_OUT)]
    remarks = left_out if quiet else [*left_out, *merge_remarks(_remarks_by_run(assessment))]
    between = [""] * (not quiet or bool(left_out))
    return [*lines, *between, *(f"remark: {remark}" for remark in remarks)]


def _remarks_by_run(assessment: Assessment) -> Iterator[tuple[str, str]]:
    """Yield remarks with the names of their runs, nothing where they are of all."""
    for remark in assessment.remarks:
        if remark.startswith(LEFT_OUT):
            continue
        name, _, text = remark.partition(": ")
        yield (name, text) if name in assessment.runs else ("", remark)
