"""``railsim modes``: eigenfrequencies, damping and mode shapes of a vehicle."""

import math
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    echo,
    json_option,
    linearisation_options,
    load_option,
    names_of,
    overwrite_option,
    print_json,
    quiet_option,
    set_option,
    table,
    with_load,
)
from railsim.cli.progress import progress_bar

if TYPE_CHECKING:
    from railsim.animation import Scene
    from railsim.cli.analysis import Folder, Inputs
    from railsim.linear.modes import Modes, RootLocus

SHOWN = 50.0  # Hz, up to which modes are printed
FILES = ("modes.json", "modes.png")
ANIMATION = "mode.html"


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=names_of("vehicle"))
@click.argument("track", metavar="TRACK", required=False, shell_complete=names_of("track"))
@click.option(
    "--speed", type=float, default=20.0, show_default=True, metavar="V", help="Speed in m/s."
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
@click.option("--out", metavar="DIR", help="Folder for modes.json and modes.png.")
@click.option(
    "--animate", metavar="NAME", help="Write this mode to --out as an animated page, mode.html."
)
@click.option("--settings", metavar="F", help="Settings file: creep law and contact.")
@load_option
@set_option
@overwrite_option
@json_option
@quiet_option
def command(
    vehicle: str,
    track: str | None,
    speed: float,
    speeds: str | None,
    over: str | None,
    out: str | None,
    animate: str | None,
    settings: str | None,
    load: str | None,
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
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
    from railsim.cli.analysis import Folder, load_inputs, values_of
    from railsim.errors import Fault, InputError
    from railsim.linear.modes import modes, root_locus

    if speeds is not None and over is not None:
        raise InputError([Fault("--over", "", "given together with --speeds", "one of the two")])
    assignments = with_load(assignments, load, "vehicle.")
    inputs = load_inputs(vehicle, track, settings, assignments)
    if animate is not None and (out is None or speeds is not None or over is not None):
        wrong = "given without --out" if out is None else "given with --speeds or --over"
        raise InputError([Fault("--animate", "", wrong, "one speed, and --out DIR")])
    folder = Folder(out, FILES if animate is None else (*FILES, ANIMATION), overwrite)
    with progress_bar("modes", quiet=quiet):
        if over is not None:
            found: Modes | RootLocus = _over(
                inputs, over, speed, vehicle, track, settings, assignments, how
            )
        elif speeds is not None:
            found = root_locus(
                inputs.vehicle,
                inputs.track,
                settings=inputs.settings,
                speeds=values_of(speeds, "--speeds"),
                **how,
            )
        else:
            found = modes(
                inputs.vehicle, inputs.track, speed=speed, settings=inputs.settings, **how
            )
    scene = _scene(inputs, found, animate)
    _write(folder, found, inputs)
    if scene is not None and folder.path is not None:
        from railsim.animation import write_page

        folder.written.append(write_page(scene, folder.path / ANIMATION, overwrite=True))
    if as_json:
        print_json(found.record())
        return
    echo("\n".join(_lines(found)))
    folder.tell()


def _over(
    inputs: "Inputs",
    over: str,
    speed: float,
    vehicle: str,
    track: str | None,
    settings: str | None,
    assignments: tuple[str, ...],
    how: dict[str, Any],
) -> "RootLocus":
    """Root locus over one key of the files."""
    from railsim.cli.analysis import load_inputs, values_of
    from railsim.linear.modes import parameter_locus
    from railsim.linear.vehicle import AMPLITUDE, Contact, LinearVehicle, smooth_law

    key, _, text = over.partition("=")
    options = dict(how)
    contact = Contact(
        options.pop("linearisation"), options.pop("amplitude", AMPLITUDE), options.pop("conicity")
    )

    def prepared(value: float) -> LinearVehicle:
        here = load_inputs(vehicle, track, settings, [*assignments, f"{key}={value!r}"])
        law = smooth_law(here.settings)
        return LinearVehicle(here.vehicle, here.track, contact=contact, settings=law, **options)

    return parameter_locus(prepared, key, values_of(text, "--over"), speed)


def _scene(inputs: "Inputs", found: "Modes | RootLocus", name: str | None) -> "Scene | None":
    """What ``--animate`` shows; refused where there is no such mode."""
    from railsim.linear.modes import Modes

    if name is None or not isinstance(found, Modes):
        return None
    from railsim.animation import mode_scene
    from railsim.animation.scene import chosen_mode

    return mode_scene(inputs.vehicle, chosen_mode(found.record()["modes"], name, "--animate"))


def _write(folder: "Folder", found: "Modes | RootLocus", inputs: "Inputs") -> None:
    if folder.path is None:
        return
    from railsim.linear.modes import RootLocus
    from railsim.plot.modes import locus_figure, modes_figure

    folder.write_json("modes.json", found.record())
    if isinstance(found, RootLocus):
        words = _contact_words(found.sets[0])
        figure = locus_figure(found, f"{inputs.vehicle.name}: {words}")
    else:
        words = f"{_contact_words(found)}, {found.speed:g} m/s"
        figure = modes_figure(found, f"{inputs.vehicle.name}: {words}")
    folder.write_picture("modes.png", figure)


def _contact_words(found: "Modes") -> str:
    contact = found.contact
    words = f"contact {contact.linearisation}"
    if contact.linearisation == "harmonic":
        words += f" {1e3 * contact.amplitude:g} mm"
    if contact.conicity is not None:
        words += f", cones of {contact.conicity:g}"
    return words


def _lines(found: "Modes | RootLocus") -> list[str]:
    from railsim.linear.modes import RootLocus

    if isinstance(found, RootLocus):
        return _locus_lines(found)
    rows = []
    for mode in found.oscillations:
        if mode.natural_frequency > SHOWN:
            continue
        shares = [f"{name} {100 * share:.0f} %" for name, share in mode.participation.items()]
        rows.append(
            [
                mode.name,
                f"{mode.frequency:.3f}",
                f"{mode.natural_frequency:.3f}",
                f"{100 * mode.damping_ratio:.2f}",
                ", ".join(shares[:3]),
            ]
        )
    header = ["mode", "f (Hz)", "f0 (Hz)", "damping (%)", "kinetic energy"]
    body = table(header[:4], [row[:4] for row in rows])
    lines = [
        f"{line}  {row}" for line, row in zip(body, [header[4], *(r[4] for r in rows)], strict=True)
    ]
    above = sum(mode.natural_frequency > SHOWN for mode in found.oscillations)
    still = sum(mode.exists and not mode.oscillates for mode in found.modes)
    head = f"{found.speed:g} m/s, {_contact_words(found)}"
    rest = f"{above} oscillations above {SHOWN:g} Hz and {still} modes that do not oscillate"
    return [head, *lines, f"{rest}: --json", *(f"remark: {remark}" for remark in found.remarks)]


def _locus_lines(found: "RootLocus") -> list[str]:
    """Least damped oscillation at every value."""
    rows = []
    for value, modes in zip(found.values, found.sets, strict=True):
        least = modes.least_damped
        if least is None:
            rows.append([f"{value:g}", "no oscillation", "", ""])
            continue
        name = found.names[modes.modes.index(least)]
        rows.append(
            [f"{value:g}", name, f"{least.frequency:.3f}", f"{100 * least.damping_ratio:.2f}"]
        )
    first = "speed (m/s)" if found.key == "speed" else found.key
    words = f"Least damped oscillation between 0.3 and 40 Hz, {_contact_words(found.sets[0])}"
    remarks = dict.fromkeys(remark for modes in found.sets for remark in modes.remarks)
    return [
        words,
        *table([first, "mode", "f (Hz)", "damping (%)"], rows, numbers=2),
        *(f"remark: {remark}" for remark in remarks),
    ]
