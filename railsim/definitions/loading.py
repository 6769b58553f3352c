"""From files to definitions, with every fault of a file reported at once.

`load_vehicle`, `load_track` and `load_settings` read one file each; `FORMATS` says for every
`format` key which definition it stands for and what is checked beyond the single values.
"""

import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from railsim.definitions import names, sources
from railsim.definitions.base import FileDefinition, Remark
from railsim.definitions.flatten import position_faults
from railsim.definitions.layout import track_faults, track_remarks
from railsim.definitions.measured import embed_measured
from railsim.definitions.settings import SETTINGS_FORMAT, Settings
from railsim.definitions.sources import Source
from railsim.definitions.spring import (
    SPRING_FORMAT,
    TrailingArmSuspension,
    spring_faults,
    spring_remarks,
)
from railsim.definitions.track import TRACK_FORMAT, Track
from railsim.definitions.vehicle import VEHICLE_FORMAT, Vehicle
from railsim.errors import Fault, InputError, nearest

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
        Tables whose members are dotted names.
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
        "track", Track, faults=track_faults, remarks=track_remarks, prepare=embed_measured
    ),
    SETTINGS_FORMAT: Format("settings", Settings, free=("initial",)),
    SPRING_FORMAT: Format(
        "spring",
        TrailingArmSuspension,
        faults=spring_faults,
        remarks=spring_remarks,
        free=("loads",),
    ),
}


def load_vehicle(path: str | Path, overrides: Iterable[str] = ()) -> Vehicle:
    """Load a vehicle from a file, or a shipped one by its name.

    Parameters
    ----------
    path : str or Path
        Path of a file, or name of a shipped vehicle.
    overrides : iterable of str
        Assignments ``key.path=value`` with the file's own keys.

    Raises
    ------
    InputError : everything that is wrong in the file and those that it extends.

    Examples
    --------
    >>> load_vehicle("coach_manchester", ["bodies.carbody.mass=40e3"]).bodies["carbody"].mass
    40000.0
    """
    return _loaded(Vehicle, _file_source(path, "vehicle"), overrides)


def load_track(path: str | Path, overrides: Iterable[str] = ()) -> Track:
    """Load a track from a file, or a shipped one by its name; as `load_vehicle`."""
    return _loaded(Track, _file_source(path, "track"), overrides)


def load_settings(path: str | Path | None = None, overrides: Iterable[str] = ()) -> Settings:
    """Load settings from a file, or the default ones; as `load_vehicle`."""
    if path is None:
        return _loaded(Settings, Source("settings", {"format": SETTINGS_FORMAT}), overrides)
    return _loaded(Settings, _file_source(path, "settings"), overrides)


def load_spring(path: str | Path, overrides: Iterable[str] = ()) -> TrailingArmSuspension:
    """Load a spring file, or a shipped one by its name; as `load_vehicle`."""
    return _loaded(TrailingArmSuspension, _file_source(path, "spring"), overrides)


def load_vehicle_text(text: str, file: str = "vehicle_toml") -> Vehicle:
    """Load a vehicle from the text of a file, for instance that kept in a result."""
    return _loaded(Vehicle, sources.text_source(text, file, "vehicle"), ())


def load_track_text(text: str, file: str = "track_toml") -> Track:
    """Load a track from the text of a file, for instance that kept in a result."""
    return _loaded(Track, sources.text_source(text, file, "track"), ())


def load_any(path: str | Path, overrides: Iterable[str] = ()) -> tuple[FileDefinition, Format]:
    """Load a file of whatever definition its `format` key names, or a shipped one by its name.

    Raises
    ------
    InputError : everything that is wrong in it; an unknown format.
    """
    file = sources.find_any(path)
    head = sources.read_toml(file).get("format")
    known = FORMATS.get(head) if isinstance(head, str) else None
    if known is None:
        raise InputError([_format_fault(str(path), head, FORMATS)])
    source = sources.read_source(file, known.kind)
    return _loaded(known.model, source, overrides), known


def _file_source(path: str | Path, kind: str) -> Source:
    return sources.read_source(sources.find_file(path, kind), kind)


def _loaded(model: type[D], source: Source, overrides: Iterable[str]) -> D:
    format_name, known = next((n, f) for n, f in FORMATS.items() if f.model is model)
    if source.data.get("format") != format_name:
        file = source.file_of(("format",))
        raise InputError([_format_fault(file, source.data.get("format"), [format_name])])
    source = sources.apply_overrides(source, overrides, known.free)
    faults = [*known.prepare(source.data), *known.raw_faults(source.data)]
    faults = [_placed(fault, source) for fault in faults]
    try:
        definition = model.model_validate(source.data)
    except ValidationError as error:
        faults = _validation_faults(error, source, model) + faults
    else:
        if not faults:
            faults = [_placed(fault, source) for fault in known.faults(definition)]
    if faults:
        raise InputError(dict.fromkeys(faults))
    return definition


def _format_fault(file: str, found: object, allowed: Iterable[str]) -> Fault:
    named = "missing" if found is None else repr(found)
    return Fault(file, "format", named, "allowed: " + ", ".join(allowed))


