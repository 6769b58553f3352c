"""`validate_model`: simulated against measured runs, section by section (EN 14363, Annex T).

In each section the same values are formed of measured and simulated channels, with the filters and
percentiles of the assessment.  The difference of a value counts positive where the simulation
overestimates its magnitude, D = (S - M) sign(M); mean and standard deviation of all differences of
a quantity stand against limits.  Values of sections in which a channel has a gap are left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

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
from railsim.assessment.signals import OUTWARDS, Signal, passed
from railsim.definitions.limits import RunningLimits, ValidationLimits
from railsim.definitions.loading import load, load_running_limits, load_track
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.loads import DESIGN
from railsim.definitions.vehicle.tables import Service
from railsim.errors import Fault, InputError, argument_error, input_error
from railsim.measurement import Measurement, load_measurement
from railsim.measurement.alignment import Shift, shift_of
from railsim.measurement.counterpart import amplified, check_channels, compared, series
from railsim.measurement.likeness import suspicions
from railsim.notation import SIDES
from railsim.result import Result
from railsim.result.filters import low_passed
from railsim.result.sensors import all_sensors

LIKE = 50.0  # 1/s, at which signs and clocks are compared
START = 3.0  # s after the start of a run that are not compared
UNKNOWN = 0.01  # share of a section that a gap may take
ALONG = 30.0  # m
SAME_SPEED = 0.02  # share by which the speeds of one run may differ
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
    runs = [one if isinstance(one, Measurement) else load_measurement(one) for one in files]
    found = [results] if isinstance(results, Result) else list(results)
    if len(found) != len(runs) or not runs:
        words = f"{len(found)} results for {len(runs)} measured runs"
        raise argument_error("results", words, "one for each")
    if not isinstance(limits, ValidationLimits):
        limits = load(ValidationLimits, limits)
    unknown = sorted(set(limits.limits) - set(QUANTITIES))
    if unknown:
        allowed = "allowed: " + ", ".join(QUANTITIES)
        raise input_error("limits", "unknown quantity", allowed, f"limits.{unknown[0]}")
    tests = load_running_limits(zones)
    pairs: list[Pair] = []
    overlays: list[Overlay] = []
    remarks: list[str] = []
    for run, result in zip(runs, found, strict=True):
        one = _Run.of(run, result)
        remarks += one.remarks
        overlays += one.overlays()
        pairs += one.pairs(tests, limits)
    if not pairs:
        allowed = "a longer run, or channels of Q, Y or the body's accelerations"
        raise input_error(runs[0].name, "no section", allowed, "distance")
    Q0 = float(np.mean([np.mean(result["Q0"]) for result in found]))
    comparisons = []
    for name, quantity in QUANTITIES.items():
        own = tuple(pair for pair in pairs if pair.quantity == name)
        if own and name in limits.limits:
            limit = limits.limits[name].at(Q0)
            mean, least = limits.mean * limit, limits.sections
            comparisons.append(Comparison(quantity, own, limit, mean, least))
    if not all(one.checked for one in limits.limits.values()):
        remarks.append(f"limits of {limits.edition} not checked against the printed standard")
    names, said = tuple(run.name for run in runs), tuple(dict.fromkeys(remarks))
    results_of = found[0].vehicle().name, names, tuple(comparisons), tuple(overlays)
    return ModelValidation(*results_of, limits.edition, said)


def matching(measured: Sequence[Measurement], results: Mapping[str, Result]) -> list[Result]:
    """Return for each measured run the result on its track, at its speed (2 %) and in its load.

    `results`: By names, such as those of a study. Raises InputError: runs without a result of this
    kind, or with several.
    """
    found: list[Result] = []
    faults = []
    for run in measured:
        name = run.definition.track
        track = None if name is None else load_track(name)
        speed = float(np.mean(run.speed))
        fits = {n: r for n, r in results.items() if not _contradictions(run, r, track)}
        if len(fits) == 1:
            found += fits.values()
            continue
        words = f"{len(fits)} results" + (f": {', '.join([*fits][:5])}" if fits else "")
        on = "any track" if track is None else f"track '{track.name}'"
        allowed = f"one on {on} at {speed:.1f} m/s in load '{run.definition.load or DESIGN}'; " + (
            "name the file" if fits else f"there are {', '.join([*results][:5]) or 'none'}"
        )
        faults.append(Fault(run.name, "", words, allowed))
    if faults:
        raise InputError(faults)
    return found


def _contradictions(run: Measurement, result: Result, track: Track | None) -> list[str]:
    """Return in what a result is not that of a measured run."""
    found = []
    if track is not None and not _alike(result.track(), track):
        found.append(f"simulated on another track, '{result.track().name}'")
    speed = float(np.mean(run.speed))
    inside = run.part(float(result["distance"][0]), float(result["distance"][-1]))
    if len(inside.speed):
        speed = float(np.mean(inside.speed))
    time, distance = result["time"], result["distance"]
    own = float((distance[-1] - distance[0]) / (time[-1] - time[0]))
    if abs(own - speed) > SAME_SPEED * speed:
        found.append(f"measured at {speed:.1f} m/s, simulated at {own:.1f} m/s")
    loads = run.definition.load or DESIGN, result.vehicle().load or DESIGN
    if loads[0] != loads[1]:
        found.append(f"measured in load '{loads[0]}', simulated in '{loads[1]}'")
    return found


def _alike(first: Track, second: Track) -> bool:
    """Return whether two tracks have one course, one gauge and the same irregularities."""

    def course(track: Track) -> list[object]:
        rows = [one.model_dump() for one in track.irregularities]
        # a file counts by its name: the folder may be another by now
        named = [{k: Path(v).name if k == "file" else v for k, v in row.items()} for row in rows]
        return [track.plan, track.cant, track.vertical, track.gauge, named]

    return course(first) == course(second)


@dataclass(eq=False)
class _Run:
    """A measured run and its simulation; values at the places of the measured ones."""

    measurement: Measurement
    result: Result
    measured: dict[str, Floats]
    simulated: dict[str, Floats]
    unknown: dict[str, Flags]
    s: Floats
    remarks: list[str]

    @classmethod
    def of(cls, run: Measurement, result: Result) -> "_Run":
        check_channels(run.name, run, result.vehicle())
        selections = compared(run)
        time, distance = result["time"], result["distance"]
        rate = (len(time) - 1) / float(time[-1] - time[0])
        simulated_there, faults = {}, []
        for name, selection in selections.items():
            try:
                values = np.asarray(series(result, selection))
            except KeyError as error:
                key = f"channels.{name}"
                words = str(error.args[0])
                faults.append(Fault(run.name, key, words, "run it with outputs for it"))
                continue
            simulated_there[name] = amplified(values, rate, run.channel(name))
        if faults:
            raise InputError(faults)
        moved, remarks = _placed(run, distance, simulated_there)
        on = run.definition.track
        remarks += _contradictions(run, result, None if on is None else load_track(on))
        begin = float(np.interp(time[0] + START, time, distance))
        part = moved.part(begin, float(distance[-1]))
        if len(part.time) < 10:
            found = f"{moved.distance[0]:.0f} to {moved.distance[-1]:.0f} m"
            allowed = f"measured between {begin:.0f} and {distance[-1]:.0f} m, as simulated"
            raise input_error(run.name, found, allowed, "distance")
        rising = np.concatenate([[True], np.diff(distance) > 0.0])
        unknown = {name: np.isnan(part[name]) for name in selections}
        row = np.arange(len(part.time))
        simulated: dict[str, Floats] = {}
        measured: dict[str, Floats] = dict.fromkeys(selections, np.zeros(len(row)))
        for name, x in simulated_there.items():
            simulated[name] = np.interp(part.distance, distance[rising], x[rising])
            known = ~unknown[name]
            if known.any():
                measured[name] = np.interp(row, row[known], part[name][known])
        every = max(1, round(part.rate / LIKE))

        def thin(values: Mapping[str, Floats]) -> dict[str, Floats]:
            return {n: low_passed(x, part.rate, 0.4 * LIKE)[::every] for n, x in values.items()}

        remarks += suspicions(thin(measured), thin(simulated), every / part.rate)
        said = [f"{run.name}: {words}" for words in (*run.remarks, *remarks)]
        return cls(part, result, measured, simulated, unknown, part.distance, said)

    def overlays(self) -> list[Overlay]:
        rate = self.measurement.rate
        found = []
        for name, quantity in compared(self.measurement).items():
            read, made = (passed(x[name], rate, FORCES) for x in (self.measured, self.simulated))
            read = np.where(self.unknown[name], np.nan, read)
            found.append(Overlay(self.measurement.name, name, quantity, self.s, rate, read, made))
        return found

    def pairs(self, tests: RunningLimits, limits: ValidationLimits) -> list[Pair]:
        vehicle, track = self.result.vehicle(), self.result.track()
        covered = float(self.s[0]), float(self.s[-1])
        offsets = self._offsets()
        covered = covered[0] + max(0.0, *offsets.values()), covered[1] + min(0.0, *offsets.values())

        def speed_at(s: float) -> float:
            return float(np.interp(s, self.s, self.measurement.speed))

        service = vehicle.service or SERVICE
        found: list[Pair] = []
        for section in track_sections(track, tests, service, covered, speed_at):
            if not section.zone:
                continue
            length = section_length(tests.zones[section.zone], section.speed)
            if section.end - section.begin < length - 1e-6:
                continue
            for quantity in QUANTITIES.values():
                if quantity.name in limits.limits and (section.turn or not quantity.curves):
                    found += self._in_section(quantity, section, offsets)
        return found

    def _offsets(self) -> dict[str, float]:
        """Arc lengths of the channels' places relative to the reference body [m]."""
        vehicle = self.result.vehicle()
        sensors, flat = all_sensors(vehicle), flatten(vehicle)
        origin = {body.name: body.position[0] for body in flat.bodies}[flat.reference]
        ahead = [body.position[0] - origin for body in flat.of_kind("wheelset")]
        names = list(self.result.wheelsets)
        found = {}
        for name, selection in compared(self.measurement).items():
            base, *labels = selection.split(":")
            if base.startswith("sensor_"):
                found[name] = sensors[labels[0]].offset + sensors[labels[0]].arm[0]
            elif labels and (labels[0] in names or labels[0].isdecimal()):
                k = names.index(labels[0]) if labels[0] in names else int(labels[0]) - 1
                found[name] = float(ahead[k])
            else:
                found[name] = 0.0
        return found

    def _signals(self, base: str) -> list[tuple[str, int | None, str, list[str]]]:
        """Return place, side, and what to do with which channels for a quantity."""
        by = {quantity: name for name, quantity in compared(self.measurement).items()}
        found: list[tuple[str, int | None, str, list[str]]] = []
        for quantity, name in by.items():
            kind, *labels = quantity.split(":")
            if base.startswith("body"):
                elsewhere = ("frame", "axlebox")
                at_floor = kind == "sensor_acceleration" and not labels[0].startswith(elsewhere)
                if at_floor and labels[1] == base[-1]:
                    found.append((labels[0], None, base[-1], [name]))
            elif kind == base:
                side = SIDES.index(labels[1]) if len(labels) > 1 else None
                found.append((f"wheelset {labels[0]}", side, base, [name]))
            elif base == "Y_over_Q" and kind == "Y" and f"Q:{labels[0]}:{labels[1]}" in by:
                load = by[f"Q:{labels[0]}:{labels[1]}"]
                side = SIDES.index(labels[1])
                found.append((f"wheelset {labels[0]}", side, "ratio", [name, load]))
            elif base == "sum_Y" and kind == "Y" and labels[1] == "left":
                other = by.get(f"Y:{labels[0]}:right")
                if other and f"sum_Y:{labels[0]}" not in by:
                    found.append((f"wheelset {labels[0]}", None, "sum", [name, other]))
        return found

    def _in_section(
        self, quantity: Compared, section: TestSection, offsets: Mapping[str, float]
    ) -> list[Pair]:
        found = []
        for place, side, how, names in self._signals(quantity.base):
            wheel = section.wheel(side)
            if wheel == "inner" and quantity.base != "Q":
                continue
            s = self.s + offsets[names[0]]
            inside = slice(*np.searchsorted(s, [section.begin, section.end]))
            if any(np.mean(self.unknown[name][inside]) > UNKNOWN for name in names):
                continue
            both = []
            for source in (self.measured, self.simulated):
                values = self._signal(source, quantity, how, side, names, section)
                signal = Signal(values[:, None], s[:, None], [(place, side)])
                x = signal.in_section(0, section, quantity.window)
                both.append(quantity.value(x, section.turn) if len(x) else [])
            label = f"{place} {wheel}".rstrip()
            names_of = quantity.name, self.measurement.name, label
            where = section.begin, section.end, section.radius
            found += [Pair(*names_of, *where, m, v) for m, v in zip(*both, strict=False)]
        return found

    def _signal(
        self, source: Mapping[str, Floats], quantity: Compared, how: str, side: int | None,
        names: list[str], section: TestSection,
    ) -> Floats:  # fmt: skip
        rate = self.measurement.rate
        first, *rest = [passed(source[name], rate, quantity.band) for name in names]
        outwards = 1.0 if side is None else float(OUTWARDS[side])
        if how == "sum":
            first = first + rest[0]
        if how == "ratio":
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.asarray(np.where(rest[0] > 0.0, outwards * first / rest[0], np.nan))
        if how == "Y":
            return outwards * first
        if how in ("sum", "sum_Y"):
            return (-section.turn or 1.0) * first  # outwards
        if how == "y":
            return (section.turn or 1.0) * first
        return first


def _placed(
    run: Measurement, distance: Floats, simulated: Mapping[str, Floats]
) -> tuple[Measurement, list[str]]:
    """Return a run with its arc length moved to match the simulation, and what was done."""
    best: Shift | None = None
    for name, x in simulated.items():
        found = shift_of(run.distance, run[name], distance, x, most=ALONG)
        if found is not None and (best is None or found.correlation > best.correlation):
            best = found
    if best is None:
        return run, ["no channel is like the simulated one: the place on the track is not checked"]
    words = []
    if abs(best.shift) > 1.0 or abs(best.stretch) > 1e-3:
        words = [f"arc length moved by {best.shift:+.1f} m and {1e3 * best.stretch:+.2f} m/km "
                 "to match the simulation"]  # fmt: skip
    return run.moved(best.shift, best.stretch), words
