"""Irregularities of a track file, told apart by their key `type`.

Each rail is displaced laterally (y, positive to the right) and vertically (z, positive downwards)
from the position that plan, cant and vertical profile give it; several irregularities add up.  A
disturbance that does not end at zero by itself is faded in and out over `fade`.

Every module of this package that defines a type belongs to the registry `TYPES`: file format,
schema, key tables and tables of the rails read it.  `base` holds what the types share, `spectra`
the spectra by name, `measured_file` and `recording` read files of recording cars.
"""

from typing import TYPE_CHECKING, Annotated, Union

from pydantic import Field

from railsim.definitions.base import kinds
from railsim.definitions.excitations.base import Irregular

TYPES = kinds(Irregular, "type", __name__)  # type: ignore[type-abstract]
"""Definition of every type of irregularity."""

if TYPE_CHECKING:
    Irregularity = Irregular
else:
    Irregularity = Annotated[Union[tuple(TYPES.values())], Field(discriminator="type")]  # noqa: UP007
