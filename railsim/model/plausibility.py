"""Remarks on implausible values of a vehicle, often errors of sign or unit.

What is looked at needs no rails and no run: where the bodies lie, the vertical modes of the bodies
on their springs with the wheelsets held, and how the weight is shared by the supports.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import numpy as np

from railsim.arrays import Floats
from railsim.constants import FASTEST
from railsim.contact.gauges import wheel_gauge
from railsim.definitions import Track, Vehicle
from railsim.definitions.base import Remark, once
from railsim.definitions.elements.base import Element, FreeLength, two_sided
from railsim.definitions.elements.friction import SideBearer
from railsim.definitions.elements.springs import BumpStop, SpringDamper
from railsim.definitions.track.check_rail import CheckRail
from railsim.definitions.vehicle.flatten import FlatElement, FlatVehicle, flatten
from railsim.errors import ModelError, listed

if TYPE_CHECKING:
    from railsim.model.assembly import Model


LOWEST = (0.3, 10.0)
"""Lowest vertical frequency of a vehicle on its springs [Hz]: soft air springs, empty wagons."""
HIGHEST = 500.0
"""Vertical frequency of a body on steel [Hz], a light bolster under a centre plate 100 Hz."""
DAMPED = 1.5
"""Damping ratio of the lowest vertical mode; secondary dampers give 0.1 to 0.4."""
WHEEL_LOAD = (8e3, 250e3)
"""Mean static wheel load [N]: an empty light railcar has 20 kN, an ore wagon 200 kN."""
LONGEST = 500.0
"""Coordinate of a part [m]: trains measure up to 400 m; a vehicle in mm reaches thousands."""
TRAVEL = 1.0
"""Clearance of a stop or side bearer [m]: railways have some centimetres."""
WHEEL_RADIUS = (0.1, 1.2)
"""Wheel radius [m]: roller wagons have 0.16 m, steam locomotives 1.1 m."""
BACK_TO_BACK = 2.5
"""Distance between the backs of the flanges [m]: as the widest gauge of a track."""
PLAY = (0.045, 0.115)
"""Gauge less the distance of the flange backs [m]: 75 mm at 1435 mm, 80 mm at 1520 mm, 50 mm with
the thin flanges of trams, 110 mm on the widest worn track."""
REACH = 1.5
"""Distance along the vehicle from an axle to an element that acts on it [m]: half a wheelbase."""
INERTIA = 1.3
"""Moment of inertia over the sum of the other two: at most 1, in published data up to 1.29."""
GYRATION = (0.05, 15.0)
"""Radius of gyration of a body [m]: bolsters have 0.2 m, long cars 9 m."""
BESIDE = 5.0
"""Distance of an element from the middle of the track [m]: wagons are 3.5 m wide."""
SLIDING = 0.05
"""Displacement of a pad at rest before it slides [m]: rubber 10 mm, steel on steel 1 mm or less."""
HEIGHT = 8.0
"""Height of a body above the rails [m]: raised pantographs reach 6.5 m."""
DAMPER = (200.0, 1e7)
"""Damping of a damper [N s/m]: 4 kN s/m to 2.5 MN s/m."""
LAG = 1.0
"""Damping over series stiffness of a damper [s]: 0.3 s at most, of yaw dampers."""
SPRING_LOAD = (0.6, 1.5)
"""Static load of a spring over the load at which its length was measured."""
SPRING_TRAVEL = 0.7
"""Static compression of a spring over its free length, coils on each other."""


def vehicle_remarks(
    vehicle: Vehicle, balanced: "Model | None" = None, *, supports: bool = True
) -> list[Remark]:
    """Return what is unlike all experience in a vehicle, equal findings as one line.

    `balanced`: its model with preloads, where there is one; `supports`: whether the weight on each
    support is computed too; it needs the compiler's import.

    >>> from railsim.definitions.loading import load_vehicle
    >>> coach = load_vehicle("coach_manchester", ["bodies.carbody.inertia.0=4e7"])
    >>> print(vehicle_remarks(coach)[0])
    carbody: a moment of inertia is above the sum of the other two: Ixx, Iyy, Izz in this order?
    """
    found = once(vehicle, "_remarks_without_supports", lambda: _without_supports(vehicle))
    return [*found, *(_supports(vehicle, balanced) if supports else ())]


def _without_supports(vehicle: Vehicle) -> list[Remark]:
    flat, service = flatten(vehicle), vehicle.service
    points = {f"sensors.{name}": point.position for name, point in vehicle.sensors.items()}
    found: list[Remark] = []
    if service is not None:
        points |= {f"service.points.{name}": at.position for name, at in service.points.items()}
        points["service.floor_height"] = (0.0, 0.0, -service.floor_height)
        if (speed := service.admissible_speed) > FASTEST:
            text = f"{speed:g} m/s are {3.6 * speed:.0f} km/h: is the speed in m/s?"
            found.append(Remark("service.admissible_speed", text))
    found += [*_bodies(flat, points), *_by_text(_far_from_axles(flat)), *_vertical_modes(flat)]
    found += [*_by_text(_pulling(flat)), *_by_text(_coefficients(flat))]
    for name in vehicle.loads:
        of_load = _bodies(flatten(vehicle.model_copy(update={"load": name})), points)
        found += [Remark(f"loads.{name}: {r.key}", r.text) for r in of_load if r not in found]
    return found


def _bodies(flat: FlatVehicle, points: Mapping[str, Sequence[float]]) -> list[Remark]:
    """Remarks on places, `points` by name among them, inertias and the mass."""
    found = [*_below_the_rails(flat, points), *_heights(flat), *_lengths(flat, points)]
    return [*found, *_inertias(flat), *_wheel_load(flat)]


def gauge_remarks(flat: FlatVehicle, track: Track) -> list[Remark]:
    """Return wheelsets that are too narrow or too wide for the gauge of a track to be meant."""
    low, high = PLAY
    texts: dict[str, list[str]] = {}
    for body in flat.of_kind("wheelset"):
        assert body.wheelset is not None
        backs = body.wheelset.back_to_back
        if not low <= (play := track.gauge - backs) <= high:
            text = (
                f"back_to_back {1e3 * backs:g} mm is {1e3 * play:.4g} mm less than the gauge, "
                f"{1e3 * track.gauge:g} mm; railways have {1e3 * low:g} to {1e3 * high:g} mm"
            )
            texts.setdefault(text, []).append(body.name)
    return [one_remark(text, names) for text, names in texts.items()]


def narrow_remarks(model: "Model", gauge: float) -> list[Remark]:
    """Remark on rails that come closer than the flanges of a wheelset are apart."""
    tables = model.system.track
    apart = gauge + tables.rail[:, 2, 0] - tables.rail[:, 0, 0]
    texts: dict[str, list[str]] = {}
    for body in model.flat.of_kind("wheelset"):
        assert body.wheelset is not None
        thick = sum(wheel_gauge(model.profiles[name])[1] for name in body.wheelset.profile)
        over = body.wheelset.back_to_back + thick
        if apart[k := int(np.argmin(apart))] < over:
            text = (
                f"{1e3 * over:.1f} mm over its flanges, the rails are {1e3 * apart[k]:.1f} mm "
                f"apart at s = {tables.s_start + k * tables.ds:.1f} m: it wedges between them"
            )
            texts.setdefault(text, []).append(body.name)
    return [one_remark(text, names) for text, names in texts.items()]


def flangeway_remarks(model: "Model", track: Track) -> list[Remark]:
    """Remark on flangeways narrower than a flange, and on two that leave the backs no room."""
    texts: dict[str, list[str]] = {}
    for body in model.flat.of_kind("wheelset"):
        wheelset = body.wheelset
        assert wheelset is not None
        for k, part in enumerate(track.check_rail):
            wheel = model.profiles[wheelset.profile[part.rail == "right"]]
            width, thick = min(width for _, width in part.rows), wheel_gauge(wheel)[1]
            text = f"a flange of {1e3 * thick:.1f} mm in the flangeway of check_rail.{k}, "
            if width < thick:
                texts.setdefault(f"{text}{1e3 * width:.1f} mm", []).append(body.name)
        for (i, a), (k, b) in combinations(enumerate(track.check_rail), 2):
            apart = track.gauge - _narrowest(a, b)
            text = f"{1e3 * wheelset.back_to_back:.1f} mm between its backs, the faces of "
            text += f"check_rail.{i} and {k} are {1e3 * apart:.1f} mm apart: it wedges on them"
            if a.rail != b.rail and apart > wheelset.back_to_back:
                texts.setdefault(text, []).append(body.name)
    return [one_remark(text, names) for text, names in texts.items()]


def _narrowest(a: CheckRail, b: CheckRail) -> float:
    """Least sum of two flangeways where both are [m]; infinite where they are nowhere together."""
    (s_a, of_a), (s_b, of_b) = (np.transpose(part.rows) for part in (a, b))
    s = np.union1d(s_a, s_b)
    s = s[(s >= max(s_a[0], s_b[0])) & (s <= min(s_a[-1], s_b[-1]))]
    return float(np.min(np.interp(s, s_a, of_a) + np.interp(s, s_b, of_b), initial=np.inf))


def profile_remarks(model: "Model", known: Iterable[str] | None = None) -> tuple[str, ...]:
    """Remarks on what was recognised and corrected in profiles, but for those `given` as such."""
    return tuple(
        f"Profile {name}: {'; '.join(profile.notes)}."
        for name, profile in model.profiles.items()
        if profile.notes and name not in (known or ())
    )


def one_remark(text: str, names: Sequence[str]) -> Remark:
    """Return one remark for several parts with the same finding, the first ones by name."""
    return Remark(listed(names), text)


def _below_the_rails(flat: FlatVehicle, points: Mapping[str, Sequence[float]]) -> Iterator[Remark]:
    heights = {body.name: body.position[2] for body in flat.bodies if body.kind == "body"}
    heights |= {e.name: max(e.point1[2], e.point2[2]) for e in flat.elements}
    heights |= {name: point[2] for name, point in points.items()}
    names = [name for name, z in heights.items() if z > 0.0]
    if names:
        low = max(heights.values())
        text = f"below the rails, z up to {low:g} m: z points down, a height of 1 m is z = -1"
        yield one_remark(text, names)


def _heights(flat: FlatVehicle) -> Iterator[Remark]:
    heights = {b.name: -b.position[2] for b in flat.bodies if HEIGHT < -b.position[2] <= LONGEST}
    if heights:
        text = f"up to {max(heights.values()):g} m above the rails: is its position in m?"
        yield one_remark(text, [*heights])


def _lengths(flat: FlatVehicle, points: Mapping[str, Sequence[float]]) -> Iterator[Remark]:
    """Remarks on lengths that are not those of a railway vehicle in metres."""
    far = {body.name: max(map(abs, body.position)) for body in flat.bodies}
    far |= {e.name: max(map(abs, (*e.point1, *e.point2))) for e in flat.elements}
    far |= {name: max(map(abs, point)) for name, point in points.items()}
    names = [name for name, most in far.items() if most > LONGEST]
    if names:
        yield one_remark(f"up to {max(far.values()):g} m from the origin: are lengths in m?", names)
    beside = {e.name: max(abs(e.point1[1]), abs(e.point2[1])) for e in flat.elements}
    if names := [name for name, y in beside.items() if BESIDE < y <= LONGEST]:
        most = max(beside[name] for name in names)
        yield one_remark(f"up to {most:g} m beside the middle of the track: is it in m?", names)
    travels = {e.name: _travel(e.definition) for e in flat.elements}
    names = [name for name, most in travels.items() if most > TRAVEL]
    if names:
        yield one_remark(
            f"no force before {max(travels.values()):g} m of travel: is it in m?", names
        )
    low, high = WHEEL_RADIUS
    usual = f"railways have {low:g} to {high:g} m"
    texts: dict[str, list[str]] = {}
    for body in flat.bodies:
        if body.wheelset is None:
            continue
        for radius in body.wheelset.radius:
            if not low <= radius <= high:
                texts.setdefault(f"wheel radius {radius:g} m, {usual}", []).append(body.name)
        backs = body.wheelset.back_to_back
        if backs > BACK_TO_BACK:
            text = f"back_to_back {backs:g} m, usual is at most {BACK_TO_BACK:g} m"
            texts.setdefault(text, []).append(body.name)
    for text, parts in texts.items():
        yield one_remark(f"{text}: is it in m?", list(dict.fromkeys(parts)))


def _travel(element: Element) -> float:
    """How far an element moves before it acts: clearance, or free travel of a stop [m]."""
    if isinstance(element, BumpStop):
        rows = two_sided(element.table)
        ends = [abs(y if f else x) for (x, f), (y, g) in pairwise(rows) if bool(f) != bool(g)]
        return min(ends, default=0.0 if rows[0][1] else math.inf)
    return element.clearance if isinstance(element, SideBearer) else 0.0


def _far_from_axles(flat: FlatVehicle) -> Iterator[tuple[str, FlatElement]]:
    """Elements that act on an axle far from them, mostly another one than meant."""
    axles = {b.name: b.position[0] for b in flat.bodies if b.kind in ("wheelset", "axlebox")}
    for element in flat.elements:
        for body, point in ((element.body1, element.point1), (element.body2, element.point2)):
            away = abs(point[0] - axles.get(body, point[0]))
            if away > REACH:
                text = (
                    f"acts on {body} from {away:.3g} m along the vehicle: another axle's element?"
                )
                yield text, element


def _inertias(flat: FlatVehicle) -> Iterator[Remark]:
    """Remarks on moments of inertia that no distribution of mass has, as Ixx + Iyy >= Izz."""
    names = [
        b.name for b in flat.bodies if max(b.inertia) > INERTIA * (sum(b.inertia) - max(b.inertia))
    ]
    if names:
        text = "a moment of inertia is above the sum of the other two"
        yield one_remark(f"{text}: Ixx, Iyy, Izz in this order?", names)
    axles = [b.name for b in flat.of_kind("wheelset") if b.inertia[1] > min(b.inertia)]
    if axles:
        text = "the moment of inertia about the axle is not the smallest"
        yield one_remark(f"{text}: Ixx, Iyy, Izz in this order?", axles)
    low, high = GYRATION
    radii = {b.name: np.sqrt(np.array(b.inertia) / b.mass) for b in flat.bodies if b.mass > 0.0}
    odd = {k: r[(r < low) | (r > high)] for k, r in radii.items()}
    if names := [name for name, r in odd.items() if len(r)]:
        text = f"radius of gyration {odd[names[0]][0]:.3g} m, railways have {low:g} to {high:g} m"
        yield one_remark(f"{text}: is the mass in kg, the inertia in kg m2?", names)


def _coefficients(flat: FlatVehicle) -> Iterator[tuple[str, FlatElement]]:
    """Friction above 1; dampings of no damper, and springs in series that give way before it."""
    for element in flat.elements:
        law = element.definition
        friction = float(np.max(getattr(law, "friction_coefficient", 0.0)))
        if friction > 1.0:
            yield f"coefficient of friction {friction:g}, railways have at most 0.5", element
        if not isinstance(law, SpringDamper) or not law.damping:
            continue
        if not DAMPER[0] <= law.damping <= DAMPER[1]:
            yield f"damping {law.damping:g} N s/m, railways have 4e3 to 2.5e6: in N s/m?", element
        elif law.damping > LAG * law.series_stiffness > 0.0:
            words = f"damping {law.damping:g} N s/m gives way at {law.series_stiffness:g} N/m"
            yield f"{words} in series: in N s/m and N/m?", element


def _wheel_load(flat: FlatVehicle) -> Iterator[Remark]:
    load = flat.mean_wheel_load
    if not WHEEL_LOAD[0] <= load <= WHEEL_LOAD[1]:
        low, high = (f"{limit / 1e3:g}" for limit in WHEEL_LOAD)
        text = f"mean static wheel load {load / 1e3:.3g} kN, railways have {low} to {high} kN"
        yield Remark("mass", f"{text}: are all masses in kg?")


# vertical modes -----------------------------------------------------------------------------------


def _vertical_modes(flat: FlatVehicle) -> Iterator[Remark]:
    """Remarks on frequencies and damping of the vertical motion, wheelsets held."""
    names = [body.name for body in flat.bodies if body.kind == "body" and not body.fixed]
    stiffness, damping = _network(flat, names)
    # coordinates in which the masses are 1; scipy's eigh takes masses, and long to import
    scale = 1.0 / np.sqrt([flat.body(name).mass for name in names])
    squares, shapes = np.linalg.eigh(stiffness * np.outer(scale, scale))
    shapes *= scale[:, None]
    frequency = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
    carried = np.flatnonzero(frequency > 1e-3)
    if not len(carried):
        return
    low, high = int(carried[0]), int(carried[-1])
    usual = f"railway vehicles have {LOWEST[0]:g} to {LOWEST[1]:g} Hz"
    units = "stiffness in N/m, mass in kg?"
    if not LOWEST[0] <= frequency[low] <= LOWEST[1]:
        text = f"bounces at {frequency[low]:.3g} Hz on its springs, {usual}: {units}"
        yield Remark(_largest(names, shapes[:, low]), text)
    if frequency[high] > HIGHEST:
        text = f"vibrates at {frequency[high]:.3g} Hz on its springs, above {HIGHEST:g} Hz: {units}"
        yield Remark(_largest(names, shapes[:, high]), text)
    shape = shapes[:, low]
    ratio = float(shape @ damping @ shape) / (4.0 * np.pi * frequency[low])
    if ratio > DAMPED:
        text = f"damping ratio {ratio:.3g} of its bounce, usual is 0.1 to 0.4"
        yield Remark(_largest(names, shape), f"{text}: are dampings in N s/m?")


def _largest(names: Sequence[str], shape: Floats) -> str:
    return names[int(np.argmax(np.abs(shape)))]


def _network(flat: FlatVehicle, names: Sequence[str]) -> tuple[Floats, Floats]:
    """Vertical stiffness and damping matrices of the bodies `names`, all others held."""
    index = {name: k for k, name in enumerate(names)}
    matrices = np.zeros((2, len(names), len(names)))
    for element in flat.elements:
        law = element.definition
        values = _upright(element) * np.array([law.vertical_stiffness, law.vertical_damping])
        ends = [index[body] for body in (element.body1, element.body2) if body in index]
        for i in ends:
            for j in ends:
                matrices[:, i, j] += values if i == j else -values
    return matrices[0], matrices[1]


def _upright(element: FlatElement) -> float:
    """Share of a link's stiffness that acts vertically; 1 for all other elements."""
    if not isinstance(element.definition, SpringDamper):
        return 1.0
    way = np.array(element.point2) - np.array(element.point1)
    return float(way[2] ** 2 / (way @ way))


