"""Remarks on implausible values of a vehicle, often errors of sign or unit.

What is looked at needs no rails and no run: where the bodies lie, the vertical modes of the bodies
on their springs with the wheelsets held, and how the weight is shared by the supports.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from railsim.constants import GRAVITY
from railsim.definitions.base import Remark
from railsim.definitions.elements.base import FreeLength
from railsim.definitions.elements.side_bearer import SideBearer
from railsim.definitions.elements.spring_damper import SpringDamper
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import FlatElement, FlatVehicle, flatten
from railsim.errors import ModelError

if TYPE_CHECKING:
    from railsim.model.assembly import Model

Floats = NDArray[np.float64]

LOWEST = (0.3, 10.0)
"""Lowest vertical frequency of a vehicle on its springs [Hz]: soft air springs, empty wagons."""
HIGHEST = 500.0
"""Vertical frequency of a body on steel [Hz], a light bolster under a centre plate 100 Hz."""
DAMPED = 1.5
"""Damping ratio of the lowest vertical mode; secondary dampers give 0.1 to 0.4."""
WHEEL_LOAD = (8e3, 250e3)
"""Mean static wheel load [N]: an empty light railcar has 20 kN, an ore wagon 200 kN."""
SPRING_LOAD = (0.6, 1.5)
"""Static load of a spring over the load at which its length was measured."""
SPRING_TRAVEL = 0.7
"""Static compression of a spring over its free length, coils on each other."""


def vehicle_remarks(
    vehicle: Vehicle, balanced: "Model | None" = None, *, supports: bool = True
) -> list[Remark]:
    """Return what is unlike all experience in a vehicle, equal findings as one line.

    Parameters
    ----------
    vehicle : Vehicle
    balanced : Model, optional
        Its model with preloads, where there is one.
    supports : bool
        Whether the weight on each support is computed too; it needs the compiler's import.

    Examples
    --------
    >>> from railsim.definitions.loading import load_vehicle
    >>> coach = load_vehicle("coach_manchester", ["bodies.carbody.position.2=1.8"])
    >>> print(vehicle_remarks(coach)[0])
    carbody: below the rails, z up to 1.8 m: z points down, a height of 1 m is z = -1
    """
    flat = flatten(vehicle) if balanced is None else balanced.flat
    found = [*_below_the_rails(flat), *_wheel_load(flat), *_vertical_modes(flat)]
    found += _pulling(flat)
    return [*found, *_supports(vehicle, balanced)] if supports else found


def gathered(what: str, names: Sequence[str]) -> Remark:
    """Return one remark for several parts with the same finding, the first ones by name."""
    first = ", ".join(names[:3])
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return Remark(first + more, what)


def _below_the_rails(flat: FlatVehicle) -> list[Remark]:
    names = [body.name for body in flat.bodies if body.kind == "body" and body.position[2] > 0.0]
    if not names:
        return []
    low = max(body.position[2] for body in flat.bodies)
    text = f"below the rails, z up to {low:g} m: z points down, a height of 1 m is z = -1"
    return [gathered(text, names)]


def _wheel_load(flat: FlatVehicle) -> list[Remark]:
    mass = sum(body.mass for body in flat.bodies)
    load = mass * GRAVITY / (2 * len(flat.of_kind("wheelset")))
    if WHEEL_LOAD[0] <= load <= WHEEL_LOAD[1]:
        return []
    low, high = (f"{limit / 1e3:g}" for limit in WHEEL_LOAD)
    text = f"mean static wheel load {load / 1e3:.3g} kN, railways have {low} to {high} kN"
    return [Remark("mass", f"{text}: are all masses in kg?")]


# vertical modes -----------------------------------------------------------------------------------


def _vertical_modes(flat: FlatVehicle) -> list[Remark]:
    """Remarks on frequencies and damping of the vertical motion, wheelsets held."""
    names = [body.name for body in flat.bodies if body.kind == "body" and not body.fixed]
    if not names:
        return []
    stiffness, damping = _network(flat, names)
    # coordinates in which the masses are 1; scipy's eigh takes masses, and long to import
    scale = 1.0 / np.sqrt([flat.body(name).mass for name in names])
    squares, shapes = np.linalg.eigh(stiffness * np.outer(scale, scale))
    shapes *= scale[:, None]
    frequency = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
    carried = np.flatnonzero(frequency > 1e-3)
    if not len(carried):
        return []
    found = []
    low, high = int(carried[0]), int(carried[-1])
    usual = f"railway vehicles have {LOWEST[0]:g} to {LOWEST[1]:g} Hz"
    if not LOWEST[0] <= frequency[low] <= LOWEST[1]:
        text = f"bounces at {frequency[low]:.3g} Hz on its springs, {usual}"
        found.append(
            Remark(_largest(names, shapes[:, low]), f"{text}: stiffness in N/m, mass in kg?")
        )
    if frequency[high] > HIGHEST:
        text = f"vibrates at {frequency[high]:.3g} Hz on its springs, above {HIGHEST:g} Hz"
        found.append(
            Remark(_largest(names, shapes[:, high]), f"{text}: stiffness in N/m, mass in kg?")
        )
    shape = shapes[:, low]
    ratio = float(shape @ damping @ shape) / (4.0 * np.pi * frequency[low])
    if ratio > DAMPED:
        text = f"damping ratio {ratio:.3g} of its bounce, usual is 0.1 to 0.4"
        found.append(Remark(_largest(names, shape), f"{text}: are dampings in N s/m?"))
    return found


def _largest(names: Sequence[str], shape: Floats) -> str:
    return names[int(np.argmax(np.abs(shape)))]


def _network(flat: FlatVehicle, names: Sequence[str]) -> tuple[Floats, Floats]:
    """Vertical stiffness and damping matrices of the bodies `names`, all others held."""
    index = {name: k for k, name in enumerate(names)}
    matrices = np.zeros((2, len(names), len(names)))
    for element in flat.elements:
        values = np.array([_upright(element) * element.definition.vertical_stiffness, 0.0])
        values[1] = _upright(element) * element.definition.vertical_damping
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


@dataclass(frozen=True)
class _Support:
    """A spring that carries weight: its element and its compression at rest [N]."""

    element: FlatElement
    load: float


def _pulling(flat: FlatVehicle) -> list[Remark]:
    """Remarks on springs that are longer between their seats than without load."""
    names: dict[str, list[str]] = {}
    for element in flat.elements:
        law = element.definition
        if not isinstance(law, FreeLength) or not law.has_free_length or _upright(element) < 0.5:
            continue
        way = np.array(element.point2) - np.array(element.point1)
        length = float(np.linalg.norm(way) if isinstance(law, SpringDamper) else abs(way[2]))
        stiffness = element.definition.vertical_stiffness
        force = law.compression(stiffness, length)
        if force < 0.0:
            free = length + force / stiffness
            text = (
                f"pulls with {-force / 1e3:.3g} kN: {1e3 * free:.4g} mm long without load, and "
                f"{1e3 * length:.4g} mm between its seats"
            )
            names.setdefault(text, []).append(element.name)
    return [gathered(text, parts) for text, parts in names.items()]


def _supports(vehicle: Vehicle, balanced: "Model | None") -> list[Remark]:
    """Remarks on how the springs share the weight at rest."""
    from railsim.model.assembly import without_rails
    from railsim.model.preloads import static_shares

    try:
        model = balanced or without_rails(vehicle)
        shares = static_shares(model, solved=balanced is not None and _as_they_are(balanced))
    except ModelError as error:
        return [Remark("elements", str(error))]
    parts = {element.name: element for element in model.flat.elements}
    supports = [_Support(parts[name], force) for name, force in shares.items() if name in parts]
    return [*_pulled(model.flat, supports), *_idle(supports), *_other_loads(supports)]


def _as_they_are(balanced: "Model") -> bool:
    """Whether the preloads of a model with preloads carry it in its nominal position."""
    return balanced.design is None and not any(
        element.definition.has_free_length for element in balanced.flat.elements
    )


def _pulled(flat: FlatVehicle, supports: Iterable[_Support]) -> list[Remark]:
    kinds = {body.name: body.kind for body in flat.bodies}
    pulled = [
        support
        for support in supports
        if _carries_from_below(support.element, kinds) and support.load < -1.0
    ]
    if not pulled:
        return []
    most = max(-support.load for support in pulled)
    text = (
        f"in tension at rest, up to {most / 1e3:.3g} kN: does the body above stand where it should?"
    )
    return [gathered(text, [support.element.name for support in pulled])]


def _idle(supports: Iterable[_Support]) -> list[Remark]:
    """Pads that only press, and would have to pull for the vehicle to stand as it is drawn."""
    idle = [
        support.element.name
        for support in supports
        if isinstance(support.element.definition, SideBearer) and support.load <= 0.0
    ]
    return [gathered("carries nothing at rest, it would have to pull", idle)] if idle else []


def _carries_from_below(element: FlatElement, kinds: Mapping[str, str]) -> bool:
    """Whether an element is a support that carries from below; others may hang."""
    if element.definition.SUPPORTS == "on axles":
        ends = {kinds[element.body1], kinds.get(element.body2, "")}
        return bool(ends & {"wheelset", "axlebox"})
    return element.definition.SUPPORTS == "always"


def _other_loads(supports: Iterable[_Support]) -> list[Remark]:
    """Springs whose load is unlike that at which they were measured, or that are compressed far."""
    names: dict[str, list[str]] = {}
    for support in supports:
        law = support.element.definition
        measured = getattr(law, "load_at_length", None)
        if measured is not None:
            low, high = SPRING_LOAD
            if not low <= support.load / measured[0] <= high:
                text = (
                    f"carries {support.load / 1e3:.3g} kN at rest, its length was measured under "
                    f"{measured[0] / 1e3:.3g} kN: another spring's data?"
                )
                names.setdefault(text, []).append(support.element.name)
        free = getattr(law, "free_length", None)
        if free is not None:
            compression = support.load / law.vertical_stiffness
            if compression > SPRING_TRAVEL * free:
                text = (
                    f"is compressed by {1e3 * compression:.3g} of {1e3 * free:.3g} mm at rest: "
                    "it would be coil-bound"
                )
                names.setdefault(text, []).append(support.element.name)
    return [gathered(text, parts) for text, parts in names.items()]
