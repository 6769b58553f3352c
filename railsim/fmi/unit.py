"""What a unit does when a program calls it: a `Simulation` behind the calls of FMI 3.0.

Loaded by the wrapper within the unit, in the Python of the program that calls; the unit's folder
of resources holds `INPUTS` and `VARIABLES`.
"""

import base64
import json
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.result import open_run
from railsim.simulation import Simulation
from railsim.simulation.advance import SavedState
from railsim.version import __version__

INPUTS = "inputs.h5"
"""A result of no length: the vehicle, track, settings and profiles with which the unit runs."""
VARIABLES = "variables.json"
POWERS = {"N": (1, -2), "Pa": (-1, -2), "J": (2, -2), "W": (2, -3)}  # of m and s, with kg
DERIVED = {unit: {"kg": 1, "m": m, "s": s} for unit, (m, s) in POWERS.items()}
BASE = "kg", "m", "s", "A", "K", "mol", "cd", "rad"
TIME_TOLERANCE = 1e-9  # s; between the time of the program that calls and that of the run


class Unit:
    """Calls of FMI 3.0 for co-simulation, mixed into the class of PythonFMU3.

    Inputs are commands of actuators, which hold over a step of communication; outputs are
    quantities and signals at its end.  `do_step` asks to terminate where the run has ended, and
    logs why: at the end of the track, by derailment, by a state that could not be computed.
    """

    vars: Any
    resources: Any
    log: Any
    register_units: Any
    register_variable: Any

    def __init__(self, **facts: Any) -> None:
        super().__init__(**facts)
        wrapper = self._wrapper = import_module("pythonfmu3")
        folder = Path(str(self.resources).removeprefix("file://"))
        self._folder = folder
        self._facts = json.loads((folder / VARIABLES).read_text(encoding="utf-8"))
        self.description = self._facts["description"]
        self.default_experiment = wrapper.DefaultExperiment(
            start_time=0.0, step_size=self._facts["step"]
        )
        self.author, self.version = f"railsim {__version__}", self._facts["railsim"]
        self._commands = {one["name"]: one["start"] for one in self._facts["inputs"]}
        self._values = {one["name"]: 0.0 for one in self._facts["outputs"]}
        self._status = "not begun"
        self._simulation: Simulation | None = None
        self._begin, self._time = 0.0, 0.0
        self._register()

    def _register(self) -> None:
        wrapper = self._wrapper
        causality, variability = wrapper.Fmi3Causality, wrapper.Fmi3Variability
        units = {one["unit"] for one in (*self._facts["inputs"], *self._facts["outputs"])}
        # those of one's own outputs may be any text: what is not known has no unit in FMI
        known = {u: found for u in sorted(units - {""}) if (found := exponents(u)) is not None}
        self.register_units([wrapper.unit.Unit(u, **found) for u, found in known.items()])

        def register(kind: Any, name: str, getter: Any, **more: Any) -> None:
            if "unit" in more:
                more["unit"] = more["unit"] if more["unit"] in known else None
            self.register_variable(kind(name, getter=getter, **more), nested=False)

        continuous, number = variability.continuous, wrapper.Float64
        independent: Any = {"causality": causality.independent, "variability": continuous}
        register(number, "time", lambda: self._time, **independent)
        for one in self._facts["inputs"]:
            more = {key: one[key] for key in ("unit", "description", "start")}
            more |= {"causality": causality.input, "variability": variability.discrete}
            more["setter"] = lambda value, name=one["name"]: self._commands.update({name: value})
            register(number, one["name"], lambda name=one["name"]: self._commands[name], **more)
        for one in self._facts["outputs"]:
            more = {key: one[key] for key in ("unit", "description")}
            more |= {"causality": causality.output, "variability": continuous}
            more["initial"] = wrapper.Fmi3Initial.calculated
            register(number, one["name"], lambda name=one["name"]: self._values[name], **more)
        words = "running, or the status of the run that has ended"
        local = {"description": words, "causality": causality.local}
        register(wrapper.String, "status", lambda: self._status, **local)

    # calls

    def exit_initialization_mode(self) -> None:
        """Prepare the run, and evaluate it once: what has to be compiled is compiled here."""
        if self._facts["railsim"] != __version__:
            self.log(
                f"made with railsim {self._facts['railsim']}, run with {__version__}: "
                "results may differ",
                self._wrapper.Fmi3Status.warning,
            )
        inputs = open_run(self._folder / INPUTS).inputs()
        inputs |= {"duration": self._facts["duration"], "until": self._facts["until"]}
        # whoever loads a unit executes its code: the wrapper is Python too
        self._simulation = Simulation(**inputs, record=False, allow_code=True)
        self._command()
        self._read_outputs()

    def do_step(self, current_time: float, step_size: float) -> Any:
        """Advance by a step of communication."""
        outcome, status = self._wrapper.Fmi3StepResult, self._wrapper.Fmi3Status

        def refused(why: str) -> Any:
            self.log(why, status.error)
            return outcome(status.error)

        run = self._simulation
        if run is None:
            return refused("asked for a step before the initialisation, or after the end")
        if run.time == 0.0:  # the calling program's time at which the run begins
            self._begin = self._time = current_time
        if abs(self._time - current_time) > TIME_TOLERANCE * max(1.0, abs(current_time)):
            return refused(f"asked for a step at {current_time} s, the run is at {self._time} s")
        if not step_size > 0.0:
            return refused(f"asked for a step of {step_size} s, allowed is more than 0")
        if not run.running:
            return refused(f"the run has ended before: {self._status}")
        try:
            self._command()
        except InputError as fault:  # the run goes on from here with commands that are right
            return refused(str(fault))
        goes_on = run.step(step_size)
        self._read_outputs()
        if not goes_on:
            ended = status.ok if self._status == "complete" else status.warning
            self.log(f"the run has ended: {self._status}, {run.status_reason}", ended)
            return outcome(ended, terminateSimulation=True)
        # the run may be a thousandth of a step off; the next call makes up for it
        self._time = current_time + step_size
        return outcome()

    def terminate(self) -> None:
        """End the run."""
        self._simulation = None

    @property
    def _run(self) -> Simulation:
        if self._simulation is None:
            raise RuntimeError("the unit has not been initialised")
        return self._simulation

    def _command(self) -> None:
        for name, value in self._commands.items():
            self._run.set(name, value)

    def _read_outputs(self) -> None:
        """Read the outputs."""
        run = self._run
        self._time, self._status = self._begin + run.time, run.status
        if self._status not in ("running", "complete"):
            return  # the last values that could be computed stay
        for one in self._facts["outputs"]:
            value = run.read(one["quantity"])
            self._values[one["name"]] = float(value[tuple(one["at"])] if one["at"] else value)

    # states

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "commands": dict(self._commands),
            "values": dict(self._values),
            "status": self._status,
            "time": [self._begin, self._time],
            "state": _state_to_json(self._run.state),
        }

    def _set_fmu_state(self, data: dict[str, Any]) -> None:
        self._commands, self._values = dict(data["commands"]), dict(data["values"])
        self._status, (self._begin, self._time) = data["status"], data["time"]
        self._run.state = _state_from_json(data["state"])


