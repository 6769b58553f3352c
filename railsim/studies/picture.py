"""The picture of a study: values of its runs over what was varied."""

import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from railsim.errors import Faults, argument_error, argument_fault, input_error, nearest
from railsim.files.access import folder_of
from railsim.plot.study import Column, curves_figure, map_figure, ranking_figure, say_above
from railsim.studies.columns import RANKED, columns, parameters
from railsim.studies.gathered import Gathered, gather
from railsim.studies.inputs import inputs_of, units_of, used_inputs
from railsim.studies.records import Record
from railsim.text import unformatted

Text = str | None
WITH_VALUES = ("complete", "derailed", "stopped")
KINDS = ("curves", "map", "ranking")


def study_figure(
    file: str | Path,
    quantities: Sequence[str] = (),
    *,
    against: Text = None,
    family: Text = None,
    kind: Text = None,
) -> Figure:
    """Draw values of the summary of a study over what was varied.

    `file`: Folder of the study or a file with its table; also any folder of results. `quantities`:
    Names of values of the summary; by default those by which runs are judged. `against`: Parameter
    of the horizontal axis; by default that of most values. `family`: Parameter with a curve for
    each value, or vertical axis of a map; by default vehicle and track, or the next one. `kind`:
    ``curves``, ``map`` or ``ranking``; by default curves where the parameter is a number.

    Raises InputError: the study cannot be read or has no values; no such value, or no such
    parameter was varied.
    """
    gathered = gather([str(file)])
    records = [record for record in gathered.records if record["status"] in WITH_VALUES]
    by_key = columns(records)
    if not by_key:
        raise input_error(str(file), "no run has values", "a study with finished runs")
    names, varied = _names(quantities, by_key), _varied(file, gathered, records)
    _check(names, by_key, {"against": against, "family": family}, varied, kind)
    ordered = sorted(varied, key=lambda name: _use(name, varied[name]))
    x = against or next((name for name in ordered if name != family), None)
    if kind is None:
        curves = x and (against or family or (varied[x].numeric and not _is_seed(x)))
        kind = "curves" if curves else "ranking"
    rest = [name for name in ordered if name != x]
    # what differs in kind is not mixed in one median
    parted = [name for name in ("vehicle", "track") if name in rest and kind == "curves"]
    members = [family] if family else parted or rest[:1]
    chosen = [_column(by_key[name]) for name in names]
    early = [record["status"] != "complete" for record in records]
    if kind == "ranking" or x is None:
        figure = ranking_figure(chosen, [_label(record) for record in records])
    elif kind == "curves":
        figure = curves_figure(chosen, varied[x], _combine([varied[m] for m in members]), early)
    elif members:
        figure = map_figure(chosen, varied[x], varied[members[0]])
    else:
        allowed = "a study over two parameters"
        raise argument_error("kind", f"only '{x}' was varied", allowed, key="map")
    mixed = [name for name in rest if name not in members]
    if mixed and kind != "ranking":
        say_above(figure, f"Not told apart: {', '.join(mixed)} (options: against, family)")
    if any(early):
        crosses = " (crosses)" if kind == "curves" else ""
        runs = f"{sum(early)} of {len(records)} runs ended early{crosses}"
        say_above(figure, f"{runs}: their values until then")
    say_above(figure, _common_title(folder_of(str(file)).resolve().name, records, varied))
    return figure


def _check(
    names: Sequence[str],
    by_key: Collection[str],
    parameters_of: Mapping[str, Text],
    varied: Collection[str],
    kind: Text,
) -> None:
    """Refuse values that the study does not have, what was not varied, axes twice, other kinds."""
    faults = Faults()
    for name in names:
        if name not in by_key:
            words, alike = "no such value in the study", nearest(name, by_key)
            faults.append(argument_fault("quantities", name, words, alike, "QUANTITY"))
    for argument, key in parameters_of.items():
        if key and key not in varied:
            words = f"'{key}' was not varied"
            faults.append(argument_fault(argument, "", words, nearest(key, varied)))
    key, family = parameters_of.values()
    faults.require(not key or key != family, "family", f"'{key}' as `against`", "another parameter")
    alone = kind != "ranking" or not (key or family)
    faults.require(alone, "kind", "'ranking' with `against` or `family`", "without them")
    faults.require(kind in (None, *KINDS), "kind", f"found {kind!r}", nearest(str(kind), KINDS))
    faults.check()


def _label(record: Record) -> str:
    name, status = str(record["name"]), record["status"]
    return name if status == "complete" else f"{name} ({status})"


def _names(quantities: Sequence[str], by_key: Collection[str]) -> list[str]:
    """Return the keys of values by their names in the summary, or those drawn by default."""
    of_summary = {re.sub("_abs$", "_peak", name): name for name in by_key}
    of_summary |= {re.sub(r"_mid(?:1$|(\d+)$)", r"_median\1", name): name for name in by_key}
    requested = [of_summary.get(name, name) for name in quantities]
    return requested or [name for name in RANKED if name in by_key] or list(by_key)[:4]


def _varied(file: str | Path, gathered: Gathered, records: Sequence[Record]) -> dict[str, Column]:
    """Return the parameters that differ between runs, with their units."""
    first = gathered.results(list(gathered.paths)[:1])
    units = units_of(records, inputs_of(records, first) or used_inputs(folder_of(str(file))))
    return {name: _column(column) for name, column in parameters(records, units).items()}


def _use(name: str, column: Column) -> tuple[bool, bool, int]:
    """Return by what axes are chosen: numbers first, most values first; seeds only name a track."""
    return _is_seed(name), not column.numeric, -len(column.different)


def _is_seed(name: str) -> bool:
    return name.rpartition(".")[2] == "seed"


def _combine(parts: Sequence[Column]) -> Column | None:
    """Several parameters as one; None for none."""
    if len(parts) < 2:
        return next(iter(parts), None)
    values = zip(*(column.values for column in parts), strict=True)
    return Column(", ".join(c.words for c in parts), [", ".join(map(str, v)) for v in values])


def _common_title(name: str, records: Sequence[Record], keys: Collection[str]) -> str:
    """What a study is called, and what all its runs have."""
    labels = records[0]["labels"]
    common = [labels[kind] for kind in ("vehicle", "track", "speed") if kind in {*labels} - {*keys}]
    words = [f"{value:g} m/s" if isinstance(value, float) else str(value) for value in common]
    return unformatted(": ".join(filter(None, [name, ", ".join(words)])))


def _column(column: Mapping[str, Any]) -> Column:
    words, unit = column["words"], column["unit"]
    if " " in words:  # a name in a file stays as it is
        words = words[:1].upper() + words[1:]
    name = f"{words} ({unit})" if unit else words
    return Column(name, column["values"], column.get("decimals"))
