"""Choice of components: every row of a catalogue fits, or why not, and what it does."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from railsim.definitions.mechanism.definition import CatalogueRow
from railsim.definitions.mechanism.parts import Cylinder, GasSpring
from railsim.design_checks import ROUNDING
from railsim.mechanisms.analysis import Analysis, either_way
from railsim.mechanisms.components import gas_temperature_factor, next_size
from railsim.mechanisms.forces import Rates, actuator_force
from railsim.mechanisms.kinematics import Motion


@dataclass(frozen=True)
class Choice:
    """A row of a catalogue: whether it fits, or why not."""

    catalogue: str
    name: str
    fits: bool
    reasons: tuple[str, ...]  # why it does not fit; of a row that fits, what was chosen
    values: dict[str, float]
    """Of a gas spring that fits: stroke, extended length, body, rod, progression, tolerance of F1
    (`F1_low`, `F1_high`), force of the lock; the unknown force with it (`force_least`,
    `force_most`), and the same over temperatures in service and tolerances of F1 (`force_lowest`,
    `force_highest`); the gas pressure over the outside (`pressure_least`, `pressure_most`)."""


def selection(result: Analysis) -> list[Choice]:
    """Cylinders and gas springs of the catalogues, each with its verdict."""
    definition = result.definition
    unknown = definition.held_by if definition.solve is not None else None
    found = [*_cylinders(result, unknown)] if isinstance(unknown, Cylinder) else []
    for request in definition.selection:
        element = definition.elements[request.element]
        assert isinstance(element, GasSpring)
        for row in definition.catalogues[request.catalogue]:
            found.append(_gas_spring(result, request.element, element, request.catalogue, row))
    return found


def needed_bore(result: Analysis, cylinder: Cylinder) -> float:
    """Smallest bore that gives the largest force of each chamber at the supply pressure [m]."""
    n = result.model.number
    least, most = either_way(result, "force")
    rod = n(cylinder.rod)
    chambers = {"push": [(most, 0.0)], "pull": [(most, rod)], "both": [(most, 0.0), (-least, rod)]}
    bores = [0.0]
    for force, rod in chambers[cylinder.acts]:
        area = max(force, 0.0) / n(cylinder.supply_pressure) / n(cylinder.count)
        bores.append(float(np.sqrt(4.0 * area / np.pi + rod * rod)))
    return max(bores)


def _cylinders(result: Analysis, cylinder: Cylinder) -> Iterator[Choice]:
    n = result.model.number
    bore, stroke = needed_bore(result, cylinder), result.stroke
    shortest = result.extremes("length").least
    made = next_size([n(s) for s in cylinder.strokes], stroke)
    least, _ = either_way(result, "force")
    wrong = cylinder.acts != "both" and -least > ROUNDING * result.peak_force
    for size in (n(b) for b in cylinder.bores):
        why = []
        if wrong:
            other = "pull" if cylinder.acts == "push" else "push"
            why.append(f"must {other} {-least:.0f} N: pressure in the other chamber too")
        if size < bore * (1.0 - ROUNDING):
            why.append(f"bore {bore * 1e3:.2f} mm needed")
        if made is None:
            why.append(f"stroke {stroke * 1e3:.1f} mm is not made")
        elif cylinder.pin_to_pin is not None:
            shortest_made = n(cylinder.pin_to_pin) + made
            if shortest < shortest_made * (1.0 - ROUNDING):
                apart = f"{shortest_made * 1e3:g} mm from pin to pin"
                why.append(f"{shortest * 1e3:.1f} mm at the shortest, {apart}")
        words = (f"stroke {made * 1e3:g} mm",) if made is not None else ()
        name = f"bore {size * 1e3:g} mm"
        yield Choice("cylinder", name, not why, tuple(why) or words, {})


def _gas_spring(
    result: Analysis, name: str, spring: GasSpring, catalogue: str, row: CatalogueRow
) -> Choice:
    """A series of a catalogue for a gas spring: its stroke, force and length."""
    n = result.model.number
    lengths = result.extremes(f"{name}_length")
    F1, unlock, extended = float(n(spring.F1)), n(row.unlock), n(spring.extended)
    needed = lengths.most - lengths.least + unlock
    stroke = _stroke(result, row, needed)
    largest = max(map(n, row.stroke or row.strokes or ())) * 1e3
    why = []
    low, high = (n(f) for f in row.F1)
    if not low <= F1 <= high:
        why.append(f"F1 {F1:g} N is not within {low:g} to {high:g} N")
    if stroke is None:
        why.append(f"stroke {needed * 1e3:.1f} mm is needed, {largest:g} mm the largest")
    elif row.extended is not None:
        factor, constant = (n(x) for x in row.extended)
        stroke = _stroke(result, row, max(needed, (lengths.most + unlock - constant) / factor))
        shortest = lengths.least * (1.0 + ROUNDING)
        if stroke is None or (factor - 1.0) * stroke + constant > shortest:
            least, most = lengths.least * 1e3, lengths.most * 1e3
            why.append(f"{least:.1f} to {most:.1f} mm is no range of its lengths")
        else:
            extended = factor * stroke + constant
    else:
        # made to the length that the file asks for: what it is compressed by must be in the stroke
        compressed = extended - lengths.least
        stroke = _stroke(result, row, max(needed, compressed))
        if stroke is None:
            why.append(f"compressed by {compressed * 1e3:.1f} mm, {largest:g} mm at most")
    notes = [] if stroke is None else [f"stroke {stroke * 1e3:.4g} mm"]
    stated = [n(limit) for limit, _, _ in row.F1_tolerance or ()]
    if stated and max(stated) < F1:
        notes.append(f"no tolerance of F1 stated above {max(stated):g} N")
    values: dict[str, float] = {}
    if not why and stroke is not None:
        values = _with_row(result, name, spring, row, stroke, extended)
    return Choice(catalogue, f"{name}: {row.name}", not why, tuple(why or notes), values)


def _stroke(result: Analysis, row: CatalogueRow, needed: float) -> float | None:
    """Shortest stroke of a row that is long enough [m]; None where none is."""
    n, enough = result.model.number, needed * (1.0 - ROUNDING)
    if row.strokes is not None:
        return next_size([n(s) for s in row.strokes], enough)
    assert row.stroke is not None
    low, high = n(row.stroke[0]), n(row.stroke[1])
    return None if enough > high else float(np.clip(needed, low, high))


def _with_row(
    result: Analysis,
    name: str,
    spring: GasSpring,
    row: CatalogueRow,
    stroke: float,
    extended: float,
) -> dict[str, float]:
    """What the mechanism does with a row of a catalogue in place of its gas spring."""
    n = result.model.number
    F1 = float(n(spring.F1))
    progression = n(spring.progression if row.progression is None else row.progression)
    minus, plus = F1_band(result, row, F1)
    values = {"stroke": stroke, "extended": extended, "progression": progression, "F1": F1}
    values |= {"F1_low": F1 - minus, "F1_high": F1 + plus}
    rod = spring.rod if row.rod is None else row.rod
    known = {"body": row.body, "rod": rod, "lock_extension": row.lock_extension}
    values |= {key: float(n(value)) for key, value in known.items() if value is not None}
    if row.lock_compression is not None:
        values["lock_compression"] = n(row.lock_compression) * F1
    if rod is not None:
        section = 0.25 * np.pi * n(rod) ** 2
        values |= {"pressure_least": F1 / section, "pressure_most": F1 * progression / section}
    if result.definition.solve is None:
        return values
    made = {"stroke": stroke, "extended": extended, "progression": progression, "rod": rod}
    cold, hot = (n(x) for x in spring.service)
    for (low, high), corners in {
        ("force_least", "force_most"): [(F1, n(spring.temperature))],
        # all corners: other springs, as warm as this one, may act against it
        ("force_lowest", "force_highest"): [*product((F1 - minus, F1 + plus), (cold, hot))],
    }.items():
        forces = []
        for force, temperature in corners:
            changes: dict[str, Any] = {**made, "F1": force, "temperature": temperature}
            forces += _unknown_forces(result, name, spring.model_copy(update=changes), temperature)
        values[low], values[high] = float(np.min(forces)), float(np.max(forces))
    values["F_cold"] = gas_temperature_factor(cold) * (F1 - minus)
    values["F_hot"] = gas_temperature_factor(hot) * (F1 + plus)
    return values


def F1_band(result: Analysis, row: CatalogueRow, F1: float) -> tuple[float, float]:
    """Tolerance of the force F1 that a row states: minus and plus [N]."""
    n = result.model.number
    for limit, minus, plus in sorted([n(x) for x in band] for band in row.F1_tolerance or ()):
        if limit >= F1:
            return float(minus), float(plus)
    return 0.0, 0.0


def _unknown_forces(
    result: Analysis, name: str, spring: GasSpring, temperature: float
) -> list[Any]:
    """The unknown force, way and back, with another gas spring; all have the same temperature."""
    definition = result.definition
    elements = {**definition.elements, name: spring}
    for key, part in elements.items():
        if isinstance(part, GasSpring):
            elements[key] = part.model_copy(update={"temperature": temperature})
    model = replace(result.model, definition=definition.model_copy(update={"elements": elements}))
    motion: Motion = replace(result.motion, model=model, known={})
    rates = [Rates(friction=way, trial=True) for way in (1, -1)]
    return [actuator_force(motion, definition.unknown, one) for one in rates]
