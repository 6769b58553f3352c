"""``railsim study``: every combination of vehicles, tracks and speeds."""

from collections.abc import Callable, Sequence
from contextlib import chdir, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.cli.progress import RunLines
from railsim.cli.terminal import echo, show
from railsim.errors import Fault, Faults
from railsim.processes import begin_server

if TYPE_CHECKING:
    from railsim.studies.spec import StudySpec

MANY = ("--vehicles", "--tracks", "--speeds", "--grid")
OF_FILE = ("vehicles", "tracks", "speeds", "grid", "settings", "start", "duration", "until")
STORED = ("keep", "compress", "single")
OF_SCENARIO = ("file", *OF_FILE[1:], "quantities", "plots", *STORED)


class ManyValues(click.Command):
    """A command some of whose options take all the values that follow them."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Write such an option before each of its values, as click wants it."""
        return super().parse_args(ctx, spread(args))


def spread(args: list[str]) -> list[str]:
    """Return arguments with every option of `MANY` repeated before each of its values.

    >>> spread(["--speeds", "10", "-5", "--out", "d"])
    ['--speeds', '10', '--speeds', '-5', '--out', 'd']
    """
    found: list[str] = []
    option = ""
    for arg in args:
        if arg in MANY:
            option = arg
        elif arg.startswith("-") and not _is_number(arg):
            option = ""
            found.append(arg)
        else:
            found.extend([option, arg] if option else [arg])
    return found


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@click.command(cls=ManyValues)
@click.argument("file", required=False, metavar="[STUDY]", shell_complete=cli.names_of("study"))
@cli.repeated("--vehicles", "Files or names.", "F...", shell_complete=cli.names_of("vehicle"))
@cli.repeated("--tracks", "Files or names.", "F...", shell_complete=cli.names_of("track"))
@cli.repeated("--speeds", "In m/s, or with a unit; first:last:number; or `permitted`.", "V...")
@cli.repeated("--grid", "Values of a further key, or first:last:number.", "KEY.PATH=A,B,C...")
@cli.extent_options
@cli.option("--quantities", "Function of each result: further numbers.", "FILE.py:FUNCTION")
@cli.option("--scenario", "Scenario instead of tracks and speeds.", "F")
@cli.option("--out", "Folder.", "DIR", default="study")
@cli.given_options()
@cli.workers_option
@cli.scheduler_option
@cli.flag("--resume", "Continue the study in DIR; compute what has changed.")
@cli.option("--keep", "all; summary: no result files; or quantities: Q,Y.", "WHAT", default="all")
@cli.flag("--compress", "Store arrays compressed, without loss.")
@cli.flag("--single", "Store arrays with 4 bytes a number: 7 digits.")
@cli.flag("--plots", "Plot every run; where results are kept also vehicles against each other.")
@cli.flag("--report", "Write report.html into DIR, see `railsim report`.")
@cli.output_options()
@cli.code_options
def command(
    file: str | None,
    scenario: str | None,
    given: cli.Given,
    output: cli.Output,
    report: bool,
    resume: bool,
    quantities: str | None,
    **how: Any,
) -> int:
    """Run every combination of vehicles, tracks, speeds and the values of a grid.

    They are given as options or by a STUDY file, which can also link and sample values; keys of
    --grid and --set begin with vehicle., track. or settings.

    DIR receives one HDF5 file per run, summary.csv and study.json.  A finished run with the
    same inputs is not computed again, so the same command can be repeated after an interruption.
    --resume alone continues the study in DIR; --quantities must be given again.

    \b
    Example:
      railsim study --vehicles coach_manchester --tracks curve_r250 curve_r500 \\
          --speeds 15 20 --out curves --plots
      railsim study --vehicles coach_manchester --tracks curve_r250 --speeds 20 \\
          --grid track.friction=0.3,0.4,0.5 --out friction
      railsim study --vehicles coach_manchester --tracks curve_r250 --speeds 20 \\
          --grid vehicle.bodies.carbody.mass=36e3,40e3,44e3,48e3 --out mass
      railsim study curving_reference --out reference --report
      railsim study --scenario en14363 --vehicles coach_manchester --out campaign
    """
    storage = {name: how.pop(name) for name in STORED}
    values = {name: how.pop(name) for name in OF_FILE if name != "settings"}
    where = {name: how[name] for name in ("workers", "scheduler")}
    campaign: Callable[..., int] = partial(_campaign, report=report, **where)
    if scenario is not None:
        overrides = given.overrides
        return campaign(scenario, values["vehicles"], output, assignments=overrides, resume=resume)
    folder, base = Path(str(output.out)), Path.cwd()
    done = not output.overwrite and (folder / "study.json").exists()
    if not done and how["workers"] != 1 and how["scheduler"] is None:
        begin_server()  # which imports on another core while this process does
    from railsim.studies.plan import faults_of_file
    from railsim.studies.spec import Execution
    from railsim.studies.study import run_study, stored_spec
    from railsim.studies.user_function import function_to_resume

    inputs = {**values, "grid": _grid(values["grid"]), "start": values["start"] or 0.0}
    inputs |= {"assignments": given.overrides, "settings": given.settings}
    if resume and file is None and not any(inputs.values()):
        spec, base = stored_spec(folder)
        spec = spec.changed(quantities=function_to_resume(spec.quantities, quantities))
        folder = folder if base == Path.cwd() else folder.absolute()
        if spec.scenario is not None:
            resumed = {"assignments": tuple(spec.assignments), "resume": True}
            with chdir(base):
                resumed_output = replace(output, out=str(folder))
                return campaign(spec.scenario, spec.vehicles, resumed_output, **resumed)
    else:
        spec = _spec(file, inputs, quantities, storage, output)
    lines = RunLines()
    # names of files in a study that goes on count from where it was started
    file_faults = faults_of_file(file, assignments=not given.overrides) if file else nullcontext()
    with chdir(base), file_faults, output.studying("study") as studying:
        on_record = None if output.quiet or output.as_json else lines
        beside = ("report.html",) * report
        how |= {"resume": resume, "on_record": on_record, "further_files": beside, **studying}
        outcome = run_study(spec, folder, Execution(**how))
        if report:
            from railsim.report.write import write_report

            output.written.append(outcome.folder / "report.html")
            write_report([outcome.folder], output.written[0], overwrite=True)
    if not output.as_json:
        lines.end()
        for key in () if output.quiet else outcome.without_effect():
            echo(f"remark: {key} changes no peak of any run")
        kept_runs = len(outcome.records) - outcome.computed
        present = f", {kept_runs} were there already" if kept_runs else ""
        computed = outcome.computed - len(outcome.failed)
        echo(f"{computed} of {len(outcome.records)} runs computed{present}")
        if outcome.failed:
            echo(f"{len(outcome.failed)} failed; study.json holds the reasons", err=True)
        echo(str(outcome.folder / "summary.csv"))
    output.answer({"folder": str(outcome.folder), "runs": list(outcome.records)})
    if outcome.failed:
        return cli.FAILED
    return cli.ENDED_EARLY if outcome.ended_early else cli.DONE


