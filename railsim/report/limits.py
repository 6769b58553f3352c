"""Tables of the values of runs with the limits of standards and the meaning of each limit."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from railsim.assessment import Assessment, assess
from railsim.assessment.criteria import CRITERIA, WORDS
from railsim.assessment.influences import RADIUS
from railsim.assessment.record import RUNNING
from railsim.assessment.running import by_vehicle
from railsim.assessment.tables import transition_table
from railsim.assessment.verdict import DERAILED, FAIL, PASS, Verdict
from railsim.assessment.zones import Assessed as Row
from railsim.assessment.zones import ZoneReport
from railsim.compare import differing
from railsim.errors import Faults, listed
from railsim.profiles.used import used_profiles
from railsim.report.document import FAILED, OPEN, PASSED, Cell, Section, Table, page_table
from railsim.result import Results
from railsim.result.sensors import sensors
from railsim.table import beside
from railsim.text import printable

KINDS = {PASS: PASSED, FAIL: FAILED, DERAILED: FAILED}
NADAL = (
    "Nadal's limit (tan γ - μ)/(1 + μ tan γ), γ the flange angle of the profile, μ the friction of "
    "the track; Y/Q unfiltered at the outputs. The climb is the longest stretch of any wheel above "
    "the limit or without load. Overturning is the largest magnitude of (ΣQ left - ΣQ right)/ΣQ of "
    "a bogie; 1: a side without load."
)
NOTE = (
    "Estimate from the sections within the standard's conditions, below it the share of the limit, "
    "the wheelset, wheel or sensor nearest to it and the method: 1-dim. mean + k s, 2-dim. upper "
    "bound of the regression over the cant deficiency at the admissible one. [P] printed in a "
    "source that was read, [R] from memory, [A] assumed; unchecked: not compared with the printed "
    "standard."
)
METHOD = {"one": "1-dim.", "two": "2-dim.", "largest": "largest value", "smallest": "smallest"}
MOST_TOLD = 3  # values that tell vehicles of one name apart; else the names of their runs do
MOST = 256  # runs that are assessed; more would take long


def assess_runs(results: Results) -> tuple[list[tuple[str, str]], Section]:
    """Assess all runs as `railsim assess` does, also those that are sampled too coarsely.

    EN 14363 as far as the runs cover its zones; Nadal's limit for each run.  Returns: the kind
    of each verdict on the page, and the verdict in a sentence; the section of the page.
    """
    runs = {name: result for name, result in results.items() if len(result["time"])}
    verdicts, section = list[tuple[str, str]](), Section("Comparison with limits", id="limits")
    if len(runs) > MOST:
        words = f"{len(runs)} runs are not compared with limits; at most {MOST} runs are."
        section.details.append(remark_table([words]))
        return verdicts, section
    running, remarks = _assess_vehicles(runs, "en14363")
    judged = {name for one in running for name in one.runs}
    missing = [r for name, r in runs.items() if name not in judged and {"Y", "Q"} <= set(r)]
    for name in dict.fromkeys(result.vehicle().name for result in missing):
        words = "not assessed to EN 14363; the remarks on these values say why"
        verdicts.append((OPEN, f"{name}: {words}."))
    running = _distinguish(running, runs)
    derailment, of_safety = _assess_vehicles(runs, "safety")
    for one in running:
        parts = ", ".join(f"{WORDS[n]} {v.value}" for n, v in one.verdicts.items())
        edition = one.limits.edition if one.limits else ""
        words = f"{one.vehicle}, {edition}: {one.verdict} ({parts})."
        verdicts.append((KINDS.get(one.verdict, OPEN), words))
        section.tables.append(_reasons(one))
        section.details += [_conditions(one), _sections(one), *_track(one), *_rows(one)]
        section.details += [_influences(one)] if one.influences else []
        if any(one.transitions.values()):
            section.details.append(page_table(transition_table(one), f"Transitions: {one.vehicle}"))
    section.tables += _zones(running)
    section.details += [_setup(one, runs) for one in running]
    section.details += [_sources(one.limits) for one in running[:1] if one.limits]
    if derailment:
        table, above = _safety(derailment)
        section.tables.append(table)
        if above:
            verdicts.append((FAILED, f"Limits exceeded: {'; '.join(above)}."))
    if sentences := _remark_sentences([*remarks, *of_safety], runs):
        section.details.append(remark_table(sentences))
    return verdicts, section


def remark_table(remarks: Sequence[str]) -> Table:
    """Return remarks as a table."""
    return Table(["remark"], [[remark] for remark in remarks], "Remarks on these values")


def _assess_vehicles(runs: Results, standard: str) -> tuple[list[Assessment], list[str]]:
    """Assess vehicle by vehicle, so that missing quantities of one do not affect the others."""
    faults, assessments = Faults(), list[Assessment]()
    for group in by_vehicle(runs, loads=standard in RUNNING):
        with faults.caught():
            assessments += assess(group, standard, coarse=True)
    remarks = [f"{standard}: {fault}" for fault in faults]
    return assessments, [*remarks, *(remark for one in assessments for remark in one.remarks)]


def _distinguish(assessments: Sequence[Assessment], runs: Results) -> list[Assessment]:
    """Assessments of vehicles of one name, with the values that differ or their runs' names."""
    apart = list[Assessment]()
    for each in assessments:
        same = [other for other in assessments if other.vehicle == each.vehicle]
        parts = [
            f"{' '.join(key.split('.')[-2:]).replace('_', ' ')} {words[same.index(each)]}"
            for key, words in differing([runs[other.runs[0]].vehicle() for other in same]).items()
        ]
        marks = "; ".join(parts) if 0 < len(parts) <= MOST_TOLD else listed(each.runs)
        apart.append(replace(each, vehicle=f"{each.vehicle} ({marks})") if len(same) > 1 else each)
    return apart


