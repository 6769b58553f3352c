"""Files of test sections of the user's own, `railsim-sections/1`, as a laboratory has them."""

import csv
from contextlib import suppress
from itertools import combinations
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from railsim.definitions.base import Definition, NonNegative, Positive, Text
from railsim.definitions.file_definition import FileDefinition
from railsim.errors import Fault

SHORTEST = 5.0  # m
Zone = Annotated[
    Literal["1", "2", "3", "4"],
    BeforeValidator(lambda zone: str(zone) if zone in (1, 2, 3, 4) else zone),
    WithJsonSchema({"enum": ["1", "2", "3", "4", 1, 2, 3, 4]}),
]


class OwnSection(Definition):
    """A test section."""

    begin: NonNegative
    """Arc length of its beginning [m]"""
    end: Positive
    """Arc length of its end [m]"""
    zone: Zone | None = None
    """Test zone, instead of that of its radius and cant deficiency"""
    track: Text | None = None
    """Name of its track; without it on the tracks of all runs"""


class OwnSections(FileDefinition):
    """Test sections of the user's own, in place of those that are cut from the track."""

    KIND: ClassVar = "limits"

    format: Literal["railsim-sections/1"]
    sections: Annotated[tuple[OwnSection, ...], Field(min_length=1)]
    """Test sections, in any order"""

    def contradictions(self) -> list[Fault]:
        """Return sections too short for means over 2 m, and those that overlap on a track."""
        numbered = list(enumerate(self.sections))
        ends = [(f"sections.{k}.end", part.end, part.begin + SHORTEST) for k, part in numbered]
        faults = [
            Fault("", key, f"{end:.12g} m", f"{least:.12g} m at least")
            for key, end, least in ends
            if end < least
        ]
        for (k, part), (n, other) in combinations(numbered, 2):
            same = part.track == other.track or None in (part.track, other.track)
            if same and part.begin < other.end and other.begin < part.end:
                words = f"{other.begin:g} to {other.end:g} m", f"outside sections.{k}"
                faults.append(Fault("", f"sections.{n}", *words))
        return faults


def parse_csv(text: str) -> dict[str, Any]:
    """Return the tables of a file of a section a line, comma or semicolon, keys as header."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    separator = ";" if ";" in "".join(lines[:1]) else ","
    rows = csv.DictReader(lines, restkey="", delimiter=separator, skipinitialspace=True)
    sections: list[dict[str, Any]] = [{k: v for k, v in row.items() if v} for row in rows]
    for section in sections:
        for key in {"begin", "end"} & section.keys():
            with suppress(ValueError):  # what is no number is said with its key
                section[key] = float(section[key])
    return {"format": OwnSections.format_name(), "sections": sections}
