"""What an identification has found: values, how well they are known, and the residuals."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from railsim.arrays import Floats
from railsim.definitions.base import FrozenDict
from railsim.definitions.vehicle.definition import Vehicle
from railsim.files.access import check_file, relative, write_text
from railsim.identification.parameters import TRACK, Parameter, blended, find_value, scaled
from railsim.identification.residuals import banded
from railsim.profiles import save_profile
from railsim.profiles.used import exchanged_wheels
from railsim.table import Column, Table

NORMAL = 1.959964  # of a normal distribution: 95 % within
UNKNOWN = 0.5  # standard deviation of a combination (as a share) from which the data do not tell it
INFINITE = 1e3  # standard deviation, end of an interval from which nothing is known
PART = 0.25  # share of the largest part of a combination that is named
AT_BOUND = "ends at its bound"  # of a parameter, in remarks
NOT_WHITE = 0.01  # probability


@dataclass(frozen=True, eq=False)
class Channel:
    """A channel before and after."""

    run: str
    name: str
    quantity: str
    step: float  # [s]
    at: Floats = field(repr=False)  # arc length, float64[time] [m]
    measured: Floats = field(repr=False)  # [SI]
    before: Floats = field(repr=False)  # simulated with the file's values
    after: Floats = field(repr=False)  # with the identified ones
    level: float  # rms of the weighted residuals: 1 where they are the noise [1]
    statistic: float  # of white residuals, see `railsim.identification.residuals.whiteness`
    probability: float

    @property
    def is_white(self) -> bool:
        """Whether the residuals look like white noise."""
        return not self.probability < NOT_WHITE


@dataclass(frozen=True)
class Place:
    """Where a run lies on the track: shift at its first value [m], stretch [1]."""

    run: str
    shift: float
    stretch: float


@dataclass(frozen=True, eq=False)
class Identified:
    """Identified parameters.

    Attributes
    ----------
    vehicle : Vehicle
        Where the search started.
    parameters : tuple of Parameter
    x : float64[parameter]
        Coordinates: logarithms of the factors on the file's values (shares of profiles).
    covariance : float64[parameter, parameter]
        Of the coordinates [1].
    singular_values : float64[parameter]
        Of the derivatives of the weighted residuals; one over the standard deviation of a
        combination.
    combinations : float64[combination, parameter]
        Directions that belong to them.
    channels : tuple of Channel
    places : tuple of Place
    form : str
    band : (float, float)
        [Hz]
    inflation : float
        Mean square of the weighted residuals, 1 at least: factor on the covariance.
    simulations : int
        Runs that were simulated.
    remarks : tuple of str
    """

    vehicle: Vehicle
    parameters: tuple[Parameter, ...]
    x: Floats
    covariance: Floats
    singular_values: Floats
    combinations: Floats
    channels: tuple[Channel, ...] = field(repr=False)
    places: tuple[Place, ...] = ()
    form: str = "history"
    band: tuple[float, float] = (0.0, 0.0)
    inflation: float = 1.0
    simulations: int = 0
    remarks: tuple[str, ...] = ()

    @property
    def factors(self) -> Floats:
        """Identified value over the file's, or share of a profile, by parameter."""
        return np.array([p.factor(x) for p, x in zip(self.parameters, self.x, strict=True)])

    @property
    def deviations(self) -> Floats:
        """Standard deviations of the coordinates: of a factor as a share of it [1]."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def intervals(self) -> Floats:
        """Ends of the 95 % intervals of the factors, float64[parameter, 2]."""
        reach = NORMAL * self.deviations
        ends = [self.x - reach, self.x + reach]
        return np.array(
            [[p.factor(min(a, 700.0)), p.factor(min(b, 700.0))]
             for p, a, b in zip(self.parameters, *ends, strict=True)]
        )  # fmt: skip

    @property
    def correlation(self) -> Floats:
        """Correlation matrix of the parameters."""
        scale = np.where(self.deviations > 0.0, self.deviations, 1.0)
        return np.asarray(self.covariance / np.outer(scale, scale))

    @cached_property
    def values(self) -> Mapping[str, Any]:
        """Identified values by the whole keys of the vehicle's file [SI]."""
        values = {}
        for parameter, factor in zip(self.parameters, self.factors, strict=True):
            for key in parameter.of_vehicle:
                path, value = find_value(self.vehicle, key)
                values[".".join(path)] = scaled(value, float(factor))
        return FrozenDict(values)

    @property
    def fitted(self) -> Vehicle:
        """The vehicle with the identified values."""
        return self.vehicle.with_values(self.values) if self.values else self.vehicle

    @property
    def unidentified(self) -> tuple[str, ...]:
        """What the data cannot tell apart, a sentence for each combination."""
        texts = []
        scale = np.sqrt(self.inflation)
        for value, row in zip(self.singular_values, self.combinations, strict=True):
            spread = scale / value if value > 0.0 else np.inf
            if not spread > UNKNOWN:
                continue
            row = row * np.sign(row[np.argmax(np.abs(row))])
            parts = [k for k in np.argsort(-np.abs(row)) if abs(row[k]) > PART * abs(row).max()]
            size = "infinite" if spread > INFINITE else f"{100 * spread:.0f} %"
            names = [self.parameters[k].name for k in parts]
            if len(parts) == 1:
                texts.append(f"The data say nothing about {names[0]} (standard deviation {size}).")
                continue
            changes = ", ".join(
                f"{self.parameters[k].name} by {10 * row[k] / row[parts[0]]:+.1f} %" for k in parts
            )
            texts.append(
                f"The data cannot tell apart {', '.join(names[:-1])} and {names[-1]}: a change of "
                f"{changes} at once leaves the channels as they are (standard deviation of this "
                f"combination {size})."
            )
        return tuple(texts)

    def table(self) -> Table:
        """Return values, standard deviations and intervals by parameter."""
        return parameter_table(self.record())

    def correlation_table(self) -> Table:
        """Return the correlation matrix."""
        return correlation_table(self.record())

    def residual_table(self) -> Table:
        """Return the residuals by channel: rms before and after, level, whiteness."""
        return residual_table(self.record())

    def _value(self, parameter: Parameter) -> float | None:
        """Return the identified value of a parameter of one number."""
        if not parameter.keys or parameter.keys[0].startswith(TRACK):
            return None
        value = self.values[".".join(find_value(self.vehicle, parameter.keys[0])[0])]
        return None if isinstance(value, list) else float(value)

    def _misfit(self, channel: Channel, simulated: Floats) -> float:
        """Return the rms of measured less simulated in the band, in % of the measured rms."""
        valid = np.isfinite(channel.measured) & np.isfinite(simulated)
        measured, simulated = (np.where(valid, x, np.nan) for x in (channel.measured, simulated))
        rows = (banded(x, channel.step, self.band) for x in (measured - simulated, measured))
        difference, scale = (float(np.sqrt(np.sum(row[valid] ** 2))) for row in rows)
        return 100.0 * difference / scale if scale else np.nan

    def record(self) -> dict[str, Any]:
        """Return everything but the series as plain values."""
        arrays = ("covariance", "correlation", "singular_values", "combinations")
        return {
            "vehicle": self.vehicle.name,
            "parameters": [
                {
                    "name": p.name,
                    "keys": list(p.keys),
                    "value": self._value(p),
                    "factor": float(f),
                    "standard_deviation": float(d),
                    "interval": [float(a), float(b)],
                }
                for p, f, d, (a, b) in zip(
                    self.parameters, self.factors, self.deviations, self.intervals, strict=True
                )
            ],
            "values": dict(self.values),
            **{name: getattr(self, name).tolist() for name in arrays},
            "unidentified": list(self.unidentified),
            "channels": [
                {
                    "run": channel.run,
                    "channel": channel.name,
                    "before": self._misfit(channel, channel.before),
                    "after": self._misfit(channel, channel.after),
                    "level": channel.level,
                    "probability": channel.probability,
                    "white": channel.is_white if np.isfinite(channel.probability) else None,
                }
                for channel in self.channels
            ],
            "places": [dict(vars(place)) for place in self.places],
            "form": self.form,
            "band": list(self.band),
            "inflation": self.inflation,
            "simulations": self.simulations,
            "remarks": list(self.remarks),
        }

    def save_vehicle(
        self, path: str | Path, base: str | Path | None = None, *, overwrite: bool = False
    ) -> Path:
        """Write a vehicle file with the identified values, the letter [I] beside each.

        Parameters
        ----------
        path : str or Path
        base : str or Path, optional
            Vehicle that the file extends, a name or a path; without it the file is complete.
        overwrite : bool

        Raises
        ------
        InputError
            The file exists and may not be overwritten, or cannot be written.
        """
        path = Path(path)
        check_file(path, overwrite=overwrite, endings=[".toml"])
        files: dict[str, tuple[str, str]] = {}
        for parameter, x, spread in zip(self.parameters, self.x, self.deviations, strict=True):
            if parameter.is_share:
                first, second = parameter.profiles
                file = path.with_name(f"{path.stem}_wheel{len(files) + 1}.csv")
                save_profile(blended(first, second, float(x)), file)
                files[first] = file.name, f"[I] {x:.3g} +- {spread:.2g} of the way to {second}"
        write_text(path, self._file(path, base, files))
        return path

    def _file(
        self, path: Path, base: str | Path | None, files: Mapping[str, tuple[str, str]]
    ) -> str:
        """Return the text; `files` and remarks of the identified profiles by the original's."""
        runs = ", ".join(dict.fromkeys(channel.run for channel in self.channels))
        head = [f"# Identified from {runs}: [I] identified by least squares, with the standard",
                "# deviation of the value."]  # fmt: skip
        shares = zip(self.parameters, self.factors, self.deviations, strict=True)
        head += [
            f"# Of the track: {parameter.name} x {factor:.4g} {_spread_text(spread)}."
            for parameter, factor, spread in shares
            if parameter.of_vehicle != parameter.keys
        ]
        head += [f"# {remark}" for remark in self.remarks if AT_BOUND in remark]
        wheels = exchanged_wheels(self.vehicle, {n: file for n, (file, _) in files.items()})
        if base is None:
            vehicle = self.fitted.with_values(wheels) if wheels else self.fitted
            return "\n".join([*head, vehicle.to_toml()])
        base_path = Path(base)
        if base_path.suffix == ".toml":
            base = relative(base_path.resolve(), path.resolve().parent)
        extended = tomli_w.dumps({"extends": str(base)}).strip()
        lines = [*head, 'format = "railsim-vehicle/1"', extended, ""]
        tables: dict[str, list[str]] = {}
        for parameter, spread in zip(self.parameters, self.deviations, strict=True):
            for key in parameter.of_vehicle:
                keys, _ = find_value(self.fitted, key)
                whole = keys[:-1] if keys[-1] in "xyz" or keys[-1].isdecimal() else keys
                value = find_value(self.fitted, ".".join(whole))[1]
                assignment = tomli_w.dumps({whole[-1]: value}).strip().replace("\n", " ")
                part = keys[-1] if keys != whole else ""
                mark = f"{assignment}  # [I] {part} {_spread_text(spread)}"
                tables.setdefault(".".join(whole[:-1]), []).append(" ".join(mark.split()))
        marks = "; ".join(mark for _, mark in files.values())
        for key, names in wheels.items():
            table, _, last = key.rpartition(".")
            tables.setdefault(table, []).append(f"{last} = {json.dumps(names)}  # {marks}")
        for table, entries in tables.items():
            lines += [f"[{table}]" if table else "", *_merge_vectors(entries), ""]
        return "\n".join(lines)


