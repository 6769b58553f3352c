"""``railsim study``: every combination of vehicles, tracks and speeds."""

from contextlib import chdir
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    code_options,
    echo,
    json_option,
    load_option,
    names_of,
    overwrite_option,
    print_json,
    quiet_option,
    set_option,
    with_load,
)
from railsim.cli.progress import RunLines, progress_bar
from railsim.processes import begin_server

if TYPE_CHECKING:
    from railsim.studies import Outcome
    from railsim.studies.spec import StudySpec

OF_STUDY = ("settings", "start", "duration", "until", "quantities", "keep", "compress", "single")
MANY = ("--vehicles", "--tracks", "--speeds", "--grid")


class ManyValues(click.Command):
    """A command some of whose options take all the values that follow them."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Write such an option before each of its values, as click wants it."""
        return super().parse_args(ctx, spread(args))


def spread(args: list[str]) -> list[str]:
    """Return arguments with every option of `MANY` repeated before each of its values.

    Examples
    --------
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
@click.argument("file", required=False, metavar="[STUDY]", shell_complete=names_of("study"))
@click.option(
    "--vehicles",
    multiple=True,
    metavar="F...",
    help="Vehicles: files or names.",
    shell_complete=names_of("vehicle"),
)
@click.option(
    "--tracks",
    multiple=True,
    metavar="F...",
    help="Tracks: files or names.",
    shell_complete=names_of("track"),
)
@click.option(
    "--speeds",
    multiple=True,
    metavar="V...",
    help="Speeds in m/s, or with a unit (72km/h); ranges first:last:number; permitted: the lower "
    "of the vehicle's and the track's speed.",
)
@click.option(
    "--grid",
    "grids",
    multiple=True,
    metavar="KEY.PATH=A,B,C...",
    help="Values of further keys, or ranges first:last:number; paths begin with vehicle., track. "
    "or settings.",
)
@click.option(
    "--quantities",
    metavar="FILE.py:FUNCTION",
    help="Function called with each result; it returns further numbers by name.",
)
@click.option("--scenario", metavar="F", help="Scenario instead of tracks and speeds.")
@click.option("--out", default="study", metavar="DIR", show_default=True, help="Folder.")
@click.option(
    "--start", type=float, default=0.0, metavar="S", help="Start of all runs in m along the track."
)
@click.option("--duration", type=float, metavar="T", help="End of all runs in s.")
@click.option("--until", type=float, metavar="S", help="End of all runs in m along the track.")
@load_option
@click.option("--settings", metavar="F", help="Settings file for all runs.")
@set_option
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Number of processes; default: all cores.",
)
@click.option(
    "--together",
    type=click.IntRange(min=1),
    default=1,
    metavar="N",
    show_default=True,
    help="Up to N runs that differ in the vehicle only are computed in one call of the time loop: "
    "same results, 15 to 20 % less CPU time in the loop. Runs with different time steps are "
    "computed separately.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Address of a dask scheduler to run on.")
@click.option("--resume", is_flag=True, help="Continue the study in DIR; compute what has changed.")
@overwrite_option
@click.option(
    "--keep",
    default="all",
    show_default=True,
    metavar="WHAT",
    help="all; summary: no result files; or quantities such as Q,Y,wheelset_*.",
)
@click.option("--compress", is_flag=True, help="Store arrays compressed, without loss.")
@click.option("--single", is_flag=True, help="Store arrays with 4 bytes a number: 7 digits.")
@click.option("--plots", is_flag=True, help="Plot every run, and the vehicles against each other.")
@click.option("--report", is_flag=True, help="Write report.html into DIR, see `railsim report`.")
@json_option
@quiet_option
@code_options
def command(
    file: str | None,
    vehicles: tuple[str, ...],
    tracks: tuple[str, ...],
    speeds: tuple[str, ...],
    grids: tuple[str, ...],
    scenario: str | None,
    out: str,
    load: str | None,
    assignments: tuple[str, ...],
    resume: bool,
    report: bool,
    as_json: bool,
    quiet: bool,
    **how: Any,
) -> int:
    """Run every combination of vehicles, tracks, speeds and the values of a grid.

    They are given as options or by a STUDY file, which can also link and sample values.

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
          --grid vehicle.bodies.carbody.mass=36e3,40e3,44e3,48e3 --together 8 --out mass
      railsim study curving_reference --out reference --report
      railsim study --scenario en14363 --vehicles coach_manchester --out campaign
    """  # noqa: D301 - click reads the escape
    if scenario is not None:
        return _campaign(
            scenario,
            vehicles,
            (tracks, speeds, grids),
            out,
            with_load(assignments, load, "vehicle."),
            {**how, "report": report, "file": file},
            resume=resume,
            as_json=as_json,
            quiet=quiet,
        )
    done = not how["overwrite"] and Path(out, "study.json").exists()
    if not done and how["workers"] != 1 and how["scheduler"] is None:
        begin_server()  # which imports on another core while this process does
    from railsim.studies.spec import Execution
    from railsim.studies.study import run_study

    of_study = {name: how.pop(name) for name in OF_STUDY}
    inputs: dict[str, Any] = {
        "vehicles": list(vehicles),
        "tracks": list(tracks),
        "speeds": list(speeds),
        "grid": _grid(grids),
        "assignments": list(with_load(assignments, load, "vehicle.")),
        **{name: of_study[name] for name in ("settings", "start", "duration", "until")},
    }
    folder, base = Path(out), Path.cwd()
    if resume and file is None and not any(inputs.values()):
        spec, base = _stored(folder, of_study["quantities"])
        folder = folder if base == Path.cwd() else folder.absolute()
        if spec.scenario is not None:
            with chdir(base):
                return _campaign(
                    spec.scenario,
                    tuple(spec.vehicles),
                    ((),),
                    str(folder),
                    tuple(spec.assignments),
                    {**inputs, **of_study, **how, "report": report, "file": None},
                    resume=True,
                    as_json=as_json,
                    quiet=quiet,
                )
    else:
        spec = _asked(file, {**of_study, **inputs})
    lines = RunLines()
    execution = Execution(
        **how, resume=resume, on_record=None if quiet or as_json else lines, on_remark=_print_remark
    )
    # names of files in a study that goes on count from where it was started
    with chdir(base), progress_bar("study", quiet=quiet) as progress:
        outcome = run_study(spec, folder, replace(execution, progress=progress))
        page = _report(outcome) if report else None
    if as_json:
        print_json({"folder": str(outcome.folder), "runs": list(outcome.records)})
    else:
        lines.end()
        _print_end(outcome)
        if page is not None:
            echo(str(page))
    return _status(outcome)


def _stored(folder: Path, quantities: str | None) -> "tuple[StudySpec, Path]":
    """Return the study in a folder, and the folder of its relative file names."""
    from railsim.studies.study import stored_spec
    from railsim.studies.user_function import given_again

    spec, base = stored_spec(folder)
    return spec.changed(quantities=given_again(spec.quantities, quantities)), base


def _asked(file: str | None, inputs: dict[str, Any]) -> "StudySpec":
    """Return the study of the options, or of a file with the assignments of the options."""
    from railsim.definitions.loading import load_study
    from railsim.errors import Fault, InputError
    from railsim.studies.spec import StudySpec, checked
    from railsim.studies.user_function import full_name

    if file is None:
        _require(*(inputs[name] for name in ("vehicles", "tracks", "speeds")))
        inputs["quantities"] = full_name(inputs["quantities"])
        return checked(StudySpec, inputs, "study")
    both = ("vehicles", "tracks", "speeds", "grid", "settings", "start", "duration", "until")
    faults = [
        Fault(f"--{name}", "", "given together with a study file", "the file holds it")
        for name in both
        if inputs[name]
    ]
    if faults:
        raise InputError(faults)
    study = load_study(file)
    return StudySpec.of_file(
        study,
        assignments=[*study.assignments, *inputs["assignments"]],
        quantities=full_name(inputs["quantities"]),
        **{name: inputs[name] for name in ("keep", "compress", "single")},
    )


def _report(outcome: "Outcome") -> Path:
    from railsim.cli.report import write_report

    path = outcome.folder / "report.html"
    write_report([str(outcome.folder)], path)
    return path


def _campaign(
    scenario: str,
    vehicles: tuple[str, ...],
    others: tuple[tuple[Any, ...], ...],
    out: str,
    assignments: tuple[str, ...],
    how: dict[str, Any],
    *,
    resume: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Run a scenario, which knows its tracks and speeds itself."""
    from railsim.cli.campaign import run_campaign
    from railsim.errors import Fault, InputError

    taken = {"--tracks, --speeds, --grid": any(others)}
    refused = ["start", "duration", "until", "settings", "plots", "file", "quantities"]
    refused += ["compress", "single"]
    taken |= {f"--{n}": bool(how[n]) for n in refused}
    taken["--keep"] = how["keep"] != "all"
    faults = [
        Fault(option, "", "given together with --scenario", "the scenario's file holds it")
        for option, is_given in taken.items()
        if is_given
    ]
    if faults:
        raise InputError(faults)
    return run_campaign(
        scenario, vehicles, out, assignments=assignments, workers=how["workers"],
        scheduler=how["scheduler"], resume=resume, overwrite=how["overwrite"], as_json=as_json,
        quiet=quiet, report=how["report"],
    )  # fmt: skip


