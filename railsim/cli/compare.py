"""``railsim compare``: results side by side."""

from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.errors import Faults

if TYPE_CHECKING:
    from railsim.studies.comparable import Group

FILES = ("compare.csv", "compare.json", "compare.png", "differences.png")
SEEDS = (
    "the irregularities are random: peaks differ from seed to seed too, often by more than those "
    "of vehicles; runs with several values of track.irregularities.0.seed show by how much"
)


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="R.h5|STUDY...")
@cli.choice("--over", "Horizontal axis of the picture.", "distance|time")
@cli.output_options("Folder for compare.csv, .json, .png, differences.png; a set for each group.")
def command(files: tuple[str, ...], over: str, output: cli.Output) -> None:
    """Print peaks and medians over full curves of results side by side.

    The others are compared with the first result; differences are those of magnitudes, and those
    along the track where the plan is the same.  What differs in speed, vehicle, track and settings
    stands first.  With --out the table, and pictures of the leading wheelset, are written.

    Of one STUDY, a folder, the runs that differ in nothing but the vehicle are compared with each
    other; of several, the runs of the same name.

    \b
    Example:
      railsim compare manchester.h5 flexicoil.h5 --out comparison --overwrite
      railsim compare curves
      railsim compare before after --out changes
    """
    from railsim.studies.comparable import comparable

    cli.goes_with("--out", output.folder, "over")
    groups, remarks = comparable(files)
    for remark in remarks:
        output.remark(remark)
    output.reserve(*(_file_name(name, title) for title in groups for name in FILES))
    tracks = [result.track() for results in groups.values() for result in results.values()]
    random = any(one.type == "random" for track in tracks for one in track.irregularities)
    if random and not output.quiet:
        output.remark(SEEDS)
    records, parts = [], list[Any]()
    for title, results in groups.items():
        if title:
            parts += [*[""] * bool(parts), title]
        record, lines = _compare_group(title, results, over, output)
        records.append({"group": title, **record} if title else record)
        parts += lines
    output.answer(records[0] if list(groups) == [""] else {"groups": records}, parts)


def _compare_group(
    title: str, results: "Group", over: str, output: cli.Output
) -> tuple[dict[str, Any], list[Any]]:
    """Write what is compared with each other; return its record and the parts that are printed."""
    from railsim import compare
    from railsim.plot.selection import STUDY

    rows, unlike = compare.compare(results), compare.conditions(results)
    faults, differing = Faults(), list[compare.Difference]()
    with faults.caught():
        differing = compare.differences(results, STUDY)
    why = [f"no differences along the track: {fault}" for fault in faults]
    record = {
        "results": list(results),
        "status": {label: result.status for label, result in results.items()},
        "status_reason": {n: r.attributes.get("status_reason", "") for n, r in results.items()},
        "compared_up_to": {n: float(r["distance"][-1]) for n, r in results.items()},
        "remarks": {label: list(result.remarks) for label, result in results.items()},
        "conditions": {key: dict(zip(results, unlike[key], strict=True)) for key in unlike},
        "rows": [row.record() for row in rows],
        "along_the_track": [one.record() for one in differing],
    }
    if output.folder is not None:  # a picture is drawn: matplotlib takes long to import
        from railsim.plot.overlay import difference_figure, overlay

        table, data, picture, differences = (_file_name(name, title) for name in FILES)
        output.write(table, compare.comparison_table(rows))
        output.write(data, record)
        output.write(picture, overlay(results, over=over))
        if differing:
            output.write(differences, difference_figure(differing, next(iter(results))))
    parts: list[Any] = [compare.condition_table(unlike, results), ""] if unlike else []
    for one in compare.comparison_tables(rows, results):
        parts += [one, ""]
    for label, result in results.items():
        if result.status != "complete":
            ended = f"{result.status}: {result.attributes['status_reason']}"
            parts.append(f"{label}: {ended}; compared up to s = {result['distance'][-1]:.1f} m")
    for label, result in () if output.quiet else results.items():
        parts += [f"{label}: remark: {remark}" for remark in result.remarks]
    return record, parts + ([compare.difference_table(differing)] if differing else why)


def _file_name(name: str, title: str) -> str:
    from railsim.studies.rows import in_a_name

    stem, _, ending = name.partition(".")
    return f"{stem}_{in_a_name(title)}.{ending}" if title else name
