"""Mechanism files, `railsim-mechanism/1`: planar linkages with one degree of freedom.

Bodies with points, joints between points, a driver, actuators and force elements.  Every number may
be an expression of the parameters in `[parameters]`; `provenance` says where each of them is from.
Axes x, y; angles from x, anticlockwise; gravity along -y unless said otherwise.  SI and rad.

What one key says is checked here, what several say together in `mechanism_faults`.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, PlainValidator, Tag, WithJsonSchema, model_validator

from railsim.definitions.base import Count, Definition, FileDefinition, Flag, Name, Text
from railsim.definitions.expressions import Expression

MECHANISM_FORMAT = "railsim-mechanism/1"
AUTO = "auto"


def _quantity(value: Any) -> float | str:
    if isinstance(value, Expression):
        return value
    if isinstance(value, str):
        return Expression(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("a number, or an expression of parameters in quotes")
    if not math.isfinite(value):
        raise ValueError("must be finite")
    return float(value)


def _quantity_or_auto(value: Any) -> float | str:
    return AUTO if value == AUTO else _quantity(value)


Quantity = Annotated[
    float | str,
    PlainValidator(_quantity),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]}),
]
QuantityOrAuto = Annotated[
    float | str,
    PlainValidator(_quantity_or_auto),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]}),
]
PointName = Annotated[
    str, Field(strict=True, pattern=r"^[A-Za-z_][A-Za-z0-9_-]*\.[A-Za-z_][A-Za-z0-9_-]*$")
]
Pair = tuple[PointName, PointName]


class Polar(Definition):
    """A place in polar coordinates."""

    radius: Quantity
    """Distance from the body's origin [m]"""
    angle: Quantity
    """Direction from the body's x axis [rad]"""


def _place_tag(value: Any) -> str:
    return "polar" if isinstance(value, dict | Polar) else "cartesian"


Place = Annotated[
    Annotated[tuple[Quantity, Quantity], Tag("cartesian")] | Annotated[Polar, Tag("polar")],
    Discriminator(_place_tag),
]


class Ground(Definition):
    """What does not move."""

    points: dict[Name, Place] = Field(default_factory=dict)
    """Places by name [m]"""
    gravity: Quantity = 9.81
    """Gravitational acceleration along -y [m/s2]"""


class Body(Definition):
    """A rigid body; its axes are where its points say."""

    points: dict[Name, Place] = Field(default_factory=dict)
    """Places by name in the body's axes [m]"""
    mass: Quantity = 0.0
    """Mass [kg]"""
    centre: Place = (0.0, 0.0)
    """Centre of gravity in the body's axes [m]"""
    inertia: Quantity = 0.0
    """Moment of inertia about the centre of gravity [kg m2]"""
    outline: tuple[Name, ...] = ()
    """Points joined by lines in drawings; by default all in their order"""


class Start(Definition):
    """Pose of a body from which the assembly at the driver's start is found."""

    x: QuantityOrAuto = AUTO
    """Place of the body's origin [m]; by default from a revolute joint or 0"""
    y: QuantityOrAuto = AUTO
    """The same along y [m]"""
    angle: Quantity = 0.0
    """Angle of the body [rad]"""


class Revolute(Definition):
    """Two points that stay together."""

    revolute: Pair
    """The points"""


class Link(Definition):
    """A rod without mass between two points, hinged at both."""

    link: Pair
    """The points"""
    length: Quantity
    """Distance between them [m]"""


class Slot(Definition):
    """A pin in a straight slot."""

    slot: Pair
    """Pin; point on another body from which the slot is measured"""
    angle: Quantity = 0.0
    """Direction of the slot in the axes of that body [rad]"""
    offset: Quantity = 0.0
    """Distance of the slot from that point, to the left of its direction [m]"""


class Prismatic(Definition):
    """A body that slides along a line of another one without turning against it."""

    prismatic: Pair
    """Point of the sliding body; point on the other one from which the line is measured"""
    angle: Quantity = 0.0
    """Direction of the line in the axes of the other body [rad]"""
    offset: Quantity = 0.0
    """Distance of the line from that point, to the left of its direction [m]"""
    turned: Quantity = 0.0
    """Angle of the sliding body less that of the other one [rad]"""


