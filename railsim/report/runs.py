"""A self-contained page about runs: inputs, values and limits, curves, spread.

`page` composes it from the records of all runs and the results of those whose curves are shown.
The page loads no other files; its plots are drawn by uPlot (`vendor/`).
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from markupsafe import Markup

from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.description.rest import rest_frequencies
from railsim.errors import InputError, ModelError
from railsim.model.statics import static_loads
from railsim.notation import QUANTITIES
from railsim.page import rendered
from railsim.profiles import Profile
from railsim.report.curves import cells_of, curve_data, groups
from railsim.report.drawings import element_kinds, track_svg, vehicle_svg
from railsim.report.limits import assessed
from railsim.report.published import beside_published
from railsim.report.spread import LEAST, WORDS, columns, command, parameters, spread_rows
from railsim.report.tables import Cell, Table, of_values
from railsim.result import Result
from railsim.text import printable
from railsim.version import __version__

Record = Mapping[str, Any]
MOST_ROWS = 300  # of a table on the page
MOST_SHOWN = 12  # values of an input of a study
MOST_AT_REST = 3  # vehicles
MOST_DIFFERENCES = 40  # keys in which the vehicles differ


@dataclass(frozen=True)
class Drawing:
    """A drawing of the page; `kinds` are the labels of its colours."""

    title: str
    words: str
    svg: str
    kinds: Sequence[str] = ()


@dataclass
class Section:
    """A section of the page.

    Attributes
    ----------
    id, title : str
    texts : list of str
    drawings : list of Drawing
    tables : list of Table
    plots : list of str
        Plots that the script of the page draws: the number of a group of curves, or ``spread``.
    details : list of Table
        Tables that are folded at first.
    """

    id: str
    title: str
    texts: list[str] = field(default_factory=list)
    drawings: list[Drawing] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    plots: list[str] = field(default_factory=list)
    details: list[Table] = field(default_factory=list)


def page(
    title: str,
    records: Sequence[Record],
    results: Mapping[str, Result],
    remarks: Sequence[str] = (),
    assessable: Mapping[str, Result] | None = None,
    inputs: Mapping[str, Any] | None = None,
) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    title : str
        Title of the page.
    records : sequence of mapping
        One for each run, as `railsim.result.facts.run_facts` with ``name`` and ``labels``,
        including runs that failed or have not been done.
    results : mapping of str to Result
        Results, by the names of their runs, whose curves are shown.
    remarks : sequence of str
        Further notes for the reader.
    assessable : mapping of str to Result, optional
        All results, which are assessed together; by default `results`.
    inputs : mapping, optional
        Inputs of the study whose runs these are, as in its ``study.json``.
    """
    found = groups(results)
    cells = cells_of(found)
    curves = [curve_data(group, cells) for group in found]
    data: dict[str, Any] = {"curves": [group for group in curves if group["quantities"]]}
    limits = assessed(results if assessable is None else assessable)
    sections = [_peaks(records, results)]
    if found:
        sections.append(_curves(len(data["curves"]), records, results))
    if limits.tables or limits.details:
        title_of = "Comparison with limits"
        tables, details = limits.tables, limits.details
        sections.append(Section("limits", title_of, tables=tables, details=details))
    if spread := _spread(records, data, inputs or {}):
        sections.append(spread)
    if published := _published(results):
        sections.append(published)
    sections.append(_what_was_run(records, results, inputs or {}))
    sections.append(_remarks(records, remarks))
    return rendered(
        "railsim.report",
        "templates/runs.html",
        title=title,
        styles=["vendor/uPlot.min.css", "templates/runs.css"],
        scripts=["vendor/uPlot.iife.min.js", "templates/study.js", "templates/runs.js"],
        data=data,
        schemes="light dark",
        lead=_lead(records, results),
        verdict=_verdict(records, limits.verdicts),
        sections=[section for section in sections if section],
        foot=f"Written by railsim {__version__}; plots by uPlot 1.6.32 (MIT). "
        "Values in customary units; files and the Python interface use SI units.",
        wrap=Markup("_<wbr>"),
    )


def _done(records: Sequence[Record]) -> list[Record]:
    return [record for record in records if record.get("peaks")]


