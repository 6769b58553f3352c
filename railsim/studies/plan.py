"""`Plan`: from the inputs of a study to its points and cases; all faults are reported together.

When a study of a hundred thousand runs is continued, its finished runs must be found at once.  The
key of a point is a hash of the texts that define the run: contents of the vehicle, track and
settings files and of all files that they name, assignments, speed, start and end.  Definitions are
loaded and checked for the runs that are to be computed.
"""

import hashlib
import json
import math
import os
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

from railsim.definitions.loading import load_track
from railsim.definitions.study.analyses import Analysis, AssessAnalysis, needs_run
from railsim.definitions.study.definition import Study, value_texts
from railsim.definitions.study.design import Optimise, Value
from railsim.errors import (
    Fault,
    Faults,
    InputError,
    argument_error,
    changed_faults,
    input_error,
    nearest,
)
from railsim.files import sources
from railsim.files.access import TABLE_BYTES, is_file, read_bytes
from railsim.result.extremes import BY_SIGN, FACTS, PEAK_QUANTITIES
from railsim.studies.analyses import check_analyses, numbers_of
from railsim.studies.case import Case, Loader, Overrides, run_labels, run_name
from railsim.studies.rows import PERMITTED, Row, combined_rows
from railsim.studies.spec import MOST_RUNS, RunSpec, StudySpec
from railsim.studies.user_function import fingerprint
from railsim.units import ALLOWED, duration_in_words
from railsim.version import __version__

LONGEST_NAME = 250  # bytes of a file name with its ending; file systems allow 255
BETWEEN = 0.618  # share of a range, at no whole number of a usual one
ROUGH_DURATION = 60.0  # s; simulated time of a run that has not been looked at
# what a run takes at a rough guess: simulated seconds per second of one core, and seconds besides
REAL_TIME_FACTOR, SECONDS_BESIDES = 60.0, 0.5
# options for what a study file may hold instead
OF_FILE = ("vehicles", "tracks", "speeds", "grid", "settings", "start", "duration", "until")