def _grid(texts: tuple[str, ...]) -> dict[str, list[str]]:
    from railsim.errors import Fault, InputError
    from railsim.studies.plan import parse_grid

    grid: dict[str, list[str]] = {}
    faults: list[Fault] = []
    for text in texts:
        try:
            key, values = parse_grid(text)
        except InputError as error:
            faults.extend(error.faults)
            continue
        grid.setdefault(key, []).extend(values)
    if faults:
        raise InputError(faults)
    return grid


def _require(vehicles: tuple[str, ...], tracks: tuple[str, ...], speeds: tuple[str, ...]) -> None:
    from railsim.errors import Fault, InputError

    inputs = {"--vehicles": vehicles, "--tracks": tracks, "--speeds": speeds}
    faults = [
        Fault(option, "", "not given", "give one value at least")
        for option, values in inputs.items()
        if not values
    ]
    if faults:
        raise InputError(faults)


def _print_remark(text: str) -> None:
    echo(f"remark: {text}", err=True)


def _print_end(outcome: "Outcome") -> None:
    there = len(outcome.records) - outcome.computed
    present = f", {there} were there already" if there else ""
    done = outcome.computed - len(outcome.failed)
    echo(f"{done} of {len(outcome.records)} runs computed{present}")
    if outcome.failed:
        echo(f"{len(outcome.failed)} failed; study.json holds the reasons", err=True)
    echo(str(outcome.folder / "summary.csv"))


def _status(outcome: "Outcome") -> int:
    from railsim.cli import DONE, ENDED_EARLY, FAILED

    if outcome.failed:
        return FAILED
    return ENDED_EARLY if outcome.ended_early else DONE
