"""Names of modes after the field, from where their kinetic energy is.

Car bodies are the rigid bodies that no element joins to a wheelset or axlebox (where there are
none, the heaviest ones); bogies are those that one does.

=============  ==================================================================================
car body       more than half of the energy is in car bodies: bounce, pitch, yaw, longitudinal,
               of a body with another name after that (tank yaw); lateral with roll is lower sway
               where both are in phase (the pole lies below the centre of gravity), else upper sway
hunting        a wheelset whose yaw V/(omega y) is 1 +- 0.3 and about 90 degrees ahead or behind,
               and whose y is at least half of the largest lateral motion; of the bogie that moves
               most
bogie          the frames have 30 % of the energy and more: bounce, pitch, roll, lateral, yaw,
               longitudinal, in phase or out of phase between the bogies; of a lighter body of a
               bogie, such as an axle-hung motor, after that (motor pitch)
rolling        the whole vehicle runs along the track: eigenvalue zero
=============  ==================================================================================

Any other mode is called after what has most of its energy: car body, bogie, or wheelsets with the
component, and which of them move.

Any mixture of modes with the same eigenvalue is a mode too, such as that of two bogies that do not
feel each other.  Named are those that lie farthest apart along the vehicle, the foremost first.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from railsim.arrays import Complexes, Floats
from railsim.kernels.system import AXLEBOX, FIXED, RIGID, WHEELSET
from railsim.linear.coordinates import Coordinates
from railsim.linear.eigenmodes import SLOWEST, Eigenmodes, divergent
from railsim.model.assembly import Model
from railsim.notation import COMPONENTS

ALIKE = 1e-6  # relative distance of eigenvalues whose modes are any mixture, by rounding
NEAR_ZERO = 0.05  # 1/s, |lambda| of rolling
HUNTING_RATIO = 0.3
HUNTING_PHASE = np.radians(45.0)
CAR_NAMES = {0: "longitudinal", 2: "bounce", 4: "pitch", 5: "yaw"}
WHEELSET_NAMES = ("longitudinal", "lateral", "vertical", "roll", "rotation", "yaw")
MOVES = 0.3  # share of the largest energy from which on a wheelset is named
LEAST_OF_FRAMES = 0.3  # share of the frames in a mode of the bogies
BOGIE_NAMES = ("longitudinal", "lateral", "bounce", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class Parts:
    """Which bodies, by their indices, are what."""

    model: Model
    coordinates: Coordinates
    cars: tuple[int, ...]
    frames: tuple[int, ...]
    wheelsets: tuple[int, ...]

    @cached_property
    def _inertia(self) -> Floats:
        """Mass three times and moments of inertia, float64[n_bodies, 6]."""
        bodies = self.model.system.bodies
        return np.hstack([np.repeat(bodies.mass[:, None], 3, axis=1), bodies.inertia])

    def energy_shares(self, shape: Complexes) -> Floats:
        """Share of each body and component in the kinetic energy, float64[n_bodies, 6]."""
        c = self.coordinates
        own = c.velocities
        energy = np.zeros_like(self._inertia)
        entries = c.bodies[own], c.components[own]
        energy[entries] = self._inertia[entries] * np.abs(shape[own]) ** 2
        total = float(energy.sum())
        return energy / total if total > 0.0 else energy

    def component(self, shape: Complexes, body: int, component: int) -> complex:
        """Position component of a shape, 0 where the body is held or has none."""
        index = self.coordinates.position_of.get((body, component))
        return 0j if index is None else complex(shape[index])

    def bogie_of(self, body: int) -> str:
        """First part of a body's dotted name."""
        return self.model.index.bodies[body].split(".")[0]


def parts_of(model: Model, coordinates: Coordinates) -> Parts:
    """Tell car bodies from bogie frames by the elements that join them to wheelsets."""
    bodies = model.system.bodies
    rolling = {int(b) for b in np.flatnonzero((bodies.kind == WHEELSET) | (bodies.kind == AXLEBOX))}
    pairs = [*model.system.links.body.tolist(), *model.system.mounts.body.tolist()]
    carried = {a for pair in pairs for a, b in (pair, pair[::-1]) if b in rolling} - rolling
    rigid = [int(b) for b in np.flatnonzero((bodies.kind == RIGID) | (bodies.kind == FIXED))]
    cars = [b for b in rigid if b not in carried]
    if not cars and rigid:
        heaviest = max(float(bodies.mass[b]) for b in rigid)
        cars = [b for b in rigid if bodies.mass[b] > 0.5 * heaviest]
        if len(cars) > 1 and len(cars) == len(rigid):
            cars = []  # bogies alone
    frames = tuple(b for b in rigid if b not in cars)
    wheelsets = tuple(int(b) for b in model.system.contact.body)
    return Parts(model, coordinates, tuple(cars), frames, wheelsets)


