"""A case: all inputs of one run, loaded and checked; its run."""

import hashlib
import json
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import Any

from railsim.contact.curves import misfits, rail_curve, tape_circle_position, wheel_curve
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.definitions.study.analyses import Analysis, AssessAnalysis, needs_run, needs_speed
from railsim.definitions.vehicle.flatten import groups
from railsim.errors import Fault, Faults, InputError
from railsim.files.key_paths import AXES
from railsim.files.overrides import split_overrides
from railsim.files.sources import OVERRIDE
from railsim.profiles import load_profile
from railsim.profiles.used import profile_faults, profile_hashes
from railsim.result import Hdf5Sink, MemorySink, Result
from railsim.result.hdf5 import PLAIN, Storage
from railsim.result.sinks import EVERYTHING
from railsim.simulation import simulate
from railsim.simulation.conditions import check_agreement, check_range, initial_speed
from railsim.studies.spec import Progress, RunSpec
from railsim.version import __version__


@dataclass(frozen=True)
class Case:
    """One run: vehicle, track, speed and settings; times and distances as in `RunSpec`."""

    name: str  # of the run, and of its file without the ending
    vehicle: Vehicle
    track: Track
    settings: Settings
    speed: float  # at the start where it varies [m/s]
    start: float = 0.0
    duration: float | None = None
    until: float | None = None
    # ``vehicle``, ``track``, ``speed``, keys of a grid
    labels: Mapping[str, str | float] = field(default_factory=dict)
    analyses: Mapping[str, Analysis] = field(default_factory=dict)  # without any, a run is computed

    @property
    def file_name(self) -> str:
        """Name of the result file; empty if there is no run in the time domain."""
        return f"{self.name}.h5" if needs_run(self.analyses) else ""

    @property
    def conditions(self) -> dict[str, Any]:
        """Speed, beginning, end and settings, as arguments of `railsim.simulate`."""
        names = ("speed", "start", "duration", "until", "settings")
        return {name: getattr(self, name) for name in names}

    @cached_property
    def key(self) -> str:
        """Hash of everything that the results of the run depend on.

        Definitions with their defaults, the points of the profiles and the version of railsim; not
        the name, the labels or the analyses of the finished run.
        """
        inputs = {
            "railsim": __version__,
            "vehicle": self.vehicle.to_toml(),
            "track": self.track.to_toml(),
            **self.conditions,
            "settings": self.settings.to_toml(),
            "profiles": profile_hashes(self.vehicle, self.track),
        }
        return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()


AS_IN_TABLES = 1e-4  # m, between the points of a wheel
Overrides = tuple[str, ...]
LOADERS: dict[str, Callable[..., Any]] = {
    "vehicle": load_vehicle,
    "track": load_track,
    "settings": load_settings,
}


def _leads_to(name: str, key: str) -> bool:
    """Whether a path, perhaps a short one, is that of a key or of a table that holds it.

    >>> key = "vehicle.elements.primary.stiffness.0"
    >>> [_leads_to(f"vehicle.{rest}", key) for rest in ("primary.stiffness.x", "secondary.mass")]
    [True, False]
    """
    parts = iter(key.split("."))
    return all((str(AXES.index(p)) if p in AXES else p) in parts for p in name.split("."))


def assignment_fault(fault: Fault, grid: Collection[str], kind: str = "") -> Fault:
    """Return the fault of an assignment with its key and option as given."""
    if fault.file != OVERRIDE:
        return fault
    key = f"{kind}.{fault.key}" if kind else fault.key
    of_grid = any(_leads_to(name, key) for name in grid)
    parameter, option = ("grid", "--grid") if of_grid else ("assignments", "--set")
    return replace(fault, file=parameter, option=option, key=key)


