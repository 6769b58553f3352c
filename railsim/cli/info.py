"""``railsim info``: what a vehicle, track, study or result file holds, on one screen."""

import os
from pathlib import Path
from typing import Any

import click

from railsim.cli import common as cli
from railsim.files.access import PICTURES, RESULTS, STUDY_FILES, check_file
from railsim.plottable import Plottable

DRAWN = "--draw is for vehicles and tracks"


@click.command()
@click.argument("file", metavar="F")
@cli.repeated("--speed speeds", "For the cant deficiency, m/s or with a unit.", "V", cli.as_speed)
@cli.flag("--static", "Also at rest, in each load case: wheel loads, heights, springs, stops.")
@cli.option("--track", "Rails and gauge for --static; default straight.", "F")
@cli.option("--draw", "Draw a vehicle in three views, or a track.", "F.png")
@cli.load_option
@cli.set_option
@cli.output_options()
def command(
    file: str,
    speeds: tuple[float, ...],
    static: bool,
    track: str | None,
    draw: str | None,
    load: str | None,
    assignments: tuple[str, ...],
    output: cli.Output,
) -> None:
    """Show what a vehicle, track, settings, study or result holds: a file, a name or a folder.

    \b
    Example:
      railsim info coach_manchester --draw coach.png --overwrite
      railsim info curve_r250 --speed 20 --speed 25
    """
    path = Path(file)
    result = path.suffix.lower() in RESULTS
    runs = os.path.isdir(file) or path.name in STUDY_FILES
    if draw is not None and (result or runs):
        raise click.UsageError(f"{DRAWN}; see `railsim plot`")
    cli.goes_with("--static", static, "track")
    cli.goes_with(
        "vehicles and tracks", not (result or runs), "assignments", "load", "speeds", "static"
    )
    remarks: list[Any] = []
    if runs:
        from railsim.studies.gathered import described_runs

        found = described_runs(file)
    elif result:
        from railsim.description import describe
        from railsim.result import open_result

        found = describe(open_result(file))
    else:
        from railsim.definitions import Track, Vehicle
        from railsim.definitions.loading import load_any, load_track
        from railsim.description import describe

        definition = load_any(file, [*assignments, *([f"load={load}"] if load else [])])
        cli.goes_with("vehicles", isinstance(definition, Vehicle), "static")
        cli.goes_with("tracks", isinstance(definition, Track), "speeds")
        if draw is not None:
            if not isinstance(definition, Plottable):
                raise click.UsageError(DRAWN)
            check_file(Path(draw), overwrite=output.overwrite, option="--draw", endings=PICTURES)
            definition.plot(draw, overwrite=output.overwrite)
        found = describe(definition, speeds)
        if static and isinstance(definition, Vehicle):
            from railsim.description import Description
            from railsim.description.rest import describe_statics

            rails = load_track(track) if track is not None else None
            rest = describe_statics(definition, [definition.load] if load else [], rails)
            chosen = rest.data[definition.load or "design"]
            data = {**found.data, "static": chosen, "load_cases": rest.data}
            found = Description(data, [*found.parts, *rest.parts])
        remarks = [] if output.as_json else cli.remarks_on(definition, supports=static)
    output.answer(found.data, found.parts, remarks)