@dataclass(frozen=True, eq=False)
class Point:
    """Inputs of one run, before its definitions are loaded."""

    name: str  # of the run
    run: RunSpec  # with its speed at the start
    labels: Mapping[str, str | float]  # of the run
    key: str  # hash of all inputs; empty if a file cannot be read
    has_run: bool = True  # in the time domain, with a result file


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
        check_analyses(spec.analyses)
        self._spec = spec
        self._loader = Loader(spec.varied_keys, spec.analyses, contacts=True)
        # hashes of files; each is read once
        self._fingerprint = cache(self._definition_hash)
        self._base, self._content = cache(self._file_hash), cache(_content_hash)
        # what the record of a run depends on besides the run
        self._further = [f"told {function}"] if (function := fingerprint(spec.quantities)) else []
        self._further += [f"analyses {spec.analyses}"] if spec.analyses else []
        self._further += [f"limits {self._limits(analysis)}" for analysis in spec.analyses.values()]
        self._further += [f"keep {spec.keep}"] if spec.keep != "all" else []
        self._further += ["single"] if spec.single else []
        linked = [next(iter(table.values())) for table in spec.linked]
        lists: list[Sequence[object]] = [spec.vehicles, spec.tracks, spec.speeds]
        lists += [*spec.grid.values(), *linked]
        number = math.prod(map(len, lists)) * (spec.sample.number if spec.sample else 1)
        check_number(number, workers, self._simulated_time)
        self._loader.overrides(tuple(spec.assignments))  # its faults come first
        rows = combined_rows(spec.grid, spec.linked, spec.sample)
        of_rows = ([f"{key}={value}" for key, value in row.values.items()] for row in rows)
        assigned = [(*spec.assignments, *texts) for texts in of_rows]
        shared = spec.settings, spec.start, spec.duration, spec.until
        self.points: list[Point] = []
        for vehicle, track, speed in product(spec.vehicles, spec.tracks, spec.speeds):
            for row, assignments in zip(rows, assigned, strict=True):
                requested = speed if row.speed is None else row.speed
                number_or_none = None if isinstance(requested, str) else requested
                run = RunSpec(vehicle, track, number_or_none, *shared, assignments)
                permitted = isinstance(requested, str)
                first = self._permitted_speed(run) if permitted else self._loader.first_speed(run)
                run = run if first is number_or_none else replace(run, speed=first)
                self.points.append(self._point(run, row))

    def _point(self, run: RunSpec, row: Row) -> Point:
        overrides = self._loader.overrides(run.assignments)
        each = ((kind, getattr(run, kind), some) for kind, some in overrides.items())
        parts = [self._fingerprint(*definition) for definition in each]
        inputs = (*parts, run.speed, run.start, run.duration, run.until, *self._further)
        key = "" if "" in parts else _hash([__version__, *map(repr, inputs)])
        labels = {**run_labels(run), **row.values}
        return Point(run_name(run) + row.suffix, run, labels, key, needs_run(self._spec.analyses))

    def cases(self, points: Sequence[Point] | None = None) -> list[Case]:
        """Load the inputs of some points, by default all; raises InputError: all their faults."""
        requested = self.points if points is None else points
        cases = [self._loader.case(point.name, point.run, point.labels) for point in requested]
        self._loader.check()
        check_names(self.points)
        return [case for case in cases if case is not None]

    def _limits(self, analysis: Analysis) -> str:
        """Return a hash of the limits file of an analysis, which is checked; empty without one."""
        if not isinstance(analysis, AssessAnalysis) or analysis.limits is None:
            return ""
        from railsim.assessment.assess import limits_of

        limits_of(analysis.standard, analysis.limits)
        return self._fingerprint("limits", analysis.limits, ())

    def _permitted_speed(self, run: RunSpec) -> float | None:
        """Return the lower of the admissible speed of a vehicle and the speed of a track [m/s]."""
        vehicle, track = (self._loader.definition(kind, run) for kind in ("vehicle", "track"))
        if vehicle is None or track is None:
            return None  # already reported
        allowed, missing = f"needed for the speed '{PERMITTED}'", Faults()
        if vehicle.service is None:
            missing.append(Fault(str(run.vehicle), "service.admissible_speed", "missing", allowed))
        if track.speed is None:
            missing.append(Fault(str(run.track), "speed", "missing", allowed))
        self._loader.faults += missing
        return None if missing else float(min(vehicle.service.admissible_speed, track.speed))

    def _simulated_time(self) -> float:
        """Estimate the duration of a run [s] from the first track and speed."""
        spec = self._spec
        if spec.duration is not None:
            return spec.duration
        try:
            length = spec.until or load_track(spec.tracks[0]).length
        except InputError:
            return ROUGH_DURATION
        first = spec.speeds[0]
        if not isinstance(first, float):  # that of the track, or linked
            return ROUGH_DURATION
        return max(0.0, length - spec.start) / max(first, 0.5)

    def _definition_hash(self, kind: str, path: str | Path | None, overrides: Overrides) -> str:
        """Return the hash of a file with assignments; empty if it cannot be read."""
        base = self._base(kind, path)
        if not base:
            return ""
        contents = [self._content(name) for text in overrides for name in _named_files(text)]
        return _hash([base, *overrides, *contents])

    def _file_hash(self, kind: str, path: str | Path | None) -> str:
        if path is None:
            return "defaults"
        try:
            data = sources.read_source(sources.find_file(path, kind), kind).data
        except InputError:
            return ""
        text = json.dumps(data, sort_keys=True, default=str)
        return _hash([text, *(self._content(name) for name in _file_names(data))])


def _hash(parts: Sequence[str]) -> str:
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogateescape")).hexdigest()


def _content_hash(name: str) -> str:
    try:
        return hashlib.sha256(read_bytes(name, TABLE_BYTES)).hexdigest()
    except InputError:
        return "unreadable"


def _file_names(node: Any, of_file: bool = False) -> Iterator[str]:
    """Yield what stands under keys that name files, where it is a file."""
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _file_names(value, key in sources.FILE_KEYS)
    elif isinstance(node, list):
        for value in node:
            yield from _file_names(value, of_file)
    elif of_file and isinstance(node, str) and is_file(node):
        yield node


def _named_files(assignment: str) -> Iterator[str]:
    key, _, written = assignment.partition("=")
    if not sources.FILE_KEYS & set(key.strip().split(".")):
        return
    try:
        value: Any = tomllib.loads(f"v = {written}")["v"]
    except (ValueError, RecursionError):
        value = written.strip()
    yield from _file_names(value, of_file=True)


