"""``railsim bench``: the runtime benchmark on this machine."""

import click

from railsim.cli.common import echo, json_option, print_json, show
from railsim.cli.progress import progress_bar


@click.command()
@click.option(
    "--quick", is_flag=True, help="Three runs instead of seven, no start with empty caches."
)
@json_option
@click.option("--quiet", is_flag=True, help="No progress bar.")
def command(quick: bool, as_json: bool, quiet: bool) -> None:
    """Measure the speed of railsim on this machine, and the error at that speed.

    The study's runs in multiples of real time with their errors against RK4 at 0.125 ms; the parts
    of the right-hand side; FASTSIM over its grid; many runs per call; one core and two; start-up,
    whole commands and memory.  Takes a few minutes.  Other programs that run at the same time
    falsify the wall times.

    \b
    Example:
      railsim bench
      railsim bench --quick --json > bench.json
    """  # noqa: D301 - click reads the escape
    from railsim.bench.report import FULL, QUICK, benchmark, tables
    from railsim.table import Column, Table

    with progress_bar("bench", quiet=quiet) as progress:
        found = benchmark(QUICK if quick else FULL, progress)
    if as_json:
        print_json(found)
        return
    facts = found["hardware"]
    echo(
        f"{facts['processor']}, {facts['cores']} cores, {facts['memory']}, {facts['system']}; "
        f"FASTSIM's vectors: {facts['vectors']}"
    )
    echo(", ".join(f"{name} {number}" for name, number in found["versions"].items()))
    for (first, *others), rows in tables(found):
        show("", Table([Column(first), *(Column(name, format=">") for name in others)], rows))
