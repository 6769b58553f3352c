"""Elastic contact of one wheel under a given load, from the contact table, at rest.

What the simulation would find for a wheel that is held at a lateral displacement and roll and
pressed down: the patches, their loads, positions and sizes.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from railsim.arrays import Floats
from railsim.contact.coupling import coupling
from railsim.contact.table import PATCHES, ContactTable
from railsim.errors import ModelError
from railsim.kernels import contact_table as kernel


class TableArrays(NamedTuple):
    """A table as the look-up takes it: several tables along the first axis."""

    values: Floats
    shear: Floats
    y0: float
    dy: float
    roll0: float
    droll: float
    w: Floats


@dataclass(frozen=True)
class Patch:
    """One contact patch of a right wheel.

    - `N`, `N_z`, `N_y`: normal force, its vertical and lateral components on the rail [N]
    - `y`: lateral position, track axes [m]
    - `angle`: contact angle, positive towards the flange [rad]
    - `area`, `length`, `width`: area [m2], extent along the rail and across it [m]
    - `p_max`: greatest pressure [Pa]
    - `zone`: part of the wheel, a name of `railsim.contact.table.PATCHES`, where it is known
    """

    N: float
    N_z: float
    N_y: float
    y: float
    angle: float
    area: float
    length: float
    width: float
    p_max: float
    zone: str = ""

    @property
    def a(self) -> float:
        """Half the length: of an ellipse its semi-axis along the rail [m]."""
        return 0.5 * self.length

    @property
    def b(self) -> float:
        """Half the width: of an ellipse its semi-axis across the rail [m]."""
        return 0.5 * self.width


@dataclass(frozen=True)
class LoadedContact:
    """Contact of a right wheel under a load.

    `z`: vertical displacement of the wheelset's centre [m]; `patches`: loaded patches, tread first.
    """

    z: float
    patches: tuple[Patch, ...]


def loaded_contact(table: ContactTable, y: float, roll: float, load: float) -> LoadedContact:
    """Patches of a right wheel under a vertical load, without yaw.

    `table`: contact table; `y`, `roll`: lateral displacement [m] and roll [rad] of the wheelset;
    `load`: vertical force on the rail [N]. Raises ModelError: if the position lies outside of the
    table or the load is not positive.
    """
    if not load > 0.0:
        raise ModelError(f"a load of {load:g} N presses no wheel on a rail")
    grid = table.y0, table.dy, table.roll0, table.droll, table.w
    arrays = TableArrays(table.values[None], np.array([table.shear]), *grid)
    stretched, roll_slope = kernel.stretched_roll(roll)
    where, iy, ir, iw, ty, tr, tw = kernel.find_cell(arrays, 0, y, roll, stretched, 0.0)
    if where != kernel.INSIDE:
        raise ModelError(
            f"y = {1e3 * y:.2f} mm with roll {1e3 * roll:.2f} mrad lies outside of the table"
        )
    weights, flat = np.empty(kernel.N_WEIGHT), np.empty(kernel.N_PATCH * kernel.LOOK_UP_SIZE)
    kernel.set_cell_weights(arrays, ty, tr, roll_slope, weights)
    for patch in range(kernel.N_PATCH):
        kernel.look_up(arrays, 0, patch, iy, ir, iw, tw, weights, flat, patch * kernel.LOOK_UP_SIZE)
    fields = flat.reshape(kernel.N_PATCH, kernel.LOOK_UP_SIZE)
    compliance = coupling(table.values, table.G, table.nu)[None]
    stiffness = np.concatenate((fields[:, kernel.K], fields[:, kernel.K2]))

    def approaches(z: float) -> Floats:
        e = z - fields[:, kernel.G]
        kernel.couple_approaches(compliance, 0, stiffness, e)
        return e

    def vertical(z: float) -> Floats:
        e = np.maximum(approaches(z), 0.0)
        return np.asarray(e**1.5 * (fields[:, kernel.K] + fields[:, kernel.K2] * np.sqrt(e)))

    lowest = float(fields[:, 0].min())
    depth = 1e-5
    while vertical(lowest + depth).sum() < load:
        depth *= 2.0
        if depth > 1.0:
            raise ModelError(f"the load of {load:g} N is not reached")
    from scipy.optimize import brentq  # long to import

    z = float(brentq(lambda z: vertical(z).sum() - load, lowest, lowest + depth, xtol=1e-12))
    patches = []
    for patch, (N_z, e) in enumerate(zip(vertical(z), approaches(z), strict=True)):
        if N_z < 1e-3 * load:
            continue
        field = fields[patch]
        by_K = 0.4 * e * e * np.sqrt(e) * field[kernel.K_Y] + e**3 / 3.0 * field[kernel.K2_Y]
        c_y, _, a1, b1, tangent = kernel.patch_under_load(field, 0, float(N_z))
        N = float(N_z) * float(np.hypot(1.0, tangent))
        a, b = (float(axis) * N ** (1.0 / 3.0) for axis in (a1, b1))
        patches.append(
            Patch(
                N=N,
                N_z=float(N_z),
                N_y=float(by_K - N_z * field[kernel.G_Y]),
                y=y + float(c_y),
                angle=float(np.arctan(tangent)),
                area=np.pi * a * b,
                length=2.0 * a,
                width=2.0 * b,
                p_max=1.5 * N / (np.pi * a * b),
                zone=PATCHES[patch],
            )
        )
    return LoadedContact(z, tuple(patches))
