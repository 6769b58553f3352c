"""Arithmetic in text files: numbers, names of parameters, + - * / **, and a few functions.

Expressions are parsed and walked, never executed.  They are evaluated on real numbers, or on
complex arrays whose imaginary part carries a derivative (complex step; Squire and Trapp, Using
complex variables to estimate derivatives of real functions, SIAM Review 40, 1998): every function
here is analytic, or (`atan2`, `hypot`) continued to first order.
"""

import ast
import math
import operator
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

FUNCTIONS = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan2", "hypot")
CONSTANTS = {"pi": math.pi}
LONGEST = 500
_OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow)
GRAMMAR = f"numbers, names of parameters, + - * / **, parentheses, pi, {', '.join(FUNCTIONS)}"


Function = Callable[[Mapping[str, Any]], Any]


class Expression(str):
    """The text of an expression, already parsed.

    Attributes
    ----------
    tree : ast.expr
        What it says.
    function : callable
        The same as nested functions of the values, without checks.
    names : frozenset of str
        Parameters that it uses.
    """

    __slots__ = ("function", "names", "tree")
    tree: ast.expr
    function: Function
    names: frozenset[str]

    def __new__(cls, text: str) -> "Expression":
        """Parse a text.

        Raises
        ------
        ValueError : it is no arithmetic.
        """
        made = super().__new__(cls, text)
        made.tree = _parsed(text)
        made.function = _nested(made.tree)
        made.names = frozenset(
            node.id
            for node in ast.walk(made.tree)
            if isinstance(node, ast.Name) and node.id not in (*FUNCTIONS, *CONSTANTS)
        )
        return made

    def __reduce__(self) -> tuple[type["Expression"], tuple[str]]:
        """Travel between processes as text."""
        return Expression, (str(self),)


def _parsed(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise ValueError(f"an expression of {len(text)} characters; at most {LONGEST}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"no arithmetic expression; allowed: {GRAMMAR}") from None
    _check(tree)
    return tree


def _check(node: ast.expr) -> None:
    match node:
        case ast.Constant(value=bool() | complex() | str() | bytes() | None):
            pass
        case ast.Constant(value=int() | float() as value) if abs(value) <= sys.float_info.max:
            return
        case ast.Name():
            return
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            return _check(operand)
        case ast.BinOp(left=left, op=op, right=right) if isinstance(op, _OPERATORS):
            _check(left)
            return _check(right)
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            wanted = 2 if name in ("atan2", "hypot") else 1
            if len(arguments) != wanted:
                raise ValueError(f"{name} takes {wanted} argument{'s' * (wanted - 1)}")
            for argument in arguments:
                _check(argument)
            return None
    raise ValueError(f"'{ast.unparse(node)}' is not allowed; allowed: {GRAMMAR}")


def evaluate(expression: Expression, values: Mapping[str, Any]) -> Any:
    """Value of an expression.

    Parameters
    ----------
    expression : Expression
        What to evaluate.
    values : mapping of str to float or complex ndarray
        Parameters by name.

    Raises
    ------
    ValueError : a division by zero, a function outside its domain, an overflow.

    Examples
    --------
    >>> float(evaluate(Expression("hypot(a, 4) * cos(0)"), {"a": 3.0}))
    5.0
    """
    with np.errstate(all="ignore"):
        try:
            value = expression.function(values)
        except (ZeroDivisionError, OverflowError, ValueError):
            value = np.nan
        if isinstance(value, np.ndarray):
            # outside their domains functions of complex numbers leave the real axis
            fine = bool(np.isfinite(value).all() and np.abs(value.imag).max() < 1e-9)
        else:
            fine = math.isfinite(value)
        if fine:
            return value
        _value(expression.tree, values)
    raise ValueError(f"'{expression}' is not finite")


def _nested(node: ast.expr) -> Function:
    """The functions of a checked tree, put into each other."""
    match node:
        case ast.Constant(value=int() | float() as number):
            constant = float(number)
            return lambda values: constant
        case ast.Name(id=name):
            if name in CONSTANTS:
                return lambda values: CONSTANTS[name]
            return lambda values: values[name]
        case ast.UnaryOp(op=op, operand=operand):
            inner = _nested(operand)
            return (lambda values: -inner(values)) if isinstance(op, ast.USub) else inner
        case ast.BinOp(left=left, op=op, right=right):
            a, b = _nested(left), _nested(right)
            if isinstance(op, ast.Pow) and isinstance(right, ast.Constant):
                return _power(a, right.value)
            join = _JOINED[type(op)]
            return lambda values: join(a(values), b(values))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            function, inner = _CALLED[name], _nested(arguments[0])
            if len(arguments) == 1:
                return lambda values: function(inner(values))
            second = _nested(arguments[1])
            return lambda values: function(inner(values), second(values))
    raise AssertionError(node)


def _power(base: Function, exponent: Any) -> Function:
    if exponent == 2:
        return lambda values: (x := base(values)) * x
    return lambda values: base(values) ** exponent


def _value(node: ast.expr, values: Mapping[str, Any]) -> Any:
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name):
            return CONSTANTS[name] if name in CONSTANTS else values[name]
        case ast.UnaryOp(op=op, operand=operand):
            value = _value(operand, values)
            return -value if isinstance(op, ast.USub) else value
        case ast.BinOp(left=left, op=op, right=right):
            return _operation(op, _value(left, values), _value(right, values), node)
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _function(name, [_value(a, values) for a in arguments], node)
    raise AssertionError(node)


def _operation(op: ast.operator, a: Any, b: Any, node: ast.expr) -> Any:
    match op:
        case ast.Add():
            return a + b
        case ast.Sub():
            return a - b
        case ast.Mult():
            return a * b
        case ast.Div():
            if np.any(np.real(b) == 0.0):
                raise ValueError(f"'{ast.unparse(node)}' divides by zero")
            return a / b
    if np.any(np.real(a) == 0.0) and np.any(np.real(b) <= 0.0):
        raise ValueError(f"'{ast.unparse(node)}' is not finite")
    if np.any(np.real(a) < 0.0) and np.any(np.real(b) != np.rint(np.real(b))):
        raise ValueError(f"'{ast.unparse(node)}' is a root of a negative number")
    if not np.iscomplexobj(b) and np.all(b == np.rint(b)) and np.all(np.abs(b) <= 64):
        return a ** int(np.ravel(b)[0])
    return np.exp(b * np.log(a))


def _function(name: str, arguments: list[Any], node: ast.expr) -> Any:
    x = arguments[0]
    if name == "sqrt" and np.any(np.real(x) < 0.0):
        raise ValueError(f"'{ast.unparse(node)}': root of {np.min(np.real(x)):.6g}")
    if name in ("asin", "acos") and np.any(np.abs(np.real(x)) > 1.0):
        worst = np.ravel(np.real(x))[0]
        raise ValueError(f"'{ast.unparse(node)}': the argument is {worst:.6g}, not from -1 to 1")
    match name:
        case "atan2":
            return atan2(x, arguments[1])
        case "hypot":
            return hypot(x, arguments[1])
        case "asin" | "acos":
            return {"asin": np.arcsin, "acos": np.arccos}[name](x)
        case "sqrt" | "sin" | "cos" | "tan":
            return getattr(np, name)(x)
    raise AssertionError(name)


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


_JOINED: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_CALLED: dict[str, Callable[..., Any]] = {
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan2": atan2,
    "hypot": hypot,
}
