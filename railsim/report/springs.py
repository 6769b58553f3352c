"""A self-contained page about a trailing-arm suspension: inputs, results, checks, pictures.

`collected` computes all results that the file allows, `figures` draws them, `page` returns HTML.
"""

import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from railsim.definitions.spring import TrailingArmSuspension
from railsim.errors import InputError
from railsim.page import rendered
from railsim.plot import springs as pictures
from railsim.plot.style import styled
from railsim.springs.datasheet import data_sheets
from railsim.springs.design import Design, design
from railsim.springs.tables import (
    Texts,
    case_table,
    check_table,
    fatigue_table,
    loaded_table,
    ride_height_table,
    search_table,
    sheet_table,
)
from railsim.springs.tolerance import RideHeight, ride_heights
from railsim.springs.verification import Fatigue, Verification, dynamic_loads, fatigue, verify
from railsim.version import __version__

if TYPE_CHECKING:
    from railsim.springs.search import SearchResult

DPI = 130

METHOD = (
    "Vertical stiffness after EN 13906-1; lateral and tilting stiffness of the loaded coil column "
    "after Krettek and Sobczak with the factors of Grossi (2025), ch. 2; equilibrium of the arm "
    "about its hinge, converged to round-off. The system stiffness is load over deflection; the "
    "tangent stiffness, which governs vibrations, is the slope of the load over the rise of the "
    "axle.",
    "Solid height for hot coiled springs with closed and ground ends. The stress at solid height "
    "is without, the fatigue stress with the factor for the curvature of the wire and the lateral "
    "load; the fatigue margin is the ratio of allowable to actual upper stress at the same lower "
    "stress. Buckling after EN 13906-1, where the lateral stiffness of the column vanishes.",
)
FORMS = {
    "grossi": 'Moment of the nest in the form of the reference (equilibrium = "grossi").',
    "energy": "Moment of the nest as the derivative of its stored energy "
    '(equilibrium = "energy"); the reference\'s own numbers are those of "grossi".',
}


@dataclass(frozen=True)
class Collected:
    """All results for a suspension that its file allows.

    Attributes
    ----------
    suspension : TrailingArmSuspension
        Content of the file.
    verification : Verification
        Load cases and checks.
    design, fatigue, ride_heights, search : optional
        Results of the other tables; None where the file has no such table, or where the design has
        no physical solution (with a remark).
    remarks : tuple of str
        What could not be computed, with reasons.
    """

    suspension: TrailingArmSuspension
    verification: Verification
    design: Design | None
    fatigue: Mapping[str, Fatigue] | None
    ride_heights: Sequence[RideHeight] | None
    search: "SearchResult | None"
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """A table of the page; `words` are the columns with text, `failed` the rows in red."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    words: frozenset[int] = frozenset({0})
    failed: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Picture:
    """A picture of the page: PNG in base64, its width on the screen, its caption."""

    png: str
    width: int
    caption: str


@dataclass
class Section:
    """A section of the page."""

    title: str
    texts: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    figures: list[Picture] = field(default_factory=list)


def collected(suspension: TrailingArmSuspension, search: "SearchResult | None" = None) -> Collected:
    """Compute all results that a suspension file allows.

    Raises
    ------
    InputError : the suspension cannot be verified.
    """
    verification = verify(suspension)
    designed, remarks = None, []
    if suspension.target is not None and suspension.inner is not None:
        try:
            designed = design(suspension)
        except InputError as error:
            remarks = [f"Design: {fault.key}: {fault.found}." for fault in error.faults]
    return Collected(
        suspension=suspension,
        verification=verification,
        design=designed,
        fatigue=fatigue(suspension) if suspension.fatigue is not None else None,
        ride_heights=ride_heights(suspension) if suspension.tolerances is not None else None,
        search=search,
        remarks=tuple(remarks),
    )


def figures(results: Collected) -> dict[str, Figure]:
    """Draw all pictures; returned by the names of their files."""
    suspension = results.suspension
    with styled():
        drawn = {
            "stiffness": pictures.stiffness_figure(results.verification),
            "deflection": pictures.deflection_figure(suspension, results.verification),
            "arm": pictures.arm_figure(suspension, results.verification),
        }
        if results.design is not None:
            drawn["coils"] = pictures.coils_figure(suspension, results.design)
        if results.fatigue is not None:
            drawn["goodman_smith"] = pictures.goodman_figure(suspension, results.fatigue)
        if results.ride_heights is not None:
            tare = suspension.fatigue.tare if suspension.fatigue is not None else None
            drawn["ride_height"] = pictures.ride_height_figure(results.ride_heights, tare)
        if results.search is not None:
            drawn["search"] = pictures.search_figure(results.search)
    return drawn


def as_png(figure: Figure) -> bytes:
    """Draw a figure as the bytes of a PNG file."""
    buffer = BytesIO()
    with styled():
        figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return buffer.getvalue()


def page(results: Collected, drawn: Mapping[str, bytes]) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    results : Collected
    drawn : mapping of str to bytes
        PNG pictures by the names of `figures`.
    """
    suspension = results.suspension
    sections = [_inputs(suspension)]
    if results.design is not None:
        sections.append(_design(suspension, results.design, drawn))
    sections += [_cases(results.verification, drawn), _checks(results.verification)]
    sections.append(_sheets(suspension, results.verification))
    if results.fatigue is not None:
        sections.append(_fatigue(suspension, results.fatigue, drawn))
    if results.ride_heights is not None:
        sections.append(_ride_heights(results.ride_heights, drawn))
    if results.search is not None:
        sections.append(_search(results.search, drawn))
    failed = [check.name for check in results.verification.checks if not check.ok]
    count = len(results.verification.checks)
    verdict = {
        "ok": not failed,
        "text": f"Not met: {', '.join(failed)}." if failed else f"All {count} checks are met.",
    }
    return rendered(
        "railsim.report",
        "templates/document.html",
        title=f"Primary suspension: {suspension.name}",
        styles=["templates/document.css"],
        lead=f"{suspension.source or 'no source given'}. Written by railsim {__version__}.",
        verdict=verdict,
        sections=sections,
        method=[*METHOD, FORMS[suspension.arm.equilibrium], *results.remarks],
    )


