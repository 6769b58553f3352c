"""Force elements of a vehicle file, distinguished by their key `kind`.

A force element acts between two bodies, named in the order [body 1, body 2].  Its parameters are
those of the element as written (on the right for `sides = "both"`); `mirrored` gives the copy on
the other side or in a mirrored assembly.  Tables hold rows [displacement or velocity, force].
"""

from typing import Annotated

from pydantic import Field

from railsim.definitions.friction_elements import CentrePlate, Friction, SideBearer, Wedge
from railsim.definitions.given_elements import AppliedForce, Brake, Traction
from railsim.definitions.spring_elements import (
    Airspring,
    BumpStop,
    Bushing,
    RollBar,
    ShearSpring,
    SpringDamper,
)

AnyElement = Annotated[
    SpringDamper
    | Bushing
    | ShearSpring
    | RollBar
    | BumpStop
    | Friction
    | SideBearer
    | CentrePlate
    | Wedge
    | Airspring
    | AppliedForce
    | Traction
    | Brake,
    Field(discriminator="kind"),
]
