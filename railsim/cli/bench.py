"""``railsim bench``: the runtime benchmark on this machine."""

import click

from railsim.cli import common as cli


@click.command()
@cli.flag("--quick", "No errors, which take most of the time.")
@cli.answer_options
def command(quick: bool, output: cli.Output) -> None:
    """Measure the speed of railsim on this machine, and the error at that speed.

    Two coaches through a curve and one on irregular rails, in multiples of real time of the time
    loop, with their errors against RK4 at 0.125 ms: of the largest and smallest wheel load change,
    of the largest guiding force and that at mid-curve, of the largest yaw, and the largest of all
    peaks.  Takes about a minute.  More is measured by the scripts in `benchmarks/` of the sources.

    \b
    Example:
      railsim bench
      railsim bench --quick --json > bench.json
    """
    from railsim.bench.runs import benchmark, table

    with output.progress("bench") as progress:
        found = benchmark(errors=not quick, progress=progress)
    facts, versions = found["hardware"], found["versions"].items()
    machine = (
        f"{facts['processor']}, {facts['cores']} cores, {facts['memory']}, {facts['system']}; "
        f"FASTSIM's vectors: {facts['vectors']}"
    )
    programs = ", ".join(f"{name} {number}" for name, number in versions)
    output.answer(found, [machine, programs, "", table(found["runs"])])