class Arc(Definition):
    """An arc of the path of the roller's centre on a cam."""

    radius: Quantity
    """Radius [m]"""
    turns: Literal["left", "right"]
    """Side to which the path turns on its way"""
    length: Quantity | None = None
    """Length along the path [m], of a path of tangent arcs"""
    centre: Place | None = None
    """Centre in the cam's axes [m], instead of tangency"""
    begin: Quantity | None = None
    """Direction from the given centre to the arc's begin [rad]; by default where its rates equal
    those of the arc before, on the line through both centres"""
    end: Quantity | None = None
    """The same for its end [rad]"""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.length is None) == (self.centre is None):
            raise ValueError("either 'length' (tangent arcs) or 'centre'")
        return self


class Cam(Definition):
    """A roller on a cam, kept in contact in both directions."""

    cam: PointName
    """Centre of the roller"""
    path: PointName | None = None
    """Point of the cam where the path of the roller's centre begins, for tangent arcs"""
    body: Name | None = None
    """Body that carries the cam, where arcs have centres"""
    tangent: Quantity = 0.0
    """Direction of the path at its begin, in the axes of the cam's body [rad]"""
    arcs: tuple[Arc, ...] = Field(min_length=1)
    """Arcs from the begin of the motion on"""

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        tangent = [arc.length is not None for arc in self.arcs]
        if any(tangent) != all(tangent):
            raise ValueError("all arcs with 'length', or all with 'centre'")
        if tangent[0] == (self.path is None) or tangent[0] != (self.body is None):
            raise ValueError("'path' goes with arcs of a 'length', 'body' with arcs of a 'centre'")
        return self


def _by_key(*keys: str) -> Any:
    """A discriminator: the first of these keys that a table has."""

    def tag(value: Any) -> str | None:
        for key in keys:
            if (key in value) if isinstance(value, Mapping) else hasattr(value, key):
                return f"a {key}"
        return None

    listed = ", ".join(keys)
    return Discriminator(
        tag,
        custom_error_type="one_of",
        custom_error_message=f"one of the keys {listed} must say what it is",
    )


Joint = Annotated[
    Annotated[Revolute, Tag("a revolute")]
    | Annotated[Link, Tag("a link")]
    | Annotated[Slot, Tag("a slot")]
    | Annotated[Prismatic, Tag("a prismatic")]
    | Annotated[Cam, Tag("a cam")],
    _by_key("revolute", "link", "slot", "prismatic", "cam"),
]


class Cylinder(Definition):
    """A pneumatic or hydraulic cylinder; its force is an unknown, or follows from a pressure."""

    cylinder: Pair
    """Its ends"""
    bore: Quantity
    """Bore of one cylinder [m]"""
    rod: Quantity = 0.0
    """Diameter of the rod [m]; counts when the cylinder pulls"""
    count: Quantity = 1.0
    """Cylinders side by side"""
    supply_pressure: Quantity
    """Available pressure [Pa]"""
    acts: Literal["push", "pull"] = "push"
    """Chamber under pressure"""
    pin_to_pin: Quantity | None = None
    """Shortest length of the cylinder between its pins less its stroke [m]"""
    bores: tuple[Quantity, ...] = (0.032, 0.04, 0.05, 0.063, 0.08, 0.1, 0.125, 0.16, 0.2)
    """Bores that are made [m]"""
    strokes: tuple[Quantity, ...] = (
        0.025, 0.05, 0.08, 0.1, 0.125, 0.16, 0.2, 0.25, 0.32, 0.4, 0.5,
    )  # fmt: skip
    """Strokes that are made [m]"""


