"""From the text of a law to an address that the time loop calls; the loop is not compiled again.

A law has one argument there: the address of its block of numbers, first what it gives, then what
it is given (see `railsim.kernels.user_laws`).
"""

import ast
import ctypes
import inspect
import linecache
import logging
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from numbers import Real
from types import FunctionType
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.vehicle.laws import Law
from railsim.errors import InputError, input_error, nearest
from railsim.laws.permission import check_laws

MEMORY = "memory"
KIND = "railsim_law"
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Takes:
    """What a law is given and gives."""

    kind: str  # what it is: ``a force element``
    supplied: tuple[str, ...]  # arguments that the loop gives, in the order of the block
    required: tuple[str, ...] = ()  # further ones that have to be there: the inputs of a controller
    gives: tuple[int, ...] = (1,)  # how many numbers it may return
    states: bool = False  # whether arguments ``state_1``, ... are states whose rates it returns


FORCE_ELEMENT = Takes("a force element", ("deflection", "rate", "time", "command"), states=True)
CREEP_LAW = Takes(
    "a creep law",
    ("xi_x", "xi_y", "phi", "a", "b", "mu_N", "c11", "c22", "c23", "c33", "G"),
    gives=(2, 3),
)
FRICTION_LAW = Takes("a friction law", ("slip", "speed"))
EXCITATION = Takes("an excitation", ("s",))


@dataclass(frozen=True)
class Bound:
    """A law that the time loop can call."""

    name: str
    address: int  # where it stands
    states: int  # their number
    further: tuple[str, ...]  # names of its parameters, in the order of the block
    defaults: Mapping[str, float]  # of parameters that need not be given
    references: tuple[Any, ...]  # what has to live as long as the address is called

    def values(self, inputs: Floats, parameters: Sequence[float]) -> Any:
        """What a law of one value gives, called beside the loop.

        `parameters`: as `parameters` returns them.
        """
        n, k = inputs.shape
        block, results = np.array([0.0] * (1 + k) + list(parameters)), np.empty(n)
        function, place = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(self.address), block.ctypes.data
        for row in range(n):
            block[1 : 1 + k] = inputs[row]
            function(place)
            results[row] = block[0]
        return results

    def parameters(self, key: str, values: Mapping[str, float]) -> list[float]:
        """Values of its parameters in their order.

        Raises InputError: one is missing, or one too many is given.
        """
        values_by_name = {**self.defaults, **values}
        wrong = [n for n in values if n not in self.further]
        missing = [n for n in self.further if n not in values_by_name]
        if wrong or missing:
            found = (
                f"the law '{self.name}' has no argument '{wrong[0]}'"
                if wrong
                else (f"no value for '{missing[0]}', an argument of the law '{self.name}'")
            )
            raise input_error("vehicle", found, _allowed_text(self.further), key=key)
        return [float(values_by_name[name]) for name in self.further]


def _allowed_text(names: Sequence[str]) -> str:
    return f"allowed: {', '.join(names)}" if names else "it has no parameters"


def bind(name: str, law: Law, takes: Takes, gives: int | None = None, memory: int = 0) -> Bound:
    """Compile a law, or take it as it was compiled before.

    `name`: name of the law in the file; `takes`: what the loop gives and what it needs; `gives`:
    how many numbers it has to return; by default what `takes` allows; `memory`: length of its
    memory. Raises InputError: it is not permitted, raises errors, has wrong arguments or cannot be
    compiled.
    """
    check_laws([(name, law)])
    return _bound(name, law, takes, gives, memory)


def bind_use(
    file: str, key: str, use: Any, laws: Mapping[str, Law] | None, takes: Takes
) -> tuple[Bound, list[float]]:
    """Compile the law that a key of a file uses, with the values of its parameters.

    `use`: has the name `law` of one of the `laws`, and `parameters`. Raises InputError: there is no
    such law; see `bind` for the others.
    """
    if use.law not in (laws := laws or {}):
        allowed = nearest(use.law, laws) if laws else "there is none"
        raise input_error(file, f"no law '{use.law}'", allowed, key=f"{key}.law")
    bound = bind(use.law, laws[use.law], takes)
    return bound, bound.parameters(f"{key}.parameters", use.parameters)


@cache
def _bound(name: str, law: Law, takes: Takes, gives: int | None, memory: int) -> Bound:
    return _Binding(name, law, takes, gives, memory).bind()


