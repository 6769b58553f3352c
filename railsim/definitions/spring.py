"""Spring files, `railsim-spring/1`: a trailing arm on its coil springs, loads, limits, search.

The first five tables and `[loads]` are what every command needs; the others have defaults or
belong to one command (`[target]` to design, `[fatigue]` to fatigue, `[vehicle]` to vehicle,
`[search]` and `[tolerances]` to the search).  Lengths in m, forces in N, stresses in Pa.
"""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from railsim.definitions import base
from railsim.definitions.file_definition import FileDefinition
from railsim.errors import Fault, nearest

Row = tuple[base.NonNegative, base.Positive]


TARE = "ODM"  # usual name of the tare load; not looked for where nothing uses it
LARGEST = 50.0  # m; no part of a suspension is nearly as large
LENGTHS = (
    *("length", "seat_height", "mean_diameter", "free_height", "wire_diameter", "engagement"),
    *("deflection", "outer_diameter_max", "wheel_radius", "lateral_position"),
)
_NUMBER = {"type": "number", "exclusiveMinimum": 0}
_ROW = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}

NumberOrTable = Annotated[
    tuple[Row, ...],
    BeforeValidator(lambda v: v if isinstance(v, list | tuple) else ((0.0, v),)),
    Field(min_length=1),
    base.rises("first column"),
    WithJsonSchema({"anyOf": [_NUMBER, {"type": "array", "items": _ROW, "minItems": 1}]}),
]
Polyline = Annotated[
    tuple[Row, ...],
    Field(min_length=2),
    base.rises("first column"),
    base.holds(
        lambda rows: all(lower <= upper for lower, upper in rows),
        "rows [tau_min, tau_max]: the upper stress must not be below the lower",
    ),
]
Bounds = Annotated[
    tuple[base.Positive, base.Positive],
    base.holds(
        lambda b: b[0] <= b[1], "[smallest, largest]: the second must not be below the first"
    ),
]


class TrailingArm(base.Definition):
    """The axlebox arm, horizontal under the mounting load."""

    length: base.Positive
    """Hinge on the bogie frame to axle centre [m]"""
    seat_height: base.NonNegative
    """Height of the outer spring's lower seat above the axle centre [m]"""
    bush_torsional_stiffness: base.NonNegative
    """Torsional stiffness of the hinge's bush, unloaded at the mounting load [N m/rad]"""
    equilibrium: Literal["grossi", "energy"] = "grossi"
    """Form of the nest's moment: the reference's, or the derivative of the stored energy"""


class Material(base.Definition):
    """Material of the springs."""

    G: base.Positive
    """Shear modulus [Pa]"""
    E: base.Positive
    """Young's modulus [Pa]"""
    density: base.Positive = 7850.0
    """Density [kg/m3]"""
    tau_allowable: NumberOrTable | None = None
    """Allowable shear stress of the solid spring [Pa], or rows [wire diameter m, stress Pa]"""

    @base.check
    def _isotropic(self) -> None:
        nu = self.E / (2.0 * self.G) - 1.0
        if not 0.0 <= nu < 0.5:
            raise ValueError(
                f"E/(2 G) - 1 is {nu:.3f}; Poisson's ratio must be from 0 to 0.5: "
                "G must be between E/3 and E/2"
            )


class HelicalSpring(base.Definition):
    """A helical spring of round wire."""

    mean_diameter: base.Positive
    """Mean coil diameter D [m]"""
    free_height: base.Positive
    """Height without load H0 [m]"""
    wire_diameter: base.Positive | None = None
    """Wire diameter d [m]; design can do without"""
    active_coils: base.Positive | None = None
    """Number of active coils n; design finds it"""

    @base.check
    def _winds(self) -> None:
        if self.wire_diameter is not None and self.wire_diameter >= self.mean_diameter:
            raise ValueError("'wire_diameter' must be below 'mean_diameter'")


class InnerSpring(HelicalSpring):
    """The spring within the outer one."""

    engagement: base.NonNegative | None = None
    """Deflection of the outer spring at which this one starts to work [m]; by default 0, its
    seat raised by the difference of the free heights"""
    seat_height: base.NonNegative | None = None
    """Height of its lower seat above the axle centre [m] instead of `engagement`"""

    @base.check
    def _one_way_of_standing(self) -> None:
        if self.engagement is not None and self.seat_height is not None:
            raise ValueError("either 'engagement' or 'seat_height', not both")


