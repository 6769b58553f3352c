"""Wheels that are not round, in the arrays of a run.

Equilibrium, linear analyses and the choice of the step see round wheels, as they see smooth rails;
`rolling` gives the system that runs, with the check rails.
"""

from typing import NamedTuple

import numpy as np

from railsim.arrays import Floats, Integers
from railsim.contact.curves import rail_curve, tape_circle_position
from railsim.contact.out_of_round import Surface, parts_by_wheel, surface_arrays, wheel_surface
from railsim.definitions import Track
from railsim.definitions.vehicle.flatten import FlatVehicle
from railsim.definitions.vehicle.out_of_round import Flat, Sections, Uneven
from railsim.kernels.contact_table import FLANGE, N_PATCH, TREAD
from railsim.kernels.system import System
from railsim.kernels.wheel_surface import FIRST, FIRST_FLAT, FLAT, N_PHI, N_Y, SURFACE_ROW, WAVE
from railsim.model.check_rails import CheckRails
from railsim.model.rail_ranges import RailRanges
from railsim.profiles.profile import Profile

PER_LENGTH = 20.0  # steps over a flat or wave
PER_WAVE = 60.0  # on rigid rails, where the fast scheme smooths the accelerations of wheelsets


class UnevenWheels(NamedTuple):
    """The fields of `kernels.system.Contact` that hold wheels that are not round."""

    surface_of: Integers
    surface_row: Floats
    surface: Floats
    flat_ahead: Floats

    @property
    def uneven(self) -> bool:
        """Whether a wheel is not round."""
        return bool((self.surface_of >= 0).any())

    def heights(self, w: int, angle: float) -> Floats:
        """Return e and e_phi of both treads of wheelset `w` in mid-gauge [m], at an angle.

        On a flat e_phi is 0: no wheel that runs over one follows it, which would throw it up.
        """
        found, turn = np.zeros((2, 2)), 2.0 * np.pi
        for side, table in enumerate(self.surface_of[w, :, TREAD]):
            if table >= 0:
                columns = [FIRST, N_PHI, N_Y, FIRST_FLAT]
                first, n, n_y, ahead = self.surface_row[table, columns].astype(int).tolist()
                values = self.surface[first + n_y // 2 : first + n * n_y : n_y, :2]
                on_flat = self.flat_ahead[ahead + int(angle % turn / turn * n)] == 0.0
                nodes = np.linspace(0.0, turn, n, endpoint=False)
                found[side] = [np.interp(angle, nodes, x, period=turn) for x in values.T]
                found[side, 1] *= not on_flat
        return found

    def longest_step(self, speed: float, of_rails: float, *, elastic: bool) -> float:
        """Longest step that resolves waves of the wheels and of elastic or rigid rails [m], [s]."""
        steps = PER_LENGTH if elastic else PER_WAVE
        shortest = float(min(self.surface_row[:, WAVE], default=np.inf))
        return min(shortest, of_rails) / (steps * speed)


ROUND = UnevenWheels(
    np.zeros((0, 2, N_PATCH), dtype=np.int64),
    np.zeros((0, SURFACE_ROW)),
    np.zeros((0, 4)),
    np.zeros(0),
)


def uneven_wheels(flat: FlatVehicle, track: Track, profiles: dict[str, Profile]) -> UnevenWheels:
    """Return the wheels of a vehicle that are not round, on the rails of a track."""
    wheelsets = [body.wheelset for body in flat.of_kind("wheelset")]
    if not track.sections and not any(w and w.out_of_round for w in wheelsets):
        return ROUND
    surface_of = np.full((len(wheelsets), 2, N_PATCH), -1)
    surfaces: list[Surface] = []
    known: dict[object, int] = {}

    def number(parts: tuple[Uneven, ...], radius: float, rail: str, tape: float) -> int:
        if not parts:
            return -1
        measured = any(isinstance(part, Sections) for part in parts)
        key = (tuple(part.model_copy(update={"wheel": "both"}) for part in parts), radius) + (
            (rail, tape) if measured else ()
        )
        if key not in known:
            curve = rail_curve(profiles[rail], track.gauge, track.inclination)
            known[key] = len(surfaces)
            surfaces.append(wheel_surface(parts, radius, curve, tape))
        return known[key]

    for w, wheelset in enumerate(wheelsets):
        assert wheelset is not None
        tape = tape_circle_position(wheelset.back_to_back)
        for side, parts in enumerate(parts_by_wheel(wheelset.out_of_round)):
            radius, rail = wheelset.radius[side], track.rail[side]
            surface_of[w, side] = number(parts, radius, rail, tape)
            # flats are on the tread
            whole = tuple(part for part in parts if not isinstance(part, Flat | Sections))
            surface_of[w, side, FLANGE] = number(whole, radius, rail, tape)
    return UnevenWheels(surface_of, *surface_arrays(surfaces))


def rolling(system: System, wheels: UnevenWheels, check: CheckRails, rails: RailRanges) -> System:
    """Return the system with its wheels and rails as they are, and check rails."""
    contact = system.contact._replace(**wheels._asdict(), **check._asdict(), rails=rails.arrays)
    return system._replace(contact=contact)


def longest_part(system: System, speed: float) -> float:
    """Longest part of a step in which a wheel passes a flat [s]; infinite without flats."""
    flat = min(system.contact.surface_row[:, FLAT], default=np.inf)
    return float(flat) / (PER_LENGTH * speed)