class AirSpring(Definition):
    """An air spring by its table: force over height and pressure, linear in between."""

    air_spring: Pair
    """Its ends"""
    heights: tuple[Quantity, ...] = Field(min_length=2)
    """Heights of the rows, rising [m]"""
    pressures: tuple[Quantity, ...] = Field(min_length=2)
    """Pressures of the columns, rising [Pa]"""
    forces: tuple[tuple[Quantity, ...], ...] = Field(min_length=2)
    """Forces, a row for each height [N]"""
    supply_pressure: Quantity | None = None
    """Available pressure [Pa]"""

    @model_validator(mode="after")
    def _rectangular(self) -> Self:
        if len(self.forces) != len(self.heights):
            raise ValueError(f"{len(self.forces)} rows of 'forces', {len(self.heights)} 'heights'")
        for row in self.forces:
            if len(row) != len(self.pressures):
                raise ValueError(f"a row of {len(row)} 'forces', {len(self.pressures)} 'pressures'")
        return self


class Piston(Definition):
    """An actuator along a line; its force is an unknown."""

    piston: Pair
    """Its ends"""


class HandForce(Definition):
    """A force at a point, of unknown size."""

    push: PointName
    """Where it acts"""
    angle: Quantity
    """Direction in which it is positive [rad]"""
    turns: Flag = True
    """Whether the direction turns with the body of the point"""


class HandTorque(Definition):
    """A torque on a body, of unknown size."""

    turn: Name
    """The body"""


Actuator = Annotated[
    Annotated[Cylinder, Tag("a cylinder")]
    | Annotated[AirSpring, Tag("a air_spring")]
    | Annotated[Piston, Tag("a piston")]
    | Annotated[HandForce, Tag("a push")]
    | Annotated[HandTorque, Tag("a turn")],
    _by_key("cylinder", "air_spring", "piston", "push", "turn"),
]


class PointMass(Definition):
    """A mass at a point."""

    point_mass: PointName
    """Where it is"""
    mass: Quantity
    """Mass [kg]"""


class Force(Definition):
    """A given force at a point."""

    force: PointName
    """Where it acts"""
    size: Quantity
    """Its size [N]"""
    angle: Quantity
    """Its direction [rad]"""
    turns: Flag = False
    """Whether the direction turns with the body of the point"""


class Torque(Definition):
    """A given torque on a body."""

    torque: Name
    """The body"""
    size: Quantity
    """Its size, anticlockwise [N m]"""


class Spring(Definition):
    """A linear spring between two points."""

    spring: Pair
    """Its ends"""
    stiffness: Quantity
    """Stiffness [N/m]"""
    free_length: Quantity
    """Length without force [m]"""


class JointFriction(Definition):
    """Dry friction of joints against a body's turning."""

    joint_friction: Name
    """Body that turns against the ground"""
    moment: Quantity
    """Torque against its motion [N m]"""


class Damper(Definition):
    """A linear damper between two points."""

    damper: Pair
    """Its ends"""
    damping: Quantity
    """Damping [N s/m]"""


class Stop(Definition):
    """A one-sided end stop between two points."""

    stop: Pair
    """Its ends"""
    length: Quantity
    """Distance at which it is met [m]"""
    side: Literal["shortest", "longest"] = "shortest"
    """Whether the distance may not become shorter, or not longer"""
    stiffness: Quantity
    """Stiffness [N/m]"""
    damping: Quantity = 0.0
    """Damping while it is met [N s/m]"""


class GasSpring(Definition):
    """A gas spring between two points."""

    gas_spring: Pair
    """Its ends"""
    F1: Quantity
    """Force at 20 C without friction: fully extended, or fully compressed if it pulls [N]"""
    progression: Quantity
    """Ratio of the force at the other end of the stroke to `F1`"""
    stroke: Quantity
    """Stroke [m]"""
    extended: Quantity
    """Length fully extended [m]"""
    law: Literal["linear", "isothermal"] = "linear"
    """Force over the stroke"""
    acts: Literal["compression", "traction"] = "compression"
    """Whether it pushes or pulls"""
    friction: Quantity = 0.0
    """Friction against the motion [N]"""
    damping: Quantity = 0.0
    """Damping [N s/m]"""
    end_damping: Quantity | None = None
    """Damping over the last part of the extension (oil) [N s/m]"""
    end_length: Quantity = 0.0
    """Length of that part [m]"""
    temperature: Quantity = 20.0
    """Temperature of the gas [C]"""
    rod: Quantity | None = None
    """Diameter of the rod [m], for the pressure of the gas"""
    service: tuple[Quantity, Quantity] = (-30.0, 80.0)
    """Lowest and highest temperature in service [C]"""


