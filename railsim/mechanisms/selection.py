"""Checks and the choice of components: every row of a catalogue fits, or why not."""

from dataclasses import dataclass

import numpy as np

from railsim.definitions.mechanism import CatalogueRow
from railsim.definitions.mechanism_parts import Cylinder, GasSpring
from railsim.mechanisms.analysis import Analysis, actuator_of
from railsim.mechanisms.components import cylinder_area, lid_force, next_size

ROUNDING = 1e-5
"""Share of a limit by which rounding may miss it: dimensions have six or seven digits."""


@dataclass(frozen=True)
class Check:
    """A value against its limit; `sense` says on which side it must be."""

    name: str
    value: float
    limit: float
    sense: str
    unit: str
    note: str

    @property
    def ok(self) -> bool:
        """Whether it is met; on the limit counts as met."""
        margin = ROUNDING * abs(self.limit)
        if self.sense == "above":
            return self.value >= self.limit - margin
        return self.value <= self.limit + margin


@dataclass(frozen=True)
class Choice:
    """A row of a catalogue: whether it fits, or why not.

    Attributes
    ----------
    catalogue, name : str
        Where it stands.
    fits : bool
    reasons : tuple of str
        Why it does not fit; of a row that fits, what was chosen.
    """

    catalogue: str
    name: str
    fits: bool
    reasons: tuple[str, ...]


def checks(result: Analysis) -> list[Check]:
    """Everything that a mechanism must keep, as far as its file says so."""
    definition, model = result.definition, result.model
    found: list[Check] = []
    limits = definition.optimise
    name = actuator_of(definition)
    actuator = definition.actuators.get(name or "")
    if isinstance(actuator, Cylinder) and definition.solve and definition.solve.unknown == name:
        available = model.number(actuator.supply_pressure) * _area(result, actuator)
        note = "largest force against bore and supply pressure"
        found.append(Check("available_force", result.max_force, available, "below", "N", note))
    if limits is not None and limits.min_transmission_angle is not None:
        limit = model.number(limits.min_transmission_angle)
        for angle, value in result.min_angles.items():
            if definition.angles[angle].limited:
                note = "smallest over the whole travel, folded to 90 deg"
                found.append(Check(angle, value, limit, "above", "rad", note))
    if "length" in result.output:
        shortest = float(np.min(result.output["length"]))
        if limits is not None and limits.min_length is not None:
            least, note = model.number(limits.min_length), "shortest length wanted"
            found.append(Check("min_length", shortest, least, "above", "m", note))
        if limits is not None and limits.max_stroke is not None:
            most, note = model.number(limits.max_stroke), "stroke wanted at most"
            found.append(Check("max_stroke", result.stroke, most, "below", "m", note))
        if isinstance(actuator, Cylinder) and actuator.pin_to_pin is not None:
            strokes = [model.number(s) for s in actuator.strokes]
            stroke = next_size(strokes, result.stroke)
            if stroke is not None:
                least = model.number(actuator.pin_to_pin) + stroke
                note = f"shortest length against pin to pin and the stroke of {stroke * 1e3:g} mm"
                found.append(Check("pin_to_pin", shortest, least, "above", "m", note))
    for element, part in definition.elements.items():
        if isinstance(part, GasSpring):
            found.append(_service(result, element, part))
    if (lid := definition.lid) is not None:
        spring = definition.elements[lid.element]
        assert isinstance(spring, GasSpring)
        n = model.number
        least = lid_force(n(lid.mass), n(lid.centre), n(lid.lever), n(lid.springs), n(lid.factor))
        note = "F1 against the makers' quick formula G D/(b n) 9.8 alpha"
        found.append(Check(f"lid_{lid.element}", n(spring.F1), least, "above", "N", note))
    if result.contact is not None:
        values = list(result.contact.force.values())
        note = "static contact force in the zone: the head must not come down"
        found.append(Check("contact_force", float(np.min(values)), 0.0, "above", "N", note))
    return found


def _service(result: Analysis, name: str, spring: GasSpring) -> Check:
    """The temperature of a gas spring against the nearer end of its service range."""
    n = result.model.number
    value, (low, high) = n(spring.temperature), (n(x) for x in spring.service)
    above = value < 0.5 * (low + high)
    limit, sense = (low, "above") if above else (high, "below")
    note = "temperature against the range in service"
    return Check(f"{name}_temperature", value, limit, sense, "C", note)


