"""Contact of a wheelset on its rails at a glance: functions, conicity, patches under a load."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.contact.creep_curves import Patch
from railsim.contact.elastic import LoadedContact, loaded_contact
from railsim.contact.exact_normal import ExactContact, exact_contact
from railsim.contact.geometry import ContactGeometry, contact_geometry
from railsim.contact.stored_table import cached_contact_table
from railsim.contact.table import ContactTable, Normal
from railsim.errors import InputError, ModelError
from railsim.profiles.profile import Profile

STEP = 5e-5
"""Step of the lateral displacement [m]."""
PATCH_SHARES = (-0.6, -0.3, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.65, 0.7)
"""Displacements at which patches are computed, over the largest one."""
OTHER_NORMAL: dict[Normal, Normal] = {"hertz": "kik-piotrowski", "kik-piotrowski": "hertz"}


@dataclass(frozen=True)
class Pair:
    """Wheel and rail of one side with what places them.

    `gauge`, `inclination`, `back_to_back`: as `railsim.contact.contact_geometry` [m], [1], [m].
    """

    wheel: Profile
    rail: Profile
    gauge: float
    inclination: float
    back_to_back: float

    @property
    def words(self) -> str:
        """Profiles and the inclination of the rail."""
        slope = f"1:{1.0 / self.inclination:.4g}" if self.inclination else "upright"
        return f"{self.wheel.name} on {self.rail.name} {slope}"

    def table(self, radii: tuple[float, float], normal: Normal) -> ContactTable:
        """Return the contact table of the right wheel of a wheelset with these radii [m]."""
        return cached_contact_table(
            self.wheel,
            self.rail,
            radius=radii[1],
            gauge=self.gauge,
            inclination=self.inclination,
            back_to_back=self.back_to_back,
            centre_height=0.5 * (radii[0] + radii[1]),
            normal=normal,
        )


@dataclass(frozen=True)
class ContactSummary:
    """What `contact_summary` finds.

    Attributes
    ----------
    pairs : tuple of two Pair
        Left and right.
    radii : tuple of two floats
        Rolling radii, left and right [m].
    load : float
        Vertical load of the right wheel [N].
    normal : str
        Normal contact of the table.
    geometry : ContactGeometry
        Contact functions over the lateral displacement.
    amplitudes, conicity : float64[k]
        Equivalent conicity of EN 15302 over the amplitude [m], [1].
    contacts : dict of float to LoadedContact
        Patches of the right wheel by the lateral displacement [m], where the wheel rests on them.
    exact : dict of float to ExactContact
        The same by boundary elements; empty where they were not asked for.
    """

    pairs: tuple[Pair, Pair]
    radii: tuple[float, float]
    load: float
    normal: Normal
    geometry: ContactGeometry
    amplitudes: Floats
    conicity: Floats
    contacts: dict[float, LoadedContact]
    exact: dict[float, ExactContact]

    @property
    def notes(self) -> list[str]:
        """What was recognised in the profiles' files, once each."""
        profiles = {p.name: p for pair in self.pairs for p in (pair.wheel, pair.rail)}
        return [f"{p.source or p.name}: {note}" for p in profiles.values() for note in p.notes]

    @property
    def functions(self) -> dict[str, Floats]:
        """Contact functions by name, SI."""
        geometry = self.geometry
        columns = {"lateral": geometry.lateral, "delta_r": geometry.delta_r}
        for name in ("rolling_radius", "contact_angle", "contact_y", "wheel_y"):
            for side, side_name in enumerate(("left", "right")):
                columns[f"{name}_{side_name}"] = getattr(geometry, name)[:, side]
        return columns | {"roll": geometry.roll}

    @property
    def patches(self) -> list[dict[str, Any]]:
        """One row for each patch of table and boundary elements, SI."""
        rows = []
        for y, contact in self.contacts.items():
            rows += [_row(y, "table", patch.zone, patch, contact.z) for patch in contact.patches]
            if y in self.exact:
                solution = self.exact[y]
                rows += [
                    _row(y, "exact", "", patch, solution.z) for patch in solution.patches[::-1]
                ]
        return rows

    def with_other_normal(self) -> dict[float, LoadedContact]:
        """Return the patches by the other kind of normal contact, for a comparison."""
        table = self.pairs[1].table(self.radii, OTHER_NORMAL[self.normal])
        return _contacts_at(table, self.geometry, list(self.contacts), self.load)

    def main_patch(self, friction: float) -> Patch:
        """Return the most loaded patch of the centred right wheel.

        Raises ModelError: the wheel does not rest on its rail.
        """
        if not self.contacts:
            raise ModelError("the wheel rests on its rail at none of the displacements")
        centred = self.contacts[min(self.contacts, key=abs)]
        largest = max(centred.patches, key=lambda patch: patch.N)
        return Patch(largest.a, largest.b, largest.N, friction)


