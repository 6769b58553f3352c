"""``railsim spring``: dimension and verify a trailing-arm primary suspension."""

import math
from collections.abc import Callable, Sequence
from functools import wraps
from typing import TYPE_CHECKING, Any, cast

import click

from railsim.cli import common as cli
from railsim.cli.terminal import echo
from railsim.errors import input_error, nearest
from railsim.files.access import TABLES, write_text

if TYPE_CHECKING:
    from railsim.definitions.spring import TrailingArmSuspension
    from railsim.springs.search import SearchResult

REPORT = "report.html"
Answer = tuple[Any, list[Any], "SearchResult | None"]  # data, what is printed, what was searched


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
    """


_options = cli.together(
    command.command(),
    click.argument("file"),
    cli.set_option,
    cli.output_options(f"Folder for the pictures and the page {REPORT}."),
)


def _spring_command(function: Callable[..., Answer]) -> Callable[..., None]:
    """Make a command of the group: a file, a folder for pictures and page, the common options.

    The function gets the suspension and returns what is answered, and the search, if there is one.
    """

    @wraps(function)
    def command(file: str, assignments: Sequence[str], output: cli.Output, **how: Any) -> None:
        from railsim.definitions.loading import load_spring

        if output.folder:
            from railsim.report.springs import NAMES, files

            output.reserve(*NAMES)
        suspension = load_spring(file, assignments)
        with cli.faults_in(file, "spring", suspension.name):
            data, parts, search = function(suspension, **how)
            if output.folder:
                output.write_all(files(suspension, search))
        output.answer(data, parts, suspension.unusual())

    return cast("Callable[..., None]", _options(command))


@_spring_command
@cli.flag("--search", "Also search the nests that fit the table [search].")
def design(suspension: "TrailingArmSuspension", search: bool) -> Answer:
    """Find the springs for two required deflections.

    Prints their stiffnesses and numbers of coils. With --search, also the nests of standard wires
    that fit the space and the stresses, ranked by mass or by fatigue margin (search.objective),
    with the active limits.

    \b
    Example:
      railsim spring design turasas_axlebox
      railsim spring design turasas_axlebox --search --set search.objective=fatigue
    """
    from railsim.springs.design import design as designed
    from railsim.springs.summary import design_data, search_data
    from railsim.springs.tables import design_table, search_table

    result, found = designed(suspension), None
    data = design_data(suspension, result)
    low, high = (load * 1e-3 for load in result.load_range)
    parts: list[Any] = [
        design_table(suspension, result),
        f"arm at the target: {math.degrees(result.rotation):.4f} deg; "
        f"target load possible there: {low:.3f} to {high:.3f} kN",
    ]
    if search:
        from railsim.springs.search import search as searched

        found = searched(suspension)
        data["search"] = search_data(found)
        sentence = (
            f"{found.tried} nests tried, {found.feasible} within all limits before refinement; "
            f"ranked by {found.objective}"
        )
        parts += ["", sentence, search_table(found)]
    return data, parts, found


@_spring_command
def verify(suspension: "TrailingArmSuspension") -> Answer:
    """Verify a suspension under all its loads.

    Equilibrium, heights, stresses, buckling. A check that is not met is a result: the exit status
    stays 0. A load that the nest cannot carry (solid, buckled, lifted off) is a fault of the
    input: exit status 2.

    \b
    Example:
      railsim spring verify turasas_axlebox --out suspension --overwrite
      railsim spring verify turasas_axlebox --set inner.wire_diameter=0.028 --json
    """
    from railsim.design_checks import check_table
    from railsim.springs import tables
    from railsim.springs.datasheet import data_sheets
    from railsim.springs.summary import ride_height_data, verification_data
    from railsim.springs.tolerance import ride_heights
    from railsim.springs.verification import verify as verified

    result = verified(suspension)
    heights = ride_heights(suspension) if suspension.tolerances is not None else ()
    data, sheets = verification_data(suspension, result), data_sheets(suspension, result)
    parts: list[Any] = [tables.load_table(suspension), ""] if suspension.load_notes else []
    deflections = f"{1e3 * data['mounting_deflection']:.2f} mm under the mounting load"
    target = f"mounting.deflection is {1e3 * suspension.mounting.deflection:.2f} mm"
    parts += [tables.case_table(result), f"{deflections}; {target}", ""]
    parts += [tables.loaded_table(sheets), ""]
    parts += [tables.sheet_table(sheets), "", check_table(result.checks)]
    parts += [] if suspension.fatigue else [tables.NO_FATIGUE]
    if heights:
        data["ride_height"] = ride_height_data(heights)
        parts += ["", tables.ride_height_table(heights)]
    return data, parts, None


@_spring_command
def fatigue(suspension: "TrailingArmSuspension") -> Answer:
    """Compare stress ranges with the Goodman-Smith line.

    \b
    Example:
      railsim spring fatigue turasas_axlebox
      railsim spring fatigue turasas_axlebox --set fatigue.max_load=80e3 --json
    """
    from railsim.springs.summary import fatigue_data
    from railsim.springs.tables import fatigue_table
    from railsim.springs.verification import dynamic_loads
    from railsim.springs.verification import fatigue as fatigue_of

    result, loads = fatigue_of(suspension), dynamic_loads(suspension)
    low, high = (loads[key] * 1e-3 for key in ("min_load", "max_load"))
    parts: list[Any] = [f"between {low:.3f} and {high:.3f} kN", fatigue_table(result)]
    return fatigue_data(suspension, result, loads), parts, None


@command.command()
@click.argument("file")
@cli.option("--out", "Vehicle file to write; by default to stdout.", "F.toml")
@cli.option("--load", "Load at which the stiffness of the springs is taken.", "NAME")
@cli.option("--extends", "Vehicle to extend instead of vehicle.extends.", "VEHICLE")
@cli.set_option
@cli.output_options()
def vehicle(
    file: str,
    load: str | None,
    extends: str | None,
    assignments: tuple[str, ...],
    output: cli.Output,
) -> None:
    """Write a vehicle file with this primary suspension.

    It extends the vehicle that the table [vehicle] or --extends names, without its primary.

    \b
    Example:
      railsim spring vehicle turasas_axlebox --out my_coach.toml --overwrite
      railsim run my_coach.toml curve_r250 --speed 20 --overwrite
    """
    from railsim.definitions.loading import load_spring
    from railsim.springs.vehicle_table import base_of, load_remarks, vehicle_part, vehicle_text

    suspension = load_spring(file, assignments)
    out = output.file(output.out, TABLES) if output.out else None
    with cli.faults_in(file, "spring", suspension.name):
        if load is not None and load not in suspension.loads:
            valid = nearest(load, suspension.loads)
            raise input_error("--load", f"no load '{load}' in [loads]", valid)
        part = vehicle_part(suspension, load)
        base, removed, beside = base_of(suspension, extends, out.parent if out else "")
        text = vehicle_text(suspension, part, base, removed)
        if out:
            write_text(out, text)
            output.written.append(out)
    for remark in (*part.remarks, *beside, *load_remarks(suspension, part.case, extends)):
        if not output.quiet:
            echo(remark, err=True)
    record = {"file": output.out, "assembly": part.assembly, "axleboxes": part.axleboxes}
    record |= {"elements": part.elements, "load": part.case.name}
    output.answer(record, [] if out else [text.rstrip("\n")])
