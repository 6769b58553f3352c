"""A unit of FMI 3.0 as controller of a run, called by FMPy."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from railsim.errors import argument_error, input_error, nearest, optional_package
from railsim.simulation import Simulation


class Controller:
    """A unit for co-simulation that commands the actuators of a run at a fixed period.

    Over a period both run side by side: the unit gets what is read at its beginning, the
    actuators get at its end what the unit gives, so that a command acts one period late.

    `path`: unit of FMI 3.0 for co-simulation; `inputs`: inputs of the unit: to each a signal of the
    vehicle, or a quantity with indices, such as ``sensor_acceleration:0:1``, counted from 0;
    `outputs`: outputs of the unit: to each an actuator of the vehicle; `period`: step of
    communication [s]; `allow_code`: units hold native code, which may do whatever the user may:
    without True none is loaded. Raises InputError: the unit has no such variables, is no unit for
    co-simulation, or may not be loaded. ImportError FMPy is not installed.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        inputs: Mapping[str, str],
        outputs: Mapping[str, str],
        period: float,
        allow_code: bool = False,
    ) -> None:
        name = str(path)
        if not allow_code:
            allowed = "allow_code=True, where you trust its source"
            raise input_error(name, "a unit holds native code", allowed)
        if not 0.0 < period < np.inf:
            raise argument_error("period", f"found {period} s", "a positive time")
        fmpy = optional_package("fmpy", "Controller", "'railsim[fmi]'")
        slave = optional_package("fmpy.fmi3", "Controller", "'railsim[fmi]'").FMU3Slave
        try:
            model = fmpy.read_model_description(name)
        except Exception as error:
            raise input_error(name, f"no unit: {error}", "a unit of FMI 3.0") from None
        if model.coSimulation is None or not model.fmiVersion.startswith("3"):
            allowed = "a unit of FMI 3.0 for co-simulation"
            raise input_error(name, f"FMI {model.fmiVersion}", allowed)
        known = {variable.name: variable for variable in model.modelVariables}
        self._read = [(_reference(name, known, one), at) for one, at in inputs.items()]
        self._give = [(_reference(name, known, one), to) for one, to in outputs.items()]
        self._period = period
        self._folder = fmpy.extract(name)
        about = {"guid": model.guid, "modelIdentifier": model.coSimulation.modelIdentifier}
        self._unit = slave(unzipDirectory=self._folder, instanceName=Path(name).stem, **about)
        self._time: float | None = None

    def run(
        self, simulation: Simulation, *, until: float | None = None, duration: float | None = None
    ) -> bool:
        """Advance a run under this controller; whether it goes on.

        `simulation`: the run; `until`, `duration`: arc length [m] to run to, or time [s] to run
        for; otherwise to its end.
        """
        end = np.inf if duration is None else simulation.time + duration
        if self._time is None:
            self._unit.instantiate()
            self._unit.enterInitializationMode(startTime=simulation.time)
            self._unit.exitInitializationMode()
            self._time = simulation.time
        while (
            simulation.running
            and simulation.time < end - 1e-9
            and (until is None or simulation.distance < until)
        ):
            self._step(simulation)
        return simulation.running

    def _step(self, simulation: Simulation) -> None:
        assert self._time is not None
        if self._read:
            values = [_value(simulation, at) for _, at in self._read]
            self._unit.setFloat64([reference for reference, _ in self._read], values)
        _, terminate, *_ = self._unit.doStep(self._time, self._period)
        self._time += self._period
        simulation.step(self._period)
        given = self._unit.getFloat64([reference for reference, _ in self._give])
        for (_, actuator), value in zip(self._give, given, strict=True):
            simulation.set(actuator, value)
        if terminate:
            raise argument_error("unit", "it ended the simulation")

    def close(self) -> None:
        """End the unit and remove what was unpacked of it."""
        if self._time is not None:
            self._unit.terminate()
            self._unit.freeInstance()
            self._time = None
        shutil.rmtree(self._folder, ignore_errors=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _reference(file: str, variables: Mapping[str, Any], name: str) -> int:
    """Return the reference of a unit's variable, a number without dimensions."""
    if name not in variables:
        raise input_error(file, "no such variable", nearest(name, variables), key=name)
    if variables[name].type != "Float64" or variables[name].dimensions:
        raise input_error(file, f"a {variables[name].type}", "one Float64", key=name)
    reference: int = variables[name].valueReference
    return reference


def _value(simulation: Simulation, address: str) -> float:
    """Return a signal, or a member of a quantity."""
    name, *indices = address.split(":")
    value = simulation.read(address if address in simulation.readable else name)
    try:
        return float(np.asarray(value)[tuple(int(i) for i in indices)])
    except (IndexError, ValueError, TypeError):
        allowed = f"indices within {np.shape(value)}"
        raise argument_error("inputs", "no such member", allowed, key=address) from None
