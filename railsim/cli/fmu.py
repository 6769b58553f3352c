"""``railsim fmu``: a vehicle on its track as a unit of FMI 3.0 for other programs."""

from typing import Any

import click

from railsim.cli import common as cli


@click.command()
@cli.vehicle_argument
@cli.track_argument
@cli.option("--speed", "Speed in m/s, or with a unit: 72km/h.", "V", cli.as_speed)
@cli.option("--inputs", "Actuators that are commanded; default: all without a controller.", "A,B")
@cli.option("--outputs", "Quantities and signals; default Q, Y, lateral.", "X,Y")
@cli.option("--out", "The unit.", "F.fmu", required=True)
@cli.extent_options
@cli.given_options()
@cli.output_options()
@cli.code_options
def command(
    speed: float | None,
    inputs: str | None,
    outputs: str | None,
    given: cli.Given,
    output: cli.Output,
    **extent: Any,
) -> None:
    """Write a vehicle on its track as a unit for co-simulation by FMI 3.0.

    The program that calls the unit needs a Python that has railsim.  Inputs are commands of the
    vehicle's actuators; outputs are signals, and quantities with the labels wanted: Q, Y:1:left.

    \b
    Example:
      railsim fmu coach_manchester curve_r250 --speed 20 --out coach.fmu
      railsim fmu active.toml straight --speed 50 --inputs push --outputs Q,sum_Y:1 --out a.fmu
    """
    from railsim.fmi import fmu
    from railsim.studies.case import load_case

    out = output.file("", (".fmu",))
    extent["start"] = extent["start"] or 0.0
    case = load_case(given.run(speed, **extent))
    named = {"inputs": inputs, "outputs": outputs}
    how: dict[str, Any] = {n: text.split(",") for n, text in named.items() if text is not None}
    how |= {"speed": case.speed, "settings": case.settings, **extent}
    output.wrote(fmu(case.vehicle, case.track, out, overwrite=output.overwrite, **how))
