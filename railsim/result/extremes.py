"""Largest values of a result with the place where they occur, and values at mid-curve."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.definitions.layout import curvature_sections
from railsim.notation import Quantity
from railsim.result.data import Array, Result

PEAK_QUANTITIES = (
    "Q",
    "dQ_over_Q0",
    "Y",
    "Y_over_Q",
    "sum_Y",
    "sum_abs_Y",
    "wheelset_lateral",
    "wheelset_roll",
    "wheelset_yaw",
    "T_gamma",
)
"""What peak tables list unless told otherwise."""

BY_SIGN = ("dQ_over_Q0",)
"""Quantities whose largest and smallest value are two different questions (overload, unloading)."""


@dataclass(frozen=True)
class Peak:
    """An extreme value over time and over all places of a quantity.

    Attributes
    ----------
    quantity : Quantity
        What it is a value of.
    value : float
        The value, with its sign [SI].
    labels : mapping of str to str
        Where: dimension to name, such as ``wheelset`` and ``side``.
    time : float
        When [s].
    distance : float
        Distance of the reference body at that time [m].
    kind : {"abs", "max", "min"}
        Largest magnitude, largest or smallest value.
    """

    quantity: Quantity
    value: float
    labels: Mapping[str, str]
    time: float
    distance: float
    kind: str = "abs"

    @property
    def shown(self) -> float:
        """The value in the unit of printed tables, `quantity.shown_unit`."""
        return self.value * self.quantity.scale

    def record(self) -> dict[str, Any]:
        """Return the peak as plain numbers and strings, SI."""
        return {
            "quantity": self.quantity.name,
            "kind": self.kind,
            "value": self.value,
            "unit": self.quantity.unit,
            **self.labels,
            "time": self.time,
            "distance": self.distance,
        }


def peak(result: Result, name: str, kind: str = "abs") -> Peak:
    """Return the extreme value of a quantity.

    Parameters
    ----------
    result : Result
        Result with at least one instant.
    name : str
        Quantity with time as its first dimension.
    kind : {"abs", "max", "min"}
        Largest magnitude, largest or smallest value; values that are not a number are left out.

    Notes
    -----
    Of the quantities in the group ``peaks`` over all steps of the run, of others over its outputs.
    """
    if name in result.groups.get("peaks", {}):
        return _peak_of_steps(result, name, kind)
    array = result[name]
    keys: dict[str, Array] = {"abs": np.abs(array), "max": array, "min": -array}
    key = keys[kind]
    place = np.unravel_index(np.argmax(np.where(np.isnan(key), -np.inf, key)), key.shape)
    quantity = result.quantities[name]
    instant = place[0]
    return Peak(
        quantity,
        float(array[place]),
        _labels(result, name, place[1:]),
        float(result["time"][instant]),
        float(result["distance"][instant]),
        kind,
    )


def _peak_of_steps(result: Result, name: str, kind: str) -> Peak:
    found = result.groups["peaks"]
    rows = {"abs": slice(0, 2), "max": slice(0, 1), "min": slice(1, 2)}[kind]
    values = found[name][rows]
    key = {"abs": np.abs(values), "max": values, "min": -values}[kind]
    place = np.unravel_index(np.argmax(np.where(np.isnan(key), -np.inf, key)), key.shape)
    return Peak(
        result.quantities[name],
        float(values[place]),
        _labels(result, name, place[1:]),
        float(found[f"{name}_time"][rows][place]),
        float(found[f"{name}_distance"][rows][place]),
        kind,
    )


def peaks(result: Result, names: Iterable[str] | None = None) -> tuple[Peak, ...]:
    """Return the peaks of a result: by magnitude, and by sign for `BY_SIGN`.

    Parameters
    ----------
    result : Result
        Result of a run.
    names : iterable of str, optional
        Quantities; those of `PEAK_QUANTITIES` that the result has if not given.

    Returns
    -------
    tuple of Peak
        None of them where the run ended before its first instant was recorded.
    """
    if not len(result["time"]):
        return ()
    if names is None:
        names = [name for name in PEAK_QUANTITIES if name in result]
    found: list[Peak] = []
    for name in names:
        kinds = ("max", "min") if name in BY_SIGN else ("abs",)
        found.extend(peak(result, name, kind) for kind in kinds)
    return tuple(found)


@dataclass(frozen=True)
class MidCurve:
    """Values while the reference body passes the middle of a circular element.

    Attributes
    ----------
    radius : float
        Signed radius of the element, positive to the right [m].
    distance : float
        Distance of its middle along the track [m].
    time : float
        When the reference body is there [s].
    values : mapping of str to ndarray
        Quantity to its values, without the dimension time [SI].
    peaks : tuple of Peak
        Largest magnitude of every quantity over its places.
    """

    radius: float
    distance: float
    time: float
    values: Mapping[str, Array]
    peaks: tuple[Peak, ...]

    def record(self) -> dict[str, Any]:
        """Return the values as plain numbers and strings, SI."""
        return {
            "radius": self.radius,
            "distance": self.distance,
            "time": self.time,
            "values": {name: values.tolist() for name, values in self.values.items()},
            "largest": {peak.quantity.name: peak.value for peak in self.peaks},
        }


def mid_curves(result: Result, names: Iterable[str] | None = None) -> tuple[MidCurve, ...]:
    """Return the values at the middle of every circular element that was passed.

    They are interpolated linearly between the two instants around the middle.

    Parameters
    ----------
    result : Result
        Result with ``distance``.
    names : iterable of str, optional
        Quantities; those of `PEAK_QUANTITIES` that the result has if not given.
    """
    wanted = list(names) if names is not None else [n for n in PEAK_QUANTITIES if n in result]
    distance = result["distance"]
    found: list[MidCurve] = []
    if not len(distance):
        return ()
    for section in curvature_sections(result.track()):
        middle = 0.5 * (section.begin + section.end)
        if section.type == "CIR" and distance[0] <= middle <= distance[-1] > distance[0]:
            found.append(_mid_curve(result, wanted, 1.0 / section.start_value, middle))
    return tuple(found)


def _mid_curve(result: Result, names: list[str], radius: float, middle: float) -> MidCurve:
    distance = result["distance"]
    after = max(1, int(np.searchsorted(distance, middle)))
    share = (middle - distance[after - 1]) / (distance[after] - distance[after - 1])

    def there(name: str) -> Array:
        array = result[name]
        return np.asarray((1.0 - share) * array[after - 1] + share * array[after])

    values = {name: there(name) for name in names}
    time = float(there("time"))
    largest = []
    for name, array in values.items():
        place = np.unravel_index(np.argmax(np.abs(np.nan_to_num(array))), array.shape)
        labels = _labels(result, name, place)
        peak = Peak(result.quantities[name], float(array[place]), labels, time, middle)
        largest.append(peak)
    return MidCurve(radius, middle, time, values, tuple(largest))


def _labels(result: Result, name: str, place: tuple[Any, ...]) -> dict[str, str]:
    dims = result.quantities[name].dims[1:]
    names = zip(dims, place, strict=True)
    return {dim: result.coordinates[dim][index] for dim, index in names}
