"""What a definition offers but modules built on the definitions do.

A vehicle knows its mass, and yet assemblies are placed by `flatten`, which is built on vehicles.
Such a module enters its function here when the package is imported, and the definition calls it by
name: no module imports one that is built on it.
"""

from collections.abc import Callable
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])
_FUNCTIONS: dict[str, Callable[..., Any]] = {}


def offers(function: Function) -> Function:
    """Enter a function under its own name; a decorator."""
    _FUNCTIONS[function.__name__] = function
    return function


def offered(name: str) -> Callable[..., Any]:
    """Return the function with a given name."""
    return _FUNCTIONS[name]