Element = Annotated[
    Annotated[PointMass, Tag("a point_mass")]
    | Annotated[Force, Tag("a force")]
    | Annotated[Torque, Tag("a torque")]
    | Annotated[Spring, Tag("a spring")]
    | Annotated[JointFriction, Tag("a joint_friction")]
    | Annotated[Damper, Tag("a damper")]
    | Annotated[Stop, Tag("a stop")]
    | Annotated[GasSpring, Tag("a gas_spring")],
    _by_key(
        "point_mass", "force", "torque", "spring", "joint_friction", "damper", "stop", "gas_spring"
    ),
]


class Driver(Definition):
    """The coordinate that moves the mechanism: an angle, a length or a coordinate."""

    angle: Name | None = None
    """Body whose angle it is"""
    length: Pair | None = None
    """Points whose distance it is"""
    coordinate: PointName | None = None
    """Point whose coordinate it is"""
    axis: Literal["x", "y"] = "y"
    """Which coordinate"""
    zero: Quantity = 0.0
    """What the angle, length or coordinate is where the driver is 0 [rad or m]"""
    start: Quantity = 0.0
    """Value of the driver at the start of the motion [rad or m]"""
    end: Quantity
    """Value of the driver at its end [rad or m]"""

    @model_validator(mode="after")
    def _one(self) -> Self:
        if sum(x is not None for x in (self.angle, self.length, self.coordinate)) != 1:
            raise ValueError("one of 'angle', 'length' and 'coordinate'")
        return self


class Sampling(Definition):
    """Positions at which results are written."""

    points: Annotated[int, Field(strict=True, ge=3, le=100_000)] = 1000
    """Number of positions, both ends included"""
    by: Literal["travel", "length", "time"] = "travel"
    """Quantity in equal steps: the driver, the actuator's length, or time at its motion law"""


class Angle(Definition):
    """An angle between two lines, folded to 0 to 90 degrees."""

    between: tuple[Pair, Pair]
    """The lines, each from one point to another"""
    offset: Quantity = 0.0
    """Added to the angle of the first line less that of the second [rad]"""
    limited: Flag = True
    """Whether it is a transmission angle that the least one of `[optimise]` holds for"""


class Output(Definition):
    """The point that the mechanism is there to move."""

    point: PointName
    """The point; its height is its y less that at the start"""


class Zone(Definition):
    """Working range of the output."""

    low: Quantity
    """Lowest height over that at the start [m]"""
    work: Quantity
    """Height at work [m]"""
    high: Quantity
    """Highest height [m]"""


class Solve(Definition):
    """What is unknown."""

    unknown: Name
    """Actuator whose force (or torque) holds the mechanism"""
    actuator: Name | None = None
    """Actuator whose length the ratios are taken over; by default the unknown one"""


class Contact(Definition):
    """Static contact force of the output at a pressure held in the actuator."""

    force: Quantity = 100.0
    """Contact force wanted at work height [N]"""
    pressure: QuantityOrAuto = AUTO
    """Pressure held [Pa]; by default what gives that force at work height"""


class Motion(Definition):
    """Motion law of an actuator's length, for inverse dynamics."""

    actuator: Name
    """Actuator whose length follows the law"""
    unknown: Name | None = None
    """Actuator whose force drives the motion; by default the same"""
    law: Literal["constant_speed", "polynomial_345", "table"] = "constant_speed"
    """Constant speed, the 3-4-5 polynomial from rest to rest, or a table"""
    speed: Quantity | None = None
    """Speed of the length [m/s], for a constant speed"""
    duration: Quantity | None = None
    """Time for the whole range [s]"""
    table: tuple[tuple[Quantity, Quantity], ...] | None = None
    """Rows [time s, change of length since the start m], a cubic spline, for a table"""
    points: Annotated[int, Field(strict=True, ge=3, le=100_000)] = 401
    """Number of points in time"""

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.law == "table":
            if self.table is None or len(self.table) < 4:
                raise ValueError("law = 'table' needs a 'table' of four rows at least")
        elif self.law == "polynomial_345":
            if self.duration is None:
                raise ValueError("law = 'polynomial_345' needs a 'duration'")
        elif (self.speed is None) == (self.duration is None):
            raise ValueError("law = 'constant_speed' needs 'speed' or 'duration'")
        return self


