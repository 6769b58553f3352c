"""Several vehicles on one track as one system: many runs per compiled call.

The vehicles share time, position and speed and do not interact; each has its own bodies,
elements and wheels.  In the time loop FASTSIM then marches the strips of all their wheels side by
side, and what a call or an evaluation costs by itself is spent once.

Arrays hold vehicle after vehicle, indices are moved on accordingly; but mounts of one kind are
together, and a track frame serves all vehicles that have a body at its position.  Nothing large is
copied: equal contact tables are one, and so is the track's table.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from railsim.arrays import Floats, Integers
from railsim.kernels.aligned import aligned
from railsim.kernels.element_columns import BOTH_ENDS, ROTATES, falling_friction, mount_laws
from railsim.kernels.element_outputs import LINK
from railsim.kernels.recording import Recorder
from railsim.kernels.state import (
    N_SCALARS,
    contact_begin,
    drive_begin,
    internal_begin,
    smoothed_begin,
    velocity_begin,
)
from railsim.kernels.status import (
    BESIDE_RAIL,
    DERAILED,
    FALLEN,
    INWARD_RANGE,
    NOT_FINITE,
    ROLL_RANGE,
    WHEEL_LIFT,
    WRONG_SIDE,
    YAW_RANGE,
)
from railsim.kernels.system import Bodies, Contact, Curves, Mounts, System
from railsim.model import rail_ranges
from railsim.model.assembly import Model, per_wheelset, side_by_side
from railsim.model.uneven_wheels import joined, rolling

Group = TypeVar("Group", bound=tuple[Any, ...])

# the grid of the contact tables, which a system has but one of
GRID = ("y0", "dy", "roll0", "droll")
# statuses that concern a wheelset
ENDS = (DERAILED, BESIDE_RAIL, WRONG_SIDE, FALLEN, INWARD_RANGE, WHEEL_LIFT, ROLL_RANGE, YAW_RANGE)


def contact_grid(model: Model) -> tuple[float | int, ...]:
    """Grid of a model's contact tables; models that differ in it cannot be one system."""
    contact = model.system.contact
    return (*(getattr(contact, name) for name in GRID), *contact.w, *contact.values.shape[1:])


@dataclass(frozen=True)
class Part:
    """Where one vehicle is in the arrays of an ensemble."""

    # indices of its own state; the last three, time, position and speed, are those of all
    state: Integers
    bodies: slice
    wheelsets: slice
    elements: slice  # that are recorded


class Ensemble:
    """Models of several vehicles as one system; a single model's as it is.

    `models`: on the same track, with the same settings and the same `contact_grid`; `recorders`:
    what is recorded of each. `system`: everything that the time loop reads; `recorder`: records of
    all vehicles; `parts`: where each vehicle is.
    """

    def __init__(self, models: Sequence[Model], recorders: Sequence[Recorder]) -> None:
        self._recorders = recorders
        systems = [model.system for model in models]
        bodies = _slices(len(system.bodies.kind) for system in systems)
        internal = _slices(len(system.internal.kind) for system in systems)
        wheelsets = _slices(len(system.contact.body) for system in systems)
        elements = _slices(len(recorder.chosen) for recorder in recorders)
        n, m = bodies[-1].stop, internal[-1].stop
        sizes = per_wheelset(systems[0])
        self.parts = tuple(
            Part(_indices(n, m, sizes, own, inner, axles, wheelsets[-1].stop), own, axles, chosen)
            for own, inner, axles, chosen in zip(bodies, internal, wheelsets, elements, strict=True)
        )
        if len(models) == 1:
            self.system = rolling(systems[0], models[0].wheels, models[0].check, models[0].rails)
            self.recorder = recorders[0]
            return
        self.system = joined_system(models)
        n_state = contact_begin(n, m) + sum(sizes) * wheelsets[-1].stop + N_SCALARS
        self.recorder = _joined_recorder(systems, recorders, n_state)

    def state(self, states: Sequence[Floats]) -> Floats:
        """State of the ensemble from those of its vehicles."""
        joint = np.zeros(self.recorder.state.shape[1])
        for part, state in zip(self.parts, states, strict=True):
            joint[part.state] = state
        return joint

    def records(self, number: int, rows: int) -> Recorder:
        """First `rows` records of one vehicle."""
        if len(self.parts) == 1:
            return self.recorder
        part, joint = self.parts[number], self.recorder
        return Recorder(
            state=joint.state[:rows][:, part.state],
            rates=joint.rates[:rows, 6 * part.bodies.start : 6 * part.bodies.stop],
            acceleration=joint.acceleration[:rows, part.bodies],
            wheel=joint.wheel[:rows, part.wheelsets],
            patch=joint.patch[:rows, part.wheelsets],
            chosen=self._recorders[number].chosen,
            element=joint.element[:rows, part.elements],
        )

    def concerned(self, status: int, where: int) -> list[int]:
        """Number the vehicles by what a status of the time loop says of them.

        1 for the one that it concerns and 0 for the others; each has a number of its own where that
        is not known, or wheels strike: others will soon, and each time part of the way is repeated.
        """
        concerned = [False] * len(self.parts)
        if status == NOT_FINITE:
            concerned = [where in part.state for part in self.parts]
        elif status in ENDS:
            concerned = [part.wheelsets.start <= where < part.wheelsets.stop for part in self.parts]
        if sum(concerned) != 1:
            return list(range(len(self.parts)))
        return [int(this) for this in concerned]


