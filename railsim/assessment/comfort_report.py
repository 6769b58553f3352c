"""Comfort at every measuring point on the floor of the car body, read part by part."""

from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats
from railsim.assessment import comfort
from railsim.assessment.record import PIECE, Record
from railsim.assessment.sperling import Direction, index_of_rms, sperling_weighted
from railsim.assessment.weighting import WK
from railsim.definitions.limits import Classes, ComfortLimits
from railsim.definitions.track.layout import curvature_sections
from railsim.definitions.vehicle.flatten import flatten
from railsim.errors import input_error
from railsim.result.filters import band_passed

NEAR = (0.85, 1.15)  # band around the frequency of hunting, over this frequency
SHOCKS = {"MTVV/a_w": 1.5, "VDV/(a_w T^1/4)": 1.75}
LEAST_SHARE, PERCEIVED = 0.25, 0.01  # of the largest axis; threshold of perception [m/s2]
MARGIN = 16.0  # s on either side of a part, for the lower band limit of 0.4 Hz of the weightings


@dataclass(frozen=True)
class PointComfort:
    """Comfort at one point."""

    sensor: str
    place: float  # along the vehicle, from the reference body forwards [m]
    mean: comfort.MeanComfort  # N_MV, N_VA, N_VD and the root mean squares of 5 s
    iso_rms: Floats  # weighted root mean squares after ISO 2631-1 along x, y, z [m/s2], float64[3]
    MTVV: Floats  # largest running root mean squares over 1 s, likewise [m/s2], float64[3]
    VDV: Floats  # vibration dose values, likewise [m/s1.75], float64[3]
    sperling: dict[str, float]  # wz ``lateral`` and ``vertical``
    transitions: tuple[comfort.TransitionComfort, ...]
    events: dict[str, float]  # largest P_DE by posture [%]
    # its share in the mean square of the weighted lateral acceleration; 0: none
    hunting: float = 0.0
    duration: float = np.nan  # of what counts [s]

    def record(self, limits: ComfortLimits) -> dict[str, object]:
        """Return the values as plain numbers and strings, SI, percentages in per cent."""
        largest = [float(value) for value in np.max(self.mean.continuous, axis=0)]
        return {
            "place": self.sensor, "x": self.place, "N_MV": self.mean.N_MV, "N_VA": self.mean.N_VA,
            "N_VD": self.mean.N_VD, "class": class_of(limits.mean_comfort, self.mean.N_MV),
            "blocks": self.mean.blocks,
            "continuous_largest": largest,  # along x, y, z; classes are those of y and z
            "continuous_class": [class_of(limits.continuous, value) for value in largest[1:]],
            "iso2631_rms": [float(v) for v in self.iso_rms],
            "iso2631_total": float(np.sqrt(np.sum(self.iso_rms**2))),
            "iso2631_MTVV": self.MTVV.tolist(), "iso2631_VDV": self.VDV.tolist(),
            "sperling": self.sperling,
            "P_CT": {
                posture: max((getattr(t, posture) for t in self.transitions), default=None)
                for posture in ("standing", "seated")
            },
            "P_DE": self.events, "hunting_share": self.hunting,
            "source": limits.mean_comfort.source, "checked": limits.mean_comfort.checked,
        }  # fmt: skip


def class_of(classes: Classes, value: float) -> str:
    """Name of the class of a value; empty for nan."""
    if np.isnan(value):
        return ""
    return next((name for end, name in classes.values if value < end), classes.above)


def comfort_report(record: Record) -> list[PointComfort]:
    """Comfort at all measuring points except those on bogie frames.

    `record`: Run with sensor readings, or with the motion of the bodies. Raises InputError: there
    are no measuring points; TooShort: the run is shorter than one block of 5 s.
    """
    record.need_quantities("comfort")
    names = [name for name in record.sensors if not name.startswith("frame_")]
    if not names:
        flat = flatten(record.result.vehicle())
        if flat.body(flat.reference).kind == "wheelset":
            found, allowed = "a vehicle of wheelsets alone", "one with a body that has a floor"
            raise input_error(record.name, found, allowed, "vehicle.bodies")
        allowed = "run it with settings.outputs.sensors=true"
        raise input_error(record.name, "is not in the result", allowed, "sensor_acceleration")
    columns = [list(record.sensors).index(name) for name in names]
    frequency = float(record.result.attributes.get("hunting_frequency", 0.0))
    sums = [_PointSums(frequency) for _ in names]
    for rows, counted in record.pieces(MARGIN):
        a = record.readings(rows)[0]
        for column, point in zip(columns, sums, strict=True):
            point.add(a[:, column], counted, record.rate)
    if not sums[0].blocks:
        allowed = "at least 5 s after the first 3 s"
        raise record.too_short("too short for one block of 5 s", allowed)
    transitions = _transitions(record, columns)
    return [
        PointComfort(
            name, record.sensor_offset(name),
            comfort.mean_comfort(np.concatenate(point.blocks), np.concatenate(point.back)),
            np.sqrt(point.iso / point.count), np.sqrt(point.largest),
            (point.fourth / record.rate) ** 0.25,
            {k: index_of_rms(float(np.sqrt(v / point.count))) for k, v in point.sperling.items()},
            tuple(transitions[number]), point.events,
            float(point.hunting / point.iso[1]) if frequency else 0.0,
            point.count / record.rate,
        )
        for number, (name, point) in enumerate(zip(names, sums, strict=True))
    ]  # fmt: skip


