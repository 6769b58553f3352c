"""Page about a track judged by vehicles."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from railsim.report.document import Section, as_png, document, pictures
from railsim.table import Table

MOST_ROWS = 200
CAPTIONS = {"heat": "Largest share of each limit over the arc length; hatched without a run."}
METHOD = (
    "Q, Y/Q, sum Y and accelerations of the floor, low-passed at 20 Hz, Y/Q and sum Y as mean over "
    "2 m, against the limits of EN 14363. A section counts as flagged by vehicles where one of "
    "them exceeds the share of a limit in one of its cells of 25 m, by geometry where a standard "
    "deviation or an isolated defect exceeds its limit of EN 13848-5.",
)


def assessed_track_page(
    track: str, places: Table, share: float, strip: Figure, notes: Sequence[str], sections: Table
) -> str:
    """Return the page as HTML: places beyond a share of a limit, heat strip, sections.

    `track`: name of the recording.
    """
    number = len(places)
    at = f"{number} place{'s' * (number != 1)}"
    text = f"At {at} a vehicle exceeds {100.0 * share:g} % of a limit."
    texts = [f"The first {MOST_ROWS} of {number}; all are in places.csv."]
    places.rows = places.rows[:MOST_ROWS]
    parts = [
        Section("Places", texts if number > MOST_ROWS else [], [places] if number else []),
        Section("Along the track", drawings=pictures({"heat": as_png(strip)}, CAPTIONS)),
        Section("Vehicles and geometry limits", [*notes], [sections]),
    ]
    return document(f"{track} judged by vehicles", parts, METHOD, {"text": text, "ok": number == 0})
