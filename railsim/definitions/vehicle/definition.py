"""Vehicle files, `railsim-vehicle/1`: bodies, wheelsets, axleboxes, force elements, assemblies.

Everything is a table with its own name, so that an extending file can replace a part of it.
Positions are those of the nominal vehicle at rest on straight level track: x forward from the
vehicle's origin, y to the right, z down from the plane through the rail tops.  An assembly is a
group that stands at each of its placements; its coordinates count from there.
"""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from railsim.definitions.base import EMPTY_TABLE, Flag, Name, Text
from railsim.definitions.elements import AnyElement
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.section_files import embed_wheel_sections
from railsim.definitions.vehicle.flatten import flatten, position_faults
from railsim.definitions.vehicle.laws import Controller, Law, Signal, with_sources
from railsim.definitions.vehicle.loads import LoadCase, LoadName
from railsim.definitions.vehicle.names import name_faults
from railsim.definitions.vehicle.tables import Assembly, Axlebox, Body, Point, Service, Wheelset
from railsim.errors import Fault
from railsim.plottable import Plottable
from railsim.table import Column, Table


class Vehicle(FileDefinition, Plottable):
    """A vehicle: everything that its file says."""

    KIND: ClassVar = "vehicle"

    format: Literal["railsim-vehicle/1"]
    name: Text
    """What the vehicle is called in tables and plots"""
    source: Text | None = None
    """Where the numbers come from"""
    load: LoadName | None = None
    """Load case in force; `design`, the default: the numbers of the bodies themselves"""
    loads: dict[Name, LoadCase] = EMPTY_TABLE
    """Load cases by name"""
    turned: Flag = False
    """Turned end for end when it is read, so that its other end is ahead; the keys of the file and
    assignments count as if it were not"""
    reference: Text | None = None
    """Full name of the body whose travelled distance is the vehicle's `distance`; by default the
    first body, else the first wheelset"""
    service: Service | None = None
    """Approved operating conditions of the vehicle; assessments need it"""
    sensors: dict[Name, Point] = EMPTY_TABLE
    """Points whose motion is recorded with `settings.outputs.sensors`, by name, beside the
    standard ones"""
    laws: dict[Name, Law] | None = None
    """User-defined laws by name: Python functions, executed only with permission"""
    signals: dict[Name, Signal] | None = None
    """What is measured during a run, by name"""
    controllers: dict[Name, Controller] | None = None
    """What reads signals and commands actuators, by name"""
    bodies: dict[Name, Body] = EMPTY_TABLE
    """Bodies by name"""
    wheelsets: dict[Name, Wheelset] = EMPTY_TABLE
    """Wheelsets by name"""
    axleboxes: dict[Name, Axlebox] = EMPTY_TABLE
    """Axleboxes by name"""
    elements: dict[Name, AnyElement] = EMPTY_TABLE
    """Force elements by name"""
    assemblies: dict[Name, Assembly] = EMPTY_TABLE
    """Assemblies by name"""

    @property
    def mass(self) -> float:
        """Mass of all bodies in the load case [kg]."""
        return flatten(self).mass

    @property
    def name_with_load(self) -> str:
        """Name, and the load case where one is chosen."""
        return f"{self.name}, load case {self.load}" if self.load else self.name

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
        if self.turned and (self.signals or self.controllers):
            found = "the vehicle has signals or controllers"
            return [Fault("", "turned", found, "none: their signs cannot be turned")]
        return position_faults(self)

    def settled(self) -> Self:
        """Return the vehicle as it stands on the track."""
        from railsim.definitions.mirror import turned_vehicle

        return turned_vehicle(self) if self.turned else self

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
