"""From a measurement file and its data to arrays with railsim's units and signs."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from railsim.arrays import Floats, stretches
from railsim.constants import GRAVITY
from railsim.definitions.file_definition import loaded
from railsim.definitions.loading import load_track
from railsim.definitions.measurement import AXES, FEWEST, MeasurementFile, quantity_of
from railsim.errors import Fault, Faults, input_error, nearest
from railsim.files import sources
from railsim.measurement.clock import Clock, bridged, clock_of, delayed, joined_times
from railsim.measurement.columns import pieces
from railsim.measurement.data import Measurement
from railsim.measurement.position import position

MOST_VALUES = 200_000_000  # of all channels: 1.6 GB
LARGEST = {
    "Q": 1e6, "Y": 1e6, "sum_Y": 2e6, "sum_abs_Y": 2e6, "Y_over_Q": 10.0, "speed": 170.0,
    "curvature": 0.2, "yaw_rate": 10.0, "sensor_acceleration": 5000.0,
    "sensor_absolute_acceleration": 5000.0, "sensor_displacement": 1.0, "sensor_velocity": 50.0,
    "sensor_roll_rate": 20.0, "wheelset_lateral": 0.2, "element_deflection": 2.0,
}  # fmt: skip
"""Values [SI] that no vehicle on a track reaches."""
SMALLEST = {"Q": 500.0, "speed": 0.1}
"""Largest values [SI] that are too small for any run."""
SLOWEST = 1.0  # values per second
SINGLE = 1e-7  # share by which a number of single precision may differ from what is written
EQUAL_ENDS, OFTEN = 3, 3  # values in a row at the largest or smallest one, and how often


def load_measurement(
    path: str | Path, overrides: Iterable[str] | str = (), *, channels: Sequence[str] | None = None
) -> Measurement:
    """Load a measured run: its file and the data that it names.

    Parameters
    ----------
    path : str or Path
        Measurement file, or the name of the shipped one.
    overrides : iterable of str
        Assignments ``key.path=value`` with the file's own keys.
    channels : sequence of str, optional
        Names or quantities of the channels that are read; by default all.  A long record takes
        8 bytes for each value of a channel.

    Raises
    ------
    InputError
        Everything that is wrong in the files: missing columns, text, times or distances that do
        not rise, values that no vehicle reaches.
    """
    source = sources.read_source(sources.find_file(path, "measurement"), "measurement")
    folder = Path(source.file).parent
    for key in ("vehicle", "track"):  # names of files beside the measurement count from its folder
        name = source.data.get(key)
        if isinstance(name, str) and name and (folder / name).is_file():
            source.data[key] = str((folder / name).resolve())
    setup = loaded(MeasurementFile, source, overrides)
    names = _channel_names(str(path), setup, channels)
    parts = _read(setup, names)
    times = [name for name in names if setup.channels[name].quantity == "time"]
    remarks: list[str] = []
    if times:
        channel = setup.channels[times[0]]
        times_read, restarts = joined_times([
            channel.factor * (part - channel.offset) for part in parts[times[0]]
        ])  # fmt: skip
        if restarts:
            remarks.append(f"Files whose clock begins anew: {restarts}; they follow each other.")
        clock = clock_of(setup.file[0], times_read)
    else:
        count = sum(map(len, parts[names[0]]))
        assert setup.rate is not None  # by the definition
        clock = Clock(np.arange(count) / setup.rate, setup.rate, np.arange(count), np.empty(0))
    if clock.rate < SLOWEST:
        found = f"{clock.rate:.3g} values per second"
        allowed = f"{SLOWEST:g} at least; the 'unit' of the time?"
        raise input_error(setup.file[0], found, allowed, key="rate" if setup.rate else "time")
    remarks += clock.remarks
    values, faults = {}, Faults()
    for name in names:
        pieces_of = parts.pop(name)  # freed as it is converted
        if name not in times:
            values[name] = _channel(name, setup, np.concatenate(pieces_of), clock, remarks)
            faults += _implausible(setup, name, values[name])
    faults.check()
    return _measurement(str(path), setup, clock, values, remarks)


def _channel_names(file: str, setup: MeasurementFile, requested: Sequence[str] | None) -> list[str]:
    """Return the names of the channels to read: those asked for, and time and place."""
    names = list(setup.channels)
    if requested is None:
        return names
    by_quantity = {channel.quantity: name for name, channel in setup.channels.items()}
    chosen = {name for name in names if setup.channels[name].quantity in AXES}
    faults = Faults()
    for item in requested:
        name = item if item in setup.channels else by_quantity.get(item)
        if name is None:
            hint = nearest(item, [*names, *by_quantity])
            faults.append(Fault(file, "channels", f"no channel '{item}'", hint))
        else:
            chosen.add(name)
    faults.check()
    return [name for name in names if name in chosen]


def _read(setup: MeasurementFile, names: list[str]) -> dict[str, list[Floats]]:
    """Return values as the files have them: for each channel an array for each file."""
    columns = {n: (setup.channels[n].column or n, setup.channels[n].index) for n in names}
    arrays: dict[str, list[Floats]] = {name: [] for name in names}
    count = 0
    for file in setup.file:
        pieces_of: dict[str, list[Floats]] = {name: [] for name in names}
        for piece in pieces(Path(file), columns, setup):
            for name, x in piece.items():
                pieces_of[name].append(np.ascontiguousarray(x))
            count += len(x) * len(piece)
            if count > MOST_VALUES:
                allowed = f"{MOST_VALUES:g} at most; name fewer channels"
                raise input_error(file, "too many values", allowed)
        for name in names:
            parts = pieces_of.pop(name)  # freed as it is joined
            arrays[name].append(np.concatenate(parts) if parts else np.empty(0))
            del parts
    rows = sum(map(len, arrays[names[0]]))
    if rows < FEWEST:
        raise input_error(setup.file[0], f"{rows} values", f"{FEWEST} at least")
    return arrays


def _channel(
    name: str, setup: MeasurementFile, x: Floats, clock: Clock, remarks: list[str]
) -> Floats:
    """Return a channel at the equal time steps, in SI, with railsim's sign."""
    channel = setup.channels[name]
    x = np.where(np.isinf(x), np.nan, x)
    for value in setup.missing:
        x[np.abs(x - value) <= SINGLE * abs(value)] = np.nan
    if channel.range is not None:
        low, high = channel.range
        outside = (x <= low + SINGLE * abs(low)) | (x >= high - SINGLE * abs(high))
        if outside.any():
            remarks.append(f"{name}: {outside.sum()} values at the ends of its range left out.")
            x[outside] = np.nan
    elif clipped := _clipped(x):
        remarks.append(f"{name} {clipped}: give its range to leave these values out.")
    finite = x[np.isfinite(x)]
    if channel.quantity not in AXES and len(finite) and finite.min() == finite.max():
        remarks.append(f"{name} is {finite[0]:g} from its first value to its last: a dead sensor?")
    x = clock.on_grid(channel.factor * (x - channel.offset))
    if channel.delay:
        x = delayed(x, channel.delay * clock.rate)
    x = bridged(x, round(setup.longest_gap * clock.rate))
    missing = float(np.mean(np.isnan(x)))
    if missing and channel.quantity not in AXES:
        remarks.append(f"{name}: {100.0 * missing:.3g} % of the values are missing.")
    return x


