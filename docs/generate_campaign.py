"""Fill the table of all vehicles on all tracks in `docs/validation/vehicles_and_tracks.md`.

``python docs/generate_campaign.py DIR`` reads the folder of

    railsim study --vehicles ... --tracks ... --speeds permitted --keep summary --out DIR

with all vehicles and tracks of `railsim list`; it takes a quarter of an hour of one core.
"""

import sys
from collections import defaultdict
from pathlib import Path

from generate import fill_page, table

from railsim.definitions.sources import library_files
from railsim.studies.summary import read_index

PAGE = Path(__file__).parent / "validation" / "vehicles_and_tracks.md"
COMPLETE = "complete"


def peak(record: dict, quantity: str, kind: str) -> float:
    """One of the largest values of a run."""
    return next(
        p["value"] for p in record["peaks"] if p["quantity"] == quantity and p["kind"] == kind
    )


def worst(runs: list[dict], quantity: str, kind: str, scale: float, digits: int) -> str:
    """Largest value of all runs and its track."""
    values = [
        (abs(peak(run, quantity, kind)) * scale, run["labels"]["track"])
        for run in runs
        if peak(run, quantity, kind) is not None
    ]
    value, track = max(values)
    return f"{value:.{digits}f}, `{track}`"


def campaign(found: list[dict]) -> str:
    """One row for each vehicle; then the runs that are not complete."""
    by_vehicle = defaultdict(list)
    for record in found:
        by_vehicle[record["labels"]["vehicle"]].append(record)
    rows, ended = [], []
    for vehicle in sorted(by_vehicle):
        runs = by_vehicle[vehicle]
        whole = [run for run in runs if run["status"] == COMPLETE]
        rows.append(
            (
                f"[`{vehicle}`](../library/{vehicle}.md)",
                f"{len(whole)} of {len(runs)}",
                worst(whole, "dQ_over_Q0", "min", 100.0, 0),
                worst(whole, "Y_over_Q", "abs", 1.0, 2),
                worst(whole, "sum_Y", "abs", 1e-3, 0),
            )
        )
        ended += [run for run in runs if run["status"] != COMPLETE]
    head = (
        "vehicle",
        "complete",
        "largest wheel unloading (%), track",
        "largest derailment quotient, track",
        "largest track shifting force (kN), track",
    )
    every = len(library_files("vehicle")) * len(library_files("track"))
    text = f"{len(found)} of {every} combinations have been computed.\n\n"
    text += table(head, rows, "---")
    if ended:
        ends = [
            (f"`{run['labels']['vehicle']}`", f"`{run['labels']['track']}`",
             f"{run['labels']['speed']:g}", run["status"], run["status_reason"])
            for run in ended
        ]  # fmt: skip
        text += "\n" + table(("vehicle", "track", "m/s", "status", "reason"), ends, "---")
    return text


if __name__ == "__main__":
    runs = [run.model_dump() for run in read_index(Path(sys.argv[1]) / "study.json").runs]
    fill_page(PAGE, {"campaign": lambda: campaign(runs)}, ["campaign"])
