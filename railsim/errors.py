"""Errors that a user can act on.

`InputError` gathers every fault of the input at once; the command line prints one line per fault
and ends with exit status 2.  `ModelError` says that a model was asked for something outside its
range of validity.
"""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong in an input.

    Attributes
    ----------
    file : str
        File or parameter of a function that holds the fault.
    key : str
        Dotted path of the key within the file, or ``line 12``; empty for the file as a whole.
    found : str
        What was found.
    allowed : str
        What is allowed instead, or how to mend it.
    option : str
        The command line's option for a parameter; empty for a file.
    """

    file: str
    key: str
    found: str
    allowed: str
    option: str = ""

    def __str__(self) -> str:
        location = f"{self.file}: {self.key}" if self.key else self.file
        remedy = f"; {self.allowed}" if self.allowed else ""
        return f"{location}: {self.found}{remedy}"

    def on_command_line(self) -> "Fault":
        """Return the fault as the command line names it: by options, also those in backquotes."""
        if not self.option:
            return self
        found, allowed = (
            re.sub(r"`(\w+)`", lambda name: "--" + name[1].replace("_", "-"), text)
            for text in (self.found, self.allowed)
        )
        return replace(self, file=self.option, found=found, allowed=allowed)


def argument_fault(
    parameter: str, key: str, found: str, allowed: str, option: str | None = None
) -> Fault:
    """Return what is wrong with an argument of a function.

    `parameter`: Its name in Python. `key`, `found`, `allowed`: As in `Fault`. `option`: The
    command line's option, where it is not called as the parameter.

    >>> fault = argument_fault("cant_deficiency", "", "found 2 m", "0.3 m at most")
    >>> print(fault)
    cant_deficiency: found 2 m; 0.3 m at most
    >>> print(fault.on_command_line())
    --cant-deficiency: found 2 m; 0.3 m at most
    >>> print(argument_fault("duration", "", "given with `until`", "").on_command_line())
    --duration: given with --until
    """
    return Fault(parameter, key, found, allowed, option or "--" + parameter.replace("_", "-"))


MOST_FAULTS = 100  # faults that are kept of an input; the rest is counted

EQUAL = 5  # more faults than these that differ in their keys alone are one line with a count


def fault_lines(faults: Iterable[Fault]) -> list[str]:
    """Return a line for each fault; many that differ in their keys alone as one with a count.

    >>> fault_lines(Fault("a.toml", f"bodies.b{k}.mass", "found 0", "> 0") for k in range(20))
    ['a.toml: bodies.b0.mass: found 0; > 0 (and 19 more: bodies.b1.mass ... bodies.b19.mass)']
    """
    groups: dict[tuple[str, str, str], list[Fault]] = {}
    for fault in faults:
        groups.setdefault((fault.file, fault.found, fault.allowed), []).append(fault)
    lines = []
    for group in groups.values():
        keys = [fault.key for fault in group]
        if len(group) <= EQUAL or not all(keys):
            lines += [str(fault) for fault in group]
        else:
            lines.append(f"{group[0]} (and {len(group) - 1} more: {keys[1]} ... {keys[-1]})")
    return lines


def message_of(error: OSError | MemoryError) -> str:
    """Return what the system refused, in a line: no space on the device, no memory.

    >>> message_of(OSError(28, "no space left on device", "run.h5"))
    'No space left on device: run.h5'
    """
    if isinstance(error, MemoryError):
        return "not enough memory"
    if error.errno is None:
        return str(error).partition("\n")[0]
    # HDF5 tells the cause in several lines
    return os.strerror(error.errno) + (f": {error.filename}" if error.filename else "")


def merge_similar(faults: Iterable[Fault]) -> list[Fault]:
    """Return faults of the rows of a file, those of one kind as one with their number.

    Faults are of one kind where file and remedy agree.

    >>> rows = [Fault("a.csv", f"line {n}", "not a number", "numbers only") for n in range(2, 22)]
    >>> print(*merge_similar(rows))
    a.csv: line 2: not a number, and 19 more like it up to line 21; numbers only
    """
    kinds: dict[tuple[str, str], list[Fault]] = {}
    for fault in faults:
        kinds.setdefault((fault.file, fault.allowed), []).append(fault)
    merged = []
    for first, *others in kinds.values():
        if others:
            more = f"{first.found}, and {len(others)} more like it up to {others[-1].key}"
            first = replace(first, found=more)
        merged.append(first)
    return merged


class RailsimError(Exception):
    """Base of all errors that railsim raises on purpose."""


class InputError(RailsimError):
    """The input is wrong; `faults` lists what was found, the first hundred and a count."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        faults = list(faults)
        if (more := len(faults) - MOST_FAULTS) > 1:
            faults[MOST_FAULTS:] = [Fault(faults[-1].file, "", f"{more} more faults", "")]
        self.faults = tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))

    def __reduce__(self) -> tuple[type, tuple[tuple[Fault, ...]]]:
        """As another process gets it: made of its faults, not of its message."""
        return type(self), (self.faults,)