def _reasons(assessment: Assessment) -> Table:
    """Return the verdicts of a vehicle with a row for each reason; what is equal once."""
    deciding = getattr(assessment.limits, "deciding", ())
    rows, failed = list[list[str]](), list[int]()
    groups: dict[Verdict, list[str]] = {}
    for name, verdict in assessment.verdicts.items():
        words = WORDS[name] + ("" if name in deciding else " (for information)")
        groups.setdefault(verdict, []).append(words)
    each = [dict.fromkeys(verdict.reasons) for verdict in groups]
    of_all = [r for r in each[0] if all(r in own for own in each)] if len(each) > 1 else []
    for verdict, names in groups.items():
        for k, reason in enumerate([r for r in verdict.reasons if r not in of_all] or ("",)):
            failed += [len(rows)] if KINDS.get(verdict.value) == FAILED else []
            rows.append(["" if k else ", ".join(names), "" if k else verdict.value, reason])
    rows += [["" if k else "all of these", "", reason] for k, reason in enumerate(of_all)]
    header, caption = ["verdict on", "", "reasons"], f"Verdicts: {assessment.vehicle}"
    return Table(header, rows, caption, range(3), failed)


def _conditions(assessment: Assessment) -> Table:
    rows = [
        [c.place or "all runs", c.name, c.state, c.found, c.required, _origin(c)]
        for c in assessment.conditions
    ]
    header = ["", "condition", "", "found", "required", "requirement from"]
    failed = [k for k, c in enumerate(assessment.conditions) if c.state == "not met"]
    return Table(header, rows, f"Conditions of the test: {assessment.vehicle}", range(6), failed)


def _sections(assessment: Assessment) -> Table:
    header = ["run", "zone", "from (m)", "to (m)", "R (m)", "I (mm)", "speed (m/s)",
              "alignment (mm)", "level (mm)", "conicity", "quality", "not counted"]  # fmt: skip
    rows = [
        [
            row.run, s.zone, f"{s.begin:.0f}", f"{s.end:.0f}",
            "straight" if math.isinf(s.radius) else f"{s.radius:.0f}",
            f"{1e3 * s.cant_deficiency:.0f}", f"{s.speed:.2f}", f"{1e3 * row.alignment:.2f}",
            f"{1e3 * row.level:.2f}", "" if math.isnan(row.conicity) else f"{row.conicity:.2f}",
            row.quality, "" if row.counts else s.reason or "no zone",
        ]
        for row in assessment.sections
        for s in [row.section]
    ]  # fmt: skip
    return Table(header, rows, f"Sections: {assessment.vehicle}", (0, 10, 11))


def _track(assessment: Assessment) -> list[Table]:
    """Standard deviations in D2 and D3, and the largest deviation in D1 with its class."""
    texts = {"largest": "largest in D1", "defects": "single defects"}
    measured = [row for row in assessment.sections if row.further]
    header = ["run", "from (m)", "to (m)"]
    for key in measured[0].further if measured else ():
        words = " ".join(texts.get(part, part) for part in key.split("_"))
        header.append(words if key == "defects" else f"{words} (mm)")
    rows = [
        [row.run, f"{row.section.begin:.0f}", f"{row.section.end:.0f}"]
        + [x if isinstance(x, str) else f"{1e3 * x:.1f}" for x in row.further.values()]
        for row in measured
    ]
    caption = f"Track of the sections in D2, D3 and single defects: {assessment.vehicle}"
    return [Table(header, rows, caption, (0, len(header) - 1))] if rows else []


