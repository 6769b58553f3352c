"""``railsim mechanism``: kinematics, forces and optimisation of planar linkages."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from railsim.cli import common as cli
from railsim.errors import changed_faults, input_error
from railsim.files.access import relative

if TYPE_CHECKING:
    from railsim.definitions.mechanism.definition import Mechanism
    from railsim.mechanisms.analysis import Analysis

REPORT, OPTIMISED = "report.html", "optimised.toml"

Query = tuple[str, str, float]  # words of --at: name of a result, its value


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@cli.flag("--optimise searched", "Search as specified in the table [optimise].")
@cli.option("--starts", "Number of starting points of the search.", "N", cli.COUNT)
@cli.option("--seed", "Seed of the starting points.", "S", cli.FROM_0)
@cli.option("--case", "Case of the file instead of its base.", "NAME")
@cli.repeated("--at", "Also print all results wherever one has a value (SI).", "NAME=VALUE")
@cli.set_option
@cli.output_options(f"Folder for {REPORT}, pictures, animation, positions.csv.")
def command(
    files: tuple[str, ...],
    searched: bool,
    case: str | None,
    at: tuple[str, ...],
    assignments: tuple[str, ...],
    output: cli.Output,
    **search: int | None,
) -> None:
    """Compute planar linkages with one degree of freedom: positions, forces, components.

    FILE is a mechanism file (format railsim-mechanism/1) or the name of a shipped one.  Of several
    files the first is the reference of a comparison.  With --optimise, search for better
    parameters; --out then also writes optimised.toml, which extends the file and runs again.

    \b
    Example:
      railsim mechanism atr95_lift_5 --out lift_5 --overwrite
      railsim mechanism atr95_lift_4 --optimise --starts 20 --seed 1
      railsim mechanism atr95_lift_5 atr95_lift_4 --at height=0.8955
      railsim mechanism tilting_one_spring --case bordolese_5000 --json
    """
    if searched and len(files) > 1:
        raise click.UsageError("--optimise takes one FILE")
    cli.goes_with("--optimise", searched, *search)
    from railsim.definitions.loading import load_mechanism
    from railsim.mechanisms.analysis import analyse
    from railsim.mechanisms.optimisation import optimise
    from railsim.mechanisms.remarks import remarks
    from railsim.mechanisms.summary import data_of
    from railsim.mechanisms.tables import parts_of
    from railsim.processes import available_cores

    mechanisms = [load_mechanism(file, assignments) for file in files]
    if output.out is not None:
        from railsim.report.mechanisms import NAMES, PageResults
        from railsim.report.mechanisms import files as written

        others = (f"drawing_{number}.png" for number in range(2, len(files) + 1))
        output.reserve(*NAMES, *others, *[OPTIMISED] * searched)
    queries = _queries(at)
    optimum, results, at_values, cases = None, [], [], {}
    for file, mechanism in zip(files, mechanisms, strict=True):
        with cli.faults_in(file, "mechanism", mechanism.name):
            if searched:
                chosen, cores = mechanism.in_case(case), available_cores()
                if queries:  # before the search
                    before = analyse(chosen)
                    for _, name, _ in queries:
                        before.result(name)
                optimum = optimise(chosen, workers=cores, **search)
            results.append(optimum.after if optimum else analyse(mechanism, case))
            hits = ((words, results[-1].everywhere(name, value)) for words, name, value in queries)
            at_values.append([{"where": words, **one} for words, rows in hits for one in rows])
            if len(results) == 1 and mechanism.cases and case is None and not searched:
                cases = {name: _analyse_case(mechanism, name) for name in mechanism.cases}
                cases = {"base": results[0], **cases}
    if output.out is not None:
        content = written(PageResults(results, cases, optimum))
        if optimum is not None:
            from railsim.mechanisms.optimum import optimised_text

            file_path = Path(files[0])
            base = relative(file_path, output.out) if file_path.is_file() else files[0]
            content[OPTIMISED] = optimised_text(base, optimum, assignments, case).encode()
        output.write_all(content)
    output.answer(
        data_of(results, cases, at_values, optimum),
        [] if output.as_json else parts_of(results, at_values, optimum),
        dict.fromkeys(r for result in results for r in remarks(result)),
    )


def _analyse_case(mechanism: "Mechanism", case: str) -> "Analysis":
    """Results of a case that was not asked for; what is wrong with it names it."""
    from railsim.mechanisms.analysis import analyse

    with changed_faults(lambda fault: replace(fault, found=f"case '{case}': {fault.found}")):
        return analyse(mechanism, case)


def _queries(assignments: Sequence[str]) -> list[Query]:
    """Words of --at, with the name of the result and its value."""
    queries = list[Query]()
    for assignment in assignments:
        name, equals, written = assignment.partition("=")
        try:
            value = float(written)
        except ValueError:
            equals = ""
        if not equals:
            raise input_error("--at", f"'{assignment}'", "NAME=VALUE, in SI units")
        queries.append((assignment, name.strip(), value))
    return queries
