"""Mechanism files, `railsim-mechanism/1`: planar linkages with one degree of freedom.

Bodies with points, joints between points, a driver, actuators and force elements.  Every number may
be an expression of the parameters in `[parameters]`; `provenance` says where each of them is from.
Axes x, y; angles from x, anticlockwise; gravity along -y unless said otherwise.  SI and rad.

What one key says is checked here, what several say together in `mechanism_faults`.
"""

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from railsim.definitions import base
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.mechanism import parts
from railsim.errors import Fault, argument_error, nearest


class Driver(base.Definition):
    """The coordinate that moves the mechanism: an angle, a length or a coordinate."""

    angle: parts.BodyName | None = None
    """Body whose angle it is"""
    length: parts.Pair | None = None
    """Points whose distance it is"""
    coordinate: parts.PointName | None = None
    """Point whose coordinate it is"""
    axis: Literal["x", "y"] = "y"
    """Which coordinate"""
    zero: parts.Quantity = 0.0
    """What the angle, length or coordinate is where the driver is 0 [rad or m]"""
    start: parts.Quantity = 0.0
    """Value of the driver at the start of the motion [rad or m]"""
    end: parts.Quantity
    """Value of the driver at its end [rad or m]"""

    @base.check
    def _one(self) -> None:
        if sum(x is not None for x in (self.angle, self.length, self.coordinate)) != 1:
            raise ValueError("one of 'angle', 'length' and 'coordinate'")


class Sampling(base.Definition):
    """Positions at which results are written."""

    points: Annotated[int, Field(strict=True, ge=3, le=100_000)] = 1000
    """Number of positions, both ends included"""
    by: Literal["travel", "length", "time"] = "travel"
    """Quantity in equal steps: the driver, the actuator's length, or time at its motion law"""


class Output(base.Definition):
    """The point that the mechanism is there to move."""

    point: parts.PointName
    """The point; its height is its y less that at the start"""
    axis: Literal["x", "y"] = "y"
    """Direction in which it is to move: ratio, zone and contact force are taken along it"""


class Zone(base.Definition):
    """Working range of the output."""

    low: parts.Quantity
    """Lowest height over that at the start [m]"""
    work: parts.Quantity
    """Height at work [m]"""
    high: parts.Quantity
    """Highest height [m]"""


class Solve(base.Definition):
    """What is unknown."""

    unknown: parts.ActuatorName
    """Actuator whose force (or torque) holds the mechanism"""
    actuator: parts.ActuatorName | None = None
    """Actuator whose length the ratios are taken over; by default the unknown one"""


class Contact(base.Definition):
    """Static contact force of the output at a pressure held in the actuator."""

    force: parts.Quantity = 100.0
    """Contact force wanted at work height [N]"""
    pressure: parts.QuantityOrAuto = parts.AUTO
    """Pressure held [Pa]; by default what gives that force at work height"""


class Motion(base.Definition):
    """Motion law of an actuator's length or a body's angle, for inverse dynamics."""

    actuator: parts.ActuatorName | None = None
    """Actuator whose length follows the law"""
    angle: parts.BodyName | None = None
    """Body whose angle follows it, instead, such as a crank"""
    unknown: parts.ActuatorName | None = None
    """Actuator whose force drives the motion; by default the same, of an angle that of `[solve]`"""
    law: Literal["constant_speed", "polynomial_345", "table"] = "constant_speed"
    """Constant speed, the 3-4-5 polynomial from rest to rest, or a table"""
    speed: parts.Positive | None = None
    """Speed of the length [m/s] or angle [rad/s], for a constant speed"""
    duration: parts.Positive | None = None
    """Time for the whole range [s]"""
    table: tuple[tuple[parts.Quantity, parts.Quantity], ...] | None = None
    """Rows [time s, change of length m or angle rad since the start], a cubic spline"""
    points: Annotated[int, Field(strict=True, ge=3, le=100_000)] = 401
    """Number of points in time"""

    @base.check
    def _complete(self) -> None:
        if (self.actuator is None) == (self.angle is None):
            raise ValueError("either 'actuator' (its length) or 'angle' (of a body)")
        if self.law == "table":
            if self.table is None or len(self.table) < 4:
                raise ValueError("law = 'table' needs a 'table' of four rows at least")
        elif self.law == "polynomial_345":
            if self.duration is None:
                raise ValueError("law = 'polynomial_345' needs a 'duration'")
        elif (self.speed is None) == (self.duration is None):
            raise ValueError("law = 'constant_speed' needs 'speed' or 'duration'")


