"""JSON Schemas of the file formats and the key tables of the manual, both made from the models.

``docs/schema/*.json`` are written, and every table in ``docs/user/*.md`` is filled that stands
between the lines ``<!-- keys: FORMAT NAME -->`` and ``<!-- end of keys -->``, where NAME is a
definition's class.
"""

import functools
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from generators.filling import check_markers
from railsim.definitions.base import meanings
from railsim.definitions.loading import FORMATS, definition_of

DOCS = Path(__file__).parents[1]
PARTS: tuple[str, ...] = ()
DIALECT = "https://json-schema.org/draft/2020-12/schema"
_BEGIN = r"<!-- keys: (?P<format>\S+) (?P<name>\w+) -->\n"
TABLE = re.compile(_BEGIN + r".*?<!-- end of keys -->", re.DOTALL)


def json_schema(format_name: str) -> dict[str, Any]:
    """Return the JSON Schema of a file format.

    A file that `extends` another is only a part of a definition: of such a file the schema checks
    `format`, `extends` and `remove`; the whole is checked when it is loaded.
    """
    model = definition_of(format_name)
    full = model.model_json_schema(schema_generator=_Generator)
    definitions = full.pop("$defs", {})
    return {
        "$schema": DIALECT,
        "title": f"{format_name}: {' '.join((model.__doc__ or '').split())}",
        "if": {"type": "object", "required": ["extends"]},
        "then": {
            "properties": {
                "format": {"const": format_name},
                "extends": {"type": "string", "description": "Path or name of the file extended"},
                "remove": {
                    "type": "array",
                    "items": {"type": "string"},
                    "description": "Dotted paths of what is taken out of the extended file",
                },
            },
            "required": ["format"],
        },
        "else": {"$ref": f"#/$defs/{model.__name__}"},
        "$defs": {**definitions, model.__name__: full},
    }


_of_tables = functools.cache(json_schema)  # a page has some forty of one format


class _Generator(GenerateJsonSchema):
    """Adds what the texts below the fields say; leaves out titles and nulls, which TOML lacks."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def model_schema(self, schema: Any) -> dict[str, Any]:
        found = super().model_schema(schema)
        found.pop("title")
        said = meanings(schema["cls"])
        for name, field in found.get("properties", {}).items():
            if name in said:
                field.setdefault("description", said[name])
        return found

    def nullable_schema(self, schema: Any) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: Any) -> dict[str, Any]:
        found = super().default_schema(schema)
        if found.get("default", "") is None:
            del found["default"]
        return found

    def tuple_schema(self, schema: Any) -> dict[str, Any]:
        found = super().tuple_schema(schema)
        members = found.get("prefixItems", [])
        if members and all(member == members[0] for member in members):
            found["items"] = found.pop("prefixItems")[0]
        return found

    def dict_schema(self, schema: Any) -> dict[str, Any]:
        found = super().dict_schema(schema)
        return {**found, "additionalProperties": False} if "patternProperties" in found else found

    def tagged_union_schema(self, schema: Any) -> dict[str, Any]:
        found = super().tagged_union_schema(schema)
        found.pop("discriminator", None)
        return found


def schema_name(format_name: str) -> str:
    """Return the name of a format's schema file."""
    return format_name.replace("/", "-") + ".schema.json"


def key_table(format_name: str, name: str) -> str:
    """Return the markdown table of a definition's keys: type, default, meaning with unit."""
    schema = _of_tables(format_name)["$defs"][name]
    required = schema.get("required", [])
    lines = ["| key | value | default | meaning |", "| --- | --- | --- | --- |"]
    for key, value in schema["properties"].items():
        default = "required" if key in required else _default(value)
        meaning = " ".join(value.get("description", "").split())
        lines.append(f"| `{key}` | {_words(value)} | {default} | {meaning} |")
    return "\n".join(lines) + "\n"


def _default(schema: dict[str, Any]) -> str:
    if "default" not in schema:
        return ""
    value = schema["default"]
    if isinstance(value, list) and len(value) == 2 and value[0] == value[1] and "anyOf" in schema:
        value = value[0]
    if value in ([], None) or isinstance(value, dict):
        return ""
    if isinstance(value, float):
        return f"`{value:g}`".replace("e+0", "e").replace("e+", "e")
    return f"`{json.dumps(value)}`"


_ANY_VALUE = {"true or false", "whole number", "number", "text"}


def _words(schema: dict[str, Any]) -> str:
    """Return the type of a value in words."""
    if "$ref" in schema:
        return str(schema["$ref"]).rsplit("/", 1)[-1]
    for union in ("anyOf", "oneOf"):
        if union in schema:
            parts = list(dict.fromkeys(_words(option) for option in schema[union]))
            if len(parts) > len(_ANY_VALUE) and set(parts[: len(_ANY_VALUE)]) == _ANY_VALUE:
                return "value"  # of whatever type, or a list
            return " or ".join(parts)
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "enum" in schema:
        return ", ".join(f"`{json.dumps(option)}`" for option in schema["enum"])
    if schema["type"] == "array":
        return _array_words(schema)
    if schema["type"] == "object":
        members = [*schema.get("patternProperties", {}).values()]
        members += [schema["additionalProperties"]] if schema.get("additionalProperties") else []
        return f"tables by name: {_words(members[0])}"
    return _limited(schema)


def _array_words(schema: dict[str, Any]) -> str:
    if "prefixItems" in schema:
        return "[" + ", ".join(_words(member) for member in schema["prefixItems"]) + "]"
    inner = _words(schema["items"])
    if schema.get("minItems") == schema.get("maxItems") and "minItems" in schema:
        return f"{schema['minItems']} x {inner}"
    return f"list of {inner}"


_LIMITS = {"minimum": ">= ", "exclusiveMinimum": "> ", "maximum": "<= ", "exclusiveMaximum": "< "}


def _limited(schema: dict[str, Any]) -> str:
    names = {"string": "text", "boolean": "true or false", "integer": "whole number"}
    limits = [f"{sign}{schema[key]:g}" for key, sign in _LIMITS.items() if key in schema]
    return " ".join([names.get(schema["type"], schema["type"]), *limits])


def filled(text: str) -> str:
    """Return a page of the manual with its key tables filled."""
    check_markers(text)

    def table(match: re.Match[str]) -> str:
        begin = f"<!-- keys: {match['format']} {match['name']} -->\n"
        return begin + "\n" + key_table(match["format"], match["name"]) + "\n<!-- end of keys -->"

    return TABLE.sub(table, text)


def make(parts: Sequence[str]) -> None:
    """Write all schemas and fill all key tables."""
    for format_name in FORMATS:
        text = json.dumps(json_schema(format_name), indent=1) + "\n"
        (DOCS / "schema" / schema_name(format_name)).write_text(text, encoding="utf-8")
    for page in sorted((DOCS / "user").glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if filled(text) != text:
            page.write_text(filled(text), encoding="utf-8")
