"""Rails whose section changes along the track, in the arrays of a run.

Equilibrium, linear analyses and the choice of the step see the plain rails.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railsim.arrays import Floats, Integers
from railsim.contact.curves import gauge_face
from railsim.contact.section_tables import SectionRange, cached_section_table
from railsim.contact.table import ContactTable, Normal
from railsim.definitions import Track
from railsim.definitions.section_files import SectionList
from railsim.definitions.track.rail_sections import RailSections
from railsim.definitions.vehicle.flatten import FlatVehicle
from railsim.errors import ModelError, input_error
from railsim.kernels.contact_table import N_FIELD, N_PATCH, RailTables
from railsim.profiles.profile import Profile

ANOTHER = 0.02  # m, beyond side wear: gauge sides so far apart are those of wing and nose


@dataclass(frozen=True, eq=False)
class RailRanges:
    """Ranges of a track over which the section of a rail changes."""

    # by range and kind of wheel, see `railsim.contact.section_tables`
    tables: tuple[ContactTable, ...]
    which: Integers  # of them serves each wheel on each range, else -1
    ends: Floats  # begin and end of the ranges [m]

    @cached_property
    def arrays(self) -> RailTables:
        """The same as the time loop reads it."""
        piece: list[tuple[int, int, int]] = []
        part: list[tuple[int, int]] = []
        nodes: list[list[float]] = []
        first = 0
        for table in self.tables:
            described: list[list[list[float]]] = table.description["parts"]  # type: ignore[assignment]
            piece.append((len(part), len(described), first))
            for rows in described:
                part.append((len(nodes), len(rows)))
                nodes += [[s, *(k + first if k >= 0 else -1 for k in zones)] for s, *zones in rows]
            first += N_PATCH * len(table.values)
        grid = self.tables[0] if self.tables else None
        if any((t.y0, t.values.shape[1:]) != (grid.y0, grid.values.shape[1:]) for t in self.tables):  # type: ignore[union-attr]
            raise ModelError("tables of rails' sections differ in their grids")
        listed = np.array(nodes).reshape(-1, 1 + N_PATCH)
        return RailTables(
            values=_one_after_another([t.values for t in self.tables]),
            shear=np.array([t.shear for t in self.tables for _ in t.values]),
            y0=grid.y0 if grid else 0.0,
            dy=grid.dy if grid else 1.0,
            roll0=grid.roll0 if grid else 0.0,
            droll=grid.droll if grid else 1.0,
            w=grid.w if grid else np.zeros(2),
            range_of=self.which,
            range_row=self.ends,
            piece=np.array(piece, dtype=np.int64).reshape(-1, 3),
            lever=np.array([float(str(t.description["tape"])) for t in self.tables]),
            part=np.array(part, dtype=np.int64).reshape(-1, 2),
            node_s=np.ascontiguousarray(listed[:, 0]),
            node_zone=listed[:, 1:].astype(np.int64),
        )


PLAIN = RailRanges((), np.zeros((0, 0, 2), dtype=np.int64), np.zeros((0, 2)))


def _one_after_another(values: list[Floats]) -> Floats:
    if len(values) == 1:
        return values[0]
    joined = np.concatenate(values) if values else np.zeros((0, N_PATCH, 2, 2, 2, N_FIELD))
    joined.setflags(write=False)  # as on disk
    return joined


def rail_ranges(
    flat: FlatVehicle,
    track: Track,
    profiles: dict[str, Profile],
    plain: tuple[tuple[ContactTable, ...], Integers],
    normal: Normal,
) -> RailRanges:
    """Return the ranges of a track for the wheels of a vehicle.

    `plain`: contact tables on the plain rails, and which of them serves each wheel, [w, 2].
    """
    if not track.sections:
        return PLAIN
    wheelsets = [body.wheelset for body in flat.of_kind("wheelset")]
    tables: list[ContactTable] = []
    known: dict[tuple[int, int], int] = {}
    which = np.full((len(track.sections), len(wheelsets), 2), -1)
    for k, part in enumerate(track.sections):
        side = 0 if part.rail == "left" else 1
        for w, wheelset in enumerate(wheelsets):
            assert wheelset is not None
            key = k, int(plain[1][w, side])
            if key not in known:
                known[key] = len(tables)
                pair = profiles[wheelset.profile[side]], profiles[track.rail[side]]
                given = _range(part, track.gauge, pair, plain[0][key[1]], normal)
                tables.append(cached_section_table(given))
            which[k, w, side] = known[key]
    ends = np.array([[part.begin, part.end] for part in track.sections]).reshape(-1, 2)
    return RailRanges(tuple(tables), which, ends)


def _range(
    part: RailSections,
    gauge: float,
    pair: tuple[Profile, Profile],
    plain: ContactTable,
    normal: Normal,
) -> SectionRange:
    assert part.contours is not None
    contours = tuple(np.array([contour.y, contour.z]) for contour in part.contours)
    sections = SectionList(np.array([contour.s for contour in part.contours]), contours)
    face = _gauge_face(contours) if part.gauge_face is None else part.gauge_face
    return SectionRange(
        sections=sections,
        begin=round(part.begin - part.shift, 9),
        end=round(part.end - part.shift, 9),
        zero=0.5 * gauge - face,
        wheel=pair[0],
        rail=pair[1],
        plain=plain,
        normal=normal,
    )


def _gauge_face(contours: tuple[Floats, ...]) -> float:
    """That of the first section, where it and the last one are those of one rail [m]."""
    key = "sections.gauge_face"
    try:
        first, last = (gauge_face(y, z - z.min()) for y, z in (contours[0], contours[-1]))
    except ValueError as error:
        fault = f"{error} in the first or last section"
        raise input_error("track", fault, "14 mm, or a number", key) from error
    if abs(last - first) > ANOTHER:
        fault = f"the last section's gauge side is {1e3 * (last - first):.0f} mm beside the first's"
        raise input_error("track", fault, "a number", key)
    return first
