"""From definitions to the flat arrays of `railsim.kernels.system`, and names to numbers.

`assemble` is the only place that knows both sides: what a user wrote (bodies, elements with names)
and what the kernels read (arrays with indices).  `Index` keeps the way back.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.contact.coupling import coupling
from railsim.contact.creep_table import NO_TABLE, creep_table
from railsim.contact.kalker import creep_tables
from railsim.contact.table import ContactTable, cached_contact_table
from railsim.definitions.flatten import FlatBody, FlatVehicle, flatten
from railsim.definitions.layout import is_straight_and_level
from railsim.definitions.settings import Drive as DriveDefinition
from railsim.definitions.settings import Settings
from railsim.definitions.support import Support as SupportDefinition
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import Fault, InputError, ModelError
from railsim.kernels.aligned import CACHE_LINE, aligned, aligned_zeros
from railsim.kernels.contact_table import LOOK_UP_SIZE, N_PATCH, N_WEIGHT
from railsim.kernels.creep import LAW_NUMBERS
from railsim.kernels.extremes import EXTREMES, MAX, MIN
from railsim.kernels.fastsim import fastsim_workspace
from railsim.kernels.lanes import LANES
from railsim.kernels.rails import COMING, COSINE, MOTION_SIZE, PLANE_SIZE, RAIL_SIZE
from railsim.kernels.support import SUPPORT_COLUMNS, SUPPORT_ROW, SUPPORT_SIZE, SUPPORT_STEP
from railsim.kernels.system import (
    AXLEBOX,
    CONSTANT,
    FIXED,
    FREE,
    N_SCALARS,
    POSE_SIZE,
    RATES_SIZE,
    RELATIVE_SIZE,
    RIGID,
    TABLE,
    WHEELSET,
    Bodies,
    Contact,
    Drive,
    Support,
    System,
    Work,
)
from railsim.kernels.track_frame import FRAME_SIZE, MU_LEFT, MU_RIGHT, TrackTables
from railsim.kernels.vibration import VIBRATION
from railsim.kernels.wheel_rail import CONTACT_JACOBIAN, PATCH_ROWS, WHEEL_COLUMNS
from railsim.model.element_arrays import ElementArrays
from railsim.profiles import Profile, load_profile
from railsim.profiles.profile import Kind
from railsim.track.alignment import CANT_BASE
from railsim.track.tables import track_tables

Floats = NDArray[np.float64]
GRAVITY = 9.81  # m/s2, as in the reference study
CONSTANT_SPEED = Drive(CONSTANT, np.zeros((1, 2)), np.zeros(3))
_KINDS = {"body": RIGID, "wheelset": WHEELSET, "axlebox": AXLEBOX}


@dataclass(frozen=True)
class Index:
    """Names of the model's parts in the order of the arrays.

    Attributes
    ----------
    bodies : tuple of str
        All bodies: rigid ones, wheelsets from the leading end, axleboxes.
    wheelsets : tuple of str
        Names of the wheelsets.
    links, mounts : tuple of str
        Names of the elements in `System.links` and `System.mounts`.
    """

    bodies: tuple[str, ...]
    wheelsets: tuple[str, ...]
    links: tuple[str, ...]
    mounts: tuple[str, ...]

    @property
    def n_bodies(self) -> int:
        """Number of bodies."""
        return len(self.bodies)

    def coordinate(self, body: str, component: int) -> int:
        """Place of a coordinate in the state vector."""
        return 6 * self.bodies.index(body) + component


@dataclass(frozen=True)
class Model:
    """A vehicle on a track, ready for the kernels.

    Attributes
    ----------
    system, index : System, Index
        Arrays and names.
    flat : FlatVehicle
        The vehicle's parts with names and positions.
    tables : tuple of ContactTable
        Contact tables in the order of `System.contact.values`.
    profiles : dict
        Profiles used, by name.
    design : Model or None
        The vehicle in its design load, whose preloads these are, where a load case is in force.
    """

    system: System
    index: Index
    flat: FlatVehicle
    tables: tuple[ContactTable, ...]
    profiles: Mapping[str, Profile]
    design: "Model | None" = None

    @property
    def n_state(self) -> int:
        """Length of the state vector."""
        system = self.system
        track = SUPPORT_SIZE * system.support.elastic * len(system.contact.body)
        return 18 * self.index.n_bodies + 2 * len(system.internal.kind) + track + N_SCALARS


def assemble(
    vehicle: Vehicle,
    track: Track,
    settings: Settings,
    profiles: Mapping[str, Profile] | None = None,
    shared: "SharedTables | None" = None,
) -> Model:
    """Build the arrays of one vehicle on one track.

    Parameters
    ----------
    vehicle, track, settings : Vehicle, Track, Settings
        Valid definitions.
    profiles : mapping of str to Profile, optional
        Profiles by name that take precedence over built-in ones and files (a result carries those
        that it used).
    shared : SharedTables, optional
        Tables of other models with the same track, settings and profiles; takes those made now.

    Returns
    -------
    Model

    Raises
    ------
    InputError
        A profile cannot be read.
    ModelError
        The wheels do not fit on the rails.
    """
    flat = flatten(vehicle)
    book = _ProfileBook(dict(profiles or {}))
    check_fixed(flat, track, settings.drive.mode)
    shared = shared or SharedTables()
    if shared.track is None:
        shared.track = track_tables(track)
    contact, tables = _contact(flat, track, settings, book, shared.contact)
    elements = ElementArrays({body.name: body for body in flat.bodies})
    for element in flat.elements:
        elements.add(element)
    elements.sort()
    bodies, offsets = _bodies(flat)
    system = System(
        bodies=bodies,
        frame_offset=offsets,
        track=shared.track,
        support=support_arrays(track.support),
        contact=contact,
        links=elements.links(),
        mounts=elements.mounts(),
        curves=elements.curves(),
        internal=elements.internal(),
        loads=elements.loads(),
        drive=drive_arrays(settings.drive),
        gravity=GRAVITY,
    )
    index = Index(
        bodies=tuple(_names(flat.bodies)),
        wheelsets=tuple(body.name for body in flat.of_kind("wheelset")),
        links=tuple(row["name"] for row in elements.link_rows),
        mounts=tuple(row["name"] for row in elements.mount_rows),
    )
    design = None
    if vehicle.load is not None:
        unloaded = vehicle.model_copy(update={"load": None})
        design = assemble(unloaded, track, settings, profiles, shared)
    return Model(system, index, flat, tables, book.used, design)


def check_fixed(flat: FlatVehicle, track: Track, drive: str = "constant") -> None:
    """Raise InputError where bodies are fixed that cannot be so on this track."""
    fixed = [body for body in flat.bodies if body.fixed]
    faults = []
    where = f"vehicle '{flat.name}'"
    if fixed and drive == "free":
        names = ", ".join(body.name for body in fixed)
        faults.append(
            Fault(
                "settings",
                "drive.mode",
                f"free running with {names} fixed",
                "constant or table: a fixed body moves on as prescribed",
            )
        )
    if not is_straight_and_level(track):
        faults += [
            Fault(
                where,
                f"{body.name}.fixed",
                "fixed to the ground beside curves, cant or gradients",
                'fixed = "track", or straight level track',
            )
            for body in fixed
            if body.fixed == "ground"
        ]
    if faults:
        raise InputError(faults)


def components_of(kind: int) -> tuple[int, ...]:
    """Components in which a body of this kind moves."""
    return {AXLEBOX: (4,), FIXED: ()}.get(kind, (0, 1, 2, 3, 4, 5))


def work_arrays(system: System) -> Work:
    """Scratch arrays for `system`."""
    n = len(system.bodies.kind)
    n_wheelsets = len(system.contact.body)
    n_patches = 2 * N_PATCH * n_wheelsets
    n_frames = len(system.frame_offset)
    n_tracks = n_wheelsets * system.support.elastic
    return Work(
        frames=aligned_zeros((n_frames, FRAME_SIZE)),
        cell=aligned_zeros(n_frames, np.int64),
        cell_u=aligned_zeros(n_frames),
        pose=aligned_zeros((n, POSE_SIZE)),
        relative=aligned_zeros((n, RELATIVE_SIZE)),
        rail_force=aligned_zeros((n, RATES_SIZE)),
        acceleration=aligned_zeros((n, RATES_SIZE)),
        drive=aligned_zeros((len(system.internal.kind), 2)),
        laws=aligned_zeros(9 * LANES),
        decay=aligned_zeros(len(system.internal.kind)),
        contact_jacobian=aligned_zeros((n, CONTACT_JACOBIAN)),
        plane=_smooth_planes(n_wheelsets),
        rail=aligned_zeros((n_wheelsets, 2, RAIL_SIZE)),
        rail_motion=aligned_zeros((n_wheelsets, 2, MOTION_SIZE)),
        above=aligned_zeros(10),
        look_up=aligned_zeros(N_PATCH * LOOK_UP_SIZE),
        weights=aligned_zeros(N_WEIGHT),
        stiffness=aligned_zeros(2 * N_PATCH),
        approach=aligned_zeros(N_PATCH),
        patch_index=aligned_zeros((n_patches, 3), np.int64),
        patch=aligned_zeros((PATCH_ROWS, n_patches)),
        fastsim=fastsim_workspace(n_patches, system.contact.n_y, system.contact.n_x),
        offsets=aligned_zeros(16, np.int64),
        support=aligned_zeros((n_tracks, 2, SUPPORT_COLUMNS)),
        support_step=aligned_zeros((n_tracks, SUPPORT_STEP)),
        compliance=aligned_zeros(2),
        vibration=aligned_zeros((n_wheelsets, 2, VIBRATION)),
        events=aligned_zeros((n_wheelsets, 4), np.int64),
        wheel=aligned_zeros((n_wheelsets, 2, WHEEL_COLUMNS)),
        swing=aligned_zeros(n_wheelsets),
        watch=aligned_zeros(2),
        coming=aligned_zeros((2, COMING)),
        parts=aligned_zeros(3, np.int64),
        extremes=no_extremes(n_wheelsets),
        present=aligned_zeros(EXTREMES),
        unloaded=aligned_zeros((n_wheelsets, 2)),
        decay_part=aligned_zeros(len(system.internal.kind)),
    )


def _smooth_planes(n_wheelsets: int) -> Floats:
    """Planes of rails that are not displaced: they turn nothing."""
    plane = aligned_zeros((n_wheelsets, PLANE_SIZE))
    plane[:, COSINE] = 1.0
    return plane


def no_extremes(n_wheelsets: int) -> Floats:
    """`Work.extremes` before anything has been seen, shape (6, wheelset, EXTREMES)."""
    extremes = aligned_zeros((6, n_wheelsets, EXTREMES))
    extremes[MAX] = -np.inf
    extremes[MIN] = np.inf
    return extremes


def level_track(system: System) -> System:
    """Return the same system on straight, level, smooth, frictionless track, no given loads."""
    cells = 4
    length = float(np.ptp(system.frame_offset)) + 100.0
    coefficients = np.zeros((cells, 6, 4))
    ds = 2.0 * length / cells
    coefficients[:, 0, 0] = -length + ds * np.arange(cells)
    coefficients[:, 0, 1] = 1.0
    start = float(np.min(system.frame_offset)) - length / 2.0
    coefficients[:, 0, 0] += start + length
    track = TrackTables(start, ds, coefficients, np.zeros((cells, 6, 4)), 0)
    nothing = system.loads._replace(
        body=system.loads.body[:0], point=system.loads.point[:0], flags=system.loads.flags[:0]
    )
    even = system.support._replace(variation=system.support.variation[:0])
    return system._replace(track=track, support=even, drive=CONSTANT_SPEED, loads=nothing)


def level_track_with_friction(system: System) -> System:
    """As `level_track`, with the largest friction that each rail of the real track has."""
    level = level_track(system)
    rail = level.track.rail.copy()
    for row in (MU_LEFT, MU_RIGHT):
        rail[:, row, 0] = np.max(system.track.rail[:, row, 0])
    return level._replace(track=level.track._replace(rail=rail))


def support_arrays(definition: SupportDefinition) -> Support:
    """Arrays of the moving track model; the track's elastic parts as they follow from the file."""
    values = definition.values
    variation = np.array(definition.variation or (), dtype=float).reshape(-1, 3)
    if values is None:
        return Support(0, 0, 0, np.zeros(SUPPORT_ROW), variation)
    (k_y, c_y), (k_z, c_z) = values.pad_lateral, values.pad_vertical
    ballast_y, ballast_z = values.ballast_lateral or (0.0, 0.0), values.ballast_vertical
    k_side, c_side = ballast_z or (0.0, 0.0)
    square = values.ballast_base**2
    row = np.array(
        [
            values.rail_mass,
            values.sleeper_mass,
            values.sleeper_inertia,
            k_y,
            c_y,
            k_z,
            c_z,
            *ballast_y,
            2.0 * k_side,
            2.0 * c_side,
            2.0 * square * k_side,
            2.0 * square * c_side,
            0.5 * CANT_BASE,
        ]
    )
    return Support(1, int(values.has_sleeper), int(values.massless), row, variation)


