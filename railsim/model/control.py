"""Signals and controllers of a vehicle as the arrays of its model, for runs alone.

Analyses know the vehicle without them, its actuators without commands; what a run adds is added
here, when everything else is prepared.
"""

import math
import zlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railsim.definitions import Settings, Vehicle
from railsim.definitions.vehicle.laws import BODY_SIGNALS, Controller, Signal
from railsim.errors import Fault, InputError, argument_error, nearest
from railsim.kernels import actuators as acts
from railsim.kernels import controllers as kernel
from railsim.kernels import element_columns as layout
from railsim.kernels import element_outputs as element
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.control_records import Controllers, Signals
from railsim.laws.binding import Takes, bind
from railsim.model.assembly import Model
from railsim.model.element_arrays import SLOT, LawBlocks
from railsim.notation import COMPONENTS, QUANTITIES, REQUESTED

OF_POINTS = kernel.POINT_POSITION, kernel.POINT_VELOCITY, kernel.POINT_ACCELERATION
OF_BODY = dict(zip(BODY_SIGNALS, (*OF_POINTS, kernel.BODY_ANGLE, kernel.BODY_RATE), strict=True))
OF_RUN = {
    "speed": kernel.TRAVEL_SPEED,
    "distance": kernel.TRAVEL_DISTANCE,
    "time": kernel.TRAVEL_TIME,
    "speed_change": kernel.TRAVEL_ACCELERATION,
}
OF_ELEMENT = {
    "deflection": element.DEFLECTION,
    "rate": element.RATE,
    "force": element.FORCE,
    "power": element.POWER,
}


def check_command(vehicle: Vehicle, key: str, name: str, actuators: Sequence[str]) -> None:
    """Raise InputError where `name` is no actuator, or one that a controller commands."""
    for by, controller in (vehicle.controllers or {}).items():
        if name in controller.outputs:
            raise argument_error(key, f"'{name}', which controllers.{by} commands", "another one")
    if name not in actuators:
        allowed = nearest(str(name), actuators) if actuators else "the vehicle has none"
        raise argument_error(key, f"no actuator '{name}'", allowed)


def periods(vehicle: Vehicle) -> list[float]:
    """Periods of all controllers and signals [s]."""
    return [c.period for c in (vehicle.controllers or {}).values()] + [
        1.0 / s.rate for s in (vehicle.signals or {}).values() if s.rate is not None
    ]


def with_control(model: Model, vehicle: Vehicle, settings: Settings) -> Model:
    """Return the model with the vehicle's signals and controllers.

    Raises InputError: names that mean nothing or two things; a law that is not permitted or cannot
    be compiled; a step of the settings longer than a controller's period or between two samples.
    """
    if not vehicle.signals and not vehicle.controllers:
        return model
    wiring = _Wiring(model, vehicle)
    quantities = {*QUANTITIES, *REQUESTED, *(settings.outputs.own or {})}
    step = settings.step or 0.0  # one that is chosen is not longer than any of these
    for name, signal in (vehicle.signals or {}).items():
        same = name == signal.quantity and name in QUANTITIES and signal.side is None
        if name in quantities and not same:  # `Simulation.read` knows both by their names
            wiring.fault(f"signals.{name}", "the name of a quantity of results", "another name")
        if step * (signal.rate or 0.0) > 1.0 + 1e-9:
            found = f"found {signal.rate:.12g} 1/s, faster than the step of the settings"
            wiring.fault(f"signals.{name}.rate", found, f"{1.0 / step:.12g} 1/s at most")
    for name, controller in (vehicle.controllers or {}).items():
        if controller.period < step * (1.0 - 1e-9):
            found = f"found {controller.period:.12g} s, shorter than the step of the settings"
            wiring.fault(f"controllers.{name}.period", found, f"{step:.12g} s at least")
    return wiring.model()


