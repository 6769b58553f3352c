"""The creep part of ``railsim contact``: curves and traction fields, the table's generator."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railsim.cli.common import echo, print_json
from railsim.cli.progress import progress_bar
from railsim.files.access import check_folder, whole_file

if TYPE_CHECKING:
    from railsim.contact.creep_curves import Patch

PICTURES = ("creep_curves.png", "traction.png")
TABLES = ("creep_curves.csv",)
FIELD_SIZE = 1.2
"""Magnitude of the normalised creepage of the traction fields."""

TABLE_FILE = "creep_table.npz"


def check_friction(friction: float) -> None:
    """Refuse a friction coefficient out of its range."""
    from railsim.errors import Fault, InputError

    if not 0.0 < friction <= 1.0:
        raise InputError([Fault("--friction", "", f"{friction:g}", "above 0, at most 1")])


def write(folder: Path, patch: "Patch", rows: Sequence[dict[str, Any]]) -> None:
    """Write pictures and table; the folder exists and files may be replaced."""
    from railsim.contact.creep import LAWS
    from railsim.contact.creep_curves import CASES, exact_force
    from railsim.plot.creep import creep_curves_figure, traction_figure
    from railsim.plot.style import save
    from railsim.table import Table

    fields = {
        case: exact_force(patch, FIELD_SIZE * patch.unit_creepages(direction))
        for case, direction in CASES.items()
    }
    figures = (creep_curves_figure(patch, LAWS), traction_figure(fields, patch.mu * patch.N))
    for name, figure in zip(PICTURES, figures, strict=True):
        save(figure, folder / name, overwrite=True)
    with whole_file(folder / TABLES[0]) as partial:
        partial.write_text(Table(list(rows[0]), rows).csv(), encoding="utf-8")


def build_table(out: str | None, workers: int, as_json: bool, quiet: bool) -> None:
    """Recompute the table of the full theory into a folder and compare it with the shipped one.

    Parameters
    ----------
    out : str or None
        Folder of the rows and the result; by default ``creep_table``.
    workers : int
        Processes.
    """
    import numpy as np

    from railsim.contact.creep_table import build_nodes, gather_nodes, shipped_nodes, write_nodes

    folder = Path(out or "creep_table")
    check_folder(folder)
    with progress_bar("creep table", quiet=quiet) as show:
        for done, count in build_nodes(folder, workers):
            show(done / count)
    nodes = gather_nodes(folder)
    write_nodes(nodes, folder / TABLE_FILE)
    difference = float(np.abs(nodes.force - shipped_nodes().force).max())
    if as_json:
        print_json({"file": str(folder / TABLE_FILE), "largest_difference": difference})
        return
    echo(
        f"wrote {folder / TABLE_FILE}; largest difference from the shipped table "
        f"{difference:.1e} of mu N"
    )