def apart(parts: Parts, modes: Eigenmodes) -> Eigenmodes:
    """Modes in which those of the same eigenvalue are the ones farthest apart along the vehicle.

    Within the space of such modes the place of the kinetic energy, x^H W X x over x^H W x with the
    inertia W and the position X of each body, is stationary.
    """
    c, values, shapes = parts.coordinates, modes.eigenvalues, modes.shapes.copy()
    own = c.velocities
    inertia = parts._inertia[c.bodies[own], c.components[own]]
    place = np.array([body.position[0] for body in parts.model.flat.bodies])[c.bodies[own]]
    left = np.flatnonzero(modes.frequencies > SLOWEST)
    while len(left):
        near = np.abs(values[left] - values[left[0]]) < ALIKE * np.abs(values[left[0]])
        alike, left = left[near], left[~near]
        if len(alike) > 1:
            speeds = shapes[alike][:, own]
            at, energy = ((speeds.conj() * w) @ speeds.T for w in (inertia * place, inertia))
            if np.linalg.cond(energy) > 1.0 / ALIKE:  # one shape in two
                continue
            mixed = eigh(at, energy)[1][:, ::-1].T @ shapes[alike]
            largest = np.argmax(np.abs(mixed), axis=1)
            shapes[alike] = mixed / mixed[np.arange(len(alike)), largest][:, None]
    return replace(modes, shapes=shapes)


def mode_name(parts: Parts, modes: Eigenmodes, k: int = 0) -> str:
    """Name one of the modes of a vehicle at a speed."""
    shape, eigenvalue = modes.shapes[k], complex(modes.eigenvalues[k])
    speed = modes.linearisation.parameter
    shares = parts.energy_shares(shape)
    if abs(eigenvalue) < NEAR_ZERO and shares[:, 0].sum() + shares[:, 4].sum() > 0.9:
        return "rolling"
    hunting = _hunting_bogie(parts, shape, shares, eigenvalue, speed)
    if hunting is not None:
        return f"{hunting} hunting".strip()
    if parts.cars and shares[list(parts.cars)].sum() > 0.5:
        return _car_name(parts, shape, shares)
    frames = list(parts.frames)
    if frames and shares[frames].sum() > LEAST_OF_FRAMES:
        return _bogie_name(parts, shape, shares)
    body, component = divmod(int(np.argmax(shares)), shares.shape[1])
    if body in parts.cars:
        return _car_name(parts, shape, shares)
    if body in parts.wheelsets:
        return _wheelset_name(parts, shares, component)
    return f"{parts.model.index.bodies[body]}.{COMPONENTS[component]}"


def divergence(parts: Parts, modes: Eigenmodes) -> tuple[str, ...]:
    """Remark on an equilibrium that is left without an oscillation.

    Wheelsets leave it, as on hollow treads, where one moves at least half as far as the body that
    moves farthest; under a body that tips over they hardly move.
    """
    mode = divergent(modes)
    if mode is None:
        return ()
    bodies = (*parts.wheelsets, *parts.cars, *parts.frames)
    ways = {b: max(abs(parts.component(mode.shapes[0], b, k)) for k in range(3)) for b in bodies}
    farthest = max(bodies, key=lambda body: ways[body])
    cause = ""
    if max(ways[body] for body in parts.wheelsets) < 0.5 * ways[farthest]:
        name = parts.model.index.bodies[farthest]
        cause = f", and {name} moves farthest, as where springs do not hold it upright"
    elif ways[farthest] > 0.0:
        hollow = "as on hollow treads, whose radius falls towards the flange at first"
        cause = f" for one beside it, {hollow}"
    return (
        f"a motion that does not oscillate grows by {mode.eigenvalues[0].real:.3g} 1/s: the "
        f"vehicle leaves the state that is linearised{cause}; modes and linear critical speeds are "
        "not those of where it runs",
    )


