"""``railsim contact``: contact geometry of a wheelset, equivalent conicity, patches, creep."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import echo, json_option, overwrite_option, print_json, quiet_option
from railsim.files import check_folder, make_folder

if TYPE_CHECKING:
    import numpy as np

    from railsim.contact.elastic import LoadedContact
    from railsim.contact.exact_normal import ExactContact
    from railsim.contact.geometry import ContactGeometry
    from railsim.contact.table import ContactTable
    from railsim.plot.contact import Pair
from railsim.cli.contact_tables import (
    PATCH_SHARES,
    TABLES,
    contact_data,
    contact_lines,
    write_tables,
)

PICTURES = ("profiles.png", "functions.png", "conicity.png", "patches.png")
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
        write_tables(folder, geometry, amplitudes, conicity, contacts, solutions)
        other = _other_table(pairs[1], radius_pair, geometry, list(contacts), load, normal, exact)
        _write_pictures(
            folder, geometry, pairs, amplitudes, conicity, contacts, load, normal, solutions, other
        )
    if as_json:
        data = contact_data(geometry, amplitudes, conicity, contacts, solutions, notes)
        print_json(data | ({"creep": creep_rows} if patch else {}))
        return
    for note in notes:
        echo(note, err=True)
    for line in contact_lines(geometry, amplitudes, conicity, contacts, solutions, load):
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
