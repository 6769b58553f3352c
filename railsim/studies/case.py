"""A case: all inputs of one run."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path

from railsim.definitions.analyses import Analysis, needs_run
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.profiles import load_profile
from railsim.profiles.used import used_profiles
from railsim.version import __version__


@dataclass(frozen=True)
class Case:
    """One run: vehicle, track, speed and settings.

    Attributes
    ----------
    name : str
        Name of the run, and of its file without the ending.
    vehicle, track, settings
        Definitions.
    speed : float
        Speed, at the start where it varies [m/s].
    start : float
        Distance at which the reference body starts [m].
    duration, until : float or None
        End of the run: time from its start [s] or distance [m]; the end of the track's plan if
        neither.
    labels : mapping of str to str or float
        Labels of the case: ``vehicle``, ``track``, ``speed`` and the keys of a grid.
    analyses : mapping of str to Analysis
        Analyses by name; without analyses, a run is computed.
    """

    name: str
    vehicle: Vehicle
    track: Track
    settings: Settings
    speed: float
    start: float = 0.0
    duration: float | None = None
    until: float | None = None
    labels: Mapping[str, str | float] = field(default_factory=dict)
    analyses: Mapping[str, Analysis] = field(default_factory=dict)

    @property
    def file_name(self) -> str:
        """Name of the result file; empty if there is no run in the time domain."""
        return f"{self.name}.h5" if needs_run(self.analyses) else ""

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
            "settings": self.settings.to_toml(),
            "speed": self.speed,
            "start": self.start,
            "duration": self.duration,
            "until": self.until,
            "profiles": {
                name: hashlib.sha256(load_profile(name).key()).hexdigest()
                for name in sorted(self._profile_names())
            },
        }
        text = json.dumps(inputs, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def _profile_names(self) -> set[str]:
        used = (*used_profiles(self.vehicle), *used_profiles(self.track))
        return {name for _, name, _ in used}


@lru_cache(1000)  # few files in up to 100 000 runs
def short_name(path: str | Path) -> str:
    """Return the name of a file in the names of runs: without folder and ending."""
    return Path(path).name.removesuffix(".toml")


def run_name(vehicle: str | Path, track: str | Path, speed: float) -> str:
    """Return the name of a run.

    Examples
    --------
    >>> run_name("vehicles/coach_manchester.toml", "curve_r250", 20.0)
    'coach_manchester_curve_r250_20'
    """
    return f"{short_name(vehicle)}_{short_name(track)}_{speed:.10g}"
