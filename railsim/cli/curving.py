"""``railsim curving``: quasi-static curving on a grid."""

from typing import Any

import click

from railsim.cli.common import (
    Given,
    Output,
    as_values,
    code_options,
    given_options,
    option,
    output_options,
    rails_option,
    vehicle_argument,
)

FILES = ("curving.json", "curving.png")


@click.command()
@vehicle_argument
@option(
    "--radius",
    "Radii in m, positive to the right.",
    "R,R,... or A:B:N",
    callback=as_values,
    required=True,
)
@option("--cant", "Cant in m.", "H", float, default=0.15)
@option(
    "--cant-deficiency",
    "Cant deficiencies in m.",
    "I,I,... or A:B:N",
    callback=as_values,
    default="0",
)
@option("--friction", "Default: the track's.", "MU,MU,... or A:B:N", callback=as_values)
@rails_option
@given_options("creep law and contact")
@output_options("Folder for curving.json and curving.png.")
@code_options
def command(vehicle: str, track: str | None, given: Given, output: Output, **grid: Any) -> None:
    """Compute steady curving of a vehicle for every combination of the given values.

    The speed follows from radius, cant and cant deficiency.  Where Newton's method fails, time
    integration is used; such points are marked.

    \b
    Example:
      railsim curving coach_manchester --radius 250,300,500,1000,3000 --cant-deficiency 0,0.1
      railsim curving coach_manchester --radius 250:1000:16 --friction 0.2,0.4 --out curving
    """
    from railsim.stability.curving import curving

    coach, rails, settings = given.inputs(vehicle, track)
    output.reserve(*FILES)
    with output.progress("curving") as progress:
        found = curving(coach, rails, settings=settings, progress=progress, **grid)
    output.finish(FILES, found, [found.table()], found.remarks)
