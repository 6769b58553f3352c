"""From files to definitions, with every fault of a file reported at once.

`load_vehicle`, `load_track` and `load_settings` read one file each; `FORMATS` says for every
`format` key which definition it stands for and what is checked beyond the single values.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from railsim.definitions import names, sources
from railsim.definitions.base import FileDefinition, Remark
from railsim.definitions.faults import validation_faults
from railsim.definitions.flatten import position_faults
from railsim.definitions.layout import track_faults, track_remarks
from railsim.definitions.limits import (
    COMFORT_LIMITS_FORMAT,
    LIMITS_FORMAT,
    STATIONARY_LIMITS_FORMAT,
    ComfortLimits,
    RunningLimits,
    StationaryLimits,
)
from railsim.definitions.measured import embed_measured
from railsim.definitions.mechanism import MECHANISM_FORMAT, Mechanism
from railsim.definitions.mechanism_faults import mechanism_faults, mechanism_remarks
from railsim.definitions.offered import offers
from railsim.definitions.overrides import apply_overrides, with_values
from railsim.definitions.published import PUBLISHED_FORMAT, Published
from railsim.definitions.scenario import SCENARIO_FORMAT, Scenario
from railsim.definitions.settings import SETTINGS_FORMAT, Settings
from railsim.definitions.sources import Source
from railsim.definitions.spring import (
    SPRING_FORMAT,
    TrailingArmSuspension,
    spring_faults,
    spring_remarks,
)
from railsim.definitions.study import STUDY_FORMAT, Study
from railsim.definitions.track import TRACK_FORMAT, Track
from railsim.definitions.vehicle import VEHICLE_FORMAT, Vehicle
from railsim.definitions.wear_law import WEAR_LAW_FORMAT, WearLawFile
from railsim.errors import Fault, InputError
from railsim.files import is_file
from railsim.text import shortened

D = TypeVar("D", bound=FileDefinition)


def _nothing(_: Any) -> list[Any]:
    return []


@dataclass(frozen=True)
class Format:
    """What a `format` key stands for.

    Attributes
    ----------
    kind : str
        Word for it: vehicle, track, settings.
    model : type
        Its definition.
    prepare : callable
        Completes the plain tables from further files, in place, and returns their faults.
    raw_faults : callable
        Checks on the plain tables, valid or not; the faults' file is left empty.
    faults : callable
        Checks between the parts of a valid definition; the faults' file is left empty.
    remarks : callable
        What is allowed but unusual.
    free : tuple of str
        Tables that an assignment makes where they are missing; their members are dotted names.
    """

    kind: str
    model: type[FileDefinition]
    raw_faults: Callable[[Mapping[str, Any]], list[Fault]] = _nothing
    faults: Callable[[Any], list[Fault]] = _nothing
    remarks: Callable[[Any], list[Remark]] = _nothing
    free: tuple[str, ...] = ()
    prepare: Callable[[dict[str, Any]], list[Fault]] = _nothing


FORMATS: dict[str, Format] = {
    VEHICLE_FORMAT: Format("vehicle", Vehicle, names.name_faults, position_faults),
    TRACK_FORMAT: Format(
        "track",
        Track,
        faults=track_faults,
        remarks=track_remarks,
        free=("friction_falling",),
        prepare=embed_measured,
    ),
    SETTINGS_FORMAT: Format("settings", Settings, free=("initial",)),
    SPRING_FORMAT: Format(
        "spring",
        TrailingArmSuspension,
        faults=spring_faults,
        remarks=spring_remarks,
        free=("loads",),
    ),
    MECHANISM_FORMAT: Format(
        "mechanism", Mechanism, faults=mechanism_faults, remarks=mechanism_remarks
    ),
    LIMITS_FORMAT: Format("limits", RunningLimits),
    SCENARIO_FORMAT: Format("scenario", Scenario),
    COMFORT_LIMITS_FORMAT: Format("limits", ComfortLimits),
    PUBLISHED_FORMAT: Format("published", Published),
    STUDY_FORMAT: Format("study", Study, free=("grid",)),
    STATIONARY_LIMITS_FORMAT: Format("limits", StationaryLimits),
    WEAR_LAW_FORMAT: Format("limits", WearLawFile),
}


def load_vehicle(path: str | Path, overrides: Iterable[str] | str = ()) -> Vehicle:
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
    return _loaded(Vehicle, _file_source(path, "vehicle"), overrides)


def load_track(path: str | Path, overrides: Iterable[str] | str = ()) -> Track:
    """Load a track from a file, or a shipped one by its name; as `load_vehicle`."""
    return _loaded(Track, _file_source(path, "track"), overrides)


def load_settings(path: str | Path | None = None, overrides: Iterable[str] | str = ()) -> Settings:
    """Load settings from a file, or the default ones; as `load_vehicle`."""
    if path is None:
        return _loaded(Settings, Source("settings", {"format": SETTINGS_FORMAT}), overrides)
    return _loaded(Settings, _file_source(path, "settings"), overrides)


def load_spring(path: str | Path, overrides: Iterable[str] | str = ()) -> TrailingArmSuspension:
    """Load a spring file, or a shipped one by its name; as `load_vehicle`."""
    return _loaded(TrailingArmSuspension, _file_source(path, "spring"), overrides)


def load_mechanism(path: str | Path, overrides: Iterable[str] | str = ()) -> Mechanism:
    """Load a mechanism file, or a shipped one by its name; as `load_vehicle`.

    Parameters that the overrides set are listed in `provenance.set`.

    Examples
    --------
    >>> load_mechanism("atr95_lift_5", "parameters.a1=0.16").parameters["a1"]
    0.16
    """
    overrides = [overrides] if isinstance(overrides, str) else list(overrides)
    source = _file_source(path, "mechanism")
    _find_reference(source)
    _note_parameters(source, [text.partition("=")[0].strip() for text in overrides])
    return _loaded(Mechanism, source, overrides)


def _note_parameters(source: Source, keys: Iterable[str], earlier: Iterable[str] = ()) -> None:
    """List parameters of a mechanism that are or were set by their keys in `provenance.set`."""
    known = source.data.get("parameters", {})
    paths = [key.split(".") for key in keys]
    changed = [path[1] for path in paths if path[0] == "parameters" and len(path) == 2]
    if changed := [name for name in dict.fromkeys([*earlier, *changed]) if name in known]:
        source.data["provenance"] = {**source.data.get("provenance", {}), "set": changed}


def _find_reference(source: Source) -> None:
    """Make the path of a mechanism's reference count from the file that names it."""
    optimise = source.data.get("optimise")
    name = optimise.get("reference") if isinstance(optimise, dict) else None
    if isinstance(optimise, dict) and isinstance(name, str):
        beside = Path(source.file_of(("optimise", "reference"))).parent / name
        if is_file(beside):
            optimise["reference"] = str(beside.resolve())