def settings_fault(fault: Fault, run: RunSpec, grid: Collection[str] = ()) -> Fault:
    """Return a fault of the settings with the file or the assignment that gives them."""
    if fault.file != "settings":
        return fault
    key = f"settings.{fault.key}"
    assigned = (text.partition("=")[0].strip() for text in run.assignments)
    if any(_leads_to(name, key) or name.startswith(f"{key}.") for name in assigned):
        return assignment_fault(replace(fault, file=OVERRIDE), grid, "settings")
    return fault if run.settings is None else replace(fault, file=str(run.settings))


class Loader:
    """Loads the definitions of runs, each once, and gathers everything that is wrong with them.

    `grid`: keys whose assignments a user knows by ``--grid``; `analyses`: analyses of all cases;
    `contacts`: whether wheels and rails have to fit, which a run by itself finds out at once.
    """

    def __init__(
        self,
        grid: Collection[str] = (),
        analyses: Mapping[str, Analysis] | None = None,
        *,
        contacts: bool = False,
    ) -> None:
        self._contacts = contacts
        self._grid = grid
        self._analyses = dict(analyses or {})
        self.faults = Faults()
        self._loaded = cache(self._load)
        self._misfits = cache(_misfits)
        self.overrides = cache(self._overrides)

    def check(self) -> None:
        """Raise an `InputError` if anything was wrong so far."""
        Faults(dict.fromkeys(self.faults)).check()

    def definition(self, kind: str, run: RunSpec) -> Any:
        """Return the ``vehicle``, ``track`` or ``settings`` of a run; None if it is wrong."""
        return self._loaded(kind, getattr(run, kind), self.overrides(run.assignments)[kind])

    def _load(self, kind: str, path: str | Path | None, overrides: Overrides) -> Any:
        with self.faults.caught(lambda fault: assignment_fault(fault, self._grid, kind)):
            definition = LOADERS[kind](path, overrides)
            self.faults += profile_faults(definition, str(path))
            return definition
        return None

    def _overrides(self, assignments: tuple[str, ...]) -> dict[str, Overrides]:
        """Return the assignments to vehicle, track and settings, each with the file's own keys."""
        overrides: dict[str, Overrides] = dict.fromkeys(LOADERS, ())
        for text in assignments:
            with self.faults.caught(lambda fault: assignment_fault(fault, self._grid)):
                for kind, some in split_overrides([text]).items():
                    overrides[kind] += tuple(some)
        return overrides

    def first_speed(self, run: RunSpec) -> float | None:
        """Return the speed at the start of a run [m/s]; None if there is none."""
        settings = self.definition("settings", run)
        if settings is None or (run.speed is None and not needs_speed(self._analyses)):
            return run.speed
        with self.faults.caught():
            return initial_speed(settings, run.speed, run.start)
        return None

    def case(self, name: str, run: RunSpec, labels: Mapping[str, str | float]) -> Case | None:
        """Return the case of a run whose speed is that at its start; None if it is wrong."""
        vehicle, track, settings = (self.definition(kind, run) for kind in LOADERS)
        speed = run.speed
        if speed is None and not needs_speed(self._analyses):
            speed = math.nan
        elif track and speed is not None and needs_run(self._analyses):
            with self.faults.caught():
                check_range(track, speed, run.start, run.duration, run.until)
        if not (vehicle and track and settings) or speed is None:
            return None
        if needs_run(self._analyses) and speed > 0.0:
            self.faults += self._disagreements(vehicle, track, settings, speed, run)
        inputs = vehicle, track, settings, speed, run.start, run.duration, run.until
        return Case(name, *inputs, labels, self._analyses)

    def _disagreements(
        self, vehicle: Vehicle, track: Track, settings: Settings, speed: float, run: RunSpec
    ) -> list[Fault]:
        """Return in what settings do not fit the vehicle, the track or an assessment of the run."""
        faults = Faults()
        with faults.caught():
            check_agreement(vehicle, track, settings, speed, short_name(run.vehicle))
        wheelsets = (w for group in groups(vehicle) for w in group.wheelsets.values())
        sides = ((w, side) for w in wheelsets for side in range(2) if self._contacts)
        of = track.gauge, track.inclination
        pairs = ((w.profile[k], w.radius[k], w.back_to_back, track.rail[k], *of) for w, k in sides)
        for pair in dict.fromkeys(pairs):
            words = f"{short_name(run.vehicle)} on {short_name(run.track)}"
            faults += [replace(misfit, file=words) for misfit in self._misfits(*pair)]
        for name, analysis in self._analyses.items():
            if isinstance(analysis, AssessAnalysis):
                from railsim.assessment.outputs import check_outputs

                def add_analysis(fault: Fault, name: str = name) -> Fault:
                    return replace(fault, found=f"{fault.found}, for analyses.{name}")

                with faults.caught(add_analysis):
                    check_outputs(vehicle, settings, speed, analysis.standard, coarse=True)
        return [settings_fault(fault, run, self._grid) for fault in faults]


