"""Rigid contact geometry of a wheelset on straight track, without yaw.

For each lateral displacement the wheelset rolls until both rigid wheels touch their rails; contact
points, rolling radii and contact angles follow.  This is the geometry of EN 15302 and of every
plot of "contact functions"; the simulation itself uses `railsim.contact.table`, which knows
several contacts at once, yaw and elasticity.

The search is exact (least vertical gap over candidates 0.03 mm apart, refined between them); it
shares the prepared profiles with the table but nothing else.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from railsim.arrays import Floats
from railsim.contact.conicity import equivalent_conicity
from railsim.contact.curves import misfits, rail_curve, tape_circle_position, wheel_curve
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.tables import Wheelset
from railsim.errors import Faults, InputError
from railsim.kernels import contact_geometry as kernel
from railsim.notation import SIDES
from railsim.profiles.profile import Profile

T = TypeVar("T")

SEARCH_SPACING = 3e-5
"""Distance of the candidates on the wheel [m]."""

LARGEST_ROLL = 0.03
"""Largest roll of a wheelset that is tried [rad]."""

LATERAL = 0.010
"""Largest lateral displacement of a wheelset by default [m]."""


@dataclass(frozen=True, eq=False)
class ContactGeometry:
    """Rigid contact functions of a wheelset; side axis in the order left, right.

    Attributes
    ----------
    lateral : ndarray, shape (n,)
        Lateral displacement of the wheelset, positive to the right [m].
    roll : ndarray, shape (n,)
        Roll of the wheelset [rad].
    rolling_radius : ndarray, shape (n, 2)
        Radius at the contact [m].
    contact_angle : ndarray, shape (n, 2)
        Angle of the contact plane to the track plane, positive for a normal cone, growing towards
        the flange [rad].
    contact_y : ndarray, shape (n, 2)
        Lateral position of the contact, track axes [m].
    wheel_y : ndarray, shape (n, 2)
        Lateral position of the contact on the wheel from the nominal rolling circle, positive to
        the field side [m].
    centre_z : ndarray, shape (n,)
        Vertical displacement of the wheelset's centre, positive down [m].
    """

    lateral: Floats
    roll: Floats
    rolling_radius: Floats
    contact_angle: Floats
    contact_y: Floats
    wheel_y: Floats
    centre_z: Floats

    @property
    def delta_r(self) -> Floats:
        """Rolling radius difference, right minus left [m], shape (n,)."""
        difference: Floats = self.rolling_radius[:, 1] - self.rolling_radius[:, 0]
        return difference

    def equivalent_conicity(self, amplitudes: ArrayLike) -> Floats:
        """Equivalent conicity by EN 15302, see `railsim.contact.equivalent_conicity`."""
        known = np.isfinite(self.delta_r)
        return equivalent_conicity(self.lateral[known], self.delta_r[known], amplitudes)

    def jumps(self, least: float = 1e-3) -> list[tuple[float, str]]:
        """Displacements at which a contact jumps on its wheel by more than `least` [m].

        Returns
        -------
        list of (lateral [m], side)
            Middle of the step in which the jump lies, and ``"left"`` or ``"right"``.
        """
        middles = 0.5 * (self.lateral[:-1] + self.lateral[1:])
        steps = np.argwhere(np.abs(np.diff(self.wheel_y, axis=0)) > least)
        return sorted((float(middles[i]), SIDES[side]) for i, side in steps)


def _positions(furthest: float) -> Floats:
    """Lateral displacements in steps of 0.05 mm, as far to either side [m]."""
    count = round(furthest / 0.05e-3)
    return np.asarray(np.linspace(-furthest, furthest, 2 * count + 1))


def _pair(value: T | tuple[T, T]) -> tuple[T, T]:
    """Left and right of something given once or for each side."""
    return value if isinstance(value, tuple) else (value, value)


def contact_geometry(
    wheel: Profile | tuple[Profile, Profile],
    rail: Profile | tuple[Profile, Profile],
    radius: float | tuple[float, float] = 0.46,
    gauge: float = 1.435,
    inclination: float = 0.025,
    back_to_back: float = 1.360,
    lateral: ArrayLike | None = None,
) -> ContactGeometry:
    """Rigid contact functions of a wheelset.

    Parameters
    ----------
    wheel, rail : Profile or (left, right)
        Profiles; a left one is given as a right one.
    radius : float or (left, right)
        Rolling radius at the nominal rolling circle [m].
    gauge : float
        Distance of the gauge faces within 14 mm below the rail tops [m].
    inclination : float
        Inclination of the rails, as tangent [1].
    back_to_back : float
        Distance of the flange backs [m].
    lateral : ndarray, shape (n,), optional
        Lateral displacements, increasing; default -10 to 10 mm in steps of 0.05 mm [m].

    Returns
    -------
    ContactGeometry
        With nan where no roll up to 30 mrad lets both wheels touch.

    Raises
    ------
    InputError
        If the wheelset does not fit onto the rails: it falls between them or its flanges ride on
        them in the middle of the track.
    """
    radii = _pair(radius)
    tape_circle = tape_circle_position(back_to_back)
    wheels = [
        wheel_curve(w, r, tape_circle, SEARCH_SPACING)
        for w, r in zip(_pair(wheel), radii, strict=True)
    ]
    rails = [rail_curve(r, gauge, inclination) for r in _pair(rail)]
    if lateral is None:
        lateral = _positions(LATERAL)
    displacements: Floats = np.atleast_1d(np.asarray(lateral, dtype=np.float64))
    Faults(
        fault
        for side, w, r in zip(SIDES, wheels, rails, strict=True)
        for fault in misfits(w, r, gauge, f"{side} wheel")
    ).check()
    mean_radius = 0.5 * (radii[0] + radii[1])
    pairs = [
        kernel.RigidPair(np.ascontiguousarray((w.u, w.r, w.t)), r.Y0, r.z, r.slope)
        for w, r in zip(wheels, rails, strict=True)
    ]
    roll, contacts = np.empty(displacements.size), np.empty((displacements.size, 2, 6))
    # from the middle outwards, so that the roll is followed from a good start
    order = np.argsort(np.abs(displacements), kind="stable")
    for part in (order[displacements[order] >= 0.0], order[displacements[order] < 0.0]):
        given = pairs[1], pairs[0], rails[0].dY, mean_radius, LARGEST_ROLL
        found = np.empty(part.size), np.empty((part.size, 2, 6))
        kernel.rigid_sweep(displacements[part], *given, *found)
        roll[part], contacts[part] = found
    gap = contacts[..., kernel.R_GAP]
    tape = np.array([wheels[0].u[0] - wheels[0].y[0], wheels[1].u[0] - wheels[1].y[0]])
    return ContactGeometry(
        lateral=displacements,
        roll=roll,
        rolling_radius=contacts[..., kernel.R_RADIUS],
        contact_angle=np.arctan(-contacts[..., kernel.R_SLOPE]),
        contact_y=contacts[..., kernel.R_Y] * np.array([-1.0, 1.0]),
        wheel_y=contacts[..., kernel.R_U] - tape,
        centre_z=0.5 * (gap[:, 0] + gap[:, 1]),
    )


def geometry_of(
    wheelset: Wheelset, track: Track, profiles: Mapping[str, Profile], widening: float = 0.0
) -> ContactGeometry | None:
    """Geometry of a wheelset on a track; None where it does not fit between the rails.

    `profiles` holds those of both by their names; by `widening` the gauge is wider there [m].
    """
    wheels = profiles[wheelset.profile[0]], profiles[wheelset.profile[1]]
    rails = profiles[track.rail[0]], profiles[track.rail[1]]
    gauge, furthest = track.gauge + widening, LATERAL + 0.5 * max(widening, 0.0)
    return _fitting(
        furthest, wheel=wheels, rail=rails, radius=wheelset.radius, gauge=gauge,
        inclination=track.inclination, back_to_back=wheelset.back_to_back,
    )  # fmt: skip


@lru_cache(32)  # maps, optimisations and sections ask for the same profiles over and over
def _fitting(furthest: float, **given: Any) -> ContactGeometry | None:
    try:
        return contact_geometry(**given, lateral=_positions(furthest))
    except InputError:
        return None
