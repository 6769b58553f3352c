"""``railsim plot``: time histories of a result, a study over its parameters, a track in plan."""

import os
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.errors import Fault, Faults, input_error, nearest
from railsim.files.access import PICTURES, RESULTS, folder_of
from railsim.text import unformatted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from railsim.plot.study import Column

Text = str | None
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
        figure = _study_figure(str(folder), selections, against, family, kind)
    elif result:
        from railsim.plot.histories import histories
        from railsim.result import open_run

        figure = histories(open_run(file), selections, **how)
    else:
        figure = _track_figure(file, selections)
    output.wrote(save(figure, path, overwrite=output.overwrite))


def _study_figure(
    file: str, selections: tuple[str, ...], against: Text, family: Text, kind: Text
) -> "Figure":
    from railsim.cli.report import used_inputs
    from railsim.plot.study import curves_figure, map_figure, ranking_figure, say_above
    from railsim.report.inputs import inputs_of, units_of
    from railsim.report.spread import RANKED, columns, parameters
    from railsim.studies.gathered import gather

    ended = ("complete", "derailed", "stopped")
    gathered = gather([file])
    records = [record for record in gathered.records if record["status"] in ended]
    by_key = columns(records)
    if not by_key:
        raise input_error(file, "no run has values", "a study with finished runs")
    of_summary = {re.sub("_abs$", "_peak", name): name for name in by_key}  # its names there
    of_summary |= {re.sub(r"_mid(?:1$|(\d+)$)", r"_median\1", name): name for name in by_key}
    requested = [of_summary.get(name, name) for name in selections]
    names = requested or [name for name in RANKED if name in by_key] or list(by_key)[:4]
    wrong, found = (name for name in names if name not in by_key), "no such value in the study"
    faults = Faults(Fault("QUANTITY", name, found, nearest(name, by_key)) for name in wrong)
    first = gathered.results(list(gathered.paths)[:1])
    units = units_of(records, inputs_of(records, first) or used_inputs(folder_of(file)))
    varied = {name: _quantity(column) for name, column in parameters(records, units).items()}
    faults += [
        Fault(option, "", f"'{name}' was not varied", nearest(name, varied))
        for option, name in (("--against", against), ("--family", family))
        if name and name not in varied
    ]
    faults.check()
    quantities = [_quantity(by_key[name]) for name in names]
    # most values first, numbers before words; seeds last, which only name a random track
    seeds = [name for name in varied if name.rpartition(".")[2] == "seed"]
    order = sorted(
        varied, key=lambda n: (n in seeds, not varied[n].numeric, -len(varied[n].different))
    )
    x = against or next((name for name in order if name != family), None)
    ordered = x and (against or family or (varied[x].numeric and x not in seeds))
    kind = kind or ("curves" if ordered else "ranking")
    rest = [name for name in order if name != x]
    # what differs in kind is not mixed in one median
    parted = [name for name in ("vehicle", "track") if name in rest and kind == "curves"]
    members = [family] if family else parted or rest[:1]
    early = [record["status"] != "complete" for record in records]
    if kind == "ranking" or x is None:
        ends = [f" ({record['status']})" * (record["status"] != "complete") for record in records]
        labels = [f"{record['name']}{end}" for record, end in zip(records, ends, strict=True)]
        figure = ranking_figure(quantities, labels)
    elif kind == "map":
        if not members:
            found = f"only '{x}' was varied"
            raise input_error("--kind", found, "a study over two parameters", key="map")
        figure = map_figure(quantities, varied[x], varied[members[0]])
    else:
        figure = curves_figure(quantities, varied[x], _combine([varied[m] for m in members]), early)
    mixed = [name for name in rest if name not in members]
    if mixed and kind != "ranking":
        say_above(figure, f"Not told apart: {', '.join(mixed)} (options: --against, --family)")
    if any(early):
        crosses = " (crosses)" if kind == "curves" else ""
        runs = f"{sum(early)} of {len(records)} runs ended early{crosses}"
        say_above(figure, f"{runs}: their values until then")
    say_above(figure, _common_title(folder_of(file).resolve().name, records, varied))
    return figure


def _combine(columns: "Sequence[Column]") -> "Column | None":
    """Several parameters as one; None for none."""
    from railsim.plot.study import Column

    if len(columns) < 2:
        return next(iter(columns), None)
    values = zip(*(column.values for column in columns), strict=True)
    return Column(", ".join(c.words for c in columns), [", ".join(map(str, v)) for v in values])


def _common_title(name: str, records: Sequence[Mapping[str, Any]], keys: Collection[str]) -> str:
    """What a study is called, and what all its runs have."""
    labels = records[0]["labels"]
    common = [labels[kind] for kind in ("vehicle", "track", "speed") if kind in {*labels} - {*keys}]
    words = [f"{value:g} m/s" if isinstance(value, float) else str(value) for value in common]
    return unformatted(": ".join(filter(None, [name, ", ".join(words)])))


def _quantity(column: "dict[str, Any]") -> "Column":
    from railsim.plot.study import Column

    words, unit = column["words"], column["unit"]
    if " " in words:  # a name in a file stays as it is
        words = words[:1].upper() + words[1:]
    name = f"{words} ({unit})" if unit else words
    return Column(name, column["values"], column.get("decimals"))


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