def _lead(records: Sequence[Record], results: Mapping[str, Result]) -> str:
    number = f"{len(records)} run{'s' * (len(records) != 1)}"
    names = {kind: list(dict.fromkeys(str(record["labels"].get(kind, "")) for record in records))
             for kind in ("vehicle", "track")}  # fmt: skip
    parts = [number]
    for kind, found in names.items():
        if len(found) <= 4 and all(found):
            parts.append(f"{kind}{'s' * (len(found) > 1)} {', '.join(map(printable, found))}")
        else:
            parts.append(f"{len(found)} {kind}s")
    versions = sorted({str(r.attributes.get("railsim_version", "")) for r in results.values()})
    created = sorted(str(r.attributes.get("created", "")) for r in results.values())
    if versions and any(versions):
        parts.append(f"computed by railsim {', '.join(filter(None, versions))}")
    if created and created[-1]:
        parts.append(f"last run {created[-1]}")
    return "; ".join(parts) + "."


def _verdict(
    records: Sequence[Record], verdicts: Sequence[tuple[bool, str]]
) -> list[dict[str, Any]]:
    counts = Counter(str(record["status"]) for record in records)
    whole = counts == {"complete": len(records)}
    words = ", ".join(f"{number} {status}" for status, number in counts.items())
    text = f"All {len(records)} runs are complete." if whole else f"Of {len(records)} runs {words}."
    if len(records) == 1:
        text = f"The run is {words[2:]}."
    return [{"ok": whole, "text": text}, *({"ok": ok, "text": told} for ok, told in verdicts)]


def _peaks(records: Sequence[Record], results: Mapping[str, Result]) -> Section:
    """Peaks of the shown runs side by side, with position and time."""
    shown = [record for record in _done(records) if record["name"] in results]
    rows: dict[tuple[str, str], list[Cell]] = {}
    for number, record in enumerate(shown):
        wheelsets = results[record["name"]].wheelsets
        for peak in record["peaks"]:
            quantity = QUANTITIES[peak["quantity"]]
            words = f"{quantity.words}, {WORDS[peak['kind']]}"
            row = rows.setdefault((quantity.name, peak["kind"]), [words])
            row += [""] * (1 + number - len(row))
            wheelset = peak.get("wheelset", "")
            where = f"wheelset {wheelsets.index(wheelset) + 1} " if wheelset in wheelsets else ""
            where += f"{peak.get('side', '')} at {peak['distance']:.1f} m"
            row.append((quantity.text(peak["value"]), where))
    table = Table(
        ["", *(printable(str(record["name"])) for record in shown)],
        [row + [""] * (1 + len(shown) - len(row)) for row in rows.values()],
    )
    texts = ["Largest magnitudes over all steps after the start of the run, with their "
             "signs; wheelsets are numbered from the leading end."]  # fmt: skip
    if not shown:
        texts = ["The study kept no results of its runs (`--keep summary`); their values follow."]
    elif len(shown) < len(_done(records)):
        texts.append(f"{len(shown)} of {len(_done(records))} runs, those with the largest values; "
                     "all others follow in the table of runs.")  # fmt: skip
    return Section("peaks", "Peaks", texts, tables=[table] if shown else [])


def _curves(number: int, records: Sequence[Record], results: Mapping[str, Result]) -> Section:
    if not number:
        text = "The results hold none of the quantities that are drawn here."
        return Section("curves", "Along the track", [text])
    texts = []
    if len(results) < len(_done(records)):
        texts = [f"{len(results)} of {len(_done(records))} runs, those with the largest values."]
    return Section("curves", "Along the track", texts, plots=[str(k) for k in range(number)])


def _spread(
    records: Sequence[Record], data: dict[str, Any], inputs: Mapping[str, Any]
) -> Section | None:
    """Table of all runs, and what their values depend on."""
    done = _done(records)
    if len(records) < LEAST:
        return None
    varied = parameters(records)
    data["spread"] = {
        "parameters": varied,
        "columns": columns(records),
        "runs": [
            {
                "name": printable(str(record["name"])),
                "status": str(record["status"]),
                "reason": printable(str(record.get("status_reason", ""))),
                "command": printable(command(record, inputs)),
            }
            for record in records
        ],
    }
    table = Table(
        ["value", "smallest", "in run", "median", "largest", "in run"],
        spread_rows(done),
        f"Spread over {len(done)} runs",
        words=frozenset({0, 2, 5}),
        note="Peaks and medians over full curves by magnitude, over all wheels.",
    )
    section = Section("spread", "Over the study", plots=["runs"], details=[table])
    if len(done) >= LEAST and varied:
        section.texts = [f"Varied: {', '.join(map(printable, varied))}."]
        section.plots.insert(0, "spread")
    return section