class Point(base.Definition):
    """A load with its wanted deflection."""

    load: base.Positive
    """Load of one primary suspension [N]"""
    deflection: base.Positive
    """Deflection of the outer spring under it [m]"""


class Fatigue(base.Definition):
    """Dynamic loads and the material's Goodman-Smith line."""

    max_load: base.Positive | None = None
    """Highest dynamic load [N]; by default the tare load + 20 %"""
    min_load: base.Positive | None = None
    """Lowest dynamic load [N]; by default the tare load - 35 %"""
    tare: base.Text = TARE
    """Name of the tare load among `loads`"""
    goodman: Polyline
    """Rows [tau_min, tau_max] of the Goodman-Smith line [Pa]"""


class Checks(base.Definition):
    """Constants and limits of the checks."""

    dead_coils: base.NonNegative = 0.2
    """Dead coils n_m beyond the end coils"""
    end_coils: base.NonNegative = 1.5
    """End coils n_e, closed and ground"""
    clearance_factor: base.NonNegative = 0.002
    """Reserve above the solid height over n (D + d), as in the reference study"""
    standard_clearance_factor: base.NonNegative = 0.02
    """The same for the check after EN 13906-1 (hot coiled, static)"""
    solid_load: base.Text | None = None
    """Name of the load for the solid height; by default the highest"""
    seating: Annotated[base.Finite, Field(ge=0.5, le=2.0)] = 1.0
    """Seating coefficient of EN 13906-1 for buckling; 1: seats parallel, free to move sideways"""
    radial_clearance: base.NonNegative = 0.0
    """Least clearance between inner and outer spring [m]"""
    fatigue_margin: base.Positive = 1.0
    """Least margin against the Goodman-Smith line"""


class Search(base.Definition):
    """Space, limits and aim of the search for nests."""

    objective: Literal["mass", "fatigue"] = "mass"
    """Ranked by least mass or by largest fatigue margin"""
    wire_diameters: Annotated[tuple[base.Positive, ...], Field(min_length=1)] | None = None
    """Wire diameters to choose from [m]; by default the bars of EN 10060 from 10 to 60 mm"""
    outer_diameter_max: base.Positive
    """Largest outside diameter of the outer spring [m]"""
    inner_diameter_min: base.NonNegative = 0.0
    """Smallest inside diameter of the inner spring [m]"""
    clearance_min: base.NonNegative = 0.005
    """Smallest radial clearance between the springs [m]"""
    free_height: Bounds
    """Smallest and largest free height [m]"""
    spring_index: Bounds = (3.0, 12.0)
    """Smallest and largest D/d; EN 13906-1 for hot coiled springs by default"""
    active_coils_min: base.Positive = 3.0
    """Smallest number of active coils; EN 13906-1 for hot coiled springs by default"""
    fatigue_margin_min: base.Positive = 1.0
    """Smallest margin against the Goodman-Smith line"""
    stress_ratio_max: base.Positive = 1.0
    """Largest stress of the solid spring over the allowable one"""
    buckling_ratio_max: base.Positive = 0.9
    """Largest deflection over the buckling deflection"""
    candidates: Annotated[int, Field(strict=True, ge=64, le=1_000_000)] = 10_000
    """Number of nests that are tried before the best are refined"""
    results: Annotated[int, Field(strict=True, ge=1, le=100)] = 10
    """Number of nests that are returned"""
    diameter_step: base.Positive = 0.001
    """Step to which mean diameters and free height are rounded [m]"""
    coil_step: base.Positive = 0.05
    """Step to which the number of active coils is rounded"""
    height_error_max: base.Positive = 0.003
    """Largest error of a deflection that the rounding may cause [m]"""


class Tolerances(base.Definition):
    """Scatter of springs, plus and minus; the same for both springs."""

    wire_diameter: base.NonNegative = 0.0
    """Wire diameter [m]"""
    mean_diameter: base.NonNegative = 0.0
    """Mean coil diameter [m]"""
    active_coils: base.NonNegative = 0.0
    """Number of active coils"""
    free_height: base.NonNegative = 0.0
    """Free height [m]"""
    G: Annotated[base.NonNegative, Field(lt=0.5)] = 0.0
    """Shear modulus, relative"""
    bush: Annotated[base.NonNegative, Field(lt=1.0)] = 0.0
    """Torsional stiffness of the bush, relative"""