def contact_summary(
    wheels: tuple[Profile, Profile],
    rails: tuple[Profile, Profile],
    *,
    radii: tuple[float, float] = (0.46, 0.46),
    gauge: float = 1.435,
    inclination: float = 0.025,
    back_to_back: float = 1.360,
    load: float = 60e3,
    max_shift: float = 0.010,
    normal: Normal = "hertz",
    exact: bool = False,
) -> ContactSummary:
    """Contact functions, equivalent conicity and loaded patches of a wheelset.

    Parameters
    ----------
    wheels, rails : tuple of two Profile
        Left and right.
    radii : tuple of two floats
        Rolling radii [m].
    gauge : float
        As `railsim.contact.contact_geometry` [m].
    inclination : float
        Of the rails [1].
    back_to_back : float
        Distance between the flange backs [m].
    load : float
        Vertical load of the right wheel [N].
    max_shift : float
        Largest lateral displacement [m].
    normal : str
        Normal contact of the table, `hertz` or `kik-piotrowski`.
    exact : bool
        Whether the patches are also computed by boundary elements (about ten seconds).
    """
    steps = max(round(max_shift / STEP), 10)
    lateral = np.linspace(-max_shift, max_shift, 2 * steps + 1)
    geometry = contact_geometry(wheels, rails, radii, gauge, inclination, back_to_back, lateral)
    amplitudes: Floats = 1e-3 * np.arange(0.5, 1e3 * max_shift + 1e-9, 0.5)
    left, right = (
        Pair(wheel, rail, gauge, inclination, back_to_back)
        for wheel, rail in zip(wheels, rails, strict=True)
    )
    shifts = [round(share * max_shift, 6) for share in PATCH_SHARES]
    contacts = _contacts_at(right.table(radii, normal), geometry, shifts, load)
    return ContactSummary(
        (left, right),
        radii,
        load,
        normal,
        geometry,
        amplitudes,
        geometry.equivalent_conicity(amplitudes),
        contacts,
        _exact(right, radii[1], geometry, list(contacts), load) if exact else {},
    )


def conicity_over_gauge(summary: ContactSummary, gauges: Sequence[float]) -> Floats:
    """Equivalent conicity, float64[gauge, amplitude], at the amplitudes of a summary [1].

    `found`: profiles and their position; `gauges`: track gauges [m]; NaN for one at which the
    wheels do not stand on the rails.
    """
    left, right = summary.pairs
    rows = []
    for gauge in gauges:
        try:
            geometry = contact_geometry(
                (left.wheel, right.wheel),
                (left.rail, right.rail),
                summary.radii,
                gauge,
                left.inclination,
                left.back_to_back,
                summary.geometry.lateral,
            )
        except (InputError, ModelError):
            rows.append(np.full(len(summary.amplitudes), np.nan))
        else:
            rows.append(geometry.equivalent_conicity(summary.amplitudes))
    return np.array(rows)


def _roll(geometry: ContactGeometry, y: float) -> float:
    """Roll of the wheelset at the nearest displacement of the geometry [rad]."""
    return float(geometry.roll[int(np.argmin(np.abs(geometry.lateral - y)))])


def _contacts_at(
    table: ContactTable, geometry: ContactGeometry, shifts: Sequence[float], load: float
) -> dict[float, LoadedContact]:
    """Patches of the right wheel at the given displacements, where the geometry knows them."""
    contacts = {}
    for y in shifts:
        roll = _roll(geometry, y)
        if np.isfinite(roll):
            with suppress(ModelError):  # beyond the table: a wheel that has climbed its rail
                contacts[y] = loaded_contact(table, y, roll, load)
    return contacts


def _exact(
    pair: Pair, radius: float, geometry: ContactGeometry, shifts: Sequence[float], load: float
) -> dict[float, ExactContact]:
    """The same patches by boundary elements."""
    solutions = {}
    for y in shifts:
        with suppress(ModelError):  # the load is not reached: a wheel that hangs on its flange
            solutions[y] = exact_contact(
                pair.wheel,
                pair.rail,
                y,
                _roll(geometry, y),
                load,
                radius=radius,
                gauge=pair.gauge,
                inclination=pair.inclination,
                back_to_back=pair.back_to_back,
            )
    return solutions


def _row(y: float, method: str, zone: str, patch: Any, z: float) -> dict[str, Any]:
    """What both kinds of patches have in common."""
    return {
        "lateral": y,
        "method": method,
        "zone": zone,
        "N": patch.N,
        "Q": patch.N_z,
        "Y": patch.N_y,
        "contact_y": patch.y,
        "contact_angle": patch.angle,
        "length": patch.length,
        "width": patch.width,
        "area": patch.area,
        "p_max": patch.p_max,
        "z": z,
    }
