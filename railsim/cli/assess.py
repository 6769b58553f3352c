"""``railsim assess``: results against the limits of a standard."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import echo, output_options, print_json, show, text_table
from railsim.files import check_folder, make_folder, whole_file
from railsim.text import spreadsheet_cell

if TYPE_CHECKING:
    from collections.abc import Sequence

    from railsim.assessment import Assessment
    from railsim.assessment.zones import Assessed
    from railsim.definitions.vehicle_tables import Service
    from railsim.result import Result
    from railsim.table import Table

STANDARDS = ("en14363", "uic518", "comfort", "wear", "safety")
SHORT = {"one": "1-dim.", "two": "2-dim.", "largest": "largest", "smallest": "smallest"}
FILES = ("assessment.json", "assessment.csv", "assessment.png", "assessment_sections.png",
         "assessment_regression.png")  # fmt: skip


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="R.h5|DIR ...")
@click.option(
    "--standard", type=click.Choice(STANDARDS), default="en14363", show_default=True,
    help="What to assess.",
)  # fmt: skip
@click.option("--limits", metavar="F", help="Limits file, or the name of a shipped one.")
@click.option(
    "--method", type=click.Choice(["normal", "simplified"]), default="normal", show_default=True,
    help="With wheel forces, or with accelerations only.",
)  # fmt: skip
@click.option(
    "--admissible-speed", type=float, metavar="V", help="Instead of the vehicle's, in m/s."
)
@click.option("--cant-deficiency", type=float, metavar="I", help="Admissible cant deficiency in m.")
@click.option(
    "--category", type=click.Choice(["passenger", "freight", "locomotive", "multiple_unit"]),
    help="Instead of the vehicle's.",
)  # fmt: skip
@click.option(
    "--causal", is_flag=True, help="Causal filters, with phase, as in measuring amplifiers."
)
@click.option("--coarse", is_flag=True, help="Also accept results below 1000 samples per second.")
@click.option("--all-sections", is_flag=True, help="Also use sections outside a zone's conditions.")
@click.option("--fail", is_flag=True, help="Exit status 4 where a limit is exceeded.")
@click.option("--out", metavar="DIR", help="Folder for assessment.json, .csv and .png.")
@output_options
def command(
    files: tuple[str, ...],
    standard: str,
    out: str | None,
    fail: bool,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
    admissible_speed: float | None,
    cant_deficiency: float | None,
    category: str | None,
    **how: Any,
) -> int:
    """Assess results: running behaviour, comfort, wear or derailment.

    Runs of one vehicle are assessed together, those of several vehicles one after the other; a
    folder means all results in it.  The verdict is "pass" only where all zones have enough
    sections within the standard's conditions.

    \b
    Example:
      railsim assess coach_manchester_curve_r500_29.h5
      railsim assess coach_manchester_curve_r500_29.h5 --standard comfort
    """  # noqa: D301 - click reads the escape
    from railsim.assessment import assess
    from railsim.cli import DONE, LIMIT_EXCEEDED

    results = _opened(files)
    folder = Path(out) if out else None
    if folder:
        check_folder(folder, FILES, overwrite=overwrite)
    service = _service(results, admissible_speed, cant_deficiency, category)
    assessments = assess(results, standard, service=service, **how)
    written = write_assessments(folder, assessments) if folder else []
    if as_json:
        print_json([assessment.record() for assessment in assessments])
    else:
        for assessment in assessments:
            show(*assessment_lines(assessment, quiet=quiet))
        for path in written:
            echo(str(path))
    return LIMIT_EXCEEDED if fail and any(a.exceeded for a in assessments) else DONE


def _opened(files: "Sequence[str]") -> "dict[str, Result]":
    """Open results by their names; a folder stands for those in it."""
    from railsim.errors import Fault, InputError
    from railsim.result import open_run

    faults: list[Fault] = []
    paths: list[Path] = []
    for file in files:
        inside = sorted(Path(file).glob("*.h5")) if os.path.isdir(file) else [Path(file)]
        if not inside:
            faults.append(Fault(file, "", "no results in this folder", "a folder with .h5 files"))
        paths += inside
    stems = [path.stem for path in paths]
    results: dict[str, Result] = {}
    for path in paths:
        label = path.stem if stems.count(path.stem) == 1 else str(path)
        if label in results:
            faults.append(Fault(str(path), "", "given twice", "give each result once"))
            continue
        try:
            results[label] = open_run(path)
        except InputError as error:
            faults.extend(error.faults)
    if faults:
        raise InputError(faults)
    return results


def _service(
    results: "dict[str, Result]",
    speed: float | None,
    deficiency: float | None,
    category: str | None,
) -> "Service | None":
    """Service table with options instead of the vehicles' values; None where there are none."""
    given = {
        name: value
        for name, value in (
            ("admissible_speed", speed), ("cant_deficiency", deficiency), ("category", category),
        )
        if value is not None
    }  # fmt: skip
    if not given:
        return None
    from pydantic import ValidationError

    from railsim.definitions.vehicle_tables import Service
    from railsim.errors import Fault, InputError

    own = next(iter(results.values())).vehicle().service
    try:
        return Service.model_validate({**(own.model_dump() if own else {}), **given})
    except ValidationError as error:
        raise InputError([
            Fault(f"--{str(e['loc'][0]).replace('_', '-')}", "", e["msg"].lower(), "in SI units")
            for e in error.errors()
        ]) from None  # fmt: skip