# supports -----------------------------------------------------------------------------------------


Supports = Sequence[tuple[FlatElement, float]]
"""Springs that carry weight, with their compression at rest [N]."""


def _by_text(elements_by_text: Iterable[tuple[str, FlatElement]]) -> Iterator[Remark]:
    """Remarks on elements, those with the same text as one."""
    names: dict[str, list[str]] = {}
    for text, element in elements_by_text:
        names.setdefault(text, []).append(element.name)
    for text, parts in names.items():
        yield one_remark(text, parts)


def _pulling(flat: FlatVehicle) -> Iterator[tuple[str, FlatElement]]:
    """Springs that are longer between their seats than without load."""
    for element in flat.elements:
        law = element.definition
        if not isinstance(law, FreeLength) or not law.has_free_length or _upright(element) < 0.5:
            continue
        way = np.array(element.point2) - np.array(element.point1)
        length = float(np.linalg.norm(way) if isinstance(law, SpringDamper) else abs(way[2]))
        stiffness = law.vertical_stiffness
        force = law.compression(stiffness, length)
        if force < 0.0:
            free = length + force / stiffness
            yield (
                f"pulls with {-force / 1e3:.3g} kN: {1e3 * free:.4g} mm long without load, and "
                f"{1e3 * length:.4g} mm between its seats",
                element,
            )