def _area(result: Analysis, cylinder: Cylinder, bore: float | None = None) -> float:
    n = result.model.number
    size = n(cylinder.bore) if bore is None else bore
    return float(cylinder_area(size, n(cylinder.rod), n(cylinder.count), cylinder.acts))


def needed_bore(result: Analysis, cylinder: Cylinder) -> float:
    """Smallest bore that gives the largest force at the supply pressure [m]."""
    n = result.model.number
    area = result.max_force / n(cylinder.supply_pressure) / n(cylinder.count)
    rod = n(cylinder.rod) if cylinder.acts == "pull" else 0.0
    return float(np.sqrt(4.0 * area / np.pi + rod * rod))


def selection(result: Analysis) -> list[Choice]:
    """Cylinders and gas springs of the catalogues, each with its verdict."""
    found: list[Choice] = []
    definition = result.definition
    for name, actuator in definition.actuators.items():
        solved = definition.solve is not None and name == definition.solve.unknown
        if isinstance(actuator, Cylinder) and solved:
            found += _cylinders(result, actuator)
    for wanted in definition.selection:
        element = definition.elements[wanted.element]
        assert isinstance(element, GasSpring)
        for row in definition.catalogues[wanted.catalogue]:
            found.append(_gas_spring(result, wanted.element, element, wanted.catalogue, row))
    return found


def _cylinders(result: Analysis, cylinder: Cylinder) -> list[Choice]:
    n = result.model.number
    bore, stroke = needed_bore(result, cylinder), result.stroke
    shortest = float(np.min(result.output["length"]))
    made = next_size([n(s) for s in cylinder.strokes], stroke)
    found = []
    for size in (n(b) for b in cylinder.bores):
        why = []
        if size < bore * (1.0 - ROUNDING):
            why.append(f"bore {bore * 1e3:.2f} mm needed")
        if made is None:
            why.append(f"stroke {stroke * 1e3:.1f} mm is not made")
        elif cylinder.pin_to_pin is not None:
            least = n(cylinder.pin_to_pin) + made
            if shortest < least * (1.0 - ROUNDING):
                why.append(
                    f"{shortest * 1e3:.1f} mm at the shortest, {least * 1e3:g} mm from pin to pin"
                )
        chosen = (f"stroke {made * 1e3:g} mm",) if made is not None else ()
        name = f"bore {size * 1e3:g} mm"
        found.append(Choice("cylinder", name, not why, tuple(why) or chosen))
    return found


def _gas_spring(
    result: Analysis, name: str, spring: GasSpring, catalogue: str, row: CatalogueRow
) -> Choice:
    """A series of a catalogue for a gas spring: its stroke, force and length."""
    n = result.model.number
    lengths = result.output[f"{name}_length"]
    needed = float(np.ptp(lengths))
    longest, shortest, F1 = float(np.max(lengths)), float(np.min(lengths)), float(n(spring.F1))
    strokes = _strokes(result, row, needed)
    why = []
    low, high = (n(f) for f in row.F1)
    if not low <= F1 <= high:
        why.append(f"F1 {F1:g} N is not within {low:g} to {high:g} N")
    if not strokes:
        largest = n(row.stroke[1]) if row.stroke is not None else n((row.strokes or (0.0,))[-1])
        why.append(f"stroke {needed * 1e3:.1f} mm is needed, {largest * 1e3:g} mm the largest")
    chosen = strokes[0] if strokes else None
    if chosen is not None and row.extended is not None:
        factor, constant = (n(x) for x in row.extended)
        fitting = [
            c for c in strokes if factor * c + constant >= longest and
            (factor - 1.0) * c + constant <= shortest
        ]  # fmt: skip
        chosen = fitting[0] if fitting else None
        if chosen is None:
            why.append(f"{shortest * 1e3:.1f} to {longest * 1e3:.1f} mm is no range of its lengths")
    said = () if chosen is None else (f"stroke {chosen * 1e3:g} mm",)
    return Choice(catalogue, f"{name}: {row.name}", not why, tuple(why) or said)


def _strokes(result: Analysis, row: CatalogueRow, needed: float) -> list[float]:
    """Strokes of a row that are long enough, the shortest first; of a range some more."""
    n = result.model.number
    if row.strokes is not None:
        return [n(s) for s in row.strokes if n(s) >= needed]
    assert row.stroke is not None
    low, high = n(row.stroke[0]), n(row.stroke[1])
    first = max(low, needed)
    return [] if first > high else list(np.linspace(first, high, 101))