def drive_arrays(drive: DriveDefinition) -> Drive:
    """Arrays of the way the speed goes along the track."""
    if drive.mode == "table":
        return Drive(TABLE, np.array(drive.speed_table, dtype=float), np.zeros(3))
    if drive.mode == "free":
        traction = drive.traction_table or ((0.0, 0.0),)
        return Drive(FREE, np.array(traction, dtype=float), np.array(drive.resistance))
    return CONSTANT_SPEED


def _names(bodies: Sequence[FlatBody]) -> list[str]:
    return [body.name for body in bodies]


def _bodies(flat: FlatVehicle) -> tuple[Bodies, Floats]:
    """Arrays of the bodies, and the arc length of each track frame from the reference body."""
    names = _names(flat.bodies)
    origin = flat.body(flat.reference).position[0]
    places = [round(body.position[0] - origin, 9) for body in flat.bodies]
    offsets = sorted(set(places))
    kinds = np.array(
        [FIXED if body.fixed else _KINDS[body.kind] for body in flat.bodies], dtype=np.int64
    )
    bodies = Bodies(
        kind=kinds,
        frame=np.array([offsets.index(place) for place in places], dtype=np.int64),
        parent=np.array(
            [names.index(body.parent) if body.parent else -1 for body in flat.bodies],
            dtype=np.int64,
        ),
        row=aligned(np.array([_body_row(body) for body in flat.bodies])),
        whole=np.flatnonzero(kinds != AXLEBOX),
        axleboxes=np.flatnonzero(kinds == AXLEBOX),
        fixed=np.flatnonzero(kinds == FIXED),
        references=np.array([names.index(flat.reference)], dtype=np.int64),
    )
    return bodies, np.array(offsets)