def _wheelset_name(parts: Parts, shares: Floats, component: int) -> str:
    """Name of a mode of wheelsets: which move, where not all do."""
    most = float(shares[list(parts.wheelsets), component].max())
    moving = [b for b in parts.wheelsets if shares[b, component] > MOVES * most]
    names = [parts.model.index.bodies[b].removesuffix(".wheelset") for b in moving]
    bogies = {parts.bogie_of(b) for b in moving}
    words = f"wheelset{'s' * (len(moving) > 1)} {WHEELSET_NAMES[component]}"
    if len(moving) == len(parts.wheelsets):
        return words
    return (
        f"{words}, {bogies.pop() if len(bogies) == 1 and len(names) > 1 else ' and '.join(names)}"
    )


def _car_name(parts: Parts, shape: Complexes, shares: Floats) -> str:
    component = int(np.argmax(shares[list(parts.cars)].sum(axis=0)))
    car = max(parts.cars, key=lambda b: float(shares[b].sum()))
    if component in CAR_NAMES:
        name = parts.model.index.bodies[car].split(".")[-1].replace("_", " ")
        words = "car body" if name == "carbody" else name
        return f"{words if len(parts.cars) == 1 else 'car bodies'} {CAR_NAMES[component]}"
    y, roll = parts.component(shape, car, 1), parts.component(shape, car, 3)
    return "lower sway" if (y * roll.conjugate()).real > 0.0 else "upper sway"


def _bogie_name(parts: Parts, shape: Complexes, shares: Floats) -> str:
    """Name of a mode of bogies: a motor on its axles has its own name, the heaviest body none."""
    component = int(np.argmax(shares[list(parts.frames)].sum(axis=0)))
    body = max(parts.frames, key=lambda b: float(shares[b, component]))
    names, mass = parts.model.index.bodies, parts.model.system.bodies.mass
    bogie = [b for b in parts.frames if parts.bogie_of(b) == parts.bogie_of(body)]
    heaviest = mass[body] >= max(mass[b] for b in bogie)
    words = "bogie" if heaviest else names[body].split(".")[-1].replace("_", " ")
    alike = [b for b in parts.frames if names[b].split(".")[1:] == names[body].split(".")[1:]]
    return f"{words} {BOGIE_NAMES[component]}{_phase(parts, shape, component, alike)}"


def _phase(parts: Parts, shape: Complexes, component: int, alike: list[int]) -> str:
    """Whether a body moves together in the outermost bogies, or against each other."""
    if len(alike) < 2:
        return ""
    first, last = (parts.component(shape, alike[k], component) for k in (0, -1))
    if min(abs(first), abs(last)) < 0.1 * max(abs(first), abs(last)):
        return f", {parts.bogie_of(alike[0] if abs(first) > abs(last) else alike[-1])}"
    return ", in phase" if (first * last.conjugate()).real > 0.0 else ", out of phase"


def _hunting_bogie(
    parts: Parts, shape: Complexes, shares: Floats, eigenvalue: complex, speed: float
) -> str | None:
    """Name of the bogie that hunts most, empty without bogies; None where nothing hunts."""
    omega = eigenvalue.imag
    # yaw or roll of a frame takes its wheelsets along
    own = float(shares[list(parts.frames)][:, [3, 5]].sum()) if parts.frames else 0.0
    if omega <= 0.0 or shares[:, [1, 5]].sum() < 0.5 or own > 0.5:
        return None
    everything = [
        abs(parts.component(shape, b, 1)) for b in (*parts.cars, *parts.frames, *parts.wheelsets)
    ]
    largest = max(everything, default=0.0)
    best: tuple[float, int] | None = None
    for body in parts.wheelsets:
        y, yaw = parts.component(shape, body, 1), parts.component(shape, body, 5)
        if abs(y) < 0.5 * largest or abs(y) == 0.0:
            continue
        ratio = abs(yaw) * speed / (omega * abs(y))
        phase = abs(abs(np.angle(yaw / y)) - 0.5 * np.pi) if abs(yaw) else np.pi
        is_hunting = abs(ratio - 1.0) <= HUNTING_RATIO and phase < HUNTING_PHASE
        if is_hunting and (best is None or abs(y) > best[0]):
            best = abs(y), body
    if best is None:
        return None
    several = len({parts.bogie_of(body) for body in parts.wheelsets}) > 1
    return parts.bogie_of(best[1]) if several and parts.frames else ""
