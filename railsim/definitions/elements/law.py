"""A force by a law of one's own."""

from typing import Literal

from railsim.definitions.base import EMPTY_TABLE, Finite, Name
from railsim.definitions.elements.actuator import CommandedElement
from railsim.definitions.elements.rows import Act


class LawElement(CommandedElement):
    """A force by a law of one's own, a compiled Python function."""

    kind: Literal["law"]
    law: Name
    """Name of the law in the table `laws`"""
    parameters: dict[Name, Finite] = EMPTY_TABLE
    """Values of the function's further arguments, by name"""

    def rows(self) -> list[Act]:
        """One element with a law."""
        return [self.act(mode="law", law=self.law, parameters=dict(self.parameters))]
