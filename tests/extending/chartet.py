"""Creep law after Chartet: linear theory, bent towards mu N."""

import math

from . import compiled


@compiled(ordered=True)
def chartet(n, patches, G):
    """Force F = F_l/sqrt(1 + (F_l/(mu N))^2) along the linear force F_l, without a moment.

    Parameters as in `railsim.kernels.creep_laws.linear_saturated`.
    """
    a, b, mu_N = patches.a, patches.b, patches.mu_N
    c11, c22, c23 = patches.c11, patches.c22, patches.c23
    xi_x, xi_y, phi = patches.xi_x, patches.xi_y, patches.phi
    T_x, T_y, M_z = patches.T_x, patches.T_y, patches.M_z
    for i in range(n):
        area = a[i] * b[i]
        x = G * area * c11[i] * xi_x[i]
        y = G * area * (c22[i] * xi_y[i] + math.sqrt(area) * c23[i] * phi[i])
        factor = 0.0
        if area > 0.0 and mu_N[i] > 0.0:
            factor = 1.0 / math.sqrt(1.0 + (x * x + y * y) / (mu_N[i] * mu_N[i]))
        T_x[i] = factor * x
        T_y[i] = factor * y
        M_z[i] = 0.0
