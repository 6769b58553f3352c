"""``railsim identify``: parameters of a vehicle from measured runs."""

import shutil
import sys
from pathlib import Path

import click

from railsim.cli.common import code_options, echo, names_of, output_options, print_json, show
from railsim.errors import Fault, InputError
from railsim.files.access import check_folder, make_folder, write_folder

FILES = ("identified.toml", "identified.json", "report.html", "fits.png", "residuals.png")
KEPT = "evaluations"


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=names_of("vehicle"))
@click.argument("measured", nargs=-1, required=True, metavar="MEASURED.toml ...")
@click.option(
    "--parameters",
    "-p",
    multiple=True,
    required=True,
    metavar="KEY[,KEY...]",
    help="Keys of the vehicle or of `track.`; KEY+KEY: one factor for both; "
    "KEY:LOW:HIGH[:SPREAD]: bounds and standard deviation known before, as factors.",
)
@click.option(
    "--band",
    default="0.5:30",
    show_default=True,
    metavar="LOW:HIGH",
    help="Frequencies that are compared, in Hz.",
)
@click.option(
    "--form",
    type=click.Choice(["history", "spectra", "sections"]),
    default="history",
    show_default=True,
    help="What is compared.",
)
@click.option(
    "--loss",
    type=click.Choice(["linear", "soft_l1", "huber", "cauchy"]),
    default="linear",
    show_default=True,
    help="Robust ones weigh outliers less.",
)
@click.option("--fixed-place", is_flag=True, help="Do not seek the place of the runs on the track.")
@click.option(
    "--workers",
    type=click.IntRange(1, 256),
    metavar="N",
    help="Processes; by default one for each core.",
)
@click.option(
    "--out",
    metavar="DIR",
    help="Folder for vehicle file, JSON, pictures and a page; an "
    "interrupted identification goes on from what it has kept there.",
)
@output_options
@code_options
def command(
    vehicle: str,
    measured: tuple[str, ...],
    parameters: tuple[str, ...],
    band: str,
    form: str,
    loss: str,
    fixed_place: bool,
    workers: int | None,
    out: str | None,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Identify parameters of a vehicle from measured runs, by least squares.

    The fitted vehicle file extends the original with the letter [I] for each number.

    \b
    Example:
      railsim identify coach_25t run12.toml -p coil_spring.stiffness.z,bodies.carbody.mass --out fit
    """  # noqa: D301 - click reads the escape
    from railsim.identification import identify

    folder = Path(out) if out else None
    if folder:
        check_folder(folder, FILES, overwrite=overwrite)
        make_folder(folder)
    keys = [key.strip() for text in parameters for key in text.split(",") if key.strip()]

    def progress(count: int) -> None:
        if not quiet and not as_json and sys.stderr.isatty():
            sys.stderr.write(f"\r{count} runs simulated")

    found = identify(
        vehicle,
        measured,
        keys,
        band=_band(band),
        form=form,
        loss=loss,
        place=not fixed_place,
        workers=workers,
        folder=folder and folder / KEPT,
        progress=progress,
    )
    if as_json:
        print_json(found.record())
    else:
        echo()
        show(found.table(), "", found.correlation_table(), "", found.residual_table(), "")
        for words in found.unidentified:
            echo(words)
        for remark in found.remarks if not quiet else ():
            echo(f"note: {remark}")
    if folder:
        import json

        from railsim.cli.common import plain
        from railsim.report.document import as_png
        from railsim.report.measured import identification_figures, identification_page

        figures = identification_figures(found)
        content = (
            json.dumps(plain(found.record()), indent=2).encode(),
            identification_page(found).encode(),
            as_png(figures["fits"]),
            as_png(figures["residuals"]),
        )
        paths = write_folder(folder, dict(zip(FILES[1:], content, strict=True)), overwrite=True)
        paths.insert(0, found.save_vehicle(folder / FILES[0], vehicle, overwrite=True))
        shutil.rmtree(folder / KEPT, ignore_errors=True)
        for path in paths:
            if not quiet and not as_json:
                echo(str(path))


def _band(text: str) -> tuple[float, float]:
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        raise InputError(
            [Fault("--band", "", f"'{text}'", "LOW:HIGH in Hz, such as 0.5:30")]
        ) from None
    return low, high