def exponents(unit: str) -> dict[str, int] | None:
    """Return the exponents of the base units in a unit; None for one that is not known.

    >>> exponents("N m/rad"), exponents("m/s2"), exponents("kN")
    ({'kg': 1, 'm': 2, 's': -2, 'rad': -1}, {'m': 1, 's': -2}, None)
    """
    found: dict[str, int] = {}
    for place, part in enumerate(unit.split("/")):
        for factor in part.split():
            if factor == "1":
                continue
            written = re.fullmatch(r"([A-Za-z]+)(\d*)", factor)
            name, power = written.groups() if written else ("", "")
            if name not in (*DERIVED, *BASE):
                return None
            for base, exponent in DERIVED.get(name, {name: 1}).items():
                times = int(power or 1) * (-1 if place else 1)
                found[base] = found.get(base, 0) + times * exponent
    return found


def _state_to_json(state: SavedState) -> dict[str, Any]:
    """Return a state as JSON holds it."""
    return {
        "motion": _text(state.motion),
        "counted": [_text(array) for array in state.counted],
        "grid": list(state.grid),
        "begun": state.begun and _state_to_json(state.begun),
    }


def _state_from_json(data: dict[str, Any]) -> SavedState:
    counted = tuple(_array(text) for text in data["counted"])
    begun = data["begun"] and _state_from_json(data["begun"])
    return SavedState(_array(data["motion"]), counted, tuple(data["grid"]), begun)


def _text(array: Any) -> list[Any]:
    """Return an array as text that gives it back to the last bit."""
    array = np.ascontiguousarray(array)
    return [array.dtype.str, list(array.shape), base64.b64encode(array.tobytes()).decode()]


def _array(text: list[Any]) -> Any:
    kind, shape, content = text
    return np.frombuffer(base64.b64decode(content), dtype=kind).reshape(shape).copy()