def _body_row(body: FlatBody) -> tuple[float, ...]:
    inertia = (1.0, body.pitch_inertia, 1.0) if body.kind == "axlebox" else body.inertia
    radius = 0.5 * sum(body.wheelset.radius) if body.wheelset else 1.0
    return (
        max(body.mass, 1e-9),
        *inertia,
        body.position[1],
        body.position[2],
        radius,
        float(body.wheelset is not None),
    )


def on_common_grid(tables: Sequence[ContactTable]) -> tuple[float, list[Floats]]:
    """First node and values of contact tables over the range that all of them cover."""
    dy = tables[0].dy
    first = max(round(t.y0 / dy) for t in tables)
    last = min(round(t.y0 / dy) + t.values.shape[3] for t in tables)
    starts = [first - round(t.y0 / dy) for t in tables]
    parts = [
        t.values[..., start : start + last - first, :]
        for t, start in zip(tables, starts, strict=True)
    ]
    return tables[starts.index(0)].y0, parts


def side_by_side(tables: Sequence[Floats]) -> Floats:
    """Contact tables as one array; a single one as it lies in memory (or on disk)."""
    values = tables[0][None] if len(tables) == 1 else np.stack(tables)
    if values.ctypes.data % CACHE_LINE:
        values = aligned(values)
    # as on disk: for an array that can be written to the time loop would be compiled anew
    values.setflags(write=False)
    return values