def _zeroed(path: str, name: str, setup: MeasurementFile, x: Floats, time: Floats) -> Floats:
    """Return a channel without its mean between the times of `zero`."""
    zero = setup.channels[name].zero
    if zero is None:
        return x
    inside = (time >= zero[0]) & (time <= zero[1]) & np.isfinite(x)
    if not inside.any():
        found = f"no value between {zero[0]:g} and {zero[1]:g} s"
        allowed = f"times from {time[0]:g} to {time[-1]:g} s"
        raise input_error(path, found, allowed, key=f"channels.{name}.zero")
    return np.asarray(x - x[inside].mean())


def _clipped(x: Floats) -> str:
    """Return how often a channel rests at its largest or smallest value, if it looks clipped."""
    finite = x[np.isfinite(x)]
    if len(finite) < FEWEST or finite.min() == finite.max():
        return ""
    for value, word in ((finite.max(), "largest"), (finite.min(), "smallest")):
        lengths = [end - begin for begin, end in stretches(finite == value)]
        if sum(length >= EQUAL_ENDS for length in lengths) >= OFTEN and value != 0.0:
            return f"rests {len(lengths)} times at its {word} value {value:g} and looks clipped"
    return ""


def _implausible(setup: MeasurementFile, name: str, x: Floats) -> list[Fault]:
    """Return what no vehicle can do: mostly a wrong unit."""
    quantity = setup.channels[name].quantity
    magnitudes = np.abs(x[np.isfinite(x)])
    kind = quantity_of(quantity)
    if not len(magnitudes) or kind is None:
        return []
    largest, base = float(magnitudes.max()), quantity.partition(":")[0]
    key = f"channels.{name}"
    if largest > LARGEST.get(base, np.inf):
        found = f"{largest:.4g} {kind.unit}"
        allowed = f"{LARGEST[base]:g} {kind.unit} at most; 'unit', 'range' or 'missing'?"
        return [Fault(setup.file[0], key, found, allowed)]
    if 0.0 < largest < SMALLEST.get(base, 0.0):
        found = f"{largest:.4g} {kind.unit} at most"
        return [Fault(setup.file[0], key, found, "larger values; is its 'unit' another?")]
    return []


