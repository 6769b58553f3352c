"""``railsim compare``: results side by side."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import echo, json_option, overwrite_option, print_json, quiet_option, table
from railsim.files import check_folder, make_folder, whole_file

if TYPE_CHECKING:
    from collections.abc import Sequence

    from railsim.compare import Comparison
    from railsim.result import Result

FILES = ("compare.csv", "compare.json", "compare.png")


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="R1.h5 R2.h5 ...")
@click.option("--out", metavar="DIR", help="Folder for compare.csv, compare.json and compare.png.")
@click.option(
    "--over",
    type=click.Choice(["distance", "time"]),
    default="distance",
    show_default=True,
    help="Horizontal axis of the picture.",
)
@overwrite_option
@json_option
@quiet_option
def command(
    files: tuple[str, ...], out: str | None, over: str, overwrite: bool, as_json: bool, quiet: bool
) -> None:
    """Print peaks and mid-curve values of results side by side.

    The others are compared with the first result; differences are those of magnitudes.
    With --out the table and a picture of the leading wheelset's quantities are written.

    \b
    Example:
      railsim compare manchester.h5 flexicoil.h5 --out comparison --overwrite
    """  # noqa: D301 - click reads the escape
    from railsim.compare import compare

    results = _opened(files)
    folder = Path(out) if out else None
    if folder:
        check_folder(folder, FILES, overwrite=overwrite)
    rows = compare(results)
    written = _write(folder, rows, results, over) if folder else []
    if as_json:
        print_json(_record(rows, results))
        return
    echo("\n".join(_lines(rows, results)))
    for path in written:
        echo(str(path))


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


def _record(rows: "Sequence[Comparison]", results: "dict[str, Result]") -> dict[str, Any]:
    """Return a comparison as plain numbers and strings, SI."""
    return {
        "results": list(results),
        "remarks": {label: list(result.remarks) for label, result in results.items()},
        "rows": [row.record() for row in rows],
    }


def _write(
    folder: Path, rows: "Sequence[Comparison]", results: "dict[str, Result]", over: str
) -> list[Path]:
    import json

    from railsim.compare import comparison_csv
    from railsim.plot.overlay import overlay
    from railsim.plot.style import save

    make_folder(folder)
    table_file, record_file, picture = (folder / name for name in FILES)
    record = _record(rows, results)
    with whole_file(table_file) as partial:
        partial.write_text(comparison_csv(rows), encoding="utf-8")
    with whole_file(record_file) as partial:
        partial.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    save(overlay(results, over=over), picture, overwrite=True)
    return [table_file, record_file, picture]


def _lines(rows: "Sequence[Comparison]", results: "dict[str, Result]") -> list[str]:
    from railsim.compare import WORDS

    blocks: dict[str, list[list[str]]] = {}
    for row in rows:
        by_sign = row.where in (WORDS["max"], WORDS["min"])
        block = blocks.setdefault("peaks" if row.where in WORDS.values() else row.where, [])
        words = f"{row.quantity.words}, {row.where}" if by_sign else row.quantity.words
        differences = row.differences
        for index, (label, peak) in enumerate(row.peaks.items()):
            place = peak.labels.get("wheelset", "")
            block.append(
                [
                    "" if index else row.quantity.name,
                    "" if index else words,
                    label,
                    f"{results[label].wheelsets.index(place) + 1}" if place else "",
                    peak.labels.get("side", ""),
                    row.quantity.text(peak.value),
                    f"{peak.time:.2f}",
                    f"{peak.distance:.1f}",
                    _percent(differences[label]) if index else "",
                ]
            )
    lines: list[str] = []
    for where, block in blocks.items():
        header = [where, "", "result", "wheelset", "side", "value", "t (s)", "s (m)", "difference"]
        lines += ["", *table(header, block, numbers=5)]
    remarks = [
        f"{label}: remark: {remark}"
        for label, result in results.items()
        for remark in result.remarks
    ]
    return [*lines[1:], *([""] if remarks else []), *remarks]


def _percent(share: float) -> str:
    return "" if share != share else f"{100.0 * share:+.2f} %"
