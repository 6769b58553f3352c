"""``railsim irregularity``: the track from what a vehicle in service reads."""

from typing import Any

import click

from railsim.cli import common as cli
from railsim.errors import input_error

FILES = ("irregularity.json", "irregularity.png")


@click.command()
@click.argument("measured", shell_complete=cli.names_of("measurement"))
@cli.option("--vehicle", "The vehicle that measured; default as MEASURED says.", "F")
@cli.rails_option
@cli.option("--spectrum", "Assumed spectrum of the track.", "NAME", default="erri_b176_low")
@cli.option("--scale", "Factor on it.", "X", float, default=1.0)
@cli.option(
    "--wavelengths", "Shortest and longest in m.", "A B", float, nargs=2, default=(3.0, 100.0)
)
@cli.option(
    "--noise", "rms of an accelerometer in m/s2, unless MEASURED has it.", "A", float, default=0.05
)
@cli.option("--simulations", "Most runs per 2 km; 0: linear estimate.", "N", cli.FROM_0, default=25)
@cli.set_option
@cli.output_options("Folder for recording, track, estimates, forces.")
@cli.code_options
def command(
    measured: str,
    vehicle: str | None,
    track: str | None,
    simulations: int,
    assignments: tuple[str, ...],
    output: cli.Output,
    **given: Any,
) -> None:
    """Irregularities of a track and wheel forces from accelerations of a vehicle.

    MEASURED is a measurement file with channels sensor_acceleration:POINT:AXIS of axleboxes,
    frames or floor.  A smoother with the linearised vehicle gives alignment, level and cross level
    with the standard deviation of their errors, in D1 and D2 of EN 13848, and Q, Y and sum Y;
    simulated runs over the estimate correct it for the non-linear contact.
    Wavelengths that the channels do not see are named and not filled in.

    \b
    Example:
      railsim irregularity run.toml --vehicle coach_25t --out track
      railsim info track/track.toml
    """
    from railsim.definitions.loading import load_track, load_vehicle
    from railsim.measurement import load_measurement
    from railsim.observation import Assumed, irregularity
    from railsim.observation.estimate import FILES as WRITTEN
    from railsim.plot.observation import irregularity_figure

    assumed = Assumed(**given)
    assumed.check()
    folder = output.reserve(*FILES, *WRITTEN)
    measurement = load_measurement(measured, assignments)
    how = measurement.definition
    name = vehicle or how.vehicle
    if name is None:
        raise input_error("--vehicle", "not given", "the vehicle that measured")
    load = [f"load={how.load}"] if how.load else []
    coach, rails = load_vehicle(name, load), load_track(track or how.track or "straight")
    with output.progress(measurement.name) as progress:
        more: Any = {"assumed": assumed, "simulations": simulations, "progress": progress}
        found = irregularity(measurement, coach, rails, **more)
    if folder is not None:
        output.written += found.write(folder)
    record = found.record()
    output.write_all({FILES[0]: record, FILES[1]: lambda: irregularity_figure(found)})
    parts: list[Any] = [found.table(), "", found.forces_table(), "", *found.notes]
    output.answer(record, parts, found.remarks)
