"""``railsim run``: one vehicle on one track at one speed."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.cli.terminal import show
from railsim.errors import Fault, Faults, changed_faults
from railsim.files.access import PICTURES, RESULTS, check_file
from railsim.threads import keep_freed_memory

if TYPE_CHECKING:
    from railsim.result import Result
    from railsim.studies.case import Case
    from railsim.studies.spec import RunSpec


@click.command()
@cli.vehicle_argument
@cli.track_argument
@cli.option("--speed", "Speed in m/s, or with a unit: 72km/h.", "V", cli.as_speed)
@cli.option("--out", "Result file; default VEHICLE_TRACK_SPEED.h5.", "R.h5")
@cli.extent_options
@cli.option("--continue before", "Begin where this result of the same inputs ended.", "R.h5")
@cli.given_options()
@cli.flag("--plots", "Also plot the result; the picture is written next to the file (.png).")
@cli.flag("--check-step", "Run again at half the step and compare peaks.")
@cli.output_options()
@cli.code_options
def command(
    speed: float | None,
    before: str | None,
    plots: bool,
    check_step: bool,
    given: cli.Given,
    output: cli.Output,
    **extent: Any,
) -> int:
    """Simulate one vehicle on one track and print the peak values.

    VEHICLE and TRACK are files or names of shipped files.  The run ends with the track unless
    --duration or --until says otherwise.  Paths of --set begin with vehicle., track. or settings.
    The speed is not needed with --continue, or where the settings have a speed table.

    \b
    Example:
      railsim run coach_manchester curve_r250 --speed 20 --overwrite
      railsim run my_coach.toml curve_r250 --speed 20 --set track.friction=0.2 --out wet.h5
      railsim run coach_manchester curve_r250 --speed 20 --check-step --overwrite
    """
    from railsim.definitions.track.layout import track_remarks
    from railsim.result.extremes import run_facts
    from railsim.result.tables import result_parts
    from railsim.simulation.assumptions import assumptions
    from railsim.studies.case import run_case, settings_fault

    keep_freed_memory()
    resume = _open_for_continuation(before) if before else None
    if resume:
        *_, start, speed = map(float, resume.groups["state"]["end"])
        extent["start"] = start
    extent["start"] = extent["start"] or 0.0
    spec = given.run(speed, **extent)
    case, path = _load_case(spec, output, plots)
    quiet, overwrite = output.quiet, output.overwrite
    if not (quiet or output.as_json):
        show(*assumptions(case.vehicle, case.track, case.settings, case.speed))
    found = changed_faults(lambda fault: settings_fault(fault, spec))
    with output.progress(case.name) as progress, found:
        result = run_case(case, path, overwrite=overwrite, progress=progress, resume=resume)
    record: dict[str, Any] = {"file": str(path)}
    parts: list[Any] = []
    if output.as_json:
        record |= run_facts(result)
    else:
        of_track = [f"{given.track}: {remark}" for remark in track_remarks(case.track)]
        remarks = () if quiet else (*of_track, *result.remarks)
        parts = [*result_parts(result, remarks), "", str(path)]
    if plots and len(result["time"]):
        from railsim.plot.histories import histories
        from railsim.plot.style import save

        parts.append(str(save(histories(result), path.with_suffix(".png"), overwrite=overwrite)))
    if check_step and len(result["time"]):
        from railsim.simulation import check_step as by_halving

        with output.progress("half the step") as progress:
            half = by_halving.half_step(result, progress=progress)
        differences = by_halving.step_differences(result, half)
        record["half_step"] = [by_halving.difference_record(row) for row in differences]
        parts += ["", by_halving.step_table(result, differences)]
    output.answer(record, parts)
    return cli.DONE if result.status == "complete" else cli.ENDED_EARLY


def _open_for_continuation(before: str) -> "Result":
    """Open a result to go on from, which gives speed and position itself."""
    from railsim.result import open_run

    faults = cli.refusals("given together with --continue", "one of the two", "speed", "start")
    with faults.caught():
        result = open_run(before)
        if "end" not in result.groups.get("state", {}):
            faults.append(Fault("--continue", "", f"{before} holds no state", "run it again first"))
    faults.check()
    return result


def _load_case(spec: "RunSpec", output: cli.Output, plots: bool) -> "tuple[Case, Path]":
    """Load the case and settle its file; everything that is wrong with either at once."""
    from railsim.studies.case import load_case

    faults, name = Faults(), output.out
    with faults.caught():
        case = load_case(spec)
        name = name or case.file_name
    path = Path(name or "")
    if name:
        with faults.caught():
            check_file(path, overwrite=output.overwrite, endings=RESULTS)
    if plots and path.name:
        with faults.caught():
            check_file(path.with_suffix(".png"), overwrite=output.overwrite, endings=PICTURES)
    faults.check()
    return case, path