def _published(results: Mapping[str, Result]) -> Section | None:
    rows = beside_published(results)
    if not rows:
        return None
    tables = []
    for study in dict.fromkeys(row.study.name for row in rows):
        own = [row for row in rows if row.study.name == study]
        cells = []
        for row in own:
            quantity = QUANTITIES[row.value.quantity]
            side = f" {row.value.side}" if row.value.side else ""
            at = row.value.read if isinstance(row.value.read, str) else f"t = {row.value.read:g} s"
            cells.append(
                [
                    printable(row.run),
                    quantity.words,
                    f"wheelset {row.value.wheelset}{side}, {at}",
                    quantity.text(row.published),
                    quantity.text(row.found),
                    f"{100.0 * row.difference:+.1f} %",
                    row.rails,
                ]
            )
        first = own[0].study
        note = f"{first.program}: {first.source}. {' '.join(first.notes)}"
        header = ["run", "", "read", "published", "here", "difference", "rails of the run"]
        words = frozenset({0, 1, 2, 6})
        tables.append(Table(header, cells, first.name, words=words, note=note))
    return Section("published", "Comparison with published values", tables=tables)


def _what_was_run(
    records: Sequence[Record], results: Mapping[str, Result], inputs: Mapping[str, Any]
) -> Section:
    section = Section("inputs", "Inputs")
    labels = {record["name"]: record["labels"] for record in records}
    vehicles: dict[str, Any] = {}
    tracks: dict[str, list[Track]] = {}
    for name, result in results.items():
        own = labels.get(name, {})  # two files may hold vehicles of one name
        vehicle, track = result.vehicle(), result.track()
        vehicles.setdefault(str(own.get("vehicle", vehicle.name)), vehicle)
        tracks.setdefault(str(own.get("track", track.name)), []).append(track)
    for name, vehicle in vehicles.items():
        words = f"{vehicle.name}. {vehicle.source or ''}"
        section.drawings.append(
            Drawing(
                printable(name),
                printable(words),
                _svg(vehicle_svg(vehicle)),
                [kind.replace("_", " ") for kind in element_kinds(vehicle)],
            )
        )
    for name, variants in tracks.items():
        rails = ", ".join(dict.fromkeys(_rails(track) for track in variants))
        values = sorted({mu for track in variants for mu in track.friction})
        friction = ", ".join(f"{mu:g}" for mu in values)
        words = f"{variants[0].name}. Friction {friction}; rails {rails}."
        drawing = _svg(track_svg(variants[0]))
        section.drawings.append(Drawing(printable(name), printable(words), drawing))
    section.details += _at_rest(results)
    if len(vehicles) > 1:
        section.tables.append(_differences(vehicles))
    if results:
        section.tables.append(_settings(results))
    if inputs:
        section.tables.append(_inputs(inputs))
    return section


def _at_rest(results: Mapping[str, Result]) -> list[Table]:
    """Return how the vehicles of the results stand at rest, each in its load case."""
    vehicles: list[tuple[Vehicle, Mapping[str, Profile]]] = []
    for result in results.values():
        vehicle = result.vehicle()
        if all(vehicle != known for known, _ in vehicles) and len(vehicles) < MOST_AT_REST:
            vehicles.append((vehicle, result.profiles))
    found = []
    for vehicle, profiles in vehicles:
        with suppress(InputError, ModelError):
            loads = static_loads(vehicle, profiles=profiles)
            subject = f"{vehicle.name}, load '{loads.load}' at rest"
            found += [of_values(table, subject) for table in loads.tables]
            found.append(of_values(rest_frequencies(vehicle, profiles), subject))
    return found


def _inputs(inputs: Mapping[str, Any]) -> Table:
    """Inputs of a study, without those that are not given."""
    rows = []
    for key, value in inputs.items():
        if value in (None, [], {}, False, "", ()) or key == "folder":
            continue
        parts = value.items() if isinstance(value, dict) else [("", value)]
        for name, part in parts:
            values = part if isinstance(part, list) else [part]
            words = ", ".join(_number(v) for v in values[:MOST_SHOWN])
            more = len(values) - MOST_SHOWN
            words += f" and {more} more" if more > 0 else ""
            rows.append([printable(f"{key} {name}".strip()), printable(words)])
    return Table(["input", "value"], rows, "Inputs of the study", words=frozenset({0, 1}))


