"""``railsim optimise``: parameters of a vehicle against objectives and constraints."""

import math
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.processes import begin_server

if TYPE_CHECKING:
    from railsim.studies.optimise import Optimisation
    from railsim.table import Table

MOST_ROWS = 15


@click.command()
@click.argument("study", shell_complete=cli.names_of("study"))
@cli.option("--out", "Folder.", "DIR", default="optimise")
@cli.choice(
    "--method",
    "Instead of the file's. nsga2 needs pip install 'railsim[optimise]'.",
    "surrogate|nsga2|differential_evolution",
    default=None,
)
@cli.option("--evaluations", "Designs, instead of the file's.", "N", cli.COUNT)
@cli.option("--seed", "Instead of the file's.", "N", cli.FROM_0)
@cli.option("--choose", "Design for the vehicle file; default: nearest to the best.", "N", int)
@cli.workers_option
@cli.scheduler_option
@cli.flag("--resume", "Continue in DIR although STUDY has changed.")
@cli.output_options()
@cli.code_options
def command(study: str, output: cli.Output, **how: Any) -> None:
    """Find the parameters of a vehicle that give the best compromises between objectives.

    STUDY is a study file with a table [optimise]: variables with bounds, objectives and
    constraints over any quantity of its summary.  DIR receives the Pareto front, sensitivities,
    a vehicle file of the chosen design, and the study of all runs.  Finished runs are not repeated:
    the command can be given again after an interruption, or with more evaluations.

    \b
    Example:
      railsim optimise examples/primary_and_yaw_damper.toml --out compromise
      railsim optimise my_study.toml --evaluations 200 --method nsga2 --seed 3
    """
    if how["workers"] != 1 and how["scheduler"] is None:
        begin_server()  # which imports on another core while this process does
    from railsim.studies.optimise import optimise

    with output.studying("optimise") as studying:
        found = optimise(study, out=str(output.out), **studying, **how)
    output.answer({"folder": str(found.folder), **found.record()}, _lines(found))


def _lines(found: "Optimisation") -> "list[str | Table]":
    from railsim.design_checks import NEAR_BOUND
    from railsim.table import Table

    if found.chosen is None:
        reasons = {design.reason for design in found.designs if design.reason}
        why = f": {sorted(reasons)[0]}" if reasons else ""
        return [f"none of {len(found.designs)} designs keeps all constraints{why}"]
    step = max(1, math.ceil(len(found.front) / MOST_ROWS))
    shown = [*found.front[::step]]
    if found.chosen not in shown:
        shown.append(found.chosen)
    designs, ends = found.table(), 3  # feasible, front and reason are for spreadsheets
    rows = [
        ["chosen" if design is found.chosen else "", *designs.rows[design.number - 1][:-ends]]
        for design in shown
    ]
    table = Table(["", *designs.columns[:-ends]], rows)
    number = f"front of {len(found.front)} in {len(found.designs)} designs"
    lines: list[str | Table] = [number, "", table, ""]
    lines += [f"remark: {found.chosen.remark}"] * bool(found.chosen.remark)
    lines += [f"active (within {NEAR_BOUND:.0%}): {words}" for words in found.active]
    for one in found.sensitivities:
        shares = sorted(one.total.items(), key=lambda item: -item[1])
        words = ", ".join(f"{p.removeprefix('vehicle.')} {100.0 * s:.0f} %" for p, s in shares)
        words += f" (surrogate's error {100.0 * one.error:.0f} %)"
        if not any(one.total.values()):
            words = "none of the variables; it is the same in all designs"
        lines.append(f"{one.quantity} depends on: {words}")
    return [*lines, *map(str, found.vehicles), str(found.folder / "front.png")]
