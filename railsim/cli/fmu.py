"""``railsim fmu``: a vehicle on its track as a unit of FMI 3.0 for other programs."""

from pathlib import Path

import click

from railsim.cli.common import (
    Speed,
    code_options,
    load_option,
    names_of,
    output_options,
    report_file,
    set_option,
    with_load,
)


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=names_of("vehicle"))
@click.argument("track", metavar="TRACK", shell_complete=names_of("track"))
@click.option("--speed", type=Speed(), metavar="V", help="Speed in m/s, or with a unit: 72km/h.")
@click.option("--inputs", metavar="A,B", help="Actuators that are commanded; default all.")
@click.option("--outputs", metavar="X,Y", help="Quantities and signals; default Q, Y, lateral.")
@click.option("--out", required=True, metavar="F.fmu", help="The unit.")
@click.option("--start", type=float, default=0.0, metavar="S", help="Start in m along the track.")
@click.option("--duration", type=float, metavar="T", help="Length of the run in s.")
@click.option("--until", type=float, metavar="S", help="End of the run in m along the track.")
@load_option
@click.option("--settings", metavar="F", help="Settings file.")
@set_option
@output_options
@code_options
def command(
    vehicle: str,
    track: str,
    speed: float | None,
    inputs: str | None,
    outputs: str | None,
    out: str,
    start: float,
    duration: float | None,
    until: float | None,
    load: str | None,
    settings: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Write a vehicle on its track as a unit for co-simulation by FMI 3.0.

    The program that calls the unit needs a Python that has railsim.  Inputs are commands of the
    vehicle's actuators; outputs are signals, and quantities with the labels wanted: Q, Y:1:left.

    \b
    Example:
      railsim fmu coach_manchester curve_r250 --speed 20 --out coach.fmu
      railsim fmu active.toml straight --speed 50 --inputs push --outputs Q,sum_Y:1 --out a.fmu
    """  # noqa: D301 - click reads the escape
    from railsim.errors import InputError, argument_fault
    from railsim.files.access import check_file
    from railsim.fmi import OUTPUTS, fmu
    from railsim.studies.case import load_case
    from railsim.studies.spec import RunSpec

    check_file(Path(out), overwrite=overwrite, endings=(".fmu",))
    assignments = with_load(assignments, load, "vehicle.")
    spec = RunSpec(
        vehicle, track, speed, settings=settings, duration=duration, until=until,
        assignments=assignments, start=start,
    )  # fmt: skip
    case = load_case(spec)
    try:
        path = fmu(
            case.vehicle,
            case.track,
            out,
            inputs=None if inputs is None else inputs.split(","),
            outputs=OUTPUTS if outputs is None else outputs.split(","),
            overwrite=overwrite,
            speed=case.speed,
            settings=case.settings,
            start=start,
            duration=duration,
            until=until,
        )
    except ImportError as error:
        raise InputError([argument_fault("fmu", "", str(error), "")]) from None
    report_file(Path(path), as_json=as_json, quiet=quiet)
