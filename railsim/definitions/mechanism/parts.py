"""Parts of a mechanism file: bodies, joints, forces, springs, drivers."""

import math
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    PlainValidator,
    Tag,
    WithJsonSchema,
)

from railsim.definitions.base import EMPTY_TABLE, Definition, Flag, Name, Side, check
from railsim.definitions.mechanism.expressions import Expression

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


_NUMBER_OR_TEXT = WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]})
Quantity = Annotated[float | str, PlainValidator(_quantity), _NUMBER_OR_TEXT]
QuantityOrAuto = Annotated[
    float | str,
    PlainValidator(lambda value: AUTO if value == AUTO else _quantity(value)),
    _NUMBER_OR_TEXT,
]


class Least(NamedTuple):
    """Smallest value of a quantity, checked where the parameters have values."""

    value: float
    allowed: str  # in words
    excluded: bool = False


Positive = Annotated[Quantity, Least(0.0, "greater than 0", excluded=True)]
NonNegative = Annotated[Quantity, Least(0.0, "0 or greater")]
# where the law of the makers, 0.36 % per degree from 20 C on, leaves a force
Temperature = Annotated[Quantity, Least(-257.0, "-257 C or above: the gas has no force below")]
Progression = Annotated[Quantity, Least(1.0, "1 or greater: the gas is compressed")]


@cache
def least_values(kind: type[Definition]) -> dict[str, Least]:
    """Smallest values of the quantities of a definition, by its fields."""
    least = {}
    for name, field in kind.model_fields.items():
        notes = list(field.metadata)
        for member in get_args(field.annotation):  # of an optional one
            notes += getattr(member, "__metadata__", ())
        for note in notes:
            if isinstance(note, Least):
                least[name] = note
    return least


class Reference(str):
    """The name of a part of the file; `kind` says of which parts."""

    kind = ""


def _refers(kind: str) -> AfterValidator:
    """Make names references to parts of a kind: the file's own parts are looked up by it."""

    def reference(name: str) -> Reference:
        made = Reference(name)
        made.kind = kind
        return made

    return AfterValidator(reference)


PointName = Annotated[
    str,
    Field(strict=True, pattern=r"^[A-Za-z_][A-Za-z0-9_-]*\.[A-Za-z_][A-Za-z0-9_-]*$"),
    _refers("point"),
]
BodyName = Annotated[Name, _refers("body")]
ActuatorName = Annotated[Name, _refers("actuator")]
GasSpringName = Annotated[Name, _refers("gas spring")]
CatalogueName = Annotated[Name, _refers("catalogue")]
Pair = tuple[PointName, PointName]


class Polar(Definition):
    """A point in polar coordinates."""

    radius: Quantity
    """Distance from the body's origin [m]"""
    angle: Quantity
    """Direction from the body's x axis [rad]"""


Coordinates = Annotated[
    Annotated[tuple[Quantity, Quantity], Tag("cartesian")] | Annotated[Polar, Tag("polar")],
    Discriminator(lambda value: "polar" if isinstance(value, dict | Polar) else "cartesian"),
]


class Ground(Definition):
    """What does not move."""

    points: dict[Name, Coordinates] = EMPTY_TABLE
    """Points by name [m]"""
    gravity: Quantity = 9.81
    """Gravitational acceleration along -y [m/s2]"""


class Body(Definition):
    """A rigid body; its axes are where its points say."""

    points: dict[Name, Coordinates] = EMPTY_TABLE
    """Points by name in the body's axes [m]"""
    mass: NonNegative = 0.0
    """Mass [kg]"""
    centre: Coordinates = (0.0, 0.0)
    """Centre of gravity in the body's axes [m]"""
    inertia: NonNegative = 0.0
    """Moment of inertia about the centre of gravity [kg m2]"""
    outline: tuple[Name, ...] = ()
    """Points joined by lines in drawings; by default all in their order"""


