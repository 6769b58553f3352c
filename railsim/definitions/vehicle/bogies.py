"""Which wheelsets carry the car, the bogie frame above each, and what belongs to its bogie."""

from collections import defaultdict
from collections.abc import Mapping, Set

from railsim.definitions.elements.traction import is_about_axle
from railsim.definitions.vehicle.flatten import FlatBody, FlatVehicle

NEAR = 3.0  # a frame lies no further from its wheelset than this along the vehicle [m]


def frame_above(flat: FlatVehicle, wheelset: FlatBody) -> FlatBody | None:
    """Return the bogie frame above a wheelset; None where no body is near.

    Of the bodies on the shortest ways over elements from the wheelset to the reference body the
    nearest one along the vehicle: a motor that hangs on the axle is on none of them.  Where there
    is no such body, the nearest of all.
    """
    between = _between(flat, wheelset.name)
    others = [body for body in flat.of_kind("body") if body.name != flat.reference]
    candidates = [body for body in others if body.name in between] or others

    def distance(body: FlatBody) -> float:
        return abs(body.position[0] - wheelset.position[0])

    nearest = min(candidates, key=distance, default=None)
    return nearest if nearest is not None and distance(nearest) <= NEAR else None


def bogie_name(flat: FlatVehicle, wheelset: FlatBody) -> str:
    """Name of the bogie of a wheelset: of its frame's assembly, or of the frame itself.

    Without a frame above it, the first part of the wheelset's name.
    """
    frame = frame_above(flat, wheelset)
    if frame is None:
        return wheelset.name.split(".")[0]
    return frame.name.rpartition(".")[0] or frame.name


def bogie_mass(flat: FlatVehicle, wheelset: FlatBody) -> float:
    """Mass of frame, assembly and wheelsets of the bogie of a wheelset [kg]; 0 without a frame."""
    frame = frame_above(flat, wheelset)
    if frame is None:
        return 0.0
    assembly = frame.name.rpartition(".")[0]
    inside = [
        body
        for body in flat.of_kind("body")
        if body is frame
        or (assembly and body.name.startswith(f"{assembly}.") and body.name != flat.reference)
    ]
    wheelsets = [w for w in flat.of_kind("wheelset") if frame_above(flat, w) is frame]
    return sum(body.mass for body in (*inside, *wheelsets))


def carrying(flat: FlatVehicle) -> tuple[FlatBody, ...]:
    """Return the wheelsets that carry the reference body, of a train those of its car.

    On the way from another car's wheelset there is that car: a body of half the mass of the
    reference body or more.  All wheelsets where none is found.
    """
    heavy = 0.5 * flat.body(flat.reference).mass
    wheelsets = flat.of_kind("wheelset")
    carriers = []
    for wheelset in wheelsets:
        between = _between(flat, wheelset.name)
        cars = [name for name in between if flat.body(name).mass >= heavy and name != wheelset.name]
        if cars == [flat.reference]:
            carriers.append(wheelset)
    return tuple(carriers) or wheelsets


def _between(flat: FlatVehicle, wheelset: str) -> Set[str]:
    """Names of the bodies on the shortest ways from a wheelset to the reference body."""
    neighbours: dict[str, set[str]] = defaultdict(set)
    holding = [e for e in flat.elements if e.body2 and not is_about_axle(e.definition)]
    ends = [(e.body1, e.body2) for e in holding]
    ends += [(body.name, body.parent) for body in flat.bodies if body.parent]
    for first, second in ends:
        neighbours[first].add(second)
        neighbours[second].add(first)
    outward, back = _steps(neighbours, wheelset), _steps(neighbours, flat.reference)
    if flat.reference not in outward:
        return set()
    return {name for name in outward if outward[name] + back[name] == outward[flat.reference]}


def _steps(neighbours: Mapping[str, Set[str]], begin: str) -> dict[str, int]:
    """Least number of elements from a body to every other one that can be reached."""
    steps, edge = {begin: 0}, {begin}
    while edge:
        edge = {name for body in edge for name in neighbours.get(body, ())} - steps.keys()
        steps |= dict.fromkeys(edge, max(steps.values()) + 1)
    return steps
