"""``railsim contact``: contact geometry of a wheelset, equivalent conicity, patches, creep."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import echo, json_option, overwrite_option, print_json, quiet_option
from railsim.cli.contact_tables import TABLES, contact_data, contact_lines, write_tables
from railsim.files import check_folder, make_folder

if TYPE_CHECKING:
    from railsim.contact.summary import ContactSummary

PICTURES = ("profiles.png", "functions.png", "conicity.png", "patches.png")
NORMAL = ("hertz", "kik-piotrowski")

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
    type=click.Choice(NORMAL),
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
    from railsim.cli import creep as creep_part
    from railsim.contact.creep_curves import forces_by_law
    from railsim.contact.summary import contact_summary

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
    if creep:
        creep_part.check_friction(friction)
    written = (*PICTURES, *TABLES, *((*creep_part.PICTURES, *creep_part.TABLES) if creep else ()))
    folder = Path(out) if out else None
    if folder:
        check_folder(folder, written, overwrite=overwrite)
    found = contact_summary(
        _profiles(wheels, "wheel"),
        _profiles(rails, "rail"),
        radii=(radii[0], radii[-1]),
        gauge=gauge,
        inclination=inclination,
        back_to_back=back_to_back,
        load=load,
        max_shift=max_shift,
        normal=normal,  # type: ignore[arg-type]
        exact=exact,
    )
    patch = found.main_patch(friction) if creep else None
    creep_rows = forces_by_law(patch) if patch else []
    if folder:
        make_folder(folder)
        if patch:
            creep_part.write(folder, patch, creep_rows)
        write_tables(folder, found)
        _write_pictures(folder, found)
    if as_json:
        print_json(contact_data(found) | ({"creep": creep_rows} if patch else {}))
        return
    for note in found.notes:
        echo(note, err=True)
    for line in contact_lines(found):
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


def _write_pictures(folder: Path, found: "ContactSummary") -> None:
    from railsim.contact.summary import OTHER_NORMAL
    from railsim.plot import contact as plot
    from railsim.plot.style import save

    names = dict.fromkeys(f"{pair.wheel.name} on {pair.rail.name}" for pair in found.pairs)
    other = found.with_other_normal() if found.exact else None
    labels = (f"table, {found.normal}", f"table, {OTHER_NORMAL[found.normal]}")
    figures = (
        plot.profiles_figure(found.geometry, found.pairs),
        plot.functions_figure(found.geometry),
        plot.conicity_figure({" / ".join(names): (found.amplitudes, found.conicity)}),
        plot.patches_figure(found.contacts, found.load, found.exact, other, labels),
    )
    for name, figure in zip(PICTURES, figures, strict=True):
        save(figure, folder / name, overwrite=True)
