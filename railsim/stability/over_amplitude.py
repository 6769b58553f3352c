"""Linear critical speed over the amplitude for which the contact is linearised."""

from collections.abc import Callable
from typing import Any

from railsim.errors import InputError
from railsim.linear.eigenmodes import loss_of_stability
from railsim.linear.vehicle import LinearVehicle

AMPLITUDES = (0.1e-3, 0.2e-3, 0.3e-3, 0.5e-3, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3)  # m


def linear_over_amplitude(
    prepared: Callable[[float], LinearVehicle], low: float, high: float
) -> dict[str, Any]:
    """Return ``amplitude`` [m], ``speed`` [m/s], ``frequency`` [Hz] and the ``smallest`` of them.

    Where the vehicle is stable up to `high`, speed and frequency are None; where the contact table
    is narrower than an amplitude, this and all larger ones are left out.

    Parameters
    ----------
    prepared : callable
        Amplitude of the harmonic linearisation to the vehicle.
    low, high : float
        Range of the search [m/s].
    """
    found: dict[str, Any] = {"amplitude": [], "speed": [], "frequency": []}
    for amplitude in AMPLITUDES:
        vehicle = prepared(amplitude)
        try:
            lost = loss_of_stability(vehicle.linearised, low, high)
        except InputError:
            break
        speed, frequency = lost.parameter, None
        if speed is not None:
            frequency = float(lost.modes[0].frequencies[0])
        found["amplitude"].append(amplitude)
        found["speed"].append(low if lost.already else speed)
        found["frequency"].append(frequency)
    known = [
        (speed, amplitude)
        for speed, amplitude in zip(found["speed"], found["amplitude"], strict=True)
        if speed is not None
    ]
    if known:
        found["smallest"] = dict(zip(("speed", "amplitude"), min(known), strict=True))
    else:
        found["smallest"] = None
    return found
