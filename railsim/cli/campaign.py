"""``railsim study --scenario``: a campaign of runs that ends in its assessment."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from railsim.cli.common import show
from railsim.cli.output import Output
from railsim.cli.progress import RunLines, progress_bar


def run_campaign(
    scenario: str,
    vehicles: Sequence[str],
    output: Output,
    *,
    taken: Sequence[str],
    report: bool,
    **how: Any,
) -> int:
    """Run a scenario for vehicles, print and write its assessment; return the exit status.

    `taken`: options and arguments that are given although the scenario, which knows its tracks and
    speeds, holds them; `report`: write the page too; `how`: assignments, workers, scheduler, resume
    of `railsim.studies.campaign`.
    """
    from railsim.assessment.tables import assessment_lines
    from railsim.cli import DONE
    from railsim.cli.assess import write_assessments
    from railsim.errors import Fault, Faults
    from railsim.studies.campaign import campaign

    faults = Faults(
        Fault(
            name if name.isupper() else f"--{name}",
            "",
            "given together with --scenario",
            "the scenario's file holds it",
        )
        for name in taken
    )
    if not vehicles:
        faults.append(Fault("--vehicles", "", "not given", "give one vehicle at least"))
    faults.check()
    lines = RunLines()
    with progress_bar(scenario, quiet=output.quiet) as progress:
        done = campaign(
            scenario,
            list(vehicles),
            out=str(output.out),
            overwrite=output.overwrite,
            progress=progress,
            on_record=None if output.quiet or output.as_json else lines,
            on_remark=output.remark,
            **how,
        )
    write_assessments(output, done.assessments)
    if report:
        from railsim.cli.report import write_report

        page = Path(done.folder, "report.html")
        write_report([str(done.folder)], page, assessments=done.assessments)
        output.written.append(page)
    if not output.as_json:
        lines.end(remarks=False)  # the assessments repeat them
        for assessment in done.assessments:
            show("", *assessment_lines(assessment, quiet=output.quiet))
    records = [assessment.record() for assessment in done.assessments]
    output.answer({"folder": str(done.folder), "assessments": records})
    return DONE
