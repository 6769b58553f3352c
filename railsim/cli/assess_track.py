"""``railsim assess-track``: a recorded track judged by vehicles."""

from pathlib import Path
from typing import Any

import click

from railsim.cli import common as cli
from railsim.cli.study import ManyValues

SHOWN = 40


@click.command(cls=ManyValues)
@click.argument("recording", shell_complete=cli.names_of("track"))
@cli.repeated("--vehicles", "Vehicles: files or names.", "F [F ...]", required=True)
@cli.repeated("--speeds", "Speeds in m/s, or with a unit: 160km/h.", "V [V ...]", required=True)
@cli.option("--share", "Least share of a limit that is listed.", "X", float, default=0.8)
@cli.option("--out", "Folder of the runs and tables.", "DIR", required=True)
@cli.workers_option
@cli.flag("--resume", "Continue in this folder.")
@cli.output_options()
@cli.code_options
def command(
    recording: str,
    vehicles: tuple[str, ...],
    speeds: tuple[str, ...],
    output: cli.Output,
    **how: Any,
) -> None:
    """Run vehicles over a recorded track and list where they exceed a share of a limit.

    RECORDING is a track file with a measured irregularity, or the CSV of one.  It is run in pieces
    over all cores; places.csv lists the places with the shape of the defect, sections.csv compares
    with the geometry limits of EN 13848-5, heat_strip.png shows all limits over the arc length,
    report.html has them all.

    \b
    Example:
      railsim assess-track track/track.toml --vehicles coach_25t coach_manchester \\
          --speeds 40 --out judged
    """
    from railsim.plot.study import heat_strip
    from railsim.report.assessed_track import assessed_track_page
    from railsim.studies.assess_track import assess_track
    from railsim.studies.geometry_limits import CELL
    from railsim.studies.rows import speed_of

    how |= {"out": str(output.out), "overwrite": output.overwrite}
    driven = [speed_of(text) for text in speeds]
    with output.progress("assess-track") as progress:
        how["further_files"] = "places.csv", "sections.csv", "heat_strip.png", "report.html"
        found = assess_track(recording, vehicles, driven, progress=progress, **how)
    output.written += found.write()
    table, strip = found.table(), heat_strip(found.cells, found.shares, CELL)
    output.write("heat_strip.png", strip)
    contents = found.table(), found.share, strip, found.notes, found.sections
    output.write("report.html", assessed_track_page(Path(recording).name, *contents))
    more = len(table) - SHOWN
    table.rows = table.rows[:SHOWN]
    none = f"no vehicle exceeds {100.0 * found.share:g} % of a limit at any place"
    further = [f"and {more} further places in places.csv"] if more > 0 else []
    output.answer(found.record(), [table if len(table) else none, *further, "", *found.notes])
