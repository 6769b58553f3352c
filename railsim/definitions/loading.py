"""From files to definitions, with every fault of a file reported at once.

`load_vehicle`, `load_track` and their like read one file each; `definition_of` gives the definition
of a `format`.  What is checked beyond the single values stands in each definition.
"""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, TypeVar

from railsim.definitions.file_definition import FileDefinition, format_fault, loaded
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import wrong_type
from railsim.errors import InputError, input_error
from railsim.files import sources
from railsim.files.access import DEFINITION_BYTES, read_text
from railsim.files.sources import Source

if TYPE_CHECKING:
    from railsim.definitions.limits import (
        ComfortLimits,
        RunningLimits,
        StationaryLimits,
        WheelLimits,
    )
    from railsim.definitions.mechanism.definition import Mechanism
    from railsim.definitions.own_sections import OwnSections
    from railsim.definitions.spring import TrailingArmSuspension
    from railsim.definitions.study.definition import Study
    from railsim.definitions.study.scenario import Scenario
    from railsim.definitions.wear_law import WearLawFile

D = TypeVar("D", bound=FileDefinition)
Overrides = Iterable[str] | str

FORMATS = {
    "railsim-vehicle/1": "vehicle.definition:Vehicle",
    "railsim-track/1": "track.definition:Track",
    "railsim-settings/1": "settings:Settings",
    "railsim-spring/1": "spring:TrailingArmSuspension",
    "railsim-mechanism/1": "mechanism.definition:Mechanism",
    "railsim-limits/1": "limits:RunningLimits",
    "railsim-scenario/1": "study.scenario:Scenario",
    "railsim-comfort-limits/1": "limits:ComfortLimits",
    "railsim-published/1": "published:Published",
    "railsim-study/1": "study.definition:Study",
    "railsim-stationary-limits/1": "limits:StationaryLimits",
    "railsim-wear-law/1": "wear_law:WearLawFile",
    "railsim-wheel-limits/1": "limits:WheelLimits",
    "railsim-sections/1": "own_sections:OwnSections",
    "railsim-measurement/1": "measurement:MeasurementFile",
    "railsim-validation-limits/1": "limits:ValidationLimits",
}
"""Where the definition of every file is, by its `format` key."""


def definition_of(format_name: str) -> type[FileDefinition]:
    """Return the definition of a format, imported when it is asked for."""
    definition: type[FileDefinition] = resolve_name(f"railsim.definitions.{FORMATS[format_name]}")
    return definition


def load(model: type[D], path: str | Path, overrides: Overrides = ()) -> D:
    """Load a file of a kind, or a shipped one by its name."""
    file = sources.find_file(path, model.KIND)
    return loaded(model, sources.read_source(file, model.KIND), overrides)


def load_vehicle(path: str | Path, overrides: Overrides = ()) -> Vehicle:
    """Load a vehicle from a file, or a shipped one by its name.

    Parameters
    ----------
    path : str or Path
        Path of a file, or name of a shipped vehicle.
    overrides : iterable of str
        Assignments ``key.path=value`` with the file's own keys.

    Raises
    ------
    InputError
        Everything that is wrong in the file and those that it extends.

    Examples
    --------
    >>> load_vehicle("coach_manchester", ["bodies.carbody.mass=40e3"]).bodies["carbody"].mass
    40000.0
    """
    return load(Vehicle, path, overrides)


def load_track(path: str | Path, overrides: Overrides = ()) -> Track:
    """Load a track from a file, or a shipped one by its name; as `load_vehicle`."""
    return load(Track, path, overrides)


def load_settings(path: str | Path | None = None, overrides: Overrides = ()) -> Settings:
    """Load settings from a file, or the default ones; as `load_vehicle`."""
    if path is None:
        return loaded(Settings, Source("settings", {"format": Settings.format_name()}), overrides)
    return load(Settings, path, overrides)


def load_spring(path: str | Path, overrides: Overrides = ()) -> "TrailingArmSuspension":
    """Load a spring file, or a shipped one by its name; as `load_vehicle`."""
    from railsim.definitions.spring import TrailingArmSuspension

    return load(TrailingArmSuspension, path, overrides)


def load_mechanism(path: str | Path, overrides: Overrides = ()) -> "Mechanism":
    """Load a mechanism file, or a shipped one by its name; as `load_vehicle`.

    Parameters that the overrides set are listed in `provenance.set`.

    Examples
    --------
    >>> load_mechanism("atr95_lift_5", "parameters.a1=0.16").parameters["a1"]
    0.16
    """
    from railsim.definitions.mechanism.definition import Mechanism

    return load(Mechanism, path, overrides)