def _rows(assessment: Assessment) -> list[Table]:
    """Return every quantity of every zone and population, with and without a limit."""
    header = ["", "unit", "N", "mean", "s", "method", "line", "s_e", "estimate", "uncorrected",
              "limit", "limit from"]  # fmt: skip
    tables = []
    for zone in assessment.zones:
        rows: list[list[Cell]] = []
        for row in (*zone.rows, *zone.information):
            e, line, text = row.estimate, row.estimate.line, row.criterion.text
            bounded = not math.isnan(row.limit)
            rows.append([
                (row.criterion.words, row.place), row.criterion.unit, str(e.N), text(e.mean),
                text(e.deviation), METHOD[e.method], text(float(line.at(line.target))) if line
                else "", text(line.error) if line else "", text(e.value, row.limit),
                text(row.uncorrected.value) if row.uncorrected else "",
                text(row.limit) if bounded else "none",
                _origin(row) if bounded else "for information",
            ])  # fmt: skip
        if not rows:
            continue  # no section counts; the reasons are among the conditions
        tables.append(Table(
            header, rows, f"All values: {assessment.vehicle}, {zone.title}", (0, 1, 5, 11),
            note="line and s_e: regression over the cant deficiency at the admissible one, and its "
            "standard error.",
        ))  # fmt: skip
    return tables


def _influences(assessment: Assessment) -> Table:
    rows: list[list[Cell]] = []
    for influence in assessment.influences:
        rule, solved = influence.criterion, influence.regression
        constant, deficiency, curvature = (rule.scale * c for c in solved.coefficients)
        rows.append([
            (rule.words, ", ".join(filter(None, [influence.place, influence.population]))),
            rule.unit, str(solved.N), f"{constant:.3g}", f"{1e-3 * deficiency:.3g}",
            f"{1e-3 * curvature:.3g}", rule.text(solved.error), f"{solved.determination:.2f}",
            rule.text(solved.value),
        ])  # fmt: skip
    return Table(
        ["", "unit", "N", "constant", "per mm of I", "per 1/km", "s_e", "R2", "value"], rows,
        f"Multiple regression, for information: {assessment.vehicle}", (0, 1),
        note="All curves of zones 2 to 4 of a population over cant deficiency I and curvature; "
        f"value: at the admissible cant deficiency and R {RADIUS:.0f} m.",
    )  # fmt: skip


def _setup(one: Assessment, runs: Results) -> Table:
    """Return what was tested: vehicle, measuring points, profiles."""
    vehicle = runs[one.runs[0]].vehicle()
    service = vehicle.service
    rows = [("vehicle", f"{vehicle.name}. {vehicle.source or ''}")]
    if service:
        rows.append(("approved for", f"{3.6 * service.admissible_speed:.0f} km/h, cant deficiency "
                     f"{1e3 * service.cant_deficiency:.0f} mm, {service.category}"))  # fmt: skip
    rows += [
        (f"measuring point {name}", f"on {s.body}, {_offset(s.along, 'ahead of', 'behind')} the "
         f"reference body's origin, {_offset(-s.arm[2], 'above', 'below')} that of its body")
        for name, s in sensors(vehicle).items()
    ]  # fmt: skip
    rows.append(("wheel forces", "Y and Q of every wheel, in the contact"))
    each = ((*used_profiles(runs[n].vehicle()), *used_profiles(runs[n].track())) for n in one.runs)
    pairs = {", ".join(dict.fromkeys(name for _, name, _ in used)) for used in each}
    rows += [("profiles of wheels and rails", pair) for pair in sorted(pairs)]
    times = [runs[name]["time"] for name in one.runs]
    rows.append(("runs", f"{len(times)}, {sum(float(t[-1] - t[0]) for t in times):.0f} s"))
    if one.hunting_frequency is not None:
        rows.append(("frequency of the instability", f"{one.hunting_frequency:.2f} Hz"))
    caption = f"Vehicle, measuring points, profiles: {one.vehicle}"
    return Table(["", ""], [[*row] for row in rows], caption, (0, 1))


def _offset(distance: float, on: str, back: str) -> str:
    return f"{abs(distance):.2f} m {on if distance >= 0.0 else back}"


def _sources(limits: Any) -> Table:
    rows = [
        [criterion.words, WORDS[criterion.group], criterion.meaning, _origin(law)]
        for criterion in CRITERIA.values()
        if (law := limits.limits.get(criterion.name)) is not None
    ]
    header = ["", "verdict on", "", "limit from"]
    return Table(header, rows, f"Limits of {limits.edition}", range(4))


def _origin(limit: Any) -> str:
    return limit.source if limit.checked or limit.source == "ours" else f"{limit.source}, unchecked"