class Start(Definition):
    """Pose of a body from which the assembly at the driver's start is found."""

    x: QuantityOrAuto = AUTO
    """Position of the body's origin [m]; by default from a revolute joint or 0"""
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
    length: Positive
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

    radius: Positive
    """Radius [m]"""
    turns: Side
    """Side to which the path turns on its way"""
    length: Positive | None = None
    """Length along the path [m], of a path of tangent arcs"""
    centre: Coordinates | None = None
    """Centre in the cam's axes [m], instead of tangency"""
    begin: Quantity | None = None
    """Direction from the given centre to the arc's start [rad]; by default where its rates equal
    those of the arc before, on the line through both centres"""
    end: Quantity | None = None
    """The same for its end [rad]"""

    @check
    def _one_way(self) -> None:
        if (self.length is None) == (self.centre is None):
            raise ValueError("either 'length' (tangent arcs) or 'centre'")


class Cam(Definition):
    """A roller on a cam, kept in contact in both directions."""

    cam: PointName
    """Centre of the roller"""
    path: PointName | None = None
    """Point of the cam where the path of the roller's centre begins, for tangent arcs"""
    body: BodyName | None = None
    """Body that carries the cam, where arcs have centres"""
    tangent: Quantity = 0.0
    """Direction of the path at its beginning, in the axes of the cam's body [rad]"""
    arcs: tuple[Arc, ...] = Field(min_length=1)
    """Arcs from the beginning of the motion on"""

    @check
    def _one_kind(self) -> None:
        tangent = [arc.length is not None for arc in self.arcs]
        if any(tangent) != all(tangent):
            raise ValueError("all arcs with 'length', or all with 'centre'")
        if tangent[0] == (self.path is None) or tangent[0] != (self.body is None):
            raise ValueError("'path' goes with arcs of a 'length', 'body' with arcs of a 'centre'")


class Cylinder(Definition):
    """A pneumatic or hydraulic cylinder; its force is an unknown, or follows from a pressure."""

    cylinder: Pair
    """Its ends"""
    bore: Positive
    """Bore of one cylinder [m]"""
    rod: NonNegative = 0.0
    """Diameter of the rod [m]; counts when the cylinder pulls"""
    count: Positive = 1.0
    """Cylinders side by side"""
    supply_pressure: Positive
    """Available pressure [Pa]"""
    acts: Literal["push", "pull", "both"] = "push"
    """Chamber under pressure; with 'both' the one that is needed"""
    pin_to_pin: Quantity | None = None
    """Shortest length of the cylinder between its pins less its stroke [m]"""
    bores: tuple[Quantity, ...] = (0.032, 0.04, 0.05, 0.063, 0.08, 0.1, 0.125, 0.16, 0.2)
    """Bores that are made [m]"""
    strokes: tuple[Quantity, ...] = (0.025, 0.05, 0.08, 0.1, 0.125, 0.16, 0.2, 0.25, 0.32, 0.4, 0.5)
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

    @check
    def _rectangular(self) -> None:
        if len(self.forces) != len(self.heights):
            raise ValueError(f"{len(self.forces)} rows of 'forces', {len(self.heights)} 'heights'")
        for row in self.forces:
            if len(row) != len(self.pressures):
                raise ValueError(f"a row of {len(row)} 'forces', {len(self.pressures)} 'pressures'")


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

    turn: BodyName
    """The body"""


class PointMass(Definition):
    """A mass at a point."""

    point_mass: PointName
    """Where it is"""
    mass: NonNegative
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

    torque: BodyName
    """The body"""
    size: Quantity
    """Its size, anticlockwise [N m]"""


Rows = Annotated[tuple[tuple[Quantity, Quantity], ...], Field(min_length=2)]


def _one_law(spring: Any, free: str) -> None:
    """Refuse a spring with stiffness and table, or with neither."""
    given = [getattr(spring, key) is not None for key in ("stiffness", free, "table")]
    if given not in ([True, True, False], [False, False, True]):
        raise ValueError(f"either 'stiffness' and '{free}', or 'table'")


class Spring(Definition):
    """A spring between two points, linear or by a table."""

    spring: Pair
    """Its ends"""
    stiffness: NonNegative | None = None
    """Stiffness [N/m]"""
    free_length: Quantity | None = None
    """Length without force [m]"""
    table: Rows | None = None
    """Rows [length m, push N], lengths rising, straight in between, instead"""

    @check
    def _law(self) -> None:
        _one_law(self, "free_length")


