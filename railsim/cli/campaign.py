"""``railsim study --scenario``: a campaign of runs that ends in its assessment."""

from pathlib import Path

from railsim.cli.common import echo, print_json
from railsim.cli.progress import RunLines, progress_bar


def run_campaign(
    scenario: str,
    vehicles: tuple[str, ...],
    out: str,
    *,
    assignments: tuple[str, ...],
    workers: int | None,
    scheduler: str | None,
    resume: bool,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
    report: bool = False,
) -> int:
    """Run a scenario for vehicles, print and write its assessment; return the exit status."""
    from railsim.cli import DONE
    from railsim.cli.assess import show_assessment, write_assessments
    from railsim.errors import Fault, InputError
    from railsim.studies.campaign import campaign

    if not vehicles:
        raise InputError([Fault("--vehicles", "", "not given", "give one vehicle at least")])

    lines = RunLines()
    with progress_bar(scenario, quiet=quiet) as progress:
        done = campaign(
            scenario, list(vehicles), out=out, assignments=assignments, workers=workers,
            scheduler=scheduler, resume=resume, overwrite=overwrite, progress=progress,
            on_record=None if quiet or as_json else lines,
            on_remark=lambda text: echo(f"remark: {text}", err=True),
        )  # fmt: skip
    written = write_assessments(Path(out), done.assessments)
    if report:
        from railsim.cli.report import write_report

        page = Path(out) / "report.html"
        write_report([out], page, assessments=done.assessments)
        written.append(page)
    if as_json:
        print_json({
            "folder": str(done.folder),
            "assessments": [assessment.record() for assessment in done.assessments],
        })  # fmt: skip
        return DONE
    lines.end(remarks=False)  # the assessments repeat them
    for assessment in done.assessments:
        echo()
        show_assessment(assessment, quiet=quiet)
    for path in written:
        echo(str(path))
    return DONE
