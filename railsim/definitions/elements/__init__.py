"""Force elements of a vehicle file, told apart by their key `kind`.

A force element acts between two bodies, named in the order [body 1, body 2].  Its parameters are
those of the element as written (on the right for `sides = "both"`); `mirrored` gives the copy on
the other side or in a mirrored assembly.  Tables hold rows [displacement or velocity, force].

Every kind in a module of this package belongs to the registry `KINDS`: file format, schema, key
tables, arrays and preloads read it.  `base` and `rows` hold what the kinds share.
"""

from typing import TYPE_CHECKING, Annotated, Union

from pydantic import Field

from railsim.definitions.base import kinds
from railsim.definitions.elements.base import Element
from railsim.files.key_paths import NEW_MEMBERS

KINDS = kinds(Element, "kind", __name__)  # type: ignore[type-abstract]
"""Definition of every kind of force element."""
NEW_MEMBERS["elements"] = f'kind="{"|".join(KINDS)}", '

if TYPE_CHECKING:
    AnyElement = Element
else:
    AnyElement = Annotated[Union[tuple(KINDS.values())], Field(discriminator="kind")]  # noqa: UP007
