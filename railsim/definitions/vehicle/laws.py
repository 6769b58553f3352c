"""User-defined laws, signals and controllers, as vehicle files name them.

A law's file is read and kept with the definition as its source: results carry it, their inputs are
told apart by it, and workers get it.  Nothing is executed here (see `railsim.laws`).
"""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from railsim.definitions import base
from railsim.errors import Fault, InputError, input_error, nearest
from railsim.files.access import DEFINITION_BYTES, read_text
from railsim.files.sources import library_files


class Law(base.Definition):
    """A Python function that is compiled when a run begins, by permission of the user alone."""

    file: base.Text | None = None
    """Python file with the function, or the name of a law of a library"""
    function: base.Name | None = None
    """Name of the function; by default that of the law"""
    source: base.Text | None = None
    """Text of the file, as results carry it"""
    compiled: base.Flag = True
    """`false`: called as Python, slowly"""

    @base.check
    def _has_a_source(self) -> None:
        if self.file is None and self.source is None:
            raise ValueError("'file' is needed")


class LawUse(base.Definition):
    """A law with the values of its parameters."""

    law: base.Name
    """Name of the law in the table `laws`"""
    parameters: dict[base.Name, base.Finite] = base.EMPTY_TABLE
    """Values of the function's further arguments, by name"""


class OwnOutput(LawUse):
    """A quantity of the result by a user-defined law, of other quantities at the same instant."""

    inputs: dict[base.Name, base.Text] = base.EMPTY_TABLE
    """Arguments of the function: to each a quantity with the labels wanted, such as `Q:1:left`"""
    unit: base.Text = "1"
    """SI unit of what it gives"""
    words: base.Text | None = None
    """Words for axes and tables; by default its name"""


BODY_SIGNALS = {
    "displacement": "m", "velocity": "m/s", "acceleration": "m/s2", "angle": "rad",
    "angular_velocity": "rad/s",
}  # fmt: skip
ELEMENT_SIGNALS = {"deflection": "m", "rate": "m/s", "force": "N", "power": "W"}
WHEEL_SIGNALS = {"wheel_speed": "m/s", "Q": "N", "Y": "N"}
OTHER_SIGNALS = {
    "curvature": "1/m", "cant_angle": "rad", "speed": "m/s", "speed_change": "m/s2",
    "distance": "m", "time": "s",
}  # fmt: skip
SIGNALS = {**BODY_SIGNALS, **ELEMENT_SIGNALS, **WHEEL_SIGNALS, **OTHER_SIGNALS}
"""SI units of what can be measured."""
ABOUT_AXES = {"deflection": "rad", "rate": "rad/s", "force": "N m"}
"""Those of an element about an axis."""
ANGLES = ("roll", "pitch", "yaw")


class Signal(base.Definition):
    """Something that is measured during a run."""

    quantity: Literal[tuple(SIGNALS)]  # type: ignore[valid-type]
    """Of a `body`: displacement and velocity of a point against the track, what an accelerometer
    reads there, angle against the track, absolute angular velocity; of an `element`: deflection,
    its rate, force, power; of a `wheelset`: speed of its circumference, wheel loads; of the track:
    curvature, cant angle; of the run: speed, its change, distance, time [SI]"""
    body: base.Text | None = None
    """Full name of the body"""
    position: base.Vector | None = None
    """Point of the body in the nominal vehicle [m]; by default its centre of gravity"""
    element: base.Text | None = None
    """Full name of the element"""
    wheelset: base.Text | None = None
    """Full name of the wheelset"""
    side: base.Side | None = None
    """Side of the wheel, of `Q` and `Y`"""
    axis: Literal["x", "y", "z", "roll", "pitch", "yaw"] | None = None
    """Axis; of a link its line, by default"""
    ahead: base.Finite = 0.0
    """Position on the track, ahead of the reference body [m]; the track goes on as it ends"""
    rate: Annotated[base.Positive, Field(le=1e6)] | None = None
    """Samples per second [1/s]; by default one each step of the loop"""
    delay: base.NonNegative = 0.0
    """Time after which a sample is known [s]; needs `rate`"""
    noise: base.NonNegative = 0.0
    """Standard deviation of normal noise of each sample [unit of the quantity]; needs `rate`"""
    seed: base.Whole = 1
    """Seed of the noise; signals with the same seed have independent noise"""
    resolution: base.NonNegative = 0.0
    """Smallest difference of two values [unit of the quantity]; 0: as fine as numbers are"""

    @property
    def unit(self) -> str:
        """SI unit of what is measured."""
        unit = ABOUT_AXES.get(self.quantity) if self.axis in ANGLES else None
        return unit or SIGNALS[self.quantity]

    @base.check
    def _what_belongs_together(self) -> None:
        needs = {"body": BODY_SIGNALS, "element": ELEMENT_SIGNALS, "wheelset": WHEEL_SIGNALS}
        for key, quantities in needs.items():
            if (self.quantity in quantities) != (getattr(self, key) is not None):
                raise ValueError(f"'{key}' belongs to {', '.join(quantities)} and only to them")
        if (self.quantity in ("Q", "Y")) != (self.side is not None):
            raise ValueError("'side' belongs to Q and Y and only to them")
        if self.quantity in BODY_SIGNALS and self.axis is None:
            raise ValueError(f"{self.quantity} needs 'axis'")
        linear = self.quantity in ("displacement", "velocity", "acceleration")
        if linear and self.axis in ANGLES:
            raise ValueError(f"the axis of {self.quantity} is x, y or z")
        if not linear and self.quantity in BODY_SIGNALS and self.axis in ("x", "y", "z"):
            raise ValueError(f"the axis of {self.quantity} is roll, pitch or yaw")
        only = {
            "position": ("displacement", "velocity", "acceleration"),
            "axis": (*BODY_SIGNALS, *ELEMENT_SIGNALS),
            "ahead": ("curvature", "cant_angle"),
        }
        for key, allowed in only.items():
            if self.quantity not in allowed and getattr(self, key):
                raise ValueError(f"'{key}' belongs to {', '.join(allowed)} and only to them")
        if self.rate is None and (self.delay > 0.0 or self.noise > 0.0):
            raise ValueError("'delay' and 'noise' need 'rate'")
        if self.rate is not None and self.delay * self.rate > 1e6:
            raise ValueError("within 'delay' there are at most 1e6 samples")
        if 0.0 < self.resolution < 1e-15:
            raise ValueError("'resolution' is 0 or at least 1e-15: numbers near 1 are no finer")


