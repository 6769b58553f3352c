"""``railsim export``: a result in the files of other programs."""

from typing import Any

import click

from railsim.cli import common as cli


@click.command()
@click.argument("file", metavar="R.h5")
@click.argument("quantities", nargs=-1, metavar="[QUANTITY]...")
@cli.option("--out", "File: .csv, .mat or .parquet.", "F", required=True)
@cli.option("--between", "Section of the track, m.", "A B", float, nargs=2)
@cli.option("--rate", "Values per second, low-pass filtered.", "N", float)
@cli.choice("--units", "SI, or those of tables and plots: kN, mm.", "si|shown")
@cli.output_options()
def command(
    file: str, quantities: tuple[str, ...], units: str, output: cli.Output, **how: Any
) -> None:
    """Write a result, or some of its quantities, as CSV, for MATLAB and Octave, or as Parquet.

    CSV and Parquet have a column for each wheel, body or sensor of each quantity; a MATLAB file
    holds the arrays with their dimensions.  Of CSV and Parquet a QUANTITY may select wheels, bodies
    and components, as in `railsim plot`: Y:1:left.

    \b
    Example:
      railsim export run.h5 --out run.mat
      railsim export run.h5 Q Y --between 300 400 --rate 50 --units shown --out curve.csv
    """
    from railsim.result import open_run
    from railsim.result.export import ENDINGS, export, selected

    out = output.file("", ENDINGS)
    part = selected(open_run(file), quantities, shown_units=units == "shown", **how)
    output.wrote(export(part, out, quantities, overwrite=output.overwrite))