def _spread_text(spread: float) -> str:
    """Return a standard deviation in words."""
    return "not shown by the data" if spread > INFINITE else f"+- {100 * spread:.2g} %"


def residual_remark(channels: Iterable[tuple[str, bool]]) -> str:
    """Say what residuals that are not white mean; nothing where all are.

    `channels`: names, and whether the residuals are white.
    """
    pairs = list(channels)
    names = list(dict.fromkeys(name for name, white in pairs if not white))
    if names and not any(white for _, white in pairs):
        return (
            "The residuals of no channel are white: the model lacks something, and the values are "
            "not to be believed, whatever their intervals."
        )
    sentence = f"The residuals of {', '.join(names)} are not white: the model lacks something"
    return f"{sentence}, and the intervals are too narrow." if names else ""


def parameter_table(record: Mapping[str, Any]) -> Table:
    """Return values, standard deviations and intervals of the record of an identification."""
    rows = []
    for row in record["parameters"]:
        ends = [x if x is not None and abs(x) < INFINITE else None for x in row["interval"]]
        spread = row["standard_deviation"]
        share = 100.0 * spread if spread < INFINITE else None
        rows.append([row["name"], row["value"], row["factor"], share, *ends])
    return Table(
        [
            Column("parameter"),
            Column("value", "value (SI)", format=".5g"),
            Column("factor", "factor on the file's value", format=".4f"),
            Column("deviation", "standard deviation (%)", format=".2f"),
            Column("low", "95 % from", format=".4f"),
            Column("high", "to", format=".4f"),
        ],
        rows,
    )