def _picture(drawn: Mapping[str, bytes], name: str, caption: str) -> list[Picture]:
    if name not in drawn:
        return []
    png = drawn[name]
    width = int.from_bytes(png[16:20], "big")  # the header of a PNG file
    return [Picture(b64encode(png).decode(), round(width * 96 / DPI), caption)]


def _inputs(suspension: TrailingArmSuspension) -> Section:
    arm, material = suspension.arm, suspension.material
    names = list(suspension.springs)
    springs = suspension.springs.values()
    rows = [
        ["mean coil diameter D / mm", *(f"{s.mean_diameter * 1e3:.6g}" for s in springs)],
        ["wire diameter d / mm", *(_or_dash(s.wire_diameter, 1e3) for s in springs)],
        ["active coils n", *(_or_dash(s.active_coils, 1.0) for s in springs)],
        ["free height / mm", *(f"{s.free_height * 1e3:.6g}" for s in springs)],
        ["seat above the axle / mm", *(f"{h * 1e3:.6g}" for h in suspension.seat_heights)],
    ]
    if suspension.inner is not None:
        rows.append(["engages at / mm", "0", f"{suspension.engagement * 1e3:.6g}"])
    general = [
        ["arm length / mm", f"{arm.length * 1e3:.6g}"],
        ["bushing / (Nm/rad)", f"{arm.bush_torsional_stiffness:.6g}"],
        ["shear modulus / GPa", f"{material.G * 1e-9:.6g}"],
        ["Young's modulus / GPa", f"{material.E * 1e-9:.6g}"],
        ["mounting load / kN", f"{suspension.mounting.load * 1e-3:.6g}"],
        ["deflection under it / mm", f"{suspension.mounting.deflection * 1e3:.6g}"],
    ]
    if suspension.target is not None:
        general += [
            ["target load / kN", f"{suspension.target.load * 1e-3:.6g}"],
            ["deflection under it / mm", f"{suspension.target.deflection * 1e3:.6g}"],
        ]
    return Section(
        "Inputs", tables=[Table(["spring", *names], rows), Table(["arm and loads", ""], general)]
    )


def _design(
    suspension: TrailingArmSuspension, result: Design, drawn: Mapping[str, bytes]
) -> Section:
    low, high = (load * 1e-3 for load in result.load_range)
    text = (
        f"At the target the arm is turned by {np.degrees(result.rotation):.4f} degrees. Two "
        f"springs of these diameters can meet the target deflection under loads from {low:.3f} to "
        f"{high:.3f} kN."
    )
    rows = [
        [name, f"{K_V * 1e-3:.3f}", "-" if n is None else f"{n:.4f}"]
        for name, K_V, n in zip(result.names, result.K_V, result.n, strict=True)
    ]
    table = Table(["spring", "K_V / (N/mm)", "n for the given wire"], rows)
    caption = "Active coils over the wire diameter for the designed stiffnesses."
    return Section("Design", [text], [table], _picture(drawn, "coils", caption))


