"""``railsim optimise``: parameters of a vehicle against objectives and constraints."""

from typing import Any

import click

from railsim.cli import common as cli
from railsim.errors import RailsimError
from railsim.processes import begin_server


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
    if found.failure:
        raise RailsimError(f"{found.failure}; study.json holds the reasons")
    output.answer({"folder": str(found.folder), **found.record()}, found.parts())
