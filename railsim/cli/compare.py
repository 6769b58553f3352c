"""``railsim compare``: results side by side."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import echo, output_options, print_json, show
from railsim.files.access import check_folder, make_folder, whole_file

if TYPE_CHECKING:
    from collections.abc import Sequence

    from railsim.compare import Comparison, Difference
    from railsim.result import Result

TABLE, RECORD, PICTURE, DIFFERENCES = (
    "compare.csv", "compare.json", "compare.png", "differences.png"
)  # fmt: skip
MOST = 8  # results in one picture


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="R.h5|STUDY...")
@click.option(
    "--out", metavar="DIR", help="Folder for compare.csv, compare.json, compare.png, "
    "differences.png; of several groups a set for each.",
)  # fmt: skip
@click.option(
    "--over",
    type=click.Choice(["distance", "time"]),
    default="distance",
    show_default=True,
    help="Horizontal axis of the picture.",
)
@output_options
def command(
    files: tuple[str, ...], out: str | None, over: str, overwrite: bool, as_json: bool, quiet: bool
) -> None:
    """Print peaks and mid-curve values of results side by side.

    The others are compared with the first result; differences are those of magnitudes, and those
    along the track where the plan is the same.  With --out the table and pictures of the leading
    wheelset's quantities are written.

    Of one STUDY, a folder, the runs that differ in nothing but the vehicle are compared with each
    other; of several, the runs of the same name.

    \b
    Example:
      railsim compare manchester.h5 flexicoil.h5 --out comparison --overwrite
      railsim compare curves
      railsim compare before after --out changes
    """  # noqa: D301 - click reads the escape
    from railsim.compare import compare, comparison_tables, difference_table

    groups = _groups(files)
    folder = Path(out) if out else None
    if folder:
        names = (TABLE, RECORD, PICTURE, DIFFERENCES)
        wanted = [_named(name, title) for title in groups for name in names]
        check_folder(folder, wanted, overwrite=overwrite)
    records = []
    for number, (title, results) in enumerate(groups.items()):
        rows = compare(results)
        differing, why = _differing(results)
        record = _record(rows, results, differing)
        records.append({"group": title, **record} if title else record)
        written = []
        if folder:
            written = _write(folder, title, rows, results, record, differing, over)
        if as_json:
            continue
        if title:
            echo(f"\n{title}" if number else title)
        for table in comparison_tables(rows, results):
            show(table, "")
        remarks = [
            f"{label}: remark: {remark}"
            for label, result in results.items()
            for remark in result.remarks
        ]
        show(*remarks, *([difference_table(differing)] if differing else []), *why)
        for path in written:
            echo(str(path))
    if as_json:
        print_json(records[0] if list(groups) == [""] else {"groups": records})


def _named(name: str, title: str) -> str:
    """Return the name of a file of a group."""
    from railsim.studies.rows import in_a_name

    stem, _, ending = name.partition(".")
    return f"{stem}_{in_a_name(title)}.{ending}" if title else name


def _groups(files: tuple[str, ...]) -> "dict[str, dict[str, Result]]":
    """Return what is compared with each other, by titles; a single group has none.

    Raises
    ------
    InputError : what cannot be compared, with the reason.
    """
    from railsim.errors import Fault, InputError

    folders = [file for file in files if os.path.isdir(file)]
    if not folders:
        return {"": _opened(files)}
    if len(folders) < len(files):
        found = f"results and folders together ({folders[0]})"
        raise InputError([Fault("R.h5|STUDY", "", found, "results, or folders of studies")])
    groups = _of_one(folders[0]) if len(folders) == 1 else _of_several(folders)
    crowded = [title for title, group in groups.items() if len(group) > MOST]
    if crowded:
        found = f"{len(groups[crowded[0]])} results side by side"
        raise InputError([Fault(crowded[0], "", found, f"{MOST} at most; give the files")])
    return groups if len(groups) > 1 else {"": next(iter(groups.values()))}


def _of_one(folder: str) -> "dict[str, dict[str, Result]]":
    """Return the runs of a folder that differ in nothing but the vehicle."""
    from railsim.cli.gathered import gather
    from railsim.errors import Fault, InputError

    found = gather([folder])
    alike: dict[str, list[tuple[str, str]]] = {}
    for record in found.records:
        if record["name"] in found.paths:
            vehicle = str(record["labels"].get("vehicle", record["name"]))
            rest = record["name"].removeprefix(f"{vehicle}_")
            alike.setdefault(rest, []).append((vehicle, record["name"]))
    pairs = {title: names for title, names in alike.items() if len(names) > 1}
    if not pairs:
        kept = len(found.paths)
        why = "no two runs differ in nothing but the vehicle" if kept else "no result files"
        allowed = "give the result files that are to be compared; `railsim plot` shows a study"
        raise InputError([Fault(folder, "", why, allowed)])
    return {
        title: {vehicle: found.results([name])[name] for vehicle, name in names}
        for title, names in pairs.items()
    }


def _of_several(folders: list[str]) -> "dict[str, dict[str, Result]]":
    """Return the runs of the same name in several folders."""
    from railsim.cli.gathered import gather
    from railsim.errors import Fault, InputError

    runs = {folder: gather([folder]).paths for folder in folders}
    common = [name for name in runs[folders[0]] if all(name in paths for paths in runs.values())]
    if not common:
        found = "no result that all folders have"
        raise InputError([Fault(folders[0], "", found, "studies with runs of the same names")])
    for folder, paths in runs.items():
        if alone := [name for name in paths if name not in common]:
            echo(f"remark: {len(alone)} runs of {folder} are not in all folders: {alone[0]}"
                 + (", ..." if len(alone) > 1 else ""), err=True)  # fmt: skip
    from railsim.result import open_run

    stems = [Path(folder).name for folder in folders]
    labels = stems if len(set(stems)) == len(stems) else folders
    return {
        name: {
            label: open_run(runs[folder][name])
            for label, folder in zip(labels, folders, strict=True)
        }
        for name in common
    }


def _differing(results: "dict[str, Result]") -> "tuple[list[Difference], list[str]]":
    """Return differences along the track, or why there are none."""
    from railsim.compare import differences
    from railsim.errors import InputError
    from railsim.plot.selection import STUDY

    try:
        return differences(results, STUDY), []
    except InputError as error:
        return [], [f"no differences along the track: {fault}" for fault in error.faults]


def _opened(files: tuple[str, ...]) -> "dict[str, Result]":
    """Open all results under the shortest names that tell them apart."""
    from railsim.errors import Fault, InputError
    from railsim.result import open_run

    faults: list[Fault] = []
    if len(files) < 2:
        faults.append(Fault("R2.h5", "", "one result", "give two results at least"))
    results: dict[str, Result] = {}
    stems = [Path(file).stem for file in files]
    labels = stems if len(set(stems)) == len(stems) else list(files)
    for file, label in zip(files, labels, strict=True):
        if label in results:
            faults.append(Fault(file, "", "given twice", "give each result once"))
            continue
        try:
            results[label] = open_run(file)
        except InputError as error:
            faults.extend(error.faults)
    if faults:
        raise InputError(faults)
    return results


def _record(
    rows: "Sequence[Comparison]", results: "dict[str, Result]", differing: "Sequence[Difference]"
) -> dict[str, Any]:
    """Return a comparison as plain numbers and strings, SI."""
    return {
        "results": list(results),
        "remarks": {label: list(result.remarks) for label, result in results.items()},
        "rows": [row.record() for row in rows],
        "along_the_track": [
            {
                "quantity": one.quantity.name,
                **one.labels,
                "result": one.result,
                "largest_difference": one.largest[0],
                "distance": one.largest[1],
            }
            for one in differing
        ],
    }


def _write(
    folder: Path,
    title: str,
    rows: "Sequence[Comparison]",
    results: "dict[str, Result]",
    record: dict[str, Any],
    differing: "Sequence[Difference]",
    over: str,
) -> list[Path]:
    import json

    from railsim.compare import comparison_table
    from railsim.plot.overlay import difference_figure, overlay
    from railsim.plot.style import save

    make_folder(folder)
    table_file, record_file, picture, differences = (
        folder / _named(name, title) for name in (TABLE, RECORD, PICTURE, DIFFERENCES)
    )
    with whole_file(table_file) as partial:
        partial.write_text(comparison_table(rows).csv(), encoding="utf-8")
    with whole_file(record_file) as partial:
        partial.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    written = [table_file, record_file, save(overlay(results, over=over), picture, overwrite=True)]
    if differing:
        figure = difference_figure(differing, next(iter(results)))
        written.append(save(figure, differences, overwrite=True))
    return written
