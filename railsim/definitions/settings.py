"""Settings files, `railsim-settings/1`: how a run is computed and what it outputs."""

from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field

from railsim.definitions import base
from railsim.definitions.creep_law import CREEP_LAWS, CreepLawName
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.vehicle.laws import Law, LawUse, OwnOutput, with_sources
from railsim.errors import Fault

Step = Annotated[base.Finite, Field(ge=1e-6, le=0.1)]
Rate = Annotated[base.Finite, Field(ge=1e-3, le=1e5)]
Spacing = Annotated[base.Finite, Field(ge=1e-3, le=1e5)]
Cells = Annotated[int, Field(strict=True, ge=4, le=500)]
Share = Annotated[base.Finite, Field(ge=0.0, le=1.0)]


AdhesionRows = Annotated[
    tuple[tuple[base.NonNegative, Share], ...],
    Field(min_length=2),
    base.holds(
        lambda r: r[0] == (0.0, 0.0), "the first row must be [0.0, 0.0]: no creepage, no force"
    ),
    base.rises("first column"),
]


class InitialState(base.Definition):
    """Disturbance of a body at the start, added to the equilibrium."""

    x: base.Finite = 0.0
    """Displacement along the track [m]"""
    y: base.Finite = 0.0
    """Displacement to the right [m]"""
    z: base.Finite = 0.0
    """Displacement downwards [m]"""
    roll: base.Finite = 0.0
    """Angle about x [rad]"""
    pitch: base.Finite = 0.0
    """Angle about y [rad]"""
    yaw: base.Finite = 0.0
    """Angle about z [rad]"""
    vx: base.Finite = 0.0
    """Velocity along the track, beside the vehicle's speed [m/s]"""
    vy: base.Finite = 0.0
    """Velocity to the right [m/s]"""
    vz: base.Finite = 0.0
    """Velocity downwards [m/s]"""
    vroll: base.Finite = 0.0
    """Angular velocity about x [rad/s]"""
    vpitch: base.Finite = 0.0
    """Angular velocity about y [rad/s]"""
    vyaw: base.Finite = 0.0
    """Angular velocity about z [rad/s]"""


STEEPEST = 5.0  # acceleration along the track, on dry rails and with track brakes [m/s2]


class Drive(base.Definition):
    """Speed profile along the track."""

    mode: Literal["constant", "table", "free"] = "constant"
    """`constant`: the speed of the run; `table`: after `speed_table`; `free`: the run's speed at
    the start, then by traction and resistance"""
    speed_table: base.RisingRows[base.Finite, base.Speed] | None = None
    """Rows [arc length m, speed m/s], linear in between, constant beyond"""
    traction_table: base.RisingRows[base.NonNegative, base.Finite] | None = None
    """Rows [speed m/s, force N] on the reference body, braking negative, constant beyond"""
    resistance: tuple[base.NonNegative, base.NonNegative, base.NonNegative] = (0.0, 0.0, 0.0)
    """Running resistance a + b V + c V^2 on the reference body [N, N s/m, N s2/m2]"""

    @base.check
    def _what_the_mode_needs(self) -> None:
        if (self.mode == "table") != (self.speed_table is not None):
            raise ValueError("'speed_table' belongs to mode = \"table\" and only to it")
        if self.mode != "free" and (self.traction_table or any(self.resistance)):
            raise ValueError("'traction_table' and 'resistance' belong to mode = \"free\"")

    def unusual(self) -> list[base.Remark]:
        """Return the steepest pair of rows, a = V dV/ds, that wheels and brakes do not follow."""
        steep = [
            (max(v, w) * abs(w - v) / (t - s), s, t)
            for (s, v), (t, w) in pairwise(self.speed_table or ())
        ]
        return [
            base.Remark(
                "drive.speed_table",
                f"asks for {rate:.3g} m/s2 between {s:.12g} and {t:.12g} m; wheels and brakes give "
                f"{STEEPEST:g} m/s2 at most",
            )
            for rate, s, t in sorted(steep)[-1:]
            if rate > STEEPEST
        ]


# Smallest output rate over the filter's frequency: room for the transition (zero); 1/1000 of what
# is folded back to the corner (causal: order 4).
LEAST_RATE = {"zero": 2.5, "causal": 6.7}


class LowPass(base.Definition):
    """Filter between the time loop and the result, so that slow sampling folds nothing back."""

    frequency: base.Positive
    """End of the pass band (`zero`), -3 dB (`causal`) [Hz]; at most `output_rate`/2.5 (`zero`),
    /6.7 (`causal`)"""
    phase: Literal["zero", "causal"] = "zero"
    """`zero`: without phase, flat to `frequency` and nothing above `output_rate` - `frequency`;
    `causal`: Butterworth of order 4, as a measuring amplifier"""


