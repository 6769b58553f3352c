"""``railsim wear``, ``railsim rail-wear``: profiles over distance or tonnage as they wear."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.errors import Fault, Faults, RailsimError, input_error
from railsim.report.wear import RAILS, WHEELS, Rows, Worn, shares_of, wear_tables

if TYPE_CHECKING:
    from railsim.definitions import Track
    from railsim.studies.wear_loop import WearStep
    from railsim.table import Table

RECORD, PICTURE, STEPS = "wear.json", "wear.png", "steps"
MOST_STEPS = 1000

Mix = tuple[tuple[str, float, float], ...]
Decorator = Callable[[Callable[..., None]], Callable[..., None]]


def mix_option(name: str, subject: str, amount: str) -> Decorator:
    """Option, given repeatedly, for what runs at what speed and its share of the amount."""
    text = (
        f"A {subject}, its speed in m/s or with a unit, and its share of the {amount} in any unit; "
        "may be repeated."
    )
    form = (str, cli.as_speed, float)
    return cli.repeated(name, text, f"{subject.upper()} V SHARE", form, required=True)


def amount_options(name: str, text: str, unit: str) -> Decorator:
    """Options of the distance or tonnage to run, and of that of one step."""
    amount = name.split()[0].strip("-").capitalize()
    between = f"{amount} in {unit} between two profiles written; each 0.1 mm updates them, too."
    each = (name, text), ("--step", between)
    return cli.together(*(cli.option(*one, unit.upper(), float, required=True) for one in each))


law_option = cli.option(
    "--law", "Law of wear; a wrong name shows all.", "NAME_OR_FILE", default="pearce_sherratt"
)


@click.command()
@cli.vehicle_argument
@mix_option("--route routes", "track", "distance")
@amount_options("--distance", "Distance to run in km.", "km")
@law_option
@cli.option("--limits", "Limits of flange and tread at which the loop ends.", "F", default="wheel")
@cli.given_options("creep law and contact")
@cli.output_options("Folder for wear.json, wear.png and the profiles.")
@cli.allow_code_option
def command(routes: Mix, limits: str, given: cli.Given, **how: Any) -> None:
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
    """
    from railsim.definitions.loading import load_wheel_limits
    from railsim.studies.wear_loop import wear_loop, wear_rows

    inputs = [replace(given, track=track).inputs() for track, _, _ in routes]
    ways = [(one.track, v, share) for one, (_, v, share) in zip(inputs, routes, strict=True)]
    (coach, track, settings), ends = inputs[0], load_wheel_limits(limits)
    runs = [{"track": way.name, "speed": v, "share": share} for way, v, share in ways]
    _remark_on_straights([one.track for one in inputs], how["output"])
    _carry_out(
        WHEELS,
        {"vehicle": coach.name, "routes": runs},
        partial(wear_loop, coach, ways, limits=ends, settings=settings),
        lambda found: {"rows": wear_rows(found, coach, track)},
        **how,
    )


@click.command()
@cli.track_argument
@mix_option("--traffic", "vehicle", "tonnage")
@amount_options("--tonnage distance", "Traffic in Mt.", "Mt")
@law_option
@cli.given_options("creep law and contact", load=False)
@cli.output_options("Folder for wear.json, wear.png and the profiles.")
@cli.allow_code_option
def rails(traffic: Mix, given: cli.Given, **how: Any) -> None:
    """Compute the wear of both rails of a track under mixed traffic, updating their profiles.

    The mean wear over the track is removed from the profiles, so the track should have one
    curvature.  The laws are those of wheels; the wheels do not wear.  Steps are kept and continued
    as by `railsim wear`.

    \b
    Example:
      railsim rail-wear curve_r500 --traffic coach_manchester 20 3 --traffic wagon_y25 20 1 \\
          --tonnage 0.1 --step 0.05 --out worn
    """
    from railsim.studies.rail_wear import rail_rows, rail_wear

    inputs = [replace(given, vehicle=vehicle).inputs() for vehicle, _, _ in traffic]
    mix = [(one.vehicle, v, share) for one, (_, v, share) in zip(inputs, traffic, strict=True)]
    _, worn, settings = inputs[0]
    runs = [{"vehicle": coach.name, "speed": v, "share": share} for coach, v, share in mix]
    record = {"track": worn.name, "traffic": runs}
    _remark_on_straights([worn], how["output"])
    _carry_out(RAILS, record, partial(rail_wear, worn, mix, settings=settings), rail_rows, **how)


