"""Which quantities and labels to draw.

A selection is the name of a quantity, followed by the labels that are wanted, in any order:
``Q``, ``Y:1:left``, ``body_acceleration:carbody:y``.  A wheelset is called by its name or by its
number from the leading end.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product

from railsim.arrays import Floats
from railsim.errors import Faults, InputError, input_error, nearest
from railsim.notation import Quantity
from railsim.result import Result
from railsim.result.labels import all_labels, chosen_names

MOST_LINES = 24

STUDY = ("dQ_over_Q0", "sum_Y", "Y_over_Q", "wheelset_roll", "wheelset_lateral", "wheelset_yaw")
"""Default quantities of plots."""

LIMITS = {
    "Y_over_Q": (0.8, "EN 14363: 0.8, mean over 2 m"),
    "dQ_over_Q0": (-0.6, "EN 14363: −60 %"),
}
"""EN 14363 (2016): derailment quotient, on-track tests; wheel unloading, twisted track [SI]."""
TWIST_TEST_SPEED = 3.0
"""Speed up to which the limit of wheel unloading holds, that of the test on twisted track [m/s]."""


def limit_of(name: str, results: Iterable[Result]) -> tuple[float, str] | None:
    """Return the limit of a quantity and its words, where it applies to all of some results."""
    if name == "dQ_over_Q0" and any(result.speed > TWIST_TEST_SPEED for result in results):
        return None
    return LIMITS.get(name)


@dataclass(frozen=True)
class Line:
    """One line of a picture."""

    values: Floats  # what to draw [SI], shape (time,)
    labels: Mapping[str, str]  # where: dimension to name


@dataclass(frozen=True)
class Panel:
    """One pair of axes: a quantity and its lines."""

    quantity: Quantity
    lines: tuple[Line, ...]


def panels(result: Result, selections: tuple[str, ...] | list[str]) -> list[Panel]:
    """Return what to draw for each selection; components get a panel each.

    Raises InputError: a quantity or label does not exist, or there are too many lines to tell
    apart.
    """
    faults, found = Faults(), list[Panel]()
    for selection in selections:
        with faults.caught():
            found.extend(_panels(result, selection))
    faults.check()
    return found


def _panels(result: Result, selection: str) -> Iterator[Panel]:
    name, *labels = str(selection).split(":")
    drawable = [key for key, q in result.quantities.items() if q.dims[0] == "time" != key]
    if name not in drawable:
        raise _fault(selection, f"no quantity '{name}'", nearest(name, drawable))
    quantity = result.quantities[name]
    chosen = _chosen_labels(result, quantity, selection, labels)
    per_panel = ["component"] if "component" in quantity.dims else []
    per_line = [dim for dim in quantity.dims[1:] if dim not in per_panel]
    lines = list(product(*(chosen[dim] for dim in per_line)))
    if len(lines) > MOST_LINES:
        example = ":".join((name, *(chosen[dim][0] for dim in per_line)))
        raise _fault(selection, f"{len(lines)} lines", f"choose some of them, such as {example}")
    for outer in product(*(chosen[dim] for dim in per_panel)):
        dims = (*per_panel, *per_line)
        places = [dict(zip(dims, (*outer, *inner), strict=True)) for inner in lines]
        series = tuple(Line(result.series(name, **where), where) for where in places)
        yield Panel(quantity.component(*outer) if outer else quantity, series)


def _chosen_labels(
    result: Result, quantity: Quantity, selection: str, names: list[str]
) -> dict[str, list[str]]:
    dims = quantity.dims[1:]
    known = all_labels(dims, result.coordinates)
    for name in filter(None, names):
        if name not in known:
            raise _fault(selection, f"no label '{name}'", nearest(name, known))
    chosen = chosen_names(dims, result.coordinates, [*filter(None, names)])
    return {d: chosen.get(k, list(result.coordinates[d])) for k, d in enumerate(dims)}


def _fault(selection: str, found: str, allowed: str) -> InputError:
    return input_error("QUANTITY", found, allowed, selection)
