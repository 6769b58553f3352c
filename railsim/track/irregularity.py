"""Displacements of a track's rails over the arc length: its irregularities, its gauge widening.

Each irregularity says itself how it moves the rails, see `railsim.definitions.excitations`.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from railsim.arrays import Floats
from railsim.definitions import Track
from railsim.definitions.excitations.base import Displacement, Irregular
from railsim.definitions.excitations.law import ByLaw
from railsim.definitions.excitations.measured import RECORDED, Measured, largest_between_rows
from railsim.definitions.excitations.single import Single
from railsim.definitions.track.elements import Section
from railsim.definitions.track.layout import cant_sections, curvature_sections
from railsim.definitions.track.rounded_profile import RoundedProfile
from railsim.errors import input_error
from railsim.laws.binding import EXCITATION, bind_use
from railsim.laws.permission import permitted_part

# Largest displacement between the rows over that at the rows, from which on it is remarked on.
BEYOND_ROWS = 1.05
# Least cant and length at which a cross level is held against it, and share of it that is doubtful.
CANTED, LONG, TWICE = 0.02, 30.0, 0.5  # m, m, 1
VERSINE = 0.01  # m; mean alignment in a curve that is doubtful
SMALLEST, ROUGHNESS = 1e-4, 0.1  # m; of a recording, and distance of the rows of rougher rails
MOST_ROWS = 500_000  # that tables follow, of a record as long as the track: 250 MB
SHORT = 0.4  # m; waves that steps resolve however low they are
LARGEST = 0.5  # m; of a law of one's own


def shown_displacement(track: Track) -> Displacement | None:
    """Return the displacement for pictures, without laws that are not permitted."""
    return displacement(permitted_part(track)) or (
        (lambda s: (np.zeros((4, *s.shape)),) * 2) if track.irregularities else None
    )


def displacement(track: Track) -> Displacement | None:
    """Sum of all displacements of a track's rails, None where there are none."""
    parts = [
        _by_law(part, f"irregularities.{k}", track)
        if isinstance(part, ByLaw)
        else part.displacement(track.length)
        for k, part in enumerate(track.irregularities)
    ]
    if track.gauge_widening is not None:
        parts.append(_widening(track))
    if not parts:
        return None

    def total(s: Floats) -> tuple[Floats, Floats]:
        values, rates = zip(*(part(s) for part in parts), strict=True)
        return np.sum(values, axis=0), np.sum(rates, axis=0)

    return total


def _by_law(part: ByLaw, key: str, track: Track) -> Displacement:
    """Return what a law of one's own gives; InputError where it is not permitted or not finite."""
    bound, values = bind_use("track", key, part, track.laws, EXCITATION)

    def value(s: Floats) -> Floats:
        found: Floats = bound.values(s[:, None], values)
        wrong = np.flatnonzero(~(np.abs(part.factor * found) <= LARGEST))
        if wrong.size:
            words = f"the law '{part.law}' gives {found[wrong[0]]:g} m at s = {s[wrong[0]]:.6g} m"
            raise input_error("track", words, f"a number within {LARGEST:g} m", key=key)
        return found

    return part.displacement_by(value, track.length)


def shortest_length(track: Track) -> float:
    """Length that the tables must resolve: a sixteenth of the shortest wave, and so on [m].

    Of records no more than a share of the track, `MOST_ROWS`: there is a remark.
    """
    return min((_resolved_length(part, track) for part in track.irregularities), default=np.inf)


def shortest_wave(track: Track) -> float:
    """Shortest wave of the rails that goes on, of records and such like [m].

    Infinite from `SHORT` on: where such waves or single disturbances are high, steps are divided.
    """
    parts = [part for part in track.irregularities if not isinstance(part, Single)]
    shortest = 16.0 * min((_resolved_length(part, track) for part in parts), default=np.inf)
    return shortest if shortest < SHORT else np.inf


def _resolved_length(part: Irregular, track: Track) -> float:
    """Length that tables resolve of an irregularity [m]."""
    least = track.length / MOST_ROWS if isinstance(part, Measured) else 0.0
    return max(part.resolution(), least)


