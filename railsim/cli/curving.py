"""``railsim curving``: quasi-static curving on a grid."""

from typing import Any

import click

from railsim.cli.analysis import Folder, InputFiles, Output, analysis_options, values_of
from railsim.cli.common import code_options, names_of
from railsim.cli.progress import progress_bar

FILES = ("curving.json", "curving.png")


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=names_of("vehicle"))
@click.option(
    "--radius", required=True, metavar="R,R,... or A:B:N", help="Radii in m, positive to the right."
)
@click.option("--cant", type=float, default=0.15, show_default=True, metavar="H", help="Cant in m.")
@click.option(
    "--cant-deficiency",
    default="0",
    show_default=True,
    metavar="I,I,... or A:B:N",
    help="Cant deficiencies in m.",
)
@click.option("--friction", metavar="MU,MU,... or A:B:N", help="Default: the track's.")
@click.option("--track", metavar="F", help="Rails, gauge, inclination, support; default straight.")
@analysis_options("curving.json and curving.png")
@code_options
def command(
    files: InputFiles,
    output: Output,
    radius: str,
    cant: float,
    cant_deficiency: str,
    friction: str | None,
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

    inputs = files.load()
    folder = Folder(output.out, FILES, output.overwrite)
    with progress_bar("curving", quiet=output.quiet) as progress:
        found = curving(
            inputs.vehicle,
            inputs.track,
            radius=values_of(radius, "--radius"),
            cant=cant,
            cant_deficiency=values_of(cant_deficiency, "--cant-deficiency"),
            friction=values_of(friction, "--friction") if friction else None,
            settings=inputs.settings,
            progress=progress,
        )

    def parts() -> list[Any]:
        return [found.table(), *(f"remark: {remark}" for remark in found.remarks)]

    folder.finish(found.record(), found.plot, parts, as_json=output.as_json)