def write_assessments(folder: Path, assessments: "Sequence[Assessment]") -> list[Path]:
    """Write the record, the table and the picture; return their paths."""
    import json

    from railsim.cli.common import plain
    from railsim.plot.assessment import assessment_figure, regression_figure, sections_figure
    from railsim.plot.style import save

    make_folder(folder)
    record, rows, *pictures = (folder / name for name in FILES)
    with whole_file(record) as partial:
        data = plain([assessment.record() for assessment in assessments])
        partial.write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    with whole_file(rows) as partial:
        partial.write_text(assessment_csv(assessments), encoding="utf-8")
    written = [record, rows]
    drawn = (assessment_figure, sections_figure, regression_figure)
    for path, draw in zip(pictures, drawn, strict=True):
        figure = draw(assessments)
        if figure is not None:
            save(figure, path, overwrite=True)
            written.append(path)
    return written


def assessment_csv(assessments: "Sequence[Assessment]") -> str:
    """Return one line for each zone, quantity and location, for spreadsheets; SI."""
    import csv
    import io

    text = io.StringIO()
    rows: list[dict[str, Any]] = []
    for assessment in assessments:
        head = {"vehicle": assessment.vehicle, "standard": assessment.standard}
        rows += [{**head, "zone": zone.zone, "population": zone.population.name, **row.record()}
                 for zone in assessment.zones
                 for row in (*zone.rows, *zone.information)]  # fmt: skip
        data = assessment.record()
        for kind in ("comfort", "wear"):
            table_of: Any = data[kind]
            rows += [{**head, "run": run, **_flat(point)}
                     for run, points in table_of.items() for point in points]  # fmt: skip
        safety: Any = data["safety"]
        rows += [{**head, "run": run, **wheel}
                 for run, report in safety.items() for wheel in report["wheels"]]  # fmt: skip
    columns = list(dict.fromkeys(column for row in rows for column in row))
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: spreadsheet_cell(cell) for name, cell in row.items()} for row in rows)
    return text.getvalue()


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, dict):
            found |= {f"{name}_{key}": member for key, member in value.items()}
        elif isinstance(value, list):
            found |= {f"{name}_{index}": member for index, member in enumerate(value)}
        else:
            found[name] = value
    return found


def assessment_lines(assessment: "Assessment", *, quiet: bool = False) -> "list[str | Table]":
    """Return an assessment as lines for a screen."""
    edition = f", {assessment.limits.edition}" if assessment.limits else ""
    runs = f"{len(assessment.runs)} run{'s' * (len(assessment.runs) > 1)}"
    lines: list[str | Table] = [f"{assessment.vehicle}{edition}, {runs}"]
    lines += _verdict_lines(assessment)
    for zone in assessment.zones:
        header = [
            f"{zone.title}: {len(zone.values)} of {zone.needed} sections", "location", "unit",
            "N", "mean", "s", "method", "estimate", "limit", "% of limit",
        ]  # fmt: skip
        rows = [_row(row) for row in zone.nearest]
        lines += ["", text_table(header, rows, numbers=3)]
    lines += _comfort_lines(assessment) + _wear_lines(assessment) + _safety_lines(assessment)
    if not quiet:
        lines += ["", *(f"note: {remark}" for remark in assessment.remarks)]
    return lines


