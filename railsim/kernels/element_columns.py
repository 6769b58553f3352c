"""Columns of the rows of elements, defined once for assembly, time loop and outputs.

The tables of names fix the order; `link_columns` and `mount_columns` read them for eight elements.
"""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.lanes import load_rows, row_starts


def _slices(columns: dict[str, int]) -> dict[str, slice]:
    """Columns of each name, side by side in this order."""
    slices, first = {}, 0
    for name, count in columns.items():
        slices[name] = slice(first, first + count)
        first += count
    return slices


LINK_COLUMNS = _slices(
    {
        "point_1": 3,  # attachment points in body axes from the centres of gravity (m)
        "point_2": 3,
        "length": 1,  # nominal (m)
        "stiffness": 1,  # N/m
        "damping": 1,  # parallel to the spring (N s/m)
        "preload": 1,  # N
    }
)
LINK_SIZE = 16  # whole cache lines

MOUNT_COLUMNS = _slices(
    {
        "point_1": 3,  # points in body axes, coincident in the nominal position (m)
        "point_2": 3,
        "share": 2,  # of the force in the axes of body 1 and of body 2 (1)
        "stiffness": 3,  # N/m
        "damping": 3,  # N s/m
        "preload": 3,  # N
        "rotation": 3,  # K_d of the rotational potential tr(K_d (1 - R)) (N m)
        "rotation_damping": 3,  # N m s
    }
)
MOUNT_SIZE = 24
STIFFNESS_Z, DAMPING_Z, PRELOAD_Z = (
    MOUNT_COLUMNS[name].start + 2 for name in ("stiffness", "damping", "preload")
)

# columns of Mounts.flags
TRANSLATES, BOTH_ENDS, ROTATES, FRICTION = range(4)
ONE_SIDED = 2  # in the column FRICTION: spring and damper along z press and never pull


@compiled(inline=True)
def link_columns(row, lanes):
    """Points, then nominal length, stiffness, damping and preload of eight links."""
    offsets = row_starts(lanes, LINK_SIZE)
    x1, y1, z1, x2, y2, z2, length, stiffness = load_rows(row, offsets, 0, 8)
    damping, preload = load_rows(row, offsets, 8, 2)
    return (x1, y1, z1), (x2, y2, z2), (length, stiffness, damping, preload)


@compiled(inline=True)
def mount_columns(row, lanes):
    """Points, shares, then stiffness, damping and preload, then those of rotation, of eight mounts.

    Each in the order of `MOUNT_COLUMNS`.
    """
    offsets = row_starts(lanes, MOUNT_SIZE)
    x1, y1, z1, x2, y2, z2, share_1, share_2 = load_rows(row, offsets, 0, 8)
    kx, ky, kz, cx, cy, cz, fx, fy = load_rows(row, offsets, 8, 8)
    fz, k1, k2, k3, c1, c2, c3 = load_rows(row, offsets, 16, 7)
    return (
        (x1, y1, z1),
        (x2, y2, z2),
        (share_1, share_2),
        ((kx, ky, kz), (cx, cy, cz), (fx, fy, fz)),
        ((k1, k2, k3), (c1, c2, c3)),
    )


def nonlinear_axes(internal: np.ndarray, curve: np.ndarray, flags: np.ndarray) -> np.ndarray:
    """Mount, axis, internal state of all that is more than spring and damper, rising.

    The state is -1 where there is none, or something else beside it.
    """
    nonlinear = curve >= 0
    nonlinear[:, 2] |= flags[:, FRICTION] == ONE_SIDED
    has_law = nonlinear | (internal >= 0)
    return np.stack([*np.nonzero(has_law), np.where(nonlinear, -1, internal)[has_law]], axis=1)


def stribeck_mounts(friction: np.ndarray) -> np.ndarray:
    """Mounts whose friction falls with the sliding speed."""
    return np.flatnonzero((friction[:, :, 2] < 1.0).any(axis=1))