class Release(base.Definition):
    """Free motion: let go at rest, under the elements' forces alone."""

    start: parts.Quantity
    """Value of the driver where it is let go [rad or m]"""
    until: parts.Quantity
    """Value of the driver at which the motion ends [rad or m]"""
    duration: parts.Positive = 10.0
    """Time after which it ends in any case [s]"""


class CatalogueRow(base.Definition):
    """A series of gas springs in a catalogue."""

    name: base.Text
    """Name of the series"""
    body: parts.Positive | None = None
    """Diameter of the body [m]"""
    rod: parts.Positive | None = None
    """Diameter of the rod [m]"""
    stroke: tuple[parts.Quantity, parts.Quantity] | None = None
    """Smallest and largest stroke [m]"""
    strokes: tuple[parts.Quantity, ...] | None = None
    """Strokes that are made [m], instead"""
    F1: tuple[parts.Quantity, parts.Quantity]
    """Smallest and largest force F1 [N]"""
    progression: parts.Progression | None = None
    """Progression"""
    extended: tuple[parts.Quantity, parts.Quantity] | None = None
    """Extended length as factor times stroke plus constant [1, m]"""
    F1_tolerance: tuple[tuple[parts.Quantity, parts.Quantity, parts.Quantity], ...] | None = None
    """Rows [up to F1, minus, plus] of the maker's tolerance [N]"""
    unlock: parts.NonNegative = 0.0
    """Travel beyond the range of use that unlocks it [m]"""
    lock_extension: parts.Quantity | None = None
    """Force that it holds locked against extension [N]"""
    lock_compression: parts.Quantity | None = None
    """Force that it holds locked against compression, over F1"""

    @base.check
    def _one(self) -> None:
        if (self.stroke is None) == (self.strokes is None):
            raise ValueError("either 'stroke' or 'strokes'")


class Selection(base.Definition):
    """A gas spring to be found in a catalogue."""

    element: parts.GasSpringName
    """The gas spring"""
    catalogue: parts.CatalogueName
    """The catalogue"""


class Lid(base.Definition):
    """Quick check of a lid's gas springs by the makers' formula F1 = G D/(b n) 9.8 alpha."""

    element: parts.GasSpringName
    """Gas spring whose `F1` is checked"""
    mass: parts.Positive
    """Mass of the lid G [kg]"""
    centre: parts.Positive
    """Lever of its centre of gravity about the hinge, lid open D [m]"""
    lever: parts.Positive
    """Lever of the springs about the hinge, lid open b [m]"""
    springs: parts.Positive = 2.0
    """Number of springs n"""
    factor: parts.Positive = 1.1
    """Factor of safety alpha"""


class Envelope(base.Definition):
    """A box that points may not leave."""

    points: tuple[parts.PointName, ...] = Field(min_length=1)
    """The points"""
    x: tuple[parts.Quantity, parts.Quantity] | None = None
    """Smallest and largest x [m]"""
    y: tuple[parts.Quantity, parts.Quantity] | None = None
    """Smallest and largest y [m]"""


RESULTS = ("travel", "stroke", "length_start", "length_end", "max_force", "min_force")
"""Results that `published` may name, beside the smallest of each angle."""


Objective = Literal["follow", "constant", "linear", "constant_force", "peak_force"]