class _Wiring:
    """Signals and controllers on their way to arrays; faults are gathered."""

    def __init__(self, model: Model, vehicle: Vehicle) -> None:
        self._model, self._vehicle = model, vehicle
        self._blocks = LawBlocks()
        self._blocks.memory = model.system.user_laws.memory.tolist()
        self._blocks.address = model.system.user_laws.addresses.tolist()
        self._acts = model.system.actuators.codes.copy()
        self._faults: list[Fault] = []
        self._wires: list[int] = []
        self._commanded: dict[str, str] = {}  # controllers by their actuators

    def fault(self, key: str, found: str, allowed: str) -> None:
        """Take note of what is wrong at a key of the vehicle."""
        self._faults.append(Fault(f"vehicle '{self._vehicle.name}'", key, found, allowed))

    def model(self) -> Model:
        """Return the model with all of it."""
        signals, controllers = self._vehicle.signals or {}, self._vehicle.controllers or {}
        measured = [self._signal(name, signal) for name, signal in signals.items()]
        which = [self._controller(name, one) for name, one in controllers.items()]
        if self._faults:
            raise InputError(self._faults)
        system = self._model.system._replace(
            signals=Signals(
                np.array([row for row, _ in measured], np.int64).reshape(-1, kernel.SIGNAL_CODES),
                np.array([row for _, row in measured], float).reshape(-1, kernel.SIGNAL_ROW),
            ),
            controllers=Controllers(
                np.array(which, np.int64).reshape(-1, kernel.CONTROLLER_CODES),
                np.array([one.period for one in controllers.values()], float),
                np.array(self._wires, np.int64),
            ),
            user_laws=self._blocks.as_arrays(),
            actuators=self._model.system.actuators._replace(codes=self._acts),
        )
        index = replace(self._model.index, signals=tuple(signals), controllers=tuple(controllers))
        return replace(self._model, system=system, index=index)

    def _number(self, names: Sequence[str], name: str | None, key: str, kind: str) -> int:
        if name in names:
            return names.index(name)
        allowed = nearest(str(name), names) if names else "there is none"
        self.fault(key, f"no {kind} '{name}'", allowed)
        return 0

    def _signal(self, name: str, signal: Signal) -> tuple[list[int], list[float]]:
        """Row of a signal: what it is, and how it is sampled."""
        arm = (0.0, 0.0, 0.0)
        kind, of, group, component = self._measured_signal(f"signals.{name}", signal)
        if signal.position is not None and signal.quantity in OF_BODY:
            centre = self._model.flat.bodies[of].position
            arm = tuple(np.subtract(signal.position, centre).tolist())
        period = 1.0 / signal.rate if signal.rate else 0.0
        slots = math.ceil(signal.delay / period - 1e-9) + 2 if period else 0
        # by the name as well: signals of one seed have noise of their own
        seed = signal.seed, zlib.crc32(name.encode())
        dice = np.random.default_rng(seed).integers(1, 30000, 3).astype(float)
        base = self._blocks.room([0.0, 0.0, *dice, *([0.0] * slots)])
        how = (period, signal.delay, signal.noise, signal.resolution, signal.ahead)
        return [kind, of, group, component, base, slots], [*arm, *how]

    def _measured_signal(self, key: str, signal: Signal) -> tuple[int, int, int, int]:
        """Kind, body or element or wheelset, group or side, and component of a signal."""
        index, quantity = self._model.index, signal.quantity
        axis = COMPONENTS.index(signal.axis) if signal.axis else 0
        if quantity in OF_BODY:
            body = self._number(index.bodies, signal.body, f"{key}.body", "body")
            return OF_BODY[quantity], body, 0, axis % 3
        if quantity in OF_ELEMENT:
            groups = (index.links, index.mounts, index.actuators)
            known = [name for names in groups for name in names]
            self._number(known, signal.element, f"{key}.element", "element")
            component = OF_ELEMENT[quantity] + (0 if quantity == "power" else axis)
            for group, names in enumerate(groups):
                if signal.element in names:
                    number = names.index(signal.element)
                    own = self._axes(group, number, quantity)
                    if quantity != "power" and signal.axis not in own:
                        found = f"found {signal.axis or 'none'}; {signal.element} acts elsewhere"
                        self.fault(f"{key}.axis", found, " or ".join(a or "none" for a in own))
                    return kernel.ELEMENT, number, group, component
        if signal.wheelset is not None:
            w = self._number(index.wheelsets, signal.wheelset, f"{key}.wheelset", "wheelset")
            if quantity == "wheel_speed":
                return kernel.WHEEL_SPEED, int(self._model.system.contact.body[w]), 0, 0
            return kernel.WHEEL, w, int(signal.side == "right"), W_Q if quantity == "Q" else W_Y
        if quantity in OF_RUN:
            return kernel.TRAVEL, 0, 0, OF_RUN[quantity]
        return (kernel.CURVATURE if quantity == "curvature" else kernel.CANT), 0, 0, 0

    def _axes(self, group: int, number: int, quantity: str) -> tuple[str | None, ...]:
        """Axes in which an element has a deflection, or a force; a line is that of none."""
        action = self._acts[number, acts.ACTION] if group == kernel.ACTUATOR else acts.LINE
        if group == element.MOUNT:
            mounts = self._model.system.mounts
            value = {name: mounts.row[number, at] for name, at in layout.MOUNT_COLUMNS.items()}
            along = np.any([value[n] for n in ("stiffness", "damping", "preload")], axis=0)
            along[mounts.law[mounts.law[:, 0] == number, 1]] = True
            # of K_d, see `rotation_potential`
            about = value["rotation"].sum() - value["rotation"] + value["rotation_damping"]
            own = [*along, *about]
            if quantity != "force":
                own = [mounts.flags[number, layout.TRANSLATES]] * 3 + [True] * 3
            return (None,) * bool(own[0]) + tuple(
                a for a, on in zip(COMPONENTS, own, strict=True) if on
            )
        if action == acts.LINE:
            return (None, "x")
        return (COMPONENTS[4 if action == acts.AXLE else action - acts.ALONG],)

    def _controller(self, name: str, controller: Controller) -> list[int]:
        """Row of a controller."""
        key, begin, laws = f"controllers.{name}", len(self._wires), self._vehicle.laws or {}
        for output in controller.outputs:
            actuators = self._model.index.actuators
            self._wires.append(i := self._number(actuators, output, f"{key}.outputs", "actuator"))
            if actuators and controller.period < SLOT:  # more commands may be on their way
                delay = self._model.system.actuators.row[i, acts.DELAY]
                row = self._blocks.command(delay, controller.period)
                self._acts[i, acts.COMMAND : acts.SLOTS + 1] = row
            if output in self._commanded:
                found = f"found '{output}', which controllers.{self._commanded[output]} commands"
                self.fault(f"{key}.outputs", found, "each actuator once")
            self._commanded[output] = name
        for argument, signal in controller.inputs.items():
            signals = tuple(self._vehicle.signals or {})
            self._wires.append(self._number(signals, signal, f"{key}.inputs.{argument}", "signal"))
        if controller.law not in laws:
            self._number(tuple(laws), controller.law, f"{key}.law", "law")
        if self._faults:
            return [0] * kernel.CONTROLLER_CODES
        gives, takes, kept = len(controller.outputs), len(controller.inputs), controller.memory or 0
        given = Takes("a controller", ("time",), tuple(controller.inputs))
        bound = bind(controller.law, laws[controller.law], given, gives, kept)
        values = bound.parameters(f"{key}.parameters", controller.parameters)
        block = self._blocks.room([0.0] * (gives + 1 + takes) + values + [0.0] * kept)
        return [self._blocks.law(bound), block, gives, takes, begin, self._blocks.room([0.0])]