class Release(Definition):
    """Free motion: let go at rest, under the elements' forces alone."""

    start: Quantity
    """Value of the driver where it is let go [rad or m]"""
    until: Quantity
    """Value of the driver at which the motion ends [rad or m]"""
    duration: Quantity = 10.0
    """Time after which it ends in any case [s]"""


class CatalogueRow(Definition):
    """A series of gas springs in a catalogue."""

    name: Text
    """Name of the series"""
    body: Quantity | None = None
    """Diameter of the body [m]"""
    rod: Quantity | None = None
    """Diameter of the rod [m]"""
    stroke: tuple[Quantity, Quantity] | None = None
    """Smallest and largest stroke [m]"""
    strokes: tuple[Quantity, ...] | None = None
    """Strokes that are made [m], instead"""
    F1: tuple[Quantity, Quantity]
    """Smallest and largest force F1 [N]"""
    progression: Quantity | None = None
    """Progression"""
    extended: tuple[Quantity, Quantity] | None = None
    """Extended length as factor times stroke plus constant [1, m]"""

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.stroke is None) == (self.strokes is None):
            raise ValueError("either 'stroke' or 'strokes'")
        return self


class Selection(Definition):
    """A gas spring to be found in a catalogue."""

    element: Name
    """The gas spring"""
    catalogue: Name
    """The catalogue"""


class Lid(Definition):
    """Quick check of a lid's gas springs by the makers' formula F1 = G D/(b n) 9.8 alpha."""

    element: Name
    """Gas spring whose `F1` is checked"""
    mass: Quantity
    """Mass of the lid G [kg]"""
    centre: Quantity
    """Lever of its centre of gravity about the hinge, lid open D [m]"""
    lever: Quantity
    """Lever of the springs about the hinge, lid open b [m]"""
    springs: Quantity = 2.0
    """Number of springs n"""
    factor: Quantity = 1.1
    """Factor of safety alpha"""


class Envelope(Definition):
    """A box that points may not leave."""

    points: tuple[PointName, ...] = Field(min_length=1)
    """The points"""
    x: tuple[Quantity, Quantity] | None = None
    """Smallest and largest x [m]"""
    y: tuple[Quantity, Quantity] | None = None
    """Smallest and largest y [m]"""


RESULTS = ("travel", "stroke", "length_start", "length_end", "max_force", "min_force")
"""Results that `published` may name, beside the smallest of each angle."""


def _table_or_word(value: Any) -> str:
    return "table" if isinstance(value, dict) else "word"


Objective = Literal["follow", "constant", "linear", "constant_force", "peak_force"]