class SharedTables:
    """Tables of the track and of the contacts that several models on one track share.

    Attributes
    ----------
    track : TrackTables or None
        Once the first model is there.
    contact : dict
        Contact tables by what they depend on beside track and settings.
    """

    def __init__(self) -> None:
        self.track: TrackTables | None = None
        self.contact: dict[tuple[Any, ...], ContactTable] = {}


class _ProfileBook:
    """Loads each profile once and remembers which ones were used."""

    def __init__(self, known: dict[str, Profile]) -> None:
        self._known = known
        self.used: dict[str, Profile] = {}

    def profile(self, name: str, kind: Kind) -> Profile:
        if name not in self.used:
            self.used[name] = self._known.get(name) or load_profile(name, kind=kind)
        return self.used[name]


def _contact(
    flat: FlatVehicle,
    track: Track,
    settings: Settings,
    book: _ProfileBook,
    known: dict[tuple[Any, ...], ContactTable],
) -> tuple[Contact, tuple[ContactTable, ...]]:
    """Contact arrays: one table for each different wheel on its rail."""
    wheelsets = flat.of_kind("wheelset")
    keys: dict[tuple[Any, ...], int] = {}
    tables: list[ContactTable] = []
    which = np.zeros((len(wheelsets), 2), dtype=np.int64)
    for w, body in enumerate(wheelsets):
        wheelset = body.wheelset
        assert wheelset is not None
        for side in range(2):
            key = (
                wheelset.profile[side],
                track.rail[side],
                wheelset.radius[side],
                -body.position[2],
                wheelset.back_to_back,
                wheelset.tape_circle_distance,
            )
            wheel = book.profile(wheelset.profile[side], "wheel")
            rail = book.profile(track.rail[side], "rail")
            if key not in known:
                known[key] = cached_contact_table(
                    wheel,
                    rail,
                    radius=wheelset.radius[side],
                    gauge=track.gauge,
                    inclination=track.inclination,
                    back_to_back=wheelset.back_to_back,
                    tape_circle_distance=wheelset.tape_circle_distance,
                    G=settings.shear_modulus,
                    nu=settings.poisson,
                    centre_height=-body.position[2],
                    normal=settings.normal_contact,
                )
            if key not in keys:
                keys[key] = len(tables)
                tables.append(known[key])
            which[w, side] = keys[key]
    if not tables:
        raise ModelError("a vehicle needs at least one wheelset")
    first = tables[0]
    y0, values = on_common_grid(tables)
    falling = track.friction_falling
    law_table = creep_table(settings.poisson) if settings.creep_law == "table" else NO_TABLE
    names = _names(flat.bodies)
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
        dw=first.dw,
        creep=creep_tables(settings.poisson),
        shear_modulus=settings.shear_modulus,
        damping=settings.contact_damping,
        n_x=settings.fastsim_grid[0],
        n_y=settings.fastsim_grid[1],
        law=LAW_NUMBERS[settings.creep_law],
        reduction=track.third_body[0],
        slip_reduction=track.third_body[1],
        friction_rest=falling.rest if falling else 1.0,
        friction_decay=falling.decay if falling else 0.0,
        law_table=law_table.coefficients,
        law_scale=law_table.scale,
    )
    return contact, tuple(tables)
