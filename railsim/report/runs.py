"""A self-contained page about runs: inputs, values and limits, curves, spread.

`page` composes it from the records of all runs and the results of those whose curves are shown.
The page loads no other files; its plots are drawn by uPlot (`vendor/`).
"""

import re
from base64 import b64encode
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from markupsafe import Markup

from railsim.assessment.assessment import Assessment
from railsim.assessment.record import RUNNING
from railsim.assessment.tables import tables
from railsim.errors import listed
from railsim.notation import QUANTITIES
from railsim.page import render_page
from railsim.plot.assessment import assessment_figure
from railsim.report import document as doc
from railsim.report import spread
from railsim.report.curves import cells_of, curve_data, groups
from railsim.report.inputs import inputs_section
from railsim.report.limits import assess_runs, remark_table
from railsim.report.published import published_comparisons
from railsim.result import Results
from railsim.studies.columns import WORDS, Record, columns, parameters
from railsim.studies.inputs import Inputs, inputs_of, units_of
from railsim.text import printable
from railsim.version import __version__

PEAKS = (
    "Largest magnitudes over all {instants} after the start of the run, with their signs; "
    "wheelsets are numbered from the leading end."
)
MOST_ROWS = 300  # of a table on the page
MOST_UNITS = 4  # runs whose inputs say the units of what was varied


def page(
    title: str,
    records: Sequence[Record],
    results: Results,
    remarks: Sequence[str] = (),
    assessable: Results | None = None,
    inputs: Mapping[str, Any] | None = None,
    run_inputs: Sequence[Inputs] = (),
    assessments: Sequence[Assessment] = (),
    measured: Sequence[doc.Section] = (),
) -> str:
    """Return the page as HTML.

    `title`: Title of the page. `records`: One for each run, as `railsim.result.extremes.run_facts`
    with ``name`` and ``labels``, including runs that failed or have not been done. `results`:
    Results, by the names of their runs, whose curves are shown. `remarks`: Further notes for the
    reader. `assessable`: All results, which are assessed together and whose inputs are told; by
    default `results`. `inputs`: Inputs of the study whose runs these are, as in its ``study.json``.
    `run_inputs`: Those of runs without results, as the files are now. `assessments`: Those of a
    scenario; comfort, wear and safety are shown in sections of their own. `measured`: Comparisons
    with tests and identifications.
    """
    inputs = inputs or {}
    found = groups(results)
    cells = cells_of(found)
    curves = [curve_data(group, cells) for group in found]
    data: dict[str, Any] = {"curves": [group for group in curves if group["quantities"]]}
    every = results if assessable is None else assessable
    verdicts, limits = assess_runs(every)
    peaks = any(record["name"] in results for record in _with_values(records))
    run_inputs = inputs_of(records, every) or list(run_inputs)
    units = units_of(records, run_inputs[:MOST_UNITS])
    few, analysed = len(records) < spread.LEAST, any(one.get("quantities") for one in records)
    sections = [_peaks(records, results)] if peaks or (few and not analysed) else []
    sections += [_assessment_section(one) for one in assessments if one.standard not in RUNNING]
    if len(_with_values(records)) > max(spread.LEAST, len(results)):
        sections.append(_worst(records, units))
    if found and (data["curves"] or peaks):
        sections.append(_curves(len(data["curves"]), records, results))
    if limits.tables or limits.details:
        sections.append(limits)
    if analysed or not few:
        sections.append(_spread(records, data, inputs, units))
    sections += [*_published(every), *measured]
    sections.append(inputs_section(run_inputs, every, inputs))
    sections.append(_remarks(records, remarks))
    return render_page(
        "railsim.report", "templates/runs.html", title=title,
        styles=["vendor/uPlot.min.css", "templates/runs.css"],
        scripts=["vendor/uPlot.iife.min.js", "templates/study.js", "templates/runs.js"], data=data,
        schemes="light dark", lead=_lead(records, results),
        verdict=_verdict(records, verdicts),
        sections=sections,
        foot=f"Written by railsim {__version__}; plots by uPlot 1.6.32 (MIT). "
        "Values in customary units; files and the Python interface use SI units.",
        wrap=Markup("_<wbr>"),
    )  # fmt: skip


def _with_values(records: Sequence[Record]) -> list[Record]:
    return [record for record in records if record.get("peaks") or record.get("quantities")]


def _lead(records: Sequence[Record], results: Results) -> str:
    parts = [f"{len(records)} run{'s' * (len(records) != 1)}"]
    if len(records) == len(results) == 1:
        parts += [result.title for result in results.values()]
    else:
        parts += filter(None, (_in_words(records, kind) for kind in ("vehicle", "track", "speed")))
    versions = sorted({str(r.attributes.get("railsim_version", "")) for r in results.values()})
    created = sorted(str(r.attributes.get("created", "")) for r in results.values())
    if versions and any(versions):
        parts.append(f"computed by railsim {', '.join(filter(None, versions))}")
    if created and created[-1]:
        parts.append(f"last run on {doc.day(created[-1])}")
    return "; ".join(parts) + "."


