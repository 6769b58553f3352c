"""Contact tables of rails whose section changes: one for each rail under the wheel, over s.

At nodes along the track the fields of `railsim.contact.table` are those of the wheel on the section
on which it stands there, that of `railsim.contact.rail_sections.envelope_curve`, over the lateral
displacement, roll and squared yaw, for each rail on its own: wing and nose are two rails with three
patches each.  Between the nodes `railsim.kernels.rail_parts` interpolates.

**Nodes** lie so close that the heights at which the rigid wheel touches, of every zone that is near
the lowest, are met by cubics within `TOLERANCE`, and within `SHARED` where two rails may carry.

**Ends.**  At begin and end of the range the rail that carries is the plain rail: its table there is
that of plain track, and over `FADE` it becomes that of the sections.  Heights are those above the
section at `begin`.

The grid is that of the plain table, of which only the middle is kept.
"""

import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railsim.arrays import Floats
from railsim.contact import rail_sections
from railsim.contact.curves import (
    RailCurve,
    WheelCurve,
    rail_curve,
    tape_circle_position,
    wheel_curve,
)
from railsim.contact.rail_sections import (
    WINDOW,
    RailPart,
    cubic,
    envelope_curve,
    rail_parts,
    rigid_gaps,
)
from railsim.contact.stored_table import generator_hash, load_or_build
from railsim.contact.table import (
    ContactTable,
    Generator,
    Normal,
    complete_grid,
    roll_from_stretched,
    spline_coefficients,
)
from railsim.contact.zones import zone_windows
from railsim.definitions.section_files import SectionList
from railsim.kernels.contact_table import N_PATCH, G
from railsim.profiles.profile import Profile

INWARDS, OUTWARDS = 0.012, 0.012  # m, lateral positions that a table covers
ROLLS = 4  # nodes of the plain table to each side of no roll
YAWS = slice(0, 3, 2)  # those of no yaw and of 14 mrad: a two-axle wagon yaws by 17 mrad in R 245 m
FADE = 0.05  # m, from the plain rail to the sections
TOLERANCE, SHARED = 4e-6, 5e-7  # m, of the heights between nodes; where two rails may carry
CLOSEST, FARTHEST = 4e-3, 64e-3  # m, distances of nodes
NEAR = 1.5e-3  # m, zones that touch so much later than the lowest do not carry
BOTH = 3e-4  # m, two rails that touch so close to one another may carry together
TRIED = np.linspace(-0.012, 0.012, 17)  # m, lateral positions at which zones are near
USUAL = np.abs(TRIED) < 7e-3  # those at which nodes are chosen


@dataclass(frozen=True, eq=False)
class SectionRange:
    """Sections of a rail over a range of the track, as one kind of wheel meets them."""

    sections: SectionList  # in their own arc length
    begin: float  # in that arc length [m]
    end: float
    zero: float  # where y = 0 of the sections lies beside the middle of the track [m]
    wheel: Profile
    rail: Profile  # the plain one
    plain: ContactTable  # of the two
    normal: Normal


def cached_section_table(span: SectionRange) -> ContactTable:
    """Contact tables of the rails of a range, built once and kept on disk.

    Its `values` are those of zones one after the other, three to a table: shape (n, 3, n_w, n_roll,
    n_y, n_field); `description` has under `parts` for each rail its nodes: position from the begin
    of the range [m], and the zones of tread, flange root and flange, -1 where nothing is near.
    """
    digest = hashlib.sha256(generator_hash().encode())
    for module in (rail_sections.__file__, __file__):
        digest.update(Path(module).read_bytes())
    plain = span.plain
    facts = (plain.description, plain.centre_height, plain.G, plain.nu, span.normal)
    digest.update(repr((facts, span.begin, span.end, span.zero)).encode())
    for part in (span.wheel.key(), span.rail.key(), span.sections.positions.tobytes()):
        digest.update(part)
    for points in span.sections.points:
        digest.update(points.tobytes())
    return load_or_build(digest.hexdigest(), lambda: section_table(span))


