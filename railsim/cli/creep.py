"""The creep part of ``railsim contact``: curves and traction fields, the table's generator."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railsim.cli.output import Output
from railsim.cli.progress import progress_bar
from railsim.files.access import check_folder

if TYPE_CHECKING:
    from railsim.contact.creep_curves import Patch

PICTURES = ("creep_curves.png", "traction.png")
TABLES = ("creep_curves.csv",)
FIELD_SIZE = 1.2
"""Magnitude of the normalised creepage of the traction fields."""

TABLE_FILE = "creep_table.npz"


def check_friction(friction: float) -> None:
    """Refuse a friction coefficient out of its range."""
    from railsim.errors import input_error

    if not 0.0 < friction <= 1.0:
        raise input_error("--friction", f"{friction:g}", "above 0, at most 1")


def write(output: Output, patch: "Patch", rows: Sequence[dict[str, Any]]) -> None:
    """Write pictures and table."""
    from railsim.contact.creep import LAWS
    from railsim.contact.creep_curves import CASES, exact_force
    from railsim.plot.creep import creep_curves_figure, traction_figure
    from railsim.table import Table

    fields = {
        case: exact_force(patch, FIELD_SIZE * patch.unit_creepages(direction))
        for case, direction in CASES.items()
    }
    figures = (creep_curves_figure(patch, LAWS), traction_figure(fields, patch.mu * patch.N))
    tables = (Table(list(rows[0]), rows),)
    for name, content in zip((*PICTURES, *TABLES), (*figures, *tables), strict=True):
        output.write(name, content)


def build_table(workers: int, output: Output) -> None:
    """Recompute the table of the full theory, in ``creep_table`` by default, and compare it."""
    import numpy as np

    from railsim.contact.creep_table import build_nodes, gather_nodes, shipped_nodes, write_nodes

    folder = output.folder or Path("creep_table")
    check_folder(folder)
    with progress_bar("creep table", quiet=output.quiet) as show:
        for done, count in build_nodes(folder, workers):
            show(done / count)
    nodes = gather_nodes(folder)
    write_nodes(nodes, folder / TABLE_FILE)
    difference = float(np.abs(nodes.force - shipped_nodes().force).max())
    words = f"largest difference from the shipped table {difference:.1e} of mu N"
    output.written.append(folder / TABLE_FILE)
    record = {"file": str(folder / TABLE_FILE), "largest_difference": difference}
    output.answer(record, [words])
