"""From definitions to the flat arrays of `railsim.kernels.system`, and names to numbers.

`assemble` is the only place that knows both sides: what a user wrote (bodies, elements with names)
and what the kernels read (arrays with indices).  `Index` keeps the way back.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.contact.kalker import creep_tables
from railsim.contact.table import ContactTable, cached_contact_table
from railsim.definitions.elements import (
    Bushing,
    BumpStop,
    Element,
    RollBar,
    ShearSpring,
    SpringDamper,
    two_sided,
)
from railsim.definitions.flatten import FlatBody, FlatElement, FlatVehicle, flatten
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import ModelError
from railsim.kernels.contact_table import LOOK_UP_SIZE, N_PATCH
from railsim.kernels.fastsim import fastsim_workspace
from railsim.kernels.system import (
    AXLEBOX,
    RIGID,
    WHEELSET,
    Bodies,
    Contact,
    Curves,
    Links,
    Mounts,
    System,
    Work,
)
from railsim.kernels.track_frame import FRAME_SIZE, TrackTables
from railsim.kernels.wheel_rail import PATCH_ROWS, WHEEL_COLUMNS
from railsim.profiles import Profile, load_profile
from railsim.track.tables import track_tables

Floats = NDArray[np.float64]
GRAVITY = 9.81  # m/s2, as in the reference study
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
    """

    system: System
    index: Index
    flat: FlatVehicle
    tables: tuple[ContactTable, ...]
    profiles: Mapping[str, Profile]

    @property
    def n_state(self) -> int:
        """Length of the state vector."""
        return 12 * self.index.n_bodies + self.system.maxwell.shape[0] + 2