def _remark_on_straights(tracks: "Sequence[Track]", output: cli.Output) -> None:
    """Remark on tracks of which a part only is curved: the mean wear is that over all."""
    from railsim.definitions.track.layout import curvature_sections

    for track in {track.name: track for track in tracks}.values():
        parts = curvature_sections(track)
        curved = sum(part.end - part.begin for part in parts if part.type != "STR")
        if 0.0 < curved < (whole := parts[-1].end - parts[0].begin):
            words = f"{curved:.0f} of its {whole:.0f} m are curved; its mean wear is that over all"
            output.remark(f"{track.name}: {words}.")


def _carry_out(
    part: Worn,
    inputs: Mapping[str, Any],
    loop: "Callable[..., list[WearStep]]",
    rows_of: "Callable[[list[WearStep]], Rows]",
    *,
    distance: float,
    step: float,
    law: str,
    output: cli.Output,
) -> None:
    """Run a study of wear, write and print it.

    `inputs`: name of what wears, and its runs with speeds and shares; they stand first in the
    record; `rows_of`: makes rows of each profile from the steps.
    """
    from railsim.assessment.wear import wear_law
    from railsim.plot.study import rail_wear_figure, wear_figure
    from railsim.profiles import profile_text
    from railsim.studies.wear_loop import since_new

    steps = _number_of_steps(part, distance, step)
    amounts = [part.scale * step * (number + 1) for number in range(steps)]
    profiles = [_file_name(part, at, side) for at in amounts for side in part.sides]
    folder = output.reserve(RECORD, PICTURE, *profiles, f"{STEPS}/")
    results: list[WearStep] = []
    remarks: list[str] = []

    def remark(words: str) -> None:
        remarks.append(words)
        output.remark(words)

    failure = None
    options = {"law": law, "on_step": results.append, "on_remark": remark}
    options["folder"] = folder and folder / STEPS
    try:
        with output.progress("wear") as progress:
            loop(step=part.scale * step, steps=steps, progress=progress, **options)
    except RailsimError as error:
        if not results:
            raise
        failure = error
    rows = rows_of(results)
    record: dict[str, Any] = {**inputs, "step": part.scale * step, "law": law, **rows}
    record |= {"remarks": remarks, "ended": None if failure is None else str(failure)}
    files: dict[str, Any] = {RECORD: record} | {
        _file_name(part, done.distance + done.length, side): profile_text(one)
        for done in results
        for side, one in done.worn_profiles.items()
    }
    worn = {side: [(at, one) for at, one, _ in since_new(results, side)] for side in part.sides}
    if "rows" in rows:
        title = f"{inputs['vehicle']}: wear of the wheels"
        files[PICTURE] = partial(wear_figure, worn[part.sides[0]], rows["rows"], title)
    else:
        files[PICTURE] = partial(rail_wear_figure, worn, f"{inputs['track']}: wear of the rails")
    output.write_all(files)
    if failure is None or not output.as_json:
        output.answer(record, _parts(part, inputs, wear_law(law).source, rows))
    if failure is not None:
        raise failure


def _file_name(part: Worn, amount: float, side: str) -> str:
    return f"{side}_{amount / part.scale:g}_{part.unit}.csv"


def _number_of_steps(part: Worn, distance: float, step: float) -> int:
    Faults(
        Fault(option, "", f"found {value:.12g}", "above 0")
        for option, value in ((f"--{part.amount}", distance), ("--step", step))
        if not 0.0 < value < float("inf")
    ).check()
    steps = round(min(distance / step, MOST_STEPS + 1.0))
    if not 1 <= steps <= MOST_STEPS or abs(steps * step - distance) > 1e-9 * distance:
        found = f"found {step:.12g} {part.unit} with a {part.amount} of {distance:.12g} {part.unit}"
        allowed = f"the {part.amount} divided by a whole number from 1 to {MOST_STEPS}"
        raise input_error("--step", found, allowed)
    return steps


def _parts(part: Worn, inputs: Mapping[str, Any], source: str, rows: Rows) -> "list[str | Table]":
    worn, runs = inputs.values()
    parts: list[str | Table] = [worn, f"  {shares_of(runs)}", f"  {source}, {part.note}"]
    for table in wear_tables(part, rows):
        parts += ["", table]
    return parts
