"""The result of a run: named arrays with units, and everything that led to them.

A `Result` never changes: its arrays are read-only, and what is derived from them is computed by
functions beside it.  Arrays that come from a file are read when they are first asked for.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from railsim.arrays import Floats
from railsim.errors import changed_faults, nearest, optional_package
from railsim.notation import Quantity
from railsim.plottable import draw_figure, image_tag
from railsim.profiles.profile import Profile
from railsim.result.labels import chosen_names, index_of
from railsim.table import Table
from railsim.text import printable

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from railsim.definitions.settings import Settings
    from railsim.definitions.track.definition import Track
    from railsim.definitions.vehicle.definition import Vehicle

D = TypeVar("D")
Attributes = Mapping[str, str | float | int]


def check_result(value: object) -> None:
    """Raise TypeError where something else than a result is given, such as the path of one."""
    if not isinstance(value, Result):
        raise TypeError(f"the result is {value!r}; give what railsim.open_result returns")


class Result:
    """What a run computed.

    Arrays are reached by the names of `railsim.notation.QUANTITIES`, as ``result.Q`` or
    ``result["Q"]``; the first dimension of all but the static ones is time.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        One array for every quantity [SI].
    quantities : mapping of str to Quantity
        Unit, dimensions and meaning of every array.
    coordinates : mapping of str to sequence of str
        Names along every dimension other than time.
    attributes : mapping
        Facts about the run, the root attributes of the result file.
    profiles : mapping of str to Profile
        Every wheel and rail profile that was used, by its name in the vehicle or track.
    groups : mapping of str to mapping of str to ndarray
        Further arrays by group: ``state`` holds the whole state at the ``end`` of the run, and the
        one at its ``start`` where that went on from another run; ``peaks`` the largest and smallest
        values over all steps, see `railsim.peaks`.
    source : str
        File that the result was read from, for messages.

    Examples
    --------
    >>> from railsim.notation import QUANTITIES
    >>> result = Result(
    ...     arrays={"time": [0.0, 0.1], "sum_Y": [[1e3, 2e3], [3e3, -4e3]]},
    ...     quantities={name: QUANTITIES[name] for name in ("time", "sum_Y")},
    ...     coordinates={"wheelset": ["front", "rear"]},
    ...     attributes={"status": "complete"},
    ... )
    >>> result.sum_Y.shape, result.series("sum_Y", wheelset="rear")
    ((2, 2), array([ 2000., -4000.]))
    """

    def __init__(
        self,
        arrays: Mapping[str, Any],
        quantities: Mapping[str, Quantity],
        coordinates: Mapping[str, Any],
        attributes: Attributes,
        profiles: Mapping[str, Profile] = MappingProxyType({}),
        groups: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
        *,
        source: str = "",
    ) -> None:
        self._source = source
        self._arrays = arrays if isinstance(arrays, FrozenArrays) else FrozenArrays(arrays)
        self._quantities = MappingProxyType(dict(quantities))
        labelled = {name: tuple(map(str, labels)) for name, labels in coordinates.items()}
        self._coordinates = MappingProxyType(labelled)
        self._attributes = MappingProxyType(dict(attributes))
        self._profiles = MappingProxyType(dict(profiles))
        frozen_groups = {group: FrozenArrays(arrays) for group, arrays in groups.items()}
        self._groups = MappingProxyType(frozen_groups)
        self._definitions: dict[str, Any] = {}  # read when they are first asked for

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what `pickle` restores the result from: all arrays, read if necessary."""
        arrays = {name: np.asarray(array) for name, array in self._arrays.items()}
        facts = self._quantities, self._coordinates, self._attributes, self._profiles
        groups = {group: dict(arrays) for group, arrays in self._groups.items()}
        return partial(Result, source=self._source), (arrays, *map(dict, facts), groups)

    # -- the arrays ---------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Floats:
        """Return the array of quantity `name` [SI], or the names along a dimension."""
        if name in self._coordinates:
            return np.array(self._coordinates[name])
        try:
            return self._arrays[name]
        except KeyError:
            raise KeyError(f"no quantity '{name}'; {nearest(name, self._arrays)}") from None

    def __getattr__(self, name: str) -> Floats:
        if not name.startswith("_") and (name in self._arrays or name in self._coordinates):
            return self[name]
        names = (*self._arrays, "attributes", "coordinates", "quantities", "profiles", "groups")
        raise AttributeError(f"a result has no '{name}'; {nearest(name, names)}")

    def __contains__(self, name: object) -> bool:
        return name in self._arrays

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._arrays})

    @property
    def title(self) -> str:
        """Vehicle, track and speed, as far as they are known."""
        names = []
        for key in ("vehicle_toml", "track_toml"):
            text, keys = str(self._attributes.get(key, "")), ("name", "load")
            matches = [re.search(f"^{word} = (.*)$", text, re.MULTILINE) for word in keys]
            if matches[0]:
                parts = (printable(match[1].strip("\"'")) for match in matches if match)
                names.append(", load case ".join(parts))
        speed = f" at {self.speed_words}" if "speed" in self._attributes else ""
        return f"{' on '.join(names)}{speed}".strip()

    @property
    def speed_words(self) -> str:
        """The speed in m/s and km/h; that at the start is called so where it varies."""
        settings = str(self._attributes.get("settings_json", ""))
        varies = re.search(r'"drive"\s*:\s*{[^}]*"mode"\s*:\s*"(table|free)"', settings)
        start = " at the start" if varies else ""
        return f"{self.speed:.6g} m/s ({3.6 * self.speed:.4g} km/h){start}"

    @property
    def end_words(self) -> str:
        """How the run ended, to follow its name; nothing where it is complete."""
        return "" if self.status == "complete" else f" · {self.status}"

    def __repr__(self) -> str:
        steps = self["time"].shape[0] if "time" in self else 0
        parts = [self.title, self.status, f"{steps} instants", f"{len(self._arrays)} quantities"]
        return f"<Result: {', '.join(filter(None, parts))}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the run, its wheel forces, and what the result holds."""
        facts = {"status": "", "status_reason": "", "speed": "m/s", "start": "m", "duration": "s",
                 "step": "s", "cpu_time": "s"}  # fmt: skip
        entries = ((name, self._attributes.get(name, ""), unit) for name, unit in facts.items())
        rows = [[name, f"{x:.6g} {unit}" if unit else x] for name, x, unit in entries if x != ""]
        rows += [["remark", remark] for remark in self.remarks]
        held = [[q.name, q.long_name, q.unit, ", ".join(q.dims)] for q in self._quantities.values()]
        columns = ["name", "quantity", "unit", "dimensions"]
        run = Table(["fact", "value"], rows, self.title or "Result")
        forces = {"Q", "Y", "distance"} <= set(self) and len(self["time"]) > 1
        picture = image_tag(self.plot("Q", "Y")) if forces else ""
        return f"{run.html()}{picture}{Table(columns, held).html()}"

    def part(self, name: str, rows: slice) -> Floats:
        """Return some instants of a quantity; of a file that is not read yet only these are read.

        Parameters
        ----------
        name : str
            Quantity with time as its first dimension.
        rows : slice
            Instants, a step of 1.
        """
        if name not in self._arrays:
            raise KeyError(f"no quantity '{name}'; {nearest(name, self._arrays)}")
        return self._arrays.part(name, rows)

    def series(self, name: str, **labels: str | int) -> Floats:
        """Return one quantity, selected by labels along its dimensions.

        Parameters
        ----------
        name : str
            Quantity.
        **labels : str or int
            Dimension = name along it, or its index from 0.  As everywhere, texts (``"1"``,
            ``Q:1:left``) and tables number wheelsets from 1, integers and arrays from 0.

        Returns
        -------
        ndarray
            The array without the dimensions that were given [SI].

        Raises
        ------
        KeyError
            There is no such quantity, dimension or label.
        """
        dims = self._quantities[name].dims if name in self._quantities else ()
        array = self[name]
        for dim in labels:
            if dim not in dims:
                raise KeyError(f"{name} has no dimension '{dim}'; {nearest(dim, dims)}")
        return array[tuple(self._index(dim, labels.get(dim)) for dim in dims)]

    def _index(self, dim: str, label: str | int | None) -> int | slice:
        if label is None:
            return slice(None)
        if dim == "time":
            instants = len(self["time"])
            if isinstance(label, str) or not -instants <= label < instants:
                raise KeyError(f"no instant {label!r}; 0 to {instants - 1}")
            return label
        return index_of(dim, self._coordinates[dim], label)

    # -- what describes them ------------------------------------------------------------------

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Unit, dimensions and meaning of every array."""
        return self._quantities

    @property
    def coordinates(self) -> Mapping[str, tuple[str, ...]]:
        """Names along every dimension other than time."""
        return self._coordinates

    @property
    def wheelsets(self) -> tuple[str, ...]:
        """Names of the wheelsets from the leading end."""
        return self._coordinates.get("wheelset", ())

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return self._coordinates.get("body", ())

    @property
    def attributes(self) -> Attributes:
        """Facts about the run: the root attributes of the result file."""
        return self._attributes

    @property
    def profiles(self) -> Mapping[str, Profile]:
        """Wheel and rail profiles that were used, by their names in the vehicle or track."""
        return self._profiles

    @property
    def groups(self) -> Mapping[str, Mapping[str, Floats]]:
        """Further arrays by group: ``state`` and ``peaks``."""
        return self._groups

    @property
    def status(self) -> str:
        """How the run ended: ``complete``, ``derailed`` or ``stopped``."""
        return str(self._attributes.get("status", ""))

    @property
    def speed(self) -> float:
        """Speed at the start of the run [m/s]."""
        return float(self._attributes["speed"])

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks for the reader, one sentence each; see `railsim.simulation.remarks`."""
        return tuple(str(self._attributes.get("remarks", "")).splitlines())

    def vehicle(self) -> "Vehicle":
        """Rebuild the vehicle's definition from the text that the result carries."""
        from railsim.definitions.loading import load_vehicle_text

        return self._definition("vehicle_toml", load_vehicle_text)

    def track(self) -> "Track":
        """Rebuild the track's definition from the text that the result carries."""
        from railsim.definitions.loading import load_track_text

        return self._definition("track_toml", load_track_text)

    def settings(self) -> "Settings":
        """Rebuild the settings from what the result carries."""
        from railsim.definitions.loading import load_settings_json

        return self._definition("settings_json", load_settings_json)

    def _definition(self, name: str, load: Callable[[str], D]) -> D:
        """Return what an attribute describes; its faults name the file that holds it."""
        if name not in self._definitions:
            source = f"{self._source}: " if self._source else ""
            with changed_faults(lambda fault: replace(fault, file=f"{source}{fault.file}")):
                self._definitions[name] = load(str(self._attributes[name]))
        definition: D = self._definitions[name]
        return definition

    def inputs(self) -> dict[str, Any]:
        """Return all that the run was made from: ``simulate(**result.inputs())`` runs it again."""
        facts = self._attributes
        states: Mapping[str, Floats] = self._groups.get("state", {})
        before = {"end": states.get("start"), "memory": states.get("start_memory")}
        return {
            "vehicle": self.vehicle(), "track": self.track(), "settings": self.settings(),
            "speed": self.speed, "start": float(facts.get("start", 0.0)),
            "duration": facts.get("requested_duration"), "until": facts.get("requested_until"),
            "profiles": self.profiles, "resume": before if "start" in states else None,
        }  # fmt: skip

    def plot(
        self,
        *quantities: str,
        over: str = "distance",
        by: str = "wheel",
        between: tuple[float, float] | None = None,
        path: str | Path | None = None,
        overwrite: bool = False,
    ) -> "Figure":
        """Draw quantities over distance or time, in the units of the field.

        Parameters
        ----------
        *quantities : str
            Quantities, with labels where not all are wanted: ``"Q"``, ``"Y:1:left"``,
            ``"body_acceleration:carbody:y"``; wheelsets by name, or by number from 1; by default
            wheel load change, guiding forces, derailment quotient and the motion of the wheelsets.
        over : {"distance", "time"}
            Horizontal axis.
        by : {"wheel", "wheelset"}
            One pair of axes for all wheels, or one for each wheelset.
        between : (float, float), optional
            Part of the horizontal axis [m or s].
        path : str or Path, optional
            File for the picture; the suffix gives its format.
        overwrite : bool
            Whether an existing file may be replaced.

        Raises
        ------
        InputError
            A quantity or label that the result does not have; the file exists.
        """
        selection = {"selections": quantities} if quantities else {}
        return draw_figure(self, path, overwrite, over=over, by=by, between=between, **selection)

    # -- elsewhere ----------------------------------------------------------------------------

    def to_hdf5(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the result file; it appears under its name only when it is whole.

        Raises InputError: the file exists and may not be overwritten, or cannot be written.
        """
        from railsim.result.hdf5 import write  # the layout of the file is built on this module

        return write(self, path, overwrite=overwrite)

    save = to_hdf5
    """As `to_hdf5`: definitions and results alike are saved by `save`."""

    def to_xarray(self) -> "xarray.Dataset":
        """Return the arrays as an `xarray.Dataset` with named coordinates and units.

        Raises ImportError: xarray is not installed.
        """
        package = optional_package("xarray", "to_xarray", "'railsim[xarray]'")
        variables = {}
        for name, q in self._quantities.items():
            facts = {"units": q.unit, "long_name": q.long_name, "comment": q.sign}
            variables[name] = q.dims, self[name], {k: text for k, text in facts.items() if text}
        coords: dict[str, Any] = {name: list(names) for name, names in self._coordinates.items()}
        for name in ("time", "distance"):
            if name in variables:
                coords[name] = variables.pop(name)
        data: xarray.Dataset = package.Dataset(variables, coords, dict(self._attributes))
        return data

    def to_pandas(self, *names: str) -> "pandas.DataFrame":
        """Return quantities over time as a `pandas.DataFrame`.

        Parameters
        ----------
        *names : str
            Quantities with time as their first dimension, with labels where not all are wanted
            (``"Q:1:left"``: names, and wheelsets also by numbers from 1); by default all of them.

        Returns
        -------
        DataFrame
            Rows by time [s]; a column for each set of labels, called as in `plot`:
            ``Q:front.outer.wheelset:left`` [SI].  Its ``attrs["units"]`` gives the unit of every
            column.

        Raises
        ------
        ImportError
            Pandas is not installed.
        KeyError
            There is no such quantity or label.
        """
        pandas = optional_package("pandas", "to_pandas", "'railsim[pandas]'")
        series = list(self.columns(*names))
        columns = {column: values for column, _, values in series}
        frame = pandas.DataFrame(columns, index=pandas.Index(self["time"], name="time"))
        frame.attrs["units"] = {column: unit for column, unit, _ in series}
        return frame

    def columns(self, *names: str) -> Iterator[tuple[str, str, Floats]]:
        """Yield name, unit and values of every column of quantities over time, see `to_pandas`."""
        over_time = [n for n, q in self._quantities.items() if q.dims[0] == "time" != n]
        for text in names or over_time:
            name, *requested = text.split(":")
            array = self[name]
            if name not in over_time:
                raise KeyError(f"{name} is not over time; {nearest(name, over_time)}")
            quantity = self._quantities[name]
            dims = quantity.dims[1:]
            places = chosen_names(dims, self._coordinates, requested)
            combinations = product(*(self._coordinates[dim] for dim in dims))
            columns = array.reshape(len(array), math.prod(array.shape[1:])).T  # also without rows
            for labels, values in zip(combinations, columns, strict=True):
                if any(labels[k] not in chosen for k, chosen in places.items()):
                    continue
                by_component = "component" in quantity.dims
                unit = quantity.component(labels[-1]).unit if by_component else quantity.unit
                yield ":".join((name, *labels)), unit, values


Results = Mapping[str, Result]
"""Results by the names of their runs."""


class FrozenArrays(Mapping[str, Floats]):
    """Read-only arrays by name."""

    def __init__(self, arrays: Mapping[str, Any]) -> None:
        self._loaded: MutableMapping[str, Floats] = {n: frozen(a) for n, a in arrays.items()}

    def __getitem__(self, name: str) -> Floats:
        return self._loaded[name]

    def part(self, name: str, rows: slice) -> Floats:
        """Return some rows of an array."""
        return self[name][rows]

    def __iter__(self) -> Iterator[str]:
        return iter(self._loaded)

    def __len__(self) -> int:
        return len(self._loaded)


def frozen(array: Any) -> Floats:
    """Return `array` as float64 that cannot be written to, nor made so."""
    return np.asarray(np.asarray(array, dtype=np.float64).data.toreadonly())