class Bush(base.Definition):
    """The rubber bush in the arm's hinge, as the vehicle model needs it."""

    stiffness: base.NonNegativeVector
    """Stiffness along x, y, z [N/m]"""
    damping: base.NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping along x, y, z [N s/m]"""
    rotational_stiffness: base.NonNegativeVector
    """Stiffness about x, y, z [N m/rad]"""
    rotational_damping: base.NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping about x, y, z [N m s/rad]"""


class VehicleTable(base.Definition):
    """Where and how the suspension goes into a vehicle file."""

    load: base.Text
    """Name of the load at which the vehicle's springs are taken, normally tare"""
    extends: base.Text
    """Vehicle file that the written file extends"""
    remove: tuple[base.Text, ...] = ()
    """Parts of that vehicle that this suspension replaces"""
    assembly: base.Text = "assemblies.bogie.assemblies.axle"
    """Assembly with the wheelset; its origin is above the axle, the bogie's centre at x < 0"""
    frame: base.Text = "frame"
    """Name of the bogie frame"""
    wheelset: base.Text = "wheelset"
    """Name of the wheelset within the assembly"""
    wheel_radius: base.Positive
    """Height of the axle above the rail tops [m]"""
    lateral_position: base.Positive
    """Lateral distance of arm and springs from the vehicle's middle [m]"""
    pitch_inertia: base.Positive = 10.0
    """Moment of inertia of axlebox and arm about the axle [kg m2]"""
    bush: Bush
    """The bush in the hinge"""


class TrailingArmSuspension(FileDefinition):
    """A trailing-arm primary suspension: everything that a spring file says."""

    KIND: ClassVar = "spring"
    OPEN_TABLES: ClassVar = ("loads",)

    format: Literal["railsim-spring/1"]
    name: base.Text = "trailing-arm primary suspension"
    """What the suspension is called in tables and plots"""
    source: base.Text | None = None
    """Where the numbers come from"""
    arm: TrailingArm
    """The axlebox arm"""
    material: Material
    """Material of the springs"""
    outer: HelicalSpring
    """The outer spring"""
    inner: InnerSpring | None = None
    """The inner spring, if there is one"""
    mounting: Point
    """Load under which the arm is horizontal, and the deflection wanted there"""
    target: Point | None = None
    """One further load with its wanted deflection, for the design"""
    loads: dict[base.Text, base.Positive] = Field(min_length=1)
    """Loads of one primary suspension by name [N]"""
    load_notes: dict[base.Text, base.Text] = base.EMPTY_TABLE
    """What each load is, by its name"""
    fatigue: Fatigue | None = None
    """Dynamic loads and Goodman-Smith line"""
    checks: Checks = Checks()
    """Constants and limits of the checks"""
    search: Search | None = None
    """Space and limits for the search for nests"""
    tolerances: Tolerances | None = None
    """Scatter of the springs"""
    vehicle: VehicleTable | None = None
    """Where the suspension goes in a vehicle file"""

    @property
    def springs(self) -> dict[str, HelicalSpring]:
        """The springs by name, outer first."""
        pair = {"outer": self.outer, "inner": self.inner}
        return {name: spring for name, spring in pair.items() if spring is not None}

    @property
    def engagement(self) -> float:
        """Deflection of the outer spring at which the inner one starts to work [m]."""
        if self.inner is None:
            return 0.0
        if self.inner.seat_height is not None:
            lower_top = self.inner.seat_height + self.inner.free_height
            return self.arm.seat_height + self.outer.free_height - lower_top
        return self.inner.engagement or 0.0

    def contradictions(self) -> list[Fault]:
        """Return what is wrong between the parts."""
        wrong = [*_load_faults(self), *_inner_faults(self), *_tolerance_faults(self)]
        return [*_size_faults(self)] or wrong  # which follows from a length in millimetres

    def unusual(self) -> list[base.Remark]:
        """Return what is allowed but unusual."""
        remarks = []
        if self.search is not None:
            unlimited = "missing: the search does not limit the stress"
            if self.material.tau_allowable is None:
                remarks.append(
                    base.Remark("material.tau_allowable", f"{unlimited} of the solid springs")
                )
            if self.fatigue is None:
                remarks.append(base.Remark("fatigue", f"{unlimited} in service"))
        for name, spring in self.springs.items():
            wire = spring.wire_diameter
            if wire is not None and not 3.0 <= (index := spring.mean_diameter / wire) <= 12.0:
                text = f"spring index D/d is {index:.2f}; EN 13906-1 covers 3 to 12, hot coiled"
                remarks.append(base.Remark(f"{name}.mean_diameter", text))
            if spring.active_coils is not None and spring.active_coils < 3.0:
                text = "EN 13906-1 covers hot coiled springs from 3 on"
                remarks.append(base.Remark(f"{name}.active_coils", text))
        return remarks

    @property
    def seat_heights(self) -> tuple[float, ...]:
        """Height of each spring's lower seat above the axle centre, outer first [m]."""
        if self.inner is None:
            return (self.arm.seat_height,)
        raised = self.outer.free_height - self.inner.free_height - self.engagement
        return (self.arm.seat_height, self.arm.seat_height + raised)


