"""Which results are compared with each other: files, the runs of a study, those of several."""

import os
from collections.abc import Sequence
from pathlib import Path

from railsim.errors import input_error
from railsim.result import Result, open_run
from railsim.studies.gathered import gather, open_results

MOST = 8  # results in one picture
Group = dict[str, Result]


def comparable(files: Sequence[str]) -> tuple[dict[str, Group], list[str]]:
    """Return what is compared with each other, by titles, and remarks; a single group has none.

    Result files are one group.  Of one folder, the runs that differ in nothing but the vehicle are
    compared with each other; of several, the runs of the same name.

    Raises InputError: what cannot be compared, with the reason.
    """
    folders = [file for file in files if os.path.isdir(file)]
    if not folders:
        results = open_results([Path(file) for file in files])
        if len(files) < 2:
            raise input_error("R2.h5", "one result", "give two results at least")
        return {"": results}, []
    if len(folders) < len(files):
        found = f"results and folders together ({folders[0]})"
        raise input_error("R.h5|STUDY", found, "results, or folders of studies")
    alone = len(folders) == 1
    groups, remarks = (_in_folder(folders[0]), []) if alone else _in_folders(folders)
    crowded = [title for title, group in groups.items() if len(group) > MOST]
    if crowded:
        found = f"{len(groups[crowded[0]])} results side by side"
        raise input_error(crowded[0], found, f"{MOST} at most; give the files")
    return (groups if len(groups) > 1 else {"": next(iter(groups.values()))}), remarks


def _in_folder(folder: str) -> dict[str, Group]:
    """Return the runs of a folder that differ in nothing but the vehicle."""
    found = gather([folder])
    alike: dict[str, dict[str, Path]] = {}
    for record in found.records:
        if record["name"] in found.paths:
            vehicle = str(record["labels"].get("vehicle", record["name"]))
            rest = record["name"].removeprefix(f"{vehicle}_")
            alike.setdefault(rest, {})[vehicle] = found.paths[record["name"]]
    pairs = {title: _open(paths) for title, paths in alike.items() if len(paths) > 1}
    if not pairs:
        why = "no two runs differ in nothing but the vehicle" if found.paths else "no result files"
        allowed = "give the result files that are to be compared; `railsim plot` shows a study"
        raise input_error(folder, why, allowed)
    return pairs


def _in_folders(folders: Sequence[str]) -> tuple[dict[str, Group], list[str]]:
    """Return the runs of the same name in several folders, and which are not in all."""
    runs = {folder: gather([folder]).paths for folder in folders}
    common = [name for name in runs[folders[0]] if all(name in paths for paths in runs.values())]
    if not common:
        found = "no result that all folders have"
        raise input_error(folders[0], found, "studies with runs of the same names")
    remarks = []
    for folder, paths in runs.items():
        if others := [name for name in paths if name not in common]:
            more = ", ..." if len(others) > 1 else ""
            count = len(others)
            remarks.append(f"{count} runs of {folder} are not in all folders: {others[0]}{more}")
    stems = [Path(folder).name for folder in folders]
    labels = stems if len(set(stems)) == len(stems) else folders
    labelled = dict(zip(labels, runs.values(), strict=True))
    groups = {run: _open({name: paths[run] for name, paths in labelled.items()}) for run in common}
    return groups, remarks


def _open(paths: dict[str, Path]) -> Group:
    return {label: open_run(path) for label, path in paths.items()}
