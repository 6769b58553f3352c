"""``railsim report``: one self-contained page about results or studies."""

import click

from railsim.cli import common as cli


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="DIR_OR_FILES...")
@cli.option("--out", "Page.", "F.html", default="report.html")
@cli.option("--title", "Title; by default the names of what is reported.", "TEXT")
@cli.option("--curves", "Runs with curves, largest first, 16 at most.", "N", int, default=8)
@cli.output_options()
def command(files: tuple[str, ...], title: str, curves: int, output: cli.Output) -> None:
    """Write one self-contained page about results, studies, comparisons with tests.

    Inputs, peaks, values against limits, curves to zoom, spread over the varied parameters of a
    study, comparison with published values, failures and remarks; folders that `validate-model`,
    `identify`, `wear` and `rail-wear` have written are sections of it.  The page needs no network;
    it can be sent and printed.

    \b
    Example:
      railsim report curves --out report.html
      railsim report manchester.h5 flexicoil.h5 --out coaches.html --overwrite
    """
    from railsim.report.write import write_report

    path = write_report(
        files, str(output.out), title=title, curves=curves, overwrite=output.overwrite
    )
    output.wrote(path)