def section_table(span: SectionRange) -> ContactTable:
    """As `cached_section_table`, built anew."""
    plain, about = span.plain, span.plain.description
    gauge, inclination, apart = (
        float(str(about[key])) for key in ("gauge", "inclination", "back_to_back")
    )
    tape, radius = tape_circle_position(apart), plain.r0
    grid = complete_grid(None, span.normal)
    wheel = wheel_curve(span.wheel, radius, tape, min(grid.spacing, grid.ds))
    level = rail_curve(span.rail, gauge, inclination)
    generator = Generator(wheel, level, radius, plain.centre_height, plain.G, plain.nu, grid)
    parts = rail_parts(span.sections)
    nodes, running = select_nodes(parts, wheel, level, tape - span.zero, span)
    rise = _height(generator, level) - _height(
        generator, envelope_curve(parts[running[0]], span.begin, radius, span.zero)
    )
    # the middle of the plain table: ranges of the lateral position and of the roll
    middle = plain.values.shape[2] // 2
    inner, outer = (round((end - plain.y0) / plain.dy) for end in (-INWARDS, OUTWARDS))
    y = np.arange(max(inner, 1), min(outer, plain.values.shape[3] - 3) + 1)
    rolls = np.arange(middle - ROLLS, middle + ROLLS + 1)
    cut = plain.values[:, YAWS, rolls[0] : rolls[-1] + 1, y[0] : y[-1] + 1]
    rows, sections = _rows(parts, nodes, running, span)
    tables, described = _number_zones(rows, span.begin)

    # coefficients at the ends of another rail's table need a node more
    stretched = plain.roll0 + plain.droll * np.arange(rolls[0] - 1, rolls[-1] + 2)
    lateral = plain.y0 + plain.dy * np.arange(y[0] - 1, y[-1] + 2)

    def fill(task: tuple[int, list[int]]) -> Floats:
        table, zones = task
        if table == 0:
            return cut[zones]
        rail = envelope_curve(*sections[table - 1], radius, span.zero)
        rail = replace(rail, z=rail.z + rise)
        nodes = lateral, roll_from_stretched(stretched), plain.w[YAWS]
        fields = spline_coefficients(generator.values(rail, *nodes, 1), stretched)
        return fields[zones, :, 1:-1, 1:-1]

    first = fill(tables[-1])  # compile once, not in every thread
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = [*pool.map(fill, tables[:-1]), first]
    missing = -sum(map(len, found)) % N_PATCH
    values = np.concatenate([*found, np.zeros((missing, *first.shape[1:]))])
    values = values.reshape(-1, N_PATCH, *values.shape[1:])
    values.setflags(write=False)
    return replace(
        plain,
        values=values,
        y0=float(plain.y0 + plain.dy * y[0]),
        roll0=float(plain.roll0 + plain.droll * rolls[0]),
        w=plain.w[YAWS].copy(),
        description={**about, "parts": described, "tape": tape, "rise": rise},
    )


def _rows(
    parts: tuple[RailPart, ...],
    nodes: list[list[tuple[float, Floats]]],
    running: tuple[int, int],
    span: SectionRange,
) -> tuple[list[list[tuple[float, int, Floats]]], list[tuple[RailPart, float]]]:
    """Nodes of each rail as position, number of the table, zones, and the sections of the tables.

    Table 0 is the plain one, n that of section n - 1. Nodes on the same section share a table.
    """
    sections: list[tuple[RailPart, float]] = []
    number_of: dict[tuple[int, bytes], int] = {}
    rows: list[list[tuple[float, int, Floats]]] = []
    for number, part in enumerate(parts):
        along = []
        for s, near in nodes[number]:
            same = part.constant_section(s)
            key = number, repr(s).encode() if same is None else same.tobytes()
            if key not in number_of:
                sections.append((part, s))
                number_of[key] = len(sections)
            along.append((s, number_of[key], near))
        whole = np.ones(3, dtype=bool)
        if along and number == running[0]:
            along = [(span.begin - FADE, 0, whole), (span.begin, 0, whole), *along]
        if along and number == running[1]:
            along = [*along, (span.end, 0, whole), (span.end + FADE, 0, whole)]
        rows.append(along)
    return rows, sections


