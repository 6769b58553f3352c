"""Piecewise cubic tables of a track for the compiled kernels.

Every quantity is a cubic Hermite interpolation of its exact values and derivatives at the ends of
cells of equal length: exact for the heading in straights, circles and clothoids, and with an error
of about 1e-10 m for the position.  The tables reach beyond both ends of the track, where the end
elements continue.
"""

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from railsim.arrays import Floats
from railsim.definitions import Track
from railsim.definitions.excitations.base import Displacement
from railsim.errors import input_error
from railsim.kernels.alignment import aligned_zeros
from railsim.kernels.track_frame import TrackTables
from railsim.track.alignment import Alignment, alignment_of
from railsim.track.irregularity import displacement, shortest_length

# Usual length of a cell, and the largest number of them that is worth its memory.
CELL_LENGTH = 0.25
MOST_CELLS = 200_000
# How far the tables reach beyond the track, so that wheelsets ahead and behind have rails [m].
BEFORE, AFTER = 100.0, 200.0
# Lines that a process keeps for runs that differ in their rails, and their cells at most (4 MB).
MOST_LINES, MOST_CELLS_KEPT = 8, 20_000

# Nodes and weights of the Gauss-Legendre rule on [0, 1] that integrates the position in a cell.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS


def track_tables(track: Track, cell_length: float | None = None) -> TrackTables:
    """Tables of a track over arc length.

    `track`: the track; `cell_length`: length of a cell [m]; by default `usual_cell_length`.
    Returns: see `railsim.kernels.track_frame`. Raises InputError: elements that do not fit
    together; a track too long for its details.
    """
    alignment = alignment_of(track)
    ds = cell_length or usual_cell_length(track)
    if (track.length + BEFORE + AFTER) / ds > 10 * MOST_CELLS:
        found = f"{track.length:g} m of track with details of {ds:g} m"
        raise input_error(track.name, found, "a shorter track, or coarser details", key="plan")
    cells_before = int(np.ceil(BEFORE / ds))
    n_cells = cells_before + int(np.ceil((track.length + AFTER) / ds))
    s: Floats = ds * np.arange(-cells_before, n_cells - cells_before + 1, dtype=np.float64)
    text = track.model_dump_json(exclude={"friction", "friction_table"})
    line = _Line(text, float(ds), cells_before, n_cells, alignment, s)
    make = _kept_coefficients if n_cells <= MOST_CELLS_KEPT else _coefficients
    coefficients = make(line)
    moved = displacement(track)
    rail = _rails(track, moved, s)
    irregular = int(moved is not None)
    return TrackTables(float(s[0]), float(ds), coefficients, rail, irregular, track.rail_base)


@dataclass(frozen=True)
class _Line:
    """What the table of a centre line follows from: a track apart from its friction, its cells."""

    track: str
    ds: float
    before: int
    cells: int
    alignment: Alignment = field(compare=False)
    s: Floats = field(compare=False)


def _coefficients(line: _Line) -> Floats:
    """Position, heading, grade and cant angle over the cells, float64[n_cells, 6, 4]."""
    found, alignment, s = aligned_zeros((line.cells, 6, 4)), line.alignment, line.s
    rows = [
        *_centre_line(alignment, s, line.before),
        (alignment.heading(s), alignment.curvature(s)),
        (alignment.grade_angle(s), alignment.grade_angle_rate(s)),
        (alignment.cant_angle(s), alignment.cant_angle_rate(s)),
    ]
    for row, (value, rate) in enumerate(rows):
        found[:, row] = hermite(value, rate, line.ds)
    return found


_kept_coefficients = lru_cache(MOST_LINES)(_coefficients)


def usual_cell_length(track: Track) -> float:
    """Length of a cell [m]: 0.25 m, more for very long tracks, less where details need it."""
    longest = max(CELL_LENGTH, (track.length + (BEFORE + AFTER)) / MOST_CELLS)
    return min(longest, 0.25 * track.rounding, shortest_length(track))


def hermite(value: Floats, rate: Floats, ds: float) -> Floats:
    """Cubic polynomials through values and derivatives at equally spaced nodes.

    `value`, `rate`: values and derivatives at the nodes; `ds`: distance of the nodes [m]. Returns:
    `float64[n, 4]`.
    """
    step = np.diff(value) / ds
    c2 = (3.0 * step - 2.0 * rate[:-1] - rate[1:]) / ds
    c3 = (rate[:-1] + rate[1:] - 2.0 * step) / ds**2
    return np.stack((value[:-1], rate[:-1], c2, c3), axis=-1)


def _direction(alignment: Alignment, s: Floats) -> Floats:
    """Unit vector along the centre line in global axes, one row each for x, y, z."""
    psi, theta = alignment.heading(s), alignment.grade_angle(s)
    return np.stack((np.cos(psi) * np.cos(theta), np.sin(psi) * np.cos(theta), -np.sin(theta)))


def _centre_line(alignment: Alignment, s: Floats, origin: int) -> list[tuple[Floats, Floats]]:
    """X, Y, Z with their derivatives at the nodes; node `origin` is the global origin [m]."""
    ds = s[1] - s[0]
    steps = np.zeros((3, s.size - 1))
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        steps += ds * weight * _direction(alignment, s[:-1] + node * ds)
    position = np.concatenate((np.zeros((3, 1)), np.cumsum(steps, axis=1)), axis=1)
    position -= position[:, origin : origin + 1]
    return list(zip(position, _direction(alignment, s), strict=True))


def _rails(track: Track, displacement: Displacement | None, s: Floats) -> Floats:
    """Displacements and friction of both rails, float64[n_cells, 6, 4]."""
    ds = s[1] - s[0]
    rail = np.zeros((s.size - 1, 6, 4))
    if displacement is not None:
        for row, (value, rate) in enumerate(zip(*displacement(s), strict=True)):
            rail[:, row] = hermite(value, rate, ds)
    mu = track.friction_at(s)
    rail[:, 4:, 0], rail[:, 4:, 1] = mu[:-1], np.diff(mu, axis=0) / ds
    return rail
