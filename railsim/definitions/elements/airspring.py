"""An air spring with reservoir."""

from typing import ClassVar, Literal

from railsim.definitions.base import AutoOrVector, Flag, NonNegative, Positive
from railsim.definitions.elements.base import PointElement, PreloadAlongAxes
from railsim.definitions.elements.rows import Mount, State


class Airspring(PreloadAlongAxes, PointElement):
    """Air spring with reservoir after Nishimura: three springs and the orifice's damping.

    Vertical force: area_stiffness z + bellows_stiffness (z - w), where the orifice closes the
    balance bellows_stiffness (z - w) = reservoir_stiffness w + orifice_damping w'.
    """

    SUPPORTS: ClassVar = "always"
    kind: Literal["airspring"]
    bellows_stiffness: Positive
    """Stiffness of the air in the bellows alone [N/m]"""
    reservoir_stiffness: NonNegative
    """Further stiffness of the air in the reservoir [N/m]"""
    area_stiffness: NonNegative = 0.0
    """Stiffness from the change of the effective area [N/m]"""
    orifice_damping: Positive
    """Damping of the orifice, referred to the bellows [N s/m]"""
    horizontal_stiffness: tuple[NonNegative, NonNegative]
    """Stiffness along x and y [N/m]"""
    horizontal_damping: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    """Damping along x and y [N s/m]"""
    torsional_stiffness: NonNegative = 0.0
    """Stiffness about z [N m/rad]"""
    preload: AutoOrVector = "auto"
    """Force on body 1 in the nominal position along x, y, z [N], or `auto`"""
    levelling: Flag = True
    """With levelling valve: what stands on such springs alone keeps its height in every load
    case"""

    @property
    def vertical_stiffness(self) -> float:
        """Stiffness at rest: bellows and reservoir in series, beside the area's [N/m].

        Without damping in parallel: the orifice acts through the air.
        """
        in_series = self.bellows_stiffness * self.reservoir_stiffness
        return self.area_stiffness + in_series / (self.bellows_stiffness + self.reservoir_stiffness)

    def rows(self) -> list[Mount]:
        """One mount whose vertical force has the state of the reservoir."""
        air = (self.bellows_stiffness, self.reservoir_stiffness, self.orifice_damping)
        return [
            Mount(
                stiffness=(*self.horizontal_stiffness, self.area_stiffness),
                damping=(*self.horizontal_damping, 0.0),
                states=(None, None, State("air", air)),
                rotation=(0.0, 0.0, self.torsional_stiffness),
                preload=self.known_preload,
            )
        ]