def _measurement(
    path: str, setup: MeasurementFile, clock: Clock, values: dict[str, Floats], remarks: list[str]
) -> Measurement:
    axes = {
        setup.channels[name].quantity: _zeroed(path, name, setup, values.pop(name), clock.time)
        for name in list(values)
        if setup.channels[name].quantity in ("distance", "mileage", "speed")
    }
    mileage = None
    if "mileage" in axes and setup.track is not None:
        track = load_track(setup.track)
        mileage = track.mileage, track.falling_mileage
    s, speed, position_remarks = position(path, setup, clock.time, axes, mileage)
    values = _without_mounting(path, setup, values, remarks)
    values = {name: _zeroed(path, name, setup, x, clock.time) for name, x in values.items()}
    return Measurement(setup, clock.time, s, speed, values, (*remarks, *position_remarks))


def _without_mounting(
    path: str, setup: MeasurementFile, values: dict[str, Floats], remarks: list[str]
) -> dict[str, Floats]:
    """Return the channels with the accelerations at points of `mounting` turned back.

    A sensor turned by the small angles p reads f' = f - p x f in its own axes, f = a - g; so
    f' + p x f' is what it would read along those of the body.  Axes that are not measured count
    as zero acceleration; of gravity a high pass leaves nothing.
    """
    corrected = dict(values)
    by_quantity = {setup.channels[name].quantity: name for name in values}
    for point, angles in setup.mounting.items():
        quantities = {axis: f"sensor_acceleration:{point}:{axis}" for axis in "xyz"}
        names = {axis: by_quantity[q] for axis, q in quantities.items() if q in by_quantity}
        if not names:
            allowed = "a point with channels of sensor_acceleration"
            raise input_error(path, "no channel there", allowed, key=f"mounting.{point}")
        still = np.zeros(len(next(iter(values.values()))))
        read = [values[names[axis]] if axis in names else still for axis in "xyz"]
        turned = np.cross(np.array(angles), np.stack(read, axis=-1))
        # what is taken out of the reading at rest
        at_rest = np.cross(np.array(angles), np.array([0.0, 0.0, -GRAVITY]))
        for k, axis in enumerate("xyz"):
            if axis in names:
                constant = 0.0 if setup.channels[names[axis]].high_pass else at_rest[k]
                corrected[names[axis]] = values[names[axis]] + turned[:, k] + constant
        if missing := [axis for axis in "xyz" if axis not in names]:
            remarks.append(f"{point}: {', '.join(missing)} is not measured, taken as zero.")
    return corrected