def joined_system(models: Sequence[Model]) -> System:
    """One system of several models, see the module's text."""
    systems = [model.system for model in models]
    bodies = _starts(len(system.bodies.kind) for system in systems)
    internal = _starts(len(system.internal.kind) for system in systems)
    curves = _starts(len(system.curves.start) - 1 for system in systems)
    offset = np.unique(np.concatenate([system.frame_offset for system in systems]))

    def starts(name: str) -> Integers:
        # first points of the tables of one system after the other, and the end
        counts = [np.diff(getattr(system, name).start) for system in systems]
        return np.concatenate([[0], np.cumsum(np.concatenate(counts))])

    # track and rails are those of all; vehicles with actuators, signals or laws run alone
    return systems[0]._replace(
        bodies=_joined_bodies(systems, bodies, offset),
        frame_offset=offset,
        contact=_joined_contact(models, bodies),
        links=_joined(
            [system.links for system in systems], body=bodies, internal=internal, curve=curves
        ),
        mounts=_joined_mounts(systems, body=bodies, internal=internal, curve=curves),
        curves=Curves(
            start=starts("curves"),
            x=np.concatenate([system.curves.x for system in systems]),
            f=np.concatenate([system.curves.f for system in systems]),
        ),
        internal=_joined([system.internal for system in systems], curve=curves),
        loads=_joined([s.loads for s in systems], body=bodies)._replace(start=starts("loads")),
        drives=_joined([s.drives for s in systems], body=bodies)._replace(start=starts("drives")),
    )


def _joined_bodies(systems: Sequence[System], first: Integers, offset: Floats) -> Bodies:
    joint = _joined(
        [system.bodies for system in systems],
        parent=first,
        references=first,
        whole=first,
        axleboxes=first,
        fixed=first,
    )
    frames = [
        np.searchsorted(offset, system.frame_offset)[system.bodies.frame] for system in systems
    ]
    return joint._replace(frame=np.concatenate(frames))


def _joined_mounts(systems: Sequence[System], **shifts: Integers) -> Mounts:
    """Mounts of all vehicles, those of one kind together: what a block of eight lacks is skipped.

    Those of one vehicle keep their order, and so do the forces on each body.
    """
    joint = _joined([system.mounts for system in systems], **shifts)
    order = _order_of_mounts(systems)
    joint = joint._replace(
        **{
            name: aligned(getattr(joint, name)[order])
            for name in joint._fields
            if name not in ("law", "falling")
        }
    )
    return joint._replace(
        law=mount_laws(joint.internal, joint.curve, joint.flags),
        falling=falling_friction(joint.friction),
    )


def _order_of_mounts(systems: Sequence[System]) -> Integers:
    """Numbers of the mounts, counted vehicle after vehicle, in the order of the joint system."""
    kinds = [
        np.column_stack(
            [
                ((mounts.internal < 0) & (mounts.curve < 0)).all(axis=1),
                mounts.flags[:, (BOTH_ENDS, ROTATES)] != 0,
            ]
        )
        for mounts in (system.mounts for system in systems)
    ]
    return np.lexsort(np.concatenate(kinds).T[::-1])


