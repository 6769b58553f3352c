"""``railsim validate``: check files and list every fault."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import json_option, print_json, quiet_option
from railsim.files import RESULTS

if TYPE_CHECKING:
    from railsim.definitions.vehicle import Assembly, Vehicle
    from railsim.errors import Fault
    from railsim.profiles.profile import Kind

PROFILE_SUFFIXES = {".csv", ".prw", ".prr", ".ban", ".whl"}


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="F...")
@json_option
@quiet_option
def command(files: tuple[str, ...], as_json: bool, quiet: bool) -> int:
    """Check vehicle, track, settings, spring, mechanism, study and profile files.

    Every fault is listed with file, key, what was found and what is allowed; remarks point to what
    is allowed but unusual.  Shipped files may be given by name.

    \b
    Example:
      railsim validate my_coach.toml curve_r250
    """  # noqa: D301 - click reads the escape
    from railsim.cli import DONE, WRONG_INPUT

    reports = [_report(file) for file in files]
    if as_json:
        print_json(reports)
    else:
        for report in reports:
            _print(report, quiet)
    return WRONG_INPUT if any(report["faults"] for report in reports) else DONE


def _report(file: str) -> dict[str, Any]:
    from railsim.errors import InputError

    try:
        kind, remarks = checked(file)
    except InputError as error:
        faults = [dict(vars(fault), text=str(fault)) for fault in error.faults]
        return {"file": file, "kind": None, "faults": faults, "remarks": []}
    return {"file": file, "kind": kind, "faults": [], "remarks": remarks}


def _print(report: dict[str, Any], quiet: bool) -> None:
    for fault in report["faults"]:
        click.echo(fault["text"], err=True)
    if quiet or report["faults"]:
        return
    click.echo(f"{report['file']}: {report['kind']}, no faults")
    for remark in report["remarks"]:
        click.echo(f"{report['file']}: {remark['key']}: remark: {remark['text']}")


def checked(file: str) -> tuple[str, list[dict[str, str]]]:
    """Check one file and return its kind and the remarks on it.

    Raises
    ------
    InputError : all its faults.
    """
    suffix = Path(file).suffix.lower()
    if suffix in PROFILE_SUFFIXES:
        from railsim.profiles import load_profile

        profile = load_profile(file)
        return f"{profile.kind} profile", [
            {"key": "points", "text": note} for note in profile.notes
        ]
    if suffix in RESULTS:
        from railsim.result import open_run

        return f"result, {open_run(file).status}", []
    if suffix == ".json":
        from railsim.studies.summary import check_index

        index = check_index(Path(file))
        return f"study of {len(index['runs'])} runs, {index['status']}", []

    from railsim.definitions.loading import load_any
    from railsim.errors import InputError

    definition, known = load_any(file)
    if faults := _profile_faults(definition, file):
        raise InputError(faults)
    return known.kind, [dict(vars(remark)) for remark in known.remarks(definition)]


def _profile_faults(definition: Any, file: str) -> "list[Fault]":
    """Return a fault for every wheel or rail profile of a definition that cannot be loaded."""
    from railsim.definitions.track import Track
    from railsim.definitions.vehicle import Vehicle

    faults: list[Fault] = []
    if isinstance(definition, Track):
        for name in dict.fromkeys(definition.rail):
            faults += _unusable(name, "rail", file, "rail")
    elif isinstance(definition, Vehicle):
        for key, name in dict.fromkeys(_wheel_profiles(definition, ())):
            faults += _unusable(name, "wheel", file, key)
    return faults


def _wheel_profiles(
    group: "Vehicle | Assembly", path: tuple[str, ...]
) -> Iterator[tuple[str, str]]:
    for name, wheelset in group.wheelsets.items():
        for profile in wheelset.profile:
            yield ".".join((*path, "wheelsets", name, "profile")), profile
    for name, assembly in group.assemblies.items():
        yield from _wheel_profiles(assembly, (*path, "assemblies", name))


def _unusable(name: str, kind: "Kind", file: str, key: str) -> "list[Fault]":
    from railsim.errors import Fault, InputError
    from railsim.profiles import load_profile

    try:
        load_profile(name, kind)
    except InputError as error:
        return [
            Fault(file, key, f"profile '{name}': {fault.found}", fault.allowed)
            for fault in error.faults
        ]
    return []
