"""User-defined quantities of a study: a Python function that is called with each result.

The function is given by its file, ``FILE.py:FUNCTION``, and loaded in each process of the study.
It returns numbers by name.
"""

import hashlib
import inspect
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from runpy import run_path

from railsim.errors import RailsimError, argument_error
from railsim.files.access import TABLE_BYTES, read_bytes
from railsim.result import Result

PARAMETER = "quantities"
ALLOWED = "FILE.py:FUNCTION, such as quantities.py:summary"

Function = Callable[[Result], Mapping[str, float]]


def full_name(function: "str | Function | None") -> str | None:
    """Return the name ``FILE.py:FUNCTION`` of a function with the full path of the file.

    Raises InputError: there is no such file or function, or the function is not defined in a file.
    """
    if function is None:
        return None
    if callable(function):
        name = getattr(function, "__qualname__", "")
        try:
            file = inspect.getfile(function)
        except TypeError:
            file = ""
        if not name.isidentifier() or not Path(file).is_file():
            found = f"{function!r} is not a function of a module"
            raise argument_error(PARAMETER, found, "a function defined in a file")
        return f"{Path(file).resolve()}:{name}"
    file, _, name = function.rpartition(":")
    if not (file.endswith(".py") and name.isidentifier()):
        raise argument_error(PARAMETER, "not understood", f"allowed: {ALLOWED}", key=function)
    whole = f"{Path(file).resolve()}:{name}"
    _load(whole, fingerprint(whole))
    return whole


def function_to_resume(stored: str | None, option: str | None) -> str | None:
    """Return the function of a study that is continued, as `full_name`.

    The folder of a study may come from somebody else, and a function is code: the one that the
    folder names is never loaded because of that.

    Raises InputError: the study has a function, and none is given; as `full_name`.
    """
    if stored and not option:
        found = f"the study in this folder calls the function {stored}"
        allowed = (
            f"read it, then give `{PARAMETER}`, FILE.py:FUNCTION, too: it runs with your rights"
        )
        raise argument_error("resume", found, allowed)
    return full_name(option)


def fingerprint(name: str | None) -> str:
    """Return a hash of the file of a function, empty if there is no function."""
    if name is None:
        return ""
    return hashlib.sha256(read_bytes(name.rpartition(":")[0], TABLE_BYTES)).hexdigest() + name


def user_quantities(name: str | None, result: Result) -> dict[str, float]:
    """Return the values of the function, if any, for a result; RailsimError: no numbers by name."""
    if name is None:
        return {}
    try:
        values = dict(_load(name, fingerprint(name))(result))
        found = {key: float(value) for key, value in values.items()}
        for key, number in found.items():
            if not isinstance(key, str) or not key.isprintable() or not key:
                raise TypeError(f"the name {key!r} is not a text")
            if math.isinf(number):
                raise ValueError(f"'{key}' is infinite")
        return found
    except Exception as error:
        raise RailsimError(f"{PARAMETER} {name}: {type(error).__name__}: {error}") from error


@cache
def _load(name: str, _: str) -> Function:
    """Load a function; the hash of its file has it loaded anew when that has changed."""
    file, _, function = name.rpartition(":")
    try:
        names = run_path(file, run_name=f"railsim_quantities_{Path(file).stem}")
    except Exception as error:
        found = f"cannot be loaded ({type(error).__name__}: {error})"
        raise argument_error(PARAMETER, found, ALLOWED, key=file) from None
    loaded: Function | None = names.get(function)
    if not callable(loaded):
        raise argument_error(PARAMETER, f"no function '{function}'", ALLOWED, key=file)
    try:
        with suppress(ValueError):  # of one that is not written in Python
            inspect.signature(loaded).bind(None)
    except TypeError as error:
        found = f"'{function}' cannot be called with one argument ({error})"
        raise argument_error(PARAMETER, found, "a function of a result", key=file) from None
    return loaded