def load_scenario(path: str | Path, overrides: Iterable[str] | str = ()) -> Scenario:
    """Load a scenario, or a shipped one by its name; as `load_vehicle`."""
    return _loaded(Scenario, _file_source(path, "scenario"), overrides)


def load_running_limits(path: str | Path, overrides: Iterable[str] | str = ()) -> RunningLimits:
    """Load the limits of running tests, or shipped ones by their name; as `load_vehicle`."""
    return _loaded(RunningLimits, _file_source(path, "limits"), overrides)


def load_comfort_limits(path: str | Path, overrides: Iterable[str] | str = ()) -> ComfortLimits:
    """Load classes of comfort, or shipped ones by their name; as `load_vehicle`."""
    return _loaded(ComfortLimits, _file_source(path, "limits"), overrides)


def load_wear_law(path: str | Path) -> WearLawFile:
    """Load a law of wear with constants of the user's own."""
    return _loaded(WearLawFile, sources.read_source(Path(path), "limits"), ())


def load_study(path: str | Path, overrides: Iterable[str] | str = ()) -> Study:
    """Load a study file, or a shipped one by its name; as `load_vehicle`.

    Names of files that lie beside it count from its folder.
    """
    source = _file_source(path, "study")
    folder = Path(source.file).parent
    data = source.data
    for key in ("vehicles", "tracks"):
        if isinstance(data.get(key), list):
            data[key] = [_beside(folder, name) for name in data[key]]
    if "settings" in data:
        data["settings"] = _beside(folder, data["settings"])
    return _loaded(Study, source, overrides)


def _beside(folder: Path, name: Any) -> Any:
    if isinstance(name, str) and name and (folder / name).is_file():
        return str((folder / name).resolve())
    return name


