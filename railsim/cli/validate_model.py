"""``railsim validate-model``: simulated against measured runs."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from railsim.cli import common as cli
from railsim.errors import input_error
from railsim.files.access import RESULTS

if TYPE_CHECKING:
    from railsim.measurement import Measurement
    from railsim.result import Result

FILES = ("model_validation.json", "sections.csv", "report.html", "scatter.png", "overlays.png")


@click.command(name="validate-model")
@click.argument("files", nargs=-1, required=True, metavar="MEASURED.toml ... [RESULT.h5|DIR ...]")
@cli.option("--vehicle", "Default: the measurement's.", "F", shell_complete=cli.names_of("vehicle"))
@cli.option("--limits", "Of the differences: file or name.", "F", default="validation_en14363_t")
@cli.fail_option
@cli.output_options("Folder for JSON, CSV, pictures and a page.")
@cli.code_options
def command(
    files: tuple[str, ...], vehicle: str | None, limits: str, fail: bool, output: cli.Output
) -> int:
    """Compare simulated with measured runs, section by section (EN 14363, Annex T).

    One result for each measured run, in the same order; or a folder of results named like the
    measurement files; or a study, of which the run on the same track at the same speed and load is
    taken for each.  Without results the runs are simulated.

    \b
    Example:
      railsim validate-model run12.toml run12.h5 --out comparison
      railsim validate-model run12.toml run13.toml study/
    """
    from railsim.assessment.model_validation import inputs, validate_model

    output.reserve(*FILES)
    names = [f for f in files if not (os.path.isdir(f) or Path(f).suffix.lower() in RESULTS)]
    if not names:
        raise input_error("MEASURED.toml", "none given", "a measurement file for each run")
    runs, model_limits = inputs(names, limits)  # before anything is simulated
    results = _results(names, runs, [f for f in files if f not in names], vehicle)
    found = validate_model(runs, results, limits=model_limits)
    if output.folder:
        from railsim.report.measured import measured_page, validation_figures, validation_part

        figures, page = validation_figures(found), measured_page([validation_part(found)])
        pictures = figures["scatter"], figures["overlays"]
        content = found.record(), found.section_table(), page, *pictures
        output.write_all(dict(zip(FILES, content, strict=True)))
    verdict = f"{found.vehicle} against {', '.join(found.runs)}: {found.verdict}"
    output.answer(found.record(), [verdict, found.table()], found.remarks)
    return cli.LIMIT_EXCEEDED if fail and found.verdict == "fail" else cli.DONE


def _results(
    names: list[str], runs: "list[Measurement]", files: list[str], vehicle: str | None
) -> "list[Result]":
    """Return the results that belong to measured runs; simulated where none are given."""
    from railsim.result import open_run

    if not files:
        from railsim.identification.runs import simulated_run

        return [simulated_run(run, vehicle) for run in runs]
    if vehicle is not None:
        raise input_error("--vehicle", "given together with results", "leave one out")
    if len(files) > 1 or not os.path.isdir(files[0]):
        return [open_run(Path(file)) for file in files]
    paths = [Path(files[0]) / f"{Path(name).stem}.h5" for name in names]
    if all(path.is_file() for path in paths):
        return [open_run(path) for path in paths]
    from railsim.assessment.model_validation import matched_results
    from railsim.studies.gathered import gather

    gathered = gather(files)
    return matched_results(runs, gathered.results(list(gathered.paths)))
