"""Arithmetic in text files: numbers, names of parameters, + - * / **, and a few functions.

Expressions are parsed, checked node by node, and compiled: nothing else is ever executed.  They are
evaluated on real numbers, or on complex arrays whose imaginary part carries a derivative (complex
step; Squire and Trapp, Using complex variables to estimate derivatives of real functions, SIAM
Review 40, 1998): every function here is analytic, or (`atan2`, `hypot`) continued to first order.
"""

import ast
import math
import sys
from collections.abc import Mapping
from copy import deepcopy
from functools import lru_cache
from types import CodeType
from typing import Any

import numpy as np

LONGEST = 500
CONSTANTS = {"pi": math.pi}


def atan2(y: Any, x: Any) -> Any:
    """Angle of the direction (x, y) [rad]; of complex numbers with its derivative."""
    angle = np.arctan2(np.real(y), np.real(x))
    if not (np.iscomplexobj(x) or np.iscomplexobj(y)):
        return angle
    x, y = np.asarray(x, dtype=complex), np.asarray(y, dtype=complex)
    rate = (x.real * y.imag - y.real * x.imag) / (x.real**2 + y.real**2)
    return angle + 1j * rate


def hypot(x: Any, y: Any) -> Any:
    """Length of (x, y); of complex numbers with its derivative."""
    if not (np.iscomplexobj(x) or np.iscomplexobj(y)):
        return np.hypot(x, y)
    return np.sqrt(x * x + y * y)


FUNCTIONS = {
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan2": atan2,
    "hypot": hypot,
}
GRAMMAR = f"numbers, names of parameters, + - * / **, parentheses, pi, {', '.join(FUNCTIONS)}"
# parameters cannot have these names
_KNOWN = {"__builtins__": {}} | {f"{name}()": function for name, function in FUNCTIONS.items()}


class OutsideDomain(ValueError):
    """A root of a negative number, or an angle whose sine or cosine is beyond 1."""


class Expression(str):
    """The text of an expression, already parsed.

    `tree`: what it says; `code`: the same, compiled; `names`: parameters that it uses.
    """

    __slots__ = ("code", "names", "tree")
    tree: ast.expr
    code: CodeType
    names: frozenset[str]

    def __new__(cls, text: str) -> "Expression":
        """Parse a text; raises ValueError: it is no arithmetic."""
        made = super().__new__(cls, text)
        made.tree, made.code, made.names = _parsed(text)
        return made

    def __reduce__(self) -> tuple[type["Expression"], tuple[str]]:
        """Travel between processes as text."""
        return Expression, (str(self),)


@lru_cache(4096)  # a file is read again and again, with other values
def _parsed(text: str) -> tuple[ast.expr, CodeType, frozenset[str]]:
    if len(text) > LONGEST:
        raise ValueError(f"an expression of {len(text)} characters; at most {LONGEST}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"no arithmetic expression; allowed: {GRAMMAR}") from None
    _check(tree)
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return tree, _compiled(tree), frozenset(names - FUNCTIONS.keys() - CONSTANTS.keys())


def _check(node: ast.expr) -> None:
    parts: list[ast.expr] = []
    match node:
        case ast.Constant(value=int() | float() as value) if type(value) is not bool:
            allowed = abs(value) <= sys.float_info.max
        case ast.Name():
            allowed = node.id not in FUNCTIONS
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            allowed, parts = True, [operand]
        case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() | ast.Pow()):
            allowed, parts = True, [node.left, node.right]
        case ast.Call(func=ast.Name(id=name), args=parts, keywords=[]) if name in FUNCTIONS:
            number = 2 if name in ("atan2", "hypot") else 1
            if len(parts) != number:
                raise ValueError(f"{name} takes {number} argument{'s' * (number - 1)}")
            allowed = True
        case _:
            allowed = False
    if not allowed:
        raise ValueError(f"'{ast.unparse(node)}' is not allowed; allowed: {GRAMMAR}")
    for part in parts:
        _check(part)


class _Compilable(ast.NodeTransformer):
    """Numbers as floats, but for exponents; functions under names that no parameter has."""

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        return ast.Constant(float(node.value))  # type: ignore[arg-type]

    def visit_Name(self, node: ast.Name) -> ast.expr:
        constant = CONSTANTS.get(node.id)
        return node if constant is None else ast.Constant(constant)

    def visit_Call(self, node: ast.Call) -> ast.expr:
        assert isinstance(node.func, ast.Name)  # by `_check`
        arguments = [self.visit(argument) for argument in node.args]
        return ast.Call(ast.Name(f"{node.func.id}()", ast.Load()), arguments, [])

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        is_exponent = isinstance(node.op, ast.Pow) and isinstance(node.right, ast.Constant)
        right = node.right if is_exponent else self.visit(node.right)
        return ast.BinOp(self.visit(node.left), node.op, right)


def _compiled(tree: ast.expr) -> CodeType:
    body = _Compilable().visit(deepcopy(tree))
    return compile(ast.fix_missing_locations(ast.Expression(body)), "<expression>", "eval")


def evaluate(expression: Expression, values: Mapping[str, Any]) -> Any:
    """Value of an expression.

    `expression`: what to evaluate; `values`: parameters by name. Raises ValueError: a division by
    zero, a function outside its domain, an overflow.

    >>> float(evaluate(Expression("hypot(a, 4) * cos(0)"), {"a": 3.0}))
    5.0
    """
    with np.errstate(all="ignore"):
        value = _value(expression.code, values)
        if value is not None:
            return value
        parts = [node for node in ast.walk(expression.tree) if isinstance(node, ast.expr)]
        for node in reversed(parts):  # innermost first
            is_function = isinstance(node, ast.Name) and node.id in FUNCTIONS
            if not is_function and _value(_compiled(node), values) is None:
                raise _failure(node, values)
    raise ValueError(f"'{expression}' is not finite")


def _value(code: CodeType, values: Mapping[str, Any]) -> Any:
    """Value of compiled code; None where it is not finite."""
    try:
        value = eval(code, _KNOWN, values)
    except (ZeroDivisionError, OverflowError, ValueError):
        return None
    if isinstance(value, np.ndarray):
        # outside their domains functions of complex numbers leave the real axis
        fine = bool(np.isfinite(value).all() and np.abs(value.imag).max() < 1e-9)
    else:
        fine = not isinstance(value, complex) and math.isfinite(value)
    return value if fine else None


def _failure(node: ast.expr, values: Mapping[str, Any]) -> ValueError:
    """Why an expression with finite parts has no value."""
    text = f"'{ast.unparse(node)}'"
    match node:
        case ast.BinOp(op=ast.Div(), right=right) if np.any(_real(right, values) == 0.0):
            return ValueError(f"{text} divides by zero")
        case ast.BinOp(op=ast.Pow(), left=left) if np.any(_real(left, values) < 0.0):
            return OutsideDomain(f"{text} is a root of a negative number")
        case ast.Call(func=ast.Name(id="sqrt"), args=[argument]):
            return OutsideDomain(f"{text}: root of {np.min(_real(argument, values)):.6g}")
        case ast.Call(func=ast.Name(id="asin" | "acos"), args=[argument]):
            worst = np.ravel(_real(argument, values))[0]
            return OutsideDomain(f"{text}: the argument is {worst:.6g}, not from -1 to 1")
    return ValueError(f"{text} is not finite")


def _real(node: ast.expr, values: Mapping[str, Any]) -> Any:
    return np.real(_value(_compiled(node), values))
