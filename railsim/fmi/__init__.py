"""Functional Mock-up Interface 3.0: units for other programs, and units of theirs in a run.

`export.py`      writes a unit: inputs of the run, its variables, the wrapper of PythonFMU3
`unit.py`        what the unit does when a program calls it: a `railsim.Simulation`
`controller.py`  a unit of another program as controller of a `railsim.Simulation`, by FMPy

Source: Modelica Association (2024), Functional Mock-up Interface Specification 3.0.2.
"""

from railsim.fmi.controller import Controller
from railsim.fmi.export import OUTPUTS, fmu

__all__ = ["OUTPUTS", "Controller", "fmu"]
