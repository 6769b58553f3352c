"""``railsim run``: one vehicle on one track at one speed."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    Speed,
    code_options,
    json_option,
    load_option,
    names_of,
    overwrite_option,
    print_json,
    quiet_option,
    set_option,
    show,
    with_load,
)
from railsim.cli.progress import progress_bar

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from railsim.compare import Comparison
    from railsim.result import Result
    from railsim.studies.case import Case
    from railsim.table import Table


MOST_CURVES = 3  # with a table each; more are listed, one line each


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=names_of("vehicle"))
@click.argument("track", metavar="TRACK", shell_complete=names_of("track"))
@click.option("--speed", type=Speed(), metavar="V", help="Speed in m/s, or with a unit: 72km/h.")
@click.option("--out", metavar="R.h5", help="Result file; default VEHICLE_TRACK_SPEED.h5.")
@click.option("--start", type=float, metavar="S", help="Start in m along the track; default 0.")
@click.option("--duration", type=float, metavar="T", help="Length of the run in s.")
@click.option("--until", type=float, metavar="S", help="End of the run in m along the track.")
@click.option(
    "--continue", "before", metavar="R.h5", help="Begin where this result of the same inputs ended."
)
@load_option
@click.option("--settings", metavar="F", help="Settings file.")
@set_option
@overwrite_option
@click.option(
    "--plots",
    is_flag=True,
    help="Also plot the result; the picture is written next to the file (.png).",
)
@click.option("--check-step", is_flag=True, help="Run again at half the step and compare peaks.")
@json_option
@quiet_option
@code_options
def command(
    vehicle: str,
    track: str,
    speed: float | None,
    out: str | None,
    start: float | None,
    duration: float | None,
    until: float | None,
    before: str | None,
    load: str | None,
    settings: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    plots: bool,
    check_step: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Simulate one vehicle on one track and print the peak values.

    VEHICLE and TRACK are files or names of shipped files.  The run ends with the track unless
    --duration or --until says otherwise.  Paths of --set begin with vehicle., track. or settings.
    The speed is not needed with --continue, or where the settings have a speed table.

    \b
    Example:
      railsim run coach_manchester curve_r250 --speed 20 --overwrite
      railsim run my_coach.toml curve_r250 --speed 20 --set track.friction=0.3 --out dry.h5
      railsim run coach_manchester curve_r250 --speed 20 --check-step --overwrite
    """  # noqa: D301 - click reads the escape
    from railsim.cli import DONE, ENDED_EARLY
    from railsim.definitions.track.layout import track_remarks
    from railsim.result.facts import run_facts
    from railsim.simulation.assumptions import assumptions
    from railsim.studies.run import run_case

    assignments = with_load(assignments, load, "vehicle.")
    how = {"settings": settings, "duration": duration, "until": until, "assignments": assignments}
    resume = _opened(before, {"--speed": speed, "--start": start}) if before else None
    if resume:
        end = resume.groups["state"]["end"]
        speed, start = float(end[-1]), float(end[-2])
    how["start"] = start or 0.0
    case, path = _checked((vehicle, track, speed), how, out, plots, overwrite)
    if not (quiet or as_json):
        show(*assumptions(case.vehicle, case.track, case.settings, case.speed))
    with progress_bar(case.name, quiet=quiet) as progress:
        result = run_case(case, path, overwrite=overwrite, progress=progress, resume=resume)
    record = {"file": str(path), **run_facts(result)}
    parts = _report(result, path, [f"{track}: {remark}" for remark in track_remarks(case.track)])
    if plots and len(result["time"]):
        from railsim.plot.histories import histories
        from railsim.plot.style import save

        parts.append(str(save(histories(result), path.with_suffix(".png"), overwrite=overwrite)))
    if check_step and len(result["time"]):
        from railsim.simulation.check_step import difference_record, half_step, step_differences

        with progress_bar("half the step", quiet=quiet) as progress:
            half = half_step(result, progress=progress)
        differences = step_differences(result, half)
        record["half_step"] = [difference_record(row) for row in differences]
        parts += ["", _step_table(result, differences)]
    if as_json:
        print_json(record)
    else:
        show(*parts)
    return DONE if result.status == "complete" else ENDED_EARLY