def _remark_sentences(remarks: Sequence[str], runs: Results) -> list[str]:
    """Return remarks as sentences, equal remarks on several runs once."""
    by_text: dict[str, list[str]] = {}
    for remark in remarks:
        name, _, text = remark.partition(": ")
        of_run = name in runs and bool(text)
        by_text.setdefault(text if of_run else remark, []).extend([name] if of_run else [])
    sentences = []
    for text, names in by_text.items():
        distinct = list(dict.fromkeys(names))
        who = distinct[0] if len(distinct) == 1 else f"{len(distinct)} runs"
        sentences.append(f"{who + ': ' if distinct else ''}{text.removesuffix('.')}.")
    return sentences


def _zones(assessments: Sequence[Assessment]) -> list[Table]:
    """Return a table for each zone, the vehicles side by side, worst population each."""
    tables: list[Table] = []
    for name in sorted({zone.zone for one in assessments for zone in one.zones}):
        worst = {one.vehicle: one.worst_in(name) for one in assessments}
        rules = list(dict.fromkeys(rule for rows in worst.values() for rule in rows))
        if not rules:
            continue  # no section counts; the reasons are among the conditions
        rows: list[list[Cell]] = []
        failed = []
        for rule in rules:
            pairs = [reports.get(rule) for reports in worst.values()]
            first = next(pair for pair in pairs if pair)[1]
            limits = dict.fromkeys(_limit(pair[1]) for pair in pairs if pair)
            if any(pair and pair[1].exceeded for pair in pairs):
                failed.append(len(rows))
            words = first.criterion.words, first.criterion.meaning
            values, sources = zip(*limits, strict=True)
            limit = " / ".join(values), " / ".join(dict.fromkeys(sources))
            rows.append([words, *map(_cell, pairs), limit])
        own_zones = [z for one in assessments for z in one.zones if z.zone == name]
        counts = sorted({len(zone.values) for zone in own_zones})
        number = " to ".join(dict.fromkeys(str(n) for n in (counts[0], counts[-1])))
        needed = own_zones[0].needed
        edition = next((one.limits.edition for one in assessments if one.limits), "")
        caption = f"{edition}, zone {name}: {number} of {needed} sections in each population"
        header = ["", *map(printable, worst), "limit"]
        tables.append(Table(header, rows, caption, failed=failed, note=NOTE))
    return [*(replace(table, note="") for table in tables[:-1]), *tables[-1:]]


def _cell(pair: tuple[ZoneReport, Row] | None) -> Cell:
    if pair is None:
        return ""
    zone, row = pair
    words = [f"{beside(100.0 * row.share, 100.0)} %", row.place, METHOD[row.estimate.method]]
    if row.uncorrected is not None:
        words.append(f"uncorrected {row.criterion.text(row.uncorrected.value)}")
    if math.isnan(row.share):
        mean = f"{row.estimate.N} value, mean {row.criterion.text(row.estimate.mean)}"
        words = [mean, row.place]
    small = ", ".join(filter(None, [*words, zone.population.name]))
    return row.criterion.text(row.estimate.value, row.limit), small


def _limit(row: Row) -> tuple[str, str]:
    unit = row.criterion.unit.replace("-", "")
    return f"{row.criterion.text(row.limit)} {unit}", _origin(row)


def _safety(assessments: Sequence[Assessment]) -> tuple[Table, list[str]]:
    """Return the wheel of each run that is nearest to Nadal's limit."""
    rows: list[Sequence[Cell]] = []
    failed, above = [], []
    for run, report in [pair for one in assessments for pair in one.safety.items()]:
        # a wheel that never carried load has no quotient
        shares = [
            -math.inf if math.isnan(w.Y_over_Q) else w.Y_over_Q / w.limit for w in report.wheels
        ]
        worst = report.wheels[shares.index(max(shares))]
        lifted = ", ".join(w.place for w in report.wheels if w.lifted) or "none"
        share = worst.Y_over_Q / worst.limit
        if share > 1.0:
            failed.append(len(rows))
            above.append(f"{run}: Nadal's limit, {worst.place}")
        climb = f"{max(w.climb_distance for w in report.wheels):.2f} m"
        known = [x for x in report.overturning.values() if not math.isnan(x)]
        tilt = f"{max(known):.2f}" if known else ""
        rows.append([run, worst.place, beside(worst.Y_over_Q, worst.limit, 3), f"{worst.limit:.3f}",
                     f"{beside(100.0 * share, 100.0)} %", climb, tilt, lifted])  # fmt: skip
    header = ["run", "wheel", "largest Y/Q", "limit", "share", "climb", "overturning", "lifted"]
    caption = "Derailment: the wheel nearest to Nadal's limit"
    return Table(header, rows, caption, (0, 1, 7), failed, NADAL), above
