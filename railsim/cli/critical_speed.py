"""``railsim critical-speed``: linear and non-linear critical speed of a vehicle."""

from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.errors import input_error

if TYPE_CHECKING:
    from railsim.studies.stability_map import MapPoint

METHODS = ("linear", "ramp", "bifurcation", "continuation", "all")
BY_OPTION = ("conicity", "friction")
FILES = ("critical_speed.json", "critical_speed.png")


@click.command(name="critical-speed")
@cli.vehicle_argument
@cli.optional_track
@cli.choice("--method", "The linear speed is always found.", "|".join(METHODS), default="ramp")
@cli.option("--from low", "Lowest speed in m/s, or with a unit.", "V", cli.as_speed, default=5.0)
@cli.option("--to high", "Highest speed in m/s, or with a unit.", "V", cli.as_speed, default=120.0)
@cli.option("--points", "Speeds of a bifurcation diagram.", "N", int, default=16)
@cli.values("--excitation excitations", "Disturbances tried, in m; default: 1 to 11 mm.", "A,B,...")
@cli.linearisation_options
@cli.values("--conicity", "Straight cones as wheels; several: a map.", "G or A:B:N")
@cli.values("--friction", "Friction; several values: a map.", "MU or A:B:N")
@cli.repeated("--over", "A map over a key of the input; at most two parameters.", "KEY.PATH=A:B:N")
@cli.workers_option
@cli.given_options("scheme, creep law, contact")
@cli.output_options("Folder for critical_speed.json and .png; an interrupted map is continued.")
@cli.code_options
def command(
    given: cli.Given,
    output: cli.Output,
    method: str,
    conicity: list[float] | None,
    friction: list[float] | None,
    over: tuple[str, ...],
    **how: Any,
) -> None:
    """Find the critical speed of a vehicle on ideal straight track.

    V_lin: lowest speed at which a mode is undamped.  V_n: lowest speed at which hunting sustains
    itself, by a ramp of falling speed with runs at constant speed, by a bifurcation diagram, or by
    continuation of the periodic motions.  Rails, gauge, friction and support are those of TRACK
    (default: straight).

    \b
    Example:
      railsim critical-speed coach_manchester --method linear
      railsim critical-speed coach_manchester --method all --out stability --overwrite
      railsim critical-speed coach_manchester --method linear --conicity 0.05:0.2:7 --out map
      railsim critical-speed coach_manchester --over vehicle.bodies.carbody.mass=20e3:50e3:7
    """
    workers = how.pop("workers")
    cli.goes_with("--method bifurcation or all", method in ("bifurcation", "all"), "points")
    with_excitation = method not in ("linear", "continuation")
    cli.goes_with("--method ramp, bifurcation or all", with_excitation, "excitations")
    cli.goes_with("--linearisation harmonic", how["linearisation"] == "harmonic", "amplitude")
    output.reserve(*FILES)
    inputs, ranges = given.inputs(), _ranges(conicity, friction, over)
    how["methods"] = METHODS[:-1] if method == "all" else tuple(dict.fromkeys(("linear", method)))
    if how["excitations"] is None:
        del how["excitations"]
    each = (dict(zip(ranges, values, strict=True)) for values in product(*ranges.values()))
    points = [_point(inputs, given, point) for point in each]
    if len(points) > 1:
        _map(points, ranges, how, workers, output)
        return
    from railsim.stability.critical_speed import critical_speed

    point = points[0]
    with output.progress("critical speed") as progress:
        how |= {"settings": point.settings, "conicity": point.values.get("conicity")}
        found = critical_speed(point.vehicle, point.track, progress=progress, **how)
    output.finish(FILES, found, [found.table(), *filter(None, [found.verdict()])], found.remarks)


def _map(
    points: "list[MapPoint]",
    ranges: dict[str, list[float]],
    how: dict[str, Any],
    workers: int | None,
    output: cli.Output,
) -> None:
    from railsim.definitions.units_of_keys import unit_of_input
    from railsim.plot.stability import map_figure
    from railsim.studies.stability_map import map_speeds, map_table, stability_map

    how["over_amplitude"] = False
    with output.studying("critical speed") as studying:
        records = stability_map(points, how, folder=output.folder, workers=workers, **studying)
    axes = {name: values for name, values in ranges.items() if len(values) > 1}
    units = {name: unit_of_input(points[0], name) for name in axes}
    parameters = {f"{name} ({units[name]})" if units[name] else name: axes[name] for name in axes}
    table = map_table(records, units)
    title = f"{points[0].vehicle.name_with_load}: critical speed\n{table.caption}"
    figure = partial(map_figure, parameters, map_speeds(records), title)
    output.write_all({FILES[0]: records, FILES[1]: figure})
    remarks = dict.fromkeys(remark for record in records for remark in record["remarks"])
    output.answer(records, [table], remarks)


def _ranges(
    conicity: list[float] | None, friction: list[float] | None, over: tuple[str, ...]
) -> dict[str, list[float]]:
    """Values by parameter; of a map two parameters at most."""
    ranges = {"conicity": conicity or [], "friction": friction or []}
    ranges = {name: values for name, values in ranges.items() if values}
    for mu in ranges.get("friction", ()):  # 0,4 is two values
        if not 0.0 <= mu <= 2.0:
            raise input_error("--friction", f"found {mu:.12g}", "0 to 2, such as 0.4")
    for text in over:
        key, equals, values = text.partition("=")
        if not equals:
            raise input_error("--over", f"found '{text}'", "KEY.PATH=first:last:number")
        if key in ranges or (key.startswith("track.friction") and "friction" in ranges):
            raise input_error("--over", "given twice", "each key once, or by its option", key=key)
        ranges[key] = cli.values_of(values, "--over")
    several = [name for name, values in ranges.items() if len(values) > 1]
    if len(several) > 2:
        words = f"found {len(several)} parameters with several values ({', '.join(several)})"
        raise input_error("--over", words, "two at most")
    return ranges


def _point(inputs: cli.Inputs, given: cli.Given, values: dict[str, float]) -> "MapPoint":
    from railsim.studies.stability_map import MapPoint

    changes = [f"{key}={value!r}" for key, value in values.items() if key not in BY_OPTION]
    vehicle, track, settings = given.inputs(changes) if changes else inputs
    if "friction" in values:
        track = track.replace(friction=values["friction"], friction_table=None)
    return MapPoint(values, vehicle, track, settings)
