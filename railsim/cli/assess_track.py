"""``railsim assess-track``: a recorded track judged by vehicles."""

import click

from railsim.cli.common import code_options, echo, names_of, output_options, print_json, show
from railsim.cli.progress import progress_bar
from railsim.cli.study import ManyValues

SHOWN = 40


@click.command(cls=ManyValues)
@click.argument("recording", metavar="RECORDING", shell_complete=names_of("track"))
@click.option("--vehicles", multiple=True, required=True, metavar="F [F ...]",
              help="Vehicles: files or names.")  # fmt: skip
@click.option("--speeds", multiple=True, required=True, metavar="V [V ...]",
              help="Speeds in m/s, or with a unit: 160km/h.")  # fmt: skip
@click.option("--share", type=float, default=0.8, show_default=True,
              help="Share of a limit from which on a place is listed.")  # fmt: skip
@click.option("--out", required=True, metavar="DIR", help="Folder of the runs and tables.")
@click.option("--workers", type=click.IntRange(min=1), metavar="N", help="Processes; default all.")
@click.option("--resume", is_flag=True, help="Go on where this folder was left.")
@output_options
@code_options
def command(
    recording: str,
    vehicles: tuple[str, ...],
    speeds: tuple[str, ...],
    share: float,
    out: str,
    workers: int | None,
    resume: bool,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run vehicles over a recorded track and list where they exceed a share of a limit.

    RECORDING is a track file with a measured irregularity, or the CSV of one.  It is run in pieces
    over all cores; places.csv lists the places with the shape of the defect, sections.csv compares
    with the geometry limits of EN 13848-5, heat_strip.png shows all limits over the arc length.

    \b
    Example:
      railsim assess-track track/track.toml --vehicles coach_25t coach_manchester \\
          --speeds 40 --out judged
    """  # noqa: D301 - click reads the escape
    from railsim.plot.assessed_track import heat_strip
    from railsim.plot.style import save
    from railsim.studies.assess_track import assess_track
    from railsim.studies.rows import speed_of

    with progress_bar("assess-track", quiet=quiet) as progress:
        found = assess_track(
            recording, vehicles, [speed_of(text) for text in speeds], out=out, share=share,
            workers=workers, resume=resume, overwrite=overwrite, progress=progress,
        )  # fmt: skip
    written = found.write()
    written.append(save(heat_strip(found), found.folder / "heat_strip.png", overwrite=True))
    if as_json:
        print_json(found.record())
        return
    table = found.table()
    more = len(table) - SHOWN
    table.rows = table.rows[:SHOWN]
    show(table, *([f"and {more} further places in places.csv"] if more > 0 else []))
    show("", *found.notes)
    for path in written:
        echo(str(path))