class Controller(base.Definition):
    """A user-defined law that reads signals and commands actuators, at equal times."""

    law: base.Name
    """Name of the law in the table `laws`"""
    period: Annotated[base.Finite, Field(ge=1e-6)]
    """Time between two calls [s]"""
    inputs: dict[base.Name, base.Name] = base.EMPTY_TABLE
    """Signals by the arguments of the function that take them"""
    outputs: tuple[base.Text, ...] = Field(min_length=1)
    """Full names of the actuators, in the order of what the function returns;
    one value is for all"""
    parameters: dict[base.Name, base.Finite] = base.EMPTY_TABLE
    """Values of the function's further arguments, by name"""
    memory: Annotated[base.Count, Field(le=1_000_000)] | None = None
    """How many numbers its argument `memory` keeps from call to call, 0 at the beginning"""

    @base.check
    def _inputs_are_not_what_the_loop_gives(self) -> None:
        if given := {"time", "memory"} & self.inputs.keys():
            raise ValueError(f"'{min(given)}' of the function comes from the loop, not from inputs")


def with_sources(tables: dict[str, Any]) -> list[Fault]:
    """Put the texts of laws' files into the plain tables; the faults of reading them.

    A law that is used and has no table of its own, or whose `file` is a bare name, is that of a
    library: the function of this name in ``laws/NAME.py``.
    """
    faults: list[Fault] = []
    laws = tables.setdefault("laws", {})
    for key, name in _used_laws(tables) if isinstance(laws, dict) else ():
        if name not in laws:
            if name in library_files("law"):
                laws[name] = {"file": name}
            else:
                names = [*laws, *library_files("law")]
                allowed = f"a table laws.{name}" + (f"; {nearest(name, names)}" if names else "")
                faults.append(Fault("", key, f"no law '{name}'", allowed))
    for name, law in laws.items() if isinstance(laws, dict) else ():
        if not isinstance(law, dict) or not isinstance(law.get("file"), str) or "source" in law:
            continue
        path = library_files("law").get(law["file"], Path(law["file"]))
        try:
            if path.suffix != ".py":
                found = f"found '{law['file']}'"
                raise input_error("", found, "a file .py, or the name of a library's")
            law["source"] = read_text(path, DEFINITION_BYTES)
            ast.parse(law["source"])
            law["file"] = path.name  # results are the same from whatever folder
        except InputError as error:
            key = f"laws.{name}.file"
            faults += [Fault("", key, " ".join(filter(None, (f.file, f.found))), f.allowed)
                       for f in error.faults]  # fmt: skip
        except (SyntaxError, ValueError) as error:
            faults.append(Fault("", f"laws.{name}.file", f"{path} is no Python: {error}", ""))
    if not laws:
        del tables["laws"]
    return faults


def _used_laws(node: Any, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield key and name of every law that is used in plain tables."""
    for key, value in node.items() if isinstance(node, dict) else enumerate(node):
        if key == "law" and isinstance(value, str):
            yield f"{prefix}law", value
        elif isinstance(value, dict | list) and f"{prefix}{key}" != "laws":
            yield from _used_laws(value, f"{prefix}{key}.")
