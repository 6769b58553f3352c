"""Elastic contact of one zone of a wheel on its rail: a foundation along the contour.

The zone's candidates i lie `du` apart along the axle; h is their vertical gap, L = 1/cos(gamma)
the mean of wheel's and rail's, v = z - h - theta L the vertical overlap that the foundation takes
at the height z, theta the approach along the normal that goes into the bodies as a whole.
Equations and sources: :mod:`railsim.contact.table`.
"""

import math

import numpy as np

from railsim.kernels import compiled

MOST_ITERATIONS = 60
SETTLED = 1e-9  # step of Newton's method after which the next is below round-off [m]
WIDTH_ITERATIONS = 8
REFERENCE = 60e-6  # penetration at which the terms of the potential are compared [m]
LEAST_SHARE = -0.4  # of the second term


@compiled(in_loop=False)
def overlap(z, theta, h, lift, du):
    """Integral of the overlap over the candidates, and its derivative over z.

    The overlap is linear between neighbours, so that the edges of the patch lie between candidates
    and not on them.

    Parameters
    ----------
    z, theta : float
        Height of the wheel and approach of the bodies as a whole [m].
    h, lift, du : ndarray, shape (n,)
        Gap [m], L [1], distance to the next candidate [m].

    Returns
    -------
    float, float
        Integral [m2] and its derivative, the patch's width [m].
    """
    total = width = 0.0
    # slices, and no branch or max(): so the compiler takes several intervals at a time
    h0, h1, lift0, lift1 = h[:-1], h[1:], lift[:-1], lift[1:]
    for i in range(h0.size):
        v0 = z - h0[i] - theta * lift0[i]
        v1 = z - h1[i] - theta * lift1[i]
        high = v0 if v0 > v1 else v1
        low = v1 if v0 > v1 else v0
        over = high if high > 0.0 else 0.0
        under = low if low > 0.0 else 0.0
        share = (over - under) / (high - low)
        part = du[i] * (share if low < 0.0 else 1.0)
        total += 0.5 * (over + under) * part
        width += part
    return total, width


@compiled(in_loop=False)
def height_under_load(z, load, k, theta, h, lift, du):
    """Height at which the foundation carries a normal load [m].

    Newton's method from `z` for load^(2/3), which is nearly a straight line over the height: three
    or four steps; for the load itself where that would leave the heights between which the solution
    is known to lie.  `load` in N, `k` in N/m2, the others as `overlap`.
    """
    wanted = load / k
    root_wanted = wanted ** (2.0 / 3.0)
    low, high = -math.inf, math.inf
    for _ in range(MOST_ITERATIONS):
        total, width = overlap(z, theta, h, lift, du)
        if width <= 0.0:
            low = z
            z += 1e-5
            continue
        if total < wanted:
            low = z
        else:
            high = z
        root = total ** (1.0 / 3.0)
        step = 1.5 * (root * root - root_wanted) * root / width
        if not low < z - step < high:
            step = (total - wanted) / width
        z -= step
        if abs(step) < SETTLED:
            break
    return z