class TorsionSpring(Definition):
    """A torsion spring between two bodies, linear or by a table."""

    torsion_spring: tuple[BodyName, BodyName]
    """The bodies; `ground` too"""
    stiffness: NonNegative | None = None
    """Stiffness [N m/rad]"""
    free_angle: Quantity | None = None
    """Angle of the first body less that of the second without torque [rad]"""
    table: Rows | None = None
    """Rows [angle rad, torque on the first body N m], angles rising, straight in between"""

    @check
    def _law(self) -> None:
        _one_law(self, "free_angle")


class JointFriction(Definition):
    """Dry friction of joints against a body's turning."""

    joint_friction: BodyName
    """Body that turns against the ground"""
    moment: NonNegative
    """Torque against its motion [N m]"""


class Damper(Definition):
    """A linear damper between two points."""

    damper: Pair
    """Its ends"""
    damping: NonNegative
    """Damping [N s/m]"""


class Stop(Definition):
    """A one-sided end stop between two points."""

    stop: Pair
    """Its ends"""
    length: Quantity
    """Distance at which it is met [m]"""
    side: Literal["shortest", "longest"] = "shortest"
    """Whether the distance may not become shorter, or not longer"""
    stiffness: NonNegative
    """Stiffness [N/m]"""
    damping: NonNegative = 0.0
    """Damping while it is met [N s/m]"""


class GasSpring(Definition):
    """A gas spring between two points."""

    gas_spring: Pair
    """Its ends"""
    F1: Positive
    """Force at 20 C without friction: fully extended, or fully compressed if it pulls [N]"""
    progression: Progression
    """Ratio of the force at the other end of the stroke to `F1`"""
    stroke: Positive
    """Stroke [m]"""
    extended: Positive
    """Length fully extended [m]"""
    law: Literal["linear", "isothermal"] = "linear"
    """Force over the stroke"""
    acts: Literal["compression", "traction"] = "compression"
    """Whether it pushes or pulls"""
    friction: NonNegative = 0.0
    """Friction against the motion [N]"""
    damping: NonNegative = 0.0
    """Damping [N s/m]"""
    end_damping: NonNegative | None = None
    """Damping over the last part of the extension (oil) [N s/m]"""
    end_length: Quantity = 0.0
    """Length of that part [m]"""
    temperature: Temperature = 20.0
    """Temperature of the gas [C]"""
    rod: Positive | None = None
    """Diameter of the rod [m], for the pressure of the gas"""
    rod_end: PointName | None = None
    """Point at which the rod is; it should be the lower one when compressed"""
    service: tuple[Temperature, Temperature] = (-30.0, 80.0)
    """Lowest and highest temperature in service [C]"""


class Angle(Definition):
    """An angle between two lines, folded to 0 to 90 degrees."""

    between: tuple[Pair, Pair]
    """The lines, each from one point to another"""
    offset: Quantity = 0.0
    """Added to the angle of the first line less that of the second [rad]"""
    limited: Flag = True
    """Whether it is a transmission angle that the least one of `[optimise]` holds for"""


class _ByKey:
    """Tells the members of a union apart by their first keys."""

    @staticmethod
    def __get_pydantic_core_schema__(source: Any, handler: GetCoreSchemaHandler) -> Any:
        kinds = {next(iter(kind.model_fields)): kind for kind in get_args(source)}

        def tag(value: Any) -> str | None:
            for key in kinds:
                if (key in value) if isinstance(value, Mapping) else hasattr(value, key):
                    return f"a {key}"
            return None

        by_key = Discriminator(
            tag,
            custom_error_type="one_of",
            custom_error_message=f"one of the keys {', '.join(kinds)} must say what it is",
        )
        tagged = (Annotated[kind, Tag(f"a {key}")] for key, kind in kinds.items())
        return handler.generate_schema(Annotated[Union[tuple(tagged)], by_key])  # noqa: UP007


Joint = Annotated[Revolute | Link | Slot | Prismatic | Cam, _ByKey]
Actuator = Annotated[Cylinder | AirSpring | Piston | HandForce | HandTorque, _ByKey]
_Forces = PointMass | Force | Torque | Spring | TorsionSpring | JointFriction
Element = Annotated[_Forces | Damper | Stop | GasSpring, _ByKey]
