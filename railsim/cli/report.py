"""``railsim report``: one self-contained page about results or studies."""

from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path
from typing import TYPE_CHECKING

import click

from railsim.cli.common import Output, option, output_options
from railsim.files.access import write_text

if TYPE_CHECKING:
    from railsim.assessment import Assessment
    from railsim.report.inputs import Used

ENDINGS = (".html", ".htm")


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="DIR_OR_FILES...")
@option("--out", "Page.", "F.html", default="report.html")
@option("--title", "Title; by default the names of what is reported.", "TEXT")
@option(
    "--curves",
    "Runs whose curves are shown; of more, those with the largest values.",
    "N",
    click.IntRange(min=1, max=16),
    default=8,
)
@output_options()
def command(files: tuple[str, ...], title: str | None, curves: int, output: Output) -> None:
    """Write one self-contained page about results, studies, comparisons with tests.

    Inputs, peaks, values against limits, curves to zoom, spread over the varied parameters of a
    study, comparison with published values, failures and remarks; folders that `validate-model`
    and `identify` have written are sections of it.  The page needs no network; it can be sent and
    printed.

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
    """Write the page about result files, folders of studies, and comparisons with tests.

    `assessments` are those of a scenario.
    """
    from railsim.cli.gathered import folder_of, gather
    from railsim.report.measured import as_section, is_measured, measured_page, read_part
    from railsim.report.runs import page
    from railsim.report.spread import worst_runs

    parts = [read_part(file) for file in files if is_measured(file)]
    files = [file for file in files if not is_measured(file)]
    if not files:
        write_text(path, measured_page(parts, title))
        return
    found = gather(files)
    with_files = [record for record in found.records if record["name"] in found.paths]
    results = found.results(worst_runs(with_files, curves))
    study = found.inputs.get("name")
    stems = dict.fromkeys(folder_of(file).resolve().stem for file in files[:4])
    names = str(study) if study else ", ".join(stems)
    more = f" and {len(files) - 4} more" if len(files) > 4 else ""
    every = found.results([record["name"] for record in with_files])
    used = [] if results or not found.inputs else _used(folder_of(files[0]))
    text = page(
        title or names + more,
        found.records,
        results,
        found.remarks,
        every,
        found.inputs,
        used,
        assessments,
        [as_section(part, number) for number, part in enumerate(parts, start=1)],
    )
    write_text(path, text)


def _used(folder: Path) -> "list[Used]":
    """Inputs of a study without results: the first run of each vehicle on each track.

    From the files as they are now; nothing where they are gone or no longer what they were.
    """
    from railsim.errors import RailsimError
    from railsim.report.inputs import Used
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
    return [
        Used(
            str(case.labels["vehicle"]),
            str(case.labels["track"]),
            case.vehicle,
            case.track,
            case.settings,
            case.speed,
        )
        for case in cases
    ]