def _verdict_lines(assessment: "Assessment") -> "list[str | Table]":
    """Overall verdict, and each of its parts with its reasons; a reason of several parts once."""
    from railsim.assessment.criteria import WORDS

    if not assessment.verdict:
        return []
    deciding = getattr(assessment.limits, "deciding", ())
    lines: list[str | Table] = [f"verdict: {assessment.verdict}"]
    for name, verdict in assessment.verdicts.items():
        told = "" if name in deciding else " (for information)"
        lines.append(f"  {WORDS[name]}{told}: {verdict.value}")
    lines += [f"    {reason}" for reason in assessment.reasons]
    return lines


def _row(row: "Assessed") -> list[str]:
    estimate, shown = row.estimate, row.criterion.text
    value = shown(estimate.value)
    if row.uncorrected is not None:
        value += f" (uncorrected {shown(row.uncorrected.value)})"
    return [
        row.criterion.words, row.place, row.criterion.unit, str(estimate.N), shown(estimate.mean),
        shown(estimate.deviation), SHORT[estimate.method], value,
        "" if row.limit != row.limit else shown(row.limit),
        "" if row.limit != row.limit else f"{100.0 * row.share:.1f}",
    ]  # fmt: skip


def _comfort_lines(assessment: "Assessment") -> "list[str | Table]":
    lines: list[str | Table] = []
    for run, points in assessment.comfort.items():
        header = [run, "x (m)", "N_MV", "N_VA", "N_VD", "ISO a_v (m/s2)", "Wz lateral",
                  "Wz vertical", "P_CT standing (%)", "P_DE standing (%)"]  # fmt: skip
        rows = []
        for point in points:
            most = max((t.standing for t in point.transitions), default=None)
            total = float((point.iso_rms**2).sum() ** 0.5)
            rows.append([
                point.sensor, f"{point.place:.2f}", f"{point.mean.N_MV:.2f}",
                f"{point.mean.N_VA:.2f}", f"{point.mean.N_VD:.2f}", f"{total:.3f}",
                f"{point.sperling['lateral']:.2f}", f"{point.sperling['vertical']:.2f}",
                "" if most is None else f"{most:.1f}", f"{point.events['standing']:.1f}",
            ])  # fmt: skip
        lines += ["", text_table(header, rows)]
    return lines


def _wear_lines(assessment: "Assessment") -> "list[str | Table]":
    from railsim.assessment.wear import LAWS

    columns = [f"{law.name} (mm2/1000 km)" for law in LAWS.values()]
    lines: list[str | Table] = []
    for run, wheels in assessment.wear.items():
        header = [run, "T_gamma (N)", "95 %", "99.85 %", *columns, "WLRM (1e-6)",
                  "FI_surf"]  # fmt: skip
        rows = [
            [
                w.place, f"{w.T_gamma:.1f}", f"{w.percentiles['95']:.0f}",
                f"{w.percentiles['99.85']:.0f}",
                *("" if area is None else f"{1e12 * area:.2f}" for area in w.worn_area.values()),
                f"{1e6 * w.rail_damage:.2f}",
                "" if w.fatigue_index is None else f"{w.fatigue_index:.3f}",
            ]
            for w in wheels
        ]  # fmt: skip
        lines += ["", text_table(header, rows)]
    return lines


def _safety_lines(assessment: "Assessment") -> "list[str | Table]":
    lines: list[str | Table] = []
    for run, report in assessment.safety.items():
        header = [run, "Nadal", "largest Y/Q", "climb (m)", "rise (mm)"]
        rows = [
            [w.place, f"{w.limit:.3f}", "lifted" if w.Y_over_Q != w.Y_over_Q else
             f"{w.Y_over_Q:.3f}", f"{w.climb_distance:.2f}", f"{1e3 * w.rise:.2f}"]
            for w in report.wheels
        ]  # fmt: skip
        lines += ["", text_table(header, rows), ""]
        rows = [[name, f"{value:.3f}"] for name, value in report.overturning.items()]
        lines.append(text_table(["bogie", "overturning"], rows))
    return lines
