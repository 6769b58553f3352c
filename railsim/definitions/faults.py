"""What pydantic objects to, in the words of a user: file, key, what was found, what is allowed."""

import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel, Tag, ValidationError

from railsim.definitions.base import meanings
from railsim.errors import MOST_FAULTS, Fault, nearest
from railsim.files.key_paths import LONGEST_KEY
from railsim.files.sources import Source, located_fault
from railsim.text import shortened


def validation_faults(
    error: ValidationError, source: Source, model: type[BaseModel]
) -> list[Fault]:
    """Return a fault for everything that pydantic found wrong in single values of a definition."""
    faults: list[Fault] = []
    for number, detail in enumerate(error.errors(include_url=False)):
        if detail["type"] == "too_short" and detail["ctx"]["actual_length"] < len(detail["input"]):
            continue  # members with faults of their own do not count
        if number >= MOST_FAULTS:  # they are counted only
            faults.append(Fault(source.file, ".".join(map(str, detail["loc"])), "", ""))
            continue
        path = _written_path(detail, source.data)
        found, allowed = _wording(_as_written(detail, path, source.data), model)
        if detail["type"] == "union_tag_not_found":
            allowed += _name_in_base(path, source)
        key = shortened(".".join(path), LONGEST_KEY)
        faults.append(located_fault(source.file_of(path), key, found, allowed))
    # a number that stands for both sides is objected to twice, the second time at its row
    shown = faults[:MOST_FAULTS]
    return [
        fault
        for fault in shown
        if not any(
            other.key.startswith(f"{fault.key}.")
            and (other.found, other.allowed) == (fault.found, fault.allowed)
            for other in shown
        )
    ] + faults[MOST_FAULTS:]


def _name_in_base(path: tuple[str, ...], source: Source) -> str:
    """Return the near name of a member that another file of the chain has, as a question."""
    siblings = {keys for keys in source.origin if keys[:-1] == path[:-1]}
    file = source.file_of(path)
    names = [keys[-1] for keys in siblings if source.file_of(keys) != file]
    hint = nearest(path[-1], names)
    return f"; {hint}" if names and not hint.startswith("allowed") else ""


def _as_written(detail: Any, path: Sequence[str], data: Any) -> Any:
    """Return pydantic's finding with the number as it stands in the file, not as it was shared."""
    node = data
    for item in path:
        node = node[int(item)] if isinstance(node, list) else node.get(item)
    numbers = int | float
    if isinstance(node, list) and len(node) == 2 and isinstance(detail["input"], numbers):
        node = node[1]  # a row of arc length and value
    if not (isinstance(node, numbers) and isinstance(detail["input"], numbers)):
        return detail
    return {**detail, "input": node}


def _written_path(detail: Any, data: Any) -> tuple[str, ...]:
    """Return the key path as written: pydantic's location without the tags of unions."""
    path: list[str] = []
    node = data
    location, last = detail["loc"], len(detail["loc"]) - 1
    for depth, item in enumerate(location):
        choices = range(len(node)) if isinstance(node, list) else node
        if isinstance(node, dict | list) and item in choices:
            node = node[item]
        elif not (isinstance(node, dict) and depth == last and detail["type"] == "missing"):
            continue
        path.append(str(item))
    return tuple(path)


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
            found = f"unknown {context['discriminator']} {_quoted(context['tag'])}"
            return found, nearest(context["tag"], tags)
        case "union_tag_not_found":
            return f"no key {context['discriminator']}", "it tells what the table describes"
        case "string_pattern_mismatch":
            return _quoted(value), "a name: letters, digits, _ and -, beginning with a letter"
        case "tuple_type":
            return _quoted(value), _list_text(_annotation_at(model, detail["loc"]))
        case "too_long" | "too_short" if isinstance(value, list | tuple):
            allowed = _list_text(_annotation_at(model, detail["loc"]))
            if allowed == "a list" and kind == "too_short":
                allowed = f"a list of {context['min_length']} at least"
            elif allowed == "a list":
                allowed = f"a list of {context['max_length']} at most"
            return _count_text(value), allowed
        case "model_type" | "model_attributes_type" | "dict_type":
            return _quoted(value), "must be a table"
        case "value_error":
            message = message.removeprefix("Value error, ")
            if isinstance(value, dict) or len(repr(value)) > 60:
                return message, ""
    return _quoted(value), message


def _missing(detail: Any, model: type[BaseModel]) -> tuple[str, str]:
    if isinstance(detail["input"], list | tuple):
        return _count_text(detail["input"]), _list_text(_annotation_at(model, detail["loc"][:-1]))
    *parents, name = detail["loc"]
    owner = _annotation_at(model, parents)
    text = meanings(owner).get(str(name), "") if str(name) in _fields(owner) else ""
    meaning = " ".join(text.split())
    return "missing", f"needed: {meaning}" if meaning else "needed"


def _quoted(value: object) -> str:
    return shortened(repr(value))


def _count_text(value: Sequence[object]) -> str:
    return f"{len(value)} value" if len(value) == 1 else f"{len(value)} values"


def _list_text(annotation: Any) -> str:
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
    """Return the tag or the value of `kind`, `type` or `law` that chooses a member of a union."""
    for note in getattr(member, "__metadata__", ()):
        if isinstance(note, Tag):
            return note.tag
    if not (isinstance(member, type) and issubclass(member, BaseModel)):
        return None
    for key in ("kind", "type", "law"):
        field = member.model_fields.get(key)
        if field is not None and typing.get_origin(field.annotation) is typing.Literal:
            return str(typing.get_args(field.annotation)[0])
    return f"a {next(iter(member.model_fields), '')}"  # see mechanisms
