"""Force elements of a vehicle as rows of arrays (see `railsim.kernels.system`).

Every element says itself what it becomes (`railsim.definitions.elements.rows`); here the rows get
their places, with internal states where a force has a memory.  A mount's point on body 1 is the
location of its point on body 2 in the nominal position, reached rigidly: the deflection is zero
there.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.arrays import Floats, Integers
from railsim.definitions.elements.base import two_sided
from railsim.definitions.elements.rows import (
    AXES,
    NOTHING,
    Act,
    Drive,
    FrictionLimit,
    Link,
    Load,
    Mount,
    Rows,
    State,
    Triple,
)
from railsim.definitions.vehicle.flatten import FlatBody, FlatElement
from railsim.definitions.vehicle.laws import Law
from railsim.kernels import actuators as acts
from railsim.kernels import element_columns as layout
from railsim.kernels.alignment import aligned_zeros
from railsim.kernels.control_records import Actuators, UserLaws
from railsim.kernels.internal import AIR, LAG, MAXWELL, MAXWELL_CURVE, PAD, USER, Internal
from railsim.kernels.system import Curves, Drives, Links, Loads, Mounts
from railsim.laws.binding import FORCE_ELEMENT, Bound, bind_use

LAWS = {"maxwell": MAXWELL, "maxwell_curve": MAXWELL_CURVE, "pad": PAD, "air": AIR}
LAWS |= {"lag": LAG, "own": USER}
MODES = {"force": acts.BY_FORCE, "damper": acts.BY_DAMPER, "position": acts.BY_POSITION}
MODES |= {"law": acts.BY_LAW, "brake": acts.BY_BRAKE}
ACTIONS = {axis: acts.ALONG + k for k, axis in enumerate(AXES)}
ACTIONS |= {"line": acts.LINE, "axle": acts.AXLE}
SLOT = 2.5e-4
"""Commands on their way to an actuator may follow each other by so much [s]."""


def rotation_potential(stiffness: Sequence[float]) -> Triple:
    """K_d of U = tr(K_d (1 - R)) that gives the stiffnesses about x, y, z for small angles.

    The moment about axis i is (sum(K_d) - K_d,i) theta_i, hence K_d,i = sum(k)/2 - k_i.

    `stiffness`: k_x, k_y, k_z [N m/rad]. Returns: K_d [N m]; entries may be negative.

    >>> rotation_potential((4.0, 2.0, 0.0))
    (-1.0, 1.0, 3.0)
    """
    half = 0.5 * sum(stiffness)
    return half - stiffness[0], half - stiffness[1], half - stiffness[2]


class LawBlocks:
    """Numbers of commands, signals and laws of one's own, as `Work.memory` begins with them.

    `laws`: laws by name, compiled where an element has one; None leaves these elements out.
    """

    def __init__(self, laws: Mapping[str, Law] | None = None) -> None:
        self.laws = laws
        self.memory: list[float] = [0.0]  # the time of the begin
        self.address: list[int] = []

    def room(self, values: Sequence[float]) -> int:
        """Where these numbers stand."""
        self.memory.extend(values)
        return len(self.memory) - len(values)

    def command(self, delay: float, apart: float = SLOT) -> tuple[int, int, int]:
        """Place of last and largest command, of those on their way, how many these may be."""
        place, slots = self.room([0.0, 0.0]), 0
        if delay > 0.0:
            slots = math.ceil(delay / min(apart, SLOT)) + 4
        return place, self.room([0.0] * (1 + 2 * slots)) if slots else -1, slots

    def element_law(self, name: str, act: Act) -> tuple[int, int, int]:
        """Number of a law, place of its block and number of its states."""
        bound, values = bind_use("vehicle", f"elements.{name}", act, self.laws, FORCE_ELEMENT)
        block = [0.0] * (1 + bound.states + acts.LAW_INPUTS + bound.states)
        return self.law(bound), self.room([*block, *values]), bound.states

    def law(self, bound: Bound) -> int:
        """Return the number of a law."""
        if bound.address not in self.address:
            self.address.append(bound.address)
        return self.address.index(bound.address)

    def as_arrays(self) -> UserLaws:
        """As arrays."""
        return UserLaws(np.array(self.address, np.int64), np.array(self.memory, float))


@dataclass
class ElementArrays:
    """Collects elements row by row until the arrays are made."""

    bodies: Mapping[str, FlatBody]  # all, by name, in the order of their indices
    link_rows: list[dict[str, Any]] = field(default_factory=list)
    mount_rows: list[dict[str, Any]] = field(default_factory=list)
    load_rows: list[dict[str, Any]] = field(default_factory=list)
    drive_rows: list[dict[str, Any]] = field(default_factory=list)
    act_rows: list[dict[str, Any]] = field(default_factory=list)
    own: LawBlocks = field(default_factory=LawBlocks)
    internal_rows: list[tuple[int, Triple, int]] = field(default_factory=list)
    curve_rows: list[Floats] = field(default_factory=list)

    def add(self, element: FlatElement) -> None:
        """Append what one element becomes to the rows of its groups."""
        for row in element.definition.rows():
            match row:
                case Link():
                    self.link_rows.append(self._link(element, row))
                case Mount():
                    self.mount_rows.append(self._mount(element, row))
                case Load():
                    self.load_rows.append(self._load(element, row))
                case Drive():
                    self.drive_rows.append(self._drive(element, row))
                case Act() if row.mode != "law" or self.own.laws is not None:
                    self.act_rows.append(self._act(element, row))

    def _link(self, element: FlatElement, link: Link) -> dict[str, Any]:
        point1, point2 = np.array(element.point1), np.array(element.point2)
        damper_curve = self._curve(link.damper_table)
        return {
            "name": element.name,
            "body": self._pair(element),
            **self._levers(element, point1, point2),
            "length": float(np.linalg.norm(point2 - point1)),
            "stiffness": link.stiffness,
            "damping": link.damping,
            "preload": link.preload,
            "internal": self._state(link.state),
            "curve": (self._curve(link.spring_table), damper_curve),
        }

    def _mount(self, element: FlatElement, mount: Mount) -> dict[str, Any]:
        point1, point2 = np.array(element.point1), np.array(element.point2)
        point = 0.5 * (point1 + point2) if mount.both_ends else point2
        rotates = any(mount.rotation) or any(mount.rotation_damping)
        friction = layout.ONE_SIDED if mount.one_sided else int(mount.friction is not None)
        limits = mount.friction or (FrictionLimit(),) * 3
        return {
            "name": element.name,
            "body": self._pair(element),
            **self._levers(element, point, point),
            "share": (0.5, 0.5) if mount.both_ends else (float(mount.translates), 0.0),
            "stiffness": mount.stiffness,
            "damping": mount.damping,
            "preload": mount.preload,
            "rotation": rotation_potential(mount.rotation),
            "rotation_damping": mount.rotation_damping,
            "friction": [(f.force, f.coefficient, f.ratio, f.speed) for f in limits],
            "internal": [self._state(state) for state in mount.states],
            "curve": [self._curve(table) for table in mount.tables],
            "flags": (mount.translates, mount.both_ends, rotates, friction),
        }

    def _drive(self, element: FlatElement, drive: Drive) -> dict[str, Any]:
        torque = np.array(drive.torque_table, dtype=float)
        demand = np.array(drive.demand_table or (), dtype=float).reshape(-1, 2)
        row = drive.brakes, drive.over_distance, *(drive.slip_control or (0.0, 0.0))
        return {"body": self._pair(element), "row": row, "tables": (torque, demand)}

    def _act(self, element: FlatElement, act: Act) -> dict[str, Any]:
        point1, point2 = np.array(element.point1), np.array(element.point2)
        line = act.action == "line"
        levers = self._levers(element, point1 if line else point2, point2)
        command, queue, slots = self.own.command(act.delay)
        lag = State("lag", (act.lag, act.rate_limit or np.inf, 0.0)) if act.lag > 0.0 else None
        lagging = self._state(lag)
        law, block, states = -1, -1, 0
        if act.mode == "law":
            law, block, states = self.own.element_law(element.name, act)
        first = len(self.internal_rows)
        for _ in range(states):
            self._state(State("own", NOTHING))
        of_command = ACTIONS[act.action], MODES[act.mode], lagging, command, queue, slots
        length = float(np.linalg.norm(point2 - point1))
        limits = (act.force_limit, act.power_limit, act.stroke)
        most = (np.inf if limit is None else limit for limit in limits)
        where = *levers["point_1"], *levers["point_2"], length, act.sense
        return {
            "name": element.name,
            "body": self._pair(element),
            "codes": (*of_command, law, block, first, states),
            "row": (*where, *most, act.stiffness, act.damping, act.delay),
        }

    def _load(self, element: FlatElement, load: Load) -> dict[str, Any]:
        return {
            "body": self._number(element.body1),
            "point": np.array(element.point1) - self._centre(element.body1),
            "flags": (load.is_torque, load.track_axes, load.over_distance),
            "table": np.array(load.table, dtype=float),
        }

    def _number(self, name: str) -> int:
        return list(self.bodies).index(name)

    def _pair(self, element: FlatElement) -> tuple[int, int]:
        return self._number(element.body1), self._number(element.body2)

    def _levers(self, element: FlatElement, point1: Floats, point2: Floats) -> dict[str, Floats]:
        centre1, centre2 = self._centre(element.body1), self._centre(element.body2)
        return {"point_1": point1 - centre1, "point_2": point2 - centre2}

    def _centre(self, name: str) -> Floats:
        # an axlebox turns about its axle: its levers count from the wheelset's centre
        parent = self.bodies[name].parent
        return np.array(self.bodies[parent or name].position)

    def _state(self, state: State | None) -> int:
        if state is None:
            return -1
        curve = self._curve(state.table)
        self.internal_rows.append((LAWS[state.law], state.parameter, curve))
        return len(self.internal_rows) - 1

    def _curve(self, table: Rows | None) -> int:
        if table is None:
            return -1
        self.curve_rows.append(np.array(two_sided(table)))
        return len(self.curve_rows) - 1

    def arrays(self) -> dict[str, Any]:
        """Arrays of all elements, by the fields of a `System`.

        Mounts of one kind come together: what none of a block of eight has is skipped.
        """
        self.mount_rows.sort(key=_kind_of_mount)
        points = np.concatenate([np.zeros((0, 2)), *self.curve_rows])
        loads = [row["table"] for row in self.load_rows]
        drives = [table for row in self.drive_rows for table in row["tables"]]
        return {
            "links": Links(
                row=_table(self.link_rows, layout.LINK_COLUMNS, layout.LINK_SIZE),
                **_columns(self.link_rows, np.int64, body=(2,), internal=(), curve=(2,)),
            ),
            "mounts": self._mounts(),
            "curves": Curves(
                start=_starts(self.curve_rows),
                x=np.ascontiguousarray(points[:, 0]),
                f=np.ascontiguousarray(points[:, 1]),
            ),
            "internal": Internal(
                kind=np.array([row[0] for row in self.internal_rows], dtype=np.int64),
                parameter=np.array([row[1] for row in self.internal_rows], float).reshape(-1, 3),
                curve=np.array([row[2] for row in self.internal_rows], dtype=np.int64),
            ),
            "loads": Loads(
                start=_starts(loads),
                table=np.concatenate([np.zeros((0, 4)), *loads]),
                **_columns(self.load_rows, np.int64, body=(), flags=(3,)),
                **_columns(self.load_rows, float, point=(3,)),
            ),
            "drives": Drives(
                start=_starts(drives),
                table=np.concatenate([np.zeros((0, 2)), *drives]),
                **_columns(self.drive_rows, np.int64, body=(2,)),
                **_columns(self.drive_rows, float, row=(4,)),
            ),
            "actuators": Actuators(
                **_columns(self.act_rows, np.int64, body=(2,), codes=(acts.CODES_SIZE,)),
                **_columns(self.act_rows, float, row=(acts.ROW_SIZE,)),
            ),
            "user_laws": self.own.as_arrays(),
        }

    def _mounts(self) -> Mounts:
        whole = {"body": (2,), "internal": (3,), "curve": (3,), "flags": (4,)}
        columns = _columns(self.mount_rows, np.int64, **whole)
        friction = _columns(self.mount_rows, float, friction=(3, 4))["friction"]
        return Mounts(
            row=_table(self.mount_rows, layout.MOUNT_COLUMNS, layout.MOUNT_SIZE),
            friction=friction,
            law=layout.nonlinear_axes(columns["internal"], columns["curve"], columns["flags"]),
            falling=layout.stribeck_mounts(friction),
            **columns,
        )


def _kind_of_mount(row: dict[str, Any]) -> tuple[bool, ...]:
    has_law = max(*row["internal"], *row["curve"]) >= 0
    return (not has_law, *(bool(flag) for flag in row["flags"][1:3]))


def _starts(tables: Sequence[Floats]) -> Integers:
    return np.concatenate([[0], np.cumsum([len(table) for table in tables])]).astype(np.int64)


def _table(rows: list[dict[str, Any]], columns: Mapping[str, slice], size: int) -> Floats:
    """Values of all names in their columns, one row an element."""
    table = aligned_zeros((len(rows), size))
    for row, values in zip(table, rows, strict=True):
        for name, span in columns.items():
            row[span] = values[name]
    return table


def _columns(
    rows: list[dict[str, Any]], dtype: type, **shapes: tuple[int, ...]
) -> dict[str, NDArray[Any]]:
    """Values of some names as arrays, one row an element."""
    return {
        name: np.array([row[name] for row in rows], dtype=dtype).reshape(len(rows), *shape)
        for name, shape in shapes.items()
    }
