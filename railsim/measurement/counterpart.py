"""The simulated counterparts of measured channels: which there are, how a run outputs them."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from railsim.arrays import Complexes, Floats
from railsim.definitions.measurement import AXES, Channel
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.errors import Fault, Faults, nearest
from railsim.measurement.data import Measurement
from railsim.notation import COMPONENTS, QUANTITIES, REQUESTED, SIDES
from railsim.result import Result
from railsim.result.filters import filtered
from railsim.result.sensors import READINGS, all_sensors

RESTS = 1e-9  # change over the largest value up to which a channel rests


def counterparts(measurement: Measurement) -> dict[str, str]:
    """Return the channels that a vehicle has a counterpart of: their quantities by names."""
    return {n: q for n, q in measurement.quantities.items() if q not in AXES}


def rests(x: Floats) -> bool:
    """Return whether a channel does not change, as of a dead sensor; NaN where it has no value."""
    finite = x[np.isfinite(x)]
    return not len(finite) or bool(np.ptp(finite) <= RESTS * np.abs(finite).max())


def check_channels(file: str, measurement: Measurement, vehicle: Vehicle) -> None:
    """Refuse channels of points, wheelsets, bodies and elements that a vehicle does not have.

    Raises InputError: all of them at once.
    """
    flat = flatten(vehicle)
    wheelsets = [body.name for body in flat.of_kind("wheelset")]
    numbers = [str(number + 1) for number in range(len(wheelsets))]
    labels_of = {
        "wheelset": [*wheelsets, *numbers],
        "side": SIDES,
        "axis": COMPONENTS[:3],
        "component": COMPONENTS,
        "body": [body.name for body in flat.bodies],
        "sensor": list(all_sensors(vehicle)),
        "element": [element.name for element in flat.elements],
    }
    faults = Faults()
    for name, selection in counterparts(measurement).items():
        base, *labels = selection.split(":")
        quantity = QUANTITIES.get(base) or REQUESTED[base]
        for dim, label in zip(quantity.dims[1:], labels, strict=True):
            if label not in labels_of.get(dim, [label]):
                found = f"{vehicle.name} has no {dim} '{label}'"
                key = f"channels.{name}.quantity"
                faults.append(Fault(file, key, found, nearest(label, labels_of[dim])))
    faults.check()


def outputs_for(selections: Iterable[str]) -> dict[str, Any]:
    """Return the table `outputs` of settings for some quantities with labels."""
    names = [selection.split(":") for selection in selections]
    bases = {name[0] for name in names}
    outputs: dict[str, Any] = {}
    for base in sorted(bases & {*REQUESTED}):
        request = REQUESTED[base].request
        if request == "elements":
            outputs["elements"] = sorted({n[1] for n in names if n[0].startswith("element_")})
        elif request == "sensors":
            only = all(b in READINGS for b in bases if b.startswith("sensor_"))
            outputs["sensors"] = "readings" if only else True
        else:
            outputs[request] = True
    outputs["quantities"] = sorted(bases & {*QUANTITIES}) or ["distance"]
    return outputs


def series(result: Result, selection: str) -> Floats:
    """Return a quantity with labels over time, such as ``Q:1:left``; wheelsets also by number.

    Raises KeyError: the result does not have it.
    """
    name, *labels = selection.split(":")
    if name not in result:
        raise KeyError(f"no quantity '{name}'; {nearest(name, result)}")
    return result.series(name, **dict(zip(result.quantities[name].dims[1:], labels, strict=True)))


def amplifier(channel: Channel, f: Floats) -> Complexes:
    """Return the response of the filters of a channel at frequencies [Hz]."""
    from scipy import signal

    response, s = np.ones(len(f), complex), 2j * np.pi * f
    for corner, kind in ((channel.low_pass, "lowpass"), (channel.high_pass, "highpass")):
        if corner is not None:
            b, a = signal.butter(4, 2.0 * np.pi * corner, kind, analog=True)  # type: ignore[call-overload]
            response *= np.polyval(b, s) / np.polyval(a, s)
    return response


def amplified(x: Floats, rate: float, channel: Channel) -> Floats:
    """Return a series as an amplifier with the filters of a channel shows it: with its phase."""
    corners = [corner for corner in (channel.low_pass, channel.high_pass) if corner is not None]
    if not corners:
        return x
    return filtered(x, rate, lambda f: amplifier(channel, f), 6.0 / min(corners))
