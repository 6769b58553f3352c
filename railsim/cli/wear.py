"""``railsim wear``: wheel profile over the distance run, with updates of the worn profile."""

import json
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    Speed,
    echo,
    load_option,
    names_of,
    output_options,
    print_json,
    set_option,
    show,
    text_table,
)
from railsim.cli.progress import progress_bar

if TYPE_CHECKING:
    from pathlib import Path

    from railsim.cli.analysis import Folder
    from railsim.profiles import Profile
    from railsim.studies.wear_loop import Route, WearStep
    from railsim.table import Table

FILES = ("wear.json", "wear.png")
STEPS = "steps"  # folder of the finished steps
MOST_STEPS = 1000


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=names_of("vehicle"))
@click.option(
    "--route", "routes", required=True, multiple=True, type=(str, Speed(), float),
    metavar="TRACK V SHARE", help="A track, its speed in m/s or with a unit, and its share of the "
    "distance in any unit; may be repeated.",
)  # fmt: skip
@click.option("--distance", required=True, type=float, metavar="KM", help="Distance to run in km.")
@click.option(
    "--step", required=True, type=float, metavar="KM",
    help="Distance in km between two updates of the wheel profile.",
)  # fmt: skip
@click.option(
    "--law", default="pearce_sherratt", show_default=True, metavar="NAME_OR_FILE",
    help="Law of wear; a wrong name shows all.",
)  # fmt: skip
@click.option("--out", metavar="DIR", help="Folder for wear.json, wear.png and the profiles.")
@click.option("--settings", metavar="F", help="Settings file: creep law and contact.")
@load_option
@set_option
@output_options
def command(
    vehicle: str,
    routes: tuple[tuple[str, float, float], ...],
    distance: float,
    step: float,
    law: str,
    out: str | None,
    settings: str | None,
    load: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Compute the wear of the wheels of a vehicle on several tracks, updating the profile.

    Each step runs every track once with the wheel profile of the step, averages the wear of all
    wheels and subtracts it from the profile.  With --out finished steps are kept: the same command
    continues after them, and so does one with a longer distance and --overwrite.  A loop that ends
    early, since a run does or a step wears too much, writes what was done.

    \b
    Example:
      railsim wear coach_manchester --route curve_r500 20 0.3 --route straight 40 0.7 \\
          --distance 6000 --step 1000 --out worn
    """  # noqa: D301 - click reads the escape
    from railsim.assessment.wear import wear_law
    from railsim.cli.analysis import Folder, load_inputs
    from railsim.errors import RailsimError
    from railsim.studies.wear_loop import Route, WearStep, wear_loop, wear_rows

    steps = _number_of_steps(distance, step)
    inputs = [load_inputs(vehicle, name, settings, assignments, load) for name, _, _ in routes]
    ways = [
        Route(one.track, speed, share)
        for one, (_, speed, share) in zip(inputs, routes, strict=True)
    ]
    profiles = [_file_name(1e3 * step * (number + 1)) for number in range(steps)]
    folder = Folder(out, (*FILES, *profiles), overwrite)
    coach = inputs[0].vehicle
    found: list[WearStep] = []
    remarks: list[str] = []

    def remark(words: str) -> None:
        remarks.append(words)
        echo(f"remark: {words}", err=True)

    ended = None
    try:
        with progress_bar("wear", quiet=quiet) as progress:
            wear_loop(
                coach, ways, step=1e3 * step, steps=steps, law=law, settings=inputs[0].settings,
                folder=None if folder.path is None else folder.path / STEPS, progress=progress,
                on_step=found.append, on_remark=remark,
            )  # fmt: skip
    except RailsimError as error:
        if not found:
            raise
        ended = error
    record: dict[str, Any] = {
        "vehicle": coach.name,
        "routes": [{"track": w.track.name, "speed": w.speed, "share": w.share} for w in ways],
        "step": 1e3 * step,
        "law": law,
        "rows": wear_rows(found, coach, ways[0].track),
        "remarks": remarks,
        "ended": None if ended is None else str(ended),
    }
    _write(folder, record, found)
    if not as_json:
        show(*_lines(coach.name, ways, wear_law(law).source, record["rows"]))
        folder.tell()
    elif ended is None:
        print_json(record)
    if ended is not None:
        raise ended


def _write(folder: "Folder", record: "dict[str, Any]", found: "list[WearStep]") -> None:
    """Write record, profiles and picture of what was done."""
    folder.write_json(FILES[0], record)
    if folder.path is None:
        return
    from railsim.plot.wear import wear_figure

    wheels = [(0.0, found[0].profile), *((w.distance + w.length, w.worn) for w in found)]
    for distance, worn in wheels[1:]:
        folder.written.append(_write_profile(folder.path / _file_name(distance), worn))
    title = f"{record['vehicle']}: wear of the wheels"
    folder.write_picture(FILES[1], wear_figure(wheels, record["rows"], title))


def _file_name(distance: float) -> str:
    return f"wheel_{1e-3 * distance:g}_km.csv"


def _number_of_steps(distance: float, step: float) -> int:
    from railsim.errors import Fault, InputError

    faults = [
        Fault(option, "", f"found {value:g}", "above 0")
        for option, value in (("--distance", distance), ("--step", step))
        if not 0.0 < value < float("inf")
    ]
    if faults:
        raise InputError(faults)
    steps = round(min(distance / step, MOST_STEPS + 1.0))
    if not 1 <= steps <= MOST_STEPS or abs(steps * step - distance) > 1e-9 * distance:
        found = f"found {step:g} km with a distance of {distance:g} km"
        allowed = f"the distance divided by a whole number from 1 to {MOST_STEPS}"
        raise InputError([Fault("--step", "", found, allowed)])
    return steps


def _write_profile(path: "Path", profile: "Profile") -> "Path":
    """Write a profile so that it can stand in a vehicle file."""
    from railsim.files import whole_file

    lines = [f"# {profile.name}", *(f"# {json.dumps(note)}" for note in profile.notes), "y_mm,z_mm"]
    lines += [f"{1e3 * y:.6f},{1e3 * z:.6f}" for y, z in zip(profile.y, profile.z, strict=True)]
    with whole_file(path) as partial:
        partial.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _lines(
    vehicle: str, ways: "list[Route]", source: str, rows: "list[dict[str, float | None]]"
) -> "list[str | Table]":
    total = sum(way.share for way in ways)
    shares = ", ".join(
        f"{way.share / total:.0%} {way.track.name} at {way.speed:g} m/s" for way in ways
    )
    cells = []
    for row in rows:
        conicity = row["equivalent_conicity"]
        worn = bool(row["area"])
        cells.append([
            f"{1e-3 * (row['distance'] or 0.0):g}",
            f"{1e6 * (row['area'] or 0.0):.2f}",
            f"{1e3 * (row['deepest'] or 0.0):.3f}",
            f"{1e3 * (row['deepest_y'] or 0.0):.1f}" if worn else "",
            "" if conicity is None else f"{conicity:.3f}",
        ])  # fmt: skip
    header = ["distance (km)", "worn area (mm2)", "deepest (mm)", "at y (mm)", "conicity at 3 mm"]
    note = f"{source}, mean of all wheels; y from the nominal rolling circle, "
    note += "negative towards the flange"
    return [vehicle, f"  {shares}", f"  {note}", "", text_table(header, cells, numbers=0)]
