"""Equivalent conicity over amplitude of a vehicle's leading wheelset, to read diagrams by.

How conicity changes with amplitude decides how hunting begins: where it falls below 3 mm, small
limit cycles come first (Polach 2006).
"""

from typing import Any

import numpy as np

from railsim.contact.geometry import contact_geometry
from railsim.errors import InputError
from railsim.linear.vehicle import LinearVehicle

AMPLITUDES = 1e-3 * np.concatenate([np.arange(1, 10) * 0.1, np.arange(4, 33) * 0.25])  # m


def conicity_over_amplitude(prepared: LinearVehicle) -> dict[str, Any] | None:
    """Return ``wheelset``, ``amplitude`` [m] and ``conicity`` [1] (EN 15302) on rigid rails.

    Amplitudes that the profiles do not allow are left out; None where the wheelset does not fit
    between the rails.
    """
    body = prepared.model.flat.of_kind("wheelset")[0]
    wheelset, track, known = body.wheelset, prepared.track, prepared.model.profiles
    if wheelset is None:
        return None
    wheels = [known[name] for name in wheelset.profile]
    rails = [known[name] for name in track.rail]
    try:
        geometry = contact_geometry(
            (wheels[0], wheels[1]),
            (rails[0], rails[1]),
            wheelset.radius,
            track.gauge,
            track.inclination,
            wheelset.back_to_back,
        )
    except InputError:
        return None
    values = geometry.equivalent_conicity(AMPLITUDES)
    there = np.isfinite(values)
    return {
        "wheelset": body.name,
        "amplitude": AMPLITUDES[there].tolist(),
        "conicity": values[there].tolist(),
    }
