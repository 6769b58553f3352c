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
@click.option(
    "--excitation",
    metavar="A,B,...",
    help="Sizes in m of the disturbances that hunting is sought from; default: 1 to 8 mm.",
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
    excitation: str | None,
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
    from railsim.cli.analysis import Folder, load_inputs, values_of

    inputs = load_inputs(vehicle, track, settings, assignments, load)
    ranges = _ranges(conicity, friction, over)
    methods = METHODS[:-1] if method == "all" else ("linear", method)
    options = {
        "methods": tuple(dict.fromkeys(methods)),
        "low": low,
        "high": high,
        "points": points,
        **({"excitations": values_of(excitation, "--excitation")} if excitation else {}),
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
                {**options, "over_amplitude": False},
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
        column = [_speed(record, kind) for record in found]
        if kind == "linear" or np.isfinite(column).any():
            speeds[words] = np.array(column).reshape(shape)
    folder.write_json(FILES[0], found)
    if folder.path is not None:
        folder.write_picture(FILES[1], map_figure(values, speeds, inputs.vehicle.name))
    if as_json:
        print_json(found)
        return
    kinds = {"linear": f"linear, {_linearisation(found[0])} (m/s)"}
    methods = dict.fromkeys(m for one in found for m in one.get("nonlinear_by_method") or ())
    if methods:
        kinds["nonlinear"] = f"non-linear, {', '.join(methods)} (m/s)"
    rows = []
    for record in found:
        point = [f"{record['at'][name]:g}" for name in values]
        speeds_here = [_speed(record, kind) for kind in kinds]
        cells = ["none" if np.isnan(speed) else f"{speed:.2f}" for speed in speeds_here]
        rows.append([*point, *cells])
    header = [*values, *kinds.values()]
    echo("\n".join(table(header, rows, numbers=0)))
    for remark in dict.fromkeys(remark for record in found for remark in record["remarks"]):
        echo(f"remark: {remark}")
    folder.tell()


def _speed(record: dict[str, Any], kind: str) -> float:
    """Critical speed of a record; NaN where there is none."""
    speed = (record[kind] or {}).get("speed")
    return float("nan") if speed is None else float(speed)


def _linearisation(record: dict[str, Any]) -> str:
    """How the contact was linearised, in words."""
    if record.get("linearisation") == "harmonic":
        return f"harmonic {1e3 * record['amplitude']:g} mm"
    return "tangent"


def _row(
    words: str, speed: float | None, frequency: float | None, amplitude: float | None, more: str
) -> list[str]:
    """A row of the table; cells without a number are empty."""
    if speed is None:
        return [words, "none", "", "", more]
    return [
        words,
        f"{speed:.2f}",
        "" if frequency is None else f"{frequency:.2f}",
        "" if amplitude is None else f"{1e3 * amplitude:.2f}",
        more,
    ]


def _lines(found: "CriticalSpeed") -> list[str]:
    linear = found.linear or {}
    how = f"linear, {_linearisation(found.record())}"
    rows = [_row(how, linear.get("speed"), linear.get("frequency"), None, linear.get("mode", ""))]
    if linear.get("speed_of_runs") is not None:
        rows.append(_row("linear, cells of the runs", linear["speed_of_runs"], None, None, ""))
    smallest = (found.linear_over_amplitude or {}).get("smallest")
    if smallest:
        words = "linear, harmonic, smallest over amplitude"
        rows.append(_row(words, smallest["speed"], None, smallest["amplitude"], ""))
    for method, low in found.nonlinear.items():
        rows.append(_row(f"non-linear, {method}", low.speed, low.frequency, low.amplitude, ""))
    for jump in found.jumps:
        words = "jump, speed rising" if jump["direction"] == "up" else "jump, speed falling"
        more = f"to {1e3 * jump['to']:.2f} mm"
        rows.append(_row(words, jump["speed"], None, jump["amplitude"], more))
    for words, limit in (
        ("amplitude above {:g} mm", found.amplitude_limit),
        ("rms of sum_Y above {:.3g} kN", found.instability_limit),
    ):
        if limit is not None:
            size = limit["limit"] * (1e3 if "mm" in words else 1e-3)
            more = "" if limit["reached"] else f"not reached up to {found.high:g} m/s"
            rows.append(_row(words.format(size), limit["speed"], None, None, more))
    header = ["critical speed", "m/s", "Hz", "mm", "mode"]
    kind = [f"the bifurcation is {found.type}"] if found.type not in ("", "none") else []
    if kind and found.onset and found.onset != found.type:
        kind = [f"{kind[0]}; small motions begin as in a {found.onset} one"]
    where = found.conditions
    note = (
        f"rails {where['rails']}, friction {where['friction']}, creep law {where['law']}"
        f" (linear: {where['linear_law']}), searched from {found.low:g} to {found.high:g} m/s"
    )
    remarks = (f"remark: {remark}" for remark in found.remarks)
    return [*table(header, rows), note, *kind, *remarks]
