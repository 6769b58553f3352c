"""From definitions to the flat arrays of `railsim.kernels.system`, and names to numbers.

Only `assemble` knows both sides: what a user wrote (bodies, elements with names)
and what the kernels read (arrays with indices).  `Index` keeps the way back.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from railsim.arrays import Floats, Indices
from railsim.constants import GRAVITY
from railsim.contact.coupling import coupling
from railsim.contact.kalker import creep_tables
from railsim.contact.stored_table import cached_contact_table
from railsim.contact.table import ContactTable
from railsim.contact.zones import table_widening
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.base import once
from railsim.definitions.loading import check_types
from railsim.definitions.settings import Drive as DriveDefinition
from railsim.definitions.track.layout import is_straight_and_level
from railsim.definitions.track.support import Support as SupportDefinition
from railsim.definitions.vehicle.flatten import FlatBody, FlatVehicle, flatten
from railsim.definitions.vehicle.laws import Law
from railsim.errors import Fault, Faults, ModelError, changed_faults, input_error
from railsim.kernels.alignment import CACHE_LINE, aligned_copy, aligned_zeros
from railsim.kernels.contact_table import N_PATCH
from railsim.kernels.state import N_SCALARS, contact_begin, internal_begin, velocity_begin
from railsim.kernels.status import LAW_NOT_FINITE, NOT_FINITE, STATUS
from railsim.kernels.support import SUPPORT_ROW, SUPPORT_SIZE, TRACED, TRANSIENT_SIZE
from railsim.kernels.system import (
    AXLEBOX,
    FIXED,
    FREE,
    RIGID,
    TABLE,
    WHEELSET,
    Bodies,
    Contact,
    Drive,
    Support,
    System,
)
from railsim.model.check_rails import NONE, CheckRails, check_rails
from railsim.model.contact_laws import settings_creep_law, with_own_laws
from railsim.model.element_arrays import ElementArrays, LawBlocks
from railsim.model.rail_ranges import PLAIN, RailRanges, rail_ranges
from railsim.model.uneven_wheels import ROUND, UnevenWheels, uneven_wheels
from railsim.model.work import CONSTANT_SPEED, NO_CONTROLLERS, NO_SIGNALS, parts_of_wheel
from railsim.notation import COMPONENTS
from railsim.profiles import Profile, load_profile
from railsim.profiles.profile import Kind
from railsim.track.tables import track_tables

_KINDS = {"body": RIGID, "wheelset": WHEELSET, "axlebox": AXLEBOX}


@dataclass(frozen=True)
class Index:
    """Names of the model's parts in the order of the arrays."""

    bodies: tuple[str, ...]  # rigid ones, wheelsets from the leading end, axleboxes
    wheelsets: tuple[str, ...]
    links: tuple[str, ...]  # rows of this part of the system; likewise all that follow
    mounts: tuple[str, ...]
    actuators: tuple[str, ...] = ()
    signals: tuple[str, ...] = ()
    controllers: tuple[str, ...] = ()

    @property
    def n_bodies(self) -> int:
        """Number of bodies."""
        return len(self.bodies)

    def coordinate(self, body: str, component: int) -> int:
        """Index of a coordinate in the state vector."""
        return 6 * self.bodies.index(body) + component

    def sentence(self, status: int, where: int) -> str:
        """Why the time loop has ended, with the name of what it concerns."""
        names = self.wheelsets
        if status == LAW_NOT_FINITE:
            laws = (f"the law of element {name}" for name in self.actuators)
            names = (*laws, *(f"controller {name}" for name in self.controllers))
        if status == NOT_FINITE:
            body = where % (6 * self.n_bodies) // 6
            names, where = self.bodies, min(body, self.n_bodies - 1)
        return STATUS[status][1].format(where=names[where])

    def largest_left(self, equations: Sequence[int] | Indices, rest: Floats, most: int) -> str:
        """Which of the accelerations `rest` of some rows are the largest, by body, in words."""
        n = self.n_bodies
        # those of a track or an air spring follow the bodies
        of_bodies = np.flatnonzero(np.asarray(equations) < internal_begin(n))
        parts = []
        for k in of_bodies[np.argsort(-np.abs(rest[of_bodies]))[:most]]:
            body, component = divmod(int(equations[k]) - velocity_begin(n), 6)
            parts.append(f"{self.bodies[body]} {COMPONENTS[component]}'' = {rest[k]:.3g}")
        return "largest remaining accelerations: " + ", ".join(parts)


