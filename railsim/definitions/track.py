"""A track: the tables of its file, and what follows from them."""

from typing import Any, ClassVar

from railsim.definitions.base import Remark
from railsim.definitions.excitations.measured_file import embed_measured
from railsim.definitions.layout import curvature_sections, track_faults, track_remarks
from railsim.definitions.track_tables import TrackTables
from railsim.errors import Fault
from railsim.plottable import Plottable


class Track(TrackTables, Plottable):
    """A track: everything that its file says."""

    KIND: ClassVar = "track"
    OPEN_TABLES: ClassVar = ("friction_falling",)

    @classmethod
    def complete(cls, tables: dict[str, Any]) -> list[Fault]:
        """Put the rows of measured irregularities into the tables."""
        return embed_measured(tables)

    def contradictions(self) -> list[Fault]:
        """Return where the elements do not fit together."""
        return track_faults(self)

    def unusual(self) -> list[Remark]:
        """Return what an engineer would object to."""
        return track_remarks(self)

    def _table(self) -> tuple[list[str], list[list[object]]]:
        """Return the table of the plan's elements that a notebook shows."""
        rows: list[list[object]] = []
        for section in curvature_sections(self):
            ends = " to ".join(
                f"{1.0 / value:.6g}" if value else "inf"
                for value in dict.fromkeys((section.start_value, section.end_value))
            )
            rows.append([section.type, f"{section.begin:.6g}", f"{section.end:.6g}", ends])
        return ["plan", "from (m)", "to (m)", "radius (m)"], rows
