"""Kinds of a thing, one module each: found in their package, told apart by one key."""

from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, Literal, TypeVar, get_args, get_origin

from railsim.definitions.base import Definition

D = TypeVar("D", bound=Definition)


def kinds(base: type[D], key: str, package: str) -> dict[str, type[D]]:
    """Return all definitions in the modules of a package that give `key` one value, by it."""
    for module in iter_modules([str(Path(str(import_module(package).__file__)).parent)]):
        import_module(f"{package}.{module.name}")
    found: dict[str, type[D]] = {}
    waiting: list[Any] = [base]
    while waiting:
        one = waiting.pop()
        waiting += one.__subclasses__()
        annotation = one.model_fields[key].annotation if key in one.model_fields else None
        if get_origin(annotation) is Literal:
            found[get_args(annotation)[0]] = one
    return dict(sorted(found.items()))
