"""Elastic contact of one wheel under a given load, from the contact table, at rest.

What the simulation would find for a wheel that is held at a lateral displacement and roll and
pressed down: the patches, their loads, places and sizes.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from railsim.contact.coupling import coupling
from railsim.contact.table import PATCHES, ContactTable
from railsim.errors import ModelError
from railsim.kernels.contact_table import (
    G_Y,
    INSIDE,
    K_Y,
    LOOK_UP_SIZE,
    N_PATCH,
    N_WEIGHT,
    TAN_GAMMA,
    cell_weights,
    coupled_approaches,
    locate,
    look_up,
)

Array = NDArray[np.float64]


class TableArrays(NamedTuple):
    """A table as the look-up takes it: several tables along the first axis."""

    values: Array
    shear: Array
    y0: float
    dy: float
    roll0: float
    droll: float
    dw: float


@dataclass(frozen=True)
class Patch:
    """One contact patch of a right wheel.

    Attributes
    ----------
    zone : str
        Part of the wheel: a name of `railsim.contact.table.PATCHES`.
    N, N_z, N_y : float
        Normal force, its vertical and lateral components on the rail [N].
    y : float
        Lateral place, track axes [m].
    angle : float
        Contact angle, positive towards the flange [rad].
    a, b : float
        Semi-axes along the rail and across [m].
    p_max : float
        Greatest pressure, 3 N/(2 pi a b) [Pa].
    """

    zone: str
    N: float
    N_z: float
    N_y: float
    y: float
    angle: float
    a: float
    b: float
    p_max: float


@dataclass(frozen=True)
class LoadedContact:
    """Contact of a right wheel under a load.

    Attributes
    ----------
    z : float
        Vertical displacement of the wheelset's centre [m].
    patches : tuple of Patch
        Loaded patches, tread first.
    """

    z: float
    patches: tuple[Patch, ...]


def loaded_contact(
    table: ContactTable, y: float, roll: float, load: float, yaw: float = 0.0
) -> LoadedContact:
    """Patches of a right wheel under a vertical load.

    Parameters
    ----------
    table : ContactTable
        Contact table.
    y, roll, yaw : float
        Lateral displacement [m], roll and yaw [rad] of the wheelset.
    load : float
        Vertical force on the rail [N].

    Returns
    -------
    LoadedContact

    Raises
    ------
    ModelError
        If the place lies outside of the table or the load is not positive.
    """
    if not load > 0.0:
        raise ModelError(f"a load of {load:g} N presses no wheel on a rail")
    arrays = TableArrays(
        table.values[None],
        np.array([table.shear]),
        table.y0,
        table.dy,
        table.roll0,
        table.droll,
        table.dw,
    )
    where, iy, ir, iw, ty, tr, tw = locate(arrays, 0, y, roll, yaw * yaw)
    if where != INSIDE:
        raise ModelError(
            f"y = {1e3 * y:.2f} mm with roll {1e3 * roll:.2f} mrad and yaw {1e3 * yaw:.2f} mrad "
            "lies outside of the contact table"
        )
    weights, flat = np.empty(N_WEIGHT), np.empty(N_PATCH * LOOK_UP_SIZE)
    cell_weights(arrays, ty, tr, weights)
    for patch in range(N_PATCH):
        look_up(arrays, 0, patch, iy, ir, iw, tw, weights, flat, patch * LOOK_UP_SIZE)
    fields = flat.reshape(N_PATCH, LOOK_UP_SIZE)
    compliance = coupling(table.values, table.G, table.nu)[None]
    stiffness = np.ascontiguousarray(fields[:, 1])

    def approaches(z: float) -> Array:
        e = z - fields[:, 0]
        coupled_approaches(compliance, 0, stiffness, e)
        return e

    def vertical(z: float) -> Array:
        force: Array = stiffness * np.maximum(approaches(z), 0.0) ** 1.5
        return force

    lowest = float(fields[:, 0].min())
    depth = 1e-5
    while vertical(lowest + depth).sum() < load:
        depth *= 2.0
        if depth > 1.0:
            raise ModelError(f"the load of {load:g} N is not reached")
    z = float(brentq(lambda z: vertical(z).sum() - load, lowest, lowest + depth, xtol=1e-12))
    patches = []
    for patch, (N_z, e) in enumerate(zip(vertical(z), approaches(z), strict=True)):
        if N_z < 1e-3 * load:
            continue
        field = fields[patch]
        # lateral force from the potential; direction of the plane as the simulation takes it
        slope = 0.4 * e * field[K_Y] / field[1] - field[G_Y]
        tangent = float(0.5 * (field[TAN_GAMMA] + slope))
        N = float(N_z) * float(np.hypot(1.0, tangent))
        a, b = (float(field[k]) * N ** (1.0 / 3.0) for k in (5, 6))
        patches.append(
            Patch(
                zone=PATCHES[patch],
                N=N,
                N_z=float(N_z),
                N_y=float(N_z * slope),
                y=y + float(field[2]),
                angle=float(np.arctan(tangent)),
                a=a,
                b=b,
                p_max=1.5 * N / (np.pi * a * b),
            )
        )
    return LoadedContact(z, tuple(patches))