def check_study(study: Study) -> None:
    """Check the runs of a study file, as the study does first.

    Of an optimisation those of the designs at both bounds of all variables and between them, where
    a key of whole numbers has none. Raises InputError: everything that is wrong in any of them.
    """
    spec = StudySpec.of_file(study)
    if study.optimise is not None:
        _check_quantities(study, study.optimise)
        designs = {
            key: [str(v.low), str(v.high), str(v.low + BETWEEN * (v.high - v.low))]
            for path, v in study.optimise.variables.items()
            for key in (path, *v.also)
        }
        spec = spec.changed(linked=[*spec.linked, designs])
    plan = Plan(spec)
    plan.cases()
    Faults(
        Fault("study", f"{key}.where", "no run has these labels",
              "values of a run, such as its track, its speed or a key of the grid", "--optimise")
        for key, one in (study.optimise.values if study.optimise else {}).items()
        if not any(selects(one, point.labels) for point in plan.points)
    ).check()  # fmt: skip


def selects(criterion: Value, labels: Mapping[str, Any]) -> bool:
    """Whether a run has the labels of a value of an optimisation."""
    return all(_equals(labels.get(key), value) for key, value in criterion.where.items())


def _equals(label: object, value: object) -> bool:
    """Whether a label, a text in a grid, equals a value."""
    try:
        return label == value or float(str(label)) == float(str(value))
    except ValueError:
        return False


def _check_quantities(study: Study, problem: Optimise) -> None:
    """Refuse quantities that no run of an optimisation can have."""
    known, forms = list[str](), list[str]()
    if needs_run(study.analyses):
        known = [f"{name}_{end}" for name in PEAK_QUANTITIES
                 for end in (("max", "min") if name in BY_SIGN else ("peak",))]  # fmt: skip
        # where, when and after a filter; in the middle of a curve, if the track has one
        forms += [rf"({'|'.join(known)})_(time|distance|20hz)"]
        forms += [rf"({'|'.join(PEAK_QUANTITIES)})_(mid|median)\d*"]
        known += ["speed", *(name for name in FACTS if not name.startswith("status"))]
    for analysis_name, analysis in study.analyses.items():
        known += [f"{analysis_name}.{number}" for number in numbers_of(analysis)]
        if isinstance(analysis, AssessAnalysis):  # the standard says its numbers
            forms.append(rf"{analysis_name}\..*")
    pattern = re.compile("|".join([*map(re.escape, known), *forms]))
    Faults(
        Fault("study", f"{k}.quantity", f"no run has '{name}'", nearest(name, known), "--optimise")
        for k, name in ((k, value.quantity) for k, value in problem.values.items())
        if not pattern.fullmatch(name)
    ).check()


def faults_of_file(file: str, *, assignments: bool = True) -> AbstractContextManager[None]:
    """Let faults of what an option would give name the study file that gives it.

    `assignments`: all of them are the file's.
    """
    names = [*OF_FILE, "optimise", "analyses", *(["set"] if assignments else [])]
    options = {f"--{name}" for name in names}
    return changed_faults(
        lambda fault: replace(fault, file=file, option="") if fault.option in options else fault
    )


def check_number(number: int, cores: int, seconds: Callable[[], float]) -> None:
    """Refuse a study whose number of runs must be a mistake.

    `cores`: number of processes; `seconds`: returns an estimate of the simulated time of a run [s];
    called if there are too many runs. Raises InputError: the number is above `MOST_RUNS`; the
    message gives the time needed.
    """
    if number <= MOST_RUNS:
        return
    each = seconds() / REAL_TIME_FACTOR + SECONDS_BESIDES
    found = f"{number:,} runs, some {duration_in_words(number * each / cores)} on {cores} cores"
    raise input_error("study", found, f"at most {MOST_RUNS:,}; give fewer values")


def check_names(points: Sequence[Point]) -> None:
    """Refuse, by InputError, names of runs that are equal, or too long for a file."""
    counts = Counter(point.name for point in points)
    faults = Faults(
        Fault("study", name, f"{count} runs of this name", "each value once; other file names")
        for name, count in counts.items()
        if count > 1
    )
    longest = max(counts, key=lambda name: len(os.fsencode(name)))
    if len(os.fsencode(longest)) + len(".h5") > LONGEST_NAME:
        found = f"the name of a run has {len(os.fsencode(longest))} bytes"
        faults.append(Fault("study", f"{longest[:60]}...", found, "shorter names of files"))
    faults.check()


def parse_grid(text: str) -> tuple[str, tuple[str, ...]]:
    """Return the key and the values of ``key.path=a,b,c`` or ``key.path=first:last:number``.

    Commas within brackets do not separate values.

    Raises InputError: the text has neither form.

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
