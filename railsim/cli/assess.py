"""``railsim assess``: results against the limits of a standard."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.errors import Fault, Faults, InputError, changed_faults, listed

if TYPE_CHECKING:
    from railsim.assessment import Assessment
    from railsim.definitions.vehicle.tables import Service
    from railsim.result import Result

STANDARDS = "en14363|uic518|comfort|wear|safety"
CATEGORIES = "passenger|freight|locomotive|multiple_unit"
ENDINGS = (".json", ".csv", ".png", "_sections.png", "_regression.png")
FILES = [f"assessment{ending}" for ending in ENDINGS]


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="R.h5|DIR ...")
@cli.choice("--standard", "What to assess.", STANDARDS)
@cli.option("--limits", "Limits file, or the name of a shipped one.", "F")
@cli.option("--law", "Law of wear; by default all that need no constants.", "NAME_OR_FILE")
@cli.choice("--method", "With wheel forces, or with accelerations only.", "normal|simplified")
@cli.option("--admissible-speed", "Speed in m/s, instead of the vehicle's.", "V", cli.as_speed)
@cli.option("--cant-deficiency", "Admissible cant deficiency in m.", "I", float)
@cli.choice("--category", "Instead of the vehicle's.", CATEGORIES, default=None)
@cli.flag("--causal", "Causal filters, with phase, as in measuring amplifiers.")
@cli.flag("--coarse", "Also accept results below 1000 samples per second.")
@cli.option("--sections", "File of test sections, instead of those cut from the track.", "F")
@cli.flag("--all-sections", "Also use sections outside a zone's conditions.")
@cli.fail_option
@cli.output_options("Folder for assessment.json, .csv and .png.")
@cli.allow_code_option
def command(
    files: tuple[str, ...], standard: str, fail: bool, output: cli.Output, **how: Any
) -> int:
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
    from railsim.assessment.assess import check_options
    from railsim.assessment.record import RUNNING
    from railsim.assessment.running import OF_LIMITS, by_vehicle
    from railsim.assessment.tables import assessment_lines
    from railsim.studies.gathered import open_results, runs_without_file

    results = open_results(_paths(files))
    for file in files:
        try:
            missing = runs_without_file(Path(file))
        except (InputError, OSError) as error:
            output.remark(f"runs without a result file are not named: {error}")
        else:
            if missing:
                output.remark(f"no result file in {file} of {len(missing)} runs: {listed(missing)}")
    output.reserve(*FILES)
    changes = {name: how.pop(name) for name in OF_LIMITS}
    check_options(standard, **changes)
    assessments = [
        one
        for runs in by_vehicle(results, loads=standard in RUNNING)
        for one in assess(runs, standard, service=_service(runs, changes), **how)
    ]
    write_assessments(output, assessments)
    lines = [line for one in assessments for line in assessment_lines(one, quiet=output.quiet)]
    output.answer([assessment.record() for assessment in assessments], lines)
    return cli.LIMIT_EXCEEDED if fail and any(a.exceeded for a in assessments) else cli.DONE


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
    """A vehicle's service table with options instead of its values; None where there are none."""
    changes = {name: value for name, value in options.items() if value is not None}
    if not changes:
        return None
    from railsim.assessment.running import common_service
    from railsim.definitions.vehicle.tables import Service
    from railsim.studies.spec import validated

    def option_fault(fault: Fault) -> Fault:
        found = f"found {changes.get(fault.key, 'nothing')}"
        option = f"--{fault.key.replace('_', '-')}"
        return Fault(option, "", found, f"{fault.allowed}, in SI units")

    service = common_service(results, changes)
    with changed_faults(option_fault):
        return validated(Service, {**(service.model_dump() if service else {}), **changes}, "")


def write_assessments(output: cli.Output, assessments: "Sequence[Assessment]") -> None:
    """Write the record, the table and the pictures."""
    if output.folder is None:
        return
    from railsim.assessment.tables import assessment_csv
    from railsim.plot.assessment import assessment_figure, regression_figure, sections_figure

    draw = (assessment_figure, sections_figure, regression_figure)
    content: list[Any] = [[one.record() for one in assessments], assessment_csv(assessments)]
    for name, one in zip(FILES, [*content, *(of(assessments) for of in draw)], strict=True):
        if one is not None:
            output.write(name, one)
