"""Running tests after EN 14363 (2016 with A2:2022) and UIC 518: section values of a run.

What is measured in a section stands in `criteria.py`.  Where the filtered Q <= 0 the wheel is
lifted: Y/Q has no value there, its percentile is that of the other windows, and the length over
which the wheel is lifted is kept for the verdict.  The instability is judged at one frequency f0 of
the vehicle, see `hunting_frequency`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from railsim.arrays import Floats
from railsim.assessment.criteria import CRITERIA, FORCES, HUNTING_ZONES, Criterion
from railsim.assessment.record import Record
from railsim.assessment.sections import TestSection
from railsim.assessment.signals import Signals, wheel_load

FREQUENCIES = np.arange(0.4, 20.0, 0.01)  # Hz, among which that of the instability is sought
LONGEST = 60.0  # s, duration of the sections that are evaluated together


@dataclass
class SectionValues:
    """Values of one section."""

    section: TestSection
    # by quantity and wheelset, wheel or sensor: one value, or both percentiles on straight track
    # [SI]
    values: dict[tuple[str, str], list[float]] = field(default_factory=dict)
    lifted: dict[str, float] = field(default_factory=dict)  # length without load by wheel [m]

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI; of two percentiles the larger."""
        part = {name: getattr(self.section, name) for name in ("begin", "end", "radius", "speed")}
        items = self.values.items()
        rows = [{"name": name, "place": place, "value": max(x)} for (name, place), x in items]
        return {**part, "lifted": self.lifted, "quantities": rows}


def section_values(
    record: Record,
    sections: Sequence[TestSection],
    *,
    f0: float | None = None,
    causal: bool = False,
    criteria: Sequence[Criterion] | None = None,
) -> list[SectionValues]:
    """Values of the given sections of a run.

    `record`: Run with all that is needed, and accelerations or body motions. `sections`: In the
    order of the track. `f0`: Frequency of the instability [Hz]; without it the instability is not
    judged. `causal`: Use causal filters, as in a measuring amplifier, instead of zero-phase
    filters. `criteria`: What is measured, by default all.
    """
    rows = []
    for group in _neighbours(sections):
        signals = Signals(record, group[0].begin, group[-1].end, f0=f0, causal=causal)
        for section in group:
            values: dict[tuple[str, str], list[float]] = {}
            for criterion in CRITERIA.values() if criteria is None else criteria:
                measured = criterion.measure(signals, section)
                values |= {(criterion.name, place): numbers for place, numbers in measured.items()}
            rows.append(SectionValues(section, values, _unloaded_lengths(signals, section)))
    return rows


def _neighbours(sections: Sequence[TestSection]) -> list[list[TestSection]]:
    """Neighbouring sections that are read and filtered together."""
    groups: list[list[TestSection]] = []
    for section in sections:
        last = groups[-1] if groups else None
        if (
            last
            and section.begin - last[-1].end < 1.0
            and section.turn == last[-1].turn
            and (section.end - last[0].begin) / section.speed <= LONGEST
        ):
            last.append(section)
        else:
            groups.append([section])
    return groups


def _unloaded_lengths(signals: Signals, section: TestSection) -> dict[str, float]:
    """Length over which each wheel is without load [m]."""
    load = wheel_load(signals, FORCES)
    lengths = {}
    for k, (label, side) in enumerate(load.places):
        rows = load.rows(k, section)
        unloaded = load.values[rows, k] <= 0.0
        if unloaded.any():
            metres = np.sum(np.gradient(load.s[rows, k])[unloaded])
            lengths[f"{label} {section.wheel(side)}"] = float(metres)
    return lengths


def spectrum(x: Floats, rate: float) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and power: Hann window, zero-padded to four times the length."""
    n = len(x)
    power = np.abs(np.fft.rfft((x - np.mean(x)) * np.hanning(n), 4 * n)) ** 2 / n
    return np.asarray(np.fft.rfftfreq(4 * n, 1.0 / rate), dtype=np.float64), power


def hunting_spectrum(record: Record, sections: Sequence[TestSection]) -> Floats:
    """Power of the track shift forces of all wheelsets in zones 1 and 2, over `FREQUENCIES`."""
    power = np.zeros(len(FREQUENCIES))
    for group in _neighbours([s for s in sections if s.zone in HUNTING_ZONES]):
        rows = record.rows_between(group[0].begin, group[-1].end, 0.0)
        for force in record.result.part("Y", rows).sum(axis=-1).T:
            power += np.interp(FREQUENCIES, *spectrum(force, record.rate))
    return power


def hunting_frequency(spectra: Sequence[Floats]) -> float | None:
    """Frequency f0, the largest component of all runs [Hz]; None without sections in 1 and 2."""
    power = np.sum(spectra, axis=0) if len(spectra) else np.zeros(1)
    return float(FREQUENCIES[np.argmax(power)]) if np.any(power) else None
