"""Measured runs, `railsim-measurement/1`: which files a test has left, and what their columns are.

A channel is named by the quantity of a result that it is the counterpart of, with its labels:
``Q:1:left``, ``sensor_acceleration:frame_2:y``; so a measured and a simulated run are compared
without further ado.  Reading is in `railsim.measurement`.
"""

from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from railsim.constants import STANDARD_GRAVITY
from railsim.definitions import base
from railsim.definitions.file_definition import FileDefinition
from railsim.notation import COMPONENTS, QUANTITIES, REQUESTED, SHOWN_UNITS, SIDES, Quantity

AXES = ("time", "distance", "mileage", "speed", "curvature", "yaw_rate")
"""Quantities that say where and when: a measurement has one channel of each at most."""
OWN_UNITS = {"speed": "m/s", "yaw_rate": "rad/s"}
UNITS = {
    **{unit: (si, 1.0 / factor) for unit, (si, factor) in SHOWN_UNITS.items()},
    **{si: (si, 1.0) for si, _ in SHOWN_UNITS.values()},
    **{unit: (unit, 1.0) for unit in ("s", "m/s2", "rad/s", "rad/s2", "W")},
    "ms": ("s", 1e-3),
    "g": ("m/s2", STANDARD_GRAVITY),
    "mm/s2": ("m/s2", 1e-3),
    "mm/s": ("m/s", 1e-3),
    "um": ("m", 1e-6),
    "deg/s": ("rad/s", SHOWN_UNITS["deg"][1] ** -1),
    "mrad/s": ("rad/s", 1e-3),
}
"""SI unit of values written in a unit, and SI value over written value."""
FEWEST, MOST_FILES, MOST_CHANNELS = 20, 1000, 500

Files = Annotated[
    tuple[base.Text, ...],
    Field(min_length=1, max_length=MOST_FILES),
    BeforeValidator(lambda value: (value,) if isinstance(value, str) else value),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "minLength": 1},
                {"type": "array", "items": {"type": "string"}, "minItems": 1},
            ]
        }
    ),
]


def quantity_of(selection: str) -> Quantity | None:
    """Return the quantity of a selection such as ``Q:1:left``, of one component where it has some.

    None where it is no quantity over time, or the number of labels is another than its dimensions.
    """
    name, *labels = selection.split(":")
    if name in OWN_UNITS:
        unit = OWN_UNITS[name]
        return None if labels else Quantity(name, name, "", unit, ("time",), unit, 1.0)
    quantity = QUANTITIES.get(name) or REQUESTED.get(name)
    if quantity is None or quantity.dims[0] != "time" or len(labels) != len(quantity.dims) - 1:
        return None
    for dim, label in zip(quantity.dims[1:], labels, strict=True):
        if dim == "side" and label not in SIDES:
            return None
        if dim in ("axis", "component"):
            if label not in COMPONENTS[: 3 if dim == "axis" else 6]:
                return None
            quantity = quantity.component(label) if dim == "component" else quantity
    return quantity


Selection = Annotated[
    base.Text,
    base.holds(
        lambda selection: quantity_of(selection) is not None,
        "a quantity of a result with a label for each of its dimensions: 'Q:1:left', "
        "'sensor_acceleration:floor_front:z'; or one of " + ", ".join(AXES),
    ),
]


