"""``railsim info``: what a vehicle, track or result file holds, on one screen."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    echo,
    json_option,
    load_option,
    overwrite_option,
    print_json,
    remarks_on,
    set_option,
    with_load,
)
from railsim.files import PICTURES, RESULTS, check_file

if TYPE_CHECKING:
    from railsim.definitions.base import FileDefinition


@click.command()
@click.argument("file", metavar="F")
@click.option(
    "--speed",
    "speeds",
    type=click.FloatRange(min=0.0, min_open=True),
    multiple=True,
    metavar="V",
    help="Speed for the cant deficiency in the curves of a track, m/s; may be given several times.",
)
@click.option(
    "--static", is_flag=True, help="Also compute static wheel loads and preloads of a vehicle."
)
@click.option("--draw", metavar="F.png", help="Draw a vehicle in three views, or a track.")
@overwrite_option
@load_option
@set_option
@json_option
def command(
    file: str,
    speeds: tuple[float, ...],
    static: bool,
    draw: str | None,
    overwrite: bool,
    load: str | None,
    assignments: tuple[str, ...],
    as_json: bool,
) -> None:
    """Show what a vehicle, track, settings or result file holds.

    \b
    Example:
      railsim info coach_manchester --draw coach.png --overwrite
      railsim info curve_r250 --speed 20 --speed 25
    """  # noqa: D301 - click reads the escape
    if Path(file).suffix.lower() in RESULTS:
        if draw is not None:
            raise click.UsageError("--draw is for vehicles and tracks; see `railsim plot`")
        _show_result(file, as_json)
        return
    from railsim.definitions.loading import load_any

    definition, known = load_any(file, with_load(assignments, load))
    if draw is not None:
        _draw(definition, Path(draw), overwrite)
    data, lines = _description(definition, known.kind, speeds, static)
    if as_json:
        print_json(data)
        return
    echo("\n".join(lines))
    for remark in remarks_on(definition, known):
        echo(f"remark: {remark}")


def _show_result(file: str, as_json: bool) -> None:
    from railsim.cli import describe
    from railsim.result import open_result

    result = open_result(file)
    if as_json:
        print_json(describe.result_data(result))
    else:
        echo("\n".join(describe.result_lines(result)))


def _description(
    definition: "FileDefinition", kind: str, speeds: tuple[float, ...], static: bool
) -> tuple[dict[str, Any], list[str]]:
    """Return a definition as data and as lines."""
    from railsim.cli import describe
    from railsim.definitions.mechanism import Mechanism
    from railsim.definitions.spring import TrailingArmSuspension
    from railsim.definitions.study import Study
    from railsim.definitions.track import Track
    from railsim.definitions.vehicle import Vehicle

    if isinstance(definition, Track):
        data = describe.track_data(definition, speeds)
        return data, describe.track_lines(definition, speeds)
    if isinstance(definition, Study):
        data = {"kind": kind, "runs": definition.runs, **definition.model_dump(exclude_none=True)}
        lines = [f"{definition.name}: {definition.runs} runs", ""]
        return data, lines + definition.to_toml().splitlines()
    if not isinstance(definition, Vehicle):
        data = {"kind": kind, **definition.model_dump()}
        if isinstance(definition, TrailingArmSuspension):
            return data, describe.spring_lines(definition)
        if isinstance(definition, Mechanism):
            return data, describe.mechanism_lines(definition)
        return data, definition.to_toml().splitlines()
    data, lines = describe.vehicle_data(definition), describe.vehicle_lines(definition)
    if static:
        data["static"] = describe.static_data(definition)
        lines += ["", *describe.static_lines(data["static"])]
    return data, lines


def _draw(definition: "FileDefinition", path: Path, overwrite: bool) -> None:
    from railsim.definitions.track import Track
    from railsim.definitions.vehicle import Vehicle
    from railsim.plot.style import save

    check_file(path, overwrite=overwrite, option="--draw", endings=PICTURES)
    if isinstance(definition, Vehicle):
        from railsim.plot.vehicle import vehicle_figure

        save(vehicle_figure(definition), path, overwrite=overwrite)
    elif isinstance(definition, Track):
        from railsim.plot.track import track_figure

        save(track_figure(definition), path, overwrite=overwrite)
    else:
        raise click.UsageError("--draw is for vehicles and tracks")