def load_scenario(path: str | Path, overrides: Overrides = ()) -> "Scenario":
    """Load a scenario, or a shipped one by its name; as `load_vehicle`."""
    from railsim.definitions.study.scenario import Scenario

    return load(Scenario, path, overrides)


def load_running_limits(path: str | Path, overrides: Overrides = ()) -> "RunningLimits":
    """Load the limits of running tests, or shipped ones by their name; as `load_vehicle`."""
    from railsim.definitions.limits import RunningLimits

    return load(RunningLimits, path, overrides)


def load_comfort_limits(path: str | Path, overrides: Overrides = ()) -> "ComfortLimits":
    """Load classes of comfort, or shipped ones by their name; as `load_vehicle`."""
    from railsim.definitions.limits import ComfortLimits

    return load(ComfortLimits, path, overrides)


def load_stationary_limits(path: str | Path, overrides: Overrides = ()) -> "StationaryLimits":
    """Load the limits of stationary tests, or shipped ones by their name; as `load_vehicle`."""
    from railsim.definitions.limits import StationaryLimits

    return load(StationaryLimits, path, overrides)


def load_wheel_limits(path: str | Path, overrides: Overrides = ()) -> "WheelLimits":
    """Load the limits of worn wheels, or shipped ones by their name; as `load_vehicle`."""
    from railsim.definitions.limits import WheelLimits

    return load(WheelLimits, path, overrides)


def load_wear_law(path: str | Path) -> "WearLawFile":
    """Load a law of wear with constants of the user's own."""
    from railsim.definitions.wear_law import WearLawFile

    return loaded(WearLawFile, sources.read_source(Path(path), "limits"), ())


def load_own_sections(path: str | Path) -> "OwnSections":
    """Load test sections of the user's own: TOML, or CSV with the keys of a section as header."""
    from railsim.definitions.own_sections import OwnSections, parse_csv

    path, data = Path(path), None
    if path.suffix.lower() == ".csv":
        data = parse_csv(read_text(path, DEFINITION_BYTES))
    return loaded(OwnSections, sources.read_source(path, "sections", data), ())


def load_study(path: str | Path, overrides: Overrides = ()) -> "Study":
    """Load a study file, or a shipped one by its name; as `load_vehicle`.

    Names of files that lie beside it count from its folder.
    """
    from railsim.definitions.study.definition import Study

    return load(Study, path, overrides)


def load_vehicle_text(text: str) -> Vehicle:
    """Load a vehicle from the text of a file, for instance that kept in a result."""
    return loaded(Vehicle, sources.text_source(text, "vehicle_toml", "vehicle"), ())


def load_track_text(text: str) -> Track:
    """Load a track from the text of a file, for instance that kept in a result."""
    return loaded(Track, sources.text_source(text, "track_toml", "track"), ())


def load_settings_json(text: str, file: str = "settings_json") -> Settings:
    """Load settings from the JSON that a result keeps."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise input_error(file, f"broken JSON: {error}") from None
    if not isinstance(data, dict):
        raise input_error(file, "no table")
    return loaded(Settings, Source(file, {"format": Settings.format_name(), **data}), ())


def load_any(path: str | Path, overrides: Iterable[str] = ()) -> FileDefinition:
    """Load a file of whatever definition its `format` key names, or a shipped one by its name.

    Raises InputError: everything that is wrong in it; an unknown format.
    """
    file = sources.find_any(path)
    data = sources.read_toml(file)
    head = data.get("format")
    if not isinstance(head, str) or head not in FORMATS:
        raise InputError([format_fault(str(path), head, FORMATS)])
    model = definition_of(head)
    return loaded(model, sources.read_source(file, model.KIND, data), overrides)


def check_types(vehicles: Sequence[object], *tracks: object, settings: object = None) -> None:
    """Raise TypeError where a name or a file is given instead of what it stands for.

    `settings`: None, where there need not be any.
    """
    wrong = [wrong_type("vehicle", x) for x in vehicles if not isinstance(x, Vehicle)]
    wrong += [wrong_type("track", x) for x in tracks if not isinstance(x, Track)]
    if not isinstance(settings, Settings | None):
        wrong.append(wrong_type("settings", settings))
    if wrong:
        raise TypeError(wrong[0])
