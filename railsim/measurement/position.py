"""Arc length and speed of a measured run, from distance, mileage or speed.

A counter of distance has coarse steps: between the places where it moves on it is linear.  Where
speed and distance are both measured they are held against each other: what differs is said.
"""

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.measurement import MeasurementFile
from railsim.errors import input_error

Origin = tuple[float, bool]  # mileage of s = 0 [m], and whether it falls
BACKWARDS = 1.0  # m, by which a counter may step back
APART = 0.002  # of the distance: remarked on
SPEEDS = 0.1, 170.0  # m/s, of a run in the mean
WRONG = 0.5  # of the distance: refused


def position(
    file: str, setup: MeasurementFile, time: Floats, axes: dict[str, Floats], mileage: Origin | None
) -> tuple[Floats, Floats, list[str]]:
    """Return arc length [m], speed [m/s] and remarks of a run.

    `file`: for messages; `time`: equal steps [s]; `axes`: ``distance``, ``mileage``, ``speed`` over
    time, as far as they are measured [SI]; `mileage`: that of s = 0 of the track and whether it
    falls, where the track is known. Raises InputError: a distance that does not rise; distance and
    speed that contradict each other.
    """
    remarks: list[str] = []
    step = (time[-1] - time[0]) / (len(time) - 1)
    speed = axes.get("speed")
    if speed is None and setup.speed is not None and not {"distance", "mileage"} & {*axes}:
        speed = np.full(len(time), setup.speed)
    driven = None
    if speed is not None:
        speed = _without_gaps(file, "speed", time, speed, remarks)
        driven = np.concatenate([[0.0], np.cumsum(0.5 * step * (speed[1:] + speed[:-1]))])
    counter = axes.get("distance")
    if counter is None and "mileage" in axes:
        counter = axes["mileage"]
        finite = counter[np.isfinite(counter)]
        way = float(finite[-1] - finite[0]) if len(finite) else 0.0
        falls = way < 0.0 if mileage is None else mileage[1]
        if (way > 0.0) if falls else (way < 0.0):
            trend = ("rises", "falls") if falls else ("falls", "rises")
            allowed = f"as on the track, where it {trend[1]}; for a run in the other direction the "
            allowed += "track file from its other end"
            raise input_error(file, trend[0], allowed, key="mileage")
        origin = finite[0] if mileage is None and len(finite) else (mileage or (0.0,))[0]
        counter = (-1.0 if falls else 1.0) * (counter - origin)
        if mileage is None:
            counter = counter + setup.start
    if counter is None:
        assert driven is not None  # by the definition
        assert speed is not None
        return setup.start + driven, speed, remarks
    s = _rising(file, time, counter, remarks)
    if driven is None or speed is None:
        mean = float((s[-1] - s[0]) / (time[-1] - time[0]))
        if not SPEEDS[0] <= mean <= SPEEDS[1]:
            found = f"{mean:.3g} m/s from {s[-1] - s[0]:.6g} m in {time[-1] - time[0]:.6g} s"
            allowed = f"{SPEEDS[0]:g} to {SPEEDS[1]:g} m/s; the 'unit' of distance or time?"
            raise input_error(file, found, allowed, key="distance")
        return s, np.gradient(s, step), remarks
    share = (s[-1] - s[0]) / driven[-1] - 1.0 if driven[-1] > 0.0 else np.inf
    if not abs(share) < WRONG:
        found = f"{s[-1] - s[0]:.6g} m by distance, {driven[-1]:.6g} m by speed"
        raise input_error(file, found, "the same; are the units right?", key="speed")
    if abs(share) > APART:
        remarks.append(
            f"Distance and speed differ by {100 * share:+.2f} % ({s[-1] - s[0]:.1f} m by "
            f"distance, {driven[-1]:.1f} m by speed); the distance is used."
        )
    return s, speed, remarks


def _without_gaps(file: str, name: str, time: Floats, x: Floats, remarks: list[str]) -> Floats:
    valid = np.isfinite(x)
    if valid.sum() < 2:
        raise input_error(file, "no values", "a channel with values", key=name)
    if not valid.all():
        remarks.append(f"The {name} has gaps ({100 * np.mean(~valid):.3g} %): linear over them.")
        x = np.interp(time, time[valid], x[valid])
    if name == "speed" and x.min() < -0.1:
        raise input_error(file, f"{x.min():.3g} m/s", "speeds forwards; 'reverse'?", key=name)
    return x


def _rising(file: str, time: Floats, counter: Floats, remarks: list[str]) -> Floats:
    s = _without_gaps(file, "distance", time, counter, remarks)
    highest = np.maximum.accumulate(s)
    fall = float(np.max(highest - s))
    if fall > BACKWARDS or s[-1] <= s[0]:
        found = f"falls by {fall:.3g} m" if s[-1] > s[0] else "does not rise"
        allowed = "a distance that rises; a mileage may fall (quantity = 'mileage')"
        raise input_error(file, found, allowed, key="distance")
    moving = np.concatenate([[True], np.diff(highest) > 0.0])
    if not moving.all():
        s = np.interp(time, time[moving], s[moving])
        last = time[moving][-1]
        tail = ~moving & (time > last)
        if tail.any():  # less than a further step of the counter: the vehicle may stand
            further = float(s[moving][-1] - s[moving][-2])
            speed = min((s[moving][-1] - s[0]) / (last - time[0]), further / (time[-1] - last))
            s[tail] += speed * (time[tail] - last)
    return s
