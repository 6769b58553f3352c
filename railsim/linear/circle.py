"""Track of constant curvature and cant, on which a vehicle can roll steadily."""

from collections.abc import Sequence

import numpy as np

from railsim.arrays import Floats
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.track.layout import even_line
from railsim.kernels.state import ARC_LENGTH
from railsim.model.assembly import Model

LENGTH = 50.0  # m; the tables reach beyond both ends
POSITION = 25.0  # m, where a vehicle stands on it


def at_middle(state: Floats) -> Floats:
    """Return a state of the vehicle standing there."""
    found = state.copy()
    found[ARC_LENGTH] = POSITION
    return found


def left_out(vehicle: Vehicle, track: Track, settings: Settings, model: Model) -> tuple[str, ...]:
    """Remark on what a track of constant curvature and steady rolling leave out."""
    line = (*track.plan, *track.cant, *track.vertical)
    parts = {
        "controllers (actuators get no command)": vehicle.controllers,
        "applied forces": len(model.system.loads.body),
        "traction and brakes": len(model.system.drives.body),
        "check rails": track.check_rail,
        "gauge widening": track.gauge_widening,
        "friction that varies along the track": _varies(track.friction_table),
        "support that varies along the track": _varies(track.support.variation),
        "sections of rails": track.sections,
        "wheels that are not round": model.wheels.uneven,
        "transient creep forces": settings.transient_creep,
        "curves, cant and gradients of the track": any(any(part.ends) for part in line),
        "irregularities": track.irregularities,
    }
    found = [name for name, there in parts.items() if there]
    return (f"left out here, where rolling is steady: {', '.join(found)}",) if found else ()


def _varies(rows: Sequence[Sequence[float]] | None) -> bool:
    """Whether the rows of a table over arc length differ."""
    return len({tuple(row[1:]) for row in rows or ()}) > 1


def circle(
    track: Track,
    *,
    curvature: float = 0.0,
    cant: float = 0.0,
    friction: float | tuple[float, float] | None = None,
    at: float = 0.0,
) -> Track:
    """Return a track of constant curvature and cant with rails, gauge and support of another.

    `track`: whose rails they are; `curvature`: 1/radius, positive to the right [1/m]; `cant`: left
    rail over the right one, on 1.5 m [m]; `friction`: coefficient of friction; by default that of
    `track`; `at`: arc length at which support and friction are taken, by default its beginning [m].
    """
    if friction is None:
        friction = tuple(track.friction_at(at).tolist())
    support = track.support.model_dump(exclude_none=True)
    if track.support.variation:
        places, *factors = np.transpose(track.support.variation)
        support["variation"] = [[0.0, *(float(np.interp(at, places, f)) for f in factors)]]
    return track.replace(
        **even_line(LENGTH, curvature, cant),
        vertical=[],
        irregularities=[],
        gauge_widening=None,
        friction_table=None,
        friction=friction,
        sections=[],
        check_rail=[],
        support=support,
    )
