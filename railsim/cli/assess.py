"""``railsim assess``: results against the limits of a standard."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    DONE,
    LIMIT_EXCEEDED,
    Output,
    allow_code_option,
    as_speed,
    fail_option,
    flag,
    option,
    output_options,
)
from railsim.errors import Fault, Faults, InputError

if TYPE_CHECKING:
    from railsim.assessment import Assessment
    from railsim.definitions.vehicle.tables import Service
    from railsim.result import Result

STANDARDS = ("en14363", "uic518", "comfort", "wear", "safety")
SERVICE = ("admissible_speed", "cant_deficiency", "category")  # keys of the service table
FILES = (
    "assessment.json",
    "assessment.csv",
    "assessment.png",
    "assessment_sections.png",
    "assessment_regression.png",
)


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="R.h5|DIR ...")
@option("--standard", "What to assess.", kind=click.Choice(STANDARDS), default="en14363")
@option("--limits", "Limits file, or the name of a shipped one.", "F")
@option("--law", "Law of wear; by default all that need no constants.", "NAME_OR_FILE")
@option(
    "--method",
    "With wheel forces, or with accelerations only.",
    kind=click.Choice(["normal", "simplified"]),
    default="normal",
)
@option("--admissible-speed", "Admissible speed in m/s, instead of the vehicle's.", "V", as_speed)
@option("--cant-deficiency", "Admissible cant deficiency in m.", "I", float)
@option(
    "--category",
    "Category, instead of the vehicle's.",
    kind=click.Choice(["passenger", "freight", "locomotive", "multiple_unit"]),
)
@flag("--causal", "Causal filters, with phase, as in measuring amplifiers.")
@flag("--coarse", "Also accept results below 1000 samples per second.")
@flag("--all-sections", "Also use sections outside a zone's conditions.")
@fail_option
@output_options("Folder for assessment.json, .csv and .png.")
@allow_code_option
def command(files: tuple[str, ...], standard: str, fail: bool, output: Output, **how: Any) -> int:
    """Assess results: running behaviour, comfort, wear or derailment.

    Runs of one vehicle are assessed together, those of several vehicles one after the other; a
    folder means all results in it.  The verdict is "pass" only where all zones have enough
    sections within the standard's conditions.

    \b
    Example:
      railsim assess coach_manchester_curve_r500_29.h5
      railsim assess coach_manchester_curve_r500_29.h5 --standard comfort
    """
    from railsim.assessment import assess
    from railsim.assessment.tables import assessment_lines
    from railsim.cli.gathered import opened

    results = opened(_paths(files))
    output.reserve(*FILES)
    changes = {name: how.pop(name) for name in SERVICE}
    assessments = assess(results, standard, service=_service(results, changes), **how)
    write_assessments(output, assessments)
    lines = [line for one in assessments for line in assessment_lines(one, quiet=output.quiet)]
    output.answer([assessment.record() for assessment in assessments], lines)
    return LIMIT_EXCEEDED if fail and any(a.exceeded for a in assessments) else DONE


def _paths(files: Sequence[str]) -> list[Path]:
    """Paths of results; a folder stands for those in it."""
    faults, paths = Faults(), list[Path]()
    for file in files:
        inside = sorted(Path(file).glob("*.h5")) if os.path.isdir(file) else [Path(file)]
        if not inside:
            faults.append(Fault(file, "", "no results in this folder", "a folder with .h5 files"))
        paths += inside
    faults.check()
    return paths


def _service(results: "dict[str, Result]", options: dict[str, Any]) -> "Service | None":
    """Service table with options instead of the vehicles' values; None where there are none."""
    changes = {name: value for name, value in options.items() if value is not None}
    if not changes:
        return None
    from pydantic import ValidationError

    from railsim.definitions.vehicle.tables import Service

    service = next(iter(results.values())).vehicle().service
    try:
        return Service.model_validate({**(service.model_dump() if service else {}), **changes})
    except ValidationError as error:
        raise InputError(
            Fault(f"--{str(e['loc'][0]).replace('_', '-')}", "", e["msg"].lower(), "in SI units")
            for e in error.errors()
        ) from None


def write_assessments(output: Output, assessments: "Sequence[Assessment]") -> None:
    """Write the record, the table and the pictures."""
    if output.folder is None:
        return
    from railsim.assessment.tables import assessment_csv
    from railsim.plot.assessment import assessment_figure, regression_figure, sections_figure

    record, rows, *pictures = FILES
    output.write(record, [assessment.record() for assessment in assessments])
    output.write(rows, assessment_csv(assessments))
    draw = (assessment_figure, sections_figure, regression_figure)
    for name, figure in zip(pictures, (one(assessments) for one in draw), strict=True):
        if figure is not None:
            output.write(name, figure)
