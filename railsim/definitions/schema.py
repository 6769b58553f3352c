"""JSON Schemas of the file formats and the key tables of the manual, both made from the models.

``python -m railsim.definitions.schema docs`` writes ``docs/schema/*.json`` and fills every table in
``docs/user/*.md`` that stands between the lines ``<!-- keys: FORMAT NAME -->`` and
``<!-- end of keys -->``, where NAME is a definition's class.
"""

import json
import re
import sys
import typing
from pathlib import Path
from typing import Any

from railsim.definitions.base import Definition, meanings
from railsim.definitions.loading import FORMATS

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_BEGIN = r"<!-- keys: (?P<format>\S+) (?P<name>\w+) -->\n"
TABLE = re.compile(_BEGIN + r".*?<!-- end of keys -->", re.DOTALL)


def json_schema(format_name: str) -> dict[str, Any]:
    """Return the JSON Schema of a file format.

    A file that `extends` another is only a part of a definition: of such a file the schema checks
    `format`, `extends` and `remove`; the whole is checked when it is loaded.
    """
    model = FORMATS[format_name]
    full = model.model_json_schema()
    _describe(full, model)
    known = _parts(model)
    for name, part in full.get("$defs", {}).items():
        if name in known:
            _describe(part, known[name])
    full = _tidy(full)
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


def _parts(model: type[Definition]) -> dict[str, type[Definition]]:
    """All definitions that a definition is made of, by their names."""
    found: dict[str, type[Definition]] = {}
    waiting: list[Any] = [model]
    while waiting:
        one = waiting.pop()
        if not (isinstance(one, type) and issubclass(one, Definition)):
            waiting += typing.get_args(one)
        elif one.__name__ not in found:
            found[one.__name__] = one
            waiting += [field.annotation for field in one.model_fields.values()]
    return found


def _describe(schema: dict[str, Any], model: type[Definition]) -> None:
    """Write into a definition's schema what the texts below its fields say."""
    said = meanings(model)
    for name, field in schema.get("properties", {}).items():
        if name in said and "description" not in field:
            field["description"] = said[name]
            schema["properties"][name] = dict(sorted(field.items()))


def _tidy(node: Any) -> Any:
    """Return a schema without titles, nulls and repeated members, which TOML does not need."""
    if isinstance(node, list):
        return [_tidy(member) for member in node]
    if not isinstance(node, dict):
        return node
    tidy = {key: _tidy(value) for key, value in node.items() if not _noise(key, value)}
    options = tidy.get("anyOf", [])
    if {"type": "null"} in options:
        options.remove({"type": "null"})
        if len(options) == 1:
            tidy.update(tidy.pop("anyOf")[0])
    members = tidy.get("prefixItems", [])
    if members and all(member == members[0] for member in members):
        tidy["items"] = tidy.pop("prefixItems")[0]
    if "patternProperties" in tidy:
        tidy["additionalProperties"] = False
    return tidy


def _noise(key: str, value: Any) -> bool:
    """Whether a keyword has no meaning here; a property that has its name by chance is a table."""
    if key == "title":
        return isinstance(value, str)
    return key == "discriminator" or (key == "default" and value is None)


def schema_name(format_name: str) -> str:
    """Return the name of a format's schema file."""
    return format_name.replace("/", "-") + ".schema.json"


def key_table(format_name: str, name: str) -> str:
    """Return the markdown table of a definition's keys: type, default, meaning with unit."""
    schema = json_schema(format_name)["$defs"][name]
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


_MARKERS = re.compile(r"<!-- (keys: .*?|generated: .*?|end|end of keys) -->")


def check_markers(text: str) -> None:
    """Raise ValueError where a begin and an end of a filled table of a page do not alternate."""
    opened = ""
    for match in _MARKERS.finditer(text):
        ends = match[1].startswith("end")
        if ends != bool(opened) or (ends and opened.startswith("keys:") != (match[1] != "end")):
            raise ValueError(
                f"line {text.count(chr(10), 0, match.start()) + 1}: {match[0]} has no partner"
            )
        opened = "" if ends else match[1]
    if opened:
        raise ValueError(f"<!-- {opened} --> has no end")


def filled(text: str) -> str:
    """Return a page of the manual with its key tables filled."""
    check_markers(text)

    def table(match: re.Match[str]) -> str:
        begin = f"<!-- keys: {match['format']} {match['name']} -->\n"
        return begin + "\n" + key_table(match["format"], match["name"]) + "\n<!-- end of keys -->"

    return TABLE.sub(table, text)


def write(docs: Path) -> None:
    """Write all schemas and fill all key tables under the manual's folder."""
    (docs / "schema").mkdir(parents=True, exist_ok=True)
    for format_name in FORMATS:
        text = json.dumps(json_schema(format_name), indent=1) + "\n"
        (docs / "schema" / schema_name(format_name)).write_text(text, encoding="utf-8")
    for page in sorted((docs / "user").glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if filled(text) != text:
            page.write_text(filled(text), encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
