"""What a run has to output so that it can be assessed: checked before it begins."""

from railsim.assessment import record
from railsim.definitions.settings import LEAST_RATE, Settings
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import Fault, Faults
from railsim.result.sensors import sensors
from railsim.result.sinks import matches

LEAST = LEAST_RATE["zero"] * record.WIDE_ENOUGH
"""Least rate of values that standards filter, where coarse ones are accepted [1/s]."""


def coarse_remarks(settings: Settings, speed: float) -> tuple[str, ...]:
    """Say in what the values of a run are too coarse to be judged, if they are."""
    coarseness, loss = record.coarseness(settings, 1.0 / settings.output_interval(speed))
    return (f"{coarseness}: {loss}",) if coarseness else ()


def check_outputs(
    vehicle: Vehicle, settings: Settings, speed: float, standard: str, *, coarse: bool = False
) -> None:
    """Raise InputError: what an assessment of the run would refuse.

    `coarse`: fewer samples than `FINE_ENOUGH` are accepted, unless the filters of the standard have
    nothing left to pass.
    """
    faults, outputs, filters = Faults(), settings.outputs, standard in (*record.RUNNING, "comfort")
    recorded = outputs.quantities or ("*",)
    needed = {record.NEEDED[standard]: f"with {', '.join(record.NEEDED[standard])}"}
    if standard == "comfort" and not outputs.sensors:
        needed[record.MOTION] = "with them, or settings.outputs.sensors=true"
    for names, allowed in needed.items():
        if lacking := [name for name in names if not matches(name, recorded)]:
            found = f"without {', '.join(lacking)}"
            faults.append(Fault("settings", "outputs.quantities", found, allowed))
    rate = 1.0 / settings.output_interval(speed)
    found, _ = record.coarseness(settings, rate)
    key = "output_rate" if settings.output_spacing is None else "output_spacing"
    key = key if outputs.low_pass is None else "outputs.low_pass.frequency"
    allowed = record.ENOUGH
    if settings.output_spacing is not None and settings.drive.mode != "constant":
        found, allowed = "unequal time steps, as the speed varies", "output_rate instead"
    elif coarse and outputs.low_pass is not None:
        found, allowed = found if filters else "", f"{record.WIDE_ENOUGH:g} Hz at least"
    elif coarse:
        found = found if filters and rate < LEAST * (1.0 - 1e-3) else ""
        allowed = f"at least {LEAST:g}, better {record.FINE_ENOUGH:g}"
    if found:
        faults.append(Fault("settings", key, found, allowed))
    if standard in record.RUNNING and vehicle.service is None:
        allowed = "[service] with admissible_speed and cant_deficiency in its file"
        faults.append(Fault(f"vehicle '{vehicle.name}'", "service", "missing", allowed))
    if standard == "comfort" and all(
        name.startswith("frame_") for name in sensors(vehicle.model_copy())
    ):
        allowed = "one with a body that has a floor"
        faults.append(Fault(f"vehicle '{vehicle.name}'", "bodies", "wheelsets alone", allowed))
    faults.check()
