"""Scenario files, `railsim-scenario/1`: a campaign of runs for any vehicle, and how it ends.

Each part is a track and a speed that follows from the vehicle's service table.
"""

from typing import ClassVar, Literal

from pydantic import Field

from railsim.definitions import base
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.vehicle.loads import LoadName


class Speed(base.Definition):
    """Speed of a part: fixed, a share of the admissible one, or from the cant deficiency.

    With both a share of the admissible speed and a cant deficiency, the radii of the track are
    multiplied by one factor so that both hold; its cants are lowered where that is not enough.
    """

    fixed: base.Positive | None = None
    """[m/s]"""
    admissible: base.Positive | None = None
    """Of the admissible speed [1]"""
    cant_deficiency: base.Positive | None = None
    """Of the admissible cant deficiency, in a curve of `radius` and `cant` [1]"""
    radius: base.Positive | None = None
    """Not beyond the radii of the track's curves [m]"""
    cant: base.Finite = 0.0
    """Not beyond the cants in them [m]"""

    @base.check
    def _one_way(self) -> None:
        other = self.admissible is not None or self.cant_deficiency is not None
        if (self.fixed is not None) == other:
            raise ValueError("'fixed' is needed, or 'admissible', 'cant_deficiency' or both")
        if (self.cant_deficiency is None) != (self.radius is None):
            raise ValueError("'radius' belongs to 'cant_deficiency' and only to it")


class Part(base.Definition):
    """Runs on one track."""

    track: base.Text
    """Track: a file or the name of a shipped one"""
    speed: Speed
    """Speed"""
    until: base.Positive | None = None
    """Where the run ends [m]; by default at the end of the track's plan"""


class TestCondition(base.Definition):
    """A condition in which the vehicle is tested; its section values are not pooled with others."""

    __test__ = False  # pytest: not a test

    load: LoadName | None = None
    """Load case; the condition is left out for vehicles without it"""
    wheels: dict[base.Text, base.Text] = base.EMPTY_TABLE
    """Wheel profiles by those that they replace, built-in names or files; the condition is left out
    for vehicles without any of these"""
    assignments: tuple[base.Text, ...] = ()
    """`vehicle.key.path=value`"""
    remove: tuple[base.Text, ...] = ()
    """Keys of the vehicle that are removed, such as a failed damper"""
    fault: base.Flag = False
    """It is a fault, assessed for running safety only"""


class Scenario(FileDefinition):
    """A campaign: everything that its file says."""

    KIND: ClassVar = "scenario"

    format: Literal["railsim-scenario/1"]
    name: base.Text
    """What the campaign is called"""
    purpose: base.Text | None = None
    """What it is for"""
    standard: Literal["en14363", "uic518", "comfort", "wear", "safety"]
    """How it is assessed"""
    method: Literal["normal", "simplified"] = "normal"
    """With wheel forces, or with accelerations only"""
    assignments: tuple[base.Text, ...] = ()
    """`key.path=value` for all runs, the paths beginning with `vehicle.`, `track.`, `settings.`"""
    grid: dict[base.Text, tuple[base.Text, ...]] = base.EMPTY_TABLE
    """Values of further keys: every part is run with each combination"""
    single: base.Flag = False
    """Store quantities with 4 bytes a number: 7 digits"""
    conditions: dict[base.Name, TestCondition] = base.EMPTY_TABLE
    """Conditions in which the vehicle is tested; by default as its file says"""
    to_standard: base.Flag = False
    """Repeat every part with further seeds until its zone has the sections that the standard
    requires, with random irregularities scaled to the track quality that it asks for"""
    parts: dict[base.Name, Part] = Field(min_length=1)
    """Parts by name"""