def _supports(vehicle: Vehicle, equilibrium: "Model | None") -> Iterator[Remark]:
    """Remarks on how the springs share the weight at rest."""
    from railsim.model.assembly import without_rails
    from railsim.model.preloads import static_shares

    # whether the preloads of a model with preloads carry it in its nominal position
    solved = equilibrium is not None and not (
        equilibrium.design or any(e.definition.has_free_length for e in equilibrium.flat.elements)
    )
    try:
        model = equilibrium or without_rails(vehicle)
        shares = static_shares(model, solved=solved)
    except ModelError as error:
        yield Remark("elements", str(error))
        return
    parts = {element.name: element for element in model.flat.elements}
    supports = [(parts[name], force) for name, force in shares.items() if name in parts]
    yield from _in_tension(model.flat, supports)
    # pads that only press, and would have to pull for the vehicle to stand as it is drawn
    idle = [e.name for e, load in supports if isinstance(e.definition, SideBearer) and load <= 0.0]
    if idle:
        yield one_remark("carries nothing at rest, it would have to pull", idle)
    yield from _by_text(_other_loads(supports))


def _in_tension(flat: FlatVehicle, supports: Supports) -> Iterator[Remark]:
    kinds = {body.name: body.kind for body in flat.bodies}
    pulled = {e.name: -load for e, load in supports if load < -1.0 and _from_below(e, kinds)}
    if pulled:
        most = max(pulled.values()) / 1e3
        text = (
            f"in tension at rest, up to {most:.3g} kN: does the body above stand where it should?"
        )
        yield one_remark(text, [*pulled])


