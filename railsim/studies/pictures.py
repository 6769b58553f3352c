"""The pictures of a study: every run, and comparisons of the vehicles."""

from railsim.plot.histories import histories
from railsim.plot.overlay import overlay
from railsim.plot.style import save
from railsim.studies.outcome import Outcome


def draw(outcome: Outcome) -> None:
    """Draw the runs whose picture is missing or out of date, and all comparisons.

    Runs that differ only in the vehicle are drawn into one picture,
    ``compare_TRACK_SPEED.png``.
    """
    results = outcome.results()
    alike: dict[str, dict[str, str]] = {}
    for record in outcome.records:
        result = results.get(record["name"])
        if result is None or not len(result["time"]):
            continue
        file = outcome.folder / record["file"]
        picture = file.with_suffix(".png")
        if not picture.exists() or picture.stat().st_mtime < file.stat().st_mtime:
            save(histories(results[record["name"]]), picture, overwrite=True)
        vehicle = str(record["labels"]["vehicle"])
        rest = record["name"].removeprefix(f"{vehicle}_")
        alike.setdefault(rest, {})[vehicle] = record["name"]
    for rest, names in alike.items():
        if len(names) > 1:
            figure = overlay({vehicle: results[name] for vehicle, name in names.items()})
            save(figure, outcome.folder / f"compare_{rest}.png", overwrite=True)
