"""Page about a track judged by vehicles."""

from typing import Protocol

from railsim.plot.assessed_track import Assessed, heat_strip
from railsim.report.document import Section, as_png, document, pictures
from railsim.table import Table

MOST_ROWS = 200
CAPTIONS = {"heat": "Largest share of each limit over the arc length; blank where no run came."}
METHOD = (
    "Q, Y/Q, sum Y and accelerations of the floor, low-passed at 20 Hz, Y/Q and sum Y as mean over "
    "2 m, against the limits of EN 14363. A section counts as flagged by vehicles where one of "
    "them exceeds the share of a limit in one of its cells of 25 m, by geometry where a standard "
    "deviation or an isolated defect exceeds its limit of EN 13848-5.",
)


class Judged(Assessed, Protocol):
    """What is reported, such as `railsim.studies.assess_track.TrackAssessment`."""

    @property
    def sections(self) -> Table: ...  # noqa: D102 - as there
    @property
    def notes(self) -> tuple[str, ...]: ...  # noqa: D102
    def table(self) -> Table: ...  # noqa: D102


def assessed_track_page(found: Judged) -> str:
    """Return the page as HTML: places, heat strip, sections."""
    places = found.table()
    number = len(places)
    text = f"At {number} places a vehicle exceeds {found.share:g} of a limit."
    texts = [f"The first {MOST_ROWS} of {number}; all are in places.csv."]
    places.rows = places.rows[:MOST_ROWS]
    heat = pictures({"heat": as_png(heat_strip(found))}, CAPTIONS)
    sections = [
        Section("Places", texts if number > MOST_ROWS else (), [places] if number else []),
        Section("Along the track", figures=heat),
        Section("Vehicles and geometry limits", found.notes, [found.sections]),
    ]
    verdict = {"text": text, "ok": number == 0}
    return document("Track judged by vehicles", sections, METHOD, verdict)