class _Binding:
    """One law on its way from text to address."""

    names: list[str]  # of its arguments
    place: dict[str, int]  # where each stands in the block
    allowed: tuple[int, ...]  # how many values it may return

    def __init__(self, name: str, law: Law, takes: Takes, gives: int | None, memory: int) -> None:
        self.name, self.law, self.takes, self.gives, self.memory = name, law, takes, gives, memory
        self.file = law.file or f"<law {name}>"
        self.source = law.source or ""

    def bind(self) -> Bound:
        function = self._function()
        arguments = inspect.signature(function).parameters
        names = self.names = list(arguments)
        states = [n for n in names if self.takes.states and n.startswith("state")]
        special = {*states, *self.takes.supplied, *self.takes.required, MEMORY}
        further = [n for n in names if n not in special]
        missing = [n for n in self.takes.required if n not in names]
        if missing:
            self._refuse(f"has no argument '{missing[0]}'", f"arguments: {', '.join(names)}")
        if (MEMORY in names) != (self.memory > 0):
            has = ("an argument", "key") if MEMORY in names else ("a key", "argument")
            self._refuse(f"has {has[0]} 'memory' but no {has[1]} of this name", "both or neither")
        all_defaults = {n: arguments[n].default for n in further}
        defaults = {n: v for n, v in all_defaults.items() if v is not inspect.Parameter.empty}
        for n, value in defaults.items():
            if not isinstance(value, Real) or not math.isfinite(value):
                self._refuse(f"has '{n}' = {value!r}", "a finite number")
        self.allowed = (1 + len(states),) if states else self.takes.gives
        if self.gives is not None:  # one value may be for all
            self.allowed = (self.gives,) if self.gives == 1 else (1, self.gives)
        required = [n for n in self.takes.required if n not in self.takes.supplied]
        order = [*self.takes.supplied, *required, *states, *further, MEMORY]
        self.place = {n: self.allowed[-1] + k for k, n in enumerate(order)}
        compiles = self.law.compiled and os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")
        address, references = self._compiled(function) if compiles else self._plain(function)
        return Bound(self.name, address, len(states), tuple(further), defaults, references)

    def _refuse(self, found: str, allowed: str, line: int | None = None) -> None:
        place = f"line {line}" if line else self.name
        raise input_error(self.file, f"the law '{self.name}' {found}", allowed, key=place)

    def _function(self) -> Any:
        """Execute the text and take the function out of it."""
        name = self.law.function or self.name
        if self.law.source is None:  # `file` was named in Python, where nobody reads it
            allowed = "its source, or railsim.laws.law; or a vehicle or track file that names it"
            self._refuse("is in a file that has not been read", allowed)
        try:
            tree = ast.parse(self.source, self.file)
        except SyntaxError as error:
            self._refuse(f"is no Python: {error.msg}", "", error.lineno)
        self._check_raises(tree, name)
        lines = self.source.splitlines(True)
        linecache.cache[self.file] = (len(self.source), None, lines, self.file)
        space: dict[str, Any] = {"__name__": f"railsim_law_{self.name}"}
        try:
            exec(compile(tree, self.file, "exec"), space)
        except (Exception, SystemExit) as error:
            line = _line_of(error, self.file)
            self._refuse(f"fails when it is read: {type(error).__name__}: {error}", "", line)
        function = space.get(name)
        if not isinstance(function, FunctionType):
            functions = [n for n, f in space.items() if isinstance(f, FunctionType)]
            self._refuse(f"is no function '{name}' of this file", _allowed_text(functions))
        mark = getattr(function, KIND, None)
        if mark is not None and mark.replace("_", " ") not in self.takes.kind:
            self._refuse(f"is marked as {mark}", f"{self.takes.kind} is needed here")
        return function

    def _check_raises(self, tree: ast.Module, name: str) -> None:
        """Refuse what a compiled law cannot do: raise errors."""
        functions = {n.name: n for n in tree.body if isinstance(n, ast.FunctionDef)}
        waiting, seen = [name], set()
        while waiting:
            name = waiting.pop()
            if name in seen or name not in functions:
                continue
            seen.add(name)
            for node in ast.walk(functions[name]):
                if isinstance(node, ast.Raise | ast.Assert):
                    word = "raise" if isinstance(node, ast.Raise) else "assert"
                    allowed = "return math.nan instead: the run ends there"
                    self._refuse(f"cannot '{word}' an error in the loop", allowed, node.lineno)
                if isinstance(node, ast.Name):
                    waiting.append(node.id)

    def _compiled(self, function: FunctionType) -> tuple[int, tuple[Any, ...]]:
        """Compile it with an entry that takes its block apart."""
        numba: Any = import_module("numba")
        types = numba.types
        space = function.__globals__
        for other, helper in list(space.items()):
            local = isinstance(helper, FunctionType) and helper.__code__.co_filename == self.file
            if local and helper is not function:
                space[other] = numba.njit(error_model="numpy", boundscheck=True)(helper)
        compiled = numba.njit(error_model="numpy", boundscheck=True)(function)
        kinds = [types.float64[::1] if n == MEMORY else types.float64 for n in self.names]
        try:
            compiled.compile(tuple(kinds))
            returned = compiled.overloads[tuple(kinds)].signature.return_type
            members = list(returned.types) if isinstance(returned, types.BaseTuple) else [returned]
            if not all(isinstance(m, types.Number | types.Boolean) for m in members):
                self._refuse(f"returns {returned}", "a number, or several as a tuple")
            number = len(members)
            if number not in self.allowed:
                counts = " or ".join(map(str, self.allowed))
                self._refuse(f"returns {number} values", f"{counts} as {self.takes.kind}")
            scope: dict[str, Any] = {"law": compiled, "carray": numba.carray, "nan": math.nan}
            exec(self._entry_text(number), scope)
            takes_block = types.void(types.CPointer(types.float64))
            entry = numba.cfunc(takes_block, error_model="numpy")(scope["entry"])
        except InputError:
            raise
        except Exception as error:  # numba's own are of several kinds
            line = getattr(getattr(error, "loc", None), "line", None)
            self._refuse(f"cannot be compiled: {_short(error)}", "floats, math, if and for", line)
        return entry.address, (entry, compiled)

    def _plain(self, function: FunctionType) -> tuple[int, tuple[Any, ...]]:
        """Python itself, called back from the loop; an error ends the run as not finite."""
        place, most = self.place, self.allowed[-1]
        length = place[MEMORY] + self.memory

        def entry(address: int) -> None:
            x = np.ctypeslib.as_array((ctypes.c_double * length).from_address(address))
            try:
                returned = function(
                    *(x[place[n] :] if n == MEMORY else float(x[place[n]]) for n in self.names)
                )
                members = returned if isinstance(returned, tuple) else (returned,)
                if len(members) not in self.allowed:
                    raise TypeError(f"it returns {len(members)} values")
                x[:most] = members[0] if len(members) == 1 else 0.0
                x[: len(members)] = members
            except Exception as error:
                _LOG.error(f"law '{self.name}': {type(error).__name__}: {error}")
                x[:most] = math.nan

        callback = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(entry)
        return int(ctypes.cast(callback, ctypes.c_void_p).value or 0), (callback,)

    def _entry_text(self, number: int) -> str:
        """Source of the function that takes a block apart and calls the law of so many values."""
        first = self.place[MEMORY]
        view = f"v[{first}:{first + self.memory}]"
        arguments = ", ".join(view if n == MEMORY else f"x[{self.place[n]}]" for n in self.names)
        lines = ["def entry(x):", "    x[0] = nan"]  # it stays where an index is out of bounds
        if self.memory:
            lines.append(f"    v = carray(x, ({first + self.memory},))")
        results = ", ".join(f"y{k}" for k in range(number))
        lines += ["    try:", f"        {results} = law({arguments})"]
        lines += [f"        x[{k}] = y{k}" for k in range(number)]
        rest = "y0" if number == 1 else "0.0"
        lines += [f"        x[{k}] = {rest}" for k in range(number, self.allowed[-1])]
        lines += ["    except Exception:", "        pass"]
        return "\n".join(lines) + "\n"


def _line_of(error: BaseException, file: str) -> int | None:
    """Return the line of a file in which an error came up."""
    line, trace = None, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line


def _short(error: Exception) -> str:
    """Return the first sentence of numba's report that says something."""
    for line in str(error).splitlines():
        text = re.sub(r"\x1b\[[0-9;]*m", "", line).strip()
        if text and not text.startswith(("Failed in", "File", "[", "During", "Overload", "-", "*")):
            return text[:200]
    return type(error).__name__