def _in_words(records: Sequence[Record], kind: str) -> str:
    """Return the vehicles, tracks or speeds of runs, or their number where there are many."""
    labels = list(dict.fromkeys(record["labels"].get(kind, "") for record in records))
    if kind == "speed" and "" in labels:  # every run has one, but not every record names it
        return ""
    unit = " m/s" if kind == "speed" else ""
    if len(labels) <= 4 and all(map(str, labels)):
        words = ", ".join(f"{label:.6g}" if unit else str(label) for label in labels)
        return f"{kind}{'s' * (len(labels) > 1)} {words}{unit}"
    span = f" from {min(labels):.6g} to {max(labels):.6g} m/s" if unit else ""
    return f"{len(labels)} {kind}s{span}"


def _verdict(
    records: Sequence[Record], verdicts: Sequence[tuple[str, str]]
) -> list[dict[str, str]]:
    counts = Counter(str(record["status"]) for record in records)
    whole = counts == {"complete": len(records)}
    words = ", ".join(f"{number} {status}" for status, number in counts.items())
    text = f"All {len(records)} runs are complete." if whole else f"Of {len(records)} runs {words}."
    if len(records) == 1:
        text = f"The run is {words[2:]}."
    first = doc.PASSED if whole else doc.FAILED, text
    return [{"kind": kind, "text": words} for kind, words in (first, *verdicts)]


def _peaks(records: Sequence[Record], results: Results) -> doc.Section:
    """Peaks of the shown runs side by side, with position and time."""
    shown = [record for record in _with_values(records) if record["name"] in results]
    rows: dict[tuple[str, str], list[doc.Cell]] = {}
    for number, record in enumerate(shown):
        wheelsets = results[record["name"]].wheelsets
        for peak in record["peaks"]:
            quantity = QUANTITIES[peak["quantity"]]
            words = f"{quantity.words}, {WORDS[peak['kind']]}"
            row = rows.setdefault((quantity.name, peak["kind"]), [words])
            row += [""] * (1 + number - len(row))
            wheelset = peak.get("wheelset", "")
            where = f"wheelset {wheelsets.index(wheelset) + 1} " if wheelset in wheelsets else ""
            where += f"{peak.get('side', '')} at {peak['distance']:.1f} m"
            row.append((quantity.text(peak["value"]), where))
    table = doc.Table(
        ["", *(printable(f"{r['name']}{results[r['name']].end_words}") for r in shown)],
        [row + [""] * (1 + len(shown) - len(row)) for row in rows.values()],
    )
    # results with a low pass hold the peaks of their outputs alone
    of_steps = ["peaks" in results[record["name"]].groups for record in shown]
    kinds = {(True, True): "steps", (False, False): "outputs"}
    mixed = "outputs, and over all steps where a result holds these,"
    instants = kinds.get((any(of_steps), all(of_steps)), mixed)
    texts, done = [PEAKS.format(instants=instants)], len(_with_values(records))
    if not done:
        texts = ["No run has values; why stands under the failures below."]
    elif not shown:
        texts = ["The study kept no results of its runs (`--keep summary`); their values follow."]
    elif len(shown) < done:
        texts.append(f"{_largest(len(shown), done)}; all others follow in the table of runs.")
    return doc.Section("Peaks", texts, tables=[table] if shown else [], id="peaks")


def _worst(records: Sequence[Record], units: Mapping[str, str]) -> doc.Section:
    """The runs with the largest values, and where the study has them."""
    done = _with_values(records)
    header = ["", *(f"{k}." for k in range(1, spread.WORST + 1))]
    table = doc.Table(header, spread.worst_rows(done, units))
    text = (
        f"The largest of {len(done)} runs by magnitude, over all wheels; the table of runs below "
        "has the rest, and the command of each."
    )
    # of a critical speed the largest value is no bad one
    title = "Worst runs" if any(one.get("peaks") for one in done) else "Largest values"
    return doc.Section(title, [text], tables=[table], id="worst")


def _largest(number: int, total: int) -> str:
    return f"{number} of {total} runs, those with the largest values"


def _assessment_section(assessment: Assessment) -> doc.Section:
    """An assessment of comfort, wear or safety: its picture and its tables, folded."""
    section = doc.Section(f"Assessment: {assessment.standard}", id=assessment.standard)
    figure = assessment_figure([assessment])
    if figure is not None:
        code = b64encode(doc.as_png(figure)).decode()
        words = f"{assessment.vehicle}: values of {assessment.standard}"
        image = Markup('<img alt="{}" src="data:image/png;base64,{}">').format(words, code)
        section.drawings.append(doc.Drawing(assessment.vehicle, "", image))
    section.details = [
        doc.page_table(one, str(one.columns[0].heading)) for one in tables(assessment)
    ]
    if assessment.remarks:
        section.details.append(remark_table(assessment.remarks))
    return section


