"""Tables, lines and data of the command `contact`."""

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railsim.cli.common import table
from railsim.files import whole_file

if TYPE_CHECKING:
    from railsim.contact.summary import ContactSummary


TABLES = ("functions.csv", "conicity.csv", "patches.csv")


def write_tables(folder: Path, found: "ContactSummary") -> None:
    """Write the CSV files of the command."""
    columns, patches = found.functions, found.patches
    contents: tuple[tuple[list[str], list[list[Any]]], ...] = (
        (list(columns), [[f"{x:.9g}" for x in row] for row in zip(*columns.values(), strict=True)]),
        (
            ["amplitude", "equivalent_conicity"],
            [
                [f"{a:.6g}", f"{v:.6g}"]
                for a, v in zip(found.amplitudes, found.conicity, strict=True)
            ],
        ),
        (
            list(patches[0]) if patches else ["lateral"],
            [[x if isinstance(x, str) else f"{x:.7g}" for x in row.values()] for row in patches],
        ),
    )
    for name, (header, rows) in zip(TABLES, contents, strict=True):
        with (
            whole_file(folder / name) as partial,
            partial.open("w", newline="", encoding="utf-8") as file,
        ):
            writer = csv.writer(file)
            writer.writerow(header)
            writer.writerows(rows)


def contact_data(found: "ContactSummary") -> dict[str, Any]:
    """Everything for ``--json``, SI."""
    data: dict[str, Any] = {name: values.tolist() for name, values in found.functions.items()}
    data["equivalent_conicity"] = [
        {"amplitude": float(a), "value": float(v)}
        for a, v in zip(found.amplitudes, found.conicity, strict=True)
    ]
    data["jumps"] = [{"lateral": lateral, "side": side} for lateral, side in found.geometry.jumps()]
    data["patches"] = found.patches
    data["notes"] = found.notes
    return data


def contact_lines(found: "ContactSummary") -> list[str]:
    """Printed tables, in the field's units."""
    import numpy as np

    geometry, amplitudes, conicity = found.geometry, found.amplitudes, found.conicity

    rows = []
    count = geometry.lateral.size
    for i in range(0, count, max((count - 1) // 20, 1)):
        left, right = 0, 1
        rows.append(
            [
                f"{1e3 * geometry.lateral[i]:.2f}",
                f"{1e3 * geometry.delta_r[i]:.3f}",
                *(f"{1e3 * geometry.rolling_radius[i, s]:.3f}" for s in (left, right)),
                *(f"{np.degrees(geometry.contact_angle[i, s]):.2f}" for s in (left, right)),
                *(f"{1e3 * geometry.wheel_y[i, s]:.2f}" for s in (left, right)),
                f"{1e3 * geometry.roll[i]:.3f}",
            ]
        )
    header = [
        "y mm",
        "dr mm",
        "r left",
        "r right",
        "angle left",
        "right deg",
        "wheel y left",
        "right mm",
        "roll mrad",
    ]
    lines = table(header, rows, numbers=0)
    lines.append("")
    lines.append("Equivalent conicity (EN 15302)")
    shown = [i for i in range(amplitudes.size) if i % 2 and np.isfinite(conicity[i])]
    lines += table(
        ["amplitude mm", *(f"{1e3 * amplitudes[i]:.0f}" for i in shown)],
        [["tan(gamma_e)", *(f"{conicity[i]:.3f}" for i in shown)]],
    )
    lines.append("")
    lines.append(f"Patches of the right wheel under {1e-3 * found.load:.0f} kN")
    rows = [
        [
            f"{1e3 * row['lateral']:.2f}",
            row["method"] + (f", {row['zone']}" if row["zone"] else ""),
            f"{1e-3 * row['Q']:.1f}",
            f"{1e-3 * row['Y']:.1f}",
            f"{np.degrees(row['contact_angle']):.1f}",
            f"{1e3 * row['contact_y']:.2f}",
            f"{1e3 * row['length']:.1f}",
            f"{1e3 * row['width']:.1f}",
            f"{1e6 * row['area']:.0f}",
            f"{1e-6 * row['p_max']:.0f}",
        ]
        for row in found.patches
    ]
    header = [
        "y mm",
        "patch",
        "Q kN",
        "Y kN",
        "angle deg",
        "at y mm",
        "length",
        "width mm",
        "area mm2",
        "p_max MPa",
    ]
    lines += table(header, rows, numbers=2)
    return lines
