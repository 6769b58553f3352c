"""Dry friction: what pads have in common, and the friction pad or leaf spring."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from railsim.definitions.base import (
    AutoOrVector,
    Definition,
    Finite,
    NonNegativeVector,
    Positive,
    check,
)
from railsim.definitions.elements.base import PointElement, VerticalSpring
from railsim.definitions.elements.rows import FrictionLimit, Mount, pads


class SlidingFriction(Definition):
    """Dry friction that may fall with the speed: r + (1 - r) exp(-|v|/v_s) times that at rest.

    Source: Bo, Pavelescu (1982), The friction-speed relation and its influence on the critical
    velocity of stick-slip motion, Wear 82, 277-289.
    """

    sliding_ratio: Annotated[Finite, Field(gt=0.0, le=1.0)] = 1.0
    """Friction at high sliding speed over that at rest [1]; 1: it does not fall"""
    stribeck_speed: Positive | None = None
    """Sliding speed at which the difference has fallen to 1/e of itself [m/s]"""

    @check
    def _ratio_with_speed(self) -> None:
        if (self.sliding_ratio < 1.0) != (self.stribeck_speed is not None):
            raise ValueError("a 'sliding_ratio' below 1 and 'stribeck_speed' belong together")

    def limit(self, force: float = 0.0, coefficient: float = 0.0) -> FrictionLimit:
        """Return the limit along one axis: `force` [N] + `coefficient` [1] times the load."""
        return FrictionLimit(force, coefficient, self.sliding_ratio, self.stribeck_speed or 1.0)


class Friction(SlidingFriction, VerticalSpring, PointElement):
    """Dry friction along the axes of body 1, with a spring in parallel: leaf spring, friction pad.

    The largest friction force along an axis is friction_force + friction_coefficient N, with N the
    vertical spring force of this element in the direction of its preload, 0 where it is gone.  The
    friction forces along all axes are one vector within the ellipse of these limits, or each has a
    limit of its own; below it the pad sticks elastically.
    """

    SUPPORTS: ClassVar = "on axles"
    kind: Literal["friction"]
    friction_force: NonNegativeVector = (0.0, 0.0, 0.0)
    """Constant part of the largest friction force along x, y, z [N]"""
    friction_coefficient: NonNegativeVector = (0.0, 0.0, 0.0)
    """Part that grows with the vertical spring force, along x, y, z [1]"""
    stick_stiffness: NonNegativeVector = (0.0, 0.0, 0.0)
    """Stiffness of the sticking pad along x, y, z, needed where there is friction [N/m]"""
    friction_limit: Literal["circle", "axes"] = "circle"
    """`circle`: one contact slides in any direction, its force within a circle (an ellipse where
    the limits differ); `axes`: contacts of their own along each axis"""
    stiffness: NonNegativeVector = (0.0, 0.0, 0.0)
    """Stiffness of the parallel spring along x, y, z [N/m]"""
    damping: NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping along x, y, z [N s/m]"""
    preload: AutoOrVector = "auto"
    """Spring force on body 1 in the nominal position along x, y, z [N], or `auto`"""

    @check
    def _friction_needs_a_sticking_stiffness(self) -> None:
        limits = zip(self.friction_force, self.friction_coefficient, strict=True)
        slides = [force > 0.0 or coefficient > 0.0 for force, coefficient in limits]
        if not any(slides):
            raise ValueError("no friction: 'friction_force' or 'friction_coefficient' is needed")
        for axis, sliding, sticking in zip("xyz", slides, self.stick_stiffness, strict=True):
            if sliding and sticking == 0.0:
                raise ValueError(f"friction along {axis} needs 'stick_stiffness' along {axis}")

    def rows(self) -> list[Mount]:
        """One mount with pads along the axes that have friction."""
        pairs = zip(self.friction_force, self.friction_coefficient, strict=True)
        x, y, z = (self.limit(force, coefficient) for force, coefficient in pairs)
        together = self.friction_limit == "circle"
        return [
            self.mount(
                friction=(x, y, z), states=pads(self.stick_stiffness, (x, y, z), together=together)
            )
        ]