def _curves(number: int, records: Sequence[Record], results: Results) -> doc.Section:
    if not number:
        text = "The results hold none of the quantities that are drawn here."
        return doc.Section("Along the track", [text], id="curves")
    done = len(_with_values(records))
    texts = [f"{_largest(len(results), done)}."] if len(results) < done else []
    return doc.Section("Along the track", texts, plots=[*map(str, range(number))], id="curves")


def _spread(
    records: Sequence[Record],
    data: dict[str, Any],
    inputs: Mapping[str, Any],
    units: Mapping[str, str],
) -> doc.Section:
    """Table of all runs, and what their values depend on."""
    done, varied = _with_values(records), parameters(records, units)
    data["spread"] = {
        "parameters": varied,
        "columns": columns(records),
        "runs": [
            {
                "name": printable(str(record["name"])),
                "status": str(record["status"]),
                "reason": printable(str(record.get("status_reason", ""))),
                "command": printable(spread.command(record, inputs)),
            }
            for record in records
        ],
    }
    header = ["value", "smallest", "in run", "median", "largest", "in run"]
    note = "Peaks and medians over full curves by magnitude, over all wheels."
    caption = f"Spread over {len(done)} runs"
    table = doc.Table(header, spread.spread_rows(done), caption, (0, 2, 5), note=note)
    details = [table] if table.rows else []
    section = doc.Section("Over the study", plots=["runs"], details=details, id="spread")
    if len(done) >= spread.LEAST and varied:
        section.texts = [f"Varied: {', '.join(varied)}."]
        section.plots.insert(0, "spread")
    return section


def _published(results: Results) -> list[doc.Section]:
    """Published values beside those of the runs, where there are any."""
    rows = published_comparisons(results)
    tables = []
    for study in dict.fromkeys(row.study.name for row in rows):
        of_study = [row for row in rows if row.study.name == study]
        cells = []
        for row in of_study:
            quantity = QUANTITIES[row.value.quantity]
            side = f" {row.value.side}" if row.value.side else ""
            at = row.value.read if isinstance(row.value.read, str) else f"t = {row.value.read:g} s"
            where = f"wheelset {row.value.wheelset}{side}, {at}"
            numbers = quantity.text(row.published), quantity.text(row.computed)
            difference = f"{100.0 * row.difference:+.1f} %"
            cells.append([row.run, quantity.words, where, *numbers, difference, row.rails])
        first = of_study[0].study
        note = f"{first.program}: {first.source}. {' '.join(first.notes)}"
        header = ["run", "quantity", "evaluated at", "published", "computed", "difference", "rails"]
        tables.append(doc.Table(header, cells, first.name, (0, 1, 2), note=note))
    title = "Comparison with published values"
    return [doc.Section(title, tables=tables, id="published")] if tables else []


def _remarks(records: Sequence[Record], sentences: Sequence[str]) -> doc.Section:
    """Runs that failed or ended early, and remarks, equal ones once."""
    section = doc.Section("Failures and remarks", [*sentences], id="remarks")
    ended: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        if record["status"] != "complete":  # one reason for whatever numbers it tells
            kind = re.sub(r"\d+(\.\d+)?", "#", str(record.get("status_reason", "")))
            ended.setdefault((str(record["status"]), kind), []).append(record)
    rows: list[list[doc.Cell]] = []
    for (status, _), group in sorted(ended.items(), key=lambda item: -len(item[1])):
        names = listed([str(record["name"]) for record in group])
        rows.append([f"{len(group)}", status, str(group[0].get("status_reason", "")), names])
    by_remark: dict[str, list[str]] = {}
    for record in records:
        for remark in record.get("remarks", ()):
            by_remark.setdefault(str(remark), []).append(str(record["name"]))
    short = sum(map(len, ended.values()))
    remarks = [[remark, listed(names)] for remark, names in by_remark.items()]
    caption = f"{short} of {len(records)} runs did not reach the requested end"
    for table, none in (
        (doc.Table(["runs", "status", "reason, of the first", "which"], rows, caption, range(1, 4)),
         "All runs reached the requested end."),
        (doc.Table(["remark", "runs"], remarks, "Remarks", range(2)),
         "There are no remarks on the runs."),
    ):  # fmt: skip
        left = len(table.rows) - MOST_ROWS
        note = f"{left} more are in summary.csv." if left > 0 else ""
        if table.rows:
            section.tables.append(replace(table, rows=table.rows[:MOST_ROWS], note=note))
        else:
            section.texts.append(none)
    return section