class Channel(base.Definition):
    """A column of the files: what it measures, where, in which unit and with which sign."""

    quantity: Selection
    """Counterpart in a result, with its labels: `Q:1:left`, `sum_Y:2`,
    `sensor_acceleration:axlebox_1_left:z`; `time`, `distance`, `mileage`, `speed`, `curvature` or
    `yaw_rate` (of the body) of the run itself"""
    column: base.Text | None = None
    """Its name in the files (a path in HDF5); by default that of the channel"""
    index: tuple[base.Whole, ...] = ()
    """Which series of an array with more dimensions than time, from 0: `[0, 1]` (HDF5, MATLAB)"""
    unit: base.Text | None = None
    """Unit of the file; by default SI"""
    reverse: base.Flag = False
    """Its sign is the opposite of railsim's"""
    offset: base.Finite = 0.0
    """What the file shows where the quantity is zero, in the unit of the file"""
    zero: tuple[base.Finite, base.Finite] | None = None
    """Times between which the quantity is zero in the mean (at rest, on straight track): this mean
    is taken off [s]"""
    delay: base.Finite = 0.0
    """By how much the channel lags behind the clock of the files [s]"""
    range: tuple[base.Finite, base.Finite] | None = None
    """Smallest and largest value that the amplifier can show, in the unit of the file: beyond them
    there is no value"""
    low_pass: base.Positive | None = None
    """-3 dB corner of the amplifier's low pass, Butterworth of order 4 [Hz]"""
    high_pass: base.Positive | None = None
    """-3 dB corner of its high pass, Butterworth of order 4 (piezoelectric sensors) [Hz]"""
    noise: base.Positive | None = None
    """Standard deviation of its noise, as a weight in identification [SI]"""

    @property
    def factor(self) -> float:
        """SI value with railsim's sign over the value in the file."""
        scale = UNITS[self.unit][1] if self.unit else 1.0
        return -scale if self.reverse else scale

    @base.check
    def _unit_of_quantity(self) -> None:
        quantity = quantity_of(self.quantity)
        assert quantity is not None  # by its own check
        allowed = sorted(unit for unit, (si, _) in UNITS.items() if si == quantity.unit)
        if self.unit is not None and self.unit not in allowed:
            raise ValueError(
                f"'{self.unit}' is no unit of {quantity.name}: {', '.join(allowed or ['SI'])}"
            )
        for name in ("zero", "range"):
            pair = getattr(self, name)
            if pair is not None and not pair[0] < pair[1]:
                raise ValueError(f"'{name}' must rise")


class MeasurementFile(FileDefinition):
    """A measured run: everything that its file says."""

    KIND: ClassVar = "measurement"

    format: Literal["railsim-measurement/1"]
    name: base.Text
    """What the run is called in tables and plots"""
    source: base.Text | None = None
    """Who measured it, when and where"""
    file: Files
    """Data: CSV (`.csv`, `.txt`), Parquet (`.parquet`), MATLAB (`.mat`) or HDF5 (`.h5`, `.hdf5`); a
    list of them is one record in several parts, one behind the other"""
    channels: Annotated[dict[base.Name, Channel], Field(min_length=1, max_length=MOST_CHANNELS)]
    """Channels by names of your choice"""
    vehicle: base.Text | None = None
    """Vehicle file or name of a shipped one, where a command gives no other"""
    track: base.Text | None = None
    """Track file or name of a shipped one, where a command gives no other"""
    load: base.Text | None = None
    """Load case in which the vehicle ran; by default its design load"""
    speed: base.Positive | None = None
    """Speed of the run, where no channel has it [m/s]"""
    start: base.Finite = 0.0
    """Arc length of the reference body at the first value, where neither `distance` nor `mileage`
    is measured [m]"""
    rate: base.Positive | None = None
    """Values per second, where no channel has the time [1/s]"""
    encoding: base.Text = "utf-8-sig"
    """Encoding of text files, such as `latin-1`"""
    skip: Annotated[int, Field(strict=True, ge=0, le=1000)] = 0
    """Lines of a text file above the names of the columns"""
    units_row: base.Flag = False
    """The line below the names of the columns holds units; it is not read"""
    missing: tuple[base.Finite, ...] = ()
    """Values that stand for none, such as -9999, in the unit of the file; empty cells always do"""
    longest_gap: base.NonNegative = 0.0
    """Gaps up to this time are bridged by a straight line; in longer ones there is no value [s]"""
    mounting: dict[base.Name, tuple[base.Finite, base.Finite, base.Finite]] = base.EMPTY_TABLE
    """Small angles by which the sensors at a point are turned about x, y, z of the body [rad]: its
    accelerations are turned back"""

    @base.check
    def _axes(self) -> None:
        used = [channel.quantity for channel in self.channels.values()]
        twice = sorted({quantity for quantity in used if used.count(quantity) > 1})
        if twice:
            raise ValueError(f"two channels of {twice[0]}: name another point, or leave one out")
        if ("time" in used) == (self.rate is not None):
            raise ValueError("either a channel of the quantity 'time' or 'rate' is needed")
        if not {"distance", "mileage", "speed"} & {*used} and self.speed is None:
            raise ValueError("a channel of 'distance', 'mileage' or 'speed', or the key 'speed'")
        if not {*used} - {*AXES}:
            raise ValueError("no channel measures the vehicle")
