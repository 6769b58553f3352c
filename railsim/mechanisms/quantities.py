"""Names, units and meanings of a mechanism's results: tables, files and pictures take them here."""

from dataclasses import dataclass

import numpy as np

from railsim.definitions.mechanism import Mechanism


@dataclass(frozen=True)
class Quantity:
    """A result: its unit in files, the unit shown, the factor between them, what it is."""

    unit: str
    shown: str
    scale: float
    digits: int
    meaning: str


DEGREES = float(np.degrees(1.0))
QUANTITIES = {
    "travel": Quantity("rad", "deg", DEGREES, 4, "driver"),
    "length": Quantity("m", "mm", 1e3, 3, "length of the actuator"),
    "rate": Quantity("m/rad", "mm/rad", 1e3, 3, "length over the driver, derivative"),
    "height": Quantity("m", "mm", 1e3, 2, "height of the output over the start"),
    "x": Quantity("m", "mm", 1e3, 2, "the same along x"),
    "ratio": Quantity("1", "", 1.0, 4, "height over length, derivative"),
    "ratio_x": Quantity("1", "", 1.0, 4, "the same along x"),
    "force": Quantity("N", "N", 1.0, 2, "force of the unknown actuator"),
    "force_back": Quantity("N", "N", 1.0, 2, "the same on the way back"),
    "pressure": Quantity("Pa", "MPa", 1e-6, 5, "pressure that gives this force"),
    "pressure_back": Quantity("Pa", "MPa", 1e-6, 5, "the same on the way back"),
    "effective_weight": Quantity("N", "N", 1.0, 2, "weight of everything, felt at the output"),
    "effective_mass": Quantity("kg", "kg", 1.0, 3, "mass of everything, felt at the output"),
}
ANGLE = Quantity("rad", "deg", DEGREES, 3, "angle")
LENGTH = Quantity("m", "mm", 1e3, 3, "length")
GAS = Quantity("Pa", "MPa", 1e-6, 3, "pressure of the gas over the outside")
FORCE = Quantity("N", "N", 1.0, 2, "push")
TORQUE = Quantity("N m", "N m", 1.0, 3, "torque of the unknown actuator")
SHOWN = {"m": ("mm", 1e3), "rad": ("deg", DEGREES), "Pa": ("MPa", 1e-6), "1": ("", 1.0)}


def quantity(name: str, definition: Mechanism) -> Quantity:
    """What a named result of a mechanism is."""
    angular = definition.driver.angle is not None
    if name == "travel":
        return QUANTITIES[name] if angular else Quantity("m", "mm", 1e3, 3, "driver")
    if name == "rate" and not angular:
        return Quantity("1", "", 1.0, 4, QUANTITIES[name].meaning)
    if name in ("force", "force_back") and definition.solve is not None:
        turns = force_unit(definition.solve.unknown, definition) == "N m"
        return TORQUE if turns else QUANTITIES[name]
    if name in QUANTITIES:
        return QUANTITIES[name]
    if name in definition.angles or name.endswith("_pressure_angle"):
        return ANGLE
    if name.endswith("_pressure"):
        return GAS
    return LENGTH if name.endswith("_length") else FORCE


def force_unit(actuator: str, definition: Mechanism) -> str:
    """Unit of the force, or torque, of an actuator."""
    return "N m" if hasattr(definition.actuators[actuator], "turn") else "N"


def shown(value: float, unit: str, digits: int = 6) -> str:
    """A parameter's value in the unit in which it is shown."""
    name, scale = SHOWN.get(unit, (unit, 1.0))
    return f"{value * scale:.{digits}g} {name}".rstrip()