def correlation_table(record: Mapping[str, Any]) -> Table:
    """Return the correlation matrix of the record of an identification."""
    names = [row["name"] for row in record["parameters"]]
    columns = [Column("parameter"), *(Column(name, format=".2f") for name in names)]
    pairs = zip(names, record["correlation"], strict=True)
    return Table(columns, [[name, *row] for name, row in pairs], "Correlation of the values")


def residual_table(record: Mapping[str, Any]) -> Table:
    """Return the residuals by channel of the record of an identification."""
    words = {True: "yes", False: "no", None: ""}
    return Table(
        [
            Column("run"),
            Column("channel"),
            Column("before", "before (% of rms in the band)", format=".1f"),
            Column("after", "after (% of rms in the band)", format=".1f"),
            Column("level", "residual over noise", format=".2f"),
            Column("probability", "p-value, white", format=".3f"),
            Column("white"),
        ],
        [{**row, "white": words[row["white"]]} for row in record["channels"]],
    )


def _merge_vectors(entries: list[str]) -> list[str]:
    """Return lines of a table; components of one vector are one line with several marks."""
    marks_by_value: dict[str, list[str]] = {}
    for entry in entries:
        value, _, mark = entry.partition("# ")
        marks_by_value.setdefault(value.strip(), []).append(mark)
    return [f"{value}  # {'; '.join(marks)}" for value, marks in marks_by_value.items()]