@compiled(in_loop=False)
def patch_sums(z, theta, h, lift, du, window, to_start, weight):
    """Integrals over the patch, and the weights of the candidates in its means.

    Between neighbours overlap, window and values are linear; the energy is integrated exactly, for
    its second derivative is the stiffness.

    Parameters
    ----------
    z, theta, h, lift, du
        As `overlap`.
    window : ndarray, shape (n,)
        Window of the zone [1].
    to_start, weight : ndarray, shape (n,)
        Scratch; integrals of window v/L times the share of each candidate in a linear
        interpolation [m2] (output): they weigh what is averaged over the pressure.

    Returns
    -------
    along, across, energy, carried : float
        Integrals of v/L and v [m2], of window v^2/(2 L) [m3] and of window v/L [m2].
    deepest : float
        Greatest overlap along the normal, v/L [m].
    """
    along = across = energy = carried = deepest = 0.0
    h0, h1, lift0, lift1, w0s, w1s = h[:-1], h[1:], lift[:-1], lift[1:], window[:-1], window[1:]
    at_end = weight[1:]
    for i in range(h0.size):
        v0 = z - h0[i] - theta * lift0[i]
        v1 = z - h1[i] - theta * lift1[i]
        edge = v0 / (v0 - v1)
        begin = edge if v0 <= 0.0 and v1 > 0.0 else 0.0
        end = edge if v1 <= 0.0 and v0 > 0.0 else 1.0
        v0 = v0 if v0 > 0.0 else 0.0
        v1 = v1 if v1 > 0.0 else 0.0
        part = (end - begin) * du[i] / 6.0
        normal = 2.0 * part / (lift0[i] + lift1[i])
        along += 3.0 * normal * (v0 + v1)
        across += 3.0 * part * (v0 + v1)
        # window at both ends of the overlap; integrals of products of three linear functions
        w0 = w0s[i] + begin * (w1s[i] - w0s[i])
        w1 = w0s[i] + end * (w1s[i] - w0s[i])
        energy += (
            0.25
            * normal
            * (
                w0 * (3.0 * v0 * v0 + 2.0 * v0 * v1 + v1 * v1)
                + w1 * (v0 * v0 + 2.0 * v0 * v1 + 3.0 * v1 * v1)
            )
        )
        # integral of w v (f0 + (f1 - f0) x): weights of both ends
        first = 0.5 * normal * (w0 * (3.0 * v0 + v1) + w1 * (v0 + v1))
        second = 0.5 * normal * (w0 * (v0 + v1) + w1 * (v0 + 3.0 * v1))
        late = begin * first + end * second
        carried += first + second
        at_end[i] = late
        to_start[i] = first + second - late
    weight[0] = 0.0
    weight[:-1] += to_start[:-1]
    for i in range(h.size):
        deepest = max(deepest, (z - h[i]) / lift[i] - theta)
    return along, across, energy, carried, deepest


@compiled(in_loop=False)
def weighted_sum(weight, values):
    """Sum of weight times value."""
    total = 0.0
    for i in range(weight.size):
        total += weight[i] * values[i]
    return total


@compiled(in_loop=False)
def interpolate(x, x0, dx, values):
    """Linear interpolation on a uniform grid, constant beyond its ends."""
    s = (x - x0) / dx
    if not s > 0.0:
        return values[0]
    if not s < values.size - 1:
        return values[-1]
    i = int(s)
    return values[i] + (s - i) * (values[i + 1] - values[i])


@compiled(in_loop=False)
def unit_ellipse(A, B, hertz):
    """Semi-axes [m/N^(1/3)] and approach [m/N^(2/3)] at unit load, from tabulated logarithms.

    `hertz` as from `railsim.contact.table.ellipse_functions`; A, B half the relative curvatures
    along and across [1/m].
    """
    log_ratio = math.log(A / B)
    scale = A ** (1.0 / 3.0)
    a1 = math.exp(interpolate(log_ratio, hertz.start, hertz.spacing, hertz.logarithms[0])) / scale
    b1 = a1 * math.exp(interpolate(log_ratio, hertz.start, hertz.spacing, hertz.logarithms[1]))
    d1 = math.exp(interpolate(log_ratio, hertz.start, hertz.spacing, hertz.logarithms[2])) * scale
    return a1, b1, d1


@compiled(in_loop=False)
def smooth_maximum(B, floor):
    """Smooth maximum of B and a floor: B + floor^2/B far above, the floor at B = 0 [1/m]."""
    return 0.5 * (B + math.sqrt(B * B + 4.0 * floor * floor))


