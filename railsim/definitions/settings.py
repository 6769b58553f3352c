"""Settings files, `railsim-settings/1`: how a run is computed and what it puts out."""

from typing import Literal

from pydantic import Field, model_validator

from railsim.definitions.base import (
    Count,
    Definition,
    FileDefinition,
    Finite,
    NonNegative,
    Positive,
)

SETTINGS_FORMAT = "railsim-settings/1"


class InitialState(Definition):
    """Disturbance of a body at the start, added to the equilibrium."""

    x: Finite = 0.0
    """Displacement along the track [m]"""
    y: Finite = 0.0
    """Displacement to the right [m]"""
    z: Finite = 0.0
    """Displacement downwards [m]"""
    roll: Finite = 0.0
    """Angle about x [rad]"""
    pitch: Finite = 0.0
    """Angle about y [rad]"""
    yaw: Finite = 0.0
    """Angle about z [rad]"""
    vx: Finite = 0.0
    """Velocity along the track, beside the vehicle's speed [m/s]"""
    vy: Finite = 0.0
    """Velocity to the right [m/s]"""
    vz: Finite = 0.0
    """Velocity downwards [m/s]"""
    vroll: Finite = 0.0
    """Angular velocity about x [rad/s]"""
    vpitch: Finite = 0.0
    """Angular velocity about y [rad/s]"""
    vyaw: Finite = 0.0
    """Angular velocity about z [rad/s]"""


class Settings(FileDefinition):
    """How a run is computed: everything that a settings file says."""

    format: Literal["railsim-settings/1"] = "railsim-settings/1"
    """Kind and version of the file"""
    scheme: Literal["fast", "rk4"] = "fast"
    """Integration scheme: `fast` for use, `rk4` as the reference"""
    step: Positive | None = None
    """Time step [s]; by default chosen from vehicle and speed"""
    output_rate: Positive = 200.0
    """Output points per second [1/s]"""
    output_spacing: Positive | None = None
    """Distance between output points [m] instead of `output_rate`"""
    fastsim_grid: tuple[Count, Count] = (10, 10)
    """Cells of a contact patch along and across"""
    creep_law: Literal["fastsim"] = "fastsim"
    """Law of the creep forces"""
    contact_damping: NonNegative = 1e5
    """Damping of the wheel-rail contact, normal to the patch [N s/m]"""
    shear_modulus: Positive = 82e9
    """Shear modulus of wheels and rails [Pa]"""
    poisson: NonNegative = 0.28
    """Poisson's number of wheels and rails [1]"""
    initial: dict[str, InitialState] = Field(default_factory=dict)
    """Disturbance at the start by the body's full name"""

    @model_validator(mode="after")
    def _physical(self) -> "Settings":
        if self.poisson >= 0.5:
            raise ValueError("'poisson' must be below 0.5")
        return self
