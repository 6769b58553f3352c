"""Tables, lines and data of the command `contact`."""

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railsim.cli.common import table
from railsim.files import whole_file

if TYPE_CHECKING:
    import numpy as np

    from railsim.contact.elastic import LoadedContact
    from railsim.contact.exact_normal import ExactContact
    from railsim.contact.geometry import ContactGeometry


TABLES = ("functions.csv", "conicity.csv", "patches.csv")

PATCH_SHARES = (-0.6, -0.3, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.65, 0.7)
"""Displacements at which patches are shown, over the largest one."""


def _columns(geometry: "ContactGeometry") -> dict[str, "np.ndarray[Any, Any]"]:
    """Contact functions by the names of the interface, SI."""
    columns = {"lateral": geometry.lateral, "delta_r": geometry.delta_r}
    for name, values in (
        ("rolling_radius", geometry.rolling_radius),
        ("contact_angle", geometry.contact_angle),
        ("contact_y", geometry.contact_y),
        ("wheel_y", geometry.wheel_y),
    ):
        for side, side_name in enumerate(("left", "right")):
            columns[f"{name}_{side_name}"] = values[:, side]
    columns["roll"] = geometry.roll
    return columns


def _patch_rows(
    contacts: dict[float, "LoadedContact"], solutions: dict[float, "ExactContact"]
) -> list[dict[str, Any]]:
    """One row for each patch of table and boundary elements, SI."""
    import numpy as np

    rows = []
    for y, contact in contacts.items():
        for patch in contact.patches:
            rows.append(
                {
                    "lateral": y,
                    "method": "table",
                    "zone": patch.zone,
                    "N": patch.N,
                    "Q": patch.N_z,
                    "Y": patch.N_y,
                    "contact_y": patch.y,
                    "contact_angle": patch.angle,
                    "length": 2.0 * patch.a,
                    "width": 2.0 * patch.b,
                    "area": float(np.pi) * patch.a * patch.b,
                    "p_max": patch.p_max,
                    "z": contact.z,
                }
            )
        for exact in solutions[y].patches[::-1] if y in solutions else ():
            rows.append(
                {
                    "lateral": y,
                    "method": "exact",
                    "zone": "",
                    "N": exact.N,
                    "Q": exact.N_z,
                    "Y": exact.N_y,
                    "contact_y": exact.y,
                    "contact_angle": exact.angle,
                    "length": exact.length,
                    "width": exact.width,
                    "area": exact.area,
                    "p_max": exact.p_max,
                    "z": solutions[y].z,
                }
            )
    return rows


def write_tables(
    folder: Path,
    geometry: "ContactGeometry",
    amplitudes: "np.ndarray[Any, Any]",
    conicity: "np.ndarray[Any, Any]",
    contacts: dict[float, "LoadedContact"],
    solutions: dict[float, "ExactContact"],
) -> None:
    """Write the CSV files of the command; return their paths."""
    columns = _columns(geometry)
    patches = _patch_rows(contacts, solutions)
    contents: tuple[tuple[list[str], list[list[Any]]], ...] = (
        (list(columns), [[f"{x:.9g}" for x in row] for row in zip(*columns.values(), strict=True)]),
        (
            ["amplitude", "equivalent_conicity"],
            [[f"{a:.6g}", f"{v:.6g}"] for a, v in zip(amplitudes, conicity, strict=True)],
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


def contact_data(
    geometry: "ContactGeometry",
    amplitudes: "np.ndarray[Any, Any]",
    conicity: "np.ndarray[Any, Any]",
    contacts: dict[float, "LoadedContact"],
    solutions: dict[float, "ExactContact"],
    notes: list[str],
) -> dict[str, Any]:
    """Everything for ``--json``, SI."""
    data: dict[str, Any] = {name: values.tolist() for name, values in _columns(geometry).items()}
    data["equivalent_conicity"] = [
        {"amplitude": float(a), "value": float(v)}
        for a, v in zip(amplitudes, conicity, strict=True)
    ]
    data["jumps"] = [{"lateral": place, "side": side} for place, side in geometry.jumps()]
    data["patches"] = _patch_rows(contacts, solutions)
    data["notes"] = notes
    return data


def contact_lines(
    geometry: "ContactGeometry",
    amplitudes: "np.ndarray[Any, Any]",
    conicity: "np.ndarray[Any, Any]",
    contacts: dict[float, "LoadedContact"],
    solutions: dict[float, "ExactContact"],
    load: float,
) -> list[str]:
    """Printed tables, in the field's units."""
    import numpy as np

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
    lines.append(f"Patches of the right wheel under {1e-3 * load:.0f} kN")
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
        for row in _patch_rows(contacts, solutions)
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
