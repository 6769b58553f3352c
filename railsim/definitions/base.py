"""The common base of all definitions, and the number types that their fields use.

Every definition is frozen and refuses unknown keys.  Numbers are strict: no text, no truth values,
nothing infinite.  What may be given once for both sides is always stored as the pair (left, right).
"""

import ast
import inspect
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from pkgutil import iter_modules
from typing import Annotated, Any, Literal, NoReturn, Self, TypeVar, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    WithJsonSchema,
    model_validator,
)

from railsim.units import speed_in_si

Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
NonNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)]
Share = Annotated[Finite, Field(gt=0, le=1)]
Count = Annotated[int, Field(strict=True, gt=0)]
Whole = Annotated[int, Field(strict=True, ge=0)]
Flag = Annotated[bool, Field(strict=True)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Name = Annotated[str, Field(strict=True, pattern=r"^[A-Za-z_][A-Za-z0-9_-]*$")]

Speed = Annotated[
    float, Field(strict=True, allow_inf_nan=False, gt=0), BeforeValidator(speed_in_si)
]
"""Speed [m/s]; texts with units are taken too"""

Side = Literal["left", "right"]
OTHER_SIDE: dict[str, Any] = {"left": "right", "right": "left", "both": "both"}

Vector = tuple[Finite, Finite, Finite]
PositiveVector = tuple[Positive, Positive, Positive]
NonNegativeVector = tuple[NonNegative, NonNegative, NonNegative]


def pair(value: Any) -> Any:
    """Return what holds for both sides as the pair (left, right)."""
    return value if isinstance(value, list | tuple) else (value, value)


def one_or_two(member: dict[str, Any]) -> WithJsonSchema:
    """Schema of one value or a pair."""
    pair = {"type": "array", "items": member, "minItems": 2, "maxItems": 2}
    return WithJsonSchema({"anyOf": [member, pair]})


def both_sides(share: float = 1.0) -> BeforeValidator:
    """Return the step that makes rows [s, value] to [s, left, right], each with a share of it."""

    def completed(rows: Any) -> Any:
        if not isinstance(rows, list | tuple):
            return rows
        return [
            (row[0], share * row[1], share * row[1])
            if isinstance(row, list | tuple) and len(row) == 2 and isinstance(row[1], int | float)
            else row
            for row in rows
        ]

    return BeforeValidator(completed)


NUMBERS = {"type": "array", "items": {"type": "number"}, "minItems": 2}


PositivePair = Annotated[
    tuple[Positive, Positive],
    BeforeValidator(pair),
    one_or_two({"type": "number", "exclusiveMinimum": 0}),
]
NonNegativePair = Annotated[
    tuple[NonNegative, NonNegative],
    BeforeValidator(pair),
    one_or_two({"type": "number", "minimum": 0}),
]
TextPair = Annotated[
    tuple[Text, Text], BeforeValidator(pair), one_or_two({"type": "string", "minLength": 1})
]


def _word_or_value(value: Any) -> str:
    return "word" if isinstance(value, str) else "value"


_Auto = Annotated[Literal["auto"], Tag("word")]
AutoOrNumber = Annotated[_Auto | Annotated[Finite, Tag("value")], Discriminator(_word_or_value)]
AutoOrVector = Annotated[_Auto | Annotated[Vector, Tag("value")], Discriminator(_word_or_value)]


def _refuse(*_: object, **__: object) -> NoReturn:
    raise TypeError("a definition does not change; with_values() and replace() return new ones")


class FrozenDict(dict[Any, Any]):
    """A dictionary that does not change: two definitions may share it, and keep what follows."""

    __setitem__ = __delitem__ = clear = pop = popitem = setdefault = update = __ior__ = _refuse

    def __hash__(self) -> int:  # type: ignore[override]  # definitions are keys of dictionaries
        return hash(frozenset(self.items()))

    def __reduce__(self) -> tuple[Any, ...]:
        return FrozenDict, (dict(self),)


T = TypeVar("T")
S = TypeVar("S")


def once(definition: "Definition", name: str, make: Callable[[], T]) -> T:
    """Return what follows from a definition alone, made once; a copy of it has it no more."""
    stored = definition.__dict__
    if name not in stored:
        value = make()
        stored[name] = lambda: value  # equal to itself alone: arrays have no truth value
    result: T = stored[name]()
    return result


class Definition(BaseModel):
    """Base of everything that a user may write."""

    # built when first used: a part of a vehicle is built as part of it, not once more by itself
    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    __setattr__ = __delattr__ = _refuse

    def model_post_init(self, _: Any) -> None:
        """Keep the tables of a definition from being changed."""
        for name, value in self.__dict__.items():
            if type(value) is dict:
                self.__dict__[name] = FrozenDict(value)

    def __dir__(self) -> list[str]:
        """Return names to complete: keys and own methods, without those of pydantic."""
        return sorted(set(super().__dir__()) - set(dir(BaseModel)))

    def __copy__(self) -> Self:
        """Return a copy without what was worked out: `model_copy` changes values of such a copy."""
        copied = super().__copy__()
        for name in set(copied.__dict__) - set(type(self).model_fields):
            del copied.__dict__[name]
        return copied


@cache
def meanings(model: type[BaseModel]) -> dict[str, str]:
    """What the text below each field of a definition says, by the field's name.

    It is read from the source on first use: at import it would cost every command a tenth.
    """
    meanings: dict[str, str] = {}
    for part in reversed(model.__mro__):
        if not issubclass(part, Definition):
            continue
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(part))).body
        assert isinstance(body, ast.ClassDef)
        for field, text in pairwise(body.body):
            match field, text:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str(meaning))),
                ):
                    meanings[name] = inspect.cleandoc(meaning)
    return meanings


