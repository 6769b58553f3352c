"""A suspension as the part of a vehicle file: axlebox arm, rubber bush, coil nest.

The springs' stiffnesses are taken at one load, normally tare, about which the vehicle moves.  The
nest becomes one `shear_spring` from the arm to the bogie frame: its lateral force acts half-way
between the seats, which already is `K_L H_s^2 / 4` of tilting stiffness; the element's own bending
stiffness is the rest of `K_C`.  The hinge lies where the turned arm puts it; preloads are left to
the vehicle's equilibrium (`auto`).

Numbers are rounded to seven significant digits, so that a file made today equals one made later.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from railsim.constants import GRAVITY
from railsim.definitions.loading import load_vehicle
from railsim.definitions.spring import TrailingArmSuspension, VehicleTable
from railsim.definitions.vehicle.flatten import FlatVehicle, flatten
from railsim.errors import RailsimError, input_error
from railsim.files.access import is_file, relative
from railsim.files.key_paths import key_path
from railsim.files.sources import find_file, read_source
from railsim.springs.verification import Case, load_cases

LIKELY = (0.75, 1.25)
"""Load of an axlebox in the vehicle over the load at which the springs are taken."""
_DIGITS = 7
_INNERMOST_ARRAY = re.compile(r"\[\n([^\[\]]+)\]")


@dataclass(frozen=True)
class VehiclePart:
    """The parts of a vehicle file that a suspension gives."""

    assembly: str  # dotted key of the assembly that holds them
    axleboxes: dict[str, Any]  # tables of the assembly
    elements: dict[str, Any]
    case: Case  # the load at which the springs are taken
    remarks: tuple[str, ...]  # what the vehicle model cannot carry over


def axlebox_load(vehicle: FlatVehicle) -> float:
    """Return the static load of an axlebox, all bodies but the wheelsets shared by all of them [N].

    >>> from railsim.definitions.vehicle.flatten import flatten
    >>> from railsim.definitions.loading import load_vehicle
    >>> round(axlebox_load(flatten(load_vehicle("coach_manchester"))))
    59912
    """
    carried = sum(body.mass for body in vehicle.bodies if body.kind == "body")
    return carried * GRAVITY / (2.0 * len(vehicle.of_kind("wheelset")))


def vehicle_part(suspension: TrailingArmSuspension, load: str | None = None) -> VehiclePart:
    """Return a suspension's parts of a vehicle file.

    The springs are taken at a named load, by default that of the table `[vehicle]`.

    Raises InputError: no table `[vehicle]`, or a load that the nest cannot carry.
    """
    table = suspension.vehicle
    if table is None:
        raise input_error(
            suspension.name, "missing", "needed: where the suspension is mounted", "vehicle"
        )
    name = table.load if load is None else load
    _, (case,) = load_cases(suspension, {name: suspension.loads[name]})
    nest, remarks = _nest(suspension, table, case)
    elements = {"arm_bush": _bush(suspension, table, case), "coil_nest": nest}
    axlebox = {
        "wheelset": table.wheelset,
        "position": _rounded([0.0, table.lateral_position, -table.wheel_radius]),
        "pitch_inertia": table.pitch_inertia, "sides": "both",
    }  # fmt: skip
    return VehiclePart(table.assembly, {"arm": axlebox}, elements, case, remarks)


def vehicle_text(
    suspension: TrailingArmSuspension, part: VehiclePart, extends: str, remove: Sequence[str]
) -> str:
    """Return the text of a vehicle file that replaces the primary suspension of another one.

    File and parts to remove are those of `base_of`.
    """
    name = f"{Path(extends).stem} on {suspension.name}"
    head: dict[str, Any] = {"format": "railsim-vehicle/1", "name": name, "extends": extends}
    if suspension.source is not None:
        head["source"] = suspension.source
    if remove:
        head["remove"] = list(remove)
    tables: dict[str, Any] = {"axleboxes": part.axleboxes, "elements": part.elements}
    for key in reversed(part.assembly.split(".")):
        tables = {key: tables}
    case = part.case
    heading = (
        f"# Primary suspension '{suspension.name}', written by `railsim spring vehicle`.\n"
        f"# Coil springs at load {case.name}, {case.load * 1e-3:.3f} kN: deflection "
        f"{case.deflection * 1e3:.2f} mm, arm turned by {np.degrees(case.rotation):.3f} degrees.\n"
    )
    notes = "".join(f"# {remark}\n" for remark in part.remarks)
    text: str = tomli_w.dumps(head) + "\n" + tomli_w.dumps(tables)
    return heading + notes + _INNERMOST_ARRAY.sub(_on_one_line, text)


def base_of(
    suspension: TrailingArmSuspension, extends: str | None = None, folder: str | Path = ""
) -> tuple[str, Sequence[str], list[str]]:
    """Return the vehicle to extend and what to remove there, for `vehicle_text`, and remarks.

    `extends`: file or name of a shipped one, None for that of the table `[vehicle]`; `folder`: of
    the file that is written, from which its path counts.
    """
    table = suspension.vehicle
    assert table is not None  # `vehicle_part` refuses a suspension without
    if extends is None:
        return table.extends, table.remove, []
    data = read_source(find_file(extends, "vehicle"), "vehicle").data
    removed = [key for key in table.remove if _holds(data, key)]
    beside = []
    if not removed and not _holds(data, f"{table.assembly}.elements.coil_nest"):
        keys = ", ".join(table.remove) or "nothing to remove"
        beside.append(
            f"'{extends}' has nothing of vehicle.remove ({keys}): its own primary suspension stays "
            "beside this one unless vehicle.remove names its parts."
        )
    return relative(extends, folder) if is_file(extends) else extends, removed, beside


def _holds(data: Any, key: str) -> bool:
    for part in key_path(key):
        data = data.get(part) if isinstance(data, dict) else None
    return data is not None


def load_remarks(
    suspension: TrailingArmSuspension, case: Case, extends: str | None = None
) -> list[str]:
    """Remark on springs that are taken at a load unlike that which the vehicle puts on them."""
    name = extends or (suspension.vehicle and suspension.vehicle.extends)
    if not name:
        return []
    try:
        load = axlebox_load(flatten(load_vehicle(name)))
    except RailsimError as error:
        return [f"the load of the axleboxes is not known: {error}"]
    if LIKELY[0] <= load / case.load <= LIKELY[1]:
        return []
    return [
        f"'{name}' puts {load / 1e3:.1f} kN on an axlebox at rest, the springs are taken at "
        f"{case.load / 1e3:.1f} kN ({case.name}): do springs and vehicle belong together?"
    ]


def _bush(suspension: TrailingArmSuspension, table: VehicleTable, case: Case) -> dict[str, Any]:
    length = suspension.arm.length
    x, z = -length * np.cos(case.rotation), -table.wheel_radius + length * np.sin(case.rotation)
    hinge = [x, table.lateral_position, z]
    return {
        "kind": "bushing", "bodies": [table.frame, "arm"], "point": _rounded(hinge),
        "sides": "both", "stiffness": list(table.bush.stiffness),
        "damping": list(table.bush.damping),
        "rotational_stiffness": list(table.bush.rotational_stiffness),
        "rotational_damping": list(table.bush.rotational_damping),
    }  # fmt: skip


def _nest(
    suspension: TrailingArmSuspension, table: VehicleTable, case: Case
) -> tuple[dict[str, Any], tuple[str, ...]]:
    height = float(case.springs["outer"].height)
    seat = -table.wheel_radius - suspension.arm.seat_height
    touching = [state for state in case.springs.values() if state.deflection > 0.0]
    K_V = sum(float(state.force / state.deflection) for state in touching)
    bending = case.K_C - case.K_L * height**2 / 4.0
    remarks = []
    if bending < 0.0:
        remarks.append(
            f"The tilting stiffness {case.K_C:.0f} Nm/rad is less than that of the lateral force "
            f"at mid-height, {case.K_C - bending:.0f} Nm/rad: the element's bending stiffness is 0."
        )
    if len(case.springs) > 1 and case.springs["inner"] not in touching:
        remarks.append("The inner spring does not work at this load and is left out.")
    nest = {
        "kind": "shear_spring", "bodies": [table.frame, "arm"],
        "points": [_rounded([0.0, table.lateral_position, z]) for z in (seat - height, seat)],
        "sides": "both", "stiffness": _rounded([case.K_L, case.K_L, K_V]),
        "bending_stiffness": _rounded([max(bending, 0.0)] * 2),
    }  # fmt: skip
    return nest, tuple(remarks)


def _on_one_line(array: re.Match[str]) -> str:
    members = (line.strip().removesuffix(",") for line in array[1].splitlines())
    return "[" + ", ".join(member for member in members if member) + "]"


def _rounded(values: Sequence[float]) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]
