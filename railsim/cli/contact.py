"""``railsim contact``: contact geometry of a wheelset, equivalent conicity, patches, creep."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import echo, json_option, overwrite_option, print_json, quiet_option, table
from railsim.files import check_folder, make_folder, whole_file

if TYPE_CHECKING:
    import numpy as np

    from railsim.contact.elastic import LoadedContact
    from railsim.contact.exact_normal import ExactContact
    from railsim.contact.geometry import ContactGeometry
    from railsim.contact.table import ContactTable
    from railsim.plot.contact import Pair

PICTURES = ("profiles.png", "functions.png", "conicity.png", "patches.png")
TABLES = ("functions.csv", "conicity.csv", "patches.csv")
OTHER_NORMAL = {"hertz": "kik-piotrowski", "kik-piotrowski": "hertz"}
STEP = 5e-5
"""Step of the lateral displacement [m]."""

RANGES = {
    "gauge": (0.3, 2.5, "m"),
    "inclination": (0.0, 0.2, "(1:40 is 0.025)"),
    "back_to_back": (0.2, 2.4, "m"),
    "radius": (0.05, 1.5, "m"),
    "load": (1.0, 1e6, "N"),
    "max_shift": (0.001, 0.020, "m"),
}
"""What an option's number may be, and its unit."""

PATCH_SHARES = (-0.6, -0.3, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.65, 0.7)
"""Displacements at which patches are shown, over the largest one."""


