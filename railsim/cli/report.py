"""``railsim report``: one self-contained page about results or studies."""

from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path
from typing import TYPE_CHECKING

import click

from railsim.cli import common as cli
from railsim.errors import RailsimError, listed
from railsim.files.access import folder_of, write_text

if TYPE_CHECKING:
    from railsim.assessment import Assessment
    from railsim.report.inputs import Inputs

ENDINGS = (".html", ".htm")


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="DIR_OR_FILES...")
@cli.option("--out", "Page.", "F.html", default="report.html")
@cli.option("--title", "Title; by default the names of what is reported.", "TEXT")
@cli.option("--curves", "Runs with curves, largest first.", "N", click.IntRange(1, 16), default=8)
@cli.output_options()
def command(files: tuple[str, ...], title: str | None, curves: int, output: cli.Output) -> None:
    """Write one self-contained page about results, studies, comparisons with tests.

    Inputs, peaks, values against limits, curves to zoom, spread over the varied parameters of a
    study, comparison with published values, failures and remarks; folders that `validate-model`,
    `identify`, `wear` and `rail-wear` have written are sections of it.  The page needs no network;
    it can be sent and printed.

    \b
    Example:
      railsim report curves --out report.html
      railsim report manchester.h5 flexicoil.h5 --out coaches.html --overwrite
    """
    path = output.file("", ENDINGS)
    write_report(files, path, title=title, curves=curves)
    output.wrote(path)


def write_report(
    files: Sequence[str],
    path: Path,
    *,
    title: str | None = None,
    curves: int = 8,
    assessments: "Sequence[Assessment]" = (),
) -> None:
    """Write the page about result files, folders of studies, comparisons with tests and wear.

    `assessments` are those of a scenario.
    """
    from railsim.report.measured import as_section, is_measured, measured_page, read_part
    from railsim.report.runs import page
    from railsim.report.spread import worst_runs
    from railsim.studies.gathered import gather

    parts = [read_part(file) for file in files if is_measured(file)]
    files = [file for file in files if not is_measured(file)]
    if not files:
        write_text(path, measured_page(parts, title))
        return
    found = gather(files)
    with_files = [record for record in found.records if record["name"] in found.paths]
    study = found.inputs.get("name")
    stems = list(dict.fromkeys(folder_of(file).resolve().stem for file in files))
    names = str(study) if study else listed(stems, 4)
    every = found.results([record["name"] for record in with_files])
    results = {name: every[name] for name in worst_runs(with_files, curves)}
    used = [] if results or not found.inputs else used_inputs(folder_of(files[0]))
    measured = [as_section(part, number) for number, part in enumerate(parts, start=1)]
    runs = found.records, results, found.remarks, every, found.inputs, used
    write_text(path, page(title or names, *runs, assessments, measured))


def used_inputs(folder: Path) -> "list[Inputs]":
    """Inputs of a study without results: the first run of each vehicle on each track.

    From the files as they are now; nothing where they are gone or no longer what they were.
    """
    from railsim.report.inputs import Inputs
    from railsim.studies.plan import Plan
    from railsim.studies.study import stored_spec

    try:
        spec, base = stored_spec(folder)
        with chdir(base):
            plan = Plan(spec)
            first = {(point.run.vehicle, point.run.track): point for point in reversed(plan.points)}
            cases = plan.cases(list(first.values())[::-1])
    except (RailsimError, OSError):
        return []
    found = []
    for case in cases:
        names = str(case.labels["vehicle"]), str(case.labels["track"])
        found.append(Inputs(*names, case.vehicle, case.track, case.settings, case.speed))
    return found
