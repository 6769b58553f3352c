"""Track files, `railsim-track/1`: plan, cant, vertical profile, rails, friction, irregularities.

Plan, cant and vertical profile are lists of elements, one behind the other, each with its length.
A transition (CLO, LIR) takes its ends from its neighbours where it does not name them.  Curvature,
cant and gradient are piecewise linear in the arc length and rounded over `rounding`.
"""

from typing import Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np
from pydantic import BeforeValidator, Field

from railsim.arrays import Floats
from railsim.constants import CANT_BASE, NORMAL_GAUGE
from railsim.definitions import base
from railsim.definitions.excitations import Irregularity
from railsim.definitions.excitations.measured_file import embed_measured
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.track.check_rail import MOST_CHECK_RAILS, CheckRail
from railsim.definitions.track.elements import CantElement, PlanElement, VerticalElement
from railsim.definitions.track.layout import curvature_sections, track_faults, track_remarks
from railsim.definitions.track.rail_sections import MOST_RANGES, RailSections, embed_rail_sections
from railsim.definitions.track.support import Support
from railsim.definitions.vehicle.laws import Law, with_sources
from railsim.errors import Fault
from railsim.plottable import Plottable
from railsim.table import Column, Table

ArcLength = TypeVar("ArcLength", float, Any)
MOST_ELEMENTS, MOST_IRREGULARITIES = 5000, 1000

SOFTER = "the factor of the slip area is at most that of the adhesion area"
Widening = Annotated[base.Finite, Field(ge=-0.05, le=0.1)]

ThirdBody = Annotated[
    tuple[base.Share, base.Share],
    base.holds(lambda factors: factors[1] <= factors[0], SOFTER),
    BeforeValidator(base.pair),
    base.one_or_two({"type": "number", "exclusiveMinimum": 0, "maximum": 1}),
]


class FallingFriction(base.Definition):
    """Friction that falls with the slip velocity w of a contact patch (Polach 2005).

    mu(w) = mu ((1 - rest) exp(-decay w) + rest)
    """

    rest: base.Share
    """Friction at very large slip over that without slip [1]"""
    decay: base.NonNegative
    """How fast it falls with the slip velocity [s/m]"""