@click.command()
@click.option(
    "--wheel",
    "wheels",
    multiple=True,
    default=("S1002",),
    show_default=True,
    metavar="W",
    help="Wheel profile, name or file; give it twice for different left and right wheels.",
)
@click.option(
    "--rail",
    "rails",
    multiple=True,
    default=("60E1",),
    show_default=True,
    metavar="R",
    help="Rail profile, name or file; twice for left and right.",
)
@click.option("--gauge", default=1.435, show_default=True, help="Track gauge (m).")
@click.option("--inclination", default=0.025, show_default=True, help="Rail inclination (1).")
@click.option(
    "--back-to-back",
    default=1.360,
    show_default=True,
    help="Distance between the flange backs (m).",
)
@click.option(
    "--radius",
    "radii",
    multiple=True,
    type=float,
    default=(0.46,),
    show_default=True,
    help="Rolling radius (m); twice for left and right.",
)
@click.option("--load", default=60e3, show_default=True, help="Vertical wheel load (N).")
@click.option(
    "--max-shift", default=0.010, show_default=True, help="Largest lateral displacement (m)."
)
@click.option(
    "--exact", is_flag=True, help="Check the patches by boundary elements (about ten seconds)."
)
@click.option(
    "--normal",
    type=click.Choice(list(OTHER_NORMAL)),
    default="hertz",
    show_default=True,
    help="Normal contact of the table; with --exact both are compared.",
)
@click.option(
    "--creep",
    is_flag=True,
    help="Creep forces of the centred wheel's patch by every creep law, and traction fields.",
)
@click.option(
    "--friction", default=0.4, show_default=True, help="Friction coefficient, for --creep."
)
@click.option(
    "--build-creep-table",
    is_flag=True,
    help="Only recompute the table of the creep law `table` (half an hour; can be interrupted).",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=2,
    show_default=True,
    help="Processes, for --build-creep-table.",
)
@click.option(
    "--out", metavar="DIR", help="Folder for pictures and tables; created if it does not exist."
)
@overwrite_option
@json_option
@quiet_option
def command(
    wheels: tuple[str, ...],
    rails: tuple[str, ...],
    gauge: float,
    inclination: float,
    back_to_back: float,
    radii: tuple[float, ...],
    load: float,
    max_shift: float,
    exact: bool,
    normal: str,
    creep: bool,
    friction: float,
    build_creep_table: bool,
    workers: int,
    out: str | None,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Contact geometry of a wheelset on its rails.

    Prints rolling radius difference, contact angles and contact positions over the lateral
    displacement, the equivalent conicity of EN 15302, and the contact patches of the right wheel
    under a load.

    \b
    Example:
      railsim contact --wheel S1002 --rail 60E1 --inclination 0.025 --out s1002_60e1
      railsim contact --wheel measured.whl --rail 54E1 --exact --json
      railsim contact --creep --friction 0.35 --out creep
    """  # noqa: D301 - click reads the escape
    import numpy as np

    from railsim.cli import creep as creep_part
    from railsim.contact import contact_geometry
    from railsim.plot.contact import Pair

    if build_creep_table:
        creep_part.build_table(out, workers, as_json, quiet)
        return
    _check_counts(wheel=wheels, rail=rails, radius=radii)
    _check_ranges(
        gauge=gauge,
        inclination=inclination,
        back_to_back=back_to_back,
        radius=radii,
        load=load,
        max_shift=max_shift,
    )
    written = (*PICTURES, *TABLES, *((*creep_part.PICTURES, *creep_part.TABLES) if creep else ()))
    folder = Path(out) if out else None
    if folder:
        check_folder(folder, written, overwrite=overwrite)
    wheel_pair, rail_pair = _profiles(wheels, "wheel"), _profiles(rails, "rail")
    radius_pair = (radii[0], radii[-1])
    steps = max(round(max_shift / STEP), 10)
    geometry = contact_geometry(
        wheel_pair,
        rail_pair,
        radius_pair,
        gauge,
        inclination,
        back_to_back,
        np.linspace(-max_shift, max_shift, 2 * steps + 1),
    )
    amplitudes = 1e-3 * np.arange(0.5, 1e3 * max_shift + 1e-9, 0.5)
    conicity = geometry.equivalent_conicity(amplitudes)
    pairs = [
        Pair(w, r, gauge, inclination, back_to_back)
        for w, r in zip(wheel_pair, rail_pair, strict=True)
    ]
    contact_table = _table(pairs[1], radius_pair, normal)
    places = [round(share * max_shift, 6) for share in PATCH_SHARES]
    contacts = _loaded(contact_table, geometry, places, load)
    solutions = _exact(pairs[1], radius_pair[1], geometry, list(contacts), load, exact)
    notes = _notes(pairs)
    patch = creep_part.patch_of(contacts, friction) if creep else None
    creep_rows = creep_part.rows_of(patch) if patch else []
    if folder:
        make_folder(folder)
    if folder and patch:
        creep_part.write(folder, patch, creep_rows)
    if folder:
        _write_tables(folder, geometry, amplitudes, conicity, contacts, solutions)
        other = _other_table(pairs[1], radius_pair, geometry, list(contacts), load, normal, exact)
        _write_pictures(
            folder, geometry, pairs, amplitudes, conicity, contacts, load, normal, solutions, other
        )
    if as_json:
        data = _data(geometry, amplitudes, conicity, contacts, solutions, notes)
        print_json(data | ({"creep": creep_rows} if patch else {}))
        return
    for note in notes:
        echo(note, err=True)
    for line in _lines(geometry, amplitudes, conicity, contacts, solutions, load):
        echo(line)
    if patch:
        for line in creep_part.lines_of(patch, creep_rows):
            echo(line)
    if folder and not quiet:
        echo(f"wrote {', '.join(written)} to {folder}", err=True)


def _check_counts(**given: Sequence[Any]) -> None:
    """Refuse more values than there are sides."""
    from railsim.errors import Fault, InputError

    faults = [
        Fault(f"--{name}", "", f"given {len(values)} times", "give it once, or for left and right")
        for name, values in given.items()
        if len(values) > 2
    ]
    if faults:
        raise InputError(faults)


def _check_ranges(**given: float | Sequence[float]) -> None:
    """Refuse numbers that mean nothing, all at once."""
    from railsim.errors import Fault, InputError

    faults = []
    for name, values in given.items():
        low, high, unit = RANGES[name]
        for value in values if isinstance(values, Sequence) else (values,):
            if not low <= value <= high:
                option = "--" + name.replace("_", "-")
                faults.append(Fault(option, "", f"found {value:g}", f"{low:g} to {high:g} {unit}"))
    if faults:
        raise InputError(faults)


def _profiles(names: Sequence[str], kind: Any) -> tuple[Any, Any]:
    """Left and right profile."""
    from railsim.profiles import load_profile

    loaded = {name: load_profile(name, kind) for name in dict.fromkeys(names)}
    return loaded[names[0]], loaded[names[-1]]


def _notes(pairs: Sequence["Pair"]) -> list[str]:
    """What was recognised in the profiles' files, once each."""
    profiles = {p.name: p for pair in pairs for p in (pair.wheel, pair.rail)}
    return [f"{p.source or p.name}: {note}" for p in profiles.values() for note in p.notes]


def _table(pair: "Pair", radii: tuple[float, float], normal: str) -> "ContactTable":
    from railsim.contact import cached_contact_table
    from railsim.contact.table import TableGrid

    return cached_contact_table(
        pair.wheel,
        pair.rail,
        radius=radii[1],
        gauge=pair.gauge,
        inclination=pair.inclination,
        back_to_back=pair.back_to_back,
        centre_height=0.5 * (radii[0] + radii[1]),
        grid=TableGrid(normal=normal),  # type: ignore[arg-type]
    )


def _loaded(
    contact_table: "ContactTable", geometry: "ContactGeometry", places: Sequence[float], load: float
) -> dict[float, "LoadedContact"]:
    """Patches of the right wheel at the given displacements, where the geometry knows them."""
    import numpy as np

    from railsim.contact.elastic import loaded_contact
    from railsim.errors import ModelError

    contacts = {}
    for y in places:
        i = int(np.argmin(np.abs(geometry.lateral - y)))
        roll = float(geometry.roll[i])
        if np.isfinite(roll):
            try:
                contacts[y] = loaded_contact(contact_table, y, roll, load)
            except ModelError:
                continue  # beyond the table: a wheel that has climbed its rail
    return contacts


def _exact(
    pair: "Pair",
    radius: float,
    geometry: "ContactGeometry",
    places: Sequence[float],
    load: float,
    wanted: bool,
) -> dict[float, "ExactContact"]:
    """The same patches by boundary elements."""
    if not wanted:
        return {}
    import numpy as np

    from railsim.contact.exact_normal import exact_contact
    from railsim.errors import ModelError

    solutions = {}
    for y in places:
        roll = float(geometry.roll[int(np.argmin(np.abs(geometry.lateral - y)))])
        try:
            solutions[y] = exact_contact(
                pair.wheel,
                pair.rail,
                y,
                roll,
                load,
                radius=radius,
                gauge=pair.gauge,
                inclination=pair.inclination,
                back_to_back=pair.back_to_back,
            )
        except ModelError:
            continue  # the load is not reached: a wheel that hangs on its flange
    return solutions


def _other_table(
    pair: "Pair",
    radii: tuple[float, float],
    geometry: "ContactGeometry",
    places: Sequence[float],
    load: float,
    normal: str,
    wanted: bool,
) -> dict[float, "LoadedContact"] | None:
    """Patches with the other kind of normal contact, for the comparison."""
    if not wanted:
        return None
    return _loaded(_table(pair, radii, OTHER_NORMAL[normal]), geometry, places, load)


def _write_pictures(
    folder: Path,
    geometry: "ContactGeometry",
    pairs: Sequence["Pair"],
    amplitudes: "np.ndarray[Any, Any]",
    conicity: "np.ndarray[Any, Any]",
    contacts: dict[float, "LoadedContact"],
    load: float,
    normal: str,
    solutions: dict[float, "ExactContact"],
    other: dict[float, "LoadedContact"] | None,
) -> None:
    from railsim.plot import contact as plot
    from railsim.plot.style import save

    names = dict.fromkeys(f"{pair.wheel.name} on {pair.rail.name}" for pair in pairs)
    figures = (
        plot.profiles_figure(geometry, pairs),
        plot.functions_figure(geometry),
        plot.conicity_figure({" / ".join(names): (amplitudes, conicity)}),
        plot.patches_figure(
            contacts, load, solutions, other, (f"table, {normal}", f"table, {OTHER_NORMAL[normal]}")
        ),
    )
    for name, figure in zip(PICTURES, figures, strict=True):
        save(figure, folder / name, overwrite=True)


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


def _write_tables(
    folder: Path,
    geometry: "ContactGeometry",
    amplitudes: "np.ndarray[Any, Any]",
    conicity: "np.ndarray[Any, Any]",
    contacts: dict[float, "LoadedContact"],
    solutions: dict[float, "ExactContact"],
) -> None:
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


def _data(
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


def _lines(
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
