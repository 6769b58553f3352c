"""``railsim spring``: dimension and verify a trailing-arm primary suspension."""

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from railsim.cli.common import (
    echo,
    faults_in,
    json_option,
    overwrite_option,
    print_json,
    quiet_option,
    set_option,
    table,
)
from railsim.files import TABLES, check_file, check_folder, is_file, make_folder, whole_file

if TYPE_CHECKING:
    from railsim.definitions.spring import TrailingArmSuspension
    from railsim.springs.design import Design
    from railsim.springs.search import SearchResult
    from railsim.springs.tolerance import RideHeight
    from railsim.springs.verification import Case, Fatigue, Verification

REPORT = "report.html"


@click.group()
def command() -> None:
    """Dimension and verify the coil springs of a trailing-arm primary suspension.

    Each command takes a spring file (format railsim-spring/1) or the name of a shipped one.

    \b
    Example:
      railsim spring design turasas_axlebox --search
      railsim spring verify turasas_axlebox --out suspension --overwrite
      railsim spring fatigue turasas_axlebox --json
      railsim spring vehicle turasas_axlebox --out my_coach.toml --overwrite
    """  # noqa: D301 - click reads the escape


def _pages_option(function: Any) -> Any:
    return click.option(
        "--out", metavar="DIR", help=f"Folder for the pictures and the page {REPORT}."
    )(function)


