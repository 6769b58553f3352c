"""Fill the table of all vehicles on all tracks in `docs/validation/vehicles_and_tracks.md`.

And that of the test campaign in `docs/validation/assessment.md`, from the folder of a campaign:

    railsim study --scenario en14363 --vehicles ... --out DIR

``python docs/generate.py campaign:DIR`` reads the folder of

    railsim study --vehicles ... --tracks ... --speeds permitted --keep summary --out DIR

with all vehicles and tracks of `railsim list`; it takes a quarter of an hour of one core.
"""

import json
import shutil
from collections import defaultdict
from pathlib import Path

from generators.filling import fill_page, table
from railsim.files.sources import library_files
from railsim.studies.summary import read_index

PAGE = Path(__file__).parents[1] / "validation" / "vehicles_and_tracks.md"
ASSESSMENT = PAGE.with_name("assessment.md")
IMAGES = PAGE.parents[1] / "img" / "assessment"
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
        "largest track shift force (kN), track",
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


def coaches(folder: Path, found: list[dict]) -> str:
    """One row for each vehicle of a test campaign: verdicts, and what is nearest to its limit."""
    rows = []
    for one in json.loads((folder / "assessment.json").read_text("utf-8")):
        own = [run for run in found if run["name"] in one["runs"]]
        seconds = sum(run["cpu_time"] * run["real_time_factor"] for run in own)
        quantities = [
            (q["share"], f"{q['name']}, zone {zone['zone']} {zone['population']}")
            for zone in one["zones"]
            for q in zone["quantities"]
            if q["criterion"] in one["deciding"]
        ]
        share, name = max(quantities)
        states = [condition["state"] for condition in one["conditions"]]
        rows.append((
            one["vehicle"], f"{len(own)}, {seconds:.0f} s",
            f"{states.count('met')} of {len(states)}",
            *(one["verdicts"][name]["verdict"] for name in ("safety", "loading", "ride")),
            f"{100.0 * share:.0f} %, {name}", f"{one['hunting_frequency']:.2f} Hz",
        ))  # fmt: skip
    head = ("vehicle", "runs, simulated time", "conditions met", "running safety", "track loading",
            "ride", "nearest to a limit that decides", "f0")  # fmt: skip
    IMAGES.mkdir(exist_ok=True)
    for name in ("assessment", "assessment_regression"):
        shutil.copy(
            folder / f"{name}.png", IMAGES / f"{name.replace('assessment', 'campaign')}.png"
        )
    return table(head, rows, "---")


def make(parts):
    """Fill the tables from a folder."""
    (folder,) = map(Path, parts)
    runs = [run.model_dump() for run in read_index(folder / "study.json").runs]
    if (folder / "assessment.json").is_file():
        fill_page(ASSESSMENT, {"coaches": lambda: coaches(folder, runs)}, ["coaches"])
    else:
        fill_page(PAGE, {"campaign": lambda: campaign(runs)}, ["campaign"])