def _grid(texts: Sequence[str]) -> dict[str, list[str]]:
    from railsim.studies.plan import parse_grid

    faults, grid = Faults(), dict[str, list[str]]()
    for text in texts:
        with faults.caught():
            key, values = parse_grid(text)
            grid.setdefault(key, []).extend(values)
    faults.check()
    return grid


def _campaign(
    scenario: str, vehicles: Sequence[str], output: cli.Output, *, report: bool, **how: Any
) -> int:
    """Run a scenario for vehicles, print and write its assessment; return the exit status.

    `report`: write the page too; `how`: assignments, workers, scheduler, resume of
    `railsim.studies.campaign`.
    """
    from railsim.assessment.tables import assessment_lines
    from railsim.cli.assess import FILES, write_assessments
    from railsim.studies.campaign import campaign

    found, allowed = "given together with --scenario", "the scenario's file holds it"
    faults = cli.refusals(found, allowed, *OF_SCENARIO)
    if not vehicles:
        faults.append(Fault("--vehicles", "", "not given", "give one vehicle at least"))
    faults.check()
    lines = RunLines()
    how["on_record"] = None if output.quiet or output.as_json else lines
    how["further_files"] = *FILES, *("report.html",) * report
    with output.studying(scenario) as studying:
        outcome = campaign(scenario, list(vehicles), out=str(output.out), **studying, **how)
    write_assessments(output, outcome.assessments)
    if report:
        from railsim.report.write import write_report

        page, assessments = Path(outcome.folder, "report.html"), outcome.assessments
        write_report([outcome.folder], page, assessments=assessments, overwrite=True)
        output.written.append(page)
    if not output.as_json:
        lines.end(remarks=False)  # the assessments repeat them
        for assessment in outcome.assessments:
            show("", *assessment_lines(assessment, quiet=output.quiet))
    records = [assessment.record() for assessment in outcome.assessments]
    output.answer({"folder": str(outcome.folder), "assessments": records})
    ended = any(result.status != "complete" for result in outcome.results.values())
    return cli.ENDED_EARLY if ended else cli.DONE


def _spec(
    file: str | None,
    inputs: dict[str, Any],
    quantities: str | None,
    storage: dict[str, Any],
    output: cli.Output,
) -> "StudySpec":
    """Return the study of the options, or of a file with the assignments of the options."""
    from railsim.definitions.loading import load_study
    from railsim.studies.spec import StudySpec, validated
    from railsim.studies.user_function import full_name

    if file is None:
        missing = [name for name in OF_FILE[:3] if not inputs[name]]
        words = "not given", "give one value at least"
        Faults(Fault(f"--{name}", "", *words) for name in missing).check()
        function = {"quantities": full_name(quantities)}
        return validated(StudySpec, {**storage, **inputs, **function}, "study")
    cli.refusals("given together with a study file", "the file holds it", *OF_FILE).check()
    study = load_study(file)
    if study.optimise is not None:
        output.remark("the table 'optimise' is not used here; `railsim optimise` varies its keys")
    assignments = [*study.assignments, *inputs["assignments"]]
    function = {"quantities": full_name(quantities)}
    return StudySpec.of_file(study, assignments=assignments, **function, **storage)