def _opened(before: str, given: "Mapping[str, float | None]") -> "Result":
    """Open a result to go on from, which gives speed and position itself."""
    from railsim.errors import Fault, InputError
    from railsim.result import open_run

    faults = [
        Fault(option, "", "given together with --continue", "one of the two")
        for option, value in given.items()
        if value is not None
    ]
    result = None
    try:
        result = open_run(before)
        if "end" not in result.groups.get("state", {}):
            faults.append(Fault("--continue", "", f"{before} holds no state", "run it again first"))
    except InputError as error:
        faults.extend(error.faults)
    if faults or result is None:
        raise InputError(faults)
    return result


def _checked(
    what: tuple[str, str, float | None],
    how: dict[str, Any],
    out: str | None,
    plots: bool,
    overwrite: bool,
) -> "tuple[Case, Path]":
    """Load the case and settle its file; everything that is wrong with either at once."""
    from railsim.errors import Fault, InputError
    from railsim.files.access import PICTURES, RESULTS, check_file
    from railsim.studies.case import load_case
    from railsim.studies.spec import RunSpec

    faults: list[Fault] = []
    case = None
    try:
        case = load_case(RunSpec(*what, **how))
    except InputError as error:
        faults.extend(error.faults)
    name = out or (case.file_name if case else None)
    if name:
        path = Path(name)
        targets: list[tuple[Path, Sequence[str]]] = [(path, RESULTS)]
        if plots and path.name:
            targets.append((path.with_suffix(".png"), PICTURES))
        for target, endings in targets:
            try:
                check_file(target, overwrite=overwrite, endings=endings)
            except InputError as error:
                faults.extend(error.faults)
    if faults or case is None or name is None:
        raise InputError(faults)
    return case, Path(name)


def _report(result: "Result", path: Path, remarks: list[str]) -> "list[str | Table]":
    """Return how the run ended, its peaks and its values in curves."""
    from railsim.result import mid_curves
    from railsim.result.tables import full_curve_table, full_curves_table, peak_table

    facts = result.attributes
    end = f"{result.status}: {facts['status_reason']}"
    if len(result["time"]):
        end += f"; t = {result['time'][-1]:.2f} s, s = {result['distance'][-1]:.1f} m"
    else:
        end += "; at its start, before the first instant was recorded"
    parts: list[str | Table] = [
        f"  {end}",
        f"  step {1e3 * float(facts['step']):.4g} ms; {facts['cpu_time']:.2f} s of CPU time in the "
        f"loop, {facts['real_time_factor']:.0f} x real time; {facts['wall_time']:.1f} s altogether",
        *(f"  remark: {remark}" for remark in (*remarks, *result.remarks)),
        "",
    ]
    if len(result["time"]):
        parts.append(peak_table(result))
    curves = mid_curves(result)
    if len(curves) > MOST_CURVES:
        parts += ["", full_curves_table(result, curves)]
    else:
        for curve in curves:
            parts += ["", full_curve_table(result, curve)]
    return [*parts, "", str(path)]


def _step_table(result: "Result", differences: "Sequence[Comparison]") -> "Table":
    """Return what half the step changes."""
    from railsim.simulation.check_step import FULL, HALF
    from railsim.table import Amount, Column, Table

    step = float(result.attributes["step"])
    rows = []
    for row in differences:
        full, half = row.peaks[FULL].value, row.peaks[HALF].value
        column = Column.of(row.quantity)
        changed = Amount(full - half, replace(column, format="+.2g"))
        relative = Amount(row.differences[FULL], Column("", unit="%", format="+.2g"))
        rows.append([row.quantity.words, row.where, Amount(full, column), changed, relative])
    columns = [
        Column("quantity", f"Check of the step, {1e3 * step:.4g} ms"),
        Column("where", " "),
        Column("value", format=">"),
        Column("change", "less that at half", format=">"),
        Column("share", "%", format=">"),
    ]
    return Table(columns, rows)