def _cases(result: Verification, drawn: Mapping[str, bytes]) -> Section:
    pictures_shown = [
        *_picture(drawn, "stiffness", "System stiffness over load and over deflection."),
        *_picture(drawn, "deflection", "Deflection, rotation and heights over the load."),
        *_picture(drawn, "arm", "The arm in its load cases, to scale, seen from the side."),
    ]
    return Section("Load cases", [], [_typeset(case_table(result))], pictures_shown)


def _sheets(suspension: TrailingArmSuspension, result: Verification) -> Section:
    sheets = data_sheets(suspension, result)
    text = (
        "In the manner of EN 13298: dimensions, stiffness, mass and natural frequency of the coils "
        "(EN 13906-1), and each spring under each load. Stresses without (tau) and with the factor "
        "for curvature of the wire and lateral load (tau_k). Lateral stiffness after Grossi (used "
        "here), EN 13906-1 and Wahl without his load factor C_l, whose chart is not free, nor are "
        "the equations of Gross and Sparing."
    )
    shown = [_typeset(sheet_table(sheets)), _typeset(loaded_table(sheets))]
    return Section("Data sheets of the springs", [text], shown)


def _checks(result: Verification) -> Section:
    header, rows = check_table(result.checks)
    rows = [[*row, check.note] for row, check in zip(rows, result.checks, strict=True)]
    failed = frozenset(i for i, check in enumerate(result.checks) if not check.ok)
    shown = _typeset(([*header, "comparison"], rows), words=frozenset({0, 5}), failed=failed)
    return Section("Checks", [], [shown])


def _fatigue(
    suspension: TrailingArmSuspension, result: Mapping[str, Fatigue], drawn: Mapping[str, bytes]
) -> Section:
    loads = dynamic_loads(suspension)
    text = (
        f"Between {loads['min_load'] * 1e-3:.2f} and {loads['max_load'] * 1e-3:.2f} kN; stresses "
        "with the factor for the curvature of the wire and the lateral load."
    )
    caption = "Goodman-Smith diagram: stress range of each spring against the material's line."
    return Section(
        "Fatigue",
        [text],
        [_typeset(fatigue_table(result))],
        _picture(drawn, "goodman_smith", caption),
    )


def _ride_heights(results: Sequence[RideHeight], drawn: Mapping[str, bytes]) -> Section:
    text = (
        "Deviation of the height of the bogie frame above the axle from the nominal value when "
        "springs and bushing deviate within their tolerances. Random: root of the sum of squares "
        "of the single deviations. Worst case: all at their limits in the least favourable "
        "combination."
    )
    caption = "Influence of each tolerance on the ride height, and the range under every load."
    return Section(
        "Scatter of the ride height",
        [text],
        [_typeset(ride_height_table(results))],
        _picture(drawn, "ride_height", caption),
    )


def _search(result: "SearchResult", drawn: Mapping[str, bytes]) -> Section:
    text = (
        f"{result.tried} nests tried, {result.feasible} of them within all limits before "
        f"refinement; ranked by {result.objective}. Dimensions are rounded to manufactured sizes; "
        "the limits listed are those active at each optimum."
    )
    caption = "Mass and fatigue margin of the nests; the numbers are the ranks of the table."
    table = _typeset(search_table(result), words=frozenset({7}))
    return Section("Feasible nests", [text], [table], _picture(drawn, "search", caption))


def _or_dash(value: float | None, scale: float) -> str:
    return "-" if value is None else f"{value * scale:.6g}"


def _typeset(
    texts: Texts, words: frozenset[int] = frozenset({0}), failed: frozenset[int] = frozenset()
) -> Table:
    """A table of the page from one in ASCII, with typographic signs."""

    def typeset(cell: str) -> str:
        cell = cell.replace("+-", "± ").replace(" x ", " × ")
        return re.sub(r"(?<![\w.])-(?=\d)", "−", cell)

    header, rows = texts
    cells = [
        [cell if column in words else typeset(cell) for column, cell in enumerate(row)]
        for row in rows
    ]
    return Table([typeset(title) for title in header], cells, words=words, failed=failed)
