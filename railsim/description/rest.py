"""How a vehicle stands at rest, and at which frequencies its bodies oscillate."""

from collections.abc import Mapping, Sequence
from typing import Any

from railsim.definitions import Track, Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.description.values import Description, Parts
from railsim.laws import permitted_part
from railsim.linear.modes import modes
from railsim.linear.vehicle import STICKING
from railsim.model.statics import SLOW, static_loads
from railsim.profiles import Profile
from railsim.table import Column, Table


def describe_statics(
    vehicle: Vehicle, loads: Sequence[str | None] = (), track: Track | None = None
) -> Description:
    """Return how a vehicle stands at rest, and how its bodies oscillate, in several load cases.

    `loads`: load cases, None for the design load; by default all; `track`: the rails,
    by default those of `straight`.
    """
    cases = loads or (None, *vehicle.loads)
    data: dict[str, Any] = {}
    parts: Parts = []
    vehicle = permitted_part(vehicle)
    for case in cases:
        in_case = vehicle.replace(load=case)
        static, frequencies = static_loads(in_case, track), rest_frequencies(in_case, track=track)
        data[static.load] = {**static.record(), "frequencies": frequencies.records()}
        parts += ["", f"At rest, load '{static.load}'", *(f"  {line}" for line in static.displaced)]
        for table in (*static.tables, frequencies):
            parts += ["", table] if table.rows else []
    return Description(data, parts)


def rest_frequencies(
    vehicle: Vehicle, profiles: Mapping[str, Profile] | None = None, track: Track | None = None
) -> Table:
    """Return natural frequencies of bounce, pitch and roll of the sprung bodies.

    Each is that of the mode in which the motion has the largest share of the kinetic energy, of
    the vehicle linearised at rest: friction sticks. `profiles`, `track`: as of `railsim.modes`.
    """
    motion_modes = modes(vehicle, track, speed=SLOW, profiles=profiles)
    oscillations = motion_modes.oscillations
    motions = {"bounce": "z", "pitch": "pitch", "roll": "roll"}
    rows = []
    for body in flatten(vehicle).of_kind("body"):
        row: dict[str, Any] = {"body": body.name}
        for name, component in motions.items():
            motion = f"{body.name}.{component}"
            mode = max(oscillations, key=lambda m: m.participation.get(motion, 0.0), default=None)
            if mode is not None and motion in mode.participation:
                row[name] = mode.natural_frequency
        rows.append(row)
    columns = [Column(name, unit="Hz", format=".2f") for name in motions]
    stuck = [remark for remark in motion_modes.remarks if remark.endswith(STICKING)]
    return Table([Column("body"), *columns], rows, "; ".join(["Natural frequencies", *stuck]))
