"""Friction wedges of a three-piece bogie."""

from math import tan
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from railsim.definitions.base import (
    AutoOrVector,
    Finite,
    NonNegative,
    NonNegativeVector,
    Positive,
    check,
)
from railsim.definitions.elements.base import PointElement, VerticalSpring
from railsim.definitions.elements.rows import FrictionLimit, Mount, pads


class Wedge(VerticalSpring, PointElement):
    """Friction wedges of one side of a three-piece bogie, on their springs.

    Body 1 is the side frame, body 2 the bolster, whose inclined faces rest on the wedges; the wedge
    springs stand on the side frame (variable friction).  Without mass and with a smooth inclined
    face the force on the column is N = (F + T_z)/tan(angle), with F the spring force and T_z the
    friction that holds the wedge up: mu N is larger on the way down than on the way up.
    """

    SUPPORTS: ClassVar = "always"
    MUST_PRESS: ClassVar = True
    kind: Literal["wedge"]
    stiffness: NonNegativeVector
    """Stiffness of the wedge springs of one side along x, y, z [N/m]"""
    damping: NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping along x, y, z [N s/m]"""
    preload: AutoOrVector = "auto"
    """Spring force on body 1 in the nominal position along x, y, z [N], or `auto`"""
    angle: Annotated[Finite, Field(gt=0.0, lt=1.5)]
    """Angle between the inclined face and the column's face [rad]"""
    friction_coefficient: NonNegative
    """Coefficient of friction on the column [1]"""
    stick_stiffness: tuple[Positive, Positive]
    """Stiffness of the sticking wedges along y and z [N/m]"""

    @check
    def _wedge_slides(self) -> None:
        if self.friction_coefficient >= tan(self.angle):
            raise ValueError(
                "the wedge locks itself: 'friction_coefficient' must be smaller than tan(angle) = "
                f"{tan(self.angle):.3g}"
            )
        if self.stiffness[2] == 0.0:
            raise ValueError("the wedges need springs: 'stiffness' along z")

    @check
    def _wedge_presses(self) -> None:
        if self.preload != "auto" and self.preload[2] < 0.0:
            raise ValueError(
                "wedges press and never pull: 'preload' along z, on the side frame and positive "
                f"downwards, must not be negative; found {self.preload[2]:g}"
            )
        if self.points is not None and self.points[0][2] < self.points[1][2]:
            raise ValueError(
                "the bolster, body 2, rests on the wedges, which stand on the side frame, body 1: "
                "the point on body 1 must not lie above that on body 2 (z points down)"
            )

    @property
    def share(self) -> float:
        """Friction over spring force while the wedge slides level: mu/tan(angle)."""
        return self.friction_coefficient / tan(self.angle)

    def rows(self) -> list[Mount]:
        """One mount that presses, with skew pads along y and z."""
        sliding = FrictionLimit(coefficient=self.share)
        friction = (FrictionLimit(), sliding, sliding)
        return [
            self.mount(
                friction=friction,
                states=pads((0.0, *self.stick_stiffness), friction, skew=self.share),
                one_sided=True,
            )
        ]
