"""Rail vehicle dynamics: a multibody simulator with wheel-rail contact, and design tools beside it.

The public names, loaded when they are first used:

>>> import railsim
>>> vehicle = railsim.load_vehicle("coach_manchester")
>>> track = railsim.load_track("curve_r250")
>>> result = railsim.simulate(vehicle, track, speed=20.0, until=10.0)
>>> figure = result.plot("Q", "sum_Y")
>>> path = result.to_hdf5("run.h5")  # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from railsim.plottable import use_plotter
from railsim.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from railsim.animation import animate
    from railsim.assessment import Assessment, assess
    from railsim.assessment.model_comparison import ModelValidation
    from railsim.assessment.model_validation import validate_model
    from railsim.definitions.loading import (
        load_comfort_limits,
        load_mechanism,
        load_running_limits,
        load_scenario,
        load_settings,
        load_spring,
        load_track,
        load_vehicle,
    )
    from railsim.definitions.mechanism.definition import Mechanism
    from railsim.definitions.settings import Settings
    from railsim.definitions.spring import TrailingArmSuspension
    from railsim.definitions.track.definition import Track
    from railsim.definitions.vehicle.definition import Vehicle
    from railsim.description import Description, describe
    from railsim.errors import InputError, ModelError
    from railsim.identification import Identified, Sensitivity, identify, sensitivity
    from railsim.linear.modes import modes, root_locus
    from railsim.measurement import Measurement, load_measurement
    from railsim.model.statics import StaticLoads, static_loads
    from railsim.profiles import Profile, load_profile
    from railsim.report.write import write_report
    from railsim.result import Result, mid_curves, open_result, peaks
    from railsim.simulation import Simulation, simulate, simulate_together
    from railsim.stability.critical_speed import critical_speed
    from railsim.stability.curving import curving
    from railsim.studies.gathered import open_study
    from railsim.studies.optimise import optimise
    from railsim.studies.study import study

_NAMES = {
    "animation": ("animate",), "assessment": ("Assessment", "assess"),
    "assessment.model_comparison": ("ModelValidation",),
    "assessment.model_validation": ("validate_model",),
    "definitions.loading": ("load_comfort_limits", "load_mechanism", "load_running_limits",
        "load_scenario", "load_settings", "load_spring", "load_track", "load_vehicle"),
    "definitions.mechanism.definition": ("Mechanism",), "definitions.settings": ("Settings",),
    "definitions.spring": ("TrailingArmSuspension",), "definitions.track.definition": ("Track",),
    "definitions.vehicle.definition": ("Vehicle",), "description": ("Description", "describe"),
    "errors": ("InputError", "ModelError"),
    "identification": ("Identified", "Sensitivity", "identify", "sensitivity"),
    "linear.modes": ("modes", "root_locus"), "measurement": ("Measurement", "load_measurement"),
    "model.statics": ("StaticLoads", "static_loads"), "profiles": ("Profile", "load_profile"),
    "report.write": ("write_report",), "result": ("Result", "mid_curves", "open_result", "peaks"),
    "simulation": ("Simulation", "simulate", "simulate_together"),
    "stability.critical_speed": ("critical_speed",), "stability.curving": ("curving",),
    "studies.gathered": ("open_study",), "studies.optimise": ("optimise",),
    "studies.study": ("study",),
}  # fmt: skip
"""Public names by the modules that hold them."""
_HOMES = {name: f"railsim.{home}" for home, names in _NAMES.items() for name in names}

__all__ = [
    "Assessment", "Description", "Identified", "InputError", "Measurement", "Mechanism",
    "ModelError", "ModelValidation", "Profile", "Result", "Sensitivity", "Settings", "Simulation",
    "StaticLoads", "Track", "TrailingArmSuspension", "Vehicle", "__version__", "animate", "assess",
    "critical_speed", "curving", "describe", "identify", "load_comfort_limits", "load_measurement",
    "load_mechanism", "load_profile", "load_running_limits", "load_scenario", "load_settings",
    "load_spring", "load_track", "load_vehicle", "mid_curves", "modes", "open_result", "open_study",
    "optimise", "peaks", "root_locus", "sensitivity", "simulate", "simulate_together",
    "static_loads", "study", "validate_model", "write_report",
]  # fmt: skip


@use_plotter
def _plot(thing: object, **how: Any) -> "Figure":
    from railsim.plot import plot

    return plot(thing, **how)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'railsim' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