@dataclass(frozen=True)
class Model:
    """A vehicle on a track, ready for the kernels."""

    system: System
    index: Index
    flat: FlatVehicle  # the vehicle's parts with names and positions
    tables: tuple[ContactTable, ...]  # in the order of `System.contact.values`
    profiles: Mapping[str, Profile]  # used, by name
    # in its design load, whose preloads these are, where a load case is in force
    design: "Model | None" = None
    # not round, left out of `system`: see `railsim.model.uneven_wheels`
    wheels: UnevenWheels = ROUND
    check: CheckRails = NONE  # likewise
    rails: RailRanges = PLAIN  # whose section changes, likewise

    @property
    def n_state(self) -> int:
        """Length of the state vector."""
        contact, elastic = self.system.contact, self.system.support.elastic
        first = contact_begin(self.index.n_bodies, len(self.system.internal.kind))
        per_wheelset = TRANSIENT_SIZE * contact.transient + SUPPORT_SIZE * elastic
        return first + per_wheelset * len(contact.body) + N_SCALARS


def assemble(
    vehicle: Vehicle,
    track: Track,
    settings: Settings,
    profiles: Mapping[str, Profile] | None = None,
    make_table: Callable[..., ContactTable] | None = None,
) -> Model:
    """Build the arrays of one vehicle on one track.

    `vehicle`, `track`, `settings`: valid definitions; `profiles`: profiles by name that take
    precedence over built-in ones and files (a result carries those that it used); `make_table`:
    instead of `cached_contact_table`. Raises InputError: a profile cannot be read, a law is not
    permitted or cannot be compiled. TypeError: something else than a vehicle, a track, profiles by
    name. ModelError: the wheels do not fit on the rails.
    """
    check_types([vehicle], track, settings=settings)
    flat = flatten(vehicle)
    given = {} if profiles is None else profiles
    if not isinstance(given, Mapping) or not all(isinstance(p, Profile) for p in given.values()):
        raise TypeError("profiles: give a mapping of names to what railsim.load_profile returns")
    check_fixed(flat, track, settings.drive.mode)
    # no table is made twice, also where none is kept on disk
    make_table = make_table or cache(cached_contact_table)
    contact, tables, used = _contact(flat, track, settings, given, make_table)
    contact = with_own_laws(contact, settings)
    if vehicle.laws:  # whose blocks the loop writes into: each model has its own
        system, index = _suspension(flat, vehicle.laws)
    else:
        system, index = once(vehicle, "_suspension", lambda: _suspension(flat))
    system = system._replace(
        track=track_tables(track),
        support=support_arrays(track.support, track.rail_base),
        contact=contact,
        drive=drive_arrays(settings.drive),
    )
    design = None
    if vehicle.load is not None:
        unloaded = vehicle.model_copy(update={"load": None})
        design = assemble(unloaded, track, settings, profiles, make_table)
    wheels = uneven_wheels(flat, track, used)
    check = check_rails(flat, track, used)
    rails = rail_ranges(flat, track, used, (tables, contact.table), settings.normal_contact)
    if settings.transient_creep and N_PATCH * parts_of_wheel(rails.arrays) > TRACED:
        found = "sections of more than two rails side by side"
        raise input_error("track", found, "two with settings.transient_creep", key="sections")
    return Model(system, index, flat, tables, used, design, wheels, check, rails)


def without_rails(vehicle: Vehicle) -> Model:
    """Return the model of a vehicle without wheels' contacts and track, for statics alone."""
    flat = flatten(vehicle)
    system, index = _suspension(flat)
    loaded = vehicle.load is not None
    design = without_rails(vehicle.model_copy(update={"load": None})) if loaded else None
    return Model(system, index, flat, (), {}, design)


