"""A self-contained page about a trailing-arm suspension: inputs, results, checks, pictures.

`compute` computes all results that the file allows, `figures` draws them, `page` returns HTML.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from railsim.definitions.spring import TrailingArmSuspension
from railsim.design_checks import check_table
from railsim.errors import Faults
from railsim.plot import springs as plots
from railsim.report.document import Section, as_png, design_page, pictures
from railsim.springs import tables
from railsim.springs.datasheet import data_sheets
from railsim.springs.design import Design, design
from railsim.springs.tolerance import RideHeight, ride_heights
from railsim.springs.verification import Fatigue, Verification, dynamic_loads, fatigue, verify

if TYPE_CHECKING:
    from railsim.springs.search import SearchResult

REPORT = "report.html"
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

SHEETS = (
    "In the manner of EN 13298: dimensions, stiffness, mass and natural frequency of the coils "
    "(EN 13906-1), and each spring under each load. Stresses without (tau) and with the factor "
    "for curvature of the wire and lateral load (tau_k). Lateral stiffness after Grossi (used "
    "here), EN 13906-1 and Wahl without his load factor C_l, whose chart is not free, nor are "
    "the equations of Gross and Sparing."
)
SCATTER = (
    "Deviation of the height of the bogie frame above the axle from the nominal value when "
    "springs and bush deviate within their tolerances. Statistical: root of the sum of squares "
    "(RSS) of the single deviations. Worst case: all at their limits in the least favourable "
    "combination."
)
CAPTIONS = {
    "coils": "Active coils over the wire diameter for the designed stiffnesses.",
    "stiffness": "System stiffness over load and over deflection.",
    "deflection": "Deflection, rotation and heights over the load.",
    "arm": "The arm in its load cases, to scale, seen from the side.",
    "goodman_smith": "Goodman-Smith diagram: stress range of each spring, the material's line.",
    "ride_height": "Influence of each tolerance on the ride height, and the range under every "
    "load.",
    "search": "Mass and fatigue margin of the nests; the numbers are the ranks of the table.",
}

NAMES = (REPORT, *(f"{name}.png" for name in CAPTIONS))
"""Of all files that there can be."""


@dataclass(frozen=True)
class PageResults:
    """All results for a suspension that its file allows; None where it has no such table."""

    suspension: TrailingArmSuspension
    verification: Verification
    design: Design | None  # None, with a remark, also where there is no physical solution
    fatigue: Mapping[str, Fatigue] | None
    ride_heights: Sequence[RideHeight] | None
    search: "SearchResult | None"
    remarks: tuple[str, ...]  # what could not be computed, with reasons


def compute(suspension: TrailingArmSuspension, search: "SearchResult | None" = None) -> PageResults:
    """Compute all results that a suspension file allows.

    Raises InputError: the suspension cannot be verified.
    """
    designed, faults = None, Faults()
    if suspension.target is not None and suspension.inner is not None:
        with faults.caught():
            designed = design(suspension)
    remarks = (f"Design: {fault.key}: {fault.found}." for fault in faults)
    return PageResults(
        suspension=suspension, verification=verify(suspension), design=designed,
        fatigue=fatigue(suspension) if suspension.fatigue is not None else None,
        ride_heights=ride_heights(suspension) if suspension.tolerances is not None else None,
        search=search, remarks=tuple(remarks),
    )  # fmt: skip


def files(
    suspension: TrailingArmSuspension, search: "SearchResult | None" = None
) -> dict[str, bytes]:
    """Compute what a suspension file allows; pictures and the page by the names of their files."""
    results = compute(suspension, search)
    drawn = {name: as_png(figure) for name, figure in figures(results).items()}
    content = {f"{name}.png": png for name, png in drawn.items()}
    return content | {REPORT: page(results, drawn).encode()}


def figures(results: PageResults) -> dict[str, Figure]:
    """Draw all pictures; returned by the names of their files."""
    suspension = results.suspension
    made = {
        "stiffness": plots.stiffness_figure(results.verification),
        "deflection": plots.deflection_figure(suspension, results.verification),
        "arm": plots.arm_figure(suspension, results.verification),
    }
    if results.design is not None:
        made["coils"] = plots.coils_figure(suspension, results.design)
    if results.fatigue is not None:
        made["goodman_smith"] = plots.goodman_figure(suspension, results.fatigue)
    if results.ride_heights is not None:
        tare = suspension.fatigue.tare if suspension.fatigue is not None else None
        made["ride_height"] = plots.ride_height_figure(results.ride_heights, tare)
    if results.search is not None and results.fatigue is not None:
        made["search"] = plots.search_figure(results.search)
    return made


def page(results: PageResults, figures: Mapping[str, bytes]) -> str:
    """Return the page as HTML, with PNG pictures by the names of `figures`."""
    suspension, verification = results.suspension, results.verification
    sheets = data_sheets(suspension, verification)
    drawings = partial(pictures, figures, CAPTIONS)
    sections = [Section("Inputs", [], tables.input_tables(suspension))]
    if results.design is not None:
        low, high = (load * 1e-3 for load in results.design.load_range)
        text = (
            "At the target the arm is turned by "
            f"{np.degrees(results.design.rotation):.4f} degrees. Two springs of these "
            "diameters can meet the target deflection under loads from "
            f"{low:.3f} to {high:.3f} kN."
        )
        designed = [tables.design_table(suspension, results.design)]
        sections.append(Section("Design", [text], designed, drawings(["coils"])))
    cases = [tables.load_table(suspension), tables.case_table(verification)]
    listed = [tables.sheet_table(sheets), tables.loaded_table(sheets)]
    no_fatigue = [] if suspension.fatigue else [tables.NO_FATIGUE]
    sections += [
        Section("Load cases", [], cases, drawings(["stiffness", "deflection", "arm"])),
        Section("Checks", no_fatigue, [check_table(verification.checks, notes=True)]),
        Section("Data sheets of the springs", [SHEETS], listed),
    ]
    if results.fatigue is not None:
        loads = dynamic_loads(suspension)
        text = (
            f"Between {loads['min_load'] * 1e-3:.2f} and {loads['max_load'] * 1e-3:.2f} kN; "
            "stresses with the factor for the curvature of the wire and the lateral load."
        )
        rows = [tables.fatigue_table(results.fatigue)]
        sections.append(Section("Fatigue", [text], rows, drawings(["goodman_smith"])))
    if results.ride_heights is not None:
        rows = [tables.ride_height_table(results.ride_heights)]
        title = "Scatter of the ride height"
        sections.append(Section(title, [SCATTER], rows, drawings(["ride_height"])))
    if (found := results.search) is not None:
        text = (
            f"{found.tried} nests tried, {found.feasible} of them within all limits before "
            f"refinement; ranked by {found.objective}. Dimensions are rounded to manufactured "
            "sizes; the limits listed are those active at each optimum."
        )
        rows = [tables.search_table(found)]
        sections.append(Section("Feasible nests", [text], rows, drawings(["search"])))
    method = [*METHOD, FORMS[suspension.arm.equilibrium], *results.remarks]
    title = f"Primary suspension: {suspension.name}"
    return design_page(title, suspension.source, verification.checks, sections, method)
