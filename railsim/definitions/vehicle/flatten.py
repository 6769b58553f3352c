"""From a vehicle as written to plain lists: assemblies placed, mirrored, names resolved.

Two reflections occur: fore and aft (x) for a placement with `mirror = true`, and left and right (y)
for the left copy of a part with `sides = "both"`.  Both move points; parameters with a direction
(preloads, forces) turn with them, stiffness and damping do not.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from railsim.constants import GRAVITY
from railsim.definitions.base import Vector, once
from railsim.definitions.elements.base import Element
from railsim.definitions.elements.traction import is_about_axle
from railsim.definitions.vehicle.loads import in_load_case, load_faults
from railsim.definitions.vehicle.names import name_faults, resolve, sided_names
from railsim.definitions.vehicle.tables import Assembly, Placement, Wheelset
from railsim.errors import Fault, InputError

if TYPE_CHECKING:
    from railsim.definitions.vehicle.definition import Vehicle

# Allowed difference between an axle's height and the wheel radius, and the like [m].
POSITION_TOLERANCE = 1e-3

Group: TypeAlias = "Vehicle | Assembly"
"""What holds parts: the vehicle itself or an assembly."""


@dataclass(frozen=True)
class FlatBody:
    """A body in its nominal position."""

    name: str  # full name, e.g. ``front.outer.wheelset``
    # an axlebox has no mass of its own, only `pitch_inertia`
    kind: Literal["body", "wheelset", "axlebox"]
    mass: float  # [kg]
    inertia: Vector  # principal moments about x, y, z [kg m2]
    position: Vector  # centre of gravity in vehicle axes (an axlebox: its bearing's centre) [m]
    wheelset: Wheelset | None = None  # with radii and profiles
    parent: str | None = None  # wheelset that carries the axlebox
    pitch_inertia: float = 0.0  # of an axlebox about the axle [kg m2]
    fixed: str | None = None  # where a body is held: ``track`` or ``ground``
    key: str = field(default="", compare=False)  # of its table in the file; not of bodies


@dataclass(frozen=True)
class FlatElement:
    """A force element in its nominal position.

    An applied force has no second body (an empty name); an element without points acts at the
    positions of the bodies.
    """

    name: str  # full name, as those of the bodies
    body1: str
    body2: str
    point1: Vector  # in vehicle axes [m]
    point2: Vector
    definition: Element  # with signs as they are in this placement


@dataclass(frozen=True)
class FlatVehicle:
    """A vehicle without assemblies."""

    name: str
    # in the order of the file; wheelsets from the leading end; axleboxes as their wheelsets, left
    # before right
    bodies: tuple[FlatBody, ...]
    elements: tuple[FlatElement, ...]  # in the order of the file, left before right
    reference: str  # name of the body whose arc length is the vehicle's `distance`

    def body(self, name: str) -> FlatBody:
        """Return the body with this full name."""
        return next(body for body in self.bodies if body.name == name)

    def of_kind(self, kind: str) -> tuple[FlatBody, ...]:
        """Return the bodies of one kind, in their order."""
        return tuple(body for body in self.bodies if body.kind == kind)

    def along(self, bodies: Iterable[FlatBody]) -> list[float]:
        """Where bodies stand along the vehicle, from its reference body [m]."""
        origin = self.body(self.reference).position[0]
        return [body.position[0] - origin for body in bodies]

    @property
    def mass(self) -> float:
        """Mass of all bodies [kg]."""
        return sum(body.mass for body in self.bodies)

    @property
    def mean_wheel_load(self) -> float:
        """Weight over the number of wheels [N]."""
        return self.mass * GRAVITY / (2 * len(self.of_kind("wheelset")))


@dataclass(frozen=True)
class _Frame:
    """Where a group stands: names and keys that lead to it, origin and direction of its x axis."""

    scope: tuple[str, ...] = ()
    path: tuple[str, ...] = ()
    origin: Vector = (0.0, 0.0, 0.0)
    x_sign: float = 1.0

    def full(self, name: str) -> str:
        return ".".join((*self.scope, name))

    def key(self, *names: str) -> str:
        return ".".join((*self.path, *names))

    def signs(self, side: str | None) -> Vector:
        return (self.x_sign, -1.0 if side == "left" else 1.0, 1.0)

    def point(self, local: Vector, side: str | None = None) -> Vector:
        signs = self.signs(side)
        return (
            self.origin[0] + signs[0] * local[0],
            self.origin[1] + signs[1] * local[1],
            self.origin[2] + local[2],
        )

    def inner(self, assembly: str, placement: Placement) -> "_Frame":
        return _Frame(
            (*self.scope, placement.name),
            (*self.path, "assemblies", assembly),
            self.point(placement.position),
            -self.x_sign if placement.mirror else self.x_sign,
        )


def groups(group: Group) -> Iterator[Group]:
    """Yield a vehicle and its assemblies, each once."""
    yield group
    for assembly in group.assemblies.values():
        yield from groups(assembly)


def _frames(group: Group, frame: _Frame) -> Iterator[tuple[Group, _Frame]]:
    yield group, frame
    for name, assembly in group.assemblies.items():
        for placement in assembly.placements:
            yield from _frames(assembly, frame.inner(name, placement))


def wrong_type(kind: str, value: object) -> str:
    """Return what is wrong where a name or a file is given instead of what it stands for."""
    found = repr(value) if isinstance(value, str) else f"a {type(value).__name__}"
    verb = "are" if kind == "settings" else "is"
    return f"the {kind} {verb} {found}; give what railsim.load_{kind} returns"


def flatten(vehicle: "Vehicle") -> FlatVehicle:
    """Return the vehicle as plain lists of bodies and elements, worked out once for each vehicle.

    Raises InputError: names that mean nothing or are used twice, parts that do not fit together.
    TypeError: something else than a vehicle.
    """
    if getattr(vehicle, "KIND", "") != "vehicle":
        raise TypeError(wrong_type("vehicle", vehicle))
    return once(vehicle, "_flattened", lambda: _checked_and_flat(vehicle))


def _checked_and_flat(vehicle: "Vehicle") -> FlatVehicle:
    faults = name_faults(vehicle.model_dump()) or position_faults(vehicle)
    if faults:
        raise InputError(
            Fault(f"vehicle '{vehicle.name}'", f.key, f.found, f.allowed) for f in faults
        )
    return _flat(vehicle)


def _flat(vehicle: "Vehicle") -> FlatVehicle:
    vehicle = in_load_case(vehicle)
    frames = list(_frames(vehicle, _Frame()))
    bodies = [body for group, frame in frames for body in _bodies(group, frame)]
    wheelsets = [body for group, frame in frames for body in _wheelsets(group, frame)]
    wheelsets.sort(key=lambda body: -body.position[0])
    order = {body.name: index for index, body in enumerate(wheelsets)}
    boxes = [box for group, frame in frames for box in _axleboxes(group, frame, order)]
    boxes.sort(key=lambda box: order[box.parent or ""])
    flat = (*bodies, *wheelsets, *boxes)
    positions = {body.name: body.position for body in flat}
    elements = [e for group, frame in frames for e in _elements(group, frame, positions)]
    fixed = [body.name for body in flat if body.fixed]
    reference = vehicle.reference or [*fixed, flat[0].name][0]
    return FlatVehicle(vehicle.name, flat, tuple(elements), reference)


def _bodies(group: Group, frame: _Frame) -> Iterator[FlatBody]:
    for name, body in group.bodies.items():
        place = frame.point(body.position)
        yield FlatBody(frame.full(name), "body", body.mass, body.inertia, place, fixed=body.fixed)


def _wheelsets(group: Group, frame: _Frame) -> Iterator[FlatBody]:
    for name, wheelset in group.wheelsets.items():
        values = wheelset.mass, wheelset.inertia, frame.point(wheelset.position), wheelset
        key = frame.key("wheelsets", name)
        yield FlatBody(frame.full(name), "wheelset", *values, key=key)


def _axleboxes(group: Group, frame: _Frame, wheelsets: Mapping[str, int]) -> Iterator[FlatBody]:
    for name, box in group.axleboxes.items():
        parent = resolve(box.wheelset, frame.scope, None, wheelsets)
        for sided, side in sided_names(name, box.sides):
            yield FlatBody(
                frame.full(sided),
                "axlebox",
                0.0,
                (0.0, 0.0, 0.0),
                frame.point(box.position, side),
                parent=parent,
                pitch_inertia=box.pitch_inertia,
                key=frame.key("axleboxes", name),
            )


def _elements(group: Group, frame: _Frame, positions: dict[str, Vector]) -> Iterator[FlatElement]:
    for name, element in group.elements.items():
        for sided, side in sided_names(name, getattr(element, "sides", None)):
            ends = [resolve(body, frame.scope, side, positions) or "" for body in element.bodies]
            points = element.end_points()
            if points is None:
                points = (positions[ends[0]], positions[ends[-1]])
            else:
                points = (frame.point(points[0], side), frame.point(points[1], side))
            definition = element.mirrored(frame.signs(side)).with_known_preload(*points)
            body2 = ends[1] if len(ends) == 2 else ""
            full, parts = frame.full(sided), definition.parts()
            for suffix, offset, part in parts:
                place = replace(frame, origin=points[0]).point(offset, side)
                yield FlatElement(f"{full}.{suffix}", ends[0], body2, place, place, part)
            if not parts:
                yield FlatElement(full, ends[0], body2, points[0], points[1], definition)


def position_faults(vehicle: "Vehicle") -> list[Fault]:
    """Return which parts of a vehicle stand where they cannot; the faults' file is left empty."""
    if wrong := load_faults(vehicle):
        return wrong
    faults: dict[str, Fault] = {}
    for fault in _position_faults(vehicle):  # a definition used several times is reported once
        faults.setdefault(fault.key, fault)
    return list(faults.values())


