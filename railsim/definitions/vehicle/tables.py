"""Parts of a vehicle file: bodies, wheelsets, axleboxes, assemblies, points, service."""

from typing import Annotated, Literal

from pydantic import Field

from railsim.definitions.base import (
    EMPTY_TABLE,
    Definition,
    Flag,
    Name,
    Positive,
    PositivePair,
    PositiveVector,
    Speed,
    Text,
    TextPair,
    Vector,
)
from railsim.definitions.elements import AnyElement
from railsim.definitions.vehicle.out_of_round import OutOfRound


class Body(Definition):
    """A rigid body: car body, bogie frame, bolster, traction motor."""

    mass: Positive
    """Mass [kg]"""
    inertia: PositiveVector
    """Moments of inertia Ixx, Iyy, Izz about the centre of gravity [kg m2]"""
    position: Vector
    """Centre of gravity [m]"""
    fixed: Literal["track", "ground"] | None = None
    """Held where the vehicle at rest has it: in its moving track frame (`track`), which is the
    same as on the `ground` of a test rig where the track is straight and level"""


class Wheelset(Definition):
    """Two wheels on an axle, turning with it."""

    mass: Positive
    """Mass [kg]"""
    inertia: PositiveVector
    """Moments of inertia Ixx, Iyy (about the axle), Izz [kg m2]"""
    position: Vector
    """Middle of the axle [m]; z = -radius"""
    radius: PositivePair
    """Nominal rolling radius, one number, or left and right [m]"""
    profile: TextPair
    """Wheel profile, a built-in name or a file, or [left, right]"""
    back_to_back: Positive = 1.360
    """Distance between the wheels' backs [m]"""
    tape_circle_distance: Positive = 1.5
    """Distance between the nominal rolling circles, in drawings: `back_to_back` places them [m]"""
    out_of_round: dict[Name, OutOfRound] = EMPTY_TABLE
    """How its wheels deviate from circles, by names"""


class Axlebox(Definition):
    """An axlebox with its arm: rigid with the wheelset but for its pitch about the axle."""

    wheelset: Text
    """Name of the wheelset that carries it"""
    position: Vector
    """Bearing centre [m]; mass and the other inertias are part of the wheelset"""
    pitch_inertia: Positive
    """Moment of inertia about the axle [kg m2]"""
    sides: Literal["both"] | None = None
    """`both`: given on the right (y > 0), copied to the left; the names get `.right` and `.left`"""


class Placement(Definition):
    """One position and direction of an assembly."""

    name: Name
    """Name that goes before the names within the assembly, joined by a dot"""
    position: Vector = (0.0, 0.0, 0.0)
    """Origin of the assembly's coordinates [m]"""
    mirror: Flag = False
    """Reflected fore and aft (x); left and right stay"""


class Assembly(Definition):
    """A group of parts that occurs once or several times."""

    placements: tuple[Placement, ...] = Field(min_length=1)
    """Where the assembly stands"""
    bodies: dict[Name, Body] = EMPTY_TABLE
    """Bodies by name"""
    wheelsets: dict[Name, Wheelset] = EMPTY_TABLE
    """Wheelsets by name"""
    axleboxes: dict[Name, Axlebox] = EMPTY_TABLE
    """Axleboxes by name"""
    elements: dict[Name, AnyElement] = EMPTY_TABLE
    """Force elements by name"""
    assemblies: dict[Name, "Assembly"] = EMPTY_TABLE
    """Assemblies within this one, by name"""


class Point(Definition):
    """A point that is fixed to a body."""

    body: Text
    """Full name of the body"""
    position: Vector
    """Position in the nominal vehicle [m]"""


class Service(Definition):
    """Approved operating conditions of the vehicle: the base of its assessment."""

    admissible_speed: Speed
    """Highest speed in service [m/s]"""
    cant_deficiency: Annotated[Positive, Field(le=0.5)]
    """Admissible cant deficiency [m]"""
    category: Literal["passenger", "freight", "locomotive", "multiple_unit"] = "passenger"
    """Category, which decides on limits"""
    floor_height: Positive = 1.2
    """Height of the floor above the rails, where accelerations are taken [m]"""
    points: dict[Name, Point] = EMPTY_TABLE
    """Further points at which accelerations are taken, by name"""
    condition: Text | None = None
    """Condition in which it is tested, such as `worn laden`: assessed together with the vehicles
    of this name in other conditions, without pooling their values"""
    fault: Flag = False
    """The condition is a fault, assessed for running safety only"""
