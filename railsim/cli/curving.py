"""``railsim curving``: quasi-static curving on a grid."""

import click

from railsim.cli.common import code_options, option, rails_option, vehicle_argument
from railsim.cli.inputs import Given, given_options, values_of
from railsim.cli.output import Output, output_options
from railsim.cli.progress import progress_bar

FILES = ("curving.json", "curving.png")


@click.command()
@vehicle_argument
@option("--radius", "Radii in m, positive to the right.", "R,R,... or A:B:N", required=True)
@option("--cant", "Cant in m.", "H", float, default=0.15)
@option("--cant-deficiency", "Cant deficiencies in m.", "I,I,... or A:B:N", default="0")
@option("--friction", "Default: the track's.", "MU,MU,... or A:B:N")
@rails_option
@given_options("creep law and contact")
@output_options("Folder for curving.json and curving.png.")
@code_options
def command(
    vehicle: str,
    radius: str,
    cant: float,
    cant_deficiency: str,
    friction: str | None,
    track: str | None,
    given: Given,
    output: Output,
) -> None:
    """Compute steady curving of a vehicle for every combination of the given values.

    The speed follows from radius, cant and cant deficiency.  Where Newton's method fails, time
    integration is used; such points are marked.

    \b
    Example:
      railsim curving coach_manchester --radius 250,300,500,1000,3000 --cant-deficiency 0,0.1
      railsim curving coach_manchester --radius 250:1000:16 --friction 0.2,0.4 --out curving
    """  # noqa: D301 - click reads the escape
    from railsim.stability.curving import curving

    coach, rails, settings = given.inputs(vehicle, track)
    output.reserve(*FILES)
    with progress_bar("curving", quiet=output.quiet) as progress:
        found = curving(
            coach,
            rails,
            radius=values_of(radius, "--radius"),
            cant=cant,
            cant_deficiency=values_of(cant_deficiency, "--cant-deficiency"),
            friction=values_of(friction, "--friction") if friction else None,
            settings=settings,
            progress=progress,
        )
    output.finish(FILES, found, [found.table()], found.remarks)