class Outputs(base.Definition):
    """What a run outputs."""

    quantities: tuple[base.Text, ...] = ()
    """Which of the usual quantities to keep, `*` standing for any letters; by default all"""
    evaluate_after: base.NonNegative | None = None
    """Time after the start that tables of peaks leave out [s]; by default 1 s, and no more than a
    tenth of the run; 0: none"""
    low_pass: LowPass | None = None
    """Low pass of all quantities before they are stored at `output_rate`; needs a constant speed"""
    sensors: base.Flag | Literal["readings"] = False
    """Motion of points: floor, bogie frames, axleboxes and the vehicle's `sensors`; accelerations
    also as accelerometers read them; `readings`: these and roll velocities alone"""

    elements: tuple[base.Text, ...] = ()
    """Full names of force elements, `*` standing for any letters: their deflection, force, power"""
    contact_patches: base.Flag = False
    """Position, size, load, creep forces and pressure of every contact patch"""
    frictional_power: base.Flag = False
    """Power that each wheel's contact turns into heat"""
    drives: base.Flag = False
    """Torque of drives, brakes and actuators on each wheelset, and the speed along the track"""
    track: base.Flag = False
    """Curvature, cant, gradient and irregularities at each wheelset"""
    own: dict[base.Name, OwnOutput] | None = None
    """Quantities by user-defined laws, by name"""


class Settings(FileDefinition):
    """How a run is computed: everything that a settings file says."""

    KIND: ClassVar = "settings"
    OPEN_TABLES: ClassVar = ("initial",)

    format: Literal["railsim-settings/1"] = "railsim-settings/1"
    scheme: Literal["fast", "rk4"] = "fast"
    """Integration scheme: `fast`, or `rk4` as the reference"""
    step: Step | None = None
    """Time step [s], at constant speed a whole part of the output interval; by default chosen from
    vehicle and speed"""
    output_rate: Rate = 200.0
    """Output points per second [1/s]"""
    output_spacing: Spacing | None = None
    """Distance between output points [m] instead of `output_rate`"""
    fastsim_grid: tuple[Cells, Cells] = (10, 10)
    """Cells of a contact patch along and across; in full sliding 4 x 4 carry 5 % more than mu N,
    10 x 10 0.7 %"""
    creep_law: CreepLawName = "fastsim"
    """Law of the creep forces; `table` is the full theory, tabulated"""
    laws: dict[base.Name, Law] | None = None
    """User-defined laws by name: Python functions, executed only with permission"""
    own_creep_law: LawUse | None = None
    """User-defined creep law, instead of `creep_law`"""
    own_friction: LawUse | None = None
    """Factor of the friction over the slip velocity by a user-defined law, instead of the track's
    `friction_falling`"""
    adhesion_curve: AdhesionRows | None = None
    """Measured curve of the law `adhesion_curve`: rows [creepage, T/(mu N)] from [0, 0] on, linear
    in between, constant beyond [1]"""
    transient_creep: base.Flag = False
    """Creep forces follow the creepages over the length of the patch, instead of steady rolling"""
    normal_contact: Literal["hertz", "kik-piotrowski"] = "hertz"
    """Normal contact: the Hertz ellipse of averaged curvatures, or non-elliptic patches"""
    contact_damping: base.NonNegative = 2e5
    """Damping of the wheel-rail contact, normal to the patch [N s/m]"""
    shear_modulus: base.Positive = 82e9
    """Shear modulus of wheels and rails [Pa]"""
    poisson: base.NonNegative = 0.28
    """Poisson's ratio of wheels and rails [1]"""
    drive: Drive = Drive.model_construct()
    """Speed profile along the track"""
    start_state: Literal["run-in", "steady"] = "run-in"
    """Of a run that begins in a curve: the end of some 10 s over an auxiliary track, or the steady
    state by Newton's method"""
    outputs: Outputs = Outputs.model_construct()
    """Further quantities in the result"""
    initial: dict[str, InitialState] = base.EMPTY_TABLE
    """Disturbance at the start by the body's full name"""

    def output_interval(self, speed: float) -> float:
        """Time between two outputs at a speed [s]."""
        return self.output_spacing / speed if self.output_spacing else 1.0 / self.output_rate

    def in_steady_rolling(self) -> Self:
        """Return the settings of analyses whose creep forces are those of steady rolling."""
        return self.model_copy(update={"transient_creep": False})

    @classmethod
    def complete(cls, tables: dict[str, Any]) -> list[Fault]:
        """Put the sources of laws into the tables."""
        return with_sources(tables)

    def unusual(self) -> list[base.Remark]:
        """Return values beside which another takes their place."""
        remarks, grid = self.drive.unusual(), type(self).model_fields["fastsim_grid"].default
        gridded = CREEP_LAWS[self.creep_law].grid and self.own_creep_law is None
        if not gridded and self.fastsim_grid != grid:
            remarks.append(base.Remark("fastsim_grid", "has no effect: the creep law has no cells"))
        return remarks

    @base.check
    def _physical(self) -> None:
        usual = type(self).model_fields["output_rate"].default
        if self.output_spacing is not None and self.output_rate != usual:
            raise ValueError("either 'output_rate' or 'output_spacing', not both")
        if self.poisson >= 0.5:
            raise ValueError("'poisson' must be below 0.5")
        if (self.creep_law == "adhesion_curve") != (self.adhesion_curve is not None):
            raise ValueError(
                "'adhesion_curve' belongs to creep_law = \"adhesion_curve\" and only to it"
            )
        low_pass = self.outputs.low_pass
        if low_pass is not None:
            least = LEAST_RATE[low_pass.phase] * low_pass.frequency
            if self.output_spacing is not None or self.drive.mode != "constant":
                raise ValueError("'outputs.low_pass' needs a constant speed and 'output_rate'")
            if self.output_rate < least * (1.0 - 1e-9):
                raise ValueError(
                    f"'output_rate' must be {least:.12g} at least with 'outputs.low_pass' of "
                    f"{low_pass.frequency:g} Hz"
                )
