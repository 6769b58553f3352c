"""The same quantities of several results in one picture, to be compared by eye."""

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from railsim.compare import Difference
from railsim.definitions.track.layout import curvature_sections
from railsim.plot import histories, style
from railsim.plot.histories import short_names
from railsim.plot.selection import STUDY, Panel, panels
from railsim.result import Result
from railsim.text import unformatted

WHEELS = {"time", "wheelset", "side"}  # dimensions of what is drawn by default


@style.styled()
def overlay(
    results: Mapping[str, Result], selections: Sequence[str] = (), *, over: str = "distance"
) -> Figure:
    """Draw the same quantities of several results into the same axes, a colour for each result.

    `results`: By what they are called in the picture. `selections`: Quantities and labels, see
    `railsim.plot.selection`; all results must have them; by default those of the leading wheelset
    that they have. `over` ({"distance", "time"}): Horizontal
    axis; the distance is that of the reference body.
    """
    for label, result in results.items():
        histories.check_not_empty(result, label)
    chosen = tuple(selections or _leading(list(results.values())))
    drawn = {label: panels(result, chosen) for label, result in results.items()}
    first = next(iter(results.values()))
    plans = [curvature_sections(result.track()) for result in results.values()]
    ends = [[(section.type, section.begin, section.end) for section in plan] for plan in plans]
    # over time a curve is not at one place for runs of different speeds or beginnings
    begins = {(result.speed, float(result["distance"][0])) for result in results.values()}
    alike = over == "distance" or len(begins) == 1
    alike = alike and all(other == ends[0] for other in ends)
    longest = max(results.values(), key=lambda result: result["distance"][-1])
    shown = style.spans(plans[0], longest["distance"], longest[over]) if alike else []
    same_radii = all(plan == plans[0] for plan in plans)
    count, words = max(map(len, drawn.values())), first.quantities[over].label
    title = _shared_title(list(results.values()))
    figure, cells, across = _cells(count, 1.5 if title else 1.3, words, title)
    together = zip_longest(*drawn.values())
    places = {  # wheelsets as in the legends of histories: number and name
        name: f"{number} {short}"
        for result in results.values()
        for number, (name, short) in enumerate(short_names(result.wheelsets).items(), start=1)
    }
    for number, (axes, same) in enumerate(zip(cells, together, strict=True)):
        for index, (result, panel) in enumerate(zip(results.values(), same, strict=True)):
            for line in panel.lines if panel is not None else ():
                side = line.labels.get("side", "left")
                look: Any = {"color": style.distinct(index), "ls": style.SIDE_LINES[side]}
                axes.plot(result[over], line.values * panel.quantity.scale, **look)
        held = [panel for panel in same if panel is not None]
        quantity = held[0].quantity
        histories.draw_limit(axes, quantity, results.values())
        histories.frame(axes, quantity, _heading(held, places))
        style.shade(axes, shown, with_names=same_radii and number < across)
    lines = [line for found in drawn.values() for panel in found for line in panel.lines]
    labels = [f"{label}{result.end_words}" for label, result in results.items()]
    _legend(figure, labels, {line.labels.get("side") for line in lines}, 0)
    return figure


def _cells(
    count: int, margin: float, words: str, title: str = ""
) -> tuple[style.Picture, list[Axes], int]:
    """A figure with axes for quantities, the last of a column with their words; the columns."""
    across, wide = (1, 7.0) if count < 3 else (2, 9.8)
    figure, cells = style.grid_of(count, across, wide, 2.1, margin, title, sharex=True)
    for axes in cells[max(0, count - across) :]:
        axes.set_xlabel(words)
        axes.tick_params(labelbottom=True)
    return figure, cells, across


def _legend(figure: Figure, labels: Sequence[str], sides: set[str | None], first: int) -> None:
    """A legend below a figure, in as many columns as fit: colours from a number on, sides."""
    names = enumerate(map(unformatted, labels), start=first)
    handles = [style.key(name, color=style.distinct(k), lw=2.0) for k, name in names]
    handles += style.side_keys(sides, color="0.25")
    longest = max(len(str(handle.get_label())) for handle in handles)
    fitting = int(figure.get_figwidth() / (0.5 + 0.075 * longest))
    columns = max(1, min(6, len(handles), fitting))
    figure.legend(handles=handles, loc="outside lower left", ncols=columns)


def _leading(results: Sequence[Result]) -> list[str]:
    """Quantities of `STUDY` of the leading wheelset; where some lack all, others that all have."""
    common = [
        f"{name}:1" if "wheelset" in quantity.dims else name
        for name, quantity in results[0].quantities.items()
        if quantity.dims[0] == "time"
        and WHEELS.issuperset(quantity.dims)
        and all(name in result for result in results)
    ]
    study = [name for name in (f"{one}:1" for one in STUDY) if name in common]
    return study or [name for name in common if name not in ("time", "distance")]


@style.styled()
def difference_figure(found: Sequence[Difference], first: str) -> Figure:
    """Differences of results along the track from the `first` of this name, by quantity."""
    labels = list(dict.fromkeys(one.result for one in found))
    names = list(dict.fromkeys(one.quantity.name for one in found))
    title = f"Leading wheelset: difference from {unformatted(first)}"
    figure, cells, _ = _cells(len(names), 1.5, "distance (m)", title)
    for axes, name in zip(cells, names, strict=True):
        differences = [one for one in found if one.quantity.name == name]
        for one in differences:
            colour = style.distinct(1 + labels.index(one.result))
            line = style.SIDE_LINES[one.labels.get("side", "left")]
            axes.plot(one.distance, one.values * one.quantity.scale, color=colour, ls=line)
        histories.frame(axes, differences[0].quantity, differences[0].quantity.title)
    _legend(figure, labels, {one.labels.get("side") for one in found}, 1)
    return figure


def _shared_title(results: Sequence[Result]) -> str:
    """What of vehicle, track, friction and speed is the same for all results."""
    tracks, several = [run.track() for run in results], len({r.vehicle().name for r in results}) > 1
    texts = (
        [run.vehicle().name_with_load for run in results],
        [f"load case {run.vehicle().load}" for run in results if several and run.vehicle().load],
        [track.name for track in tracks],
        [f"friction {track.friction_words}" for track in tracks],
        [run.speed_words for run in results],
    )  # fmt: skip
    same = [names[0] for names in texts if len(names) == len(results) and len(set(names)) == 1]
    return " · ".join(map(unformatted, same))


def _heading(panels: Sequence[Panel], names: Mapping[str, str]) -> str:
    """Name of a quantity, with the place that all lines of a result share."""
    quantity, places = panels[0].quantity, dict[str, None]()
    for panel in panels:
        labels = {v for line in panel.lines for dim, v in line.labels.items() if dim != "side"}
        labels -= {quantity.long_name.rpartition(", ")[2]}
        if len(labels) != 1:
            return quantity.title
        place = labels.pop()
        places[unformatted(names.get(place, place))] = None
    return f"{quantity.title}: {' / '.join(places)}"
