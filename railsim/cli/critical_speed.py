"""``railsim critical-speed``: linear and non-linear critical speed of a vehicle."""

from collections.abc import Callable
from itertools import product
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    echo,
    json_option,
    linearisation_options,
    load_option,
    names_of,
    overwrite_option,
    print_json,
    quiet_option,
    set_option,
    table,
)
from railsim.cli.progress import progress_bar

if TYPE_CHECKING:
    from railsim.cli.analysis import Inputs
    from railsim.stability.critical_speed import CriticalSpeed
    from railsim.studies.stability_map import MapPoint

METHODS = ("linear", "ramp", "bifurcation", "continuation", "all")
BY_OPTION = ("conicity", "friction")
FILES = ("critical_speed.json", "critical_speed.png")


@click.command(name="critical-speed")
@click.argument("vehicle", metavar="VEHICLE", shell_complete=names_of("vehicle"))
@click.argument("track", metavar="TRACK", required=False, shell_complete=names_of("track"))
@click.option(
    "--method",
    default="ramp",
    show_default=True,
    type=click.Choice(METHODS),
    help="The linear critical speed is always found.",
)
@click.option(
    "--from",
    "low",
    type=float,
    default=5.0,
    show_default=True,
    metavar="V",
    help="Lowest speed in m/s.",
)
@click.option(
    "--to",
    "high",
    type=float,
    default=120.0,
    show_default=True,
    metavar="V",
    help="Highest speed in m/s.",
)
@click.option(
    "--points",
    type=int,
    default=16,
    show_default=True,
    metavar="N",
    help="Speeds of a bifurcation diagram.",
)
@linearisation_options
@click.option("--conicity", metavar="G or A:B:N", help="Straight cones as wheels; several: a map.")
@click.option("--friction", metavar="MU or A:B:N", help="Friction; several values: a map.")
@click.option(
    "--over",
    multiple=True,
    metavar="KEY.PATH=A:B:N",
    help="A map over a key of the vehicle, track or settings; at most two parameters.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes for a map; default: all cores.",
)
@click.option(
    "--out",
    metavar="DIR",
    help="Folder for critical_speed.json and .png; an interrupted map is continued.",
)
@click.option("--settings", metavar="F", help="Settings file: scheme, creep law, contact.")
@load_option
@set_option
@overwrite_option
@json_option
@quiet_option
def command(
    vehicle: str,
    track: str | None,
    method: str,
    low: float,
    high: float,
    points: int,
    conicity: str | None,
    friction: str | None,
    over: tuple[str, ...],
    workers: int | None,
    out: str | None,
    settings: str | None,
    load: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
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
    """  # noqa: D301 - click reads the escape
    from railsim.cli.analysis import Folder, load_inputs

    inputs = load_inputs(vehicle, track, settings, assignments, load)
    ranges = _ranges(conicity, friction, over)
    methods = METHODS[:-1] if method == "all" else ("linear", method)
    options = {
        "methods": tuple(dict.fromkeys(methods)),
        "low": low,
        "high": high,
        "points": points,
        **how,
    }

    def with_values(changes: list[str]) -> "Inputs":
        return load_inputs(vehicle, track, settings, [*assignments, *changes], load)

    grid = [
        _point(inputs, with_values, dict(zip(ranges, values, strict=True)))
        for values in product(*ranges.values())
    ]
    folder = Folder(out, FILES, overwrite)
    with progress_bar("critical speed", quiet=quiet) as progress:
        if len(grid) > 1:
            from railsim.studies.stability_map import stability_map

            points_found = stability_map(
                grid,
                options,
                folder=folder.path,
                workers=workers,
                overwrite=overwrite,
                progress=progress,
                on_remark=lambda text: echo(f"remark: {text}", err=True),
            )
        else:
            one = _one(grid[0], options, progress)
    if len(grid) > 1:
        several = {name: values for name, values in ranges.items() if len(values) > 1}
        _tell_map(folder, inputs, several, points_found, as_json)
        return
    from railsim.plot.stability import bifurcation_figure

    folder.write_json(FILES[0], one.record())
    if folder.path is not None:
        folder.write_picture(FILES[1], bifurcation_figure(one, inputs.vehicle.name))
    if as_json:
        print_json(one.record())
        return
    echo("\n".join(_lines(one)))
    folder.tell()


def _ranges(
    conicity: str | None, friction: str | None, over: tuple[str, ...]
) -> dict[str, list[float]]:
    """Values by parameter; of a map two parameters at most."""
    from railsim.cli.analysis import values_of
    from railsim.errors import Fault, InputError

    found = {}
    for name, text in (("conicity", conicity), ("friction", friction)):
        if text:
            found[name] = values_of(text, f"--{name}")
    for text in over:
        key, equals, values = text.partition("=")
        if not equals:
            raise InputError([Fault("--over", "", f"found '{text}'", "KEY.PATH=first:last:number")])
        if key in found:
            raise InputError([Fault("--over", key, "given twice", "each key once")])
        found[key] = values_of(values, "--over")
    several = [name for name, values in found.items() if len(values) > 1]
    if len(several) > 2:
        raise InputError(
            [
                Fault(
                    "--over",
                    "",
                    f"found {len(several)} parameters with several values ({', '.join(several)})",
                    "two at most",
                )
            ]
        )
    return found


def _point(
    inputs: "Inputs", with_values: Callable[[list[str]], "Inputs"], at: dict[str, float]
) -> "MapPoint":
    from railsim.studies.stability_map import MapPoint

    changes = [f"{key}={value!r}" for key, value in at.items() if key not in BY_OPTION]
    here = with_values(changes) if changes else inputs
    track = here.track
    if "friction" in at:
        track = track.replace(friction=at["friction"], friction_table=None)
    return MapPoint(at, here.vehicle, track, here.settings)


def _one(point: "MapPoint", options: dict[str, Any], progress: Any) -> "CriticalSpeed":
    from railsim.stability.critical_speed import critical_speed

    return critical_speed(
        point.vehicle,
        point.track,
        settings=point.settings,
        conicity=point.at.get("conicity"),
        progress=progress,
        **options,
    )


def _tell_map(
    folder: Any,
    inputs: "Inputs",
    values: dict[str, list[float]],
    found: list[dict[str, Any]],
    as_json: bool,
) -> None:
    """Print, write and draw a map."""
    import numpy as np

    from railsim.plot.stability import map_figure

    shape = [len(several) for several in values.values()]
    speeds = {}
    for kind, words in (("linear", "linear"), ("nonlinear", "non-linear")):
        column = [record[kind]["speed"] if record[kind] else np.nan for record in found]
        if kind == "linear" or np.isfinite(column).any():
            speeds[words] = np.array(column).reshape(shape)
    folder.write_json(FILES[0], found)
    if folder.path is not None:
        folder.write_picture(FILES[1], map_figure(values, speeds, inputs.vehicle.name))
    if as_json:
        print_json(found)
        return
    kinds = {"linear": "linear (m/s)"}
    if any(record.get("nonlinear_by_method") for record in found):
        kinds["nonlinear"] = "non-linear (m/s)"
    rows = []
    for record in found:
        point = [f"{record['at'][name]:g}" for name in values]
        cells = [f"{record[kind]['speed']:.2f}" if record[kind] else "none" for kind in kinds]
        rows.append([*point, *cells])
    header = [*values, *kinds.values()]
    echo("\n".join(table(header, rows, numbers=0)))
    for remark in dict.fromkeys(remark for record in found for remark in record["remarks"]):
        echo(f"remark: {remark}")
    folder.tell()


def _lines(found: "CriticalSpeed") -> list[str]:
    rows = []
    if found.linear is not None:
        rows.append(
            [
                "linear",
                f"{found.linear['speed']:.2f}",
                f"{found.linear['frequency']:.2f}",
                "",
                found.linear["mode"],
            ]
        )
    else:
        rows.append(["linear", "none", "", "", ""])
    for method, lowest in found.nonlinear.items():
        if lowest.speed is None:
            rows.append([f"non-linear, {method}", "none", "", "", ""])
        else:
            rows.append(
                [
                    f"non-linear, {method}",
                    f"{lowest.speed:.2f}",
                    f"{lowest.frequency:.2f}",
                    f"{1e3 * lowest.amplitude:.2f}",
                    "",
                ]
            )
    for words, limit in (
        ("amplitude above {:g} mm", found.amplitude_limit),
        ("rms of sum_Y above {:.3g} kN", found.instability_limit),
    ):
        if limit is not None:
            size = limit["limit"] * (1e3 if "mm" in words else 1e-3)
            rows.append([words.format(size), f"{limit['speed']:.2f}", "", "", ""])
    header = ["critical speed", "m/s", "Hz", "mm", "mode"]
    kind = [f"the bifurcation is {found.type}"] if found.type not in ("", "none") else []
    return [*table(header, rows), *kind, *(f"remark: {remark}" for remark in found.remarks)]
