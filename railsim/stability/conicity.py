"""Equivalent conicity over amplitude of a vehicle's leading wheelset, to read diagrams by.

How conicity changes with amplitude decides how hunting begins: where it falls below 3 mm, small
limit cycles come first (Polach 2006).
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.contact.geometry import ContactGeometry, geometry_of
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
    geometry = geometry_of(wheelset, track, known)
    if geometry is None:
        return None
    values = _values(geometry)
    there = np.isfinite(values)
    return {
        "wheelset": body.name,
        "amplitude": AMPLITUDES[there].tolist(),
        "conicity": values[there].tolist(),
    }


@lru_cache(8)  # maps and optimisations ask for the same geometry over and over
def _values(geometry: ContactGeometry) -> NDArray[np.float64]:
    return geometry.equivalent_conicity(AMPLITUDES)
