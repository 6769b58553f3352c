"""``railsim assess``: results against the limits of a standard."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import Speed, allow_code_option, echo, output_options, print_json, show
from railsim.files.access import check_folder, make_folder, whole_file
from railsim.text import counted_remarks, spreadsheet_cell

if TYPE_CHECKING:
    from collections.abc import Sequence

    from railsim.assessment import Assessment
    from railsim.definitions.vehicle.tables import Service
    from railsim.result import Result

STANDARDS = ("en14363", "uic518", "comfort", "wear", "safety")
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
    "--law", metavar="NAME_OR_FILE", help="Law of wear; by default all that need no constants."
)
@click.option(
    "--method", type=click.Choice(["normal", "simplified"]), default="normal", show_default=True,
    help="With wheel forces, or with accelerations only.",
)  # fmt: skip
@click.option(
    "--admissible-speed",
    type=Speed(),
    metavar="V",
    help="Admissible speed in m/s, instead of the vehicle's.",
)
@click.option("--cant-deficiency", type=float, metavar="I", help="Admissible cant deficiency in m.")
@click.option(
    "--category", type=click.Choice(["passenger", "freight", "locomotive", "multiple_unit"]),
    help="Category, instead of the vehicle's.",
)  # fmt: skip
@click.option(
    "--causal", is_flag=True, help="Causal filters, with phase, as in measuring amplifiers."
)
@click.option("--coarse", is_flag=True, help="Also accept results below 1000 samples per second.")
@click.option("--all-sections", is_flag=True, help="Also use sections outside a zone's conditions.")
@click.option("--fail", is_flag=True, help="Exit status 4 where a limit is exceeded.")
@click.option("--out", metavar="DIR", help="Folder for assessment.json, .csv and .png.")
@output_options
@allow_code_option
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
            show_assessment(assessment, quiet=quiet)
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
    changes = {
        name: value
        for name, value in (
            ("admissible_speed", speed), ("cant_deficiency", deficiency), ("category", category),
        )
        if value is not None
    }  # fmt: skip
    if not changes:
        return None
    from pydantic import ValidationError

    from railsim.definitions.vehicle.tables import Service
    from railsim.errors import Fault, InputError

    service = next(iter(results.values())).vehicle().service
    try:
        return Service.model_validate({**(service.model_dump() if service else {}), **changes})
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
    figures = (assessment_figure, sections_figure, regression_figure)
    for path, draw in zip(pictures, figures, strict=True):
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


def show_assessment(assessment: "Assessment", *, quiet: bool = False) -> None:
    """Print an assessment."""
    from railsim.assessment.tables import tables

    edition = f", {assessment.limits.edition}" if assessment.limits else ""
    runs = f"{len(assessment.runs)} run{'s' * (len(assessment.runs) > 1)}"
    show(f"{assessment.vehicle}{edition}, {runs}", *_verdict_lines(assessment))
    for table in tables(assessment):
        show("", table)
    if not quiet:
        notes = counted_remarks(("", remark) for remark in assessment.remarks)
        show("", *(f"note: {one}" for one in notes))


def _verdict_lines(assessment: "Assessment") -> list[str]:
    """Overall verdict, and each of its parts with its reasons; a reason of several parts once."""
    from railsim.assessment.criteria import WORDS

    if not assessment.verdict:
        return []
    deciding = getattr(assessment.limits, "deciding", ())
    lines = [f"verdict: {assessment.verdict}"]
    for name, verdict in assessment.verdicts.items():
        note = "" if name in deciding else " (for information)"
        lines.append(f"  {WORDS[name]}{note}: {verdict.value}")
    lines += [f"    {reason}" for reason in assessment.reasons]
    return lines