class Optimise(base.Definition):
    """Search for parameters."""

    objective: Annotated[
        Annotated[Objective, Tag("word")]
        | Annotated[dict[Objective, Annotated[float, Field(strict=True, ge=0.0)]], Tag("table")],
        Discriminator(lambda value: "table" if isinstance(value, dict) else "word"),
    ] = "follow"
    """What to make small, or a table of objectives with their weights"""
    reference: base.Text | None = None
    """Mechanism whose ratio is followed at equal height of the output"""
    share: tuple[base.Text, ...] = ("upper_*", "m_*", "travel", "zone_*")
    """Parameters (patterns) that the reference takes from this file"""
    points: Annotated[int, Field(strict=True, ge=3, le=10_000)] = 215
    """Number of positions in the zone"""
    sample: Literal["length", "travel"] = "length"
    """Positions in equal steps of the (reference's) actuator length or of the travel"""
    range: Literal["zone", "travel"] = "zone"
    """Whether the positions cover the zone or the whole travel"""
    target: parts.Quantity | None = None
    """Ratio wanted (constant), or wanted at height 0 (linear)"""
    slope: parts.Quantity = 0.0
    """Change of the wanted ratio over the height [1/m], for linear"""
    min_transmission_angle: parts.Quantity | None = None
    """Smallest transmission angle [rad]"""
    min_length: parts.Quantity | None = None
    """Smallest length of the actuator [m]"""
    max_stroke: parts.Quantity | None = None
    """Largest stroke of the actuator [m]"""
    available_force: parts.Quantity | None = None
    """Largest force of the actuator [N]"""
    envelope: tuple[Envelope, ...] = ()
    """Boxes that points may not leave"""
    starts: base.Count = 20
    """Number of starts of the search; the first is the file's own"""
    seed: base.Whole = 1
    """Seed of the other starts"""
    assemblies: dict[base.Name, tuple[parts.Quantity, ...]] = base.EMPTY_TABLE
    """Parameters that choose an assembly, with the values that starts may take"""
    bounds: dict[base.Name, tuple[parts.Quantity, parts.Quantity]] = Field(min_length=1)
    """Smallest and largest value of each parameter that may change"""


