"""Irregularities measured or computed elsewhere."""

from typing import Annotated, Literal, Self

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.base import Finite, Flag, NonNegative, Positive, Text, check, rises
from railsim.definitions.excitations import base
from railsim.errors import input_error

# Keys that say how the file of a measured irregularity is read; its rows are what came of it.
READING = ("encoding", "columns", "units", "offset", "reverse", "falling_mileage", "chord", "band")
# Share of the range of the rows around by which a spline between measured rows may leave it.
OVERSHOOT = 0.25
MISSING, RECORDED = 5.0, 100  # median steps that are a gap of a record; rows that make it one
# m, least length that tables resolve, and that for which some rows next to each other count
FINEST, FEW = 1e-3, 0.05
ALIKE = 1e-7  # m: 0.1 kN at the most on the stiffness of a contact
FLATTENED = 1.5  # m, over which the rails lose their slope at either end of a gap
_INNER = np.arange(1, 8) / 8.0  # positions within an interval, over its length
Row = tuple[Finite, base.Amplitude, base.Amplitude, base.Amplitude, base.Amplitude]


class Measured(base.Irregular):
    """Displacements measured or computed elsewhere.

    Between the rows a cubic spline where they resolve the waves, shape-preserving elsewhere.
    """

    type: Literal["measured"]
    file: Text | None = None
    """CSV with a header: `s` and any of `y_left`, `z_left`, `y_right`, `z_right` in m (`s_m`) or
    mm (`y_left_mm`), or `y`, `z`, `cross_level`, `gauge`; read when the track is loaded"""
    encoding: Text | None = None
    """Encoding of the file, such as `latin-1`; by default UTF-8"""
    columns: dict[Text, Text] | None = None
    """Names of the file's columns by ours, where they differ: `{ s = "Mileage", z_left = "LL" }`;
    columns that are not named are not read"""
    units: dict[Text, Literal["m", "mm", "km", "in", "ft"]] | None = None
    """Units by our names of the columns, `{ s = "km", z_left = "mm" }`; by default as the names
    say"""
    offset: dict[Text, Finite] | None = None
    """What the file gives where the rails are not displaced, by our names of the columns and in
    the units of the file: `{ gauge = 1435.0 }` for an absolute gauge in mm"""
    reverse: tuple[Text, ...] = ()
    """Our names of the columns whose sign is the opposite of ours"""
    falling_mileage: Flag = False
    """The file's mileage falls in the direction of travel; s then counts from its first row"""
    chord: tuple[Positive, Positive] | None = None
    """Displacements are offsets at a chord of these parts behind and ahead [m]: the space curve is
    recovered from them"""
    band: Literal["D1", "D2", "D3"] | base.Wavelengths | None = None
    """Band of wavelengths that is kept: D1 (3 to 25 m), D2 (25 to 70 m), D3 (70 to 150 m), or
    shortest and longest [m]"""
    rows: Annotated[tuple[Row, ...], rises("arc length")] | None = None
    """What was read: rows of s, y_left, z_left, y_right, z_right [m]"""
    mileage: Finite | None = None
    """Mileage of the first of the `rows` where it falls, as read [m]: compared with the track's"""
    shift: Finite = 0.0
    """Added to the arc lengths of the file [m]"""
    scale: Finite = 1.0
    """Factor on all displacements"""
    fade: NonNegative = 10.0
    """Length over which the data fade in and out at both ends [m]"""

    @check
    def _one_source(self) -> None:
        if (self.file is None) == (self.rows is None):
            raise ValueError("either 'file' or 'rows' is needed")
        if self.rows is not None and len(self.rows) < 4:
            raise ValueError("four rows at least are needed")
        if self.rows is None and self.mileage is not None:
            raise ValueError("'mileage' belongs to 'rows' and does not go with 'file'")
        if self.rows is not None:
            given = [key for key in READING if getattr(self, key) not in (None, (), False)]
            if given:
                raise ValueError(f"'{given[0]}' belongs to 'file' and does not go with 'rows'")

    def _read(self) -> tuple[Row, ...]:
        """Return the rows; InputError: the file was named in Python, where nobody reads it."""
        if self.rows is None:
            allowed = "its rows; or a track file that names it, read by railsim.load_track"
            raise input_error(str(self.file), "a recording that has not been read", allowed)
        return self.rows

    def mirrored(self) -> Self:
        """Return the rows with the rails exchanged, displacements to the right turned round."""
        rows = tuple((s, -yr, zr, -yl, zl) for s, yl, zl, yr, zr in self.rows or ())
        return self.model_copy(update={"rows": rows})

    def extent(self, length: float) -> tuple[float, float]:
        """Return where the rows begin and end [m]."""
        rows = self.rows or ((0.0,), (length,))
        return rows[0][0] + self.shift, rows[-1][0] + self.shift

    def resolution(self) -> float:
        """Return half the least distance of the rows, 0.05 m at least where few have it [m].

        Half the distance of a tenth of the rows is resolved in any case, down to `FINEST`, unless
        every second row, every fourth and so on say the same to `ALIKE`.
        """
        s = np.array(self._read())[:, 0]
        least, tenth = float(np.diff(s).min()), float(np.quantile(np.diff(s), 0.1))
        plain = max(FEW, 0.5 * least)
        fine, every = max(FINEST, 0.5 * tenth), 2
        while fine < plain and self._resolved_by(every):
            fine, every = 2.0 * fine, 2 * every
        return min(plain, fine)

    def _resolved_by(self, every: int) -> bool:
        """Whether a spline through some of the rows leaves the others by less than `ALIKE`."""
        from scipy.interpolate import CubicSpline  # a quarter of a second; most need none

        rows = np.array(self._read())
        thinned = rows[::every]
        if len(thinned) < 4:
            return False
        inside = rows[rows[:, 0] <= thinned[-1, 0]]
        error = CubicSpline(thinned[:, 0], thinned[:, 1:])(inside[:, 0]) - inside[:, 1:]
        return bool(np.abs(self.scale * error).max() < ALIKE)

    def summary(self) -> str:
        """Return that it is measured, its number of rows and its scale."""
        times = "" if self.scale == 1.0 else f", times {self.scale:g}"
        return f"measured, {len(self.rows or ())} rows{times}"

    def interpolation(self) -> tuple[Floats, Floats, Floats]:
        """Positions of the rows [m], and displacements [m] and slopes [1] there by columns.

        In a gap with two rows more, between which the rails are level: to them they lose their
        slope by a parabola, as a spline would swing out and a shape-preserving one has a kink.
        """
        rows = np.array(self._read())
        positions = rows[:, 0] + self.shift
        values = self.scale * rows[:, 1:].T
        gaps = self.gaps()
        slopes = np.concatenate([
            np.stack([shape_preserving_slopes(s, row) for row in part])
            for s, part in zip(np.split(positions, gaps), np.split(values, gaps, 1), strict=True)
        ], axis=1)  # fmt: skip
        for k in reversed(gaps):
            way = min(FLATTENED, (positions[k] - positions[k - 1]) / 3.0) * np.array([1.0, -1.0])
            ends = slice(k - 1, k + 1)
            flat = values[:, ends] + 0.5 * way * slopes[:, ends]
            positions = np.insert(positions, k, positions[ends] + way)
            values = np.insert(values, [k, k], flat, axis=1)
            slopes = np.insert(slopes, [k, k], 0.0, axis=1)
        return positions, values, slopes

    def gaps(self) -> list[int]:
        """Return the rows of a record before which others are missing, by their numbers."""
        steps = np.diff([row[0] for row in self.rows or ()])
        if len(steps) < RECORDED - 1:
            return []
        return [int(k) + 1 for k in np.flatnonzero(steps > MISSING * np.median(steps))]

    def displacement(self, length: float) -> base.Displacement:
        """Return the spline through the rows."""
        from scipy.interpolate import CubicHermiteSpline  # a quarter of a second; most need none

        positions, values, slopes = self.interpolation()
        spline = CubicHermiteSpline(positions, values, slopes, axis=1)
        slope = spline.derivative()

        def value_and_rate(s: Floats) -> tuple[Floats, Floats]:
            inside = np.clip(s, positions[0], positions[-1])
            return spline(inside), slope(inside)

        return base.faded(value_and_rate, positions[0], positions[-1], self.fade)