def _misfits(
    wheel: str, radius: float, back_to_back: float, rail: str, gauge: float, inclination: float
) -> list[Fault]:
    """Return why a wheelset cannot run in a track; nothing where a profile cannot be used."""
    try:
        rail_line = rail_curve(load_profile(rail, "rail"), gauge, inclination)
        place = tape_circle_position(back_to_back)
        wheel_line = wheel_curve(load_profile(wheel, "wheel"), radius, place, AS_IN_TABLES)
    except InputError:
        return []  # told with the profile
    return misfits(wheel_line, rail_line, gauge, f"{wheel} on {rail}, gauge {1e3 * gauge:.1f} mm")


def load_case(run: RunSpec) -> Case:
    """Load the inputs of one run; raises InputError: everything that is wrong in any of them."""
    loader = Loader()
    loader.overrides(run.assignments)  # its faults come first
    run = replace(run, speed=loader.first_speed(run))
    case = loader.case(run_name(run, 6), run, run_labels(run))
    loader.check()
    assert case is not None  # without a fault
    return case


def run_case(
    case: Case,
    path: str | Path | None,
    *,
    overwrite: bool,
    progress: Progress | None,
    resume: Result | None = None,
    only: Collection[str] = EVERYTHING,
    storage: Storage = PLAIN,
) -> Result:
    """Run a case to its file, which carries name and key of the case.

    `path`: result file; None to keep the result in memory; `resume`: result whose final state is
    the initial state of this run; the file then carries no key; `only`: names of the quantities in
    a result in memory, with ``*`` for any characters; by default all; `storage`: of the file.
    Raises InputError, ModelError: as `railsim.simulate`; the file cannot be written.
    """
    facts = {"run": case.name}
    if resume is None:
        facts["inputs_hash"] = case.key
    else:
        facts["continues"] = str(resume.attributes.get("run", "another run"))
    with (
        MemorySink(facts, only)
        if path is None
        else Hdf5Sink(path, overwrite=overwrite, attributes=facts, storage=storage)
    ) as sink:
        return simulate(
            case.vehicle, case.track, **case.conditions, sink=sink, progress=progress, resume=resume
        )


def run_labels(run: RunSpec) -> dict[str, str | float]:
    """Return the labels that every run has."""
    speed = math.nan if run.speed is None else run.speed
    return {"vehicle": short_name(run.vehicle), "track": short_name(run.track), "speed": speed}


@lru_cache(1000)  # few files in up to 100 000 runs
def short_name(path: str | Path) -> str:
    """Return the name of a file in the names of runs: without folder and ending."""
    return Path(path).name.removesuffix(".toml")


def run_name(run: RunSpec, digits: int = 10) -> str:
    """Return the name of a run; in studies its speed has many digits, as in those to be resumed.

    >>> run_name(RunSpec("vehicles/coach_manchester.toml", "curve_r250", 40.0 / 3.6), 6)
    'coach_manchester_curve_r250_11.1111'
    """
    return f"{short_name(run.vehicle)}_{short_name(run.track)}_{run.speed or 0.0:.{digits}g}"