def load_published(path: str | Path, overrides: Iterable[str] | str = ()) -> Published:
    """Load published values, or shipped ones by their name; as `load_vehicle`."""
    return _loaded(Published, _file_source(path, "published"), overrides)


def load_stationary_limits(
    path: str | Path, overrides: Iterable[str] | str = ()
) -> StationaryLimits:
    """Load the limits of stationary tests, or shipped ones by their name; as `load_vehicle`."""
    return _loaded(StationaryLimits, _file_source(path, "limits"), overrides)


def load_vehicle_text(text: str, file: str = "vehicle_toml") -> Vehicle:
    """Load a vehicle from the text of a file, for instance that kept in a result."""
    return _loaded(Vehicle, sources.text_source(text, file, "vehicle"), ())


def load_track_text(text: str, file: str = "track_toml") -> Track:
    """Load a track from the text of a file, for instance that kept in a result."""
    return _loaded(Track, sources.text_source(text, file, "track"), ())


def load_settings_json(text: str, file: str = "settings_json") -> Settings:
    """Load settings from the JSON that a result keeps."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError([Fault(file, "", f"broken JSON: {error}", "")]) from None
    if not isinstance(data, dict):
        raise InputError([Fault(file, "", "no table", "")])
    return _loaded(Settings, Source(file, {"format": SETTINGS_FORMAT, **data}), ())


@offers
def changed_definition(definition: D, values: Mapping[str, Any]) -> D:
    """Return a definition with other values at some keys, checked as a file would be.

    Parameters
    ----------
    definition : Definition of a file
        It stays as it is.
    values : mapping of str to value
        New values by dotted keys, as in `load_vehicle`'s overrides.

    Raises
    ------
    InputError
        Everything that is wrong in the result.
    """
    model = type(definition)
    format_name, known = _format_of(model)
    text = definition.to_toml()
    source = sources.text_source(text, getattr(definition, "name", known.kind), known.kind)
    if isinstance(definition, Mechanism):
        _note_parameters(source, values, definition.provenance.get("set", ()))
    defaults = {**model.model_construct().model_dump(mode="json"), "format": format_name}
    return _validated(model, with_values(source, values, known.free, defaults), known)


def load_any(path: str | Path, overrides: Iterable[str] = ()) -> tuple[FileDefinition, Format]:
    """Load a file of whatever definition its `format` key names, or a shipped one by its name.

    Raises
    ------
    InputError
        Everything that is wrong in it; an unknown format.
    """
    file = sources.find_any(path)
    data = sources.read_toml(file)
    head = data.get("format")
    known = FORMATS.get(head) if isinstance(head, str) else None
    if known is None:
        raise InputError([_format_fault(str(path), head, FORMATS)])
    source = sources.read_source(file, known.kind, data)
    return _loaded(known.model, source, overrides), known


def _file_source(path: str | Path, kind: str) -> Source:
    return sources.read_source(sources.find_file(path, kind), kind)


def _format_of(model: type[FileDefinition]) -> tuple[str, Format]:
    return next((n, f) for n, f in FORMATS.items() if f.model is model)


def _loaded(model: type[D], source: Source, overrides: Iterable[str]) -> D:
    format_name, known = _format_of(model)
    if source.data.get("format") != format_name:
        file = source.file_of(("format",))
        raise InputError([_format_fault(file, source.data.get("format"), [format_name])])
    defaults = model.model_construct().model_dump(mode="json")
    return _validated(model, apply_overrides(source, overrides, known.free, defaults), known)


def _validated(model: type[D], source: Source, known: Format) -> D:
    faults = [*known.prepare(source.data), *known.raw_faults(source.data)]
    faults = [_located(fault, source) for fault in faults]
    try:
        definition = model.model_validate(source.data)
    except ValidationError as error:
        faults = validation_faults(error, source, model) + faults
    else:
        if not faults:
            faults = [_located(fault, source) for fault in known.faults(definition)]
    if faults:
        raise InputError(dict.fromkeys(faults))
    return definition


def _format_fault(file: str, found: object, allowed: Iterable[str]) -> Fault:
    named = "missing" if found is None else shortened(repr(found))
    return Fault(file, "format", named, "allowed: " + ", ".join(allowed))


def _located(fault: Fault, source: Source) -> Fault:
    return fault if fault.file else source.fault(fault.key, fault.found, fault.allowed)
