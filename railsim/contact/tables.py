"""Tables of a `ContactSummary`: contact functions, equivalent conicity, patches, creep forces."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.contact.creep import LAWS
from railsim.contact.creep_curves import Patch
from railsim.contact.summary import ContactSummary
from railsim.table import Column, Table

_CONICITY = Column("equivalent_conicity", "tan(gamma_e)", "", ".3f")
MOST_LINES = 20  # of the contact functions that are printed


def function_table(summary: ContactSummary) -> Table:
    """Return the contact functions over the lateral displacement."""
    shown = {
        "lateral": ("y", "mm", ".2f"),
        "delta_r": ("dr", "mm", ".3f"),
        "rolling_radius_left": ("r left", "mm", ".3f"),
        "rolling_radius_right": ("r right", "mm", ".3f"),
        "contact_angle_left": ("angle left", "deg", ".2f"),
        "contact_angle_right": ("right", "deg", ".2f"),
        "contact_y_left": ("rail y left", "mm", ".2f"),
        "contact_y_right": ("right", "mm", ".2f"),
        "wheel_y_left": ("wheel y left", "mm", ".2f"),
        "wheel_y_right": ("right", "mm", ".2f"),
        "roll": ("roll", "mrad", ".3f"),
    }
    columns = [Column(name, *how) for name, how in shown.items()]
    values = summary.functions
    return Table(columns, zip(*(values[name] for name in shown), strict=True))


def printed_functions(summary: ContactSummary) -> Table:
    """Return some lines of the contact functions, without the positions on the rails."""
    table = function_table(summary)
    step = max((len(table) - 1) // MOST_LINES, 1)
    chosen = [column for column in table.columns if not column.name.startswith("contact_y")]
    return Table(chosen, table.records()[::step])


def conicity_table(summary: ContactSummary) -> Table:
    """Return the equivalent conicity over the amplitude."""
    columns = [Column("amplitude", unit="mm", format="g"), _CONICITY]
    return Table(columns, zip(summary.amplitudes, summary.conicity, strict=True))


def printed_conicity(summary: ContactSummary) -> Table:
    """Return the equivalent conicity of every whole millimetre, side by side."""
    rows = list(zip(summary.amplitudes[1::2], summary.conicity[1::2], strict=True))
    upright = Table([Column("amplitude", unit="mm", format="g"), _CONICITY], rows)
    upright = upright.transposed("amplitude mm")
    upright.caption = "Equivalent conicity (EN 15302)"
    if np.isnan(summary.conicity[1::2]).any():
        upright.caption += "; -: no oscillation with this amplitude within the range"
    return upright


def conicity_map_table(summary: ContactSummary, gauges: Sequence[float], values: Floats) -> Table:
    """Return the equivalent conicity, float64[gauge, amplitude], of whole millimetres by gauge."""
    whole = range(1, len(summary.amplitudes), 2)
    sizes = [f"{1e3 * summary.amplitudes[k]:.0f} mm" for k in whole]
    columns = [Column(f"amplitude {size}", size, format=".3f") for size in sizes]
    rows = [[gauge, *row[1::2]] for gauge, row in zip(gauges, values, strict=True)]
    title = "Equivalent conicity over gauge and amplitude"
    return Table([Column("gauge", unit="mm", format=".1f"), *columns], rows, title)


def patch_table(summary: ContactSummary) -> Table:
    """Return the contact patches of the right wheel."""
    shown = {
        "lateral": ("y", "mm", ".2f"),
        "method": ("patch", "", ""),
        "zone": ("zone", "", ""),
        "N": ("N", "kN", ".1f"),
        "Q": ("Q", "kN", ".1f"),
        "Y": ("Y", "kN", ".1f"),
        "contact_y": ("at y", "mm", ".2f"),
        "contact_angle": ("angle", "deg", ".1f"),
        "length": ("length", "mm", ".1f"),
        "width": ("width", "mm", ".1f"),
        "area": ("area", "mm2", ".0f"),
        "p_max": ("p_max", "MPa", ".0f"),
        "z": ("z", "mm", ".3f"),
    }
    title = f"Patches of the right wheel under {1e-3 * summary.load:.0f} kN"
    return Table([Column(name, *how) for name, how in shown.items()], summary.patches, title)


def creep_table(patch: Patch, rows: Sequence[dict[str, Any]]) -> Table:
    """Return the creep forces of all laws over mu N, by direction and size of the creepage."""
    title = (
        f"Creep force over mu N, a = {1e3 * patch.a:.2f} mm, b = {1e3 * patch.b:.2f} mm, "
        f"N = {1e-3 * patch.N:.1f} kN, mu = {patch.mu:g}"
    )
    lines: dict[tuple[str, float], dict[str, Any]] = {}
    for row in rows:
        line = lines.setdefault((row["case"], row["size"]), {k: row[k] for k in ("case", "size")})
        line[row["law"]] = f"{row['T_x']:z.3f} {row['T_y']:z.3f}"
    columns = [Column("case", "T_x, T_y by"), Column("size", "creepage", "", "g")]
    laws = [Column(law, format=">") for law in LAWS]
    return Table([*columns, *laws], lines.values(), title)
