"""``railsim validate``: check files and list every fault."""

import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from railsim.cli import common as cli
from railsim.cli.terminal import echo, print_json
from railsim.errors import Faults, fault_lines
from railsim.files.access import RESULTS, is_file

PROFILE_SUFFIXES = {".csv", ".txt", ".dat", ".prw", ".prr", ".ban", ".whl"}


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="F...")
@cli.answer_options
def command(files: tuple[str, ...], output: cli.Output) -> int:
    """Check vehicle, track, settings, spring, mechanism, study and profile files.

    Every fault is listed with file, key, what was found and what is allowed; remarks point out what
    is allowed but unusual.  Shipped files may be given by name.

    \b
    Example:
      railsim validate my_coach.toml curve_r250
    """
    reports: list[dict[str, Any]] = []
    for file in files:
        faults, kind, remarks = Faults(), "", list[Any]()
        with faults.caught():
            kind, remarks = check_one(file)
        records = [asdict(fault) | {"text": str(fault)} for fault in faults]
        notes = [dict(vars(remark)) for remark in remarks]
        reports.append({"file": file, "kind": kind or None, "faults": records, "remarks": notes})
        if output.as_json:
            continue
        for line in fault_lines(faults):
            echo(line, err=True)
        if not (output.quiet or faults):
            echo(f"{file}: {kind}, no faults")
            for remark in remarks:
                echo(f"{file}: {remark.key}: remark: {remark.text}")
    if output.as_json:
        print_json(reports)
    return cli.WRONG_INPUT if any(report["faults"] for report in reports) else cli.DONE


def check_one(file: str) -> tuple[str, list[Any]]:
    """Check one file and return its kind and the remarks on it.

    Raises InputError: all its faults.
    """
    from railsim.definitions.base import Remark

    suffix = Path(file).suffix.lower()
    if suffix in PROFILE_SUFFIXES or _is_profile(file):
        from railsim.profiles import load_profile

        profile = load_profile(file)
        return f"{profile.kind} profile", [Remark("points", note) for note in profile.notes]
    if suffix in RESULTS:
        from railsim.result import check_result

        result = check_result(file)
        return f"result, {result.status}", [Remark("remarks", text) for text in result.remarks]
    if suffix == ".json":
        from railsim.studies.summary import check_index

        index = check_index(Path(file))
        return f"study of {len(index.runs)} runs, {index.status}", []

    from railsim.definitions.loading import load_any, load_scenario, load_study
    from railsim.profiles.used import profile_faults

    definition = load_any(file)
    if definition.KIND == "measurement":
        from railsim.measurement import load_measurement

        run = load_measurement(file)
        return definition.KIND, [Remark("channels", text) for text in run.remarks]
    if definition.KIND in ("study", "scenario"):
        from railsim.studies.plan import check_study, faults_of_file

        with faults_of_file(file):
            if definition.KIND == "study":
                check_study(load_study(file))
            else:
                from railsim.studies.campaign import check_parts

                check_parts(load_scenario(file), file)
    Faults(profile_faults(definition, file)).check()
    return definition.KIND, cli.remarks_on(definition)


def _is_profile(name: str) -> bool:
    """Whether a bare name is that of a built-in profile, and of nothing else."""
    if Path(name).suffix or os.sep in name or is_file(name):
        return False
    from railsim.profiles.builtin import DEFINITIONS

    return name in DEFINITIONS
