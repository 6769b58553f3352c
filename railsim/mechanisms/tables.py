"""Results as tables of texts in the field's units, for the terminal and for the page."""

from collections.abc import Sequence

import numpy as np

from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.kinematics import folded
from railsim.mechanisms.quantities import SHOWN, quantity, shown
from railsim.mechanisms.selection import Check, Choice
from railsim.mechanisms.summary import parameter_data

Texts = tuple[list[str], list[list[str]]]


def position_table(result: Analysis) -> Texts:
    """Results at the start, in the zone and at the end."""
    rows = [("start", {k: float(v[0]) for k, v in result.output.items()})]
    rows += list(result.zone.items())
    rows += [("end", {k: float(v[-1]) for k, v in result.output.items()})]
    return value_table(result, rows)


def value_table(result: Analysis, rows: Sequence[tuple[str, dict[str, float]]]) -> Texts:
    """Rows of results by name, a column each."""
    names = list(result.output)
    header = ["at"]
    for name in names:
        unit = quantity(name, result.definition).shown
        header.append(f"{name} / {unit}" if unit else name)
    texts = []
    for row, values in rows:
        cells = []
        for name in names:
            what = quantity(name, result.definition)
            value = values[name]
            if name in result.definition.angles:
                value = float(folded(value))
            cells.append(f"{value * what.scale:.{what.digits}f}" if np.isfinite(value) else "-")
        texts.append([row, *cells])
    return header, texts


def upright(table: Texts) -> Texts:
    """A table with rows and columns exchanged, for the terminal."""
    header, rows = table
    turned = [list(column) for column in zip(header, *rows, strict=True)]
    return turned[0], turned[1:]


def parameter_table(result: Analysis) -> Texts:
    """Every parameter with its unit and where it is from."""
    definition = result.definition
    rows = [
        [name, shown(value, definition.unit_of(name), 8), definition.provenance_of(name)]
        for name, value in parameter_data(result).items()
    ]
    return ["parameter", "value", "provenance"], rows


def check_table(checks: Sequence[Check]) -> Texts:
    """One row for each check."""
    rows = []
    for check in checks:
        unit, scale = SHOWN.get(check.unit, (check.unit, 1.0))
        sign = ">=" if check.sense == "above" else "<="
        rows.append(
            [
                check.name,
                f"{check.value * scale:.2f}",
                f"{sign} {check.limit * scale:.2f}",
                unit,
                "yes" if check.ok else "NO",
            ]
        )
    return ["check", "value", "must be", "unit", "met"], rows


def selection_table(choices: Sequence[Choice]) -> Texts:
    """One row for each row of a catalogue."""
    rows = [
        [c.catalogue, c.name, "yes" if c.fits else "no", "; ".join(c.reasons)] for c in choices
    ]
    return ["catalogue", "row", "fits", "stroke, or why not"], rows


def reaction_table(result: Analysis) -> Texts:
    """Largest reaction of every joint."""
    what = quantity("travel", result.definition)
    rows = [
        [name, f"{r.max:.1f}", f"{r.at * what.scale:.{what.digits}f}"]
        for name, r in result.reactions.items()
    ]
    return ["joint", "largest reaction / N", f"at {what.shown}"], rows