@command.command()
@click.argument("file", metavar="FILE")
@click.option("--search", is_flag=True, help="Also search the nests that fit the table [search].")
@_pages_option
@set_option
@overwrite_option
@json_option
@quiet_option
def design(
    file: str,
    search: bool,
    out: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Find stiffnesses and numbers of coils of the springs for two required deflections.

    With --search, also find the nests of standard wires that fit the space and the stresses,
    ranked by mass or by fatigue margin (search.objective), with the active limits.

    \b
    Example:
      railsim spring design turasas_axlebox
      railsim spring design turasas_axlebox --search --set search.objective=fatigue
    """  # noqa: D301 - click reads the escape
    from railsim.springs.design import design as designed
    from railsim.springs.summary import design_data, search_data

    _check_out(out, overwrite)
    suspension = _loaded(file, assignments)
    with faults_in(file, "spring", suspension.name):
        result = designed(suspension)
        found = None
        if search:
            from railsim.springs.search import search as searched

            found = searched(suspension)
        written = _write_pages(suspension, out, overwrite, found) if out else []
    if as_json:
        data = design_data(suspension, result)
        if found is not None:
            data["search"] = search_data(found)
        print_json(data)
        return
    for line in _design_lines(suspension, result):
        echo(line)
    if found is not None:
        echo()
        for line in _search_lines(found):
            echo(line)
    _tell(suspension, written, quiet)


@command.command()
@click.argument("file", metavar="FILE")
@_pages_option
@set_option
@overwrite_option
@json_option
@quiet_option
def verify(
    file: str,
    out: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Verify a suspension under all its loads: equilibrium, heights, stresses, buckling.

    A check that is not met is a result: the exit status stays 0.  A load that the nest cannot
    carry (solid, buckled, lifted off) is a fault of the input: exit status 2.

    \b
    Example:
      railsim spring verify turasas_axlebox --out suspension --overwrite
      railsim spring verify turasas_axlebox --set inner.wire_diameter=0.028 --json
    """  # noqa: D301 - click reads the escape
    from railsim.springs.summary import ride_height_data, verification_data
    from railsim.springs.tolerance import ride_heights
    from railsim.springs.verification import verify as verified

    _check_out(out, overwrite)
    suspension = _loaded(file, assignments)
    with faults_in(file, "spring", suspension.name):
        result = verified(suspension)
        heights = ride_heights(suspension) if suspension.tolerances is not None else ()
        written = _write_pages(suspension, out, overwrite) if out else []
    if as_json:
        data = verification_data(suspension, result)
        if heights:
            data["ride_height"] = ride_height_data(heights)
        print_json(data)
        return
    for line in _verification_lines(suspension, result):
        echo(line)
    for line in _ride_height_lines(heights):
        echo(line)
    _tell(suspension, written, quiet)


@command.command()
@click.argument("file", metavar="FILE")
@_pages_option
@set_option
@overwrite_option
@json_option
@quiet_option
def fatigue(
    file: str,
    out: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Stress range of each spring against the Goodman-Smith line of the material.

    \b
    Example:
      railsim spring fatigue turasas_axlebox
      railsim spring fatigue turasas_axlebox --set fatigue.max_load=80e3 --json
    """  # noqa: D301 - click reads the escape
    from railsim.springs.summary import fatigue_data
    from railsim.springs.verification import dynamic_loads
    from railsim.springs.verification import fatigue as fatigue_of

    _check_out(out, overwrite)
    suspension = _loaded(file, assignments)
    with faults_in(file, "spring", suspension.name):
        result = fatigue_of(suspension)
        loads = dynamic_loads(suspension)
        written = _write_pages(suspension, out, overwrite) if out else []
    if as_json:
        print_json(fatigue_data(suspension, result, loads))
        return
    for line in _fatigue_lines(result, loads):
        echo(line)
    _tell(suspension, written, quiet)


@command.command()
@click.argument("file", metavar="FILE")
@click.option("--out", metavar="F.toml", help="Vehicle file to write; by default to stdout.")
@click.option("--load", metavar="NAME", help="Load at which the springs are taken.")
@click.option("--extends", metavar="VEHICLE", help="Vehicle to extend instead of vehicle.extends.")
@set_option
@overwrite_option
@json_option
@quiet_option
def vehicle(
    file: str,
    out: str | None,
    load: str | None,
    extends: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Write the suspension as a vehicle file that replaces the primary of another one.

    \b
    Example:
      railsim spring vehicle turasas_axlebox --out my_coach.toml --overwrite
      railsim run my_coach.toml curve_r250 --speed 20 --overwrite
    """  # noqa: D301 - click reads the escape
    from railsim.springs.vehicle_table import vehicle_part, vehicle_text

    suspension = _loaded(file, assignments)
    if out:
        check_file(Path(out), overwrite=overwrite, endings=TABLES)
    with faults_in(file, "spring", suspension.name):
        if load is not None and load not in suspension.loads:
            _refuse("--load", f"no load '{load}' in [loads]", load, suspension.loads)
        part = vehicle_part(suspension, load)
        base, removed = _base(suspension, extends, out)
        text = vehicle_text(suspension, part, base, removed)
        if out:
            with whole_file(Path(out)) as partial:
                partial.write_text(text, encoding="utf-8")
    if as_json:
        print_json(
            {
                "file": out,
                "assembly": part.assembly,
                "axleboxes": part.axleboxes,
                "elements": part.elements,
                "load": part.case.name,
            }
        )
    elif not out:
        echo(text.rstrip("\n"))
    if not quiet:
        for remark in (*part.remarks, *_load_remarks(suspension, part.case, extends)):
            echo(remark, err=True)
        if out and not as_json:
            echo(out)


def _loaded(file: str, assignments: Sequence[str]) -> "TrailingArmSuspension":
    from railsim.definitions.loading import load_spring

    return load_spring(file, assignments)


def _refuse(option: str, found: str, name: str, valid: Iterable[str]) -> NoReturn:
    from railsim.errors import Fault, InputError, nearest

    raise InputError([Fault(option, "", found, nearest(name, valid))])


def _check_out(out: str | None, overwrite: bool) -> None:
    """Refuse a folder before anything is computed; the pictures' names are known when drawn."""
    if out:
        check_folder(Path(out), [REPORT], overwrite=overwrite)


def _write_pages(
    suspension: "TrailingArmSuspension",
    out: str,
    overwrite: bool,
    search: "SearchResult | None" = None,
) -> list[Path]:
    """Write pictures and page into a folder, created if it does not exist; nothing on a fault."""
    from railsim.report.springs import as_png, collected, figures, page

    results = collected(suspension, search)
    drawn = {name: as_png(figure) for name, figure in figures(results).items()}
    folder = Path(out)
    files = {f"{name}.png": png for name, png in drawn.items()}
    files[REPORT] = page(results, drawn).encode()
    check_folder(folder, files, overwrite=overwrite)
    make_folder(folder)
    for name, content in files.items():
        with whole_file(folder / name) as partial:
            partial.write_bytes(content)
    return [folder / name for name in files]


def _load_remarks(
    suspension: "TrailingArmSuspension", case: "Case", extends: str | None
) -> list[str]:
    """Remark on springs that are taken at a load unlike that which the vehicle puts on them."""
    from railsim.definitions.flatten import flatten
    from railsim.definitions.loading import load_vehicle
    from railsim.errors import RailsimError
    from railsim.springs.vehicle_table import LIKELY, axlebox_load

    name = extends or (suspension.vehicle.extends if suspension.vehicle else None)
    if name is None:
        return []
    try:
        load = axlebox_load(flatten(load_vehicle(name)))
    except RailsimError as error:
        return [f"the load of the axleboxes is not known: {error}"]
    low, high = LIKELY
    if low <= load / case.load <= high:
        return []
    return [
        f"'{name}' puts {load / 1e3:.1f} kN on an axlebox at rest, the springs are taken at "
        f"{case.load / 1e3:.1f} kN ({case.name}): do springs and vehicle belong together?"
    ]


def _base(
    suspension: "TrailingArmSuspension", extends: str | None, out: str | None
) -> tuple[str | None, list[str] | None]:
    """The vehicle to extend as the written file must name it, and what to remove there."""
    if extends is None or suspension.vehicle is None:
        return None, None
    from railsim.definitions.paths import key_path
    from railsim.definitions.sources import find_file, read_source

    base = find_file(extends, "vehicle")
    data = read_source(base, "vehicle").data
    removed = [key for key in suspension.vehicle.remove if _holds(data, key_path(key))]
    if is_file(extends):
        folder = Path(out).parent if out else Path()
        extends = Path(os.path.relpath(base, folder)).as_posix()
    return extends, removed


def _holds(data: Any, path: Sequence[str]) -> bool:
    for part in path:
        if not isinstance(data, dict) or part not in data:
            return False
        data = data[part]
    return True


def _tell(suspension: "TrailingArmSuspension", written: Sequence[Path], quiet: bool) -> None:
    from railsim.definitions.spring import spring_remarks

    if quiet:
        return
    for remark in spring_remarks(suspension):
        echo(f"remark: {remark}", err=True)
    for path in written:
        echo(str(path))


def _design_lines(suspension: "TrailingArmSuspension", result: "Design") -> list[str]:
    low, high = (load * 1e-3 for load in result.load_range)
    rows = []
    for (name, spring), K_V, n in zip(
        suspension.springs.items(), result.K_V, result.n, strict=True
    ):
        wire = "-" if spring.wire_diameter is None else f"{spring.wire_diameter * 1e3:.6g}"
        coils = "-" if n is None else f"{n:.4f}"
        rows.append([name, f"{spring.mean_diameter * 1e3:.6g}", f"{K_V * 1e-3:.3f}", wire, coils])
    header = ["spring", "D / mm", "K_V / (N/mm)", "d / mm", "n"]
    return [
        *table(header, rows),
        f"arm at the target: {math.degrees(result.rotation):.4f} deg; "
        f"target load possible there: {low:.3f} to {high:.3f} kN",
    ]


def _search_lines(result: "SearchResult") -> list[str]:
    from railsim.springs.tables import search_table

    header, rows = search_table(result)
    lines = table(header[:-1], [row[:-1] for row in rows])
    limits = [row[-1] for row in (header, *rows)]
    return [
        f"{result.tried} nests tried, {result.feasible} within all limits before refinement; "
        f"ranked by {result.objective}",
        *(f"{line}  {active}" for line, active in zip(lines, limits, strict=True)),
    ]


def _verification_lines(suspension: "TrailingArmSuspension", result: "Verification") -> list[str]:
    from railsim.springs.datasheet import data_sheets
    from railsim.springs.tables import case_table, check_table, loaded_table, sheet_table

    sheets = data_sheets(suspension, result)
    tables = (
        case_table(result), loaded_table(sheets), sheet_table(sheets), check_table(result.checks)
    )  # fmt: skip
    return [line for texts in tables for line in (*table(*texts), "")][:-1]


def _ride_height_lines(results: Sequence["RideHeight"]) -> list[str]:
    from railsim.springs.tables import ride_height_table

    return ["", *table(*ride_height_table(results))] if results else []


def _fatigue_lines(result: Mapping[str, "Fatigue"], loads: Mapping[str, float]) -> list[str]:
    from railsim.springs.tables import fatigue_table

    return [
        f"between {loads['min_load'] * 1e-3:.3f} and {loads['max_load'] * 1e-3:.3f} kN",
        *table(*fatigue_table(result)),
    ]
