"""Definitions that a command line names, and ranges of values."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from railsim.cli.common import F, collected, load_option, option, set_option
from railsim.errors import Faults, input_error

if TYPE_CHECKING:
    from railsim.definitions import Settings, Track, Vehicle

MOST_VALUES = 2000


class Inputs(NamedTuple):
    """Definitions of an analysis."""

    vehicle: "Vehicle"
    track: "Track"
    settings: "Settings"


@dataclass(frozen=True)
class Given:
    """Values of ``--load``, ``--settings``, ``--set``."""

    load: str | None = None
    settings: str | None = None
    assignments: tuple[str, ...] = ()

    @property
    def overrides(self) -> tuple[str, ...]:
        """The assignments with that of the load case."""
        load = () if self.load is None else (f"vehicle.load={self.load}",)
        return (*self.assignments, *load)

    def inputs(self, vehicle: str, track: str | None, changes: Sequence[str] = ()) -> Inputs:
        """Load vehicle, track (by default ``straight``) and settings, with further assignments.

        Raises InputError: everything that is wrong in any of them.
        """
        from railsim.definitions.loading import load_settings, load_track, load_vehicle
        from railsim.files.overrides import split_overrides

        faults, parts = Faults(), dict[str, list[str]](vehicle=[], track=[], settings=[])
        with faults.caught():
            parts = split_overrides([*self.overrides, *changes])
        with faults.caught():
            coach = load_vehicle(vehicle, parts["vehicle"])
        with faults.caught():
            rails = load_track("straight" if track is None else track, parts["track"])
        with faults.caught():
            settings = load_settings(self.settings, parts["settings"])
        faults.check()
        return Inputs(coach, rails, settings)


def given_options(settings: str = "", *, load: bool = True) -> Callable[[F], F]:
    """Add ``--load``, ``--settings`` and ``--set``; the command takes them as `given`.

    `settings`: what counts of the settings file, by default all.
    """
    words = f"Settings file: {settings}." if settings else "Settings file."
    options: list[Any] = [option("--settings", words, "F"), set_option]
    return collected("given", Given, *[load_option] * load, *options)


def values_of(text: str, option: str) -> list[float]:
    """Return the values of ``A:B:N`` (N values from A to B) or ``A,B,C``.

    Examples
    --------
    >>> values_of("10:20:3", "--speeds"), values_of("0.2,0.4", "--friction")
    ([10.0, 15.0, 20.0], [0.2, 0.4])
    """
    allowed = "first:last:number, such as 10:60:26, or values with commas between"
    try:
        if ":" in text:
            first, last, number = text.split(":")
            count = int(number)
            if not 1 <= count <= MOST_VALUES:
                raise ValueError
            a, b = float(first), float(last)
            step = (b - a) / (count - 1) if count > 1 else 0.0
            values = [a + k * step for k in range(count)]
        else:
            values = [float(part) for part in text.split(",")]
    except ValueError:
        raise input_error(option, f"found '{text}'", allowed) from None
    if not all(abs(value) < float("inf") for value in values):
        raise input_error(option, f"found '{text}'", "finite numbers")
    return values