def _suspension(flat: FlatVehicle, laws: Mapping[str, Law] | None = None) -> tuple[System, Index]:
    """Bodies and elements as arrays, and their names; no track and no contacts."""
    elements = ElementArrays({body.name: body for body in flat.bodies}, own=LawBlocks(laws))
    for element in flat.elements:
        elements.add(element)
    bodies, offsets = _bodies(flat)
    nothing: Any = None
    system = System(
        bodies=bodies,
        frame_offset=offsets,
        track=nothing,
        support=nothing,
        contact=nothing,
        drive=CONSTANT_SPEED,
        gravity=GRAVITY,
        signals=NO_SIGNALS,
        controllers=NO_CONTROLLERS,
        **elements.arrays(),
    )
    return system, Index(
        bodies=tuple(body.name for body in flat.bodies),
        wheelsets=tuple(body.name for body in flat.of_kind("wheelset")),
        links=tuple(row["name"] for row in elements.link_rows),
        mounts=tuple(row["name"] for row in elements.mount_rows),
        actuators=tuple(row["name"] for row in elements.act_rows),
    )


def check_fixed(flat: FlatVehicle, track: Track, drive: str = "constant") -> None:
    """Raise InputError where bodies are fixed that cannot be so on this track."""
    fixed, faults = [body for body in flat.bodies if body.fixed], Faults()
    if fixed and drive == "free":
        found = f"free running with {', '.join(body.name for body in fixed)} fixed"
        allowed = "constant or table: a fixed body moves on as prescribed"
        faults.append(Fault("settings", "drive.mode", found, allowed))
    if not is_straight_and_level(track):
        found = "fixed to the ground beside curves, cant or gradients"
        allowed = 'fixed = "track", or straight level track'
        faults += [
            Fault(f"vehicle '{flat.name}'", f"{body.name}.fixed", found, allowed)
            for body in fixed
            if body.fixed == "ground"
        ]
    faults.check()


def support_arrays(definition: SupportDefinition, rail_base: float) -> Support:
    """Arrays of the moving track model; `rail_base`: distance of the rails on the sleeper [m]."""
    values = definition.values
    variation = np.array(definition.variation or (), dtype=float).reshape(-1, 3)
    if values is None:
        return Support(0, 0, 0, np.zeros(SUPPORT_ROW), variation)
    masses = values.rail_mass, values.sleeper_mass, values.sleeper_inertia
    across = values.ballast_lateral or (0.0, 0.0)
    both = 2.0 * np.array(values.ballast_vertical or (0.0, 0.0))  # halves of the sleeper
    pads = *values.pad_lateral, *values.pad_vertical
    ballast = *across, *both, *(values.ballast_base**2 * both)
    row = np.array([*masses, *pads, *ballast, 0.5 * rail_base])
    return Support(1, int(values.has_sleeper), int(values.massless), row, variation)


def drive_arrays(drive: DriveDefinition) -> Drive:
    """Arrays of the way the speed goes along the track."""
    if drive.mode == "table":
        return Drive(TABLE, np.array(drive.speed_table, dtype=float), np.zeros(3))
    if drive.mode == "free":
        traction = drive.traction_table or ((0.0, 0.0),)
        return Drive(FREE, np.array(traction, dtype=float), np.array(drive.resistance))
    return CONSTANT_SPEED


def _bodies(flat: FlatVehicle) -> tuple[Bodies, Floats]:
    """Arrays of the bodies, and the arc length of each track frame from the reference body."""
    names = [body.name for body in flat.bodies]
    positions = [round(x, 9) for x in flat.along(flat.bodies)]
    offsets = sorted(set(positions))
    kinds = np.array([FIXED if b.fixed else _KINDS[b.kind] for b in flat.bodies], dtype=np.int64)
    parents = [names.index(body.parent) if body.parent else -1 for body in flat.bodies]
    bodies = Bodies(
        kind=kinds,
        frame=np.array([offsets.index(position) for position in positions], dtype=np.int64),
        parent=np.array(parents, dtype=np.int64),
        row=aligned_copy(np.array([_body_row(body) for body in flat.bodies])),
        whole=np.flatnonzero(kinds != AXLEBOX),
        axleboxes=np.flatnonzero(kinds == AXLEBOX),
        fixed=np.flatnonzero(kinds == FIXED),
        reference=names.index(flat.reference),
    )
    return bodies, np.array(offsets)


def _body_row(body: FlatBody) -> tuple[float, ...]:
    inertia = (1.0, body.pitch_inertia, 1.0) if body.kind == "axlebox" else body.inertia
    radius = 0.5 * sum(body.wheelset.radius) if body.wheelset else 1.0
    _, y, z = body.position
    return max(body.mass, 1e-9), *inertia, y, z, radius, float(body.wheelset is not None)


