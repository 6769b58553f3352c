"""Largest values of a result with the positions where they occur, and values at mid-curve."""

import math
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import starmap
from typing import Any

import numpy as np

from railsim.arrays import Floats, first_largest
from railsim.definitions.track.definition import Track
from railsim.definitions.track.elements import Section
from railsim.definitions.track.layout import curvature_sections
from railsim.notation import Quantity
from railsim.result.data import Result, check_result
from railsim.result.filters import even_step, low_passed, outward_quotient

FORCES = ("Q", "dQ_over_Q0", "Y", "Y_over_Q", "sum_Y", "sum_abs_Y")
"""Quantities whose peaks are also given after the low pass."""
PEAK_QUANTITIES = (*FORCES, "wheelset_lateral", "wheelset_roll", "wheelset_yaw", "T_gamma")
"""Default quantities of peak tables."""

LOW_PASS = 20.0  # low pass of forces in EN 14363 [Hz]

LEAST_RATE = 2.5  # outputs per period of the low pass at least
EDGE = 2.0  # periods of the low pass at either end of a record that depend on what is beyond
LOADED = 0.05  # of the static load; below it the low pass's ringing decides on Y/Q
DEVIATION = (15.87, 84.13)
"""Percentiles that are one standard deviation from the median of a normal distribution."""
SETTLING = 1.0 / 3.0  # share of a full curve in which the vehicle settles

SETTLES, CROSSINGS = 0.4, 6  # what is still settling in a full curve, see `_settling`

BY_SIGN = ("dQ_over_Q0",)
"""Quantities whose largest and smallest value are two different questions (overload, unloading)."""


@dataclass(frozen=True)
class Peak:
    """An extreme value over time and over all wheels, bodies or sensors of a quantity.

    `smooth`: The same extreme value of the quantity after a low pass of `LOW_PASS`; None where it
    is not known: outputs too seldom, or not at equal times [SI].
    """

    quantity: Quantity
    value: float  # with its sign [SI]
    labels: Mapping[str, str]  # where: dimension to name, such as ``wheelset`` and ``side``
    time: float  # [s]
    distance: float  # of the reference body at that time [m]
    kind: str = "abs"  # largest magnitude; or "max", "min": largest or smallest value
    smooth: float | None = None

    @property
    def shown(self) -> float:
        """The value in the unit of printed tables, `quantity.shown_unit`."""
        return self.value * self.quantity.scale

    def record(self) -> dict[str, Any]:
        """Return the peak as plain numbers and strings, SI."""
        return {
            "quantity": self.quantity.name, "kind": self.kind, "value": self.value,
            "unit": self.quantity.unit, **self.labels, "time": self.time, "distance": self.distance,
            **({} if self.smooth is None else {"low_pass_20_hz": self.smooth}),
        }  # fmt: skip


def peak(result: Result, name: str, kind: str = "abs") -> Peak:
    """Return the extreme value of a quantity over the part of the run that is evaluated.

    `result`: Result with at least one instant. `name`: Quantity with time as its first dimension.
    `kind` ({"abs", "max", "min"}): Largest magnitude, largest or smallest value; values that are
    not a number are left out.

    Of the quantities in the group ``peaks`` over all steps of the run, of others over its outputs;
    from the attribute ``evaluation_start`` on, in files without it over the whole run.
    """
    step_peaks = result.groups.get("peaks", {})
    if name in step_peaks:
        rows = {"abs": slice(0, 2), "max": slice(0, 1), "min": slice(1, 2)}[kind]
        values, times, distances = (step_peaks[name + e][rows] for e in ("", "_time", "_distance"))
        index = row = _extreme(values, kind)
    else:
        rows = evaluation_rows(result)
        values = result.part(name, rows)
        times, distances = result["time"][rows], result["distance"][rows]
        index = _extreme(values, kind)
        row = index[:1]
    value, labels = float(values[index]), _labels(result, name, index[1:])
    place = float(times[row]), float(distances[row])
    return Peak(result.quantities[name], value, labels, *place, kind)


