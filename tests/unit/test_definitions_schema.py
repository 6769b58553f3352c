"""The JSON Schemas and the manual's key tables are those of the models."""

import functools
import json
import re
from pathlib import Path

import jsonschema
import pytest
from generators.keys import filled, json_schema, schema_name

from railsim.definitions.loading import FORMATS, definition_of, load_any, load_track, load_vehicle
from railsim.files import sources

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {"assess.md", "vehicle_file.md", "track_file.md", "settings.md"}
schema_of = functools.cache(json_schema)
MENDED_BY = "python docs/generate.py keys"
SHIPPED = [(kind, name) for kind in sources.FOLDERS for name in sources.library_files(kind)]


@pytest.mark.parametrize("format_name", FORMATS)
def test_schema_file_is_up_to_date(format_name):
    written = json.loads((DOCS / "schema" / schema_name(format_name)).read_text())
    assert written == schema_of(format_name), MENDED_BY


@pytest.mark.parametrize("format_name", FORMATS)
def test_schema_is_a_schema(format_name):
    jsonschema.Draft202012Validator.check_schema(schema_of(format_name))


@pytest.mark.parametrize("page", sorted(PAGES))
def test_key_tables_of_the_manual_are_up_to_date(page):
    text = (DOCS / "user" / page).read_text()
    assert filled(text) == text, MENDED_BY
    assert "| `" in text


@pytest.mark.parametrize("format_name", ["railsim-vehicle/1", "railsim-track/1"])
def test_manual_shows_every_definition_of_a_format(format_name):
    kind = definition_of(format_name).KIND
    text = (DOCS / "user" / f"{kind}_file.md").read_text()
    for name in schema_of(format_name)["$defs"]:
        assert f"<!-- keys: {format_name} {name} -->" in text


@functools.cache
def validator_of(format_name):
    schema = schema_of(format_name)
    return jsonschema.validators.validator_for(schema)(schema)


@pytest.mark.parametrize(("kind", "name"), SHIPPED)
def test_shipped_file_satisfies_its_schema_as_written_and_resolved(kind, name):
    path = sources.find_file(name, kind)
    written, resolved = sources.read_toml(path), sources.read_source(path, kind).data
    validator = validator_of(written["format"])
    validator.validate(written)
    if resolved != written:
        validator.validate(resolved)


@pytest.mark.parametrize(
    ("key", "value"), [("mass", -1.0), ("mas", 1.0), ("mass", "x"), ("inertia", [1.0, 2.0])]
)
def test_schema_refuses_what_the_model_refuses(key, value):
    data = load_vehicle("coach_manchester").model_dump(mode="json", exclude_none=True)
    validator = validator_of("railsim-vehicle/1")
    validator.validate(data)
    data["bodies"]["carbody"][key] = value
    with pytest.raises(jsonschema.ValidationError):
        validator.validate(data)


@pytest.mark.parametrize("page", sorted(PAGES - {"assess.md"}))  # that one shows parts only
def test_whole_files_in_the_manual_are_valid(page, tmp_path):
    text = (DOCS / "user" / page).read_text()
    blocks = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    whole = [block for block in blocks if block.startswith("format")]
    assert whole
    for block in whole:
        path = tmp_path / "example.toml"
        path.write_text(block)
        load_any(path)


@pytest.mark.parametrize(
    ("flangeway", "fits"), [(0.04, True), ([[0.0, 0.06], [3.0, 0.04]], True), (0.3, False)]
)
def test_flangeway_is_one_width_or_rows_of_widths(flangeway, fits):
    data = load_track("straight").model_dump(mode="json", exclude_none=True)
    data["check_rail"] = [{"rail": "right", "flangeway": flangeway}]
    assert validator_of("railsim-track/1").is_valid(data) == fits
