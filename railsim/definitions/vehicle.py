"""A vehicle: the tables of its file, and what follows from them."""

from collections.abc import Mapping
from typing import Any, ClassVar

from railsim.definitions.flatten import flatten, position_faults
from railsim.definitions.names import name_faults
from railsim.definitions.vehicle_tables import VehicleTables
from railsim.errors import Fault
from railsim.plottable import Plottable


class Vehicle(VehicleTables, Plottable):
    """A vehicle: everything that its file says."""

    KIND: ClassVar = "vehicle"

    @property
    def mass(self) -> float:
        """Mass of all bodies in the load case [kg]."""
        return flatten(self).mass

    @classmethod
    def table_faults(cls, tables: Mapping[str, Any]) -> list[Fault]:
        """Return every fault of the names in the tables."""
        return name_faults(tables)

    def contradictions(self) -> list[Fault]:
        """Return which parts stand where they cannot."""
        return position_faults(self)

    def _table(self) -> tuple[list[str], list[list[object]]]:
        """Return the table of bodies that a notebook shows."""
        rows: list[list[object]] = []
        for body in flatten(self).bodies:
            position = " ".join(f"{value:.3f}" for value in body.position)
            inertia = " ".join(f"{value:.0f}" for value in body.inertia)
            rows.append([body.name, body.kind, f"{body.mass:.0f}", inertia, position])
        return ["body", "kind", "mass (kg)", "Ixx Iyy Izz (kg m²)", "x y z (m)"], rows