def evaluation_rows(result: Result) -> slice:
    """Instants of a result that peaks are evaluated over; all where none is in that part."""
    begin = float(result.attributes.get("evaluation_start", -math.inf))
    first = int(np.searchsorted(result["time"], begin - 1e-9))
    return slice(first if first < len(result["time"]) else 0, None)


def _extreme(array: Floats, kind: str) -> tuple[Any, ...]:
    """Index of the extreme value over time and wheels; of wheels with equal ones of the first.

    Values that are not a number are left out.
    """
    key = np.abs(array) if kind == "abs" else array if kind == "max" else -array
    wheel: Any = first_largest(np.fmax.reduce(key, axis=0))
    over_time = key[:, *wheel]
    return int(np.argmax(np.where(np.isnan(over_time), -np.inf, over_time))), *wheel


def _smoothed(result: Result, name: str, rate: float, cache: dict[str, Floats]) -> Floats | None:
    """Return a quantity after a low pass of `LOW_PASS` without phase, over the evaluated part.

    Butterworth of order 4; without the `EDGE` of the record, whose last value is unfiltered.  Y/Q
    is the quotient of both after the low pass, so that a wheel that has lifted does not spoil the
    rest, where `LOADED` of the static load are left.  None where there are gaps.

    `rate`: outputs per second; `cache` keeps what has been filtered of this result, and is filled.
    """

    def low_pass(part: str) -> Floats:
        if part not in cache:
            cache[part] = low_passed(result[part], rate, LOW_PASS)
        return cache[part]

    if name == "Y_over_Q" and {"Y", "Q"} <= set(result):
        loaded = low_pass("Q") > (LOADED * result["Q0"] if "Q0" in result else 0.0)
        smooth = np.where(loaded, outward_quotient(low_pass("Y"), low_pass("Q")), np.nan)
    elif np.isnan(result[name]).any():
        return None
    elif name == "dQ_over_Q0" and {"Q", "Q0"} <= set(result):
        smooth = low_pass("Q") / result["Q0"] - 1.0
    elif name == "sum_Y" and "Y" in result:
        smooth = low_pass("Y")[..., 0] + low_pass("Y")[..., 1]
    else:
        smooth = low_pass(name)
    edge = math.ceil(EDGE / LOW_PASS * rate)
    return np.asarray(smooth[max(edge, evaluation_rows(result).start) : -edge])


def peaks(result: Result, names: Iterable[str] | None = None) -> tuple[Peak, ...]:
    """Return the peaks of a result: by magnitude, and by sign for `BY_SIGN`.

    `names`: Quantities; those of `PEAK_QUANTITIES` that the result has if not given. Returns: none
    where the run ended before its first instant was recorded.
    """
    chosen = _quantity_names(result, names)
    if not len(result["time"]):
        return ()
    cache: dict[str, Floats] = {}
    extremes: list[Peak] = []
    step = even_step(result["time"]) or math.inf
    often = step * LOW_PASS * LEAST_RATE <= 1.0
    for name in chosen:
        filtered = often and name in FORCES
        smooth = _smoothed(result, name, 1.0 / step, cache) if filtered else None
        for kind in ("max", "min") if name in BY_SIGN else ("abs",):
            extreme = peak(result, name, kind)
            if smooth is not None and not np.isnan(smooth).all():
                extreme = replace(extreme, smooth=float(smooth[_extreme(smooth, kind)]))
            extremes.append(extreme)
    return tuple(extremes)


