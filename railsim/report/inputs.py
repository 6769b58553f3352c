"""What was run: vehicles, tracks, inputs of the study, assumptions, settings."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from markupsafe import Markup

from railsim.compare import differing, flat_keys
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import track_remarks
from railsim.definitions.vehicle.definition import Vehicle
from railsim.description.rest import rest_frequencies
from railsim.errors import InputError, ModelError
from railsim.model.statics import static_loads
from railsim.profiles import Profile
from railsim.report.document import Drawing, Section, Table, page_table
from railsim.report.drawings import element_kinds, track_svg, vehicle_svg
from railsim.result import Results
from railsim.simulation.assumptions import assumptions
from railsim.studies.columns import number
from railsim.studies.inputs import Inputs
from railsim.text import in_words, printable
from railsim.units import number_with_unit

MOST_SHOWN = 12  # values of an input of a study
MOST_AT_REST = 3  # vehicles
MOST_ASSUMED = 4  # pairs of a vehicle and a track
MOST_VALUES = 3  # of an assumption in runs of one vehicle on one track
MOST_DIFFERENCES = 40  # keys in which the vehicles differ


def _assumed(runs: Sequence[Inputs], whole: str) -> Table:
    """Return the assumptions of runs; those that are the same in all, once, under `whole`."""
    columns: dict[str, dict[str, dict[str, None]]] = {}
    for one in runs:
        texts = columns.setdefault(f"{one.vehicle_label} on {one.track_label}", {})
        for line in assumptions(one.vehicle, one.track, one.settings, one.speed)[1:]:
            key, words = line.split(None, 1)
            texts.setdefault(key, {})[words] = None
    if all(texts == next(iter(columns.values())) for texts in columns.values()):
        columns = {whole: next(iter(columns.values()))}
    keys = dict.fromkeys(key for texts in columns.values() for key in texts)
    shown, more = dict(list(columns.items())[:MOST_ASSUMED]), len(columns) - MOST_ASSUMED
    rows = [[key, *(_either(list(texts.get(key, ()))) for texts in shown.values())] for key in keys]
    header, note = ["", *map(printable, shown)], f"{more} more vehicles on tracks." * (more > 0)
    return Table(header, rows, "Assumptions", range(len(shown) + 1), note=note)


def _either(values: Sequence[str]) -> str:
    more = len(values) - MOST_VALUES
    return "; or ".join(values[:MOST_VALUES]) + (f"; and {more} more" if more > 0 else "")


def inputs_section(runs: Sequence[Inputs], results: Results, inputs: Mapping[str, Any]) -> Section:
    """Return the section of the page about vehicles, tracks, inputs and settings."""
    section = Section("Inputs", id="inputs")
    vehicles: dict[str, Any] = {}
    tracks: dict[str, list[Track]] = {}
    for run in runs:
        vehicles.setdefault(run.vehicle_label, run.vehicle)
        tracks.setdefault(run.track_label, []).append(run.track)
    if runs and not results:
        section.texts.append(
            "Vehicles and tracks as their files are now, with the values of the first run of each "
            "vehicle on each track; there are no files of results."
        )
    for name, vehicle in vehicles.items():
        words = f"{_name_beside(vehicle, name)}{vehicle.source or ''}"
        kinds = [kind.replace("_", " ") for kind in element_kinds(vehicle)]
        section.drawings.append(Drawing(name, words, Markup(vehicle_svg(vehicle)), kinds))
    for name, variants in tracks.items():
        presets = dict.fromkeys(track.support.preset for track in variants)
        rails = ", ".join(one if one == "rigid" else f"elastic ({one})" for one in presets)
        friction = ", ".join(dict.fromkeys(track.friction_words for track in variants))
        unusual = dict.fromkeys(str(one) for track in variants for one in track_remarks(track))
        words = f"{_name_beside(variants[0], name)}Friction {friction}; rails {rails}."
        words += f" Remarks: {'; '.join(unusual)}." if unusual else ""
        section.drawings.append(Drawing(name, words, Markup(track_svg(variants[0]))))
    section.details += _at_rest(results)
    if len(vehicles) > 1:
        section.tables.append(_differences(vehicles))
    if inputs:
        section.tables.append(_inputs(inputs))
    if runs:
        section.tables.append(_assumed(runs, "all runs" if results or not inputs else "first runs"))
    if results:
        section.tables.append(_settings(results))
    return section


def _name_beside(definition: Vehicle | Track, label: str) -> str:
    """Return the name of a file's content where its label does not say it."""
    return "" if definition.name == label else f"{definition.name}. "


def _at_rest(results: Results) -> list[Table]:
    """Return how the vehicles of the results stand at rest, each in its load case."""
    vehicles: list[tuple[Vehicle, Mapping[str, Profile]]] = []
    for result in results.values():
        if len(vehicles) == MOST_AT_REST:
            break
        if all(result.vehicle() != other for other, _ in vehicles):
            vehicles.append((result.vehicle(), result.profiles))
    rest_tables = []
    for vehicle, profiles in vehicles:
        with suppress(InputError, ModelError):
            loads = static_loads(vehicle, profiles=profiles)
            subject = f"{vehicle.name}, load '{loads.load}' at rest"
            rest_tables += [page_table(table, subject) for table in loads.tables]
            rest_tables.append(page_table(rest_frequencies(vehicle, profiles), subject))
    return rest_tables


def _inputs(inputs: Mapping[str, Any]) -> Table:
    """Inputs of a study, without those that are not given."""
    rows = []
    for key, value in inputs.items():
        if value in (None, [], {}, False, "", ()) or key in ("folder", "name"):
            continue
        for name, part in value.items() if isinstance(value, dict) else [("", value)]:
            values = [v for v in (part if isinstance(part, list) else [part]) if v is not None]
            if not values:
                continue
            words = ", ".join(in_words(_number(v)) for v in values[:MOST_SHOWN])
            more = len(values) - MOST_SHOWN
            words += f" and {more} more" if more > 0 else ""
            rows.append([f"{key} {name}".strip(), words])
    return Table(["input", "value"], rows, "Inputs of the study", (0, 1))


def _number(value: Any) -> Any:
    """The number of a text such as ``16e6``; anything else, with a unit too, as it is."""
    with suppress(ValueError):
        if isinstance(value, str) and number_with_unit(value) is None:
            return number(value)
    return value


def _differences(vehicles: Mapping[str, Any]) -> Table:
    rows = [[key, *values] for key, values in differing(list(vehicles.values())).items()]
    more = len(rows) - MOST_DIFFERENCES
    return Table(
        ["key", *map(printable, vehicles)], rows[:MOST_DIFFERENCES],
        "Differences between the vehicles (SI)", range(len(vehicles) + 1),
        note=f"{more} more keys differ." if more > 0 else "",
    )  # fmt: skip


def _settings(results: Results) -> Table:
    """Return a table of the settings of the runs, with differences from the default."""
    usual = dict(flat_keys(Settings().model_dump()))
    found: dict[str, dict[str, None]] = {}
    for result in results.values():
        own = dict(flat_keys(result.settings().model_dump()))
        own["step"] = f"{1e3 * float(result.attributes.get('step', 0.0)):.4g} ms"
        for key, value in own.items():
            found.setdefault(key, {})[in_words(value)] = None
    always = ("scheme", "step", "output_rate", "creep_law", "fastsim_grid", "normal_contact")
    rows = []
    for key, values in found.items():
        changed = key != "step" and set(values) != {in_words(usual.get(key))}
        if key in always or changed:
            rows.append([key, ", ".join(values), "changed" if changed else ""])
    return Table(["setting", "value", ""], rows, "Method of computation", range(3))