@dataclass(frozen=True)
class Remark:
    """Something allowed that an engineer would still want to know."""

    key: str  # dotted path of the key within the file
    text: str  # what is unusual

    def __str__(self) -> str:
        return f"{self.key}: {self.text}"


def check(method: Callable[[Any], None]) -> Any:
    """Make a method refuse contradictions between the values of a definition by ValueError."""

    def checked(definition: Any) -> Any:
        method(definition)
        return definition

    return model_validator(mode="after")(checked)


EMPTY_TABLE: Any = Field(default_factory=dict)
"""Default of a table that a file may leave out."""


def holds(condition: Callable[[Any], bool], otherwise: str) -> AfterValidator:
    """Return the check that a condition holds of a value; `otherwise` says what is allowed."""

    def check(value: Any) -> Any:
        if not condition(value):
            raise ValueError(otherwise)
        return value

    return AfterValidator(check)


def rises(column: str) -> AfterValidator:
    """Return the check that the first column of rows, called `column`, increases strictly."""
    return holds(rising, f"the {column} must increase from row to row")


def rising(rows: Sequence[Sequence[float]]) -> bool:
    """Whether the first column increases strictly."""
    return all(after[0] > before[0] for before, after in pairwise(rows))


RisingRows = Annotated[tuple[tuple[S, T], ...], Field(min_length=1), rises("first column")]
SidedRows = Annotated[
    tuple[tuple[Finite, T, T], ...],
    Field(min_length=1),
    rises("arc length"),
    both_sides(),
    WithJsonSchema({"type": "array", "minItems": 1, "items": {**NUMBERS, "maxItems": 3}}),
]
"""Rows [s, value] or [s, left, right] [m]"""


D = TypeVar("D", bound=Definition)


def kinds(base: type[D], key: str, package: str) -> dict[str, type[D]]:
    """Return all definitions in the modules of a package that give `key` one value, by it."""
    for module in iter_modules([str(Path(str(import_module(package).__file__)).parent)]):
        import_module(f"{package}.{module.name}")
    by_value: dict[str, type[D]] = {}
    waiting: list[Any] = [base]
    while waiting:
        kind = waiting.pop()
        waiting += kind.__subclasses__()
        annotation = kind.model_fields[key].annotation if key in kind.model_fields else None
        if get_origin(annotation) is Literal:
            by_value[get_args(annotation)[0]] = kind
    return dict(sorted(by_value.items()))
