"""Names within a vehicle file: which bodies there are, and which body a name means where it stands.

Works on the plain nested tables of a file, whether valid or not, so that wrong names are reported
together with wrong numbers.  A name is looked for in the innermost assembly first, then outwards;
a dotted name reaches into other assemblies.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from railsim.errors import MOST_FAULTS, Fault, nearest
from railsim.units import duration_in_words

Scope = tuple[str, ...]
Wrong = tuple[str, str, Callable[[], str]]
"""Key, what was found, and what is allowed."""
SIDES = ("left", "right")
STANDARD = re.compile(r"floor_(front|middle|rear)|frame_[1-9]\d*|axlebox_[1-9]\d*_(left|right)")
"""Sensors that every vehicle has."""
KINDS = {"bodies": "body", "wheelsets": "wheelset", "axleboxes": "axlebox"}
MOST_PARTS = 5000  # a train of twenty coaches has some 2000
MOST_WHEELSETS = 200
# to find the static equilibrium [s], by the square of the number of wheelsets
SECONDS_PER_SQUARE = 4e-3
DEEPEST_ASSEMBLY = 10


@dataclass(frozen=True)
class Group:
    """One standing assembly, or the vehicle itself."""

    parts: Mapping[str, Any]  # its table: bodies, wheelsets, axleboxes, elements
    scope: Scope  # names of the placements that lead to it
    path: tuple[str, ...]  # keys that lead to its table in the file

    def full(self, *names: str) -> str:
        """Return the full name of a part of this group."""
        return ".".join((*self.scope, *names))

    def unknown(
        self, name: Any, side: str | None, bodies: Mapping[str, Any], key: str, kind: str
    ) -> Iterator[Wrong]:
        """Yield what is wrong if a name means none of the known bodies here."""
        if isinstance(name, str) and resolve(name, self.scope, side, bodies) is None:
            yield key, f"no {kind} '{name}'", lambda: nearest(name, visible(self.scope, bodies))


def _members(parts: Mapping[str, Any], key: str) -> dict[str, Mapping[str, Any]]:
    """Return the well-formed members of one of the tables of a group."""
    table = parts.get(key)
    if not isinstance(table, Mapping):
        return {}
    return {name: part for name, part in table.items() if isinstance(part, Mapping)}


def groups(
    parts: Mapping[str, Any], scope: Scope = (), path: tuple[str, ...] = ()
) -> Iterator[Group]:
    """Yield the vehicle and every standing assembly in it, outer ones first."""
    yield Group(parts, scope, path)
    for name, assembly in _members(parts, "assemblies").items():
        for placement in placement_names(assembly):
            yield from groups(assembly, (*scope, placement), (*path, "assemblies", name))


def size_faults(parts: Mapping[str, Any]) -> list[Fault]:
    """Return a fault where placements share a name, or are more, or deeper, than anybody can mean.

    Counts without placing anything: ten nested assemblies of ten placements each are 1e10.
    """
    total = wheelsets = 0
    level: list[tuple[Mapping[str, Any], tuple[str, ...], int]] = [(parts, (), 1)]
    while level:
        inner = []
        for group, path, copies in level:
            tables = (_members(group, key) for key in (*KINDS, "elements"))
            total += copies * sum(len(table) for table in tables)
            wheelsets += copies * len(_members(group, "wheelsets"))
            if total > MOST_PARTS or len(path) > 2 * DEEPEST_ASSEMBLY:
                key = ".".join(path)
                found = "assemblies nested too deeply"
                if total > MOST_PARTS:
                    found = f"more than {MOST_PARTS} bodies and elements with all placements"
                return [Fault("", key, found, "fewer placements or parts")]
            for name, assembly in _members(group, "assemblies").items():
                names, inner_path = placement_names(assembly), (*path, "assemblies", name)
                if len(set(names)) < len(names):
                    key = ".".join((*inner_path, "placements"))
                    return [Fault("", key, f"the names {', '.join(names)}", "different names")]
                total += len(names)  # also an empty one takes time
                inner.append((assembly, inner_path, copies * len(names)))
        level = inner
    if wheelsets > MOST_WHEELSETS:
        time = duration_in_words(SECONDS_PER_SQUARE * wheelsets**2)
        found = f"{wheelsets} wheelsets, whose static equilibrium alone takes some {time}"
        return [Fault("", "assemblies", found, f"{MOST_WHEELSETS} at most")]
    return []


def placement_names(assembly: Mapping[str, Any]) -> list[str]:
    """Return the names of an assembly's placements as far as they are well-formed."""
    placements = assembly.get("placements")
    if not isinstance(placements, list | tuple):
        return []
    names = [p["name"] for p in placements if isinstance(p, Mapping) and "name" in p]
    return [name for name in names if isinstance(name, str)]


def sided_names(name: str, sides: object) -> list[tuple[str, str | None]]:
    """Return the names that a part gets, each with its side: left and right, or just one."""
    if sides == "both":
        return [(f"{name}.{side}", side) for side in SIDES]
    return [(name, None)]


