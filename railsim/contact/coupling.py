"""Elastic coupling of neighbouring contact patches.

The load on one patch bends the surfaces at the other: at the distance D from a normal force N two
half-spaces of equal material approach each other less by

    u = (1 - nu)/(pi G) N/D        (Boussinesq 1885, both bodies)

and as patches are long along the rail, 1/D is averaged over the neighbour's semi-axis a with the
line load of Hertz's pressure, 3/(4a) (1 - x^2/a^2):

    <1/sqrt(D^2 + x^2)>

Where tread and flange root, or root and flange, touch side by side some millimetres apart, this is
a quarter of their own approach; left out, the pair is too stiff and its forces point too far
outwards (docs/validation/contact_geometry.md compares with the boundary-element solution).
"""

import numpy as np

from railsim.arrays import Floats
from railsim.kernels import contact_table as fields
from railsim.kernels.contact_table import HALF_LOAD, N_PATCH

REFERENCE_LOAD = 30e3  # N, half a wheel's load on each patch of a pair
REFERENCE_ROOT = 8e-3  # sqrt(m), of the penetration there
NEGLIGIBLE = 0.05  # share of its largest stiffness below which a patch is fading out


def coupling(values: Floats, G: float, nu: float) -> Floats:
    """Compliance between the vertical forces of neighbouring patches of one table.

    For each pair the distance is taken where both touch at once, with the wheelset neither rolled
    nor yawed; it is kept constant, so that the forces stay the gradient of a potential.

    `values`: contact table; `G`, `nu`: shear modulus [Pa] and Poisson's ratio [1]. Returns loss of
    vertical penetration per vertical force on the neighbour [m/N].
    """
    line = values[:, 0, values.shape[2] // 2]
    stiffness = line[..., fields.K] + REFERENCE_ROOT * line[..., fields.K2]
    share = REFERENCE_LOAD / (REFERENCE_LOAD + HALF_LOAD)
    y, z, tangent = (
        line[..., value] + share * line[..., difference]
        for value, difference in (
            (fields.C_Y, fields.D_C_Y),
            (fields.C_Z, fields.D_C_Z),
            (fields.TAN_GAMMA, fields.D_TAN_GAMMA),
        )
    )
    third = REFERENCE_LOAD ** (1.0 / 3.0)
    found = np.zeros(N_PATCH - 1)
    for i in range(N_PATCH - 1):
        pair = [i, i + 1]
        present = np.all(
            stiffness[pair] > NEGLIGIBLE * stiffness[pair].max(axis=1, keepdims=True), axis=0
        )
        if not present.any():
            continue
        apart = np.where(present, np.abs(np.diff(line[pair, :, fields.G], axis=0)[0]), np.inf)
        node = int(np.argmin(apart))
        distance = np.hypot(y[i, node] - y[i + 1, node], z[i, node] - z[i + 1, node])
        angle_a, angle_b = np.arctan(tangent[pair, node])
        reach = mean_inverse_distance(distance, third * float(line[pair, node, fields.A1].mean()))
        normal = (1.0 - nu) / (np.pi * G) * reach
        found[i] = normal * np.cos(angle_b - angle_a) / (np.cos(angle_a) * np.cos(angle_b))
    return found


def mean_inverse_distance(distance: float, semi_axis: float) -> float:
    """Mean of 1/sqrt(D^2 + x^2) over the line load 3/(4a) (1 - x^2/a^2), |x| < a [1/m].

    `distance`, `semi_axis`: D > 0 across the rail, a along it [m].

    >>> round(mean_inverse_distance(1.0, 1e-3), 6)
    1.0
    """
    x = semi_axis * (np.arange(200) + 0.5) / 200.0
    return float(np.average(1.0 / np.hypot(distance, x), weights=1.0 - (x / semi_axis) ** 2))
