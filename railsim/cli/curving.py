"""``railsim curving``: quasi-static curving on a grid."""

import math
from typing import TYPE_CHECKING

import click

from railsim.cli.common import (
    echo,
    json_option,
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
    from railsim.stability.curving import Curving

FILES = ("curving.json", "curving.png")
MARKS = {0: "no steady state", 1: "", 2: "by time integration"}


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
@click.option("--out", metavar="DIR", help="Folder for curving.json and curving.png.")
@click.option("--settings", metavar="F", help="Settings file: creep law and contact.")
@load_option
@set_option
@overwrite_option
@json_option
@quiet_option
def command(
    vehicle: str,
    radius: str,
    cant: float,
    cant_deficiency: str,
    friction: str | None,
    track: str | None,
    out: str | None,
    settings: str | None,
    load: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Compute steady curving of a vehicle for every combination of the given values.

    The speed follows from radius, cant and cant deficiency.  Where Newton's method fails, time
    integration is used; such points are marked.

    \b
    Example:
      railsim curving coach_manchester --radius 250,300,500,1000,3000 --cant-deficiency 0,0.1
      railsim curving coach_manchester --radius 250:1000:16 --friction 0.2,0.4 --out curving
    """  # noqa: D301 - click reads the escape
    from railsim.cli.analysis import Folder, load_inputs, values_of
    from railsim.stability.curving import curving

    inputs = load_inputs(vehicle, track, settings, assignments, load)
    folder = Folder(out, FILES, overwrite)
    with progress_bar("curving", quiet=quiet) as progress:
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
    folder.write_json(FILES[0], found.record())
    if folder.path is not None:
        from railsim.plot.curving import curving_figure

        title = f"{inputs.vehicle.name}: steady curving, cant {1e3 * cant:g} mm"
        folder.write_picture(FILES[1], curving_figure(found, title))
    if as_json:
        print_json(found.record())
        return
    echo("\n".join(_lines(found)))
    folder.tell()


def _lines(found: "Curving") -> list[str]:
    """Leading wheelset and its outer wheel at every point."""
    rows = []
    for r, radius in enumerate(found.radius):
        outer = 0 if radius > 0.0 else 1
        for i, deficiency in enumerate(found.cant_deficiency):
            for m, mu in enumerate(found.friction):
                index = r, i, m
                values = [
                    1e3 * found.lateral[index][0],
                    1e3 * found.attack[index][0],
                    1e-3 * found.Q[index][0, outer],
                    1e-3 * found.Y[index][0, outer],
                    found.Y_over_Q[index][0, outer],
                    found.T_gamma[index].sum(),
                ]
                decimals = (2, 2, 1, 1, 3, 0)
                cells = [
                    "" if math.isnan(v) else f"{v:.{d}f}"
                    for v, d in zip(values, decimals, strict=True)
                ]
                rows.append(
                    [
                        f"{radius:g}",
                        f"{1e3 * deficiency:g}",
                        f"{mu:g}",
                        f"{found.speed[r, i]:.2f}",
                        *cells,
                        MARKS[int(found.converged[index])],
                    ]
                )
    header = [
        "radius (m)",
        "I (mm)",
        "mu",
        "V (m/s)",
        "y (mm)",
        "attack (mrad)",
        "Q (kN)",
        "Y (kN)",
        "Y/Q",
        "T_gamma (N)",
        "",
    ]
    words = (
        f"Leading wheelset, its outer wheel, T_gamma of all wheels; cant {1e3 * found.cant:g} mm"
    )
    remarks = [f"remark: {remark}" for remark in found.remarks]
    return [words, *table(header, rows, numbers=0), *remarks]
