"""``railsim export``: a result in the files of other programs."""

from pathlib import Path

import click

from railsim.cli.common import output_options, report_file
from railsim.files import check_file


@click.command()
@click.argument("file", metavar="R.h5")
@click.option("--out", required=True, metavar="F", help="File: .csv, .mat or .parquet.")
@output_options
def command(file: str, out: str, overwrite: bool, as_json: bool, quiet: bool) -> None:
    """Write a result as CSV, for MATLAB and Octave, or as Parquet.

    CSV and Parquet have a column for each wheel, body or sensor of each quantity; a MATLAB file
    holds the arrays with their dimensions.  All numbers are SI.

    \b
    Example:
      railsim export run.h5 --out run.mat
    """  # noqa: D301 - click reads the escape
    from railsim.result import open_run
    from railsim.result.export import ENDINGS, export

    check_file(Path(out), overwrite=overwrite, endings=ENDINGS)
    path = export(open_run(file), out, overwrite=overwrite)
    report_file(path, as_json=as_json, quiet=quiet)
