"""Pages about a model against a test, an identification, wear over distance or tonnage."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from railsim.assessment.model_comparison import ModelValidation
from railsim.assessment.verdict import FAIL, INCOMPLETE
from railsim.errors import input_error
from railsim.files.access import read_bytes
from railsim.identification import identified
from railsim.plot import validation as plots
from railsim.report.document import Drawing, Section, as_png, document, page_table, pictures
from railsim.report.wear import RAILS, WHEELS, shares_of, wear_tables

RECORDS = ("model_validation.json", "identified.json", "wear.json")
LARGEST_RECORD, LARGEST_PICTURE = 200_000_000, 20_000_000  # bytes
PNG = b"\x89PNG\r\n\x1a\n"
CAPTIONS = {
    "scatter": "Simulated over measured section values; dashed the limit of the mean, dotted twice "
    "that of the standard deviation.",
    "differences": "Differences over the limit of their standard deviation; line: their mean.",
    "overlays": "Channels over 400 m in the middle of the run, low-passed at 20 Hz.",
    "spectra": "Power spectral densities.",
    "fits": "Measured, with the values of the file, and with the identified ones, 4 s of the run; "
    "means and linear drifts are drawn but not compared.",
    "wear": "Profiles, new and worn, with the depth of wear.",
    "residuals": "Cumulative periodograms of the residuals: a straight line where they are white.",
}
VALIDATION = (
    "In each section of the track the same values are formed of both: quasi-static values are "
    "medians, largest values 99.85 % percentiles (both ends on straight track) after a low pass of "
    "20 Hz, accelerations of the body between 0.4 and 10 Hz. A difference is simulated less "
    "measured, positive where the simulation overestimates the magnitude.",
)
UNITS = "Units as in the table of differences; radius positive for curves to the right."
IDENTIFICATION = (
    "Least squares over the Fourier coefficients of the differences in the band (or the values "
    "named), weighted by the noise of each channel; the covariance is the inverse of J'J with the "
    "derivatives J, times the mean square of the weighted residuals where that is above 1.",
)


@dataclass(frozen=True)
class Part:
    """What a page says about one comparison, identification or calculation of wear."""

    title: str
    verdict: str
    ok: bool
    remarks: Sequence[str]
    sections: Sequence[Section]
    method: Sequence[str]


def measured_page(parts: Sequence[Part], title: str = "") -> str:
    """Return the page about comparisons of models with tests, identifications and wear."""
    alone = len(parts) == 1
    sections = []
    for part in parts:
        head = [] if alone else [Section(part.title, [part.verdict, *part.remarks])]
        sections += [*head, *part.sections]
    words = " ".join(p.verdict if alone else f"{p.title}: {p.verdict}" for p in parts)
    return document(
        title or "; ".join(part.title for part in parts),
        sections,
        list(dict.fromkeys(text for part in parts for text in part.method)),
        {"text": words, "ok": all(part.ok for part in parts)},
        remarks=parts[0].remarks if alone else (),
    )


def as_section(part: Part, number: int) -> Section:
    """Return a section of the page about runs; tables after the first are folded."""
    found = Section(part.title, [part.verdict, *part.remarks], id=f"measured{number}")
    for section in part.sections:
        found.texts += section.texts
        found.drawings += section.drawings
        found.details += [page_table(table, section.title) for table in section.tables]
    found.tables, found.details = found.details[:1], found.details[1:]
    return found


def as_drawings(figures: Mapping[str, Figure]) -> list[Drawing]:
    """Return figures by their names as drawings with captions."""
    return pictures({name: as_png(figure) for name, figure in figures.items()}, CAPTIONS)


def validation_figures(validation: ModelValidation) -> dict[str, Figure]:
    """Return the pictures of a comparison by their names; those of channels where it has them."""
    figures = {"scatter": plots.scatter(validation), "differences": plots.differences(validation)}
    if validation.overlays:
        figures |= {"overlays": plots.overlays(validation), "spectra": plots.spectra(validation)}
    return figures


def validation_part(result: ModelValidation, further: Sequence[Drawing] = ()) -> Part:
    """Return what a page says about a model against a test; `further` pictures at the end."""
    words = {FAIL: "The model does not match the test.", INCOMPLETE: "Too few sections."}
    text = words.get(result.verdict, "The model matches the test within all limits.")
    sections = [
        Section("Differences and limits", tables=[result.table()]),
        Section("Pictures", drawings=[*as_drawings(validation_figures(result)), *further]),
        Section("Values of the sections", [UNITS], [result.section_table()]),
    ]
    method = (*VALIDATION, result.edition)
    return Part(result.title, text, result.verdict not in words, result.remarks, sections, method)


def identification_part(record: Mapping[str, Any], figures: list[Drawing]) -> Part:
    """Return what a page says about an identification, by its record."""
    unidentified = record["unidentified"]
    white = ((one["channel"], one["white"] is not False) for one in record["channels"])
    not_white = identified.residual_remark(white)
    bounded = [words for words in record["remarks"] if identified.AT_BOUND in words]
    text = "All parameters are identified; the residuals are white."
    if unidentified:
        text = "Not all parameters can be told apart."
    elif bounded:
        text = " ".join(bounded)
    elif not_white:
        text = not_white
    values = [identified.parameter_table(record), identified.correlation_table(record)]
    sections = [
        Section("Parameters", unidentified, values),
        Section("Residuals", tables=[identified.residual_table(record)]),
        Section("Pictures", drawings=figures),
    ]
    title = f"{record['vehicle']}: identified parameters"
    good = not (not_white or unidentified or bounded)
    remarks = [words for words in record["remarks"] if words not in text]
    return Part(title, text, good, remarks, sections, IDENTIFICATION)


def wear_part(record: Mapping[str, Any], figures: list[Drawing]) -> Part:
    """Return what a page says about the wear of wheels or rails, by its record."""
    if "track" in record:
        what, of, worn, runs, sides = "rails", RAILS, "track", "traffic", RAILS.sides
    else:
        what, of, worn, runs, sides = "wheels", WHEELS, "vehicle", "routes", ("rows",)
    rows = {side: record[side] for side in sides}
    last, ended = next(iter(rows.values()))[-1]["distance"] / of.scale, record["ended"]
    text = f"{'Ended after' if ended else 'Computed to'} {last:g} {of.unit}"
    text += f": {ended}" if ended else "."
    tables, method = wear_tables(of, rows), f"Law of wear {record['law']}, {of.note}."
    words = [shares_of(record[runs])]
    sections = [Section("Wear", words, tables), Section("Pictures", drawings=figures)]
    title = f"{record[worn]}: wear of the {what}"
    return Part(title, text, not ended, record["remarks"], sections, [method])


def is_measured(file: str | Path) -> bool:
    """Return whether `railsim validate-model`, `identify`, `wear` or `rail-wear` wrote it."""
    return _record_of(Path(file)) is not None


def _record_of(path: Path) -> Path | None:
    if path.name in RECORDS and path.is_file():
        return path
    return next((path / name for name in RECORDS if (path / name).is_file()), None)


def read_part(file: str | Path) -> Part:
    """Return what was found by one of these commands, by the folder it wrote.

    Raises InputError: a record that cannot be read, or is none.
    """
    path = _record_of(Path(file))
    if path is None:
        raise input_error(file, "no record", " or ".join(RECORDS))
    try:
        record = json.loads(read_bytes(path, LARGEST_RECORD))
        if path.name == RECORDS[0]:
            return validation_part(ModelValidation.of(record), _pictures(path.parent, "overlays"))
        if path.name == RECORDS[1]:
            return identification_part(record, _pictures(path.parent, "fits", "residuals"))
        return wear_part(record, _pictures(path.parent, "wear"))
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError) as error:
        found = f"{type(error).__name__}: {error}"[:100]
        allowed = "the file as its command has written it"
        raise input_error(path, found, allowed) from None


def _pictures(folder: Path, *names: str) -> list[Drawing]:
    """Return pictures beside a record, those that are there."""
    files = {name: folder / f"{name}.png" for name in names}
    as_drawings = {n: read_bytes(f, LARGEST_PICTURE) for n, f in files.items() if f.is_file()}
    return pictures({n: x for n, x in as_drawings.items() if x[:8] == PNG}, CAPTIONS, names)