@dataclass(frozen=True)
class MidCurve:
    """Values in a circular element: at its middle, and over the full curve.

    `medians`, `scatter`: Median over the full curve, and half the distance between the percentiles
    15.87 and 84.13, which is one standard deviation of a normal distribution [SI]. `full_curve`:
    Where the reference body is while all wheelsets are in the full curve, without the first third
    of it [m]; where the curve is shorter than the vehicle, its middle. `settling`: Whether the
    scatter is mostly that of values on their way to a steady state, on smooth rails.
    """

    radius: float  # signed, positive to the right [m]
    distance: float  # of its middle along the track [m]
    time: float  # when the reference body is there [s]
    values: Mapping[str, Floats]  # by quantity, without the dimension time [SI]
    peaks: tuple[Peak, ...]  # largest magnitude of every quantity over its dimensions
    medians: Mapping[str, Floats]
    scatter: Mapping[str, Floats]
    median_peaks: tuple[Peak, ...]  # largest median of every quantity over its dimensions
    full_curve: tuple[float, float]
    settling: bool

    def record(self) -> dict[str, Any]:
        """Return the values as plain numbers and strings, SI."""
        return {
            "radius": self.radius, "distance": self.distance, "time": self.time,
            "values": {name: values.tolist() for name, values in self.values.items()},
            "largest": {peak.quantity.name: peak.value for peak in self.peaks},
            "largest_medians": {peak.quantity.name: peak.value for peak in self.median_peaks},
            "full_curve": list(self.full_curve), "settling": self.settling,
            "medians": {name: values.tolist() for name, values in self.medians.items()},
            "scatter": {name: values.tolist() for name, values in self.scatter.items()},
        }  # fmt: skip


def mid_curves(
    result: Result, names: Iterable[str] | None = None, *, track: Track | None = None
) -> tuple[MidCurve, ...]:
    """Return the values at the middle of every circular element that was passed.

    Those at the middle are interpolated linearly between the two instants around it.

    `result`: With ``distance``. `names`: Quantities; those of `PEAK_QUANTITIES` that the result has
    if not given. `track`: That of the result; by default it is rebuilt from the text that the
    result carries.
    """
    chosen, distance = _quantity_names(result, names), result["distance"]
    if len(distance) < 2 or not distance[0] < distance[-1]:
        return ()
    track = track or result.track()
    return tuple(
        _mid_curve(result, chosen, arc, smooth=not track.irregularities)
        for arc in curvature_sections(track)
        if arc.type == "CIR" and distance[0] <= 0.5 * (arc.begin + arc.end) <= distance[-1]
    )


def _quantity_names(result: Result, names: Iterable[str] | None) -> list[str]:
    check_result(result)
    return [n for n in PEAK_QUANTITIES if n in result] if names is None else list(names)


def _full_curve(result: Result, section: Section) -> tuple[float, float]:
    """Part of the way over which the whole vehicle is in the full curve, less its first third."""
    ahead = behind = 0.0
    if "wheelset_distance" in result:
        offset = result["wheelset_distance"][0] - result["distance"][0]
        ahead, behind = float(np.max(offset)), float(np.min(offset))
    begin, end = section.begin - behind, section.end - ahead
    begin += SETTLING * (end - begin)
    middle = 0.5 * (section.begin + section.end)
    return (begin, end) if begin < end else (middle, middle)


def _mid_curve(result: Result, names: list[str], section: Section, *, smooth: bool) -> MidCurve:
    radius, middle = 1.0 / section.start_value, 0.5 * (section.begin + section.end)
    distance = result["distance"]
    after = max(1, int(np.searchsorted(distance, middle)))
    share = (middle - distance[after - 1]) / (distance[after] - distance[after - 1])

    def at_middle(name: str) -> Floats:
        array = result[name]
        return np.asarray((1.0 - share) * array[after - 1] + share * array[after])

    values = {name: at_middle(name) for name in names}
    time = float(at_middle("time"))

    def largest(name: str, array: Floats) -> Peak:
        index = _extreme(array[None], "abs")[1:]
        labels = _labels(result, name, index)
        return Peak(result.quantities[name], float(array[index]), labels, time, middle)

    begin, end = _full_curve(result, section)
    first, last = np.searchsorted(distance, begin), np.searchsorted(distance, end, "right")
    medians, scatter, changes = _over_curve(result, slice(int(first), int(last)), values)
    peaks, steady = (tuple(starmap(largest, arrays.items())) for arrays in (values, medians))
    statistics = values, peaks, medians, scatter, steady, (begin, end)
    unsettled = bool(smooth and len(changes) and np.mean(changes) > 0.5)
    return MidCurve(radius, middle, time, *statistics, unsettled)


