"""The same quantities of several results side by side.

The first result is what the others are compared with.  Differences are those of the magnitudes,
(|b| - |a|) / |a|, so that a mirrored run differs by nothing.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isnan, nan
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import curvature_sections
from railsim.definitions.vehicle.loads import DESIGN
from railsim.errors import Fault, Faults
from railsim.notation import Quantity
from railsim.result import Peak, Result, mid_curves, peaks
from railsim.result.tables import PLACE
from railsim.table import Amount, Column, Table
from railsim.text import in_words, printable, shortened

BESIDE = 1e-6  # m, from ends of elements, at which the curvature may jump
MOST_KEYS = 12  # of vehicles with different names
NOT_GIVEN = {"load": DESIGN}  # what the absence of a value stands for
WORDS = {"abs": "peak", "max": "largest", "min": "smallest"}


@dataclass(frozen=True)
class Comparison:
    """One value of all results."""

    quantity: Quantity  # what is compared
    where: str  # ``peak``, ``largest`` or ``smallest`` of the run, or ``full curve 1, median``
    peaks: Mapping[str, Peak]  # the value of every result that has it, by the result's label
    first: str  # label of the result with which the others are compared

    @property
    def differences(self) -> dict[str, float]:
        """Relative difference of every magnitude from the first; nan where that is shown as 0.

        And where the first has no value.
        """
        sizes = {label: abs(peak.value) for label, peak in self.peaks.items()}
        first = sizes.get(self.first, 0.0)
        zero = first * self.quantity.scale <= 0.5 * self.quantity.least
        return {n: nan if zero else (size - first) / first for n, size in sizes.items()}

    def record(self) -> dict[str, Any]:
        """Return the comparison as plain numbers and strings, SI."""
        differences = self.differences.values()
        values = {
            label: peak.record() | {"difference": None if isnan(share) else share}
            for (label, peak), share in zip(self.peaks.items(), differences, strict=True)
        }
        return {"quantity": self.quantity.name, "where": self.where, "values": values}


def compare(results: Mapping[str, Result]) -> tuple[Comparison, ...]:
    """Compare the peaks and the full-curve values of results, by what they are called.

    The first is what the others are compared with; what it lacks has no differences.  Returns:
    peaks first, then the medians over every full curve, by its number along the track.
    """
    rows: dict[tuple[str, str], dict[str, Peak]] = {}
    for label, result in results.items():
        for peak in peaks(result):
            rows.setdefault((WORDS[peak.kind], peak.quantity.name), {})[label] = peak
        sections = [s for s in curvature_sections(result.track()) if s.type == "CIR"]
        middles = [0.5 * (s.begin + s.end) for s in sections]  # a run may begin after some
        for curve in mid_curves(result):
            place = f"full curve {1 + middles.index(curve.distance)}, median"
            for peak in curve.median_peaks:
                rows.setdefault((place, peak.quantity.name), {})[label] = peak
    first = next(iter(results))
    Faults(
        Fault(label, "time", f"holds no instants ({result.status})", "leave it out")
        for label, result in results.items()
        if not len(result["time"])
    ).check()
    return tuple(
        Comparison(next(iter(by_label.values())).quantity, place, by_label, first)
        for (place, _), by_label in rows.items()
    )


def conditions(results: Mapping[str, Result]) -> dict[str, list[str]]:
    """Return what results differ in: the value of each in words, by key.

    `speed` [m/s]; `distance`, from where to where, apart by 1 m or more, which peaks depend on;
    `track` and `vehicle`, their names; the keys of the files of both and of the
    settings, which begin with `track.`, `vehicle.` and `settings.`; not what a run wrote.  Of
    vehicles with different names that differ in more than `MOST_KEYS`, the names alone.
    """
    every = list(results.values())
    tracks, vehicles = [r.track() for r in every], [r.vehicle() for r in every]
    on_track, of_vehicle = differing(tracks), differing(vehicles)
    values = {
        "speed": [f"{result.speed:.6g}" for result in every],
        "track": [track.name if on_track else "" for track in tracks],
        "vehicle": [vehicle.name if of_vehicle else "" for vehicle in vehicles],
    }
    ends = np.array([r["distance"][[0, -1]] for r in every])
    if np.ptp(ends, axis=0).max() >= 1.0:
        values["distance"] = [f"{begin:.6g} to {end:.6g}" for begin, end in ends]
    differences = {key: texts for key, texts in values.items() if len(set(texts)) > 1}
    if len(of_vehicle) <= MOST_KEYS or "vehicle" not in differences:
        differences |= {f"vehicle.{key}": texts for key, texts in of_vehicle.items()}
    differences |= {f"track.{key}": texts for key, texts in on_track.items()}
    of_settings = differing([result.settings() for result in every])
    chosen = {key: texts for key, texts in of_settings.items() if not key.startswith("outputs.")}
    return differences | {f"settings.{key}": texts for key, texts in chosen.items()}


def condition_table(conditions: Mapping[str, Sequence[str]], labels: Iterable[str]) -> Table:
    """Return the conditions that differ, those of each result in a column."""
    units = {"speed": "speed (m/s)", "distance": "distance (m)"}
    rows = [[units.get(key, key), *texts] for key, texts in conditions.items()]
    return Table(["conditions that differ", *map(printable, labels)], rows)


def differing(definitions: Sequence[Any]) -> dict[str, list[str]]:
    """Return the keys in which definitions differ, each with all its values in words."""
    flat = [
        {key: NOT_GIVEN.get(key) if value is None else value for key, value in rows}
        for rows in (flat_keys(definition.model_dump()) for definition in definitions)
    ]
    return {
        key: [shortened(in_words(values.get(key, "—"))) for values in flat]
        for key in dict.fromkeys(key for values in flat for key in values)
        if key not in ("name", "source") and len({str(values.get(key)) for values in flat}) > 1
    }


def flat_keys(node: Any, key: str = "") -> list[tuple[str, Any]]:
    """Return the values of plain tables by their dotted keys; rows of tables are one value."""
    if isinstance(node, dict):
        pairs = [(f"{key}.{name}" if key else str(name), value) for name, value in node.items()]
        return [row for name, value in pairs for row in flat_keys(value, name)]
    if isinstance(node, tuple | list) and node and isinstance(node[0], tuple | list | dict):
        count = f"{len(node)} row{'s' * (len(node) > 1)}"
        return [(key, f"{count}: {'; '.join(map(in_words, node))}")]
    return [(key, node)]


@dataclass(frozen=True)
class Difference:
    """Difference of a result from the first one along the track, in one series of a quantity.

    `distance` (float64[position]): Positions of the first result's reference body at places
    that both leading wheelsets have passed [m].
    """

    quantity: Quantity
    labels: Mapping[str, str]  # where on the vehicle: dimension to name
    result: str  # what the result is called
    distance: Floats
    values: Floats  # value of this result less that of the first [SI], float64[position]

    def record(self) -> dict[str, Any]:
        """Return the largest difference as plain numbers and strings, SI."""
        place = {"quantity": self.quantity.name, **self.labels, "result": self.result}
        return place | dict(zip(("largest_difference", "distance"), self.largest, strict=True))

    @property
    def largest(self) -> tuple[float, float]:
        """The difference of the largest magnitude [SI], and where it is [m]; nan if there is none.

        Not where one has no value, as Y/Q of a wheel that does not touch.
        """
        if np.isnan(self.values).all():
            return nan, nan
        index = int(np.nanargmax(np.abs(self.values)))
        return float(self.values[index]), float(self.distance[index])


def differences(results: Mapping[str, Result], names: Sequence[str]) -> list[Difference]:
    """Return the differences from the first result along the track, of the leading wheelset.

    Both leading wheelsets are at the same place, wherever the reference bodies of two vehicles are;
    without `wheelset_distance` these are.  Values are interpolated linearly between outputs.

    `results`: Results over one and the same plan. `names`: Quantities of wheels or wheelsets.
    Raises InputError: results over different plans, or that have no part of the track in common.
    """
    (first, base), *others = results.items()
    faults = Faults()
    for label, result in others:
        if not _same_plan(base.track(), result.track()):
            found = f"runs over another plan than {first}"
            faults.append(Fault(label, "track", found, "results over one plan"))
        elif not _within(*_places(base, result)).any():
            found = f"has no part of the track in common with {first}"
            faults.append(Fault(label, "distance", found, "results that share a part of the track"))
    faults.check()
    rows = []
    for label, result in others:
        places, places_other = _places(base, result)
        common = _within(places, places_other)
        positions = base["distance"][common]
        for name in names:
            if name in base and name in result:
                mine, other = _leading(base, name), _leading(result, name)
                for side, values in mine.items():
                    interpolated = np.interp(places[common], places_other, other[side])
                    labels = {"wheelset": base.wheelsets[0], **({"side": side} if side else {})}
                    difference, quantity = interpolated - values[common], base.quantities[name]
                    rows.append(Difference(quantity, labels, label, positions, difference))
    return rows


def _same_plan(first: Track, second: Track) -> bool:
    """Whether two tracks have the same curvature up to rounding, however they are divided."""
    plans = []
    for track in (first, second):
        parts = curvature_sections(track)
        ends = np.ravel([(part.begin + BESIDE, part.end - BESIDE) for part in parts])
        plans.append((ends, np.ravel([(part.start_value, part.end_value) for part in parts])))
    ends_of_both = np.concatenate([ends for ends, _ in plans])
    mine, others = (np.interp(ends_of_both, *plan) for plan in plans)
    return bool(np.allclose(mine, others, rtol=1e-6, atol=1e-9))


def _leading(result: Result, name: str) -> dict[str, Floats]:
    """Return a quantity of the leading wheelset over time, by side where it has sides."""
    values = result[name][:, 0]
    if values.ndim == 1:
        return {"": values}
    return {side: values[:, k] for k, side in enumerate(("left", "right"))}


def _places(first: Result, second: Result) -> tuple[Floats, Floats]:
    """Return where the leading wheelsets of two results are over time [m]."""
    if "wheelset_distance" in first and "wheelset_distance" in second:
        return first["wheelset_distance"][:, 0], second["wheelset_distance"][:, 0]
    return first["distance"], second["distance"]


def _within(positions: Floats, others: Floats) -> Any:
    """Which positions lie within others."""
    return (positions >= others[0]) & (positions <= others[-1])


def comparison_table(rows: Sequence[Comparison]) -> Table:
    """Return comparisons with one line for each value, SI."""
    names = "quantity", "unit", "where", "result", "value", "wheelset", "side"
    columns: list[Column | str] = [*names, *PLACE, "difference"]
    lines = []
    for row in rows:
        values = row.record()["values"].items()
        lines += [{**value, "where": row.where, "result": label} for label, value in values]
    return Table(columns, lines)


def comparison_tables(rows: Sequence[Comparison], results: Mapping[str, Result]) -> list[Table]:
    """Return comparisons as people read them: the peaks, then each full curve."""
    by_place: dict[str, list[Comparison]] = {}
    for row in rows:
        place = "peaks" if row.where in WORDS.values() else row.where
        by_place.setdefault(place, []).append(row)
    return [
        Table(
            [Column("quantity", place), *_VALUE, *where, _DIFFERENCE],
            _table_rows(members, results, timed=where is PLACE),
        )
        for place, members in by_place.items()
        for where in (PLACE if place == "peaks" else _MIDDLE,)
    ]


_VALUE = (Column("words", " "), "result", "wheelset", "side", Column("value", format=">"))
_DIFFERENCE = Column("difference", "difference", "%", "+.2f")
_MIDDLE = [Column("distance", "middle at s", "m", ".1f")]  # of a median, which has no instant


def _table_rows(
    rows: Sequence[Comparison], results: Mapping[str, Result], *, timed: bool
) -> Iterator[list[Any]]:
    for row in rows:
        by_sign = row.where in (WORDS["max"], WORDS["min"])
        text = f"{row.quantity.words}, {row.where}" if by_sign else row.quantity.words
        differences = row.differences
        for index, (label, peak) in enumerate(row.peaks.items()):
            name = peak.labels.get("wheelset", "")
            undefined = index == 0 or isnan(differences[label])
            yield [
                *(("", "") if index else (row.quantity.name, text)), label,
                f"{results[label].wheelsets.index(name) + 1}" if name else "",
                peak.labels.get("side", ""), Amount(peak.value, Column.of(row.quantity)),
                *[peak.time] * timed, peak.distance, None if undefined else differences[label],
            ]  # fmt: skip


def difference_table(differences: Sequence[Difference]) -> Table:
    """Return the largest differences along the track."""
    largest = Column("largest_difference", "largest difference", format=">")
    heads = Column("quantity", "along the track, leading wheelset"), "result", "side"
    rows = []
    for d in differences:
        value = Amount(d.largest[0], Column.of(d.quantity))
        rows.append([d.quantity.words, d.result, d.labels.get("side", ""), value, d.largest[1]])
    return Table([*heads, largest, PLACE[1]], rows)