def _placed(fault: Fault, source: Source) -> Fault:
    return fault if fault.file else source.fault(fault.key, fault.found, fault.allowed)


def _validation_faults(
    error: ValidationError, source: Source, model: type[BaseModel]
) -> list[Fault]:
    faults = []
    for detail in error.errors(include_url=False):
        if detail["type"] == "too_short" and detail["ctx"]["actual_length"] < len(detail["input"]):
            continue  # members with faults of their own do not count
        path = _written_path(detail, source.data)
        found, allowed = _wording(detail, model)
        faults.append(Fault(source.file_of(path), ".".join(path), found, allowed))
    return faults


def _written_path(detail: Any, data: Any) -> tuple[str, ...]:
    """Return the key path as written: pydantic's location without the tags of unions."""
    path: list[str] = []
    node = data
    location = detail["loc"]
    for depth, item in enumerate(location):
        if _holds(node, item):
            node = node[item]
        elif not (isinstance(node, dict) and depth == len(location) - 1 and _lacks(detail)):
            continue
        path.append(str(item))
    return tuple(path)


def _holds(node: Any, item: str | int) -> bool:
    if isinstance(node, list):
        return isinstance(item, int) and item < len(node)
    return isinstance(node, dict) and item in node


def _lacks(detail: Any) -> bool:
    return bool(detail["type"] == "missing")


def _wording(detail: Any, model: type[BaseModel]) -> tuple[str, str]:
    """Return what was found and what is allowed, in words."""
    kind, value, context = detail["type"], detail["input"], detail.get("ctx", {})
    message = detail["msg"].replace("Input should be", "must be")
    match kind:
        case "missing":
            return _missing(detail, model)
        case "extra_forbidden":
            fields = _fields(_annotation_at(model, detail["loc"][:-1]))
            return "unknown key", nearest(str(detail["loc"][-1]), fields)
        case "union_tag_invalid":
            tags = [tag.strip(" '") for tag in context["expected_tags"].split(",")]
            found = f"unknown {context['discriminator']} {context['tag']!r}"
            return found, nearest(context["tag"], tags)
        case "union_tag_not_found":
            return f"no key {context['discriminator']}", "it tells what the table describes"
        case "string_pattern_mismatch":
            return repr(value), "a name: letters, digits, _ and -, beginning with a letter"
        case "tuple_type":
            return _shown(value), _list_of(_annotation_at(model, detail["loc"]))
        case "too_long" | "too_short" if isinstance(value, list | tuple):
            return _counted(value), _list_of(_annotation_at(model, detail["loc"]))
        case "model_type" | "model_attributes_type" | "dict_type":
            return _shown(value), "must be a table"
        case "value_error":
            message = message.removeprefix("Value error, ")
            if isinstance(value, dict | list | tuple):
                return message, ""
    return _shown(value), message


def _missing(detail: Any, model: type[BaseModel]) -> tuple[str, str]:
    if isinstance(detail["input"], list | tuple):
        return _counted(detail["input"]), _list_of(_annotation_at(model, detail["loc"][:-1]))
    *parents, name = detail["loc"]
    field = _fields(_annotation_at(model, parents)).get(str(name))
    meaning = " ".join(field.description.split()) if field and field.description else ""
    return "missing", f"needed: {meaning}" if meaning else "needed"


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _counted(value: Sequence[object]) -> str:
    return f"{len(value)} value" if len(value) == 1 else f"{len(value)} values"


def _list_of(annotation: Any) -> str:
    members = typing.get_args(annotation)
    if typing.get_origin(annotation) is not tuple or Ellipsis in members:
        return "a list"
    return f"a list of {len(members)}"


def _fields(annotation: Any) -> Mapping[str, Any]:
    """Return the fields of a definition, none where it is something else."""
    is_model = isinstance(annotation, type) and issubclass(annotation, BaseModel)
    return annotation.model_fields if is_model else {}


def _annotation_at(annotation: Any, location: Sequence[str | int]) -> Any:
    """Return the type that is expected at a location of the validator; None where unknown."""
    if typing.get_origin(annotation) is typing.Annotated:
        return _annotation_at(typing.get_args(annotation)[0], location)
    if not location:
        return annotation
    step, *rest = location
    if fields := _fields(annotation):
        field = fields.get(str(step))
        return _annotation_at(field.annotation, rest) if field else None
    members = [m for m in typing.get_args(annotation) if m is not type(None)]
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        chosen = [member for member in members if _tag(member) == step]
        if chosen:
            return _annotation_at(chosen[0], rest)
        return _annotation_at(members[0], location) if len(members) == 1 else None
    if not members:
        return None
    inner = members[-1] if typing.get_origin(annotation) is dict else members[0]
    return _annotation_at(inner, rest)


def _tag(member: Any) -> str | None:
    """Return the value of `kind` or `type` that chooses this member of a union."""
    if not (isinstance(member, type) and issubclass(member, BaseModel)):
        return None
    for key in ("kind", "type"):
        field = member.model_fields.get(key)
        if field is not None and typing.get_origin(field.annotation) is typing.Literal:
            return str(typing.get_args(field.annotation)[0])
    return None