class _PointSums:
    """Sums and blocks of one point over the parts of a run that hunts at `frequency`, or 0 [Hz].

    ISO 2631-1:1997 of a seated person: Wd, Wd, Wk, factors 1; VDV = (integral of aw^4 dt)^(1/4).
    """

    def __init__(self, frequency: float) -> None:
        self.frequency = frequency
        self.hunting = 0.0
        self.blocks: list[Floats] = []
        self.back: list[Floats] = []
        self.iso, self.fourth, self.largest = np.zeros((3, 3))
        self.sperling: dict[Direction, float] = {"lateral": 0.0, "vertical": 0.0}
        self.events = {"standing": 0.0, "seated": 0.0}
        self.count = 0

    def add(self, a: Floats, counted: slice, rate: float) -> None:
        """Add a part: accelerations with margins, and which of them count."""
        floor, back = comfort.weighted_for_comfort(a, rate)
        blocks = comfort.block_rms(floor[counted], rate)
        if len(blocks):
            self.blocks.append(blocks)
            self.back.append(comfort.block_rms(back[counted], rate))
        size, count = counted.stop - counted.start, self.count
        iso = np.column_stack([floor[:, 0], floor[:, 1], WK.weighted(a[:, 2], rate)])
        self.iso += np.sum(iso[counted] ** 2, axis=0)
        self.fourth += np.sum(iso[counted] ** 4, axis=0)
        begin = counted.start - round(rate) * bool(count)  # windows reach into the part before
        running = comfort.running_mean(iso[begin : counted.stop] ** 2, rate, 1.0)
        self.largest = np.max([self.largest, np.max(running, axis=0, initial=0.0)], axis=0)
        self.count += size
        if self.frequency:
            low, high = (share * self.frequency for share in NEAR)
            near = band_passed(floor[:, 1], rate, low, high)[counted]
            self.hunting += float(np.sum(near**2))
        for axis, way in enumerate(self.sperling, start=1):
            ride = sperling_weighted(a[:, axis], rate, way)[counted]
            self.sperling[way] += float(np.sum(ride**2))
        # events over the end of the part before belong to neither of both
        before = round(comfort.EVENT_WINDOW * rate) if count else 0
        part = slice(counted.start - before, counted.stop)
        for posture, value in comfort.event_comfort(a[:, 1], rate, part).items():
            self.events[posture] = max(self.events[posture], np.nan_to_num(value))


def _transitions(record: Record, columns: list[int]) -> list[list[comfort.TransitionComfort]]:
    transitions: list[list[comfort.TransitionComfort]] = [[] for _ in columns]
    names = list(record.sensors)
    for section in curvature_sections(record.result.track()):
        if section.type != "CLO":
            continue
        rows = record.rows_between(section.begin, section.end, 4.0)
        time = record.time[rows]
        if len(time) < 2 or time[-1] - time[0] > 10.0 * PIECE:
            continue
        a, roll = record.readings(rows)
        for number, column in enumerate(columns):
            s = record.distance[rows] + record.sensor_offset(names[column])
            if s[0] > section.begin or s[-1] < section.end:
                continue
            begin, end = np.interp([section.begin, section.end], s, time)
            value = comfort.transition_comfort(time, a[:, column, 1], roll[:, column], begin, end)
            if value is not None:
                transitions[number].append(value)
    return transitions


def hunting_remark(record: Record, points: list[PointComfort]) -> str:
    """Sentence that names hunting as a cause of discomfort; empty where the vehicle does not."""
    most = max(points, key=lambda point: point.hunting)
    if not most.hunting:
        return ""
    return (
        f"hunting at {record.result.attributes['hunting_frequency']:.1f} Hz makes up "
        f"{100.0 * most.hunting:.0f} % of the mean square of the weighted lateral acceleration at "
        f"{most.sensor}"
    )


def shock_remark(points: list[PointComfort]) -> str:
    """Sentence where the rms may underestimate shocks, by the criteria of ISO 2631-1:1997, 6.3.3.

    MTVV/a_w > 1.5 or VDV/(a_w T^(1/4)) > 1.75, from memory; the largest of all points and axes but
    those along which MTVV or VDV is less than a quarter of that along another one, or MTVV below
    the threshold of perception (annex C, 0.01 to 0.02 m/s2, from memory).
    """
    exceedances = []
    for name, limit in SHOCKS.items():
        ratios = []
        for p in points:
            most, time = (p.MTVV, 1.0) if name == "MTVV/a_w" else (p.VDV, p.duration**0.25)
            for axis, value, rms, felt in zip("xyz", most, p.iso_rms, p.MTVV, strict=True):
                if felt >= PERCEIVED and value >= LEAST_SHARE * np.max(most):
                    ratios.append((float(value / rms / time), f"along {axis} at {p.sensor}"))
        ratio, place = max(ratios, default=(0.0, ""))
        if ratio > limit:
            exceedances.append(f"{name} {ratio:.2f} > {limit:g} {place}")
    end = "the rms of ISO 2631-1 may underestimate shocks: judge by MTVV and VDV, too"
    return f"{', '.join(exceedances)}: {end}" if exceedances else ""


def block_remark(points: list[PointComfort]) -> str:
    """Sentence if there are fewer blocks than the standard requires; otherwise empty."""
    blocks = points[0].mean.blocks
    few = f"{blocks} blocks of 5 s, EN 12299 requires {comfort.BLOCKS}"
    return few if blocks < comfort.BLOCKS else ""
