"""``railsim stationary``: stationary tests on twisted and canted track."""

from typing import TYPE_CHECKING

import click

from railsim.cli.common import code_options, load_option, output_options, set_option

if TYPE_CHECKING:
    from railsim.studies.stationary import Stationary
    from railsim.table import Table

FILES = ("stationary.json", "stationary.png")


@click.command()
@click.argument("vehicle", metavar="VEHICLE")
@click.option("--cant", type=float, metavar="H", help="Default: the admissible cant deficiency, m.")
@click.option("--rolling", is_flag=True, help="Do not hold the wheelsets across the track.")
@click.option(
    "--limits", default="stationary", show_default=True, metavar="F",
    help="Limits file, or the name of a shipped one.",
)  # fmt: skip
@click.option("--track", metavar="F", help="Rails, gauge, friction, support; default straight.")
@click.option("--settings", metavar="F", help="Settings file: creep law and contact.")
@click.option("--fail", is_flag=True, help="Exit status 4 where a limit is exceeded.")
@click.option("--out", metavar="DIR", help="Folder for stationary.json and stationary.png.")
@load_option
@set_option
@output_options
@code_options
def command(
    vehicle: str,
    cant: float | None,
    rolling: bool,
    limits: str,
    track: str | None,
    settings: str | None,
    fail: bool,
    out: str | None,
    load: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Compare a vehicle on twisted track and on cant with limits.

    Wheel unloading on the twists of EN 14363, 6.1, with dry friction from both directions; guiding
    force in a level curve of R 150 m over the smallest wheel load on these twists; wheel unloading
    and angle of the floor on a cant equal to the admissible cant deficiency; roll coefficient.

    \b
    Example:
      railsim stationary coach_manchester
      railsim stationary coach_manchester --cant 0.15 --rolling
    """  # noqa: D301 - click reads the escape
    from railsim.cli import DONE, LIMIT_EXCEEDED
    from railsim.cli.analysis import Folder, load_inputs
    from railsim.definitions.loading import load_stationary_limits
    from railsim.studies.stationary import stationary

    inputs = load_inputs(vehicle, track, settings, assignments, load)
    folder = Folder(out, FILES, overwrite)
    found = stationary(
        inputs.vehicle, inputs.track, load_stationary_limits(limits), cant=cant, held=not rolling,
        settings=inputs.settings,
    )  # fmt: skip
    folder.finish(found.record(), found.plot, lambda: _parts(found, quiet=quiet), as_json=as_json)
    return LIMIT_EXCEEDED if fail and found.verdict == "fail" else DONE


def _parts(found: "Stationary", *, quiet: bool) -> "list[str | Table]":
    parts: list[str | Table] = [
        f"{found.vehicle}, {found.edition}",
        f"verdict: {found.verdict}",
        *(f"  {reason}" for reason in found.reasons),
        "",
        found.table(),
    ]
    if not quiet:
        parts += ["", f"note: wheelsets {'held' if found.held else 'free'} across the track"]
        if not all(v.checked for v in found.values if v.limit is not None):
            parts.append("note: limits not checked against the standard")
    return parts
