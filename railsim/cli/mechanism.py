"""``railsim mechanism``: kinematics, forces and optimisation of planar linkages."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    echo,
    json_option,
    overwrite_option,
    print_json,
    quiet_option,
    set_option,
    table,
)
from railsim.files import check_folder, make_folder, whole_file

if TYPE_CHECKING:
    from railsim.definitions.mechanism import Mechanism
    from railsim.mechanisms.analysis import Analysis


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--case", metavar="NAME", help="A case of the file instead of its base.")
@click.option(
    "--at",
    "places",
    multiple=True,
    metavar="NAME=VALUE",
    help="Also all results where one of them has a value (SI), such as height=0.8955.",
)
@set_option
@overwrite_option
@json_option
@quiet_option
def command(
    files: tuple[str, ...],
    case: str | None,
    places: tuple[str, ...],
    assignments: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Compute planar linkages with one degree of freedom: positions, forces, components.

    FILE is a mechanism file (format railsim-mechanism/1) or the name of a shipped one.  Of several
    files the first is the reference of a comparison.

    \b
    Example:
      railsim mechanism atr95_lift_5
      railsim mechanism atr95_lift_5 --at height=0.8955 --set parameters.bore=0.125
    """  # noqa: D301 - click reads the escape
    results = [_analysed(file, assignments, case) for file in files]
    found = [_values_at(result, places) for result in results]
    if as_json:
        from railsim.mechanisms.summary import analysis_data

        data = [analysis_data(result) for result in results]
        for one, values in zip(data, found, strict=True):
            if values:
                one["at"] = values
        print_json(data[0] if len(data) == 1 else {"mechanisms": data})
        return
    for number, (result, values) in enumerate(zip(results, found, strict=True)):
        if number:
            echo()
        for line in _lines(result, values):
            echo(line)
    if not quiet:
        for result in results:
            for remark in result.definition.remarks:
                echo(f"remark: {result.definition.name}: {remark}", err=True)


def _analysed(file: str, assignments: Sequence[str], case: str | None) -> "Analysis":
    from railsim.definitions.loading import load_mechanism
    from railsim.mechanisms.analysis import analyse

    mechanism = load_mechanism(file, assignments)
    with _faults_in(file, mechanism):
        return analyse(mechanism, case)


@contextmanager
def _faults_in(file: str, mechanism: "Mechanism") -> Iterator[None]:
    """Let faults that computing finds name the file instead of the mechanism."""
    from railsim.errors import InputError

    try:
        yield
    except InputError as error:
        raise InputError(
            replace(fault, file=file) if fault.file in ("", mechanism.name) else fault
            for fault in error.faults
        ) from None


def _values_at(result: "Analysis", places: Sequence[str]) -> list[dict[str, Any]]:
    """Results where one of them has a value, by the words of --at."""
    from railsim.errors import Fault, InputError

    found = []
    for place in places:
        name, equals, written = place.partition("=")
        try:
            value = float(written)
        except ValueError:
            equals = ""
        if not equals:
            raise InputError([Fault("--at", "", f"'{place}'", "NAME=VALUE, in SI units")])
        found.append({"where": place, **result.at(name.strip(), value)})
    return found


def _lines(result: "Analysis", places: Sequence[dict[str, Any]]) -> list[str]:
    from railsim.mechanisms import tables
    from railsim.mechanisms.selection import checks, selection

    definition = result.definition
    case = f", case {result.case}" if result.case else ""
    lines = [f"{definition.name}{case}", ""]
    lines += table(*tables.upright(tables.position_table(result)))
    if places:
        rows = [(p["where"], {k: v for k, v in p.items() if k != "where"}) for p in places]
        lines += ["", *table(*tables.upright(tables.value_table(result, rows)))]
    lines += ["", *_sentences(result)]
    lines += ["", *table(*tables.reaction_table(result))]
    if made := checks(result):
        lines += ["", *table(*tables.check_table(made))]
    if choices := selection(result):
        lines += ["", *table(*tables.selection_table(choices), 4)]
    return lines


def _sentences(result: "Analysis") -> list[str]:
    """What is no table: stroke, zeros, contact force, motion."""
    import numpy as np

    from railsim.mechanisms.quantities import quantity

    travel = quantity("travel", result.definition)

    def driver(value: float) -> str:
        return f"{value * travel.scale:.4f} {travel.shown}"

    lines = []
    if "length" in result.output:
        stroke = f"stroke {result.stroke * 1e3:.4f} mm"
        lines.append(f"{stroke} over a travel of {driver(result.travel)}")
    if result.force_zeros:
        lines.append(f"force zero at {', '.join(driver(s) for s in result.force_zeros)}")
    for s, stable in result.equilibria:
        lines.append(f"at rest at {driver(s)}, {'stable' if stable else 'unstable'}")
    if (contact := result.contact) is not None:
        forces = ", ".join(f"{name} {value:.2f} N" for name, value in contact.force.items())
        lines.append(f"contact force at {contact.pressure / 1e6:.5f} MPa: {forces}")
        lines += [f"  {contact.reason}"] if contact.reason else []
        for y, stable in contact.equilibria:
            word = "stable" if stable else "unstable"
            lines.append(f"  rests at a height of {y * 1e3:.1f} mm without contact, {word}")
    if (timed := result.timed) is not None:
        lines.append(
            f"motion in {timed.time[-1]:.3f} s: force {timed.force[0]:.2f} N at first, "
            f"{np.min(timed.force):.2f} to {np.max(timed.force):.2f} N"
        )
    if (released := result.release) is not None:
        end = "reaches" if released.reached else "is then at"
        lines.append(
            f"let go at {driver(released.s[0])} it {end} {driver(released.s[-1])} after "
            f"{released.time[-1]:.5f} s"
        )
    return lines


def _write(folder: Path, files: dict[str, bytes], overwrite: bool) -> list[Path]:
    """Write files into a folder, which is made if need be; all of them or none."""
    check_folder(folder, files, overwrite=overwrite)
    make_folder(folder)
    for name, content in files.items():
        with whole_file(folder / name) as partial:
            partial.write_bytes(content)
    return [folder / name for name in files]
