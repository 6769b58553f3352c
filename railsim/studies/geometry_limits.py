"""What the geometry of a recorded track says by itself: EN 13848-5, and shapes of defects."""

from itertools import pairwise

import numpy as np

from railsim.arrays import Flags, Integers, stretches
from railsim.definitions import Track
from railsim.definitions.excitations.recording import BANDS, band_passed
from railsim.table import Amount, Column, Table
from railsim.track.irregularity import displacement

CELL, SECTION = 25.0, 200.0  # m
STEP, AROUND = 0.25, 15.0  # m
# EN 13848-5: speed up to [km/h]; alert limit (least) of the standard deviations of level and of
# alignment, intervention limit (least) of isolated defects of both, D1 [mm].  From memory.
GEOMETRY = (
    (80.0, 2.3, 1.5, 17.0, 15.0),
    (120.0, 1.8, 1.2, 13.0, 11.0),
    (160.0, 1.4, 1.0, 10.0, 8.0),
    (230.0, 1.2, 0.8, 9.0, 7.0),
    (300.0, 1.0, 0.7, 8.0, 6.0),
)
COMPARED = (
    ("level", "standard deviation of level", ".2f"),
    ("alignment", "standard deviation of alignment", ".2f"),
    ("level_peak", "largest level", ".1f"),
    ("alignment_peak", "largest alignment", ".1f"),
)


class RecordedGeometry:
    """Geometry in D1 of a recording from `begin` to `end` [m], and what its limits say."""

    def __init__(self, track: Track, begin: float, end: float) -> None:
        function = displacement(track)
        assert function is not None  # it has a recording
        self.s = np.arange(begin, end, STEP)
        parts = np.array_split(self.s, max(1, len(self.s) // 50_000))
        rails = np.concatenate([np.asarray(function(p)[0]) for p in parts], axis=1)
        self.rails = band_passed(rails, STEP, BANDS["D1"])
        y_l, z_l, y_r, z_r = self.rails
        self.kinds = {"level": 0.5 * (z_l + z_r), "alignment": 0.5 * (y_l + y_r),
                      "cross level": z_r - z_l}  # fmt: skip
        self.spread = {name: float(np.std(x)) or 1.0 for name, x in self.kinds.items()}

    def shape(self, s: float) -> str:
        """Words for the defect at a place: quantity, size, length over which it has one sign."""
        near = np.flatnonzero(np.abs(self.s - s) <= AROUND)
        sizes = {n: np.max(np.abs(x[near])) / self.spread[n] for n, x in self.kinds.items()}
        name = max(sizes, key=lambda n: sizes[n])
        x = self.kinds[name]
        k = int(near[np.argmax(np.abs(x[near]))])
        begin, end = next(at for at in stretches(np.sign(x) == np.sign(x[k])) if at[1] > k)
        crossings = np.count_nonzero(np.diff(np.sign(x[near])))
        repeated = ", repeated" if crossings >= 6 and sizes[name] < 4.0 else ""
        return f"{name} {1e3 * x[k]:+.1f} mm over {STEP * (end - begin):.1f} m{repeated}"

    def sections(self, exceeded: Flags, unknown: Flags, speed: float) -> tuple[Table, Integers]:
        """Return the table of sections, and how many each of both flags.

        `exceeded`, `unknown`: cells in which some vehicle exceeds the share of a limit, and over
        which some did not run; `speed`: the highest one [m/s]. The last section takes what is
        left, if that is less than half a section.
        """
        row = next((row for row in GEOMETRY if 3.6 * speed <= row[0] + 1e-3), GEOMETRY[-1])
        ends = [Column(name, unit="m", format=".0f") for name in ("begin", "end")]
        limits = [1e-3 * limit for limit in row[1:]]
        compared = [
            Column(name, f"{words} D1, limit {1e3 * limit:g}", "mm", form)
            for (name, words, form), limit in zip(COMPARED, limits, strict=True)
        ]
        rows, flagged = [], np.zeros(5, dtype=np.int64)
        first, last = self.s[0], self.s[-1] + STEP
        edges = first + SECTION * np.arange(max(1, round((last - first) / SECTION)) + 1)
        edges[-1] = last
        cells = first + CELL * np.arange(len(exceeded))
        for begin, end in pairwise(edges.tolist()):
            shown_cells = self.rails[:, (self.s >= begin) & (self.s < end)]
            deviations, peaks = shown_cells.std(axis=1), np.abs(shown_cells).max(axis=1)
            values = [max(deviations[1], deviations[3]), max(deviations[0], deviations[2]),
                      max(peaks[1], peaks[3]), max(peaks[0], peaks[2])]  # fmt: skip
            by_geometry = any(v > limit for v, limit in zip(values, limits, strict=True))
            inside = (cells >= begin - 1e-6) & (cells < end - 1e-6)
            by_vehicles = bool(exceeded[inside].any())
            both = (0 if by_geometry else 1) if by_vehicles else (2 if by_geometry else 3)
            not_run = not by_vehicles and bool(unknown[inside].any())
            flagged[4 if not_run else both] += 1
            judged = zip(map(float, values), compared, limits, strict=True)
            shown = [Amount(value, column, limit=limit) for value, column, limit in judged]
            rows.append([begin, end, *shown, "flagged" if by_geometry else "",
                         "not run" if not_run else "flagged" if by_vehicles else ""])  # fmt: skip
        return Table([*ends, *compared, "geometry", "vehicles"], rows), flagged