def body_names(parts: Mapping[str, Any]) -> tuple[dict[str, str], list[Fault]]:
    """Return the full names of all bodies with their kind, and a fault for each name used twice."""
    kinds: dict[str, str] = {}
    faults: list[Fault] = []
    for group in groups(parts):
        for table, kind in KINDS.items():
            for name, part in _members(group.parts, table).items():
                key = ".".join((*group.path, table, name))
                for sided, _ in sided_names(name, part.get("sides")):
                    full = group.full(sided)
                    if full in kinds:
                        found = f"the name '{full}' is used twice"
                        faults.append(Fault("", key, found, "give each body a name of its own"))
                    kinds[full] = kind
    return kinds, faults


def resolve(name: str, scope: Scope, side: str | None, bodies: Mapping[str, Any]) -> str | None:
    """Return the full name of the body that `name` means in an assembly, or None.

    `name`: name as written, perhaps dotted; `scope`: where it is written; `side`: side of the
    element that names it: an axlebox on both sides is then the one on that side; `bodies`: full
    names of all bodies.
    """
    for depth in range(len(scope), -1, -1):
        full = ".".join((*scope[:depth], name))
        if full in bodies:
            return full
        if side is not None and f"{full}.{side}" in bodies:
            return f"{full}.{side}"
    return None


def visible(scope: Scope, bodies: Mapping[str, Any]) -> list[str]:
    """Return how the known bodies may be called from within an assembly, shortest forms first."""
    names: list[str] = []
    for depth in range(len(scope), -1, -1):
        prefix = "".join(f"{part}." for part in scope[:depth])
        names += [full.removeprefix(prefix) for full in bodies if full.startswith(prefix)]
    return list(dict.fromkeys(names))


def name_faults(parts: Mapping[str, Any]) -> list[Fault]:
    """Return every fault of the names in a vehicle's tables; the faults' file is left empty."""
    if too_many := size_faults(parts):
        return too_many
    kinds, faults = body_names(parts)
    for key, found, allowed in _wrong_names(parts, kinds):
        # a hint takes time, and further faults are only counted
        faults.append(Fault("", key, found, allowed() if len(faults) < MOST_FAULTS else ""))
    return list(dict.fromkeys(faults))


def _wrong_names(parts: Mapping[str, Any], kinds: Mapping[str, str]) -> Iterator[Wrong]:
    wheelsets = {full: kind for full, kind in kinds.items() if kind == "wheelset"}
    if not wheelsets:
        yield "wheelsets", "no wheelset", lambda: "a vehicle needs one at least"
    yield from _wrong_references(parts, kinds)
    used: set[str] = set()
    for group in groups(parts):
        for name, axlebox in _members(group.parts, "axleboxes").items():
            key = ".".join((*group.path, "axleboxes", name, "wheelset"))
            yield from group.unknown(axlebox.get("wheelset"), None, wheelsets, key, "wheelset")
        for name, element in _members(group.parts, "elements").items():
            key = ".".join((*group.path, "elements", name))
            for sided, side in sided_names(name, element.get("sides")):
                yield from _wrong_ends(element, group, side, kinds, f"{key}.bodies")
                if group.full(sided) in used:
                    found = f"the name '{group.full(sided)}' is used twice"
                    yield key, found, lambda: "give each element a name of its own"
                used.add(group.full(sided))


def _wrong_references(parts: Mapping[str, Any], kinds: Mapping[str, str]) -> Iterator[Wrong]:
    """Wrong names outside assemblies: the reference body, sensors."""
    candidates = {full for full, kind in kinds.items() if kind != "axlebox"}
    references = {"reference": parts.get("reference")}
    service = parts.get("service")
    points = _members(service, "points") if isinstance(service, Mapping) else {}
    for table, members in (("service.points", points), ("sensors", _members(parts, "sensors"))):
        references |= {f"{table}.{name}.body": point.get("body") for name, point in members.items()}
        for sensor in members:
            if STANDARD.fullmatch(sensor) or (members is not points and sensor in points):
                found = "the name of another sensor, in whose place it would be"
                yield f"{table}.{sensor}", found, lambda: "a name of its own"
    for key, name in references.items():
        if isinstance(name, str) and name not in candidates:
            yield key, f"no body '{name}'", partial(nearest, name, candidates)


def _wrong_ends(
    element: Mapping[str, Any], group: Group, side: str | None, kinds: Mapping[str, str], key: str
) -> Iterator[Wrong]:
    bodies = element.get("bodies")
    if not isinstance(bodies, list | tuple):
        return
    for index, name in enumerate(bodies):
        yield from group.unknown(name, side, kinds, f"{key}.{index}", "body")
    ends = [resolve(name, group.scope, side, kinds) for name in bodies if isinstance(name, str)]
    if len(ends) == 2 and ends[0] is not None and ends[0] == ends[1]:
        yield key, f"both ends are on '{bodies[0]}'", lambda: "two different bodies"
