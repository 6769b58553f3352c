"""Tables of the values of runs with the limits of standards and the meaning of each limit."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from railsim.assessment import Assessment, assess
from railsim.assessment.verdict import Assessed
from railsim.errors import InputError
from railsim.report.tables import Cell, Table
from railsim.result import Result
from railsim.text import printable

# Meaning of each limit, by the key of the quantity in the limits file.
MEANING = {
    "sum_Y": "shifting of ballasted track: k1 (10 kN + 2 Q0/3), 2 Q0 the static axle load "
    "(Prud'homme)",
    "Y_over_Q": "flange climbing of the outer wheel",
    "instability": "instability: half of the limit of the track shifting force",
    "Q": "track loading: 90 kN + Q0, at most a value that depends on the speed",
    "Q_qst": "quasi-static vertical wheel force on the outer rail in curves",
    "Y_qst": "quasi-static guiding force on the outer rail, by the mean radius of the sections",
    "body_y_safety": "lateral acceleration of the body, safety",
    "body_z_safety": "vertical acceleration of the body, safety",
    "frame_y": "lateral acceleration of the bogie frame, by its mass",
    "body_y": "lateral acceleration of the body, ride",
    "body_z": "vertical acceleration of the body, ride",
    "body_y_rms": "lateral acceleration of the body, ride, rms",
    "body_z_rms": "vertical acceleration of the body, ride, rms",
    "body_y_qst": "quasi-static lateral acceleration of the body in curves",
}
NADAL = (
    "Nadal's limit (tan gamma - mu)/(1 + mu tan gamma), gamma the flange angle of the profile, mu "
    "the friction of the track; Y/Q unfiltered at the outputs. The climb is the longest stretch "
    "above the limit. Overturning is (sum Q_left - sum Q_right)/(sum Q) of a bogie; 1 = a side "
    "without load."
)
NOTE = (
    "Estimate according to the standard from the available sections (mean + k s), below it the "
    "share of the limit and the wheelset, wheel or sensor nearest to it; for a single section its "
    "own value. Reliability of the limits: [P] printed in a source that was read, [R] "
    "recalled{unchecked}."
)
UNCHECKED = "; none has been compared with the printed standard"
MOST = 64  # runs that are assessed; more would take long


def limit_tables(results: Mapping[str, Result]) -> tuple[list[Table], list[str], list[str]]:
    """Return tables of runs with their limits, remarks on them, and limits exceeded.

    EN 14363 as far as the runs cover its zones, with all full sections; Nadal's limit for each run.
    """
    runs = {name: result for name, result in results.items() if len(result["time"])}
    if len(runs) > MOST:
        return [], [f"{len(runs)} runs are not compared with limits; at most {MOST} runs are."], []
    running, remarks = _assessed(runs, "en14363")
    derailment, more = _assessed(runs, "safety")
    tables, exceeded = _zones(running)
    if derailment:
        table, above = _safety(derailment)
        tables.append(table)
        exceeded += above
    return tables, _gathered([*remarks, *more], runs), exceeded


def _assessed(runs: Mapping[str, Result], standard: str) -> tuple[list[Assessment], list[str]]:
    """Assess vehicle by vehicle, so that missing quantities of one do not affect the others."""
    groups: dict[str, dict[str, Result]] = {}
    for name, result in runs.items():
        groups.setdefault(str(result.attributes["vehicle_toml"]), {})[name] = result
    found: list[Assessment] = []
    remarks: list[str] = []
    for group in groups.values():
        try:
            own = assess(group, standard, coarse=True, all_sections=True)
        except InputError as error:
            remarks += [f"{standard}: {fault}" for fault in error.faults]
            continue
        found += own
        for one in own:
            remarks += one.remarks
            if one.verdict:
                remarks.append(f"{one.vehicle}: {one.verdict}; {'; '.join(one.reasons)}")
    return found, remarks


def _gathered(remarks: Sequence[str], runs: Mapping[str, Result]) -> list[str]:
    """Return remarks as sentences, equal remarks on several runs once."""
    by_text: dict[str, list[str]] = {}
    for remark in remarks:
        name, _, text = remark.partition(": ")
        known = name in runs and bool(text)
        by_text.setdefault(text if known else remark, []).extend([name] if known else [])
    found = []
    for text, names in by_text.items():
        own = list(dict.fromkeys(names))
        who = own[0] if len(own) == 1 else f"{len(own)} runs"
        found.append(f"{who + ': ' if own else ''}{text}.")
    return found


def _zones(assessments: Sequence[Assessment]) -> tuple[list[Table], list[str]]:
    """Return a table for each zone, the vehicles side by side, and the limits exceeded."""
    tables: list[Table] = []
    exceeded: list[str] = []
    names = list(dict.fromkeys(zone.zone for one in assessments for zone in one.zones))
    for name in sorted(names):
        zones = {one.vehicle: z for one in assessments for z in one.zones if z.zone == name}
        worst = {vehicle: _nearest(zone.rows) for vehicle, zone in zones.items()}
        rules = list(dict.fromkeys(rule for rows in worst.values() for rule in rows))
        rows: list[list[Cell]] = []
        failed = []
        for rule in rules:
            own = [found.get(rule) for found in worst.values()]
            first = next(row for row in own if row)
            cells = [_cell(row) for row in own]
            rows.append([(first.rule.words, MEANING[rule]), *cells, _limit(first)])
            if any(row and _share(row) > 1.0 for row in own):
                failed.append(len(rows) - 1)
        exceeded += [
            f"{vehicle}, zone {name}: {row.rule.words}, {row.place} ({row.estimate.N} values)"
            for vehicle, found in worst.items()
            for row in found.values()
            if _share(row) > 1.0
        ]
        counts = " and ".join({str(len(zone.values)): None for zone in zones.values()})
        needed = next(iter(zones.values())).needed
        checked = all(row.checked for found in worst.values() for row in found.values())
        edition = next((one.limits.edition for one in assessments if one.limits), "")
        tables.append(
            Table(
                ["", *map(printable, zones), "limit"],
                rows,
                f"{edition}, zone {name}: {counts} of {needed} sections",
                failed=frozenset(failed),
                note=NOTE.format(unchecked="" if checked else UNCHECKED),
            )
        )
    for table in tables[:-1]:
        tables[tables.index(table)] = replace(table, note="")
    return tables, exceeded


def _value(row: Assessed) -> float:
    """Return the estimate; for a single section, which has none, its own value."""
    return row.estimate.value if row.estimate.value == row.estimate.value else row.estimate.mean


def _share(row: Assessed) -> float:
    return _value(row) / row.limit


def _nearest(rows: Sequence[Assessed]) -> dict[str, Assessed]:
    """Return, by quantity, the wheelset, wheel or sensor that is nearest to its limit."""
    found: dict[str, Assessed] = {}
    for row in rows:
        before = found.get(row.rule.name)
        if before is None or _share(row) > _share(before):
            found[row.rule.name] = row
    return found


def _cell(row: Assessed | None) -> Cell:
    if row is None:
        return ""
    return f"{row.rule.scale * _value(row):.3g}", f"{100.0 * _share(row):.0f} %, {row.place}"


def _limit(row: Assessed) -> Cell:
    marks = " ".join(dict.fromkeys(re.findall(r"\[[A-Z]\]", row.source)))
    return f"{row.rule.scale * row.limit:.3g} {row.rule.unit.replace('-', '')}", marks


def _safety(found: Sequence[Assessment]) -> tuple[Table, list[str]]:
    """Return the wheel of each run that is nearest to Nadal's limit."""
    rows: list[Sequence[Cell]] = []
    failed, above = [], []
    for run, report in [pair for one in found for pair in one.safety.items()]:
        # a wheel that has lifted has no quotient
        worst = max(
            report.wheels,
            key=lambda w: float("-inf") if w.Y_over_Q != w.Y_over_Q else w.Y_over_Q / w.limit,
        )
        lifted = [w.place for w in report.wheels if w.Y_over_Q != w.Y_over_Q]
        share = worst.Y_over_Q / worst.limit
        if share > 1.0:
            failed.append(len(rows))
            above.append(f"{run}: Nadal's limit, {worst.place}")
        rows.append(
            [
                run,
                worst.place,
                f"{worst.Y_over_Q:.3f}",
                f"{worst.limit:.3f}",
                f"{100.0 * share:.0f} %",
                f"{max(w.climb_distance for w in report.wheels):.2f} m",
                f"{max(report.overturning.values()):.2f}" if report.overturning else "",
                ", ".join(lifted) or "none",
            ]
        )
    header = ["run", "wheel", "largest Y/Q", "limit", "share", "climb", "overturning", "lifted"]
    table = Table(
        header,
        rows,
        "Derailment: the wheel nearest to Nadal's limit",
        words=frozenset({0, 1, 7}),
        failed=frozenset(failed),
        note=NADAL,
    )
    return table, above
