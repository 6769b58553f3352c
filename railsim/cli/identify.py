"""``railsim identify``: parameters of a vehicle from measured runs."""

import shutil
import sys
from typing import Any

import click

from railsim.cli.common import Output, code_options, flag, option, output_options, vehicle_argument
from railsim.errors import input_error
from railsim.files.access import make_folder

FILES = ("identified.toml", "identified.json", "report.html", "fits.png", "residuals.png")
KEPT = "evaluations"


@click.command()
@vehicle_argument
@click.argument("measured", nargs=-1, required=True, metavar="MEASURED.toml ...")
@option(
    "--parameters -p",
    "Keys of the vehicle or of `track.`; KEY+KEY: one factor for both; "
    "KEY:LOW:HIGH[:SPREAD]: bounds and standard deviation known before, as factors.",
    "KEY[,KEY...]",
    multiple=True,
    required=True,
)
@option("--band", "Frequencies that are compared, in Hz.", "LOW:HIGH", default="0.5:30")
@option(
    "--form",
    "What is compared.",
    kind=click.Choice(["history", "spectra", "sections"]),
    default="history",
)
@option(
    "--loss",
    "Robust ones weigh outliers less.",
    kind=click.Choice(["linear", "soft_l1", "huber", "cauchy"]),
    default="linear",
)
@flag("--fixed-place", "Do not seek the place of the runs on the track.")
@option("--workers", "Processes; by default one for each core.", "N", click.IntRange(1, 256))
@output_options(
    "Folder for vehicle file, JSON, pictures and a page; an interrupted identification goes on "
    "from what it has kept there."
)
@code_options
def command(
    vehicle: str,
    measured: tuple[str, ...],
    parameters: tuple[str, ...],
    band: str,
    fixed_place: bool,
    output: Output,
    **how: Any,
) -> None:
    """Identify parameters of a vehicle from measured runs, by least squares.

    The fitted vehicle file extends the original with the letter [I] for each number.

    \b
    Example:
      railsim identify coach_25t run12.toml -p coil_spring.stiffness.z,bodies.carbody.mass --out fit
    """
    from railsim.identification import identify

    folder, quiet = output.reserve(*FILES), output.quiet or output.as_json
    if folder:
        make_folder(folder)
    keys = [key.strip() for text in parameters for key in text.split(",") if key.strip()]

    def progress(count: int) -> None:
        if not quiet and sys.stderr.isatty():
            sys.stderr.write(f"\r{count} runs simulated")

    found = identify(
        vehicle,
        measured,
        keys,
        band=_band(band),
        place=not fixed_place,
        folder=folder and folder / KEPT,
        progress=progress,
        **how,
    )
    if folder:
        from railsim.report.measured import identification_figures, identification_page

        figures = identification_figures(found)
        content = (
            found.record(),
            identification_page(found),
            figures["fits"],
            figures["residuals"],
        )
        output.written.append(found.save_vehicle(folder / FILES[0], vehicle, overwrite=True))
        for name, one in zip(FILES[1:], content, strict=True):
            output.write(name, one)
        shutil.rmtree(folder / KEPT, ignore_errors=True)
    tables = (found.table(), found.correlation_table(), found.residual_table())
    parts = [part for table in tables for part in ("", table)]
    output.answer(found.record(), [*parts, "", *found.unidentified], found.remarks)


def _band(text: str) -> tuple[float, float]:
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        raise input_error("--band", f"'{text}'", "LOW:HIGH in Hz, such as 0.5:30") from None
    return low, high