def _size_faults(suspension: TrailingArmSuspension) -> Iterator[Fault]:
    """Lengths that look like millimetres."""
    for table in ("arm", "outer", "inner", "mounting", "target", "search", "vehicle"):
        part = getattr(suspension, table)
        for key in LENGTHS:
            value = getattr(part, key, None) or 0.0
            largest = max(value) if isinstance(value, tuple) else value
            if largest >= LARGEST:
                yield Fault("", f"{table}.{key}", f"{largest:g} m", "lengths in metres")


def _load_faults(suspension: TrailingArmSuspension) -> Iterator[Fault]:
    loads, fatigue = suspension.loads, suspension.fatigue
    references = [(f"load_notes.{name}", name) for name in suspension.load_notes]
    if suspension.checks.solid_load is not None:
        references.append(("checks.solid_load", suspension.checks.solid_load))
    if suspension.vehicle is not None:
        references.append(("vehicle.load", suspension.vehicle.load))
    if fatigue is not None:
        highest, lowest = fatigue.max_load, fatigue.min_load
        if None in (highest, lowest) or fatigue.tare != TARE:
            references.append(("fatigue.tare", fatigue.tare))
        if highest is not None and lowest is not None and highest <= lowest:
            found = f"{highest:.12g} N is not above fatigue.min_load {lowest:.12g} N"
            yield Fault("", "fatigue.max_load", found, "the highest dynamic load")
    for key, name in references:
        if name not in loads:
            yield Fault("", key, f"no load '{name}' in [loads]", nearest(name, loads))


def _inner_faults(suspension: TrailingArmSuspension) -> Iterator[Fault]:
    """Faults of where the inner spring stands."""
    outer, inner = suspension.outer, suspension.inner
    if inner is None:
        return
    early, below = -suspension.engagement, -suspension.seat_heights[1]
    if early > 1e-9:
        found = f"the inner spring would touch {early * 1e3:.1f} mm before the outer one"
        words = "lower inner.seat_height or inner.free_height by as much: the outer spring must be"
        yield Fault("", "inner.seat_height", found, f"{words} the first to work")
    elif below > 1e-9:
        found = f"the inner spring would stand {below * 1e3:.1f} mm below the axle centre"
        allowed = "shorten inner.free_height, or raise arm.seat_height or outer.free_height"
        yield Fault("", "inner.free_height", found, allowed)
    clearance = radial_clearance(outer, inner)
    if clearance <= 0.0:
        words = "the inner spring does not fit into the outer one: radial clearance"
        allowed = "reduce inner.mean_diameter or a wire diameter, or raise outer.mean_diameter"
        yield Fault("", "inner.mean_diameter", f"{words} {clearance * 1e3:.1f} mm", allowed)


def _tolerance_faults(suspension: TrailingArmSuspension) -> Iterator[Fault]:
    """Tolerances that leave nothing of what deviates."""
    if suspension.tolerances is None:
        return
    for name, spring in suspension.springs.items():
        for key in ("wire_diameter", "mean_diameter", "active_coils", "free_height"):
            value, deviation = getattr(spring, key), getattr(suspension.tolerances, key)
            if value is not None and deviation >= value:
                found = f"{deviation:g}, but {name}.{key} is {value:g}"
                yield Fault("", f"tolerances.{key}", found, "less than what deviates")


def radial_clearance(outer: HelicalSpring, inner: HelicalSpring) -> float:
    """Radial gap between two concentric springs; without wire diameters, of the mean lines [m]."""
    wires = (outer.wire_diameter or 0.0) + (inner.wire_diameter or 0.0)
    return 0.5 * (outer.mean_diameter - inner.mean_diameter - wires)
