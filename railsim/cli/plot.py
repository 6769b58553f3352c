"""``railsim plot``: time histories of a result, a study over its parameters, a track in plan."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.errors import input_error
from railsim.files.access import PICTURES, RESULTS, folder_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RECORDING = "recording"  # instead of a quantity, of a track


@click.command()
@click.argument("file", metavar="R.h5|STUDY|TRACK")
@click.argument("selections", nargs=-1, metavar="[QUANTITY]...")
@cli.option("--out", "Picture (.png, .svg, .pdf); default FILE.png, FILE_recording.png.", "F.png")
@cli.choice("--over", "Horizontal axis; the reference body's distance.", "distance|time")
@cli.choice("--by", "Axes for all wheels, or for each wheelset.", "wheel|wheelset")
@cli.option("--between", "Range of the horizontal axis to show.", "A B", float, nargs=2)
@cli.option("--against", "Of a study: the parameter of the horizontal axis.", "KEY")
@cli.option("--family", "Of a study: the parameter with a curve for each value.", "KEY")
@cli.choice("--kind", "Of a study: its picture.", "curves|map|ranking", default=None)
@cli.output_options()
def command(
    file: str,
    selections: tuple[str, ...],
    against: str | None,
    family: str | None,
    kind: str | None,
    output: cli.Output,
    **how: Any,
) -> None:
    """Draw quantities of a result or of a study, or a track with its curvature and cant.

    Without a QUANTITY: wheel load change, track shift force, derailment quotient, roll, lateral
    displacement and yaw.  A QUANTITY may select wheels, bodies and components: Y:1:left is the left
    wheel of the leading wheelset, body_acceleration:carbody:y the lateral acceleration of the
    car body.

    Of a track with a measured irregularity, `recording` draws it as measured and as applied, with
    its spectra beside those of ERRI B176.

    Of a STUDY, its folder or summary.csv: values of its summary such as Y_over_Q_abs or
    sum_abs_Y_mid1 over the parameter of most values, a curve for each vehicle and track or, of one
    alone, for each value of the next, or as set by --against, --family and --kind.

    \b
    Example:
      railsim plot coach_manchester_curve_r250_20.h5 --overwrite
      railsim plot friction --against track.friction --family speed
      railsim plot friction dQ_over_Q0_max --kind map
      railsim plot run.h5 Y Q:1 --over time --by wheelset --out forces.pdf
      railsim plot curve_r250 --out curve.png
      railsim plot my_track.toml recording --out recording.png
    """
    from railsim.plot.style import save

    folder = folder_of(file)
    of_study = os.path.isdir(folder)
    result = not of_study and Path(file).suffix.lower() in RESULTS
    cli.goes_with("results (.h5)", result, "over", "by", "between")
    default = folder / "study" if of_study and folder.name else folder
    if not folder.parent.is_dir():  # then it is the file that is missing, not its place
        default = Path(folder.name)
    recording = selections == (RECORDING,) and not (result or of_study)
    path = output.file(default, PICTURES, suffix=f"_{RECORDING}.png" if recording else ".png")
    if not of_study:
        found = f"'{file}' is no study's folder"
        cli.refusals(found, "a folder of results", "against", "family", "kind").check()
    if of_study:
        from railsim.studies.picture import study_figure

        figure = study_figure(folder, selections, against=against, family=family, kind=kind)
    elif result:
        from railsim.plot.histories import histories
        from railsim.result import open_run

        figure = histories(open_run(file), selections, **how)
    else:
        figure = _track_figure(file, selections)
    output.wrote(save(figure, path, overwrite=output.overwrite))


def _track_figure(file: str, selections: tuple[str, ...]) -> "Figure":
    from railsim.definitions.loading import load_track
    from railsim.plot.track import track_figure

    if selections == (RECORDING,):
        return _recording_figure(file)
    if selections:
        found = f"'{selections[0]}' asked of a track"
        allowed = f"{RECORDING}; quantities belong to results (.h5)"
        raise input_error("QUANTITY", found, allowed)
    return track_figure(load_track(file))


def _recording_figure(file: str) -> "Figure":
    """The recording of a track as its file holds it, and as it acts."""
    from railsim.definitions.excitations.measured_file import recordings
    from railsim.definitions.loading import load_track
    from railsim.files.sources import find_file, read_source
    from railsim.plot.recording import recording_figure

    track = load_track(file)  # says what is wrong
    data = read_source(find_file(file, "track"), "track").data
    found = recordings(data.get("irregularities", ()))
    if not found:
        allowed = 'an irregularity of type = "measured" with a file'
        raise input_error(file, "no recording", allowed, key="irregularities")
    name, before, after = found[0]
    more = f", the first of {len(found)}" if len(found) > 1 else ""
    return recording_figure(before, after, f"{track.name}: {name}{more}")
