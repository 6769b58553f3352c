"""A vehicle: the tables of its file, and what follows from them."""

from collections.abc import Mapping
from typing import Any, ClassVar

from railsim.definitions.section_files import embed_wheel_sections
from railsim.definitions.vehicle.flatten import flatten, position_faults
from railsim.definitions.vehicle.laws import with_sources
from railsim.definitions.vehicle.names import name_faults
from railsim.definitions.vehicle.tables import VehicleTables
from railsim.errors import Fault
from railsim.plottable import Plottable
from railsim.table import Column, Table


class Vehicle(VehicleTables, Plottable):
    """A vehicle: everything that its file says."""

    KIND: ClassVar = "vehicle"

    @property
    def mass(self) -> float:
        """Mass of all bodies in the load case [kg]."""
        return flatten(self).mass

    @classmethod
    def complete(cls, tables: dict[str, Any]) -> list[Fault]:
        """Put the sections of wheels that are not round and the sources of laws into the tables."""
        return [*embed_wheel_sections(tables), *with_sources(tables)]

    @classmethod
    def table_faults(cls, tables: Mapping[str, Any]) -> list[Fault]:
        """Return every fault of the names in the tables."""
        return name_faults(tables)

    def contradictions(self) -> list[Fault]:
        """Return which parts stand where they cannot."""
        return position_faults(self)

    def _table(self) -> Table:
        """Return the table of bodies that a notebook shows."""
        inertia = [Column(f"I{axis}{axis}", unit="kg m2", format=".0f") for axis in "xyz"]
        position = [Column(axis, unit="m", format=".3f") for axis in "xyz"]
        columns = [Column("body"), Column("kind"), Column("mass", unit="kg", format=".0f")]
        rows = (
            [body.name, body.kind, body.mass, *body.inertia, *body.position]
            for body in flatten(self).bodies
        )
        return Table([*columns, *inertia, *position], rows)