def _number_zones(
    rows: list[list[tuple[float, int, Floats]]], begin: float
) -> tuple[list[tuple[int, list[int]]], list[list[list[float]]]]:
    """Tables with the zones that are kept of each, and where those of each node lie.

    A zone is kept at the nodes next but one to where it is near, so that a cubic has all it needs.
    """
    zones: dict[int, set[int]] = {}
    masks = []
    for along in rows:
        near = np.array([mask for _, _, mask in along], dtype=bool).reshape(-1, 3)
        for _ in range(2):
            around = np.pad(near, ((1, 1), (0, 0)))
            near = near | around[:-2] | around[2:]
        masks.append(near)
        for (_, table, _), mask in zip(along, near, strict=True):
            zones.setdefault(table, set()).update(np.flatnonzero(mask).tolist())
    tables = [(table, sorted(found)) for table, found in sorted(zones.items()) if found]
    place, count = {}, 0
    for table, present in tables:
        for k in present:
            place[table, k] = count
            count += 1
    described = [
        [
            [round(s - begin, 9), *(place[table, k] if mask[k] else -1 for k in range(3))]
            for (s, table, _), mask in zip(along, near, strict=True)
        ]
        for along, near in zip(rows, masks, strict=True)
    ]
    return tables, described


def _height(generator: Generator, rail: RailCurve) -> float:
    """Height at which a wheelset in the middle of the track touches a rail [m]."""
    zero = np.zeros(1)
    return float(generator.values(rail, zero, zero, zero, 1)[:, 0, 0, 0, G].min())


def select_nodes(
    parts: tuple[RailPart, ...],
    wheel: WheelCurve,
    level: RailCurve,
    tape: float,
    span: SectionRange,
) -> tuple[list[list[tuple[float, Floats]]], tuple[int, int]]:
    """Where along the track each rail has a table and of which zones, and which carry at the ends.

    `level`: the plain rail; `tape`: position of the nominal rolling circle from y = 0 [m].
    """
    zone = np.argmax(zone_windows(wheel, level), axis=0)
    wheels = [(wheel.y[zone == k], wheel.r[zone == k]) for k in range(N_PATCH)]
    s = np.arange(span.begin, span.end, 0.5 * CLOSEST)
    radius, y = span.plain.r0, tape + TRIED
    gaps = np.array([rigid_gaps(part, s, radius, wheels, y) for part in parts])
    near = gaps < gaps.min(axis=(0, 2))[None, :, None] + NEAR
    carrying = near & USUAL
    of_part = gaps[..., USUAL].min(axis=2)
    both = ((of_part < of_part.min(axis=0) + BOTH).sum(axis=0) > 1).any(axis=1)
    tolerance = np.where(both, SHARED, TOLERANCE)[:, None, None]
    lowest = gaps[:, :, :, TRIED.size // 2].min(axis=2)
    running = int(np.argmin(lowest[:, 0])), int(np.argmin(lowest[:, -1]))
    nodes = []
    for number, part in enumerate(parts):
        beyond = WINDOW - CLOSEST
        low, high = part.positions[0] - beyond, part.positions[-1] + beyond
        if number == running[0]:
            low = span.begin + FADE
        if number == running[1]:
            high = span.end - FADE
        first, last = np.searchsorted(s, (low, high))
        last = min(int(last), s.size - 1)
        limit = np.where(carrying[number], tolerance, np.inf)
        found = _split(s, gaps[number], limit, int(first), last) if first < last else []
        nodes.append([(float(s[i]), near[number, i].any(axis=1)) for i in found])
    return nodes, running


def _split(s: Floats, gaps: Floats, limit: Floats, first: int, last: int) -> list[int]:
    """Indices from `first` to `last` between which cubics meet the gaps within a limit."""
    slope = np.gradient(gaps, s, axis=0)

    def between(a: int, b: int) -> list[int]:
        h = s[b] - s[a]
        u = ((s[a + 1 : b] - s[a]) / h)[:, None, None]
        found = cubic(u, h, (gaps[a], gaps[b]), (slope[a], slope[b]))
        met = (np.abs(found - gaps[a + 1 : b]) <= limit[a + 1 : b]).all()
        if b - a < 2 or (met and h <= FARTHEST):
            return [a]
        middle = (a + b) // 2
        return between(a, middle) + between(middle, b)

    return [*between(first, last), last]