def _between(positions: Floats, values: Floats, slopes: Floats) -> Floats:
    """Cubic Hermite interpolation at seven positions within every interval between the rows."""
    from scipy.interpolate import CubicHermiteSpline

    spline = CubicHermiteSpline(positions, values, slopes, axis=-1)
    return np.asarray(spline(_inner(positions)))


def _inner(positions: Floats) -> Floats:
    return positions[:-1, None] + np.diff(positions)[:, None] * _INNER


def largest_between_rows(part: Measured) -> tuple[str, float, float, float]:
    """Return the largest displacement between the rows, of the column where it differs most.

    Returns: column, largest displacement at the rows and between them, and s of the latter [m].
    A record that does not resolve the shortest wave that it holds lets the rails go further than
    any row says.
    """
    positions, values, slopes = part.interpolation()
    between = np.abs(_between(positions, values, slopes)).reshape(4, -1)
    at_rows = np.abs(values).max(axis=1)
    further = np.where(at_rows > 0.0, between.max(axis=1) - at_rows, -np.inf)
    column = int(np.argmax(further))
    index = int(np.argmax(between[column]))
    place = float(_inner(positions).ravel()[index])
    return base.COLUMNS[column], float(at_rows[column]), float(between[column, index]), place


def shape_preserving_slopes(positions: Floats, values: Floats) -> Floats:
    """Slopes at the rows for piecewise cubic interpolation without false waves.

    Those of the cubic spline where the rows resolve the wave; where the spline leaves the range of
    the four rows around an interval by more than a quarter of that range, the monotone ones of
    Fritsch and Butland (1984, SIAM J. Sci. Stat. Comput. 5) at both its ends.  A sine of six rows a
    wave leaves it by 0.15 at most.

    `positions`, shape (n,): increasing arc lengths [m]; `values`, shape (n,): displacements [m].
    Returns: slopes [1] (shape (n,)); 0 of a single row.
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    if len(positions) < 2:
        return np.zeros_like(values)
    slopes = CubicSpline(positions, values)(positions, 1)
    monotone = PchipInterpolator(positions, values)(positions, 1)
    padded = np.concatenate((values[:1], values, values[-1:]))
    around = np.stack([padded[i : i + len(values) - 1] for i in range(4)])
    low, high = around.min(axis=0), around.max(axis=0)
    allowed = OVERSHOOT * (high - low)
    while True:
        inside = _between(positions, values, slopes)
        lowest, highest = inside.min(axis=1), inside.max(axis=1)
        wrong = (lowest < low - allowed) | (highest > high + allowed)
        ends = np.zeros(len(positions), dtype=bool)
        ends[:-1] |= wrong
        ends[1:] |= wrong
        if not np.any(ends & (slopes != monotone)):
            return np.asarray(slopes)
        slopes = np.where(ends, monotone, slopes)
