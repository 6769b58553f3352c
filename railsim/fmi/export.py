"""Write a vehicle on its track as a unit of FMI 3.0, by PythonFMU3."""

import json
import keyword
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from railsim.definitions import Track, Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.errors import argument_error, changed_faults, input_error, optional_package
from railsim.files.access import check_file, whole_file
from railsim.fmi.unit import INPUTS, VARIABLES
from railsim.model.control import check_command
from railsim.plot.selection import panels
from railsim.result import Result, open_run
from railsim.simulation import Simulation
from railsim.version import __version__

OUTPUTS = ("Q", "Y", "wheelset_lateral")
"""Quantities that are output unless others are named."""

STATES = ("canGetAndSetFMUState", "canSerializeFMUState")
CAPABILITIES = ("needsExecutionTool", *STATES, "canHandleVariableCommunicationStepSize")
WRAPPER = '''"""A vehicle of railsim, called by FMI 3.0; it needs Python with railsim {version}."""

from pythonfmu3 import Fmi3Slave

from railsim.fmi.unit import Unit


class {name}(Unit, Fmi3Slave):
    """The calls are those of `railsim.fmi.unit.Unit`."""
'''


def fmu(
    vehicle: Vehicle,
    track: Track,
    path: str | Path,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] = OUTPUTS,
    overwrite: bool = False,
    **conditions: Any,
) -> Path:
    """Write a unit for co-simulation that runs this vehicle on this track.

    `vehicle`, `track`: what runs; the unit holds both as they are here, without references to
    files; `path`: file to be written, ending in ``.fmu``; `inputs`: actuators that the calling
    program commands; by default all that no controller does; `outputs`: signals of the vehicle, and
    quantities over time with the labels wanted: ``Q``, ``Y:1:left``,
    ``body_acceleration:carbody:y``; `overwrite`: whether a file of this name may be replaced;
    `**conditions`: speed, settings, start, duration, until and profiles, as in `railsim.simulate`.
    Returns: the file. Raises InputError: an actuator, signal or quantity does not exist, or the run
    is impossible. ImportError PythonFMU3 is not installed.
    """
    wrapper = optional_package("pythonfmu3", "fmu", "'railsim[fmi]'")
    path = Path(path)
    check_file(path, overwrite=overwrite, endings=(".fmu",))
    settings = conditions.get("settings")
    if settings is not None and settings.outputs.low_pass is not None:
        found = "given, and outputs of a unit are values at an instant"
        raise input_error(
            "settings", found, "leave it out; filter in the program", "outputs.low_pass"
        )
    name = _identifier(path.stem)
    with tempfile.TemporaryDirectory() as folder:
        stored, script = Path(folder) / INPUTS, Path(folder) / f"{name}.py"
        with Simulation(vehicle, track, record=stored, **conditions) as run:
            actuators, step = run.actuators, run.step_length
            signals = tuple(n for n in run.readable if n in (vehicle.signals or {}))
            run.step()
        result = open_run(stored)
        where = f"{vehicle.name} on {track.name} at {result.speed:g} m/s"
        words = f"{where}; runs in a Python that has railsim {__version__}"
        facts = {"railsim": __version__, "description": words, "step": step}
        facts |= {key: conditions.get(key) for key in ("duration", "until")}
        facts["inputs"] = _commands(vehicle, actuators, inputs)
        facts["outputs"] = _variables(vehicle, result, signals, outputs)
        _check_names(facts)
        variables = Path(folder) / VARIABLES
        variables.write_text(json.dumps(facts, indent=1, default=float), encoding="utf-8")
        script.write_text(WRAPPER.format(name=name, version=__version__), encoding="utf-8")
        files = {"dest": Path(folder) / "made", "project_files": [stored, variables]}
        made = wrapper.FmuBuilder.build_FMU(script, **files, **dict.fromkeys(CAPABILITIES, True))
        with whole_file(path) as partial:
            partial.write_bytes(made.read_bytes())
    return path


def _identifier(stem: str) -> str:
    """Return the name of a class and of a file for the name of a unit."""
    name = re.sub(r"\W", "_", stem, flags=re.ASCII)
    return f"unit_{name}" if not name or name[0].isdigit() or keyword.iskeyword(name) else name


def _check_names(facts: Mapping[str, Any]) -> None:
    """Raise InputError where two variables of the unit have one name (FMI 3.0, 2.4.7)."""
    known = {"time": "a variable of every unit", "status": "a variable of every unit"}
    for kind in ("inputs", "outputs"):
        for one in facts[kind]:
            if one["name"] in known:
                found = f"'{one['name']}' is the name of {known[one['name']]}"
                raise argument_error(kind, found, "names that differ", option=f"--{kind}")
            known[one["name"]] = f"one of its {kind}"


def _commands(
    vehicle: Vehicle, actuators: Sequence[str], names: Sequence[str] | None
) -> list[dict[str, Any]]:
    elements = {element.name: element.definition for element in flatten(vehicle).elements}
    if names is None:
        followed = {name for c in (vehicle.controllers or {}).values() for name in c.outputs}
        names = [name for name in actuators if name not in followed]
    for name in names:
        check_command(vehicle, "inputs", name, actuators)
    # a law knows the unit of its own command
    units = {name: getattr(elements[name], "command_unit", "") for name in names}
    words = "command of actuator "
    return [
        {"name": n, "start": 0.0, "unit": u, "description": words + n} for n, u in units.items()
    ]


def _variables(
    vehicle: Vehicle, result: Result, signals: Sequence[str], names: Sequence[str]
) -> list[dict[str, Any]]:
    """Return name, quantity, place in its array, unit and words of every output."""
    with changed_faults(lambda fault: replace(fault, file="outputs", option="--outputs")):
        panels(result, [one for one in names if one not in signals])  # all faults at once
    variables: dict[str, dict[str, Any]] = {}
    for selection in names:
        if selection in signals:
            words, unit = f"signal {selection}", (vehicle.signals or {})[selection].unit
            variables[selection] = _variable(selection, selection, [], unit, words)
            continue
        quantity = selection.partition(":")[0]
        for panel in panels(result, [selection]):
            for line in panel.lines:
                dims = result.quantities[quantity].dims[1:]
                labels = [line.labels[dim] for dim in dims]
                at = [
                    result.coordinates[dim].index(label)
                    for dim, label in zip(dims, labels, strict=True)
                ]
                name = ".".join((quantity, *labels))
                words = ", ".join((panel.quantity.long_name, *labels))
                variables[name] = _variable(name, quantity, at, panel.quantity.unit, words)
    if not variables:
        raise input_error("outputs", "found none", "at least one quantity or signal")
    return list(variables.values())


def _variable(name: str, quantity: str, at: list[int], unit: str, words: str) -> dict[str, Any]:
    return {"name": name, "quantity": quantity, "at": at, "unit": unit, "description": words}