def _joined_contact(models: Sequence[Model], first: Integers) -> Contact:
    """Wheelsets of all models; a table that several of them have is there once."""
    contacts = [model.system.contact for model in models]
    rows: dict[int, tuple[Floats, float, Floats]] = {}
    for model, contact in zip(models, contacts, strict=True):
        for table, row in zip(
            model.tables,
            zip(contact.values, contact.shear, contact.coupling, strict=True),
            strict=True,
        ):
            rows.setdefault(id(table), row)
    number = {table: k for k, table in enumerate(rows)}
    values, shear, coupling = zip(*rows.values(), strict=True)
    return contacts[0]._replace(
        body=np.concatenate([c.body + shift for c, shift in zip(contacts, first, strict=True)]),
        table=np.concatenate(
            [
                np.array([number[id(table)] for table in model.tables])[contact.table]
                for model, contact in zip(models, contacts, strict=True)
            ]
        ),
        load=np.concatenate([c.load for c in contacts]),
        values=side_by_side(values) if len(rows) > len(models[0].tables) else contacts[0].values,
        shear=np.array(shear),
        coupling=np.array(coupling),
        **joined([model.wheels for model in models], [len(c.body) for c in contacts])._asdict(),
        rails=rail_ranges.joined([model.rails for model in models]).arrays,
        check=models[0].check.check,
        check_flangeway=models[0].check.check_flangeway,
        check_wheel=np.concatenate([model.check.check_wheel for model in models]),
    )


def _joined_recorder(
    systems: Sequence[System], recorders: Sequence[Recorder], n_state: int
) -> Recorder:
    def along(name: str) -> Floats:
        return np.concatenate([getattr(recorder, name) for recorder in recorders], axis=1)

    links = _starts(len(system.links.length) for system in systems)
    mounts = _starts(len(system.mounts.body) for system in systems)
    moved = np.argsort(_order_of_mounts(systems))
    chosen = [
        (group, index + links[k] if group == LINK else moved[index + mounts[k]])
        for k, recorder in enumerate(recorders)
        for group, index in recorder.chosen.tolist()
    ]
    return Recorder(
        state=np.zeros((len(recorders[0].state), n_state)),
        rates=along("rates"),
        acceleration=along("acceleration"),
        wheel=along("wheel"),
        patch=along("patch"),
        chosen=np.array(chosen, dtype=np.int64).reshape(-1, 2),
        element=along("element"),
    )


def _joined(groups: Sequence[Group], **shifts: Integers) -> Group:
    """One group of arrays of several; indices of the fields in `shifts` are moved on, but -1."""

    def shifted(name: str, array: NDArray[Any], k: int) -> NDArray[Any]:
        return np.where(array >= 0, array + shifts[name][k], array) if name in shifts else array

    kind: Any = type(groups[0])
    joint: Group = kind(
        *(
            aligned(np.concatenate([shifted(name, array, k) for k, array in enumerate(arrays)]))
            for name, arrays in zip(kind._fields, zip(*groups, strict=True), strict=True)
        )
    )
    return joint


def _starts(lengths: Iterable[int]) -> Integers:
    return np.cumsum([0, *lengths])[:-1]


def _slices(lengths: Iterable[int]) -> list[slice]:
    return [slice(start, end) for start, end in pairwise(np.cumsum([0, *lengths]).tolist())]


def _indices(
    n: int, m: int, sizes: tuple[int, int], bodies: slice, internal: slice, wheelsets: slice, w: int
) -> Integers:
    """Indices of one vehicle's state in that of n bodies, m internal states, w wheelsets."""
    coordinates = np.arange(6 * bodies.start, 6 * bodies.stop)
    inner = np.arange(internal.start, internal.stop)
    first = contact_begin(n, m)
    blocks = []
    for size in sizes:
        blocks.append(first + np.arange(size * wheelsets.start, size * wheelsets.stop))
        first += size * w
    return np.concatenate(
        [
            coordinates,
            velocity_begin(n) + coordinates,
            internal_begin(n) + inner,
            smoothed_begin(n, m) + coordinates,
            drive_begin(n, m) + inner,
            *blocks,
            np.arange(first, first + N_SCALARS),
        ]
    )
