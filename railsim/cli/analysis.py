"""What `modes`, `critical-speed` and `curving` share: inputs, ranges, output folders."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli.common import (
    echo,
    json_option,
    load_option,
    overwrite_option,
    print_json,
    quiet_option,
    set_option,
    show,
)
from railsim.errors import Fault, InputError
from railsim.files.access import check_folder, make_folder, whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from railsim.definitions.settings import Settings
    from railsim.definitions.track.definition import Track
    from railsim.definitions.vehicle.definition import Vehicle
    from railsim.table import Table

MOST_VALUES = 2000


@dataclass(frozen=True)
class Inputs:
    """Definitions of an analysis.

    Attributes
    ----------
    vehicle, track, settings
        Definitions.
    name : str
        Short name of the vehicle, for titles and files.
    """

    vehicle: "Vehicle"
    track: "Track"
    settings: "Settings"
    name: str


def load_inputs(
    vehicle: str,
    track: str | None,
    settings: str | None,
    assignments: Sequence[str],
    load: str | None = None,
) -> Inputs:
    """Load vehicle (in a load case), track (by default ``straight``), settings; all faults."""
    from railsim.cli.common import with_load
    from railsim.definitions.loading import load_settings, load_track, load_vehicle
    from railsim.files.overrides import split_overrides
    from railsim.studies.case import short_name

    faults: list[Fault] = []
    try:
        parts = split_overrides(with_load(assignments, load, "vehicle."))
    except InputError as error:
        parts = {"vehicle": [], "track": [], "settings": []}
        faults.extend(error.faults)
    found: dict[str, Any] = {}
    loads: dict[str, Callable[[], Any]] = {
        "vehicle": lambda: load_vehicle(vehicle, parts["vehicle"]),
        "track": lambda: load_track("straight" if track is None else track, parts["track"]),
        "settings": lambda: load_settings(settings, parts["settings"]),
    }
    for kind, read in loads.items():
        try:
            found[kind] = read()
        except InputError as error:
            faults.extend(error.faults)
    if faults:
        raise InputError(faults)
    return Inputs(found["vehicle"], found["track"], found["settings"], short_name(vehicle))


@dataclass(frozen=True)
class InputFiles:
    """The files and changes that a command line names, see `load_inputs`."""

    vehicle: str
    track: str | None
    settings: str | None
    load_case: str | None
    assignments: tuple[str, ...]

    def load(self, changes: Sequence[str] = ()) -> Inputs:
        """Load them, with further assignments."""
        assignments = [*self.assignments, *changes]
        return load_inputs(self.vehicle, self.track, self.settings, assignments, self.load_case)


@dataclass(frozen=True)
class Output:
    """Where the results of an analysis go."""

    out: str | None
    overwrite: bool
    as_json: bool
    quiet: bool


def analysis_options(
    files: str, settings: str = "creep law and contact"
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Add the options of an analysis; the command takes `InputFiles` and `Output` first.

    Parameters
    ----------
    files : str
        What ``--out`` holds.
    settings : str
        What counts of ``--settings``.
    """

    def add(function: Callable[..., None]) -> Callable[..., None]:
        @wraps(function)
        def command(
            vehicle: str,
            out: str | None,
            settings: str | None,
            load: str | None,
            assignments: tuple[str, ...],
            **others: Any,
        ) -> None:
            names = ("overwrite", "as_json", "quiet")
            output = Output(out, *(others.pop(name) for name in names))
            track = others.pop("track", None)
            function(InputFiles(vehicle, track, settings, load, assignments), output, **others)

        found: Callable[..., None] = command
        for option in (
            quiet_option,
            json_option,
            overwrite_option,
            set_option,
            load_option,
            click.option("--settings", metavar="F", help=f"Settings file: {settings}."),
            click.option("--out", metavar="DIR", help=f"Folder for {files}."),
        ):
            found = option(found)
        return found

    return add


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
        raise InputError([Fault(option, "", f"found '{text}'", allowed)]) from None
    if not all(abs(value) < float("inf") for value in values):
        raise InputError([Fault(option, "", f"found '{text}'", "finite numbers")])
    return values


class Folder:
    """The folder of ``--out``: refused before the computation, written at its end.

    Parameters
    ----------
    out : str or None
        Folder, or nothing to write.
    names : sequence of str
        Files that will be written.
    overwrite : bool
        Whether they may exist.
    """

    def __init__(self, out: str | None, names: Sequence[str], overwrite: bool) -> None:
        self.path = Path(out) if out else None
        self.names = tuple(names)
        if self.path is not None:
            check_folder(self.path, names, overwrite=overwrite)
        self.written: list[Path] = []

    def write_json(self, name: str, data: Any) -> None:
        """Write data as JSON."""
        if self.path is None:
            return
        import json

        from railsim.cli.common import plain

        make_folder(self.path)
        with whole_file(self.path / name) as partial:
            text = json.dumps(plain(data), indent=1, allow_nan=False)
            partial.write_text(text + "\n", encoding="utf-8")
        self.written.append(self.path / name)

    def write_picture(self, name: str, figure: "Figure") -> None:
        """Write a figure."""
        if self.path is None:
            return
        from railsim.plot.style import save

        make_folder(self.path)
        self.written.append(save(figure, self.path / name, overwrite=True))

    def finish(
        self,
        record: Any,
        figure: "Callable[[], Figure]",
        parts: "Callable[[], Sequence[str | Table]]",
        *,
        as_json: bool,
    ) -> None:
        """Write record and figure to the first two files; print the record, or texts and tables."""
        data, picture, *_ = self.names
        self.write_json(data, record)
        if self.path is not None:
            self.write_picture(picture, figure())
        if as_json:
            print_json(record)
            return
        show(*parts())
        self.tell()

    def tell(self) -> None:
        """Print what was written."""
        for path in self.written:
            echo(str(path))
