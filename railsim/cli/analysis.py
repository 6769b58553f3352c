"""What `modes`, `critical-speed` and `curving` share: inputs, ranges, output folders."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railsim.cli.common import echo
from railsim.errors import Fault, InputError
from railsim.files import check_folder, make_folder, whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from railsim.definitions.settings import Settings
    from railsim.definitions.track import Track
    from railsim.definitions.vehicle import Vehicle

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
    from railsim.definitions.overrides import split_overrides
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

    def tell(self) -> None:
        """Print what was written."""
        for path in self.written:
            echo(str(path))