class Mechanism(FileDefinition):
    """A planar linkage with one degree of freedom: everything that a mechanism file says."""

    KIND: ClassVar = "mechanism"

    format: Literal["railsim-mechanism/1"]
    name: base.Text = "mechanism"
    """What it is called in tables and plots"""
    source: base.Text | None = None
    """Where it comes from"""
    remarks: tuple[base.Text, ...] = ()
    """Remarks on its numbers"""
    parameters: dict[base.Name, parts.QuantityOrAuto] = base.EMPTY_TABLE
    """Numbers that may be varied, in SI and rad, or expressions of others"""
    derived: dict[base.Name, parts.Quantity] = base.EMPTY_TABLE
    """Intermediate results by name, for use in other expressions"""
    choices: dict[base.Name, tuple[base.Finite, ...]] = base.EMPTY_TABLE
    """Parameters that may have some values only, with these, as the sign of an assembly"""
    provenance: dict[base.Name, tuple[base.Name, ...]] = base.EMPTY_TABLE
    """Parameters by where they are from: printed, derived, reconstructed, new, ..."""
    units: dict[base.Text, tuple[base.Name, ...]] = base.EMPTY_TABLE
    """Parameters by their unit; those not listed are lengths"""
    ground: parts.Ground = parts.Ground()
    """What does not move"""
    bodies: dict[base.Name, parts.Body] = Field(min_length=1)
    """Bodies by name"""
    start: dict[base.Name, parts.Start] = base.EMPTY_TABLE
    """Pose of the bodies at the driver's start, roughly"""
    joints: dict[base.Name, parts.Joint] = Field(min_length=1)
    """Joints by name"""
    driver: Driver
    """The coordinate that moves the mechanism"""
    actuators: dict[base.Name, parts.Actuator] = base.EMPTY_TABLE
    """Actuators and other unknown forces by name"""
    elements: dict[base.Name, parts.Element] = base.EMPTY_TABLE
    """Masses, springs, dampers, given forces by name"""
    angles: dict[base.Name, parts.Angle] = base.EMPTY_TABLE
    """Transmission angles by name"""
    sampling: Sampling = Sampling()
    """Positions at which results are written"""
    output: Output | None = None
    """The point that the mechanism moves"""
    zone: Zone | None = None
    """Working range of the output"""
    solve: Solve | None = None
    """What is unknown"""
    contact: Contact | None = None
    """Static contact force of the output"""
    motion: Motion | None = None
    """Motion law for inverse dynamics"""
    release: Release | None = None
    """Free motion"""
    catalogues: dict[base.Name, tuple[CatalogueRow, ...]] = base.EMPTY_TABLE
    """Catalogues of gas springs by name"""
    selection: tuple[Selection, ...] = ()
    """Gas springs to be found in a catalogue"""
    lid: Lid | None = None
    """Quick check of a lid's gas springs"""
    optimise: Optimise | None = None
    """Search for parameters"""
    published: dict[base.Name, parts.Quantity] = base.EMPTY_TABLE
    """Results that the source prints, by their names, shown beside ours [SI]"""
    tolerances: dict[base.Name, parts.Quantity] = base.EMPTY_TABLE
    """Tolerances of parameters, plus and minus"""
    cases: dict[base.Name, dict[base.Name, parts.QuantityOrAuto]] = base.EMPTY_TABLE
    """Other values of parameters by the name of a case"""

    @classmethod
    def note_assigned(
        cls, tables: dict[str, Any], keys: Iterable[str], before: FileDefinition | None = None
    ) -> None:
        """List parameters that are or were set by their keys in `provenance.set`."""
        earlier = before.provenance.get("set", ()) if isinstance(before, Mechanism) else ()
        paths = [key.split(".") for key in keys]
        changed = [path[1] for path in paths if path[0] == "parameters" and len(path) == 2]
        parameters = tables.get("parameters", {})
        if changed := [name for name in dict.fromkeys([*earlier, *changed]) if name in parameters]:
            tables["provenance"] = {**tables.get("provenance", {}), "set": changed}

    def contradictions(self) -> list[Fault]:
        """Return what is wrong between the parts."""
        from railsim.definitions.mechanism.faults import mechanism_faults  # of this definition

        return mechanism_faults(self)

    def unusual(self) -> list[base.Remark]:
        """Return remarks on the mechanism."""
        from railsim.definitions.mechanism.faults import mechanism_remarks

        return [*mechanism_remarks(self)]

    def in_case(self, case: str | None) -> "Mechanism":
        """Return the mechanism with the parameters of a case; None is the base.

        Raises InputError: there is no such case.
        """
        if case is None:
            return self
        if case not in self.cases:
            allowed = nearest(case, self.cases) if self.cases else f"'{self.name}' has no cases"
            raise argument_error("case", f"no case '{case}'", allowed)
        return self.with_parameters(self.cases[case])

    @property
    def unknown(self) -> str:
        """Name of the actuator whose force holds the mechanism; only where there is `[solve]`."""
        assert self.solve is not None
        return self.solve.unknown

    @property
    def held_by(self) -> parts.Actuator:
        """The unknown actuator itself."""
        return self.actuators[self.unknown]

    @property
    def automatic(self) -> set[str]:
        """Parameters that are left to the program."""
        return {name for name, value in self.parameters.items() if value == parts.AUTO}

    def with_parameters(self, changes: Mapping[str, float | str]) -> "Mechanism":
        """Return the mechanism with some parameters changed."""
        return self.model_copy(update={"parameters": {**self.parameters, **changes}})

    def provenance_of(self, name: str) -> str:
        """Where a parameter's value is from; what was set later comes first."""
        homes = [home for home, names in self.provenance.items() if name in names]
        for late in ("set", "optimised"):
            if late in homes:
                return late
        return homes[-1] if homes else "not stated"

    def unit_of(self, name: str) -> str:
        """Unit of a parameter."""
        return next((unit for unit, names in self.units.items() if name in names), "m")
