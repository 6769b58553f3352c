"""Rail vehicle dynamics: a multibody simulator with wheel-rail contact, and design tools beside it.

The public names, loaded when they are first used:

    vehicle = railsim.load_vehicle("coach_manchester")
    track = railsim.load_track("curve_r250")
    result = railsim.simulate(vehicle, track, speed=20.0)
    result.to_hdf5("run.h5")
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from railsim.version import __version__

if TYPE_CHECKING:
    from railsim.assessment import assess
    from railsim.definitions.loading import load_mechanism, load_settings, load_track, load_vehicle
    from railsim.errors import InputError, ModelError
    from railsim.linear.modes import modes, root_locus
    from railsim.result import Result, mid_curves, open_result, peaks
    from railsim.simulation import simulate, simulate_together
    from railsim.stability.critical_speed import critical_speed
    from railsim.stability.curving import curving
    from railsim.studies import study

_HOMES = {
    "assess": "railsim.assessment",
    "InputError": "railsim.errors",
    "ModelError": "railsim.errors",
    "Result": "railsim.result",
    "critical_speed": "railsim.stability.critical_speed",
    "curving": "railsim.stability.curving",
    "load_mechanism": "railsim.definitions.loading",
    "load_settings": "railsim.definitions.loading",
    "load_track": "railsim.definitions.loading",
    "load_vehicle": "railsim.definitions.loading",
    "mid_curves": "railsim.result",
    "modes": "railsim.linear.modes",
    "open_result": "railsim.result",
    "peaks": "railsim.result",
    "root_locus": "railsim.linear.modes",
    "simulate": "railsim.simulation",
    "simulate_together": "railsim.simulation",
    "study": "railsim.studies",
}

__all__ = [
    "InputError",
    "ModelError",
    "Result",
    "__version__",
    "assess",
    "critical_speed",
    "curving",
    "load_mechanism",
    "load_settings",
    "load_track",
    "load_vehicle",
    "mid_curves",
    "modes",
    "open_result",
    "peaks",
    "root_locus",
    "simulate",
    "simulate_together",
    "study",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'railsim' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
