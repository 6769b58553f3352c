"""`static_loads`: a vehicle at rest on straight level track, in one load case.

Wheel loads, the heights at which its bodies stand, force and length of every spring, and how far
every stop is from touching.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import dist, nan
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.constants import GRAVITY
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.elements.base import two_sided
from railsim.definitions.loading import check_types, load_track
from railsim.definitions.vehicle.flatten import FlatElement
from railsim.kernels.element_outputs import DEFLECTION, FORCE, LINK, MOUNT
from railsim.laws import permitted_part
from railsim.model.assembly import Model, assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.preloads import nominal_forces
from railsim.model.time_step import empty_recorder, record_state
from railsim.profiles import Profile
from railsim.table import Column, Table

# The equilibrium is followed by that of steady rolling, which needs a speed [m/s].
SLOW = 10.0
NO_FORCE = 1.0  # less than this is nothing that a spring carries [N]
FAR = 5e-3  # from the nominal height: worth a sentence [m]
DESIGN = "design"

_ABOVE = [
    Column("height", "height of its centre", "m", ".3f"),
    Column("raised", "above nominal", "mm", ".1f"),
    Column("roll", "", "mrad", ".2f"),
    Column("pitch", "", "mrad", ".2f"),
]
_SPRING = [
    Column("force", "compression", "kN", ".3f"),
    Column("length", "length", "mm", ".1f"),
    Column("shortened", "shorter than nominal", "mm", ".2f"),
]
_GAP = [Column("forward", "gap, +", "mm", ".2f"), Column("backward", "gap, -", "mm", ".2f")]


@dataclass(frozen=True, eq=False)
class StaticLoads:
    """A vehicle at rest.

    Attributes
    ----------
    wheelsets : tuple of str
        Names from the leading end.
    Q0 : ndarray, shape (wheelset, side)
        Static wheel loads, left and right [N].
    preload : mapping of str to ndarray
        Preloads by element: tension of an element between two points, shape (1,), or force on
        the first body, shape (3,); elements without preload are left out [N].  They are forces
        in the nominal position, which only the design load has; at rest see `springs`.
    load : str
        Load case, ``design`` where none was chosen.
    heights : Table
        Bodies: height of the centre of gravity over the rails, and how far that is above the
        nominal position; roll and pitch.
    springs : Table
        Elements that carry: force of compression, length where the ends are apart, and how much
        shorter they are than in the nominal position.
    stops : Table
        Elements with free travel: what is left of it to both sides of their axis; negative where
        the stop carries.
    masses : Table
        Bodies: mass and weight.
    """

    wheelsets: tuple[str, ...]
    Q0: Floats
    preload: Mapping[str, Floats]
    load: str
    heights: Table
    springs: Table
    stops: Table
    masses: Table

    @property
    def axle_load(self) -> Floats:
        """Static axle loads, shape (wheelset,) [N]."""
        return np.asarray(self.Q0.sum(axis=1))

    @property
    def wheel_loads(self) -> Table:
        """Wheel and axle loads of every wheelset."""
        names = {"left": "Q0 left", "right": "Q0 right", "axle": "axle load"}
        columns = [Column(name, words, "kN", ".3f") for name, words in names.items()]
        rows = zip(self.wheelsets, self.Q0[:, 0], self.Q0[:, 1], self.axle_load, strict=True)
        return Table([Column("wheelset"), *columns], rows, "Static wheel loads")

    @property
    def displaced(self) -> list[str]:
        """What stands far from its nominal height, one sentence a body."""
        return [
            f"{body} stands {1e3 * abs(raised):.0f} mm {'above' if raised > 0.0 else 'below'} its "
            "nominal height"
            for body, raised in zip(self.heights["body"], self.heights["raised"], strict=True)
            if abs(raised) >= FAR
        ]

    @property
    def tables(self) -> tuple[Table, ...]:
        """All tables that hold something."""
        every = (self.wheel_loads, self.heights, self.springs, self.stops, self.masses)
        return tuple(table for table in every if len(table))

    def record(self) -> dict[str, Any]:
        """Return the loads as plain numbers, SI."""
        tables = ("heights", "springs", "stops", "masses")
        return {
            "load": self.load,
            "Q0": dict(zip(self.wheelsets, self.Q0.tolist(), strict=True)),
            "preload": {name: value.tolist() for name, value in self.preload.items()},
            **{name: getattr(self, name).records() for name in tables},
        }

    def __repr__(self) -> str:
        total = self.Q0.sum() / 1e3
        return f"<StaticLoads: {len(self.wheelsets)} wheelsets, together {total:.2f} kN>"

    def _repr_html_(self) -> str:
        return "\n".join(table.html() for table in self.tables)


def static_loads(
    vehicle: Vehicle,
    track: Track | None = None,
    *,
    settings: Settings | None = None,
    profiles: Mapping[str, Profile] | None = None,
) -> StaticLoads:
    """Find how a vehicle, in its load case, stands on straight level track.

    Parameters
    ----------
    vehicle : Vehicle
        Definition, see `load_vehicle`.
    track : Track, optional
        Its rails and gauge count; by default those of the shipped track `straight`.
    settings : Settings, optional
        Elasticity of wheels and rails.
    profiles : mapping of str to Profile, optional
        Profiles that take precedence over built-in ones and files.

    Raises
    ------
    ModelError
        There is no equilibrium.

    Examples
    --------
    >>> import railsim
    >>> loads = railsim.static_loads(railsim.load_vehicle("coach_manchester"))
    >>> (loads.Q0[0] / 1e3).round(1)
    array([68.8, 68.8])
    >>> round(loads.springs["force"][2] / 1e3, 1)
    59.9
    """
    track = load_track("straight") if track is None else track
    check_types([vehicle], track)
    vehicle = permitted_part(vehicle)
    model = assemble(vehicle, track, settings or Settings(), profiles)
    balance = equilibrium(model, SLOW)
    model = balance.model
    preload = dict(zip(model.index.links, np.array(model.system.links.spring[:, 2:]), strict=True))
    preload |= dict(zip(model.index.mounts, nominal_forces(model.system.mounts), strict=True))
    springs, stops = _springs_and_stops(model, balance.state)
    return StaticLoads(
        wheelsets=tuple(model.index.wheelsets),
        Q0=balance.Q0.copy(),
        preload={name: value for name, value in preload.items() if value.any()},
        load=vehicle.load or DESIGN,
        heights=_heights(model, balance.state),
        springs=springs,
        stops=stops,
        masses=_masses(model),
    )


def _heights(model: Model, state: Floats) -> Table:
    """Return where the bodies stand; z points down."""
    rows = []
    for body in model.flat.of_kind("body"):
        first = model.index.coordinate(body.name, 0)
        _, _, z, roll, pitch, _ = state[first : first + 6]
        rows.append([body.name, -body.position[2] - z, -z, roll, pitch])
    return Table([Column("body"), *_ABOVE], rows, "Heights at rest")


def _masses(model: Model) -> Table:
    columns = [Column("mass", unit="t", format=".3f"), Column("weight", unit="kN", format=".2f")]
    rows = [[body.name, body.mass, body.mass * GRAVITY] for body in model.flat.bodies if body.mass]
    total = ["vehicle", model.flat.mass, model.flat.mass * GRAVITY]
    return Table([Column("body"), *columns], [*rows, total], "Weights")


def _springs_and_stops(model: Model, state: Floats) -> tuple[Table, Table]:
    index = model.index
    elements = {element.name: element for element in model.flat.elements}
    members = [(LINK, k, name) for k, name in enumerate(index.links)]
    members += [(MOUNT, k, name) for k, name in enumerate(index.mounts)]
    chosen = np.array([member[:2] for member in members], dtype=np.int64).reshape(-1, 2)
    recorder = empty_recorder(model, 1, chosen)
    record_state(model.system, state, recorder)
    springs, stops = [], []
    for (group, _, name), row in zip(members, recorder.element[0], strict=True):
        element = elements.get(name) or elements[name.rpartition(".")[0]]
        travel, force = row[DEFLECTION : DEFLECTION + 3], row[FORCE : FORCE + 3]
        gaps = _gaps(element, travel)
        if gaps is not None:
            stops.append([name, *gaps])
        carries = element.definition.vertical_stiffness > 0.0
        shorter, pressed = _shortening(element, travel, force, is_link=group == LINK)
        if carries or (abs(pressed) > NO_FORCE and gaps is not None):
            apart = dist(element.point1, element.point2)
            springs.append([name, pressed, apart - shorter if apart > 0.0 else nan, shorter])
    return (
        Table([Column("element"), *_SPRING], springs, "Springs at rest"),
        Table([Column("element"), Column("axis"), *_GAP], stops, "Stops at rest"),
    )


def _shortening(
    element: FlatElement, travel: Floats, force: Floats, *, is_link: bool
) -> tuple[float, float]:
    """By how much an element is shorter than in the nominal position [m], its compression [N]."""
    if is_link:
        return -float(travel[0]), -float(force[0])
    # the body below is pushed down by what stands on it; z points down
    lower_first = element.point1[2] >= element.point2[2]
    sign = 1.0 if lower_first else -1.0
    if element.point1[2] == element.point2[2]:
        sign = 1.0 if force[2] >= 0.0 else -1.0
    return sign * float(travel[2]), sign * float(force[2])


def _gaps(element: FlatElement, travel: Floats) -> tuple[str, float, float] | None:
    """Return axis and free travel to both sides, infinite where there is no stop [m]."""
    law = element.definition
    axis = getattr(law, "axis", "z")
    rows = getattr(law, "stop_table", None)
    if rows is None and getattr(law, "clearance", 0.0) > 0.0:
        return "z", law.clearance - float(travel[2]), np.inf  # type: ignore[attr-defined]
    if rows is None and hasattr(law, "table"):
        rows = two_sided(law.table)
    if rows is None:
        return None
    free = [x for x, force in rows if force == 0.0]
    if not free or min(free) > 0.0 or max(free) < 0.0:
        return None
    moved = float(travel["xyz".index(axis)])
    low = min(free) if min(free) > rows[0][0] else -np.inf
    high = max(free) if max(free) < rows[-1][0] else np.inf
    return axis, high - moved, moved - low