class Optimise(Definition):
    """Search for parameters."""

    objective: Annotated[
        Annotated[Objective, Tag("word")]
        | Annotated[dict[Objective, Annotated[float, Field(strict=True, ge=0.0)]], Tag("table")],
        Discriminator(_table_or_word),
    ] = "follow"
    """What to make small, or a table of objectives with their weights"""
    reference: Text | None = None
    """Mechanism whose ratio is followed at equal height of the output"""
    share: tuple[Text, ...] = ("upper_*", "m_*", "travel", "zone_*")
    """Parameters (patterns) that the reference takes from this file"""
    points: Annotated[int, Field(strict=True, ge=3, le=10_000)] = 215
    """Number of positions in the zone"""
    sample: Literal["length", "travel"] = "length"
    """Positions in equal steps of the (reference's) actuator length or of the travel"""
    range: Literal["zone", "travel"] = "zone"
    """Whether the positions cover the zone or the whole travel"""
    target: Quantity | None = None
    """Ratio wanted (constant), or wanted at height 0 (linear)"""
    slope: Quantity = 0.0
    """Change of the wanted ratio over the height [1/m], for linear"""
    min_transmission_angle: Quantity | None = None
    """Smallest transmission angle [rad]"""
    min_length: Quantity | None = None
    """Smallest length of the actuator [m]"""
    max_stroke: Quantity | None = None
    """Largest stroke of the actuator [m]"""
    available_force: Quantity | None = None
    """Largest force of the actuator [N]"""
    envelope: tuple[Envelope, ...] = ()
    """Boxes that points may not leave"""
    starts: Count = 20
    """Number of starts of the search; the first is the file's own"""
    seed: Annotated[int, Field(strict=True, ge=0)] = 1
    """Seed of the other starts"""
    assemblies: dict[Name, tuple[Quantity, ...]] = Field(default_factory=dict)
    """Parameters that choose an assembly, with the values that starts may take"""
    bounds: dict[Name, tuple[Quantity, Quantity]] = Field(min_length=1)
    """Smallest and largest value of each parameter that may change"""


class Mechanism(FileDefinition):
    """A planar linkage with one degree of freedom: everything that a mechanism file says."""

    format: Literal["railsim-mechanism/1"]
    """Kind and version of the file"""
    name: Text = "mechanism"
    """What it is called in tables and plots"""
    source: Text | None = None
    """Where it comes from"""
    remarks: tuple[Text, ...] = ()
    """What a reader must know about its numbers"""
    parameters: dict[Name, QuantityOrAuto] = Field(default_factory=dict)
    """Numbers that may be varied, in SI and rad, or expressions of others"""
    derived: dict[Name, Quantity] = Field(default_factory=dict)
    """Intermediate results by name, for use in other expressions"""
    provenance: dict[Name, tuple[Name, ...]] = Field(default_factory=dict)
    """Parameters by where they are from: printed, derived, reconstructed, new, ..."""
    units: dict[Text, tuple[Name, ...]] = Field(default_factory=dict)
    """Parameters by their unit; those not listed are lengths"""
    ground: Ground = Ground()
    """What does not move"""
    bodies: dict[Name, Body] = Field(min_length=1)
    """Bodies by name"""
    start: dict[Name, Start] = Field(default_factory=dict)
    """Pose of the bodies at the driver's start, roughly"""
    joints: dict[Name, Joint] = Field(min_length=1)
    """Joints by name"""
    driver: Driver
    """The coordinate that moves the mechanism"""
    actuators: dict[Name, Actuator] = Field(default_factory=dict)
    """Actuators and other unknown forces by name"""
    elements: dict[Name, Element] = Field(default_factory=dict)
    """Masses, springs, dampers, given forces by name"""
    angles: dict[Name, Angle] = Field(default_factory=dict)
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
    catalogues: dict[Name, tuple[CatalogueRow, ...]] = Field(default_factory=dict)
    """Catalogues of gas springs by name"""
    selection: tuple[Selection, ...] = ()
    """Gas springs to be found in a catalogue"""
    lid: Lid | None = None
    """Quick check of a lid's gas springs"""
    optimise: Optimise | None = None
    """Search for parameters"""
    published: dict[Name, Quantity] = Field(default_factory=dict)
    """Results that the source prints, by their names, shown beside ours [SI]"""
    tolerances: dict[Name, Quantity] = Field(default_factory=dict)
    """Tolerances of parameters, plus and minus"""
    cases: dict[Name, dict[Name, QuantityOrAuto]] = Field(default_factory=dict)
    """Other values of parameters by the name of a case"""

    def in_case(self, case: str | None) -> "Mechanism":
        """Return the mechanism with the parameters of a case; None is the base.

        Raises
        ------
        KeyError : there is no such case.
        """
        if case is None:
            return self
        return self.with_parameters(self.cases[case])

    @property
    def automatic(self) -> set[str]:
        """Parameters that are left to the program."""
        return {name for name, value in self.parameters.items() if value == AUTO}

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
        for unit, names in self.units.items():
            if name in names:
                return unit
        return "m"
