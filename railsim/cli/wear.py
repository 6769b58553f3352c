"""``railsim wear``, ``railsim rail-wear``: profiles over distance or tonnage as they wear."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    Speed,
    allow_code_option,
    echo,
    load_option,
    names_of,
    output_options,
    print_json,
    set_option,
    show,
)
from railsim.cli.progress import progress_bar

if TYPE_CHECKING:
    from railsim.cli.analysis import Folder
    from railsim.studies.wear_loop import WearStep

RECORD, PICTURE, STEPS = "wear.json", "wear.png", "steps"
MOST_STEPS = 1000

law_option = click.option(
    "--law", default="pearce_sherratt", show_default=True, metavar="NAME_OR_FILE",
    help="Law of wear; a wrong name shows all.",
)  # fmt: skip
settings_option = click.option(
    "--settings", metavar="F", help="Settings file: creep law and contact."
)


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
@law_option
@click.option(
    "--limits", default="wheel", show_default=True, metavar="F",
    help="Limits of flange and tread at which the loop ends.",
)  # fmt: skip
@click.option("--out", metavar="DIR", help="Folder for wear.json, wear.png and the profiles.")
@settings_option
@load_option
@set_option
@output_options
@allow_code_option
def command(
    vehicle: str,
    routes: tuple[tuple[str, float, float], ...],
    settings: str | None,
    load: str | None,
    assignments: tuple[str, ...],
    limits: str,
    **how: Any,
) -> None:
    """Compute the wear of the wheels of a vehicle on several tracks, updating the profile.

    Each step runs every track once with the wheel profile of the step, averages the wear of all
    wheels and subtracts it from the profile.  With --out finished steps are kept: the same command
    continues after them, and so does one with a longer distance and --overwrite.  If the
    loop ends early (the wheel reaches a limit, a run ends early, or a step wears too much), the
    finished steps are written.

    \b
    Example:
      railsim wear coach_manchester --route curve_r500 20 0.3 --route straight 40 0.7 \\
          --distance 6000 --step 1000 --out worn
    """  # noqa: D301 - click reads the escape
    from railsim.cli.analysis import load_inputs
    from railsim.definitions.loading import load_wheel_limits
    from railsim.studies.wear_loop import Route, wear_loop, wear_rows

    inputs = [load_inputs(vehicle, name, settings, assignments, load) for name, _, _ in routes]
    ways = [Route(one.track, v, share) for one, (_, v, share) in zip(inputs, routes, strict=True)]
    coach, ends = inputs[0].vehicle, load_wheel_limits(limits)
    of = Wearing(
        coach.name, "km", 1e3, "--distance",
        {"vehicle": coach.name, "routes": [
            {"track": w.track.name, "speed": w.speed, "share": w.share} for w in ways
        ]},
        [(w.track.name, w.speed, w.share) for w in ways],
        "mean of all wheels; y from the nominal rolling circle, negative towards the flange",
        lambda **more: wear_loop(coach, ways, limits=ends, settings=inputs[0].settings, **more),
        lambda found: {"rows": wear_rows(found, coach, ways[0].track)},
    )  # fmt: skip
    _carry_out(of, **how)


@click.command()
@click.argument("track", metavar="TRACK", shell_complete=names_of("track"))
@click.option(
    "--traffic", required=True, multiple=True, type=(str, Speed(), float),
    metavar="VEHICLE V SHARE", help="A vehicle, its speed in m/s or with a unit, and its share of "
    "the tonnage in any unit; may be repeated.",
)  # fmt: skip
@click.option(
    "--tonnage", "distance", required=True, type=float, metavar="MT", help="Traffic in Mt."
)
@click.option(
    "--step", required=True, type=float, metavar="MT",
    help="Tonnage in Mt between two updates of the rail profiles.",
)  # fmt: skip
@law_option
@click.option("--out", metavar="DIR", help="Folder for wear.json and the profiles.")
@settings_option
@set_option
@output_options
@allow_code_option
def rails(
    track: str,
    traffic: tuple[tuple[str, float, float], ...],
    settings: str | None,
    assignments: tuple[str, ...],
    **how: Any,
) -> None:
    """Compute the wear of both rails of a track under a mix of traffic, updating their profiles.

    The mean wear over the track is removed from the profiles, so the track should have one
    curvature.  The laws are those of wheels; the wheels do not wear.  Steps are kept and continued
    as by `railsim wear`.

    \b
    Example:
      railsim rail-wear curve_r500 --traffic coach_manchester 20 3 --traffic wagon_y25 20 1 \\
          --tonnage 0.1 --step 0.05 --out worn
    """  # noqa: D301 - click reads the escape
    from railsim.cli.analysis import load_inputs
    from railsim.studies.rail_wear import Traffic, rail_rows, rail_wear

    inputs = [load_inputs(name, track, settings, assignments) for name, _, _ in traffic]
    mix = [Traffic(i.vehicle, v, share) for i, (_, v, share) in zip(inputs, traffic, strict=True)]
    of = Wearing(
        inputs[0].track.name, "Mt", 1e9, "--tonnage",
        {"track": inputs[0].track.name, "traffic": [
            {"vehicle": t.vehicle.name, "speed": t.speed, "share": t.share} for t in mix
        ]},
        [(t.vehicle.name, t.speed, t.share) for t in mix],
        "both rails; y from the middle of the rail, negative towards the gauge side",
        lambda **more: rail_wear(inputs[0].track, mix, settings=inputs[0].settings, **more),
        rail_rows,
    )  # fmt: skip
    _carry_out(of, **how)


@dataclass(frozen=True)
class Wearing:
    """What wears, and how it is shown.

    Attributes
    ----------
    name, unit, scale, option : str, str, float, str
        Heading; unit of distance or tonnage, its factor to SI, and the option that gives it.
    record : dict
        What stands first in the record.
    shares : sequence of (str, float, float)
        Runs, speeds and shares.
    note : str
        What is averaged, and where y begins.
    loop, rows : callable
        The study; its steps to the rows of each profile.
    """

    name: str
    unit: str
    scale: float
    option: str
    record: Mapping[str, Any]
    shares: Sequence[tuple[str, float, float]]
    note: str
    loop: "Callable[..., list[WearStep]]"
    rows: "Callable[[list[WearStep]], Mapping[str, list[dict[str, float | None]]]]"


def _carry_out(
    of: Wearing, *, distance: float, step: float, law: str, out: str | None, overwrite: bool,
    as_json: bool, quiet: bool,
) -> None:  # fmt: skip
    from railsim.assessment.wear import wear_law
    from railsim.cli.analysis import Folder
    from railsim.errors import RailsimError

    steps = _number_of_steps(of, distance, step)
    amounts = [of.scale * step * (number + 1) for number in range(steps)]
    folder = Folder(out, (RECORD, PICTURE, *(_file_name(of, at) for at in amounts)), overwrite)
    found: list[WearStep] = []
    remarks: list[str] = []

    def remark(words: str) -> None:
        remarks.append(words)
        echo(f"remark: {words}", err=True)

    ended = None
    try:
        with progress_bar("wear", quiet=quiet) as progress:
            of.loop(
                step=of.scale * step, steps=steps, law=law, progress=progress,
                folder=None if folder.path is None else folder.path / STEPS,
                on_step=found.append, on_remark=remark,
            )  # fmt: skip
    except RailsimError as error:
        if not found:
            raise
        ended = error
    rows = of.rows(found)
    end = None if ended is None else str(ended)
    record = {**of.record, "step": of.scale * step, "law": law, **rows, "remarks": remarks,
              "ended": end}  # fmt: skip
    _write(folder, of, record, found)
    if not as_json:
        _show(of, wear_law(law).source, rows)
        folder.tell()
    elif ended is None:
        print_json(record)
    if ended is not None:
        raise ended


def _write(
    folder: "Folder", of: Wearing, record: Mapping[str, Any], found: "list[WearStep]"
) -> None:
    """Write record, profiles and, of wheels, the picture of what was done."""
    from railsim.profiles import save_profile

    folder.write_json(RECORD, record)
    if folder.path is None:
        return
    for done in found:
        for side, worn in done.worn_profiles.items():
            name = _file_name(of, done.distance + done.length, side)
            folder.written.append(save_profile(worn, folder.path / name))
    if "rows" in record:
        from railsim.plot.wear import wear_figure

        wheels = [(0.0, found[0].profile), *((w.distance + w.length, w.worn) for w in found)]
        title = f"{of.name}: wear of the wheels"
        folder.write_picture(PICTURE, wear_figure(wheels, record["rows"], title))


def _file_name(of: Wearing, amount: float, side: str = "wheel") -> str:
    return f"{side}_{amount / of.scale:g}_{of.unit}.csv"


def _number_of_steps(of: Wearing, distance: float, step: float) -> int:
    from railsim.errors import Fault, InputError

    faults = [
        Fault(option, "", f"found {value:g}", "above 0")
        for option, value in ((of.option, distance), ("--step", step))
        if not 0.0 < value < float("inf")
    ]
    if faults:
        raise InputError(faults)
    steps = round(min(distance / step, MOST_STEPS + 1.0))
    if not 1 <= steps <= MOST_STEPS or abs(steps * step - distance) > 1e-9 * distance:
        whole = of.option.removeprefix("--")
        found = f"found {step:g} {of.unit} with a {whole} of {distance:g} {of.unit}"
        allowed = f"the {whole} divided by a whole number from 1 to {MOST_STEPS}"
        raise InputError([Fault("--step", "", found, allowed)])
    return steps


def _show(of: Wearing, source: str, rows: "Mapping[str, list[dict[str, float | None]]]") -> None:
    from railsim.table import Column, Table

    total = sum(share for _, _, share in of.shares)
    shares = ", ".join(f"{share / total:.0%} {name} at {v:g} m/s" for name, v, share in of.shares)
    show(of.name, f"  {shares}", f"  {source}, {of.note}")
    columns = [
        Column("distance", "distance" if of.unit == "km" else "tonnage", of.unit, "g"),
        Column("area", "worn area", "mm2", ".2f"),
        Column("deepest", "", "mm", ".3f"),
        Column("deepest_y", "at y", "mm", ".1f"),
        Column("equivalent_conicity", "conicity at 3 mm", "", ".3f"),
        Column("flange_thickness", "flange thickness", "mm", ".2f"),
        Column("flange_height", "flange height", "mm", ".2f"),
        Column("hollow", "hollow", "mm", ".2f"),
    ]
    for side, of_side in rows.items():
        shown = [row if row["area"] else row | {"deepest_y": None} for row in of_side]
        known = [column for column in columns if column.name in shown[0]]
        show("", Table(known, shown, "" if side == "rows" else f"{side} rail"))
