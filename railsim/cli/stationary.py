"""``railsim stationary``: stationary tests on twisted and canted track."""

from typing import Any

import click

from railsim.cli import common as cli

FILES = ("stationary.json", "stationary.png")


@click.command()
@click.argument("vehicle")
@cli.option("--cant", "Default: the admissible cant deficiency, m.", "H", float)
@cli.flag("--rolling", "Do not hold the wheelsets across the track.")
@cli.option("--limits", "Limits file, or the name of a shipped one.", "F", default="stationary")
@cli.rails_option
@cli.fail_option
@cli.given_options("creep law and contact")
@cli.output_options("Folder for stationary.json and stationary.png.")
@cli.code_options
def command(
    rolling: bool, limits: str, fail: bool, given: cli.Given, output: cli.Output, **how: Any
) -> int:
    """Compare a vehicle on twisted track and on cant with limits.

    Wheel unloading on the twists of EN 14363, 6.1, with dry friction from both directions; guiding
    force in a level curve of R 150 m over the smallest wheel load on these twists; wheel unloading
    and angle of the floor on a cant equal to the admissible cant deficiency; roll coefficient.

    \b
    Example:
      railsim stationary coach_manchester
      railsim stationary coach_manchester --cant 0.15 --rolling
    """
    from railsim.definitions.loading import load_stationary_limits
    from railsim.studies.stationary import stationary

    body, rails, settings = given.inputs()
    output.reserve(*FILES)
    found = stationary(
        body, rails, load_stationary_limits(limits), held=not rolling, settings=settings, **how
    )
    remarks = [f"wheelsets {'held' if found.held else 'free'} across the track"]
    if not all(v.checked for v in found.values if v.limit is not None):
        remarks.append("limits not checked against the standard")
    remarks += found.remarks
    head = [f"{found.vehicle}, {found.edition}", f"verdict: {found.verdict}"]
    reasons = [f"  {reason}" for reason in found.reasons]
    output.finish(FILES, found, [*head, *reasons, "", found.table()], remarks)
    return cli.LIMIT_EXCEEDED if fail and found.verdict == "fail" else cli.DONE
