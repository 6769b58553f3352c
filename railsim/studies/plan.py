"""`Plan`: from the inputs of a study to its points and cases; all faults are reported together."""

import math
import os
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

from railsim.definitions.loading import load_track
from railsim.definitions.study.analyses import needs_run
from railsim.definitions.study.definition import value_texts
from railsim.errors import Fault, Faults, InputError, argument_error, input_error
from railsim.studies.case import Case, Loader, run_labels, run_name
from railsim.studies.points import Fingerprints, Point, check_number, point_key
from railsim.studies.rows import PERMITTED, Row, made_rows
from railsim.studies.spec import RunSpec, StudySpec
from railsim.studies.user_function import fingerprint
from railsim.units import ALLOWED

LONGEST_NAME = 250  # bytes of a file name with its ending; file systems allow 255


class Plan:
    """All points of a study, vehicles outermost; loads the case of a point.

    `spec`: inputs to combine. The speed `PERMITTED` is the lower of the admissible speed of the
    vehicle and the speed of the track; `workers`: processes for the runs, to estimate the time that
    a refused study would take; `points`: in the order of the combinations. Raises InputError: there
    is no combination, or there are too many combinations.
    """

    def __init__(self, spec: StudySpec, workers: int = 1) -> None:
        if not (spec.vehicles and spec.tracks and spec.speeds and all(spec.grid.values())):
            raise input_error("study", "no combination", "give a vehicle, a track, a speed")
        self._spec = spec
        self._loader = Loader({*spec.grid, *(k for t in spec.linked for k in t)}, spec.analyses)
        self._fingerprint = Fingerprints()
        # what the record of a run depends on besides the run
        self._further = [f"told {told}"] if (told := fingerprint(spec.quantities)) else []
        self._further += [f"analyses {spec.analyses}"] if spec.analyses else []
        linked = [next(iter(table.values())) for table in spec.linked]
        lists: list[Sequence[object]] = [
            spec.vehicles,
            spec.tracks,
            spec.speeds,
            *spec.grid.values(),
            *linked,
        ]
        number = range(spec.sample.number if spec.sample else 1)
        check_number([*lists, number], workers, self._simulated_time)
        self._loader.overrides(tuple(spec.assignments))  # its faults come first
        rows = made_rows(spec.grid, spec.linked, spec.sample)
        assigned = [
            (*spec.assignments, *(f"{key}={value}" for key, value in row.values.items()))
            for row in rows
        ]
        self.points: list[Point] = []
        for vehicle, track, speed in product(spec.vehicles, spec.tracks, spec.speeds):
            for row, assignments in zip(rows, assigned, strict=True):
                wanted = speed if row.speed is None else row.speed
                run = RunSpec(
                    vehicle,
                    track,
                    None if isinstance(wanted, str) else wanted,
                    spec.settings,
                    spec.start,
                    spec.duration,
                    spec.until,
                    assignments,
                )
                permitted = isinstance(wanted, str)
                first = self._permitted(run) if permitted else self._loader.first_speed(run)
                self.points.append(self._point(replace(run, speed=first), row))

    def _point(self, run: RunSpec, row: Row) -> Point:
        overrides = self._loader.overrides(run.assignments)
        key = point_key(
            *(
                self._fingerprint(kind, getattr(run, kind), some)
                for kind, some in overrides.items()
            ),
            run.speed,
            run.start,
            run.duration,
            run.until,
            *self._further,
        )
        speed = run.speed
        name = run_name(run.vehicle, run.track, 0.0 if speed is None else speed) + row.suffix
        labels = run_labels(run.vehicle, run.track, math.nan if speed is None else speed)
        return Point(name, run, {**labels, **row.values}, key, needs_run(self._spec.analyses))

    def cases(self, points: Sequence[Point] | None = None) -> list[Case]:
        """Load the inputs of the runs of some points, by default of all.

        Raises InputError: everything that is wrong in any of them.
        """
        wanted = self.points if points is None else points
        found = [self._loader.case(point.name, point.run, point.labels) for point in wanted]
        self._loader.raise_faults()
        self._loader.report(name_faults(self.points))
        self._loader.raise_faults()
        return [case for case in found if case is not None]

    def _permitted(self, run: RunSpec) -> float | None:
        """Return the lower of the admissible speed of a vehicle and the speed of a track [m/s]."""
        vehicle, track = (self._loader.definition(kind, run) for kind in ("vehicle", "track"))
        if vehicle is None or track is None:
            return None  # already reported
        allowed = f"needed for the speed '{PERMITTED}'"
        missing = []
        if vehicle.service is None:
            fault = Fault(str(run.vehicle), "service.admissible_speed", "missing", allowed)
            missing.append(fault)
        if track.speed is None:
            missing.append(Fault(str(run.track), "speed", "missing", allowed))
        self._loader.report(missing)
        return None if missing else float(min(vehicle.service.admissible_speed, track.speed))

    def _simulated_time(self) -> float:
        """Estimate the duration of a run [s] from the first track and speed."""
        spec = self._spec
        if spec.duration is not None:
            return spec.duration
        try:
            length = spec.until or load_track(spec.tracks[0]).length
        except InputError:
            return 0.0
        first = spec.speeds[0] if isinstance(spec.speeds[0], float) else 1.0
        return max(0.0, length - spec.start) / max(first, 0.5)


class Cases:
    """Loaded cases in the form that `carry_out` takes."""

    def __init__(self, cases: Sequence[Case]) -> None:
        self._cases = {case.name: case for case in cases}
        self.points = [
            Point(c.name, RunSpec(c.vehicle.name, c.track.name, c.speed), c.labels, c.key)
            for c in cases
        ]
        Faults(name_faults(self.points)).check()

    def cases(self, points: Sequence[Point]) -> list[Case]:
        """Return the cases of some points."""
        return [self._cases[point.name] for point in points]


def name_faults(points: Sequence[Point]) -> list[Fault]:
    """Return the faults of the names of runs: equal names, or names too long for a file."""
    counts = Counter(point.name for point in points)
    faults = [
        Fault("study", name, f"{count} runs of this name", "give files with different names")
        for name, count in counts.items()
        if count > 1
    ]
    longest = max(counts, key=lambda name: len(os.fsencode(name)))
    if len(os.fsencode(longest)) + len(".h5") > LONGEST_NAME:
        found = f"the name of a run has {len(os.fsencode(longest))} bytes"
        faults.append(Fault("study", f"{longest[:60]}...", found, "shorter names of files"))
    return faults


def parse_grid(text: str) -> tuple[str, tuple[str, ...]]:
    """Return the key and the values of ``key.path=a,b,c`` or ``key.path=first:last:number``.

    Commas within brackets do not separate values.

    Raises InputError: the text has neither form.

    Examples
    --------
    >>> parse_grid("settings.fastsim_grid=[10,10],[20,20]")
    ('settings.fastsim_grid', ('[10,10]', '[20,20]'))
    >>> parse_grid("track.friction=0.1,0.2:0.4:3")
    ('track.friction', ('0.1', '0.2', '0.3', '0.4'))
    """
    key, equals, written = text.partition("=")
    values = [value.strip() for value in re.split(r",(?![^\[{]*[\]}])", written)]
    if not (equals and key.strip() and all(values)):
        raise argument_error("grid", "not understood", "allowed: key.path=a,b,c", key=text)
    try:
        found = tuple(one for value in values for one in value_texts(value))
    except ValueError as error:
        raise argument_error("grid", str(error), f"allowed: {ALLOWED}", key=text) from None
    return key.strip(), found