def _over_curve(
    result: Result, rows: slice, values: Mapping[str, Floats]
) -> tuple[dict[str, Floats], dict[str, Floats], Floats]:
    """Medians, scatter and what settles in a part of the run; with one instant those of `values`.

    The quantities side by side, each component a row.
    """
    parts = {name: result.part(name, rows) for name in values}
    if not parts or len(next(iter(parts.values()))) < 2:
        return dict(values), {name: np.zeros_like(x) for name, x in values.items()}, np.zeros(0)
    stacked = np.concatenate([part.reshape(len(part), -1).T for part in parts.values()])
    percents = DEVIATION[0], 50.0, DEVIATION[1]
    gaps = np.isnan(stacked).any(axis=1)
    bounds = np.empty((3, len(stacked)))
    bounds[:, ~gaps] = np.percentile(stacked[~gaps], percents, axis=1)
    # Y/Q is undefined for an unloaded wheel; where there is none, it takes half of the time
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a wheel that never carries: NaN
        bounds[:, gaps] = np.nanpercentile(stacked[gaps], percents, axis=1)
    deviation = 0.5 * (bounds[2] - bounds[0])
    ends = np.cumsum([array.size for array in values.values()])[:-1]

    def by_name(flat: Floats) -> dict[str, Floats]:
        pairs = zip(values.items(), np.split(flat, ends), strict=True)
        return {name: part.reshape(array.shape) for (name, array), part in pairs}

    return by_name(bounds[1]), by_name(deviation), _settling(stacked, bounds[1])


def _settling(values: Floats, medians: Floats) -> Floats:
    """Which rows are on their way to steady values; not those that do not change or have gaps.

    On smooth rails a vehicle in a full curve has a steady state: what changes so slowly that it
    crosses its median fewer than `CROSSINGS` times is on its way there, and so is what decays,
    by mean square distances from the last values in the two halves (a stationary vibration: 1,
    an even drift: 0.14).
    """
    varies = np.ptp(values, axis=1) > 0.0
    rows, medians = values[varies], medians[varies]
    length = rows.shape[1]
    last = rows[:, -max(1, length // 10) :].mean(axis=1)
    square = (rows - last[:, None]) ** 2
    before, after = np.mean(square[:, : length // 2], axis=1), np.mean(square[:, length // 2 :], 1)
    above = rows > medians[:, None]
    crossings = np.count_nonzero(above[:, 1:] != above[:, :-1], axis=1)
    return np.asarray((after < SETTLES * before) | (crossings < CROSSINGS))


def _labels(result: Result, name: str, indices: tuple[Any, ...]) -> dict[str, str]:
    dims = result.quantities[name].dims[1:]
    return {dim: result.coordinates[dim][index] for dim, index in zip(dims, indices, strict=True)}


FACTS = (
    "status", "status_reason", "step", "wall_time", "cpu_time", "real_time_factor",
    "patches_out_of_range",
)  # fmt: skip

OF_FACTS = frozenset({*PEAK_QUANTITIES, "Q0", "time", "distance", "wheelset_distance"})
"""Quantities that facts are taken from."""


def run_facts(result: Result, track: Track | None = None) -> dict[str, Any]:
    """Return how a run ended, its remarks, peaks and mid-curve values as plain data [SI].

    `track` is that of the result, where it is at hand.
    """
    return {
        **{name: result.attributes[name] for name in FACTS if name in result.attributes},
        "remarks": list(result.remarks),
        "hunts": "hunting_frequency" in result.attributes,
        "peaks": [peak.record() for peak in peaks(result)],
        "mid_curves": [curve.record() for curve in mid_curves(result, track=track)],
    }
