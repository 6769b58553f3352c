"""Where a simulation puts what it computes, chunk by chunk.

A simulation knows one thing about its output: a `Sink`.  It says what will come (`begin`), hands
over chunks of consecutive instants (`append`) and ends with the facts about the run (`close`),
which gives the `Result`.  A sink is a context manager: left before `close`, by an error or Ctrl-C,
it leaves nothing behind.

    with Hdf5Sink("run.h5") as sink:
        sink.begin({"wheelset": [...], "body": [...]}, quantities)
        for chunk in ...:
            sink.append(chunk)
        result = sink.close(attributes, statics)
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from types import MappingProxyType
from typing import Any, Protocol, Self

import numpy as np

from railsim.arrays import Floats
from railsim.notation import COMPONENTS, QUANTITIES, SIDES, Quantity
from railsim.profiles.profile import Profile
from railsim.result.data import Attributes, Result
from railsim.version import __version__

FORMAT = "railsim-result/2"
ALWAYS = tuple(QUANTITIES.values())
NOTHING: Mapping[str, Any] = MappingProxyType({})
EVERYTHING = ("*",)
Coordinates = Mapping[str, Sequence[str]]  # names along the dimensions


class Sink(Protocol):
    """What a simulation needs of its output's destination.

    Left as a context manager before `close` it forgets what it took.
    """

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.abort()

    def begin(self, coordinates: Coordinates, quantities: Iterable[Quantity] = ALWAYS) -> None:
        """Say what will come.

        `coordinates`: Names along the dimensions ``wheelset`` and ``body``, and along any further
        one that `quantities` use; ``side`` and ``component`` are known. `quantities`: All
        quantities, those without time (for `close`) included.
        """

    def append(self, chunk: Mapping[str, Floats]) -> None:
        """Take consecutive instants: for every quantity with time an array, time first."""

    def close(
        self,
        attributes: Attributes,
        statics: Mapping[str, Any] = NOTHING,
        profiles: Mapping[str, Profile] = NOTHING,
        groups: Mapping[str, Mapping[str, Any]] = NOTHING,
    ) -> Result:
        """End the run and return its result.

        `attributes`: Root attributes of the result file; ``format``, ``railsim_version`` and
        ``created`` are added. `statics`: The quantities without time. `profiles`: Every profile
        that was used, by its name in the vehicle or track. `groups`: Further arrays: the states at
        start and end in ``state``, largest and smallest values over all steps in ``peaks``.
        """

    def abort(self) -> None:
        """Forget everything; harmless after `close`."""


class SinkBefore(Sink):
    """A sink that looks at chunks or changes them, and hands them on to another one."""

    def __init__(self, sink: Sink) -> None:
        self._sink = sink

    def begin(self, coordinates: Coordinates, quantities: Iterable[Quantity] = ALWAYS) -> None:
        """See `Sink.begin`."""
        self._sink.begin(coordinates, quantities)

    def close(self, attributes: Attributes, *held: Any, **more: Any) -> Result:
        """See `Sink.close`."""
        return self._sink.close(self._finish(attributes), *held, **more)

    def _finish(self, attributes: Attributes) -> Attributes:
        """Hand on what was held back, and return the attributes of the run."""
        return attributes

    def abort(self) -> None:
        """See `Sink.abort`."""
        self._sink.abort()


class MemorySink(Sink):
    """Keeps all chunks in memory.

    `attributes`: Root attributes to add to those of the run. `only`: Names of the quantities that
    are kept, with ``*`` for any characters; by default all.
    """

    def __init__(
        self, attributes: Attributes = NOTHING, only: Collection[str] = EVERYTHING
    ) -> None:
        self._attributes = dict(attributes)
        self._only = only
        self._quantities: dict[str, Quantity] = {}
        self._coordinates: dict[str, tuple[str, ...]] = {}
        self._chunks: dict[str, list[Floats]] = {}

    def begin(self, coordinates: Coordinates, quantities: Iterable[Quantity] = ALWAYS) -> None:
        """See `Sink.begin`."""
        self._quantities = {q.name: q for q in quantities if matches(q.name, self._only)}
        self._coordinates = full_coordinates(coordinates)
        for name in time_quantities(self._quantities):
            shape = (len(self._coordinates[dim]) for dim in self._quantities[name].dims[1:])
            self._chunks[name] = [np.zeros((0, *shape))]

    def append(self, chunk: Mapping[str, Floats]) -> None:
        """See `Sink.append`."""
        for name, chunks in self._chunks.items():
            chunks.append(np.array(chunk[name], dtype=np.float64))

    def close(
        self,
        attributes: Attributes,
        statics: Mapping[str, Any] = NOTHING,
        profiles: Mapping[str, Profile] = NOTHING,
        groups: Mapping[str, Mapping[str, Any]] = NOTHING,
    ) -> Result:
        """See `Sink.close`."""
        # one after the other: not everything twice
        arrays = {name: np.concatenate(self._chunks.pop(name)) for name in [*self._chunks]}
        arrays |= {name: statics[name] for name in self._quantities if name not in arrays}
        facts = root_attributes(self._attributes, attributes)
        return Result(arrays, self._quantities, self._coordinates, facts, profiles, groups)

    def abort(self) -> None:
        """See `Sink.abort`."""
        self._chunks = {}


def full_coordinates(coordinates: Coordinates) -> dict[str, tuple[str, ...]]:
    """Return the coordinates of a run with the ones that are always the same."""
    fixed: Coordinates = {"side": SIDES, "component": COMPONENTS}
    return {name: tuple(labels) for name, labels in {**fixed, **coordinates}.items()}


def matches(name: str, patterns: Iterable[str]) -> bool:
    """Whether a name is one of those given, with ``*`` for any characters."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def time_quantities(quantities: Mapping[str, Quantity]) -> tuple[str, ...]:
    """Return the names of the quantities that are functions of time."""
    return tuple(name for name, quantity in quantities.items() if "time" in quantity.dims)


def peak_quantity(name: str) -> str:
    """Return the quantity whose values, times or distances an array in ``peaks`` holds."""
    return name.removesuffix("_time").removesuffix("_distance")


def root_attributes(*parts: Attributes) -> dict[str, str | float | int]:
    """Return the root attributes of a result: those of `parts` and those that are always there."""
    attributes: dict[str, str | float | int] = {
        "format": FORMAT,
        "railsim_version": __version__,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    for part in parts:
        attributes |= part
    return attributes
