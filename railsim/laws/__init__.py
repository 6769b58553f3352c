"""Laws of one's own: Python functions of floats, compiled alone and called by the time loop.

`permission.py`  whose code may be executed
`binding.py`     from the text of a law to the address that the loop calls

A law is executed only with permission: `allow` or `allowed` (`allow_code=True`, ``--allow-code``,
``--law FILE``).
"""

import ast
import inspect
import textwrap
from collections.abc import Callable
from typing import Any, TypeVar

from railsim.definitions.vehicle.laws import Law
from railsim.errors import input_error
from railsim.laws.binding import KIND
from railsim.laws.permission import PERMITTED, allow, allowed, digest, is_allowed, permitted_part

__all__ = [
    "PERMITTED",
    "allow",
    "allowed",
    "controller",
    "creep_law",
    "digest",
    "excitation",
    "force_element",
    "friction_law",
    "is_allowed",
    "law",
    "output_quantity",
    "permitted_part",
]

F = TypeVar("F", bound=Callable[..., Any])
KNOWN = "import math\nfrom math import *\n\nimport numpy as np"
"""What a function that is given in Python knows beside its arguments."""


def _mark(kind: str, purpose: str) -> Callable[[F], F]:
    def mark(function: F) -> F:
        setattr(function, KIND, kind)
        return function

    mark.__name__ = mark.__qualname__ = kind
    mark.__doc__ = f"Mark a function as {purpose}."
    return mark


force_element = _mark("force_element", "the law of a force element")
creep_law = _mark("creep_law", "a creep law")
friction_law = _mark("friction_law", "a law of friction over the slip velocity")
controller = _mark("controller", "a controller")
output_quantity = _mark("output_quantity", "the law of an output quantity")
excitation = _mark("excitation", "the law of an irregularity over the arc length")


def law(function: Callable[..., Any], *, compiled: bool = True) -> Law:
    """Return the law of a function that is written in Python, permitted as it is given here.

    `function`: its source has to be readable: of a module, a script or a notebook. It knows the
    functions of `math`, numpy as ``np`` and nothing else beside its arguments; `compiled`: whether
    it is compiled; called as Python it is slower by far.
    """
    name = getattr(function, "__name__", repr(function))
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        (definition,) = tree.body
    except (OSError, TypeError, ValueError, SyntaxError):
        definition = None
    if not isinstance(definition, ast.FunctionDef) or definition.name != name:
        found, allowed = "its source cannot be read", "a function of a file, script or notebook"
        raise input_error("law", found, allowed, key=name)
    definition.decorator_list = []
    source = f"{KNOWN}\n\n{ast.unparse(tree)}\n"
    allow(source)
    return Law(function=definition.name, source=source, compiled=compiled)
