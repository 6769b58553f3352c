"""A track: the tables of its file, and what follows from them."""

from typing import Any, ClassVar

from railsim.definitions.base import Remark
from railsim.definitions.excitations.measured_file import embed_measured
from railsim.definitions.track.layout import curvature_sections, track_faults, track_remarks
from railsim.definitions.track.rail_sections import embed_rail_sections
from railsim.definitions.track.tables import TrackTables
from railsim.definitions.vehicle.laws import with_sources
from railsim.errors import Fault
from railsim.plottable import Plottable
from railsim.table import Column, Table


class Track(TrackTables, Plottable):
    """A track: everything that its file says."""

    KIND: ClassVar = "track"
    OPEN_TABLES: ClassVar = ("friction_falling",)

    @classmethod
    def complete(cls, tables: dict[str, Any]) -> list[Fault]:
        """Put measured irregularities, sections of rails and sources of laws into the tables."""
        return embed_measured(tables) + embed_rail_sections(tables) + with_sources(tables)

    def contradictions(self) -> list[Fault]:
        """Return where the elements do not fit together."""
        return track_faults(self)

    def unusual(self) -> list[Remark]:
        """Return what an engineer would object to."""
        return track_remarks(self)

    def _table(self) -> Table:
        """Return the table of the plan's elements that a notebook shows."""
        rows = []
        for section in curvature_sections(self):
            curvatures = dict.fromkeys((section.start_value, section.end_value))
            radii = " to ".join(f"{1.0 / kappa:.6g}" if kappa else "inf" for kappa in curvatures)
            rows.append([section.type, section.begin, section.end, radii])
        ends = [Column("from", unit="m", format=".6g"), Column("to", unit="m", format=".6g")]
        return Table([Column("plan"), *ends, Column("radius (m)", format=">")], rows)