def input_error(file: str | Path, found: str, allowed: str = "", key: str = "") -> InputError:
    """Return the error of one fault, see `Fault`."""
    return InputError([Fault(str(file), key, found, allowed)])


def argument_error(
    parameter: str, found: str, allowed: str = "", key: str = "", option: str | None = None
) -> InputError:
    """Return the error of one wrong argument of a function, see `argument_fault`."""
    return InputError([argument_fault(parameter, key, found, allowed, option)])


class Faults(list[Fault]):
    """Faults that are collected, to be raised together.

    >>> faults = Faults()
    >>> with faults.caught():
    ...     raise InputError([Fault("a.toml", "mass", "-1", "above 0")])
    >>> len(faults)
    1
    """

    @contextmanager
    def caught(self, change: Callable[[Fault], Fault] = lambda fault: fault) -> Iterator[None]:
        """Collect the faults of an `InputError` that ends the block, as `change` returns them."""
        try:
            yield
        except InputError as error:
            self.extend(map(change, error.faults))

    def require(
        self, right: object, parameter: str, found: str, allowed: str, option: str | None = None
    ) -> None:
        """Add the fault of an argument that is not right, see `argument_fault`."""
        if not right:
            self.append(argument_fault(parameter, "", found, allowed, option))

    def check(self) -> None:
        """Raise them as an `InputError`, if there are any."""
        if self:
            raise InputError(self)


@contextmanager
def changed_faults(change: Callable[[Fault], Fault]) -> Iterator[None]:
    """Raise the faults of an `InputError` that ends the block as `change` returns them."""
    try:
        yield
    except InputError as error:
        raise InputError(map(change, error.faults)) from None


class ModelError(RailsimError):
    """A model was asked for something outside its range of validity."""


class PackageMissing(InputError, ImportError):
    """A package that something needs is not installed."""


def optional_package(name: str, method: str, install: str) -> Any:
    """Return a package that a method needs and that may not be installed.

    Raises PackageMissing: it is not; with the command that installs it.
    """
    try:
        return import_module(name)
    except ImportError:
        found, allowed = f"needs the package '{name}'", f"install it with: pip install {install}"
        raise PackageMissing([Fault(method, "", found, allowed)]) from None


LONGEST_NAME = 200
MOST_NAMES = 100  # in a message


def listed(names: Sequence[str], most: int = 3) -> str:
    """Return the first names of a list, and how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return ``did you mean 'x'?`` or the list of valid names, for the end of a message."""
    names = sorted(valid)
    # no name is that long, and the comparison takes time
    close = get_close_matches(name, names, n=1, cutoff=0.6) if len(name) < LONGEST_NAME else ()
    if close:
        return f"did you mean '{close[0]}'?"
    return f"allowed: {listed(names, MOST_NAMES)}"
