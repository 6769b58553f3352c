"""``railsim plot``: time histories of a result, or a track in plan."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from railsim.cli.common import echo, json_option, overwrite_option, print_json, quiet_option
from railsim.files import PICTURES, RESULTS, check_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@click.command()
@click.argument("file", metavar="R.h5|TRACK")
@click.argument("selections", nargs=-1, metavar="[QUANTITY]...")
@click.option("--out", metavar="F.png", help="Picture (.png, .svg, .pdf); default FILE.png.")
@click.option(
    "--over",
    type=click.Choice(["distance", "time"]),
    default="distance",
    show_default=True,
    help="Horizontal axis; the distance is that of the reference body.",
)
@click.option(
    "--by",
    type=click.Choice(["wheel", "wheelset"]),
    default="wheel",
    show_default=True,
    help="All wheels in one pair of axes, or one pair of axes for each wheelset.",
)
@click.option(
    "--between", type=float, nargs=2, metavar="A B", help="Range of the horizontal axis to show."
)
@overwrite_option
@json_option
@quiet_option
def command(
    file: str,
    selections: tuple[str, ...],
    out: str | None,
    over: str,
    by: str,
    between: tuple[float, float] | None,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Draw quantities of a result, or a track with its curvature and cant.

    Without a QUANTITY: wheel load change, lateral force, derailment quotient, roll, lateral
    displacement and yaw.  A QUANTITY may select wheels, bodies and components: Y:1:left is the left
    wheel of the leading wheelset, body_acceleration:carbody:y the lateral acceleration of the
    carbody.

    \b
    Example:
      railsim plot coach_manchester_curve_r250_20.h5 --overwrite
      railsim plot run.h5 Y Q:1 --over time --by wheelset --out forces.pdf
      railsim plot curve_r250 --out curve.png
    """  # noqa: D301 - click reads the escape
    path = Path(out or file)
    if not out and path.name:
        path = path.with_suffix(".png")
    check_file(path, overwrite=overwrite, endings=PICTURES)
    if Path(file).suffix.lower() in RESULTS:
        figure = _result_figure(file, selections, over, by, between)
    else:
        figure = _track_figure(file, selections)
    from railsim.plot.style import save

    save(figure, path, overwrite=overwrite)
    if as_json:
        print_json({"file": str(path)})
    elif not quiet:
        echo(str(path))


def _result_figure(
    file: str, selections: tuple[str, ...], over: str, by: str, between: tuple[float, float] | None
) -> "Figure":
    from railsim.plot.histories import STUDY, histories
    from railsim.result import open_run

    return histories(open_run(file), selections or STUDY, over=over, by=by, between=between)


def _track_figure(file: str, selections: tuple[str, ...]) -> "Figure":
    from railsim.definitions.loading import load_track
    from railsim.errors import Fault, InputError
    from railsim.plot.track import track_figure

    if selections:
        found = f"'{selections[0]}' asked of a track"
        raise InputError([Fault("QUANTITY", "", found, "quantities belong to results (.h5)")])
    return track_figure(load_track(file))
