"""What a comparison of a model with a test has found: values of sections, differences, limits."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.assessment.criteria import FORCES, RIDE_BAND, both_ends, high, middle, outer_end, rms
from railsim.assessment.signals import Band
from railsim.assessment.verdict import FAIL, INCOMPLETE, PASS
from railsim.assessment.zones import ROUNDING
from railsim.errors import nearest
from railsim.table import Amount, Column, Table


@dataclass(frozen=True)
class Compared:
    """A quantity that is compared."""

    name: str
    words: str
    unit: str
    base: str  # ``Q``, ``Y``, ``sum_Y``, ``Y_over_Q`` or ``body``, and ``y`` or ``z`` behind it
    band: Band  # filter [Hz]
    # values in a section, outwards positive in curves, to one or two
    value: Callable[[Floats, int], list[float]]
    curves: bool = False  # in curves only
    window: float = 0.0

    @property
    def column(self) -> Column:
        """How its values are shown."""
        return Column(self.name, self.words, self.unit, ".2f" if self.unit == "kN" else ".3f")


QUANTITIES = {one.name: one for one in (
    Compared("Y_qst", "guiding force, quasi-static", "kN", "Y", FORCES, middle, True),
    Compared("Q_qst", "wheel load, quasi-static", "kN", "Q", FORCES, middle, True),
    Compared("Y_over_Q_qst", "Y/Q, quasi-static", "", "Y_over_Q", FORCES, middle, True),
    Compared("sum_Y_qst", "track shift force, quasi-static", "kN", "sum_Y", FORCES, middle, True),
    Compared("Y_max", "guiding force", "kN", "Y", FORCES, outer_end),
    Compared("Q_max", "wheel load", "kN", "Q", FORCES, high),
    Compared("Y_over_Q_max", "Y/Q, 2 m", "", "Y_over_Q", FORCES, outer_end, True, 2.0),
    Compared("sum_Y_max", "track shift force, 2 m", "kN", "sum_Y", FORCES, outer_end, False, 2.0),
    Compared("body_y_qst", "lateral body acceleration, quasi-static", "m/s2",
             "bodyy", FORCES, middle, True),
    Compared("body_y_max", "lateral body acceleration, 0.4 to 10 Hz", "m/s2",
             "bodyy", RIDE_BAND, both_ends),
    Compared("body_z_max", "vertical body acceleration, 0.4 to 10 Hz", "m/s2",
             "bodyz", RIDE_BAND, both_ends),
    Compared("body_y_rms", "lateral body acceleration, rms", "m/s2", "bodyy", RIDE_BAND, rms),
    Compared("body_z_rms", "vertical body acceleration, rms", "m/s2", "bodyz", RIDE_BAND, rms),
)}  # fmt: skip
"""What is compared, in the order of tables."""


@dataclass(frozen=True)
class Pair:
    """A value of a section, measured and simulated [SI]."""

    quantity: str
    run: str
    place: str
    begin: float
    end: float
    radius: float
    measured: float
    simulated: float

    @property
    def difference(self) -> float:
        """Positive where the simulation overestimates the magnitude [SI]."""
        return (self.simulated - self.measured) * (-1.0 if self.measured < 0.0 else 1.0)


@dataclass(frozen=True)
class Comparison:
    """A quantity against its limits [SI]."""

    quantity: Compared
    pairs: tuple[Pair, ...]
    limit: float
    mean_limit: float
    least: int

    @property
    def sections(self) -> int:
        """Sections with a value."""
        return len({(pair.run, pair.begin) for pair in self.pairs})

    @property
    def mean(self) -> float:
        """Mean difference."""
        return float(np.mean([pair.difference for pair in self.pairs])) if self.pairs else math.nan

    @property
    def deviation(self) -> float:
        """Standard deviation of the differences, of a sample."""
        if len(self.pairs) < 2:
            return math.nan
        return float(np.std([pair.difference for pair in self.pairs], ddof=1))

    @property
    def verdict(self) -> str:
        """Pass, fail, or incomplete with too few sections or one value, which does not scatter."""
        if self.sections < self.least or len(self.pairs) < 2:
            return INCOMPLETE
        shares = abs(self.mean) / self.mean_limit, self.deviation / self.limit
        return PASS if max(shares) <= 1.0 + ROUNDING else FAIL

    def offsets(self) -> list[str]:
        """Return the places whose mean differences cancel over curves of both hands, in words.

        An offset of a channel adds to the magnitude in curves of one hand what it takes in those of
        the other: the mean over all curves lacks it, the standard deviation alone has it.
        """
        by_place: dict[str, tuple[list[float], list[float]]] = {}
        for pair in self.pairs if self.quantity.curves else ():
            hands = by_place.setdefault(pair.place, ([], []))
            hands[pair.radius > 0.0].append(pair.difference)
        means = {
            p: [float(np.mean(d)) for d in hands] for p, hands in by_place.items() if all(hands)
        }
        text, unit = self.quantity.column.text, self.quantity.unit
        return [
            f"{self.quantity.name} of {place}: mean difference {text(left)} in left-hand curves, "
            f"{text(right)} {unit}".rstrip()
            + " in right-hand ones: an 'offset' of a channel?"
            for place, (left, right) in means.items()
            if abs(left - right) > 2.0 * self.mean_limit
        ]


@dataclass(frozen=True, eq=False)
class Overlay:
    """A channel measured and simulated over the arc length, low-passed at 20 Hz [SI]."""

    run: str
    name: str
    quantity: str
    s: Floats = field(repr=False)
    rate: float
    measured: Floats = field(repr=False)
    simulated: Floats = field(repr=False)


@dataclass(frozen=True, eq=False)
class ModelValidation:
    """A model against a test.

    Attributes
    ----------
    vehicle : str
    runs : tuple of str
    comparisons : tuple of Comparison
        Of the quantities that were measured.
    overlays : tuple of Overlay
    edition : str
        Of the standard that the limits are from.
    remarks : tuple of str
    """

    vehicle: str
    runs: tuple[str, ...]
    comparisons: tuple[Comparison, ...]
    overlays: tuple[Overlay, ...] = field(repr=False)
    edition: str
    remarks: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """What is compared with what."""
        return f"{self.vehicle} against {', '.join(self.runs)}"

    @property
    def verdict(self) -> str:
        """Fail where one quantity fails, pass where all pass."""
        verdicts = {comparison.verdict for comparison in self.comparisons}
        return FAIL if FAIL in verdicts else PASS if verdicts == {PASS} else INCOMPLETE

    def __getitem__(self, name: str) -> Comparison:
        """Return the comparison of a quantity, by its name in the limits file."""
        for comparison in self.comparisons:
            if comparison.quantity.name == name:
                return comparison
        names = (comparison.quantity.name for comparison in self.comparisons)
        raise KeyError(f"no quantity '{name}'; {nearest(str(name), names)}")

    def table(self) -> Table:
        """Return mean and standard deviation of the differences against their limits."""
        rows: list[list[object]] = []
        for c in self.comparisons:
            column = c.quantity.column
            mean = Amount(c.mean, column, limit=math.copysign(c.mean_limit, c.mean))
            scatter = Amount(c.deviation, column, limit=c.limit)
            amounts = mean, Amount(c.mean_limit, column), scatter, Amount(c.limit, column)
            rows.append([c.quantity.name, c.quantity.words, column.unit, c.sections,
                         len(c.pairs), *amounts, c.verdict])  # fmt: skip
        return Table(
            [
                Column("quantity"), Column("words", " "), Column("unit"),
                Column("sections", format="d"), Column("values", format="d"),
                Column("mean", format=".2f"), Column("mean_limit", "limit, ±", format=".2f"),
                Column("deviation", "standard deviation", format=".2f"),
                Column("limit", format=".2f"), Column("verdict"),
            ],
            rows,
        )  # fmt: skip

    def section_table(self) -> Table:
        """Return all values, measured and simulated, shown in the units of `table`."""
        rows: list[list[object]] = []
        for c in self.comparisons:
            column = c.quantity.column
            for p in c.pairs:
                values = (Amount(v, column) for v in (p.measured, p.simulated, p.difference))
                radius = p.radius if math.isfinite(p.radius or math.inf) else None  # straight
                rows.append([p.quantity, p.run, p.place, p.begin, p.end, radius, *values])
        lengths = [Column(name, unit="m", format=".0f") for name in ("begin", "end", "radius")]
        names = ("measured", "simulated", "difference")
        return Table(
            ["quantity", "run", "place", *lengths, *(Column(w, format=".3f") for w in names)], rows
        )

    def record(self) -> dict[str, Any]:
        """Return the comparison as plain values, SI."""
        return {
            "vehicle": self.vehicle, "edition": self.edition, "runs": list(self.runs),
            "verdict": self.verdict,
            "quantities": [
                {
                    "name": c.quantity.name, "sections": c.sections,
                    "least_sections": c.least, "values": len(c.pairs), "mean": c.mean,
                    "mean_limit": c.mean_limit, "standard_deviation": c.deviation,
                    "limit": c.limit, "verdict": c.verdict,
                }
                for c in self.comparisons
            ],
            "sections": self.section_table().records(), "remarks": list(self.remarks),
        }  # fmt: skip

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> "ModelValidation":
        """Return a comparison from its `record`: all but the channels over the arc length.

        Raises KeyError, TypeError: the record of something else.
        """
        pairs: dict[str, list[Pair]] = {}
        for row in record["sections"]:
            values = {name: row[name] for name in Pair.__dataclass_fields__}
            pairs.setdefault(row["quantity"], []).append(Pair(**values))
        comparisons = tuple(
            Comparison(
                QUANTITIES[row["name"]], tuple(pairs[row["name"]]), row["limit"],
                row["mean_limit"], row["least_sections"],
            )
            for row in record["quantities"]
        )  # fmt: skip
        names = record["vehicle"], tuple(record["runs"])
        return cls(*names, comparisons, (), record["edition"], tuple(record["remarks"]))

    def __repr__(self) -> str:
        return f"{self.vehicle}: {self.verdict}\n{self.table()}"
