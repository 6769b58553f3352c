"""Support of the rails: the moving track model under every wheelset.

Two rails on pads and one sleeper on ballast move along with each wheelset (`railsim.kernels.
support`).  A preset names a whole set of values; single keys replace its values.

Sources of the presets:

co-running   values that public code names "benchmark", taken to be those of Bezin and Pålsson
             (2021), Multibody simulation benchmark for dynamic vehicle-track interaction in
             switches and crossings; vertical ballast read as per side
ballasted    the same stiffnesses and dampings, without masses
p2           mass, stiffness and damping per wheel of the British P2 assessment (GM/TT0088); it has
             no lateral part: that of the pads is taken from co-running (assumed)
slab         rail CHN60 (EI 6.62 MN m2, 60.64 kg/m) on fastenings of 40 MN/m and 52 kN s/m every
             0.63 m, as one degree of freedom in the static shape of a beam on an elastic
             foundation u = k/d: L = (4 EI/u)^(1/4), stiffness 2 u L, and 3/2 L of damping and mass
             per length; the lateral part as co-running (assumed)
"""

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field, WithJsonSchema

from railsim.definitions.base import NUMBERS, Definition, NonNegative, Positive, SidedRows, check

SpringDamper = Annotated[tuple[Positive, NonNegative], WithJsonSchema({**NUMBERS, "maxItems": 2})]
Preset = Literal["rigid", "ballasted", "co-running", "p2", "slab"]


@dataclass(frozen=True)
class SupportValues:
    """All values of a support, preset and single keys together; see `Support`.

    Without `ballast_vertical` the pads stand on firm ground.
    """

    rail_mass: float
    pad_vertical: tuple[float, float]
    pad_lateral: tuple[float, float]
    sleeper_mass: float = 0.0
    sleeper_inertia: float = 0.0
    ballast_vertical: tuple[float, float] | None = None
    ballast_lateral: tuple[float, float] | None = None
    ballast_base: float = 0.75

    @property
    def has_sleeper(self) -> bool:
        """Whether the pads stand on sleepers that move."""
        return self.ballast_vertical is not None

    @property
    def massless(self) -> bool:
        """Whether nothing of the track has mass."""
        return self.rail_mass == 0.0


def beam_on_foundation(bending_stiffness: float, foundation: float) -> tuple[float, float]:
    """A long beam on an elastic foundation under a single force (Winkler 1867, Zimmermann 1888).

    `bending_stiffness`: E I of the rail [N m2]; `foundation`: u, stiffness of the support over the
    distance of the supports [N/m2]. Returns: `length, stiffness`: L = (4 E I/u)^(1/4) [m]; force
    over deflection at the force, 2 u L [N/m].
    """
    length = (4.0 * bending_stiffness / foundation) ** 0.25
    return length, 2.0 * foundation * length


def _slab() -> SupportValues:
    """Rail on fastenings in its static shape: 3/2 L of mass and damping per length."""
    distance, rail = 0.63, 60.64
    length, stiffness = beam_on_foundation(2.059e11 * 3.217e-5, 40e6 / distance)
    return SupportValues(
        1.5 * length * rail, (stiffness, 1.5 * length * 52e3 / distance), _CO_RUNNING.pad_lateral
    )


_CO_RUNNING = SupportValues(
    60.0, (150e6, 100e3), (30e6, 150e3), 1400.0, 450.0, (140e6, 1400e3), (70e6, 350e3)
)
PRESETS: dict[str, SupportValues | None] = {
    "rigid": None,
    "ballasted": replace(_CO_RUNNING, rail_mass=0.0, sleeper_mass=0.0, sleeper_inertia=0.0),
    "co-running": _CO_RUNNING,
    "p2": SupportValues(245.0, (62e6, 55.4e3), _CO_RUNNING.pad_lateral),
    "slab": _slab(),
}


class Support(Definition):
    """Support of the rails: rails on pads and sleepers on ballast, moving with each wheelset."""

    preset: Preset = "ballasted"
    """Set of values that the other keys replace one by one: `rigid`, `ballasted` (without masses),
    `co-running` (the same with masses), `p2`, `slab`"""
    rail_mass: NonNegative | None = None
    """Mass of each rail that moves with a wheel [kg]; 0 = without masses"""
    pad_vertical: SpringDamper | None = None
    """Vertical [stiffness N/m, damping N s/m] between each rail and the sleeper"""
    pad_lateral: SpringDamper | None = None
    """Lateral [stiffness N/m, damping N s/m] between each rail and the sleeper"""
    sleeper_mass: NonNegative | None = None
    """Mass of sleeper and ballast that moves with a wheelset [kg]"""
    sleeper_inertia: NonNegative | None = None
    """Its moment of inertia in roll [kg m2]"""
    ballast_vertical: SpringDamper | None = None
    """Vertical [stiffness N/m, damping N s/m] under each half of the sleeper"""
    ballast_lateral: SpringDamper | None = None
    """Lateral [stiffness N/m, damping N s/m] of the whole sleeper"""
    ballast_base: Annotated[Positive, Field(le=3.0)] | None = None
    """Lateral distance of the ballast's vertical springs from the track's middle [m]"""
    variation: SidedRows[Positive] | None = None
    """Rows [s, factor] or [s, pads, ballast]: factors of stiffness and damping along the track,
    linear in between, constant beyond [m, 1]"""

    @check
    def _complete(self) -> None:
        names = SupportValues.__dataclass_fields__
        given = [name for name in names if getattr(self, name) is not None]
        base = PRESETS[self.preset]
        if base is None:
            if given or self.variation:
                key = given[0] if given else "variation"
                raise ValueError(f"'{key}' belongs to elastic rails, not to preset = \"rigid\"")
            return
        values = self.values
        assert values is not None
        sleeper = [values.ballast_vertical, values.ballast_lateral]
        if any(part is None for part in sleeper) != all(part is None for part in sleeper):
            raise ValueError("'ballast_vertical' and 'ballast_lateral' belong together")
        if values.has_sleeper:
            masses = (values.rail_mass, values.sleeper_mass, values.sleeper_inertia)
            if any(masses) != all(masses):
                raise ValueError(
                    "'rail_mass', 'sleeper_mass' and 'sleeper_inertia' are all 0 or all positive"
                )
        elif {"sleeper_mass", "sleeper_inertia", "ballast_base"} & {*given}:
            raise ValueError("a sleeper needs 'ballast_vertical' and 'ballast_lateral'")
        springs = [values.pad_vertical, values.pad_lateral, *sleeper]
        if values.massless and any(spring[1] == 0.0 for spring in springs if spring is not None):
            raise ValueError("without masses every spring needs a damping above 0")

    @property
    def words(self) -> str:
        """What carries the rails, for tables."""
        if self.preset == "rigid":
            return "rigid"
        values = self.model_dump(exclude={"preset"}, exclude_none=True)
        return f"elastic, {self.preset}{' with own values' if values else ''}"

    @property
    def values(self) -> SupportValues | None:
        """Values of the preset, replaced by those given; None for rigid rails."""
        base = PRESETS[self.preset]
        if base is None:
            return None
        given = {name: getattr(self, name) for name in SupportValues.__dataclass_fields__}
        return replace(base, **{name: value for name, value in given.items() if value is not None})