def _position_faults(vehicle: "Vehicle") -> Iterator[Fault]:
    flat = _flat(vehicle)
    wheelsets = flat.of_kind("wheelset")
    for body in wheelsets:
        assert body.wheelset is not None  # of its kind
        radius = 0.5 * sum(body.wheelset.radius)
        if abs(body.position[2] + radius) > POSITION_TOLERANCE:
            found = f"the axle of '{body.name}' is at z = {body.position[2]:g} m"
            allowed = f"z = {-radius:g} m, so that the wheels stand on the rails"
            yield Fault("", f"{body.key}.position", found, allowed)
    for box in flat.of_kind("axlebox"):
        axle = flat.body(box.parent or "").position
        if max(abs(box.position[i] - axle[i]) for i in (0, 2)) > POSITION_TOLERANCE:
            found = f"'{box.name}' is off its axle by more than {POSITION_TOLERANCE * 1e3:g} mm"
            allowed = f"x = {axle[0]:g} m, z = {axle[2]:g} m in vehicle axes"
            yield Fault("", f"{box.key}.position", found, allowed)
    for ahead, behind in pairwise(wheelsets):
        if ahead.position[0] - behind.position[0] < POSITION_TOLERANCE:
            found = f"'{ahead.name}' and '{behind.name}' stand at the same position"
            yield Fault("", f"{behind.key}.position", found, "wheelsets one behind the other")
    kinds = {body.name: body.kind for body in flat.bodies}
    for group, frame in _frames(vehicle, _Frame()):
        yield from _side_faults(group, frame)
        yield from _torque_faults(group, frame, kinds)


def _side_faults(group: Group, frame: _Frame) -> Iterator[Fault]:
    parts: list[tuple[str, Any, Sequence[Vector]]] = []
    for name, box in group.axleboxes.items():
        parts.append((frame.key("axleboxes", name, "position"), box, [box.position]))
    for name, element in group.elements.items():
        parts.append((frame.key("elements", name), element, element.end_points() or ()))
    for key, part, points in parts:
        on_both = getattr(part, "sides", None) == "both"
        if on_both and points and max(point[1] for point in points) <= 0.0:
            found = 'sides = "both", but the part is not on the right'
            yield Fault("", key, found, "y > 0: the left one is its mirror image")


def _torque_faults(group: Group, frame: _Frame, kinds: Mapping[str, str]) -> Iterator[Fault]:
    for name, element in group.elements.items():
        if not is_about_axle(element):
            continue
        found = [kinds[resolve(body, frame.scope, None, kinds) or ""] for body in element.bodies]
        if found[0] == "wheelset" or found[1] != "wheelset":
            key = frame.key("elements", name, "bodies")
            allowed = "first the body or axlebox that takes the reaction, then the wheelset"
            yield Fault("", key, " and ".join(f"'{kind}'" for kind in found), allowed)
