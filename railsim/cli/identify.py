"""``railsim identify``: parameters of a vehicle from measured runs."""

import shutil
import sys
from typing import Any

import click

from railsim.cli import common as cli
from railsim.cli.terminal import echo
from railsim.errors import input_error

FILES = ("identified.toml", "identified.json", "report.html", "fits.png", "residuals.png")
KEPT = "evaluations"


@click.command()
@cli.vehicle_argument
@click.argument("measured", nargs=-1, required=True, metavar="MEASURED.toml ...")
@cli.repeated(
    "--parameters -p",
    "Keys of the vehicle or of `track.`; KEY+KEY: one factor; KEY:LOW:HIGH[:SPREAD]: bounds, "
    "standard deviation known before, as factors.",
    "KEY[,KEY...]",
    required=True,
)
@cli.option("--band", "Frequencies that are compared, in Hz.", "LOW:HIGH", default="0.5:30")
@cli.choice("--form", "What is compared.", "history|spectra|sections")
@cli.choice("--loss", "Robust ones weigh outliers less.", "linear|soft_l1|huber|cauchy")
@cli.flag("--fixed-place", "Do not seek the place of the runs on the track.")
@cli.option("--workers", "Processes; by default one for each core.", "N", click.IntRange(1, 256))
@cli.output_options("Folder for results; an interrupted identification is continued from it.")
@cli.code_options
def command(
    vehicle: str,
    measured: tuple[str, ...],
    parameters: tuple[str, ...],
    band: str,
    fixed_place: bool,
    output: cli.Output,
    **how: Any,
) -> None:
    """Identify parameters of a vehicle from measured runs, by least squares.

    The fitted vehicle file extends the original and marks each number with [I].

    \b
    Example:
      railsim identify coach_25t run12.toml -p coil_spring.stiffness.z,bodies.carbody.mass --out fit
    """
    from railsim.identification import identify

    folder, quiet = output.reserve(*FILES, f"{KEPT}/"), output.quiet or output.as_json
    keys = [key.strip() for text in parameters for key in text.split(",") if key.strip()]

    def progress(count: int) -> None:
        if not quiet and sys.stderr.isatty():
            sys.stderr.write(f"\r{count} runs simulated")
        elif not quiet and count % 10 == 0:
            echo(f"{count} runs simulated", err=True)

    try:
        low, high = map(float, band.split(":"))
    except ValueError:
        raise input_error("--band", f"'{band}'", "LOW:HIGH in Hz, such as 0.5:30") from None
    how |= {"band": (low, high), "place": not fixed_place, "folder": folder and folder / KEPT}
    found = identify(vehicle, measured, keys, progress=progress, **how)
    if folder:
        from railsim.plot import validation as plots
        from railsim.report import measured as report

        figures = {"fits": plots.fits(found), "residuals": plots.residual_spectra(found)}
        part = report.identification_part(found.record(), report.as_drawings(figures))
        content = found.record(), report.measured_page([part]), *figures.values()
        output.write_all(dict(zip(FILES[1:], content, strict=True)))
        output.written.append(found.save_vehicle(folder / FILES[0], vehicle, overwrite=True))
        shutil.rmtree(folder / KEPT, ignore_errors=True)
    tables = (found.table(), found.correlation_table(), found.residual_table())
    parts = [part for table in tables for part in ("", table)]
    output.answer(found.record(), [*parts, "", *found.unidentified], found.remarks)
