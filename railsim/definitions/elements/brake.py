"""A brake on a wheelset."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from railsim.definitions.base import NonNegative, rises
from railsim.definitions.elements.traction import AxleTorque


class Brake(AxleTorque):
    """Braking torque on a wheelset over the vehicle's speed; body 1 takes the reaction.

    It acts against the wheelset's rotation and vanishes with it.
    """

    BRAKES: ClassVar = True
    kind: Literal["brake"]
    torque_table: Annotated[
        tuple[tuple[NonNegative, NonNegative], ...], Field(min_length=1), rises("speed")
    ]
    """Rows [speed m/s, torque on the wheelset N m], linear in between, constant beyond"""
