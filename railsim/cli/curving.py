"""``railsim curving``: quasi-static curving on a grid."""

from typing import Any

import click

from railsim.cli import common as cli

FILES = ("curving.json", "curving.png")


@click.command()
@cli.vehicle_argument
@cli.values("--radius", "In m, positive to the right.", "R,R,... or A:B:N", required=True)
@cli.option("--cant", "In m, of the outer rail in curves of either hand.", "H", float, default=0.15)
@cli.values("--cant-deficiency", "Cant deficiencies in m.", "I,I,... or A:B:N", default="0")
@cli.values("--friction", "Default: the track's.", "MU,MU,... or A:B:N")
@cli.rails_option
@cli.given_options("creep law and contact")
@cli.output_options("Folder for curving.json and curving.png.")
@cli.code_options
def command(given: cli.Given, output: cli.Output, **grid: Any) -> None:
    """Compute steady curving of a vehicle for every combination of the given values.

    The speed follows from radius, cant and cant deficiency.  Where Newton's method fails, time
    integration is used; such points are marked.

    \b
    Example:
      railsim curving coach_manchester --radius 250,300,500,1000,3000 --cant-deficiency 0,0.1
      railsim curving coach_manchester --radius 250:1000:16 --friction 0.2,0.4 --out curving
    """
    from railsim.stability.curving import curving

    coach, rails, settings = given.inputs()
    output.reserve(*FILES)
    with output.progress("curving") as progress:
        found = curving(coach, rails, settings=settings, progress=progress, **grid)
    output.finish(FILES, found, [found.table()], found.remarks)
