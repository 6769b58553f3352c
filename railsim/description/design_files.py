"""What spring and mechanism files hold."""

from collections.abc import Callable
from typing import Any

from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.values import parameter_values
from railsim.definitions.spring import TrailingArmSuspension
from railsim.description.values import Parts
from railsim.table import Column, Table


def mechanism_parts(mechanism: Mechanism) -> Parts:
    """Return parts, driver and parameters with their provenance."""
    values = parameter_values(mechanism)
    driver = mechanism.driver
    driver_name = driver.angle or driver.coordinate or " to ".join(driver.length or ())
    parts: Parts = [mechanism.name]
    parts += [f"  source: {mechanism.source}"] if mechanism.source else []

    def names(*tables: str) -> Parts:
        members = ((table, getattr(mechanism, table)) for table in tables)
        return [f"  {table}: {', '.join(keys)}" for table, keys in members if keys]

    parts += [*names("bodies", "joints"), f"  driven by {driver_name}"]
    parts += names("actuators", "elements", "cases", "catalogues")
    right = [Column(name, format=">") for name in ("value", "unit", "provenance")]
    rows = [
        [
            name,
            "auto" if name in mechanism.automatic else f"{float(values[name]):.8g}",
            mechanism.unit_of(name),
            mechanism.provenance_of(name),
        ]
        for name in mechanism.parameters
    ]
    return [*parts, "", Table([Column("parameter"), *right], rows)]


def spring_parts(suspension: TrailingArmSuspension) -> Parts:
    """Return arm, springs, loads, and what else the file holds."""
    arm, material = suspension.arm, suspension.material
    parts: Parts = [
        suspension.name,
        f"  arm {arm.length:g} m, seat {1e3 * arm.seat_height:g} mm above the axle, bush "
        f"{arm.bush_torsional_stiffness:g} N m/rad, moment of the nest by '{arm.equilibrium}'",
        f"  G {material.G / 1e9:g} GPa, E {material.E / 1e9:g} GPa, {material.density:g} kg/m3",
    ]
    parts += [f"  source: {suspension.source}"] if suspension.source else []
    columns = [
        Column("spring"),
        Column("mean_diameter", "D", "mm", ".6g"),
        Column("wire_diameter", "d", "mm", ".6g"),
        Column("active_coils", "active coils", "", ".6g"),
        Column("free_height", "free height", "mm", ".6g"),
        Column("seat", "seat", "mm", ".6g"),
    ]
    seats = zip(suspension.springs.items(), suspension.seat_heights, strict=True)
    rows = [{"spring": name, **vars(spring), "seat": seat} for (name, spring), seat in seats]
    parts += ["", Table(columns, rows)]
    if suspension.engagement:
        parts.append(f"the inner spring works from {1e3 * suspension.engagement:g} mm on")
    points = [("mounting", suspension.mounting), ("target", suspension.target)]
    targets = {point.load: (name, point.deflection) for name, point in points if point is not None}
    loads = [[name, load, None] for name, load in suspension.loads.items()]
    loads += [[name, load, deflection] for load, (name, deflection) in targets.items()]
    force = Column("force", unit="kN", format="g")
    deflection = Column("deflection", "wanted deflection", "mm", "g")
    parts += ["", Table([Column("load"), force, deflection], loads)]
    optional = ("fatigue", "search", "tolerances", "vehicle")
    present = [name for name in optional if getattr(suspension, name) is not None]
    return [*parts, "", f"tables besides: {', '.join(present) or 'none'}"]


PARTS: dict[str, Callable[[Any], Parts]] = {"spring": spring_parts, "mechanism": mechanism_parts}
