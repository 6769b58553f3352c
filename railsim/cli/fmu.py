"""``railsim fmu``: a vehicle on its track as a unit of FMI 3.0 for other programs."""

from typing import Any

import click

from railsim.cli.common import (
    Given,
    Output,
    as_speed,
    code_options,
    extent_options,
    given_options,
    option,
    output_options,
    track_argument,
    vehicle_argument,
)


@click.command()
@vehicle_argument
@track_argument
@option("--speed", "Speed in m/s, or with a unit: 72km/h.", "V", as_speed)
@option("--inputs", "Actuators that are commanded; default all.", "A,B")
@option("--outputs", "Quantities and signals; default Q, Y, lateral.", "X,Y")
@option("--out", "The unit.", "F.fmu", required=True)
@extent_options
@given_options()
@output_options()
@code_options
def command(
    vehicle: str,
    track: str,
    speed: float | None,
    inputs: str | None,
    outputs: str | None,
    given: Given,
    output: Output,
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
    from railsim.errors import argument_error
    from railsim.fmi import OUTPUTS, fmu
    from railsim.studies.case import load_case
    from railsim.studies.spec import RunSpec

    out = output.file("", (".fmu",))
    extent["start"] = extent["start"] or 0.0
    assignments = given.overrides
    case = load_case(
        RunSpec(vehicle, track, speed, settings=given.settings, assignments=assignments, **extent)
    )
    try:
        path = fmu(
            case.vehicle,
            case.track,
            out,
            inputs=None if inputs is None else inputs.split(","),
            outputs=OUTPUTS if outputs is None else outputs.split(","),
            overwrite=output.overwrite,
            speed=case.speed,
            settings=case.settings,
            **extent,
        )
    except ImportError as error:
        raise argument_error("fmu", str(error)) from None
    output.wrote(path)
