"""``railsim critical-speed``: linear and non-linear critical speed of a vehicle."""

from collections.abc import Callable
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    Given,
    Inputs,
    Output,
    as_speed,
    as_values,
    code_options,
    given_options,
    linearisation_options,
    option,
    optional_track,
    output_options,
    values_of,
    vehicle_argument,
    workers_option,
)
from railsim.errors import input_error

if TYPE_CHECKING:
    from railsim.studies.stability_map import MapPoint

METHODS = ("linear", "ramp", "bifurcation", "continuation", "all")
BY_OPTION = ("conicity", "friction")
FILES = ("critical_speed.json", "critical_speed.png")


@click.command(name="critical-speed")
@vehicle_argument
@optional_track
@option(
    "--method",
    "The linear critical speed is always found.",
    kind=click.Choice(METHODS),
    default="ramp",
)
@option("--from low", "Lowest speed in m/s, or with a unit.", "V", as_speed, default=5.0)
@option("--to high", "Highest speed in m/s, or with a unit.", "V", as_speed, default=120.0)
@option("--points", "Speeds of a bifurcation diagram.", "N", int, default=16)
@option(
    "--excitation excitations",
    "Disturbances from which hunting is sought, in m; default: 1 to 8 mm.",
    "A,B,...",
    callback=as_values,
)
@linearisation_options
@option("--conicity", "Straight cones as wheels; several: a map.", "G or A:B:N", callback=as_values)
@option("--friction", "Friction; several values: a map.", "MU or A:B:N", callback=as_values)
@option(
    "--over",
    "A map over a key of the vehicle, track or settings; at most two parameters.",
    "KEY.PATH=A:B:N",
    multiple=True,
)
@workers_option
@given_options("scheme, creep law, contact")
@output_options("Folder for critical_speed.json and .png; an interrupted map is continued.")
@code_options
def command(
    vehicle: str,
    track: str | None,
    given: Given,
    output: Output,
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
      railsim critical-speed coach_manchester --method linear --conicity 0.05:0.4:8 --out map
      railsim critical-speed coach_manchester --over vehicle.bodies.carbody.mass=20e3:50e3:7
    """
    workers = how.pop("workers")
    load = partial(given.inputs, vehicle, track)
    inputs, ranges = load(), _ranges(conicity, friction, over)
    how["methods"] = METHODS[:-1] if method == "all" else tuple(dict.fromkeys(("linear", method)))
    if how["excitations"] is None:
        del how["excitations"]
    points = [
        _point(inputs, load, dict(zip(ranges, values, strict=True)))
        for values in product(*ranges.values())
    ]
    output.reserve(*FILES)
    if len(points) > 1:
        _map(points, ranges, how, workers, output)
        return
    from railsim.stability.critical_speed import critical_speed

    at = points[0]
    with output.progress("critical speed") as progress:
        found = critical_speed(
            at.vehicle,
            at.track,
            settings=at.settings,
            conicity=at.at.get("conicity"),
            progress=progress,
            **how,
        )
    output.finish(FILES, found, [found.table(), *filter(None, [found.verdict()])], found.remarks)


def _map(
    points: "list[MapPoint]",
    ranges: dict[str, list[float]],
    how: dict[str, Any],
    workers: int | None,
    output: Output,
) -> None:
    from railsim.plot.stability import map_figure
    from railsim.studies.stability_map import map_speeds, map_table, stability_map

    with output.progress("critical speed") as progress:
        found = stability_map(
            points,
            {**how, "over_amplitude": False},
            folder=output.folder,
            workers=workers,
            overwrite=output.overwrite,
            progress=progress,
            on_remark=output.remark,
        )
    axes = {name: values for name, values in ranges.items() if len(values) > 1}
    title = f"{points[0].vehicle.name}: critical speed"
    output.write(FILES[0], found)
    output.write(FILES[1], lambda: map_figure(axes, map_speeds(found), title))
    remarks = dict.fromkeys(remark for record in found for remark in record["remarks"])
    output.answer(found, [map_table(found, list(axes))], remarks)


def _ranges(
    conicity: list[float] | None, friction: list[float] | None, over: tuple[str, ...]
) -> dict[str, list[float]]:
    """Values by parameter; of a map two parameters at most."""
    found = {"conicity": conicity or [], "friction": friction or []}
    found = {name: values for name, values in found.items() if values}
    for mu in found.get("friction", ()):  # 0,4 is two values
        if not 0.0 <= mu <= 2.0:
            raise input_error("--friction", f"found {mu:g}", "0 to 2, such as 0.4")
    for text in over:
        key, equals, values = text.partition("=")
        if not equals:
            raise input_error("--over", f"found '{text}'", "KEY.PATH=first:last:number")
        if key in found:
            raise input_error("--over", "given twice", "each key once", key=key)
        found[key] = values_of(values, "--over")
    several = [name for name, values in found.items() if len(values) > 1]
    if len(several) > 2:
        words = f"found {len(several)} parameters with several values ({', '.join(several)})"
        raise input_error("--over", words, "two at most")
    return found


def _point(inputs: Inputs, load: Callable[..., Inputs], at: dict[str, float]) -> "MapPoint":
    from railsim.studies.stability_map import MapPoint

    changes = [f"{key}={value!r}" for key, value in at.items() if key not in BY_OPTION]
    vehicle, track, settings = load(changes) if changes else inputs
    if "friction" in at:
        track = track.replace(friction=at["friction"], friction_table=None)
    return MapPoint(at, vehicle, track, settings)