def on_common_grid(tables: Sequence[ContactTable]) -> tuple[float, list[Floats]]:
    """First node and values of contact tables over the range that all of them cover."""
    dy = tables[0].dy
    first = max(round(t.y0 / dy) for t in tables)
    last = min(round(t.y0 / dy) + t.values.shape[3] for t in tables)
    starts = [first - round(t.y0 / dy) for t in tables]
    each = zip(tables, starts, strict=True)
    parts = [t.values[..., start : start + last - first, :] for t, start in each]
    return tables[starts.index(0)].y0, parts


def side_by_side(tables: Sequence[Floats]) -> Floats:
    """Contact tables as one array; a single one as it lies in memory (or on disk)."""
    if len(tables) > 1:
        values = np.stack(tables, out=aligned_zeros((len(tables), *tables[0].shape)))
    elif (values := tables[0][None]).ctypes.data % CACHE_LINE:
        values = aligned_copy(values)
    values.setflags(write=False)  # as on disk
    return values


def _contact(
    flat: FlatVehicle,
    track: Track,
    settings: Settings,
    profiles: Mapping[str, Profile],
    make_table: Callable[..., ContactTable],
) -> tuple[Contact, tuple[ContactTable, ...], dict[str, Profile]]:
    """Contact arrays, one table for each different wheel on its rail, and the profiles used."""
    used: dict[str, Profile] = {}

    def profile(name: str, kind: Kind) -> Profile:
        if name not in used:
            used[name] = profiles.get(name) or load_profile(name, kind=kind)
        return used[name]

    def of_track(fault: Fault) -> Fault:
        # some commands take a track of standard gauge where none is named
        where = f"the track is '{track.name}', for another gauge name its own (TRACK, --track)"
        return replace(fault, allowed=f"{fault.allowed}; {where}")

    wheelsets = flat.of_kind("wheelset")
    alike: dict[str, Any] = {
        "gauge": track.gauge,
        "inclination": track.inclination,
        "G": settings.shear_modulus,
        "nu": settings.poisson,
        "normal": settings.normal_contact,
    }
    keys: dict[tuple[Any, ...], int] = {}
    tables: list[ContactTable] = []
    which = np.zeros((len(wheelsets), 2), dtype=np.int64)
    for w, body in enumerate(wheelsets):
        wheelset = body.wheelset
        assert wheelset is not None
        for side in range(2):
            own = {
                "radius": wheelset.radius[side],
                "centre_height": -body.position[2],
                "back_to_back": wheelset.back_to_back,
                "tape_circle_distance": wheelset.tape_circle_distance,
                "widening": table_widening(track.widest),  # auxiliary runs stand on plain track
            }
            of_wheel, of_rail = wheelset.profile[side], track.rail[side]
            key = (of_wheel, of_rail, *own.values())
            if key not in keys:
                keys[key] = len(tables)
                wheel, rail = profile(of_wheel, "wheel"), profile(of_rail, "rail")
                with changed_faults(of_track):
                    tables.append(make_table(wheel, rail, **own, **alike))
            which[w, side] = keys[key]
    if not tables:
        raise ModelError("a vehicle needs at least one wheelset")
    first = tables[0]
    y0, values = on_common_grid(tables)
    falling = track.friction_falling
    names = [body.name for body in flat.bodies]
    weight = GRAVITY * sum(body.mass for body in flat.bodies)
    contact = Contact(
        body=np.array([names.index(body.name) for body in wheelsets], dtype=np.int64),
        table=which,
        load=np.full(len(wheelsets), weight / (2.0 * len(wheelsets))),
        values=side_by_side(values),
        shear=np.array([t.shear for t in tables]),
        coupling=np.array(
            [coupling(t.values, settings.shear_modulus, settings.poisson) for t in tables]
        ),
        y0=y0,
        dy=first.dy,
        roll0=first.roll0,
        droll=first.droll,
        w=first.w,
        damping=settings.contact_damping,
        kalker=creep_tables(settings.poisson),
        law=settings_creep_law(settings, track),
        friction_rest=falling.rest if falling else 1.0,
        friction_decay=falling.decay if falling else 0.0,
        **ROUND._asdict(),
        **NONE._asdict(),
        transient=int(settings.transient_creep),
        rails=PLAIN.arrays,
        friction_law=0,
        friction_block=np.zeros(0),
    )
    return contact, tuple(tables), used