def _from_below(element: FlatElement, kinds: Mapping[str, str]) -> bool:
    """Whether an element is a support that carries from below; others may hang."""
    if element.definition.SUPPORTS == "on axles":
        ends = {kinds[element.body1], kinds.get(element.body2, "")}
        return bool(ends & {"wheelset", "axlebox"})
    return element.definition.SUPPORTS == "always"


def _other_loads(supports: Supports) -> Iterator[tuple[str, FlatElement]]:
    """Pads that stick for too long; springs with another load than measured, or compressed far."""
    for element, load in supports:
        law = element.definition
        if isinstance(law, SideBearer):
            way = law.friction_coefficient * load / law.stick_stiffness
            if way > SLIDING:
                yield f"slides after {way:.3g} m only: is stick_stiffness in N/m?", element
        measured = getattr(law, "load_at_length", None)
        if measured is not None and not SPRING_LOAD[0] <= load / measured[0] <= SPRING_LOAD[1]:
            yield (
                f"carries {load / 1e3:.3g} kN at rest, its length was measured under "
                f"{measured[0] / 1e3:.3g} kN: another spring's data?",
                element,
            )
        free = getattr(law, "free_length", None)
        compression = load / law.vertical_stiffness if free is not None else 0.0
        if free is not None and compression > SPRING_TRAVEL * free:
            yield (
                f"is compressed by {1e3 * compression:.3g} of {1e3 * free:.3g} mm at rest: "
                "it would be coil-bound",
                element,
            )
