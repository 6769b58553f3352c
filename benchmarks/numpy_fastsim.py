"""FASTSIM without a compiler: plain Python, numpy patch by patch, numpy over all patches at once.

The same algorithm as `railsim.kernels.fastsim` (slip at the middle of each step, traction at the
cells' centres), written from Kalker (1982) in the way of each tool.
"""

import math

import numpy as np


def plain_python(nx, ny, a, b, mu_N, c11, c22, c23, G, xi_x, xi_y, phi):
    """Force of one patch, strip by strip, cell by cell: floats only."""
    L1 = 8.0 * a / (3.0 * G * c11)
    L2 = 8.0 * a / (3.0 * G * c22)
    L3 = math.pi * a * math.sqrt(a / b) / (4.0 * G * c23)
    p0 = 2.0 * mu_N / (math.pi * a * b)
    dy = 2.0 * b / ny
    T_x = T_y = M_z = 0.0
    for j in range(ny):
        y = -b + (j + 0.5) * dy
        half = a * math.sqrt(1.0 - (y / b) ** 2)
        dx = 2.0 * half / nx
        s_x = xi_x / L1 - y * phi / L3
        p_x = p_y = 0.0
        for k in range(nx):
            x = half - (k + 0.5) * dx
            length = 0.5 * dx if k == 0 else dx
            middle = x + 0.5 * length
            p_x += length * s_x
            p_y += length * (xi_y / L2 + middle * phi / L3)
            bound = p0 * (1.0 - (x / a) ** 2 - (y / b) ** 2)
            p = math.hypot(p_x, p_y)
            if p > bound:
                p_x *= bound / p
                p_y *= bound / p
            T_x += p_x * dx * dy
            T_y += p_y * dx * dy
            M_z += (x * p_y - y * p_x) * dx * dy
    return T_x, T_y, M_z


def numpy_patches(nx, ny, a, b, mu_N, c11, c22, c23, G, xi_x, xi_y, phi):
    """Forces of all patches, arrays over patches and strips, a Python loop over the cells.

    Arrays of shape (patch, 1) or (patch, strip).  With one patch: numpy patch by patch.
    """
    a, b, mu_N, c11, c22, c23, xi_x, xi_y, phi = (
        value[:, None] for value in (a, b, mu_N, c11, c22, c23, xi_x, xi_y, phi)
    )
    L1 = 8.0 * a / (3.0 * G * c11)
    L2 = 8.0 * a / (3.0 * G * c22)
    L3 = np.pi * a * np.sqrt(a / b) / (4.0 * G * c23)
    p0 = 2.0 * mu_N / (np.pi * a * b)
    eta = (np.arange(ny) + 0.5) * 2.0 / ny - 1.0
    y = b * eta
    dy = 2.0 * b / ny
    half = a * np.sqrt(1.0 - eta**2)
    dx = 2.0 * half / nx
    s_x = xi_x / L1 - y * phi / L3
    p_x = np.zeros_like(half)
    p_y = np.zeros_like(half)
    sums = np.zeros((3, *half.shape))
    for k in range(nx):
        x = half - (k + 0.5) * dx
        length = 0.5 * dx if k == 0 else dx
        p_x += length * s_x
        p_y += length * (xi_y / L2 + (x + 0.5 * length) * phi / L3)
        bound = p0 * (1.0 - (x / a) ** 2 - eta**2)
        factor = np.minimum(1.0, bound / np.sqrt(p_x * p_x + p_y * p_y + 1e-30))
        p_x *= factor
        p_y *= factor
        sums[0] += p_x
        sums[1] += p_y
        sums[2] += x * p_y - y * p_x
    return (sums * dx * dy).sum(axis=2)