def measured_remarks(track: Track) -> list[str]:
    """Remark on records between whose rows the rails go further than at them, on gaps and curves.

    Further by 5 % or more; gaps of five steps or more, or of 30 m at an end of the track; cant or
    versines in the record; less than 0.1 mm in all of it.
    """
    remarks = []
    for index, part in enumerate(track.irregularities):
        if not isinstance(part, Measured):
            continue
        column, at_rows, between, s = largest_between_rows(part)
        if between > BEYOND_ROWS * at_rows:
            remarks.append(
                f"The rails go further between the rows of irregularities.{index} than at them: "
                f"{column} reaches {1e3 * between:.3g} mm at s = {s:.1f} m, "
                f"the largest row is {1e3 * at_rows:.3g} mm."
            )
        remarks += [*_size_remarks(part, index), *_gap_remarks(part, index)]
        if (cell := track.length / MOST_ROWS) > part.resolution():
            remarks.append(
                f"irregularities.{index} has rows closer than a track of {track.length:g} m is "
                f"resolved: waves below {4e3 * cell:.3g} mm are not followed; a shorter track does."
            )
        remarks += _held_remarks(part, index, track)
    ends = [
        part.extent(track.length)
        for part in track.irregularities
        if isinstance(part, Measured) and len(part.rows or ()) >= RECORDED
    ]
    low, high = min((a for a, _ in ends), default=0.0), max((b for _, b in ends), default=np.inf)
    if low > LONG or high < track.length - LONG:
        remarks.append(
            f"What is recorded goes from s = {low:.0f} to {high:.0f} m of the {track.length:.0f} m "
            "of the track: elsewhere it moves no rail."
        )
    return remarks


def _size_remarks(part: Measured, index: int) -> Iterator[str]:
    """Remark on a record smaller than that of any track, unless its rows follow short waves."""
    s, *rails = np.array(part.rows or ()).T
    largest = abs(part.scale) * float(np.abs(rails).max())
    if len(s) >= RECORDED and largest < SMALLEST and np.median(np.diff(s)) >= ROUGHNESS:
        yield (
            f"irregularities.{index} moves the rails by {1e3 * largest:.2g} mm at most, less than "
            "any track does: another unit?"
        )


def _gap_remarks(part: Measured, index: int) -> Iterator[str]:
    """Remark on rows that are missing: a smooth curve bridges them, and no defect is seen there."""
    if not (gaps := part.gaps()):
        return
    s = np.array([row[0] + part.shift for row in part.rows or ()])
    k = max(gaps, key=lambda k: s[k] - s[k - 1])
    more = f"the longest of {len(gaps)} such gaps, " if len(gaps) > 1 else ""
    yield (
        f"irregularities.{index} has no rows from s = {s[k - 1]:.1f} to {s[k]:.1f} m, {more}"
        f"elsewhere one every {np.median(np.diff(s)):.3g} m: a smooth curve bridges them, and "
        "forces there are not those of the track."
    )


def _held_remarks(part: Measured, index: int, track: Track) -> Iterator[str]:
    """Remark on a cross level or an alignment that holds the cant or the curves of the track."""
    rows = np.array(part.rows or ())
    s, rails = rows[:, 0] + part.shift, part.scale * rows[:, 1:]
    for word, sections, values in (
        ("cross level", cant_sections(track), rails[:, 3] - rails[:, 1]),
        ("alignment", curvature_sections(track), max(rails[:, 0], rails[:, 2], key=np.ptp)),
    ):
        for section in sections:
            own, middle = section.start_value, 0.5 * (section.begin + section.end)
            inside = (s >= section.begin) & (s < section.end)
            if own != section.end_value or not own or not inside.any():
                continue
            mean = float(values[inside].mean()) if np.ptp(s[inside]) >= LONG else 0.0
            if word == "alignment" and abs(mean) > VERSINE:
                there, same = f"in the curve of {1.0 / own:.6g} m", "the versine of this curve"
            elif word != "alignment" and abs(mean) > TWICE * abs(own) >= TWICE * CANTED:
                there, same = f"where the track has {1e3 * own:.0f} mm of cant", "the same cant"
            else:
                continue
            yield (
                f"The {word} of irregularities.{index} is {1e3 * mean:.0f} mm in the mean about "
                f"s = {middle:.0f} m, {there}: they add up. Where it is {same}, band takes it out."
            )
            break


def _widening(track: Track) -> Displacement:
    rows = track.gauge_widening or ()
    left = _profile([(row[0], -row[1]) for row in rows], track.rounding)
    right = _profile([(row[0], row[2]) for row in rows], track.rounding)

    def moved(s: Floats) -> tuple[Floats, Floats]:
        zero = np.zeros_like(s)
        return (
            np.stack((left(s), zero, right(s), zero)),
            np.stack((left.rate(s), zero, right.rate(s), zero)),
        )

    return moved


def _profile(points: Sequence[tuple[float, float]], rounding: float) -> RoundedProfile:
    """Rounded profile through points (s, value), constant beyond them."""
    first, value = points[0]
    sections = [
        Section("", "", begin[0] - first, end[0] - first, begin[1], end[1])
        for begin, end in pairwise(points)
    ]
    return RoundedProfile(sections or [Section("", "", 0.0, 1.0, value, value)], rounding, first)
