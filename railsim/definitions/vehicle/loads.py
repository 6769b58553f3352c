"""Load cases of a vehicle file: what passengers or goods change in the bodies.

A vehicle's own numbers are those of its design load, in which it stands in its nominal position.  A
load case replaces masses, inertias and centres of gravity; the springs stay as they are, and the
static equilibrium finds ride height, roll and pitch.
"""

from collections.abc import Iterator
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator

from railsim.definitions import base
from railsim.errors import Fault, nearest

DESIGN = "design"  # the load of the vehicle's own numbers, as a load case is called


LoadName = Annotated[base.Text, AfterValidator(lambda name: None if name == DESIGN else name)]
V = TypeVar("V", bound=base.Definition)  # a vehicle, which is built on this module


class BodyLoad(base.Definition):
    """What a load case changes in one body."""

    mass: base.Positive | None = None
    """Mass with the load [kg]"""
    inertia: base.PositiveVector | None = None
    """Moments of inertia Ixx, Iyy, Izz about the common centre of gravity [kg m2]"""
    position: base.Vector | None = None
    """Common centre of gravity, where the body is in its nominal position [m]"""

    @base.check
    def _something_changes(self) -> None:
        if self.mass is None and self.inertia is None and self.position is None:
            raise ValueError("'mass', 'inertia' or 'position' is needed")


class LoadGroup(base.Definition):
    """Bodies of the vehicle, or of one of its assemblies, that a load case changes."""

    bodies: dict[base.Name, BodyLoad] = base.EMPTY_TABLE
    """Changed bodies by their names"""
    assemblies: dict[base.Name, "LoadGroup"] = base.EMPTY_TABLE
    """Assemblies with changed bodies by their names"""


class LoadCase(LoadGroup):
    """One load case: tare, laden, crush, uneven."""

    description: base.Text | None = None
    """What it stands for"""


def in_load_case(vehicle: V) -> V:
    """Return the vehicle with the bodies of the load case in force."""
    group: Any = vehicle
    if group.load is None:
        return vehicle
    return vehicle.model_copy(update=_changes(group, group.loads[group.load]))


def _changes(group: Any, load: LoadGroup) -> dict[str, object]:
    bodies, assemblies = dict(group.bodies), dict(group.assemblies)
    for name in load.bodies.keys() & bodies.keys():
        change = load.bodies[name].model_dump(exclude_none=True)
        bodies[name] = bodies[name].model_copy(update=change)
    for name in load.assemblies.keys() & assemblies.keys():
        change = _changes(assemblies[name], load.assemblies[name])
        assemblies[name] = assemblies[name].model_copy(update=change)
    return {"bodies": bodies, "assemblies": assemblies}


def load_faults(vehicle: Any) -> list[Fault]:
    """Return what load cases name that is not there; the faults' file is left empty."""
    faults: list[Fault] = []
    for name, load in vehicle.loads.items():
        faults += _unknown_names(vehicle, load, f"loads.{name}")
    if DESIGN in vehicle.loads:
        found = "the load of the vehicle's own numbers is called so"
        faults.append(Fault("", f"loads.{DESIGN}", found, "another name"))
    if vehicle.load is not None and vehicle.load not in vehicle.loads:
        allowed = nearest(vehicle.load, [DESIGN, *vehicle.loads])
        faults.append(Fault("", "load", f"no load case '{vehicle.load}'", allowed))
    return faults


def _unknown_names(group: Any, load: LoadGroup, key: str) -> Iterator[Fault]:
    for table, word in (("bodies", "body"), ("assemblies", "assembly")):
        names = list(getattr(group, table))
        for name in getattr(load, table):
            if name not in names:
                found = f"no {word} '{name}' in this part of the vehicle"
                yield Fault("", f"{key}.{table}.{name}", found, nearest(name, names))
    for name, inner in load.assemblies.items():
        if name in group.assemblies:
            yield from _unknown_names(group.assemblies[name], inner, f"{key}.assemblies.{name}")
