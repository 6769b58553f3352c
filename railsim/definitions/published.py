"""Published values, `railsim-published/1`: what others found for a vehicle that railsim ships.

A report puts them beside a run of the same vehicle on the same track at the same speed.
"""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from railsim.definitions.base import Count, Definition, Finite, NonNegative, Positive, Side, Text
from railsim.definitions.file_definition import FileDefinition
from railsim.notation import QUANTITIES

Vehicles = Annotated[dict[Text, Finite], Field(min_length=1)]


class PublishedValue(Definition):
    """One quantity of one wheelset or wheel, for each vehicle."""

    quantity: Literal[tuple(QUANTITIES)]  # type: ignore[valid-type]
    """Quantity of a result"""
    wheelset: Count = 1
    """Wheelset, from the leading end"""
    side: Side | None = None
    """Wheel, for quantities that have one"""
    read: Literal["largest", "smallest"] | NonNegative
    """Largest or smallest value over the run, or the time of the value from the start of the track
    [s]"""
    values: Vehicles
    """Value by the name of the vehicle, with railsim's signs [SI]"""


class Published(FileDefinition):
    """A published study: everything that its file says."""

    KIND: ClassVar = "published"

    format: Literal["railsim-published/1"]
    name: Text
    """What the study is called"""
    source: Text
    """Where the values are printed"""
    program: Text
    """What they were computed or measured with"""
    track: Text
    """Track: the name of a shipped one"""
    speed: Positive
    """Speed [m/s]"""
    notes: tuple[Text, ...] = ()
    """Remarks for the reader, one sentence each"""
    values: Annotated[tuple[PublishedValue, ...], Field(min_length=1)]
    """What is printed"""
