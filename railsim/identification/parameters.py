"""Parameters of a model: numbers of its files, each with a factor, and worn wheel profiles.

A parameter is one number, or several that change together: ``secondary_spring.stiffness.z``,
``primary_vertical_damper.damper_table`` (its forces), ``track.friction``; short paths as with
``--set``.  Its coordinate is the logarithm of the factor on what the file says, so that a
derivative is that to a relative change and a factor stays positive.  ``wheel:S1002:worn.csv`` is
the share of a second profile in the first one, whose coordinate is the share itself.
"""

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import Faults, InputError, argument_fault, nearest
from railsim.files.key_paths import descend, full_path, key_path
from railsim.profiles import Profile, load_profile
from railsim.profiles.used import used_profiles

TRACK, WHEEL = "track.", "wheel:"
LOW, HIGH = 0.1, 10.0  # factors that are allowed by default


@dataclass(frozen=True)
class Parameter:
    """A parameter.

    - `name`: what it is called in tables
    - `keys`: of the vehicle, or with ``track.`` before them of the track; changed by one factor
    - `profiles`: two wheel profiles instead of keys: the share of the second in the first is sought
    - `low`, `high`: bounds of the factor, or of the share
    - `spread`: standard deviation of what is known before, as a share of the value; None: nothing
    """

    name: str
    keys: tuple[str, ...] = ()
    profiles: tuple[str, ...] = ()
    low: float = LOW
    high: float = HIGH
    spread: float | None = None

    @property
    def is_share(self) -> bool:
        """Whether its coordinate is a share of a profile."""
        return bool(self.profiles)

    @property
    def of_vehicle(self) -> tuple[str, ...]:
        """Keys of the vehicle."""
        return tuple(key for key in self.keys if not key.startswith(TRACK))

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the coordinate."""
        return (self.low, self.high) if self.is_share else (math.log(self.low), math.log(self.high))

    def factor(self, x: float) -> float:
        """Return the factor, or the share, of a coordinate."""
        return x if self.is_share else math.exp(x)


@dataclass(frozen=True)
class Model:
    """What is run: a vehicle, a track, and profiles that take precedence."""

    vehicle: Vehicle
    track: Track
    profiles: Mapping[str, Profile] | None = None

    def with_parameters(
        self, parameters: Sequence[Parameter], x: Sequence[float] | Floats
    ) -> "Model":
        """Return the model with the parameters at some coordinates."""
        values: dict[str, dict[str, Any]] = {"vehicle": {}, "track": {}}
        profiles = dict(self.profiles or {})
        for parameter, coordinate in zip(parameters, x, strict=True):
            if parameter.is_share:
                first, second = parameter.profiles
                profiles[first] = blended(first, second, float(coordinate))
                continue
            factor = math.exp(float(coordinate))
            for key in parameter.keys if factor != 1.0 else ():
                kind, inner = _side(key)
                values[kind][inner] = scaled(find_value(getattr(self, kind), inner)[1], factor)
        changed = {k: getattr(self, k).with_values(v) for k, v in values.items() if v}
        return replace(self, profiles=profiles or None, **changed)


def _side(key: str) -> tuple[str, str]:
    return ("track", key.removeprefix(TRACK)) if key.startswith(TRACK) else ("vehicle", key)


def parse_keys(texts: Iterable[str | Parameter], vehicle: Vehicle, track: Track) -> list[Parameter]:
    """Return parameters from texts ``KEY[+KEY...][:LOW:HIGH[:SPREAD]]``, checked.

    Raises InputError: keys that lead nowhere or hold no number, bounds that do not enclose the
    value.
    """
    chosen: list[Parameter] = []
    faults = Faults()
    places_taken: list[tuple[str, ...]] = []
    for text in texts:
        try:
            p = _parse(text) if isinstance(text, str) else text
            used = [name for _, name, _ in used_profiles(vehicle)]
            if p.is_share and p.profiles[0] not in used:
                found = f"{vehicle.name} has no wheels with '{p.profiles[0]}'"
                raise ValueError(found, nearest(p.profiles[0], used))
            places: list[tuple[str, ...]] = [(WHEEL, p.profiles[0])] if p.is_share else []
            for key in p.keys:
                kind, inner = _side(key)
                path, value = find_value({"vehicle": vehicle, "track": track}[kind], inner)
                if kind == "track" and path[0] == "friction" and track.friction_table:
                    found = "the track has a friction_table in its place"
                    raise ValueError(found, "track.friction_table")
                if not _scalable(value):
                    found = f"{'.'.join(path)} is {value!r}"[:100]
                    raise ValueError(found, "a number that is not 0")
                places.append((kind, *path))
            for place in places:
                if any(place[: len(other)] == other[: len(place)] for other in places_taken):
                    raise ValueError(f"{place[-1]} is given twice", "each value once")
                places_taken.append(place)
            chosen.append(p)
        except (KeyError, ValueError) as error:
            label = text if isinstance(text, str) else text.name
            faults.append(argument_fault("parameters", label, *[*map(str, error.args), ""][:2]))
        except InputError as error:
            faults += error.faults
    if not faults and not chosen:
        faults.append(argument_fault("parameters", "", "none", "one key at least"))
    faults.check()
    return chosen


def _parse(text: str) -> Parameter:
    keys, *rest = [text] if text.startswith(WHEEL) else text.split(":")
    if text.startswith(WHEEL):
        _, first, second, *rest = [*text.split(":"), ""][: max(3, text.count(":") + 1)]
        if not first or not second:
            raise ValueError("two profiles are needed", "wheel:S1002:worn.csv")
        p = Parameter(f"share of {second} in {first}", (), (first, second), 0.0, 1.0)
        load_profile(first)
        load_profile(second)
    else:
        p = Parameter(keys, tuple(part.strip() for part in keys.split("+")))
    try:
        numbers = [float(part) for part in rest]
    except ValueError:
        raise ValueError(f"'{':'.join(rest)}'", "numbers LOW:HIGH or LOW:HIGH:SPREAD") from None
    if len(numbers) not in (0, 2, 3):
        raise ValueError(f"{len(numbers)} numbers", "LOW:HIGH or LOW:HIGH:SPREAD, as factors")
    low, high = numbers[:2] if numbers else (p.low, p.high)
    inside = 0.0 <= low < high <= 1.0 if p.is_share else 0.0 < low < 1.0 < high
    spread = numbers[2] if len(numbers) == 3 else None
    if spread is not None and not spread > 0.0:
        raise ValueError(f"SPREAD {spread:g}", "a share of the value above 0, such as 0.2")
    if not inside:
        allowed = "shares 0 to 1" if p.is_share else "factors below and above 1, such as 0.5:2"
        raise ValueError(f"bounds {low:.12g} to {high:.12g}", allowed)
    return replace(p, low=low, high=high, spread=spread)


def find_value(definition: FileDefinition, key: str) -> tuple[list[str], Any]:
    """Return the whole path of a key and what the definition has there; KeyError: nothing."""
    tables = tomllib.loads(definition.to_toml())
    path = full_path(tables, key_path(key))
    parent, last = descend(tables, path)
    if isinstance(parent, dict) and last not in parent:
        raise KeyError(f"no value '{last}'", nearest(last, parent))
    return path, parent[last]


def _scalable(value: Any) -> bool:
    if isinstance(value, list):
        numbers = all(isinstance(member, int | float | list) for member in value)
        return numbers and any(map(_scalable, value))
    return isinstance(value, int | float) and not isinstance(value, bool) and value != 0.0


def scaled(value: Any, factor: float) -> Any:
    """Return a number, a vector or what a table holds over its first column, times a factor.

    >>> scaled(2.0, 3.0), scaled([1.0, 2.0], 2.0), scaled([[0.1, 5.0], [0.2, 7.0]], 2.0)
    (6.0, [2.0, 4.0], [[0.1, 10.0], [0.2, 14.0]])
    """
    if isinstance(value, list) and value and isinstance(value[0], list):
        return [[row[0], *(factor * member for member in row[1:])] for row in value]
    if isinstance(value, list):
        return [factor * member for member in value]
    return factor * value


def blended(first: str, second: str, share: float) -> Profile:
    """Return a wheel profile with a share of the heights that a second one has over the first.

    The points keep their y; the difference of the heights is taken where both contours are
    single-valued, from the tip of the flange on.
    """
    a, b = load_profile(first), load_profile(second)
    ya, za = _single_valued(a)
    yb, zb = _single_valued(b)
    y = ya[(ya >= yb[0]) & (ya <= yb[-1])]
    difference = np.interp(y, yb, zb) - np.interp(y, ya, za)
    return replace(a, z=a.z + share * np.interp(a.y, y, difference))


def _single_valued(profile: Profile) -> tuple[Floats, Floats]:
    falls = np.flatnonzero(np.diff(profile.y) <= 0.0)
    inner = slice(int(falls[-1]) + 1 if len(falls) else 0, None)
    return profile.y[inner], profile.z[inner]
