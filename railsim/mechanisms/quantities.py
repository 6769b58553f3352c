"""Names, units and meanings of a mechanism's results: tables, files and pictures take them here."""

from collections.abc import Iterable

from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.parts import HandTorque
from railsim.table import Column

QUANTITIES = {
    column.name: column
    for column in (
        Column("length", "length of the actuator", "mm", ".3f"),
        Column("height", "height of the output over the start", "mm", ".2f"),
        Column("x", "x of the output over the start", "mm", ".2f"),
        Column("ratio", "height over length, derivative", "", ".4f"),
        Column("ratio_x", "x over length, derivative", "", ".4f"),
        Column("pressure", "pressure that gives the force", "MPa", ".5f"),
        Column("pressure_back", "pressure on the way back", "MPa", ".5f"),
        Column("effective_weight", "weight of everything, felt at the output", "N", ".2f"),
        Column("effective_mass", "mass of everything, felt at the output", "kg", ".3f"),
    )
}


def quantity(name: str, definition: Mechanism) -> Column:
    """What a named result of a mechanism is."""
    angular = definition.driver.angle is not None
    if name in QUANTITIES:
        return QUANTITIES[name]
    if name == "travel":
        return Column(name, "driver", "deg" if angular else "mm", ".4f" if angular else ".3f")
    if name == "rate":
        unit, shown = ("mm/rad", ".3f") if angular else ("", ".4f")
        return Column(name, "length over the driver, derivative", unit, shown)
    if name in ("force", "force_back") and definition.solve is not None:
        unit = force_unit(definition.unknown, definition)
        way = " on the way back" if name == "force_back" else ""
        words = f"{'torque' if unit == 'N m' else 'force'} of the unknown actuator{way}"
        return Column(name, words, unit, ".3f" if unit == "N m" else ".2f")
    if name in definition.angles or name.endswith("_pressure_angle"):
        return Column(name, "angle", "deg", ".3f")
    if name.endswith("_pressure"):
        return Column(name, "pressure of the gas over the outside", "MPa", ".3f")
    if name.endswith("_length"):
        return Column(name, "length", "mm", ".3f")
    return Column(name, "push", "N", ".2f")


def force_unit(actuator: str, definition: Mechanism) -> str:
    """Unit of the force, or torque, of an actuator."""
    return "N m" if isinstance(definition.actuators[actuator], HandTorque) else "N"


def force_units(definitions: Iterable[Mechanism]) -> str:
    """Unit of the unknown forces of mechanisms; where they differ, each of them."""
    units = {force_unit(one.unknown, one) for one in definitions if one.solve is not None}
    return " or ".join(sorted(units)) or "N"
