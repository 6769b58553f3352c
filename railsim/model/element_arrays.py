"""Force elements of a vehicle as rows of arrays (see `railsim.kernels.system`).

Every kind of element becomes a link (point to point), a mount (three axes) or a load (given force),
with internal states where its force has a memory.  A mount's point on body 1 is the location of its
point on body 2 in the nominal position, reached rigidly: the deflection is zero there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.element_base import Element, two_sided
from railsim.definitions.flatten import FlatBody, FlatElement
from railsim.definitions.friction_elements import Friction, SideBearer, SlidingFriction, Wedge
from railsim.definitions.given_elements import AppliedForce, AxleTorque, Brake, Traction
from railsim.definitions.spring_elements import (
    Airspring,
    BumpStop,
    Bushing,
    RollBar,
    ShearSpring,
    SpringDamper,
)
from railsim.errors import ModelError
from railsim.kernels.aligned import aligned_zeros
from railsim.kernels.element_columns import (
    LINK_COLUMNS,
    LINK_SIZE,
    MOUNT_COLUMNS,
    MOUNT_SIZE,
    ONE_SIDED,
)
from railsim.kernels.internal import AIR, MAXWELL, MAXWELL_CURVE, PAD, Internal
from railsim.kernels.system import (
    Curves,
    Drives,
    Links,
    Loads,
    Mounts,
    falling_friction,
    mount_laws,
)

Floats = NDArray[np.float64]
Rows = tuple[tuple[float, float], ...]
Triple = tuple[float, float, float]

_NOTHING: Triple = (0.0, 0.0, 0.0)
_NONE = (-1, -1, -1)
_STEADY = (0.0, 0.0, 1.0, 1.0)  # friction that does not fall with the speed


def rotation_potential(stiffness: Sequence[float]) -> Triple:
    """K_d of U = tr(K_d (1 - R)) that gives the stiffnesses about x, y, z for small angles.

    The moment about axis i is (sum(K_d) - K_d,i) theta_i, hence K_d,i = sum(k)/2 - k_i.

    Parameters
    ----------
    stiffness : sequence of 3 floats
        k_x, k_y, k_z [N m/rad].

    Returns
    -------
    tuple of 3 floats
        K_d [N m]; they may be negative.

    Examples
    --------
    >>> rotation_potential((4.0, 2.0, 0.0))
    (-1.0, 1.0, 3.0)
    """
    half = 0.5 * sum(stiffness)
    return half - stiffness[0], half - stiffness[1], half - stiffness[2]


@dataclass
class ElementArrays:
    """Collects elements row by row until the arrays are made.

    Attributes
    ----------
    bodies : mapping of str to FlatBody
        All bodies by name, in the order of their indices.
    """

    bodies: Mapping[str, FlatBody]
    link_rows: list[dict[str, Any]] = field(default_factory=list)
    mount_rows: list[dict[str, Any]] = field(default_factory=list)
    load_rows: list[dict[str, Any]] = field(default_factory=list)
    drive_rows: list[dict[str, Any]] = field(default_factory=list)
    internal_rows: list[tuple[int, Triple, int]] = field(default_factory=list)
    curve_rows: list[Floats] = field(default_factory=list)

    def add(self, element: FlatElement) -> None:
        """Append one element to the rows of its group."""
        law = element.definition
        if isinstance(law, SpringDamper):
            self._add_link(element, law)
        elif isinstance(law, AppliedForce):
            self._add_loads(element, law)
        elif isinstance(law, Traction | Brake):
            self._add_drive(element, law)
        else:
            self._add_mount(element, law)

    def _add_link(self, element: FlatElement, law: SpringDamper) -> None:
        point1, point2 = np.array(element.point1), np.array(element.point2)
        in_series = law.series_stiffness > 0.0
        damper_curve = self._curve(law.damper_table)
        internal = -1
        if in_series and law.damper_table is not None:
            internal = self._state(MAXWELL_CURVE, (0.0, law.series_stiffness, 0.0), damper_curve)
        elif in_series:
            internal = self._state(MAXWELL, (law.damping, law.series_stiffness, 0.0))
        preload = 0.0 if law.preload == "auto" else law.preload
        self.link_rows.append(
            {
                "name": element.name,
                "body": self._pair(element),
                **self._levers(element, point1, point2),
                "length": float(np.linalg.norm(point2 - point1)),
                "stiffness": law.stiffness,
                "damping": 0.0 if in_series else law.damping,
                "preload": preload,
                "internal": internal,
                "curve": (self._curve(law.spring_table), -1 if in_series else damper_curve),
            }
        )

    def _add_mount(self, element: FlatElement, law: Element) -> None:
        point1, point2 = np.array(element.point1), np.array(element.point2)
        middle = 0.5 * (point1 + point2)
        point = middle if isinstance(law, ShearSpring) else point2
        row: dict[str, Any] = {
            "name": element.name,
            "body": self._pair(element),
            **self._levers(element, point, point),
            "stiffness": _NOTHING,
            "damping": _NOTHING,
            "preload": _NOTHING,
            "rotation": _NOTHING,
            "rotation_damping": _NOTHING,
            "friction": np.tile(_STEADY, (3, 1)),
            "internal": _NONE,
            "curve": _NONE,
            "flags": (1, 0, 0, 0),
        }
        row |= self._law(law)
        if any(row["rotation"]) or any(row["rotation_damping"]):
            row["flags"] = (*row["flags"][:2], 1, row["flags"][3])
        translates, both_ends = row["flags"][:2]
        row["share"] = (0.5, 0.5) if both_ends else (float(translates), 0.0)
        self.mount_rows.append(row)

    def _law(self, law: Element) -> dict[str, Any]:
        """What one kind of element changes in the empty row of a mount."""
        if isinstance(law, Bushing):
            pairs = list(zip(law.damping, law.series_stiffness, strict=True))
            return {
                "stiffness": law.stiffness,
                "damping": tuple(c if k_s == 0.0 else 0.0 for c, k_s in pairs),
                "internal": tuple(
                    self._state(MAXWELL, (c, k_s, 0.0)) if k_s > 0.0 else -1 for c, k_s in pairs
                ),
                "rotation": rotation_potential(law.rotational_stiffness),
                "rotation_damping": law.rotational_damping,
                "preload": _given(law.preload),
            }
        if isinstance(law, ShearSpring):
            return {
                "stiffness": law.stiffness,
                "damping": law.damping,
                "rotation": rotation_potential((*law.bending_stiffness, law.torsional_stiffness)),
                "flags": (1, 1, 0, 0),
                "preload": _given(law.preload),
            }
        if isinstance(law, RollBar):
            return {
                "rotation": rotation_potential((law.stiffness, 0.0, 0.0)),
                "rotation_damping": (law.damping, 0.0, 0.0),
                "flags": (0, 0, 1, 0),
            }
        if isinstance(law, BumpStop):
            curve = [-1, -1, -1]
            curve["xyz".index(law.axis)] = self._curve(law.table)
            return {"curve": tuple(curve)}
        if isinstance(law, Friction):
            return self._friction(law)
        if isinstance(law, SideBearer):
            return self._side_bearer(law)
        if isinstance(law, Wedge):
            return self._wedge(law)
        if isinstance(law, Airspring):
            parameter = (law.bellows_stiffness, law.reservoir_stiffness, law.orifice_damping)
            return {
                "stiffness": (*law.horizontal_stiffness, law.area_stiffness),
                "damping": (*law.horizontal_damping, 0.0),
                "internal": (-1, -1, self._state(AIR, parameter)),
                "rotation": rotation_potential((0.0, 0.0, law.torsional_stiffness)),
                "preload": _given(law.preload),
            }
        raise ModelError(f"no force law for an element of type '{type(law).__name__}'")

    def _friction(self, law: Friction) -> dict[str, Any]:
        limits = _friction_limits(law)
        limits[:, :2] = np.stack((law.friction_force, law.friction_coefficient), axis=1)
        return {
            "stiffness": law.stiffness,
            "damping": law.damping,
            "friction": limits,
            "internal": self._pads(
                law.stick_stiffness, limits, together=law.friction_limit == "circle"
            ),
            "flags": (1, 0, 0, 1),
            "preload": _given(law.preload),
        }

    def _side_bearer(self, law: SideBearer) -> dict[str, Any]:
        limits = _friction_limits(law)
        limits[:2, 1] = law.friction_coefficient
        load = -law.stiffness * law.clearance if law.preload == 0.0 else law.preload
        return {
            "stiffness": (0.0, 0.0, law.stiffness),
            "damping": (0.0, 0.0, law.damping),
            "friction": limits,
            "internal": self._pads((law.stick_stiffness, law.stick_stiffness, 0.0), limits),
            "curve": (-1, -1, self._curve(law.stop_table)),
            "flags": (1, 0, 0, ONE_SIDED),
            "preload": _NOTHING if load == "auto" else (0.0, 0.0, load),
        }

    def _wedge(self, law: Wedge) -> dict[str, Any]:
        limits = np.tile(_STEADY, (3, 1))
        limits[1:, 1] = law.share
        return {
            "stiffness": law.stiffness,
            "damping": law.damping,
            "friction": limits,
            "internal": self._pads((0.0, *law.stick_stiffness), limits, skew=law.share),
            "flags": (1, 0, 0, ONE_SIDED),
            "preload": _given(law.preload),
        }

    def _pads(
        self, stiffness: Triple, limits: Floats, *, together: bool = True, skew: float = 0.0
    ) -> Triple:
        """Internal states of the friction forces along the axes that have a limit."""
        axes = [k for k in range(3) if np.any(limits[k, :2] > 0.0)]
        together = together and len(axes) > 1
        found = [-1, -1, -1]
        for k in axes:
            last = k == axes[-1]
            number = float(len(axes) if last else 1) if together else 0.0
            found[k] = self._state(PAD, (stiffness[k], number, skew if last else 0.0))
        return found[0], found[1], found[2]

    def _add_drive(self, element: FlatElement, law: AxleTorque) -> None:
        assert isinstance(law, Traction | Brake)
        begin, end = law.slip_control or (0.0, 0.0)
        self.drive_rows.append(
            {
                "body": self._pair(element),
                "row": (isinstance(law, Brake), law.over == "distance", begin, end),
                "tables": (
                    np.array(law.torque_table, dtype=float),
                    np.array(law.demand_table or (), dtype=float).reshape(-1, 2),
                ),
            }
        )

    def _add_loads(self, element: FlatElement, law: AppliedForce) -> None:
        point = np.array(element.point1) - self._centre(element.body1)
        for is_torque, table in enumerate((law.force_table, law.torque_table)):
            if table is not None:
                self.load_rows.append(
                    {
                        "name": element.name,
                        "body": self._number(element.body1),
                        "point": point,
                        "flags": (is_torque, int(law.axes == "track"), int(law.over == "distance")),
                        "table": np.array(table, dtype=float),
                    }
                )

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

    def _state(self, kind: int, parameter: Triple, curve: int = -1) -> int:
        self.internal_rows.append((kind, parameter, curve))
        return len(self.internal_rows) - 1

    def _curve(self, table: Rows | None) -> int:
        if table is None:
            return -1
        self.curve_rows.append(np.array(two_sided(table)))
        return len(self.curve_rows) - 1

    def sort(self) -> None:
        """Bring mounts of one kind together: what none of a block of eight has is skipped."""
        self.mount_rows.sort(key=_kind_of_mount)

    def links(self) -> Links:
        """Arrays of all point-to-point elements."""
        rows = self.link_rows
        return Links(
            body=_column(rows, "body", (2,), np.int64),
            row=_table(rows, LINK_COLUMNS, LINK_SIZE),
            internal=_column(rows, "internal", (), np.int64),
            curve=_column(rows, "curve", (2,), np.int64),
        )

    def mounts(self) -> Mounts:
        """Arrays of all three-axis elements."""
        rows = self.mount_rows
        internal = _column(rows, "internal", (3,), np.int64)
        curve = _column(rows, "curve", (3,), np.int64)
        friction = _column(rows, "friction", (3, 4))
        flags = _column(rows, "flags", (4,), np.int64)
        return Mounts(
            body=_column(rows, "body", (2,), np.int64),
            row=_table(rows, MOUNT_COLUMNS, MOUNT_SIZE),
            friction=friction,
            internal=internal,
            curve=curve,
            flags=flags,
            law=mount_laws(internal, curve, flags),
            falling=falling_friction(friction),
        )

    def loads(self) -> Loads:
        """Arrays of all given forces and torques."""
        rows = self.load_rows
        tables = [row["table"] for row in rows]
        return Loads(
            body=_column(rows, "body", (), np.int64),
            point=_column(rows, "point", (3,)),
            flags=_column(rows, "flags", (3,), np.int64),
            start=_starts(tables),
            table=np.concatenate(tables) if tables else np.zeros((0, 4)),
        )

    def drives(self) -> Drives:
        """Arrays of all torques on wheelsets."""
        rows = self.drive_rows
        tables = [table for row in rows for table in row["tables"]]
        return Drives(
            body=_column(rows, "body", (2,), np.int64),
            row=_column(rows, "row", (4,)),
            start=_starts(tables),
            table=np.concatenate(tables) if tables else np.zeros((0, 2)),
        )

    def curves(self) -> Curves:
        """All tables, one after the other."""
        points = np.concatenate(self.curve_rows) if self.curve_rows else np.zeros((0, 2))
        return Curves(
            start=_starts(self.curve_rows),
            x=np.ascontiguousarray(points[:, 0]),
            f=np.ascontiguousarray(points[:, 1]),
        )

    def internal(self) -> Internal:
        """Laws of all internal states."""
        rows = self.internal_rows
        return Internal(
            kind=np.array([row[0] for row in rows], dtype=np.int64),
            parameter=np.array([row[1] for row in rows], dtype=float).reshape(-1, 3),
            curve=np.array([row[2] for row in rows], dtype=np.int64),
        )


def _friction_limits(law: SlidingFriction) -> Floats:
    """Rows of `Mounts.friction` without limits yet, with the fall of friction with the speed."""
    return np.tile((0.0, 0.0, law.sliding_ratio, law.stribeck_speed or 1.0), (3, 1))


def _kind_of_mount(row: dict[str, Any]) -> tuple[bool, ...]:
    has_law = max(*row["internal"], *row["curve"]) >= 0
    return (not has_law, *(bool(flag) for flag in row["flags"][1:3]))


def _given(preload: Any) -> Triple:
    given: Triple = _NOTHING if preload == "auto" else preload
    return given


def _starts(tables: Sequence[Floats]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum([len(table) for table in tables])]).astype(np.int64)


def _table(rows: list[dict[str, Any]], columns: Mapping[str, slice], size: int) -> Floats:
    """Values of all names in their columns, one row an element."""
    table = aligned_zeros((len(rows), size))
    for row, values in zip(table, rows, strict=True):
        for name, span in columns.items():
            row[span] = values[name]
    return table


def _column(
    rows: list[dict[str, Any]], key: str, shape: tuple[int, ...], dtype: type = np.float64
) -> NDArray[Any]:
    return np.array([row[key] for row in rows], dtype=dtype).reshape(len(rows), *shape)