@compiled(in_loop=False)
def averaged_curvature(A, curvature, half_widths, hertz, load, floor_ratio):
    """Half relative curvature across, averaged over the width of the ellipse that it makes.

    Parameters
    ----------
    A : float
        Half the relative curvature along the rail [1/m].
    curvature : ndarray, shape (n_width,)
        Relative curvature across, averaged over each of `half_widths` [1/m].
    half_widths : ndarray, shape (n_width,)
        Half-widths of the averages, ascending [m].
    hertz
        See `unit_ellipse`.
    load : float
        Load of the ellipse [N].
    floor_ratio : float
        B is kept above about this many A [1].

    Returns
    -------
    float
        B [1/m].
    """
    n = half_widths.size
    b, B = 0.004, 0.0
    third = load ** (1.0 / 3.0)
    for _ in range(WIDTH_ITERATIONS):
        j = 0
        while j < n - 2 and b > half_widths[j + 1]:
            j += 1
        x = (b - half_widths[j]) / (half_widths[j + 1] - half_widths[j])
        x = min(max(x, 0.0), 1.0)
        B = smooth_maximum(
            0.5 * (curvature[j] + x * (curvature[j + 1] - curvature[j])), floor_ratio * A
        )
        # the geometric mean damps the iteration, which may swing in the flange root
        b = math.sqrt(b * unit_ellipse(A, B, hertz)[1] * third)
    return B


@compiled(in_loop=False)
def fill_energies(share, z, U, energy):
    """Potential with a given share of its second term that has the first and the last energy.

    U = k e^(5/2) (2/5 (1 - share) + share/3 sqrt(e/REFERENCE)),   e = z - g

    Parameters
    ----------
    share : float
        Share of the second term in the force at e = REFERENCE [1].
    z, U : ndarray, shape (3,)
        Heights [m], ascending, and energies [J].
    energy : ndarray, shape (3,)
        Gap g [m], k [N/m^1.5], middle energy [J] (output).
    """
    a, b = 0.4 * (1.0 - share), share / (3.0 * math.sqrt(REFERENCE))
    # U_2/U_0 falls with the depth e_0; for a single power m it is known
    ratio = U[2] / U[0]
    span = z[2] - z[0]
    e = span / (ratio**0.37 - 1.0)
    for _ in range(MOST_ITERATIONS):
        s0, s2 = math.sqrt(e), math.sqrt(e + span)
        u0, u2 = s0**5 * (a + b * s0), s2**5 * (a + b * s2)
        slope = s2**3 * (2.5 * a + 3.0 * b * s2) / u2 - s0**3 * (2.5 * a + 3.0 * b * s0) / u0
        step = math.log(u2 / u0 / ratio) / slope
        following = e - step
        following = min(max(following, 0.3 * e), 3.0 * e)
        change = abs(following - e)
        e = following
        if change < 1e-14:
            break
    k = U[0] / (e**2.5 * (a + b * math.sqrt(e)))
    s1 = math.sqrt(e + z[1] - z[0])
    energy[0], energy[1], energy[2] = z[0] - e, k, k * s1**5 * (a + b * s1)


@compiled(in_loop=False)
def fit_energy(z, U):
    """Gap and stiffnesses of U = e^(5/2) (2/5 K + K2/3 sqrt(e)), e = z - g, from three energies.

    The first and the last are met, the middle one too where the second term's share lies within
    LEAST_SHARE and 1, which keeps the force growing far beyond the loads.

    Parameters
    ----------
    z, U : ndarray, shape (3,)
        Heights [m], ascending, and energies [J].

    Returns
    -------
    float, float, float
        g [m], K [N/m^1.5], K2 [N/m^2].
    """
    energy = np.empty(3)
    a, b = LEAST_SHARE, 1.0
    fill_energies(b, z, U, energy)
    f_b = energy[2] / U[1] - 1.0
    if f_b < 0.0:
        fill_energies(a, z, U, energy)
        f_a = energy[2] / U[1] - 1.0
        b = a
        if f_a > 0.0:
            b, f_a, f_b = 1.0, f_b, f_a
            a, b = 1.0, LEAST_SHARE
            for _ in range(MOST_ITERATIONS):
                x = b - f_b * (b - a) / (f_b - f_a)
                fill_energies(x, z, U, energy)
                f = energy[2] / U[1] - 1.0
                if f * f_b < 0.0:
                    a, f_a = b, f_b
                else:
                    f_a *= 0.5
                b, f_b = x, f
                if abs(f) < 1e-12 or abs(b - a) < 1e-12:
                    break
    fill_energies(b, z, U, energy)
    return energy[0], (1.0 - b) * energy[1], b / math.sqrt(REFERENCE) * energy[1]
