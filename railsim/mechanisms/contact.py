"""Positions of rest, and the static contact force of the output at a held pressure."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.mechanism.expressions import Expression
from railsim.definitions.mechanism.parts import AUTO
from railsim.mechanisms import forces
from railsim.mechanisms.inversion import largest, zeros
from railsim.mechanisms.kinematics import Motion, solve
from railsim.mechanisms.outputs import height_of


@dataclass(frozen=True)
class Rest:
    """A position of rest, with dry friction a range of positions [rad or m]."""

    at: float  # value of the driver, or height of the output: the middle of the range
    low: float  # ends of the range; equal without friction
    high: float
    stable: bool  # whether the mechanism comes back to it from either side


@dataclass(frozen=True)
class Contact:
    """Static contact force of the output; NaN where the actuator has no value [N]."""

    pressure: float  # pressure held [Pa]; by default what gives the wanted force at work height
    # without friction, the mean of the forces of a rising and a falling output
    force: Mapping[str, float]  # at low, work and high height without friction
    rising: Mapping[str, float]  # the same with friction, output on its way from start to end
    falling: Mapping[str, float]  # and back
    least: float  # the smallest in the whole zone, with friction either way
    curve: Floats  # at all positions, without friction
    bounds: tuple[Floats, Floats]  # the same with friction, rising and falling
    rests: tuple[Rest, ...]  # heights at which the output rests without a contact force [m]
    reason: str = ""  # why values are missing

    @property
    def equilibria(self) -> tuple[tuple[float, bool], ...]:
        """Heights (the middle of each range) at which it rests, and whether they are stable."""
        return tuple((rest.at, rest.stable) for rest in self.rests)


Force = Callable[[Motion, int], Any]
"""Generalised force of a motion with friction in a sense of the driver: 1, -1, or 0 for none."""


def positions_of_rest(dense: Motion) -> tuple[Rest, ...]:
    """Where a mechanism without an unknown rests under its own weights and elements."""
    if dense.model.definition.solve is not None:
        return ()
    return rests(dense, lambda m, sense: forces.generalised_force(m, forces.Rates(friction=sense)))


def is_loaded(motion: Motion) -> bool:
    """Whether weights or elements act on a mechanism at all."""
    return bool(np.any(forces.generalised_force(motion)))


def rests(dense: Motion, force: Force) -> tuple[Rest, ...]:
    """Where a generalised force is not larger than the friction.

    Without friction these are its zeros, stable where it falls along the driver.  With friction the
    mechanism rests where the force that moves it on is not positive and the one that moves it back
    not negative.
    """
    model = dense.model
    if not np.any(force(dense, 0)):
        return ()
    if forces.frictional(model):
        return tuple(_rest_ranges(dense, force))
    span = model.end - model.start
    low, high = sorted((model.start, model.end))
    found = []
    for s in zeros(dense, lambda m: force(m, 0)):
        h = 1e-6 * abs(span)
        before, after = force(solve(model, [max(s - h, low), min(s + h, high)]), 0)
        found.append(Rest(s, s, s, bool(after < before)))
    return tuple(found)


def _rest_ranges(dense: Motion, force: Force) -> Iterator[Rest]:
    model = dense.model
    edges = [(float(s), 0) for s in (model.start, model.end)]
    for sense in (1, -1):
        edges += [(s, sense) for s in zeros(dense, lambda m, k=sense: force(m, k))]  # type: ignore[misc]
    edges.sort()
    for (low, kind), (high, other) in pairwise(edges):
        if high - low < 1e-12 * abs(model.end - model.start):
            continue
        middle = solve(model, [0.5 * (low + high)])
        if force(middle, 1)[0] <= 0.0 <= force(middle, -1)[0]:
            # not stable where it is moved away: back from below the range, on from above it
            yield Rest(0.5 * (low + high), low, high, kind != -1 and other != 1)


def _held_pressure(dense: Motion, work: float) -> tuple[float, float]:
    """Pressure of `[contact]` [Pa], and the force that gives what is wanted at work height [N].

    The pressure is the stated one, or that of the force.
    """
    definition = dense.model.definition
    contact = definition.contact
    assert contact is not None
    m = solve(dense.model, [work])
    needed = dense.model.number(contact.force) * height_of(m)[1] - forces.generalised_force(m)
    force = needed / forces.unit_work(m, definition.held_by)
    pressure, stated = forces.pressure_for(m, definition.unknown, force)[0], contact.pressure
    automatic = isinstance(stated, Expression) and bool(stated.names & definition.automatic)
    if stated != AUTO and not automatic:
        pressure = dense.model.number(stated)
    return float(pressure), float(force[0])


def contact_of(dense: Motion, motion: Motion, at_zone: Mapping[str, float]) -> Contact | None:
    """Static contact force that `[contact]` asks for, at the zone's heights and all positions.

    `(F w + Q)/y'` with the actuator's force F at the pressure held and the work w of a unit of it.
    """
    definition = dense.model.definition
    if definition.contact is None:
        return None
    unknown = definition.unknown
    pressure, needed = _held_pressure(dense, at_zone["work"])

    def net_force(positions: Motion, friction: int) -> Any:
        push = forces.force_at_pressure(positions, unknown, pressure, needed)
        work = forces.unit_work(positions, definition.held_by)
        return push * work + forces.generalised_force(positions, forces.Rates(friction=friction))

    def force(positions: Motion, way: int) -> Floats:
        return np.asarray(net_force(positions, way * dense.model.sense) / height_of(positions)[1])

    rest_heights = []
    for rest in rests(dense, net_force):
        low, high = sorted(height_of(solve(dense.model, [rest.low, rest.high]))[0].tolist())
        rest_heights.append(Rest(0.5 * (low + high), low, high, rest.stable))
    in_zone = solve(dense.model, list(at_zone.values()))
    ways = (0, 1, -1)
    zone, up, down = (dict(zip(at_zone, force(in_zone, way).tolist(), strict=True)) for way in ways)
    curve, rising, falling = (force(motion, way) for way in ways)
    whole = solve(dense.model, np.linspace(at_zone["low"], at_zone["high"], len(dense.s)))
    ends = [largest(whole, lambda m, k=k: -force(m, k), -force(whole, k))[1] for k in ways[1:]]  # type: ignore[misc]
    least = float(np.min([*up.values(), *down.values(), -max(ends)]))
    missing = not np.all(np.isfinite([*curve, *zone.values()]))
    reason = f"{pressure / 1e6:.5f} MPa leaves the air spring's table" if missing else ""
    curves = curve, (rising, falling)
    return Contact(pressure, zone, up, down, least, *curves, tuple(rest_heights), reason)