def assemble(
    vehicle: Vehicle,
    track: Track,
    settings: Settings,
    profiles: Mapping[str, Profile] | None = None,
) -> Model:
    """Build the arrays of one vehicle on one track.

    Parameters
    ----------
    vehicle, track, settings : Vehicle, Track, Settings
        Valid definitions.
    profiles : mapping of str to Profile, optional
        Profiles by name that take precedence over built-in ones and files (a result carries those
        that it used).

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
    contact, tables = _contact(flat, track, settings, book)
    elements = _Elements({body.name: body for body in flat.bodies}, _names(flat.bodies))
    for element in flat.elements:
        elements.add(element)
    bodies, offsets = _bodies(flat)
    system = System(
        bodies=bodies,
        frame_offset=offsets,
        track=track_tables(track),
        contact=contact,
        links=elements.links(),
        mounts=elements.mounts(),
        curves=elements.curves(),
        maxwell=np.array(elements.maxwell_rows, dtype=float).reshape(-1, 2),
        gravity=GRAVITY,
    )
    index = Index(
        bodies=tuple(_names(flat.bodies)),
        wheelsets=tuple(body.name for body in flat.of_kind("wheelset")),
        links=tuple(row["name"] for row in elements.link_rows),
        mounts=tuple(row["name"] for row in elements.mount_rows),
    )
    return Model(system, index, flat, tables, book.used)


def work_arrays(system: System) -> Work:
    """Scratch arrays for `system`."""
    n = len(system.bodies.kind)
    n_wheelsets = len(system.contact.body)
    n_patches = 2 * N_PATCH * n_wheelsets
    n_frames = len(system.frame_offset)
    return Work(
        frames=np.zeros((n_frames, FRAME_SIZE)),
        cell=np.zeros(n_frames, dtype=np.int64),
        cell_u=np.zeros(n_frames),
        R=np.zeros((n, 9)),
        X=np.zeros((n, 3)),
        V=np.zeros((n, 3)),
        W=np.zeros((n, 3)),
        F=np.zeros((n, 3)),
        M=np.zeros((n, 3)),
        S=np.zeros((n, 4)),
        C=np.zeros((n, 9)),
        rail_force=np.zeros((n, 6)),
        acceleration=np.zeros((n, 6)),
        maxwell_rate=np.zeros(len(system.maxwell)),
        spin_damping=np.zeros(n),
        look_up=np.zeros(LOOK_UP_SIZE),
        rail=np.zeros(4),
        patch_index=np.zeros((n_patches, 3), dtype=np.int64),
        patch=np.zeros((PATCH_ROWS, n_patches)),
        fastsim=fastsim_workspace(n_patches, system.contact.n_y),
        wheel=np.zeros((n_wheelsets, 2, WHEEL_COLUMNS)),
    )


def level_track(system: System) -> System:
    """Return the same system on straight, level, smooth and frictionless track."""
    cells = 4
    length = float(np.ptp(system.frame_offset)) + 100.0
    coefficients = np.zeros((cells, 6, 4))
    ds = 2.0 * length / cells
    coefficients[:, 0, 0] = -length + ds * np.arange(cells)
    coefficients[:, 0, 1] = 1.0
    start = float(np.min(system.frame_offset)) - length / 2.0
    coefficients[:, 0, 0] += start + length
    track = TrackTables(start, ds, coefficients, np.zeros((cells, 6, 4)), 0)
    return system._replace(track=track)


def _names(bodies: Sequence[FlatBody]) -> list[str]:
    return [body.name for body in bodies]


def _bodies(flat: FlatVehicle) -> tuple[Bodies, Floats]:
    """Arrays of the bodies, and the arc length of each track frame from the reference body."""
    names = _names(flat.bodies)
    origin = flat.body(flat.reference).position[0]
    places = [round(body.position[0] - origin, 9) for body in flat.bodies]
    offsets = sorted(set(places))
    bodies = Bodies(
        kind=np.array([_KINDS[body.kind] for body in flat.bodies], dtype=np.int64),
        frame=np.array([offsets.index(place) for place in places], dtype=np.int64),
        parent=np.array(
            [names.index(body.parent) if body.parent else -1 for body in flat.bodies],
            dtype=np.int64,
        ),
        mass=np.array([max(body.mass, 1e-9) for body in flat.bodies]),
        inertia=np.array([_inertia(body) for body in flat.bodies]),
        nominal=np.array([[body.position[1], body.position[2]] for body in flat.bodies]),
        radius=np.array([_nominal_radius(body) for body in flat.bodies]),
        reference=names.index(flat.reference),
    )
    return bodies, np.array(offsets)


def _inertia(body: FlatBody) -> tuple[float, float, float]:
    return (1.0, body.pitch_inertia, 1.0) if body.kind == "axlebox" else body.inertia


def _nominal_radius(body: FlatBody) -> float:
    return 0.5 * sum(body.wheelset.radius) if body.wheelset else 1.0


class _ProfileBook:
    """Loads each profile once and remembers which ones were used."""

    def __init__(self, known: dict[str, Profile]) -> None:
        self._known = known
        self.used: dict[str, Profile] = {}

    def profile(self, name: str, kind: str) -> Profile:
        if name not in self.used:
            self.used[name] = self._known.get(name) or load_profile(name, kind=kind)
        return self.used[name]


def _contact(
    flat: FlatVehicle, track: Track, settings: Settings, book: _ProfileBook
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
            key = (wheelset.profile[side], track.rail[side], wheelset.radius[side],
                   -body.position[2], wheelset.back_to_back, wheelset.tape_circle_distance)
            if key not in keys:
                keys[key] = len(tables)
                tables.append(cached_contact_table(
                    book.profile(wheelset.profile[side], "wheel"),
                    book.profile(track.rail[side], "rail"),
                    radius=wheelset.radius[side],
                    gauge=track.gauge,
                    inclination=track.inclination,
                    back_to_back=wheelset.back_to_back,
                    tape_circle_distance=wheelset.tape_circle_distance,
                    G=settings.shear_modulus,
                    nu=settings.poisson,
                ))
            which[w, side] = keys[key]
    if not tables:
        raise ModelError("a vehicle needs at least one wheelset")
    first = tables[0]
    # one table is used as it lies in memory (or on disk); several are put side by side
    values = first.values[None] if len(tables) == 1 else np.stack([t.values for t in tables])
    names = _names(flat.bodies)
    contact = Contact(
        body=np.array([names.index(body.name) for body in wheelsets], dtype=np.int64),
        table=which,
        values=np.ascontiguousarray(values, dtype=float),
        shear=np.array([t.shear for t in tables]),
        y0=first.y0,
        dy=first.dy,
        roll0=first.roll0,
        droll=first.droll,
        dw=first.dw,
        creep=creep_tables(settings.poisson),
        shear_modulus=settings.shear_modulus,
        damping=settings.contact_damping,
        n_x=settings.fastsim_grid[0],
        n_y=settings.fastsim_grid[1],
    )
    return contact, tuple(tables)


@dataclass
class _Elements:
    """Collects elements row by row until the arrays are made."""

    bodies: Mapping[str, FlatBody]
    names: Sequence[str]
    link_rows: list[dict[str, Any]] = field(default_factory=list)
    mount_rows: list[dict[str, Any]] = field(default_factory=list)
    maxwell_rows: list[tuple[float, float]] = field(default_factory=list)
    curve_rows: list[Floats] = field(default_factory=list)

    def add(self, element: FlatElement) -> None:
        """Append one element to the rows of its group."""
        definition = element.definition
        if isinstance(definition, SpringDamper):
            self._add_link(element, definition)
        else:
            self.mount_rows.append(self._mount(element, definition))

    def _add_link(self, element: FlatElement, law: SpringDamper) -> None:
        point1, point2 = np.array(element.point1), np.array(element.point2)
        in_series = law.series_stiffness > 0.0
        preload = 0.0 if law.preload == "auto" else law.preload
        self.link_rows.append({
            "name": element.name,
            "body": self._pair(element),
            "point": self._levers(element, point1, point2),
            "length": float(np.linalg.norm(point2 - point1)),
            "spring": (law.stiffness, 0.0 if in_series else law.damping, preload),
            "maxwell": self._maxwell(law.damping, law.series_stiffness),
            "curve": (self._curve(law.spring_table), self._curve(law.damper_table)),
        })

    def _mount(self, element: FlatElement, law: Element) -> dict[str, Any]:
        point1, point2 = np.array(element.point1), np.array(element.point2)
        row: dict[str, Any] = {
            "name": element.name,
            "body": self._pair(element),
            # body 1 reaches rigidly to the point on body 2, where the deflection is measured
            "point": self._levers(element, point2, point2),
            "stiffness": (0.0, 0.0, 0.0), "damping": (0.0, 0.0, 0.0), "preload": (0.0, 0.0, 0.0),
            "rotation": (0.0, 0.0, 0.0), "rotation_damping": (0.0, 0.0, 0.0),
            "maxwell": (-1, -1, -1), "curve": (-1, -1, -1), "flags": (1, 0, 0),
        }
        if isinstance(law, Bushing):
            pairs = list(zip(law.damping, law.series_stiffness, strict=True))
            row["stiffness"] = law.stiffness
            row["damping"] = tuple(c if k_s == 0.0 else 0.0 for c, k_s in pairs)
            row["maxwell"] = tuple(self._maxwell(c, k_s) for c, k_s in pairs)
            row["rotation"] = rotation_potential(law.rotational_stiffness)
            row["rotation_damping"] = law.rotational_damping
            row["flags"] = (1, 0, int(any(law.rotational_stiffness + law.rotational_damping)))
            row["preload"] = _given(law.preload)
        elif isinstance(law, ShearSpring):
            middle = 0.5 * (point1 + point2)
            bending = (*law.bending_stiffness, law.torsional_stiffness)
            row["point"] = self._levers(element, middle, middle)
            row["stiffness"] = law.stiffness
            row["damping"] = law.damping
            row["rotation"] = rotation_potential(bending)
            row["flags"] = (1, 1, int(any(bending)))
            row["preload"] = _given(law.preload)
        elif isinstance(law, RollBar):
            row["rotation"] = rotation_potential((law.stiffness, 0.0, 0.0))
            row["rotation_damping"] = (law.damping, 0.0, 0.0)
            row["flags"] = (0, 0, 1)
        elif isinstance(law, BumpStop):
            curve = [-1, -1, -1]
            curve["xyz".index(law.axis)] = self._curve(law.table)
            row["curve"] = tuple(curve)
        else:
            raise ModelError(f"{element.name}: no force law for '{type(law).__name__}'")
        return row

    def _pair(self, element: FlatElement) -> tuple[int, int]:
        return self.names.index(element.body1), self.names.index(element.body2)

    def _levers(self, element: FlatElement, point1: Floats, point2: Floats) -> Floats:
        centre1 = np.array(self.bodies[element.body1].position)
        centre2 = np.array(self.bodies[element.body2].position)
        # an axlebox turns about its axle: its levers count from the wheelset's centre
        return np.array([point1 - self._centre(element.body1, centre1),
                         point2 - self._centre(element.body2, centre2)])

    def _centre(self, name: str, own: Floats) -> Floats:
        parent = self.bodies[name].parent
        return np.array(self.bodies[parent].position) if parent else own

    def _maxwell(self, damping: float, series_stiffness: float) -> int:
        if series_stiffness == 0.0 or damping == 0.0:
            return -1
        self.maxwell_rows.append((damping, series_stiffness))
        return len(self.maxwell_rows) - 1

    def _curve(self, table: tuple[tuple[float, float], ...] | None) -> int:
        if table is None:
            return -1
        self.curve_rows.append(np.array(two_sided(table)))
        return len(self.curve_rows) - 1

    def links(self) -> Links:
        """Arrays of all point-to-point elements."""
        rows = self.link_rows
        return Links(
            body=_column(rows, "body", (2,), np.int64),
            point=_column(rows, "point", (2, 3)),
            length=_column(rows, "length", ()),
            spring=_column(rows, "spring", (3,)),
            maxwell=_column(rows, "maxwell", (), np.int64),
            curve=_column(rows, "curve", (2,), np.int64),
        )

    def mounts(self) -> Mounts:
        """Arrays of all three-axis elements."""
        rows = self.mount_rows
        floats = ("stiffness", "damping", "preload", "rotation", "rotation_damping")
        integers = ("maxwell", "curve", "flags")
        return Mounts(
            body=_column(rows, "body", (2,), np.int64),
            point=_column(rows, "point", (2, 3)),
            **{key: _column(rows, key, (3,)) for key in floats},
            **{key: _column(rows, key, (3,), np.int64) for key in integers},
        )

    def curves(self) -> Curves:
        """All tables, one after the other."""
        lengths = [len(rows) for rows in self.curve_rows]
        points = np.concatenate(self.curve_rows) if self.curve_rows else np.zeros((0, 2))
        return Curves(
            start=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
            x=np.ascontiguousarray(points[:, 0]),
            f=np.ascontiguousarray(points[:, 1]),
        )


def rotation_potential(stiffness: Sequence[float]) -> tuple[float, float, float]:
    """K_d of U = tr(K_d (1 - R)) that gives the stiffnesses about x, y, z for small angles.

    The moment about axis i is (sum(K_d) - K_d,i) theta_i, hence K_d,i = sum(k)/2 - k_i.

    Parameters
    ----------
    stiffness : sequence of 3 floats
        k_x, k_y, k_z [N m/rad].

    Returns
    -------
    tuple of 3 floats
        K_d [N m]; negative entries are in order.
    """
    half = 0.5 * sum(stiffness)
    return half - stiffness[0], half - stiffness[1], half - stiffness[2]


def _given(preload: Any) -> tuple[float, float, float]:
    return (0.0, 0.0, 0.0) if preload == "auto" else preload


def _column(
    rows: list[dict[str, Any]], key: str, shape: tuple[int, ...], dtype: type = np.float64
) -> NDArray[Any]:
    return np.array([row[key] for row in rows], dtype=dtype).reshape(len(rows), *shape)
