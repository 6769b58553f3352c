"""``railsim modes``: eigenfrequencies, damping and mode shapes of a vehicle."""

import math
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.analysis import Folder, InputFiles, Output, analysis_options, values_of
from railsim.cli.common import Speed, code_options, linearisation_options, names_of
from railsim.cli.progress import progress_bar
from railsim.errors import Fault, InputError

if TYPE_CHECKING:
    from railsim.definitions.vehicle.definition import Vehicle
    from railsim.linear.modes import Modes, RootLocus

FILES = ("modes.json", "modes.png")
ANIMATION, ALL = "mode.html", "modes.html"
CYCLE = {"frames": 40, "cycles": 1}


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=names_of("vehicle"))
@click.argument("track", metavar="[TRACK]", required=False, shell_complete=names_of("track"))
@click.option(
    "--speed",
    type=Speed(),
    default=20.0,
    show_default=True,
    metavar="V",
    help="Speed in m/s, or with a unit: 72km/h.",
)
@click.option("--speeds", metavar="A:B:N", help="N speeds from A to B: a root locus.")
@click.option(
    "--over",
    metavar="KEY.PATH=A:B:N",
    help="Root locus over a key of the vehicle, track or settings at --speed.",
)
@click.option("--held", is_flag=True, help="Hold the wheelsets.")
@click.option(
    "--hold",
    multiple=True,
    metavar="BODY",
    help="Hold this body in the moving track frame; may be given several times.",
)
@linearisation_options
@click.option("--conicity", type=float, metavar="G", help="Straight cones of this slope as wheels.")
@click.option(
    "--radius",
    type=float,
    default=math.inf,
    metavar="R",
    help="Radius of the track in m, positive to the right; default straight.",
)
@click.option("--cant", type=float, default=0.0, metavar="H", help="Cant of the track in m.")
@click.option(
    "--animate",
    metavar="NAME",
    help="Begin the animated page of --out with this mode, and call it mode.html.",
)
@analysis_options("modes.json, modes.png and, at one speed, modes.html with all modes animated")
@code_options
def command(
    files: InputFiles,
    output: Output,
    speed: float,
    speeds: str | None,
    over: str | None,
    animate: str | None,
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
    """  # noqa: D301 - click reads the escape
    from railsim.linear.modes import Modes, RootLocus, modes, root_locus

    if speeds is not None and over is not None:
        raise InputError([Fault("--over", "", "given together with --speeds", "one of the two")])
    inputs = files.load()
    if animate is not None and (output.out is None or speeds is not None or over is not None):
        wrong = "given without --out" if output.out is None else "given with --speeds or --over"
        raise InputError([Fault("--animate", "", wrong, "one speed, and --out DIR")])
    names = FILES if animate is None else (*FILES, ANIMATION)
    if speeds is None and over is None and animate is None:
        names = (*FILES, ALL)
    folder = Folder(output.out, names, output.overwrite)
    with progress_bar("modes", quiet=output.quiet):
        found: Modes | RootLocus
        if over is not None:
            found = _over(files, over, speed, how)
        elif speeds is not None:
            how.update(settings=inputs.settings, speeds=values_of(speeds, "--speeds"))
            found = root_locus(inputs.vehicle, inputs.track, **how)
        else:
            how.update(settings=inputs.settings, speed=speed)
            found = modes(inputs.vehicle, inputs.track, **how)
    if folder.path is not None and isinstance(found, Modes):
        page = folder.path / (ALL if animate is None else ANIMATION)
        folder.written += _animated(inputs.vehicle, found, animate, page)

    def parts() -> list[Any]:
        remarks = [f"remark: {remark}" for remark in found.remarks]
        return [found.table(), *found.notes, *remarks]

    folder.finish(found.record(), found.plot, parts, as_json=output.as_json)


def _animated(vehicle: "Vehicle", found: "Modes", name: str | None, page: Path) -> list[Path]:
    """Write the oscillations as a page that shows one of them; nothing where there is none."""
    from railsim.animation import mode_scene, write_page
    from railsim.animation.scene import chosen_mode
    from railsim.files.access import make_folder
    from railsim.linear.modes import SHOWN

    records = [m.record() for m in found.oscillations if m.natural_frequency <= SHOWN]
    first = found.least_damped.name if found.least_damped else ""
    scenes = {}
    if name is not None:
        chosen = chosen_mode(found.record()["modes"], name, "--animate")
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


def _over(files: InputFiles, over: str, speed: float, how: dict[str, Any]) -> "RootLocus":
    """Root locus over one key of the files."""
    from railsim.linear.modes import parameter_locus
    from railsim.linear.vehicle import Contact, LinearVehicle, smooth_law

    key, _, text = over.partition("=")
    contact = Contact(*(how.pop(name) for name in ("linearisation", "amplitude", "conicity")))

    def prepared(value: float) -> LinearVehicle:
        here = files.load([f"{key}={value!r}"])
        law = smooth_law(here.settings)
        return LinearVehicle(here.vehicle, here.track, contact=contact, settings=law, **how)

    return parameter_locus(prepared, key, values_of(text, "--over"), speed)
