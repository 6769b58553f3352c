"""Force elements of a vehicle file, one module a kind, told apart by their key `kind`.

A force element acts between two bodies, named in the order [body 1, body 2].  Its parameters are
those of the element as written (on the right for `sides = "both"`); `mirrored` gives the copy on
the other side or in a mirrored assembly.  Tables hold rows [displacement or velocity, force].

Every module of this package belongs to the registry `KINDS`: file format, schema, key tables,
arrays and preloads read it.  `base` and `rows` hold what the kinds share.
"""

from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Annotated, Union

from pydantic import Field

from railsim.definitions.elements.base import Element


def _kinds(definition: type[Element]) -> dict[str, type[Element]]:
    """Return the definition and those derived from it that have a value of `kind`."""
    found: dict[str, type[Element]] = {}
    if "kind" in definition.model_fields:
        found[definition.model_fields["kind"].annotation.__args__[0]] = definition  # type: ignore[union-attr]
    for derived in definition.__subclasses__():
        found |= _kinds(derived)
    return found


for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")

KINDS = dict(sorted(_kinds(Element).items()))  # type: ignore[type-abstract]
"""Definition of every kind of force element."""

if TYPE_CHECKING:
    AnyElement = Element
else:
    AnyElement = Annotated[Union[tuple(KINDS.values())], Field(discriminator="kind")]  # noqa: UP007
