"""Parts of a vehicle file: bodies, wheelsets, axleboxes, assemblies, points, service."""

from typing import Annotated, Literal

from pydantic import Field

from railsim.definitions import base
from railsim.definitions.elements import AnyElement
from railsim.definitions.vehicle.out_of_round import OutOfRound


class Body(base.Definition):
    """A rigid body: car body, bogie frame, bolster, traction motor."""

    mass: base.Positive
    """Mass [kg]"""
    inertia: base.PositiveVector
    """Moments of inertia Ixx, Iyy, Izz about the centre of gravity [kg m2]"""
    position: base.Vector
    """Centre of gravity [m]"""
    fixed: Literal["track", "ground"] | None = None
    """Held where the vehicle at rest has it: in its moving track frame (`track`), which is the
    same as on the `ground` of a test rig where the track is straight and level"""


class Wheelset(base.Definition):
    """Two wheels on an axle, turning with it."""

    mass: base.Positive
    """Mass [kg]"""
    inertia: base.PositiveVector
    """Moments of inertia Ixx, Iyy (about the axle), Izz [kg m2]"""
    position: base.Vector
    """Middle of the axle [m]; z = -radius"""
    radius: base.PositivePair
    """Nominal rolling radius, one number, or left and right [m]"""
    profile: base.TextPair
    """Wheel profile, a built-in name or a file, or [left, right]"""
    back_to_back: base.Positive = 1.360
    """Distance between the wheels' backs [m]"""
    tape_circle_distance: base.Positive = 1.5
    """Distance between the nominal rolling circles, in drawings: `back_to_back` places them [m]"""
    out_of_round: dict[base.Name, OutOfRound] = base.EMPTY_TABLE
    """How its wheels deviate from circles, by names"""


class Axlebox(base.Definition):
    """An axlebox with its arm: rigid with the wheelset but for its pitch about the axle."""

    wheelset: base.Text
    """Name of the wheelset that carries it"""
    position: base.Vector
    """Bearing centre [m]; mass and the other inertias are part of the wheelset"""
    pitch_inertia: base.Positive
    """Moment of inertia about the axle [kg m2]"""
    sides: Literal["both"] | None = None
    """`both`: given on the right (y > 0), copied to the left; the names get `.right` and `.left`"""


class Placement(base.Definition):
    """One position and direction of an assembly."""

    name: base.Name
    """Name that goes before the names within the assembly, joined by a dot"""
    position: base.Vector = (0.0, 0.0, 0.0)
    """Origin of the assembly's coordinates [m]"""
    mirror: base.Flag = False
    """Reflected fore and aft (x); left and right stay"""


class Assembly(base.Definition):
    """A group of parts that occurs once or several times."""

    placements: tuple[Placement, ...] = Field(min_length=1)
    """Where the assembly stands"""
    bodies: dict[base.Name, Body] = base.EMPTY_TABLE
    """Bodies by name"""
    wheelsets: dict[base.Name, Wheelset] = base.EMPTY_TABLE
    """Wheelsets by name"""
    axleboxes: dict[base.Name, Axlebox] = base.EMPTY_TABLE
    """Axleboxes by name"""
    elements: dict[base.Name, AnyElement] = base.EMPTY_TABLE
    """Force elements by name"""
    assemblies: dict[base.Name, "Assembly"] = base.EMPTY_TABLE
    """Assemblies within this one, by name"""


class Point(base.Definition):
    """A point that is fixed to a body."""

    body: base.Text
    """Full name of the body"""
    position: base.Vector
    """Position in the nominal vehicle [m]"""


class Service(base.Definition):
    """Approved operating conditions of the vehicle: the base of its assessment."""

    admissible_speed: base.Speed
    """Highest speed in service [m/s]"""
    cant_deficiency: Annotated[base.Positive, Field(le=0.5)]
    """Admissible cant deficiency [m]"""
    category: Literal["passenger", "freight", "locomotive", "multiple_unit"] = "passenger"
    """Category, which decides on limits; track machines have none, their k1 was not found"""
    floor_height: base.Positive = 1.2
    """Height of the floor above the rails, where accelerations are taken [m]"""
    points: dict[base.Name, Point] = base.EMPTY_TABLE
    """Further points at which accelerations are taken, by name"""
    condition: base.Text | None = None
    """Condition in which it is tested, such as `worn laden`: assessed together with the vehicles
    of this name in other conditions, without pooling their values"""
    fault: base.Flag = False
    """The condition is a fault, assessed for running safety only"""