class Track(FileDefinition, Plottable):
    """A track: everything that its file says."""

    KIND: ClassVar = "track"
    OPEN_TABLES: ClassVar = ("friction_falling",)

    format: Literal["railsim-track/1"]
    name: base.Text
    """What the track is called in tables and plots"""
    source: base.Text | None = None
    """Where the numbers come from"""
    speed: base.Speed | None = None
    """Highest speed permitted on the track [m/s]: remarks on the alignment refer to it, and the
    speed `permitted` of a study"""
    mileage: base.Finite = 0.0
    """Mileage of s = 0 [m]; results hold the mileage of the reference body"""
    falling_mileage: base.Flag = False
    """The mileage falls in the direction of travel"""
    gauge: Annotated[base.Finite, Field(ge=0.3, le=2.5)] = 1.435
    """Distance between the gauge faces, 14 mm below the rail tops [m]"""
    rail: base.TextPair = ("60E1", "60E1")
    """Rail profile, a built-in name or a file, or [left, right]"""
    inclination: Annotated[base.Finite, Field(ge=0, le=0.2)] = 0.025
    """Inclination of the rails towards the track's middle, 0.025 = 1:40 [1]"""
    friction: base.NonNegativePair = (0.4, 0.4)
    """Coefficient of friction, one number, or left and right [1]"""
    friction_table: base.SidedRows[base.NonNegative] | None = None
    """Rows [s, mu] or [s, left, right] instead of `friction`, linear in between [m, 1]"""
    friction_falling: FallingFriction | None = None
    """How friction falls with the slip velocity; by default it does not"""
    third_body: ThirdBody = (1.0, 1.0)
    """Factor of Kalker's coefficients by a layer of dirt or water, one number or [adhesion, slip]:
    the second, for the slip area, is for the creep law `polach` only [1]"""
    gauge_widening: Annotated[base.SidedRows[Widening], base.both_sides(0.5)] | None = None
    """Rows [s, widening] or [s, left, right], linear in between and rounded as the plan [m]: by how
    much each rail stands further out than the gauge says, one number being shared by both rails"""
    rounding: Annotated[base.Finite, Field(ge=0.1, le=200)] = 10.0
    """Length over which kinks of curvature, cant and gradient are rounded (box filter) [m]"""
    cant_rotation: Literal["centre", "inner_rail"] = "centre"
    """Cant turns the track about its centre line, or about the inner (lower) rail"""
    plan: tuple[PlanElement, ...] = Field(min_length=1, max_length=MOST_ELEMENTS)
    """Elements of the plan, from s = 0 on; the first and the last continue beyond the ends"""
    cant: tuple[CantElement, ...] = Field(default=(), max_length=MOST_ELEMENTS)
    """Elements of the cant; where shorter than the plan, the last value continues"""
    vertical: tuple[VerticalElement, ...] = Field(default=(), max_length=MOST_ELEMENTS)
    """Elements of the vertical profile; where shorter than the plan, the last gradient continues"""

    irregularities: tuple[Irregularity, ...] = Field(default=(), max_length=MOST_IRREGULARITIES)
    """Displacements of the rails from their ideal positions; they add up"""
    laws: dict[base.Name, Law] | None = None
    """User-defined laws by name: Python functions, executed only with permission"""
    sections: tuple[RailSections, ...] = Field(default=(), max_length=MOST_RANGES)
    """Ranges in which the section of a rail changes, such as crossings"""
    check_rail: tuple[CheckRail, ...] = Field(default=(), max_length=MOST_CHECK_RAILS)
    """Check rails and guard rails"""
    support: Support = Support.model_construct()
    """What carries the rails: rigid, or elastic as a moving track model"""

    @property
    def length(self) -> float:
        """Length of the plan [m]."""
        return sum(element.length for element in self.plan)

    @property
    def rail_base(self) -> float:
        """Distance of the rails over which their heights differ: 1.5 m at 1435 mm of gauge [m]."""
        return CANT_BASE + (self.gauge - NORMAL_GAUGE)

    @property
    def widest(self) -> float:
        """Largest widening of the gauge [m]."""
        return max((left + right for _, left, right in self.gauge_widening or ()), default=0.0)

    def mileage_at(self, s: "ArcLength") -> "ArcLength":
        """Mileage at an arc length, or at an array of them [m]."""
        return self.mileage - s if self.falling_mileage else self.mileage + s

    def friction_at(self, s: float | Floats) -> Floats:
        """Coefficients of friction of the left and right rail at arc lengths, float64[..., 2]."""
        rows = np.array(self.friction_table or ((0.0, *self.friction),))
        return np.stack([np.interp(s, rows[:, 0], rows[:, k]) for k in (1, 2)], axis=-1)

    @property
    def frictions(self) -> tuple[float, ...]:
        """Coefficients of friction left and right, each once; of a table the least and largest."""
        values = self.friction
        if self.friction_table is not None:
            occurring = [mu for row in self.friction_table for mu in row[1:]]
            values = min(occurring), max(occurring)
        return tuple(dict.fromkeys(values))

    @property
    def friction_words(self) -> str:
        """Coefficient of friction, as left / right where they differ; of a table the range."""
        return (" to " if self.friction_table else " / ").join(f"{mu:g}" for mu in self.frictions)

    @classmethod
    def complete(cls, tables: dict[str, Any]) -> list[Fault]:
        """Put measured irregularities, sections of rails and sources of laws into the tables."""
        return embed_measured(tables) + embed_rail_sections(tables) + with_sources(tables)

    def contradictions(self) -> list[Fault]:
        """Return where the elements do not fit together."""
        return track_faults(self)

    def unusual(self) -> list[base.Remark]:
        """Return what an engineer would object to."""
        return [*track_remarks(self)]

    def _table(self) -> Table:
        """Return the table of the plan's elements that a notebook shows."""
        rows = []
        for section in curvature_sections(self):
            curvatures = dict.fromkeys((section.start_value, section.end_value))
            radii = " to ".join(f"{1.0 / kappa:.6g}" if kappa else "inf" for kappa in curvatures)
            rows.append([section.type, section.begin, section.end, radii])
        ends = [Column("from", unit="m", format=".6g"), Column("to", unit="m", format=".6g")]
        return Table([Column("plan"), *ends, Column("radius (m)", format=">")], rows)