def _rails(track: Track) -> str:
    preset = track.support.preset
    return "rigid" if preset == "rigid" else f"elastic ({preset})"


def _svg(text: str) -> Any:
    return Markup(text)


def _differences(vehicles: Mapping[str, Any]) -> Table:
    """Return the keys in which vehicles differ."""
    flat = {name: dict(_flat(vehicle.model_dump())) for name, vehicle in vehicles.items()}
    keys = dict.fromkeys(key for values in flat.values() for key in values)
    told = ("name", "source")
    rows = [
        [key, *(str(values.get(key, "—")) for values in flat.values())]
        for key in keys
        if key not in told and len({str(values.get(key)) for values in flat.values()}) > 1
    ]
    more = len(rows) - MOST_DIFFERENCES
    return Table(
        ["key", *map(printable, vehicles)],
        [[printable(cell) for cell in row] for row in rows[:MOST_DIFFERENCES]],
        "Differences between the vehicles (SI)",
        words=frozenset(range(len(vehicles) + 1)),
        note=f"{more} more keys differ." if more > 0 else "",
    )


def _flat(node: Any, key: str = "") -> list[tuple[str, Any]]:
    if isinstance(node, dict):
        return [row for name, value in node.items()
                for row in _flat(value, f"{key}.{name}" if key else str(name))]  # fmt: skip
    if isinstance(node, tuple | list) and node and isinstance(node[0], tuple | list | dict):
        return [(key, f"{len(node)} rows: {node}"[:60])]
    return [(key, node)]


def _settings(results: Mapping[str, Result]) -> Table:
    """Return a table of the settings of the runs, with differences from the default."""
    usual = dict(_flat(Settings().model_dump()))
    found: dict[str, dict[str, None]] = {}
    for result in results.values():
        own = dict(_flat(result.settings().model_dump()))
        own["step"] = f"{1e3 * float(result.attributes.get('step', 0.0)):.4g} ms"
        for key, value in own.items():
            found.setdefault(key, {})[str(value)] = None
    always = ("scheme", "step", "output_rate", "creep_law", "fastsim_grid", "normal_contact")
    rows = []
    for key, values in found.items():
        changed = key != "step" and set(values) != {str(usual.get(key))}
        if key in always or changed:
            rows.append([key, ", ".join(values), "changed" if changed else ""])
    words = frozenset({0, 1, 2})
    return Table(["setting", "value", ""], rows, "Method of computation", words=words)


def _number(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _remarks(records: Sequence[Record], more: Sequence[str]) -> Section:
    """Runs that failed or ended early, and remarks, equal ones once."""
    section = Section("remarks", "Failures and remarks", list(map(printable, more)))
    rows = [
        [printable(str(record["name"])), str(record["status"]),
         printable(str(record.get("status_reason", "")))]
        for record in records
        if record["status"] != "complete"
    ]  # fmt: skip
    if rows:
        left = len(rows) - MOST_ROWS
        section.tables.append(
            Table(
                ["run", "status", "reason"],
                rows[:MOST_ROWS],
                f"{len(rows)} of {len(records)} runs did not reach the requested end",
                words=frozenset({0, 1, 2}),
                note=f"{left} more are in summary.csv." if left > 0 else "",
            )
        )
    else:
        section.texts.append("All runs reached the requested end.")
    said: dict[str, list[str]] = {}
    for record in records:
        for remark in record.get("remarks", ()):
            said.setdefault(str(remark), []).append(str(record["name"]))
    cells = []
    for remark, names in list(said.items())[:MOST_ROWS]:
        more_names = f" and {len(names) - 3} more" if len(names) > 3 else ""
        cells.append([printable(remark), printable(", ".join(names[:3]) + more_names)])
    if cells:
        section.tables.append(
            Table(
                ["remark", "runs"],
                cells,
                "Remarks",
                words=frozenset({0, 1}),
                note=f"{len(said) - MOST_ROWS} more are in summary.csv."
                if len(said) > MOST_ROWS
                else "",
            )
        )
    else:
        section.texts.append("There are no remarks on the runs.")
    return section
