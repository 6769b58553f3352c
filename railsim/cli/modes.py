"""``railsim modes``: eigenfrequencies, damping and mode shapes of a vehicle."""

import math
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.errors import InputError, input_error
from railsim.files.access import make_folder

if TYPE_CHECKING:
    from railsim.definitions import Vehicle
    from railsim.linear.modes import Modes, RootLocus

FILES = ("modes.json", "modes.png")
ANIMATION, ALL = "mode.html", "modes.html"
CYCLE = {"frames": 40, "cycles": 1}
SPEED = 20.0  # m/s, unless one or several are given


@click.command()
@cli.vehicle_argument
@cli.optional_track
@cli.option("--speed", f"In m/s, or with a unit: 72km/h; default {SPEED:g}.", "V", cli.as_speed)
@cli.values("--speeds", "N speeds from A to B: a root locus.", "A:B:N")
@cli.option("--over", "Root locus over a key of the input at --speed.", "KEY.PATH=A:B:N")
@cli.flag("--held", "Hold the wheelsets.")
@cli.repeated("--hold", "Hold this body in the moving track frame; may be repeated.", "BODY")
@cli.linearisation_options
@cli.option("--conicity", "Straight cones of this slope as wheels.", "G", float)
@cli.option("--radius", "Radius in m, positive to the right; default straight.", "R", float)
@cli.option("--cant", "In m, positive: left rail higher.", "H", float, default=0.0)
@cli.option("--animate", "Begin the page of --out with this mode, as mode.html.", "NAME")
@cli.given_options("creep law and contact")
@cli.output_options("Folder for modes.json, modes.png and, at one speed, modes.html, animated.")
@cli.code_options
def command(
    speed: float | None,
    speeds: list[float] | None,
    over: str | None,
    animate: str | None,
    given: cli.Given,
    output: cli.Output,
    **how: Any,
) -> None:
    """Compute the modes of a vehicle in steady rolling.

    The equations of the time-domain simulation are linearised about steady rolling on straight or
    circular track; rails, gauge, friction and support are those of TRACK (default: straight).
    Paths of --set and --over begin with vehicle., track. or settings.

    \b
    Example:
      railsim modes coach_manchester --speed 30
      railsim modes coach_manchester --speeds 10:80:36 --linearisation harmonic --out modes
      railsim modes coach_manchester --speed 40 --animate "front hunting" --out modes
      railsim modes coach_manchester --speed 40 --over track.friction=0.1:0.6:11
    """
    from railsim.linear.modes import Modes, RootLocus, modes, root_locus

    if speeds is not None and (over is not None or speed is not None):
        option = "--speed" if over is None else "--over"
        raise input_error(option, "given together with --speeds", "one of the two")
    speed = SPEED if speed is None else speed
    cli.goes_with("--linearisation harmonic", how["linearisation"] == "harmonic", "amplitude")
    coach, rails, settings = given.inputs()
    if animate is not None and (output.out is None or speeds is not None or over is not None):
        wrong = "given without --out" if output.out is None else "given with --speeds or --over"
        raise input_error("--animate", wrong, "one speed, and --out DIR")
    page = ALL if animate is None else ANIMATION
    folder = output.reserve(*FILES, *[page] * (speeds is None and over is None))
    how["radius"] = math.inf if how["radius"] is None else how["radius"]
    with output.progress("modes"):
        found: Modes | RootLocus
        if over is not None:
            found = _locus_over(given, over, speed, how)
        elif speeds is not None:
            found = root_locus(coach, rails, settings=settings, speeds=speeds, **how)
        else:
            found = modes(coach, rails, settings=settings, speed=speed, **how)
    if folder is not None and isinstance(found, Modes):
        output.written += _animate(coach, found, animate, folder / page)
    output.finish(FILES, found, [found.table(), *found.notes], found.remarks, vehicle=given.vehicle)


def _animate(vehicle: "Vehicle", modes: "Modes", name: str | None, page: Path) -> list[Path]:
    """Write the oscillations as a page that shows one of them; nothing where there is none."""
    from railsim.animation import mode_scene, write_page
    from railsim.animation.scene import chosen_mode
    from railsim.linear.modes import SHOWN

    records = [m.record() for m in modes.oscillations if m.natural_frequency <= SHOWN]
    first = modes.least_damped.name if modes.least_damped else ""
    scenes = {}
    if name is not None:
        chosen = chosen_mode(modes.record()["modes"], name, "--animate")
        first = str(chosen["name"])
        scenes[first] = mode_scene(vehicle, chosen, **CYCLE)
    for record in records:
        with suppress(InputError):  # where nothing moves that is drawn
            scenes[record["name"]] = mode_scene(vehicle, record, **CYCLE)
    if not scenes:
        return []
    make_folder(page.parent)
    scene = scenes.get(first) or next(iter(scenes.values()))
    return [write_page(scene, page, modes=list(scenes.values()), overwrite=True)]


def _locus_over(given: cli.Given, over: str, speed: float, how: dict[str, Any]) -> "RootLocus":
    from railsim.definitions.units_of_keys import unit_of_input
    from railsim.linear.modes import parameter_locus
    from railsim.linear.vehicle import Contact, LinearVehicle, smooth_law

    key, _, text = over.partition("=")
    contact = Contact(*(how.pop(name) for name in ("linearisation", "amplitude", "conicity")))

    @cache
    def inputs(value: float) -> cli.Inputs:
        return given.inputs([f"{key}={value!r}"])

    def linear_vehicle(value: float) -> LinearVehicle:
        coach, rails, settings = inputs(value)
        return LinearVehicle(coach, rails, contact=contact, settings=smooth_law(settings), **how)

    values = cli.values_of(text, "--over")
    for value in values:  # all are looked at before the first is computed
        inputs(value)
    return parameter_locus(linear_vehicle, key, values, speed, unit_of_input(given.inputs(), key))
