"""``railsim info``: what a vehicle, track or result file holds, in a screenful."""

from pathlib import Path

import click

from railsim.cli.common import json_option, print_json, set_option
from railsim.cli.validate import RESULT_SUFFIXES


@click.command()
@click.argument("file", metavar="F")
@click.option(
    "--speed",
    "speeds",
    type=click.FloatRange(min=0.0, min_open=True),
    multiple=True,
    metavar="V",
    help="Speed for the cant deficiency of a track's curves, m/s; may be given several times.",
)
@set_option
@json_option
def command(
    file: str, speeds: tuple[float, ...], assignments: tuple[str, ...], as_json: bool
) -> None:
    r"""Show what a vehicle, track, settings or result file holds.

    \b
    Example:
      railsim info coach_manchester
      railsim info curve_r250 --speed 20 --speed 25
    """
    if Path(file).suffix.lower() in RESULT_SUFFIXES:
        _show_result(file, as_json)
    else:
        _show_definition(file, speeds, assignments, as_json)


def _show_result(file: str, as_json: bool) -> None:
    from railsim.cli import describe
    from railsim.result import open_result

    result = open_result(file)
    if as_json:
        print_json(describe.result_data(result))
    else:
        click.echo("\n".join(describe.result_lines(result)))


def _show_definition(
    file: str, speeds: tuple[float, ...], assignments: tuple[str, ...], as_json: bool
) -> None:
    from railsim.cli import describe
    from railsim.definitions.loading import load_any
    from railsim.definitions.track import Track
    from railsim.definitions.vehicle import Vehicle

    definition, known = load_any(file, assignments)
    if isinstance(definition, Vehicle):
        data, lines = describe.vehicle_data(definition), describe.vehicle_lines(definition)
    elif isinstance(definition, Track):
        data = describe.track_data(definition, speeds)
        lines = describe.track_lines(definition, speeds)
    else:
        data = {"kind": known.kind, **definition.model_dump()}
        lines = definition.to_toml().splitlines()
    if as_json:
        print_json(data)
        return
    click.echo("\n".join(lines))
    for remark in known.remarks(definition):
        click.echo(f"remark: {remark}")
