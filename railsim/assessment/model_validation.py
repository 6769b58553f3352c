"""`validate_model`: simulated against measured runs, section by section (EN 14363, Annex T).

In each section the same values are formed of measured and simulated channels, with the filters and
percentiles of the assessment.  The difference of a value counts positive where the simulation
overestimates its magnitude, D = (S - M) sign(M); mean and standard deviation of all differences of
a quantity stand against limits.  Values of sections in which a channel has a gap are left out.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from railsim.arrays import Flags, Floats
from railsim.assessment.criteria import FORCES
from railsim.assessment.model_comparison import (
    QUANTITIES,
    Compared,
    Comparison,
    ModelValidation,
    Overlay,
    Pair,
)
from railsim.assessment.sections import TestSection, section_length, track_sections
from railsim.assessment.signals import OUTWARDS, Signal, in_band
from railsim.definitions.limits import RunningLimits, ValidationLimits
from railsim.definitions.loading import load, load_running_limits, load_track
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.loads import DESIGN
from railsim.definitions.vehicle.tables import Service
from railsim.errors import Fault, Faults, argument_error, input_error
from railsim.measurement import Measurement, load_measurement
from railsim.measurement.alignment import MOST_SHIFT, common_shift
from railsim.measurement.counterpart import amplified, check_channels, counterparts, rests, series
from railsim.measurement.likeness import suspicions
from railsim.notation import SIDES
from railsim.result import Result
from railsim.result.filters import low_passed
from railsim.result.sensors import all_sensors

LIKE = 50.0  # 1/s, at which signs and clocks are compared
START = 3.0  # s after the start of a run that are not compared
UNKNOWN = 0.01  # share of a section that a gap may take
MOST = 0.9  # of a measured run: what is compared is said below it
SAME_SPEED = 0.02  # share by which the speeds of one run may differ
RIGHT = {"sum_Y": -1, "bodyy": 1}
"""Sense of what is positive outwards in right-hand curves: -1 for forces on the rails."""
SERVICE = Service(admissible_speed=60.0, cant_deficiency=0.15)
"""Where the vehicle states none: only the length of the sections depends on the speed."""


def validate_model(
    measured: Measurement | str | Path | Sequence[Measurement | str | Path],
    results: Result | Sequence[Result],
    *,
    limits: ValidationLimits | str | Path = "validation_en14363_t",
    zones: str | Path = "en14363",
) -> ModelValidation:
    """Compare simulated with measured runs, section by section.

    Parameters
    ----------
    measured : Measurement, str, Path or several
        Measured runs.
    results : Result or several
        One for each, in the same order.
    limits : ValidationLimits, str or Path
        Limits of the differences.
    zones : str or Path
        Limits file of running tests: lengths of sections by zone.

    Returns
    -------
    ModelValidation

    Raises
    ------
    InputError
        Channels that the vehicle or the result does not have; no section; unequal numbers.
    """
    files = [measured] if isinstance(measured, Measurement | str | Path) else list(measured)
    simulations = [results] if isinstance(results, Result) else list(results)
    if len(simulations) != len(files) or not files:
        found = f"{len(simulations)} results for {len(files)} measured run{'s' * (len(files) != 1)}"
        raise argument_error("results", found, "one for each", option="RESULT.h5")
    runs, limits = inputs(files, limits)
    tests = load_running_limits(zones)
    pairs: list[Pair] = []
    overlays: list[Overlay] = []
    remarks: list[str] = []
    lacking: set[str] = set()
    for run, result in zip(runs, simulations, strict=True):
        run_pair = _Run.from_result(run, result)
        overlays += run_pair.overlays()
        pairs += run_pair.pairs(tests, limits)
        remarks += run_pair.remarks
        lacking |= run_pair.lacking
    if not pairs:
        allowed = "a longer run, or channels of Q, Y or the body's accelerations that change"
        raise input_error(runs[0].name, "no section", allowed, "distance")
    Q0 = float(np.mean([np.mean(result["Q0"]) for result in simulations]))
    comparisons = []
    for name, quantity in QUANTITIES.items():
        members = tuple(pair for pair in pairs if pair.quantity == name)
        if (members or name in lacking) and name in limits.limits:
            limit = limits.limits[name].at(Q0)
            mean, least = limits.mean * limit, limits.sections
            comparisons.append(Comparison(quantity, members, limit, mean, least))
            remarks += comparisons[-1].offsets()
    if not all(limit.checked for limit in limits.limits.values()):
        remarks.append(f"limits of {limits.edition} not checked against the printed standard")
    distinct = tuple(dict.fromkeys(remarks))
    names = tuple(run.name for run in runs)
    head = simulations[0].vehicle().name, names, tuple(comparisons), tuple(overlays)
    return ModelValidation(*head, limits.edition, distinct)


def inputs(
    measured: Sequence[Measurement | str | Path], limits: ValidationLimits | str | Path
) -> tuple[list[Measurement], ValidationLimits]:
    """Return measured runs and limits; raises InputError: what is wrong with them."""
    runs = [run if isinstance(run, Measurement) else load_measurement(run) for run in measured]
    names = [run.name for run in runs]
    if twice := [name for name in dict.fromkeys(names) if names.count(name) > 1]:
        found, allowed = f"two runs named '{twice[0]}'", "a name for each run"
        raise argument_error("measured", found, allowed, option="MEASURED.toml")
    if not isinstance(limits, ValidationLimits):
        limits = load(ValidationLimits, limits)
    unknown = sorted(set(limits.limits) - set(QUANTITIES))
    if unknown:
        allowed = "allowed: " + ", ".join(QUANTITIES)
        raise input_error("limits", "unknown quantity", allowed, f"limits.{unknown[0]}")
    return runs, limits


def matched_results(measured: Sequence[Measurement], results: Mapping[str, Result]) -> list[Result]:
    """Return for each measured run the result on its track, at its speed (2 %) and in its load.

    `results`: By names, such as those of a study. Raises InputError: runs without a result of this
    kind, or with several.
    """
    matches: list[Result] = []
    faults = Faults()
    for run in measured:
        name = run.definition.track
        track = None if name is None else load_track(name)
        speed = float(np.mean(run.speed))
        fits = {n: r for n, r in results.items() if not _contradictions(run, r, track)}
        if len(fits) == 1:
            matches += fits.values()
            continue
        found = f"{len(fits)} results" + (f": {', '.join([*fits][:5])}" if fits else "")
        on = "any track" if track is None else f"track '{track.name}'"
        allowed = f"one on {on} at {speed:.1f} m/s in load '{run.definition.load or DESIGN}'; " + (
            "name the file" if fits else f"there are {', '.join([*results][:5]) or 'none'}"
        )
        faults.append(Fault(run.name, "", found, allowed))
    faults.check()
    return matches


def _contradictions(run: Measurement, result: Result, track: Track | None) -> list[str]:
    """Return in what a result is not that of a measured run."""
    contradictions = []
    if track is not None and not _same_track(result.track(), track):
        contradictions.append(f"simulated on another track, '{result.track().name}'")
    speed = float(np.mean(run.speed))
    inside = run.part(float(result["distance"][0]), float(result["distance"][-1]))
    if len(inside.speed):
        speed = float(np.mean(inside.speed))
    time, distance = result["time"], result["distance"]
    simulated = float((distance[-1] - distance[0]) / (time[-1] - time[0]))
    if abs(simulated - speed) > SAME_SPEED * speed:
        contradictions.append(f"measured at {speed:.1f} m/s, simulated at {simulated:.1f} m/s")
    loads = run.definition.load or DESIGN, result.vehicle().load or DESIGN
    if loads[0] != loads[1]:
        contradictions.append(f"measured in load '{loads[0]}', simulated in '{loads[1]}'")
    return contradictions


def _same_track(first: Track, second: Track) -> bool:
    """Return whether two tracks have one course, one gauge and the same irregularities."""

    def course(track: Track) -> list[object]:
        rows = [irregularity.model_dump() for irregularity in track.irregularities]
        # a file counts by its name: the folder may be another by now
        by_name = [
            {k: Path(v).name if k == "file" and v else v for k, v in row.items()} for row in rows
        ]
        return [track.plan, track.cant, track.vertical, track.gauge, by_name]

    return course(first) == course(second)


@dataclass(eq=False)
class _Channel:
    """A measured channel and its simulated counterpart, at the places of the measured values."""

    name: str
    quantity: str  # with its labels, such as ``Q:1:left``
    ahead: float  # arc length of its place relative to the reference body [m]
    measured: Floats
    simulated: Floats
    unknown: Flags  # gaps of the measurement


class _Place(NamedTuple):
    """A quantity at one place of the vehicle: what it is formed of, measured and simulated."""

    channels: list[_Channel]
    both: list[Signal]


@dataclass(eq=False)
class _Run:
    """A measured run and its simulation; values at the places of the measured ones."""

    measurement: Measurement
    result: Result
    channels: list[_Channel]
    remarks: list[str]
    resting: dict[str, set[float]] = field(default_factory=dict)  # channels: begins of sections
    lacking: set[str] = field(default_factory=set)  # quantities that they give no value of

    @classmethod
    def from_result(cls, run: Measurement, result: Result) -> "_Run":
        check_channels(run.name, run, result.vehicle())
        selections = counterparts(run)
        time, distance = result["time"], result["distance"]
        rate = (len(time) - 1) / float(time[-1] - time[0])
        simulated, faults = {}, Faults()
        for name, selection in selections.items():
            try:
                values = np.asarray(series(result, selection))
            except KeyError as error:
                key = f"channels.{name}"
                message = str(error.args[0])
                faults.append(Fault(run.name, key, message, "run it with outputs for it"))
                continue
            simulated[name] = amplified(values, rate, run.channel(name))
        faults.check()
        moved, remarks = _move_to_match(run, distance, simulated)
        on = run.definition.track
        ending = f"{result.status}, {result.attributes.get('status_reason', '')}".rstrip(", ")
        if result.status == "derailed":
            allowed = "a model with which the run goes on as the measured one"
            raise input_error(run.name, f"the simulated run: {ending}", allowed)
        if result.status != "complete":
            remarks.append(f"simulated up to {distance[-1]:.0f} m only ({ending})")
        remarks += _contradictions(run, result, None if on is None else load_track(on))
        begin = float(np.interp(time[0] + START, time, distance))
        part = moved.part(begin, float(distance[-1]))
        if len(part.time) < 10:
            found = f"{moved.distance[0]:.0f} to {moved.distance[-1]:.0f} m"
            allowed = f"measured between {begin:.0f} and {distance[-1]:.0f} m, as simulated"
            raise input_error(run.name, found, allowed, "distance")
        (a, b), (c, d) = moved.distance[[0, -1]], part.distance[[0, -1]]
        if d - c < MOST * (b - a):
            remarks.append(
                f"measured from {a:.0f} to {b:.0f} m, compared from {c:.0f} to {d:.0f} m"
            )
        rising = np.concatenate([[True], np.diff(distance) > 0.0])
        row, channels = np.arange(len(part.time)), []
        for name, selection in selections.items():
            valid = ~np.isnan(part[name])
            measured = np.zeros(len(row))
            if valid.any():
                measured = np.interp(row, row[valid], part[name][valid])
            x = _interpolate(part.distance, distance[rising], simulated[name][rising])
            ahead = _ahead(result, selection)
            channels.append(_Channel(name, selection, ahead, measured, x, ~valid))
        every = max(1, round(part.rate / LIKE))

        def thin(x: Floats) -> Floats:
            return low_passed(x, part.rate, 0.4 * LIKE)[::every]

        measured_thin = {channel.name: thin(channel.measured) for channel in channels}
        simulated_thin = {channel.name: thin(channel.simulated) for channel in channels}
        remarks += suspicions(measured_thin, simulated_thin, selections, every / part.rate)
        sentences = [f"{run.name}: {message}" for message in (*run.remarks, *remarks)]
        return cls(part, result, channels, sentences)

    def overlays(self) -> Iterator[Overlay]:
        run = self.measurement
        for c in self.channels:
            measured, simulated = (in_band(x, run.rate, FORCES) for x in (c.measured, c.simulated))
            measured = np.where(c.unknown, np.nan, measured)
            head = run.name, c.name, c.quantity, run.distance, run.rate
            yield Overlay(*head, measured, simulated)

    def pairs(self, tests: RunningLimits, limits: ValidationLimits) -> list[Pair]:
        run, track = self.measurement, self.result.track()
        s, ahead = run.distance, [channel.ahead for channel in self.channels]
        covered = float(s[0]) + max(0.0, *ahead), float(s[-1]) + min(0.0, *ahead)

        def speed_at(distance: float) -> float:
            return float(np.interp(distance, s, run.speed))

        service = self.result.vehicle().service or SERVICE
        quantities = [q for q in QUANTITIES.values() if q.name in limits.limits]
        places = {quantity.name: [*self._places(quantity)] for quantity in quantities}
        pairs: list[Pair] = []
        number = 0
        for section in track_sections(track, tests, service, covered, speed_at):
            if not section.zone:
                continue
            length = section_length(tests.zones[section.zone], section.speed)
            if section.end - section.begin < length - 1e-6:
                continue
            number += 1
            section = replace(section, zone="")  # very large radii are compared as curves
            for quantity in quantities:
                if section.turn or not quantity.curves:
                    for place in places[quantity.name]:
                        pairs += self._in_section(quantity, section, place)
        self.remarks += [
            f"{run.name}: {name} does not change in {len(begins)} of {number} sections: a dead "
            "sensor? It is left out there."
            for name, begins in self.resting.items()
        ]
        return pairs

    def _places(self, quantity: Compared) -> Iterator[_Place]:
        """Return a quantity at all places where it, or what it follows from, was measured."""
        channels = {channel.quantity: channel for channel in self.channels}
        base = quantity.base
        for selection, channel in channels.items():
            kind, *labels = selection.split(":")
            parts, side = [channel], None
            if kind == base:
                side = SIDES.index(labels[1]) if len(labels) > 1 else None
            elif base == "Y_over_Q" and kind == "Y" and f"Q:{labels[0]}:{labels[1]}" in channels:
                if f"{base}:{labels[0]}:{labels[1]}" in channels:
                    continue
                side = SIDES.index(labels[1])
                parts.append(channels[f"Q:{labels[0]}:{labels[1]}"])
            elif base == "sum_Y" and kind == "Y" and labels[1] == "left":
                if f"Y:{labels[0]}:right" not in channels or f"sum_Y:{labels[0]}" in channels:
                    continue
                parts.append(channels[f"Y:{labels[0]}:right"])
            elif kind != "sensor_acceleration" or not _on_floor(base, *labels):
                continue
            label = labels[0] if base.startswith("body") else f"wheelset {labels[0]}"
            s = self.measurement.distance + channel.ahead
            sources = [[c.measured for c in parts], [c.simulated for c in parts]]
            values = [_combine(quantity, self.measurement.rate, x, side) for x in sources]
            signals = [Signal(x[:, None], s[:, None], [(label, side)]) for x in values]
            yield _Place(parts, signals)

    def _in_section(self, quantity: Compared, section: TestSection, place: _Place) -> list[Pair]:
        """Return the values of a quantity at a place in a section."""
        channels, signals = place
        ((label, side),) = signals[0].places
        wheel = section.wheel(side)
        inside = slice(*np.searchsorted(signals[0].s[:, 0], [section.begin, section.end]))
        gaps = (np.mean(channel.unknown[inside]) for channel in channels)
        if (wheel == "inner" and quantity.base != "Q") or any(gap > UNKNOWN for gap in gaps):
            return []
        dead = [c for c in channels if rests(c.measured[inside]) and not rests(c.simulated[inside])]
        for channel in dead:
            self.resting.setdefault(channel.name, set()).add(section.begin)
        if dead:
            self.lacking.add(quantity.name)
            return []
        outwards, values = RIGHT.get(quantity.base, 0) * section.turn or 1.0, []
        for signal in signals:
            x = outwards * signal.in_section(0, section, quantity.window)
            values.append(quantity.value(x, section.turn) if len(x) else [])
        head = quantity.name, self.measurement.name, f"{label} {wheel}".rstrip()
        ends = section.begin, section.end, section.radius
        if not np.isfinite(np.concatenate(values)).all():
            self.remarks.append(
                f"{self.measurement.name}: no {quantity.name} of {head[2]} from "
                f"{section.begin:.0f} to {section.end:.0f} m: a wheel without load"
            )
            return []
        return [Pair(*head, *ends, m, v) for m, v in zip(*values, strict=False)]


def _interpolate(places: Floats, s: Floats, x: Floats) -> Floats:
    """Values at other places, by a cubic spline: a straight line takes 4 % of 18 Hz at 200 1/s."""
    from scipy.interpolate import CubicSpline

    if not np.isfinite(x).all():  # Y/Q of a wheel that lifts
        return np.interp(places, s, x)
    return np.asarray(CubicSpline(s, x)(places))


def _on_floor(base: str, sensor: str, axis: str) -> bool:
    return base == f"body{axis}" and not sensor.startswith(("frame", "axlebox"))


def _combine(quantity: Compared, rate: float, channels: list[Floats], side: int | None) -> Floats:
    """Return a quantity over time, of a wheel outwards positive, of one channel or two."""
    first, *second = [in_band(x, rate, quantity.band) for x in channels]
    outwards = 1.0 if side is None else float(OUTWARDS[side])
    if quantity.base == "Y":
        return outwards * first
    if second and quantity.base == "Y_over_Q":
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(second[0] > 0.0, outwards * first / second[0], np.nan))
    return first + second[0] if second else first


def _ahead(result: Result, selection: str) -> float:
    """Arc length of a channel's place relative to the reference body [m]."""
    base, *labels = selection.split(":")
    if base.startswith("sensor_"):
        return all_sensors(result.vehicle())[labels[0]].along
    names = list(result.wheelsets)
    if not labels or not (labels[0] in names or labels[0].isdecimal()):
        return 0.0
    flat = flatten(result.vehicle())
    k = names.index(labels[0]) if labels[0] in names else int(labels[0]) - 1
    return flat.along(flat.of_kind("wheelset"))[k]


def _move_to_match(
    run: Measurement, distance: Floats, simulated: Mapping[str, Floats]
) -> tuple[Measurement, list[str]]:
    """Return a run with its arc length moved to match the simulation, and what was done."""
    signals = ((run.distance, run[name], distance, x) for name, x in simulated.items())
    best = common_shift(signals)
    if best is None:
        found = f"no channel is like the simulated one at places within {MOST_SHIFT:g} m"
        return run, [f"{found}: the place on the track is not checked"]
    remarks = []
    if abs(best.shift) > 1.0 or abs(best.stretch) > 1e-3:
        remarks = [f"arc length moved by {best.shift:+.1f} m and {1e3 * best.stretch:+.2f} m/km "
                 "to match the simulation"]  # fmt: skip
    return run.moved(best.shift, best.stretch), remarks
