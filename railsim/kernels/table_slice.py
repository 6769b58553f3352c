"""Fill the contact table for one roll and one yaw of the wheelset.

Equations and sources: :mod:`railsim.contact.table`.
"""

import math
from typing import NamedTuple

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.contact_geometry import rail_height, trace_line
from railsim.kernels.contact_table import A1, B1, C_Y, C_Z, HALF_LOAD, K2, LOADS, G, K
from railsim.kernels.elastic_patch import (
    averaged_curvature,
    fit_energy,
    height_under_load,
    patch_sums,
    smooth_maximum,
    unit_ellipse,
    weighted_sum,
)
from railsim.kernels.non_elliptic import non_elliptic_axes

N_OF_LOAD = 4  # fields that have a difference over the load, from C_Y on

FOUNDATION = 1.2  # stiffness of the foundation over E* where the patch is not long
LONG_PATCH = 0.58  # and over that of the ellipse's own width where it is
FIRST_THETA = 15e-6  # approach of the bodies as a whole, first guess [m]
NEAR = 3e-4  # approach along the normal at which no candidate touches any more [m]
MORE_LOAD = 1e-4  # approach that the greatest load adds to the reference's, at most [m]
STRIDE = 4  # of the candidates in the search for the lowest one
FAR_AWAY = 1.0  # height of a zone that never touches [m]
OUT_OF_REACH = 2e-3  # a zone that touches so much later than another carries nothing [m]
SMALL_AXIS = 1e-4  # of a zone out of reach [m/N^(1/3)]
LEAST_AXIS = 0.3  # axes without and under endless load over those under the middle one


class Wheel(NamedTuple):
    """Candidates of a wheel, see `railsim.contact.curves.WheelCurve`."""

    u: np.ndarray
    r: np.ndarray
    t: np.ndarray
    curvature: np.ndarray
    window: np.ndarray
    first: np.ndarray
    last: np.ndarray


class Rail(NamedTuple):
    """A rail, see `railsim.contact.curves.RailCurve`."""

    Y0: float
    dY: float
    z: np.ndarray
    slope: np.ndarray
    curvature: np.ndarray


class Hertz(NamedTuple):
    """Unit-load ellipses over ln(A/B): logarithms of a1 A^(1/3), b/a and d1 A^(-1/3)."""

    start: float
    spacing: float
    logarithms: np.ndarray


class Strips(NamedTuple):
    """Influences for non-elliptic patches, see `railsim.contact.table.strip_influence`."""

    start: float
    spacing: float
    strip: np.ndarray
    whole: np.ndarray


class Elastic(NamedTuple):
    """What the elastic contact is computed with.

    E_star : equivalent modulus [Pa]; half_widths : of the averaged curvatures [m]; reference : load
    of the curvatures [N]; floor_ratio : B is kept above about this many A [1]; non_elliptic : axes
    after Kik and Piotrowski.
    """

    E_star: float
    half_widths: np.ndarray
    reference: float
    floor_ratio: float
    non_elliptic: bool


class Zone(NamedTuple):
    """Candidates of a wheel in position on the rail, filled from `low` to `high`, `high` exclusive.

    h : gap at z = 0 [m]; lift : 1/cos(contact angle), mean of wheel and rail [1]; du, length :
    distance to the next candidate along the axle, and of the neighbours along the contour [m];
    c_y, c_z : position from the wheelset's centre [m]; radius [m]; slope : of the rail, down [1];
    window [1]; wheel_curvature, rail_curvature : averaged, shape (n_width, n) [1/m]; node : of the
    rail under the candidate.
    """

    h: np.ndarray
    lift: np.ndarray
    du: np.ndarray
    length: np.ndarray
    c_y: np.ndarray
    c_z: np.ndarray
    radius: np.ndarray
    slope: np.ndarray
    window: np.ndarray
    wheel_curvature: np.ndarray
    rail_curvature: np.ndarray
    node: np.ndarray
    low: int
    high: int


@compiled(in_loop=False)
def fill_table_slice(
    values, y_nodes, roll, yaw, centre_height, wheel, rail, elastic, hertz, strips
):
    """Fill the table for one roll and one yaw.

    Parameters
    ----------
    values : ndarray, shape (n_patch, n_y, N_FIELD)
        Slice of the table (output).
    y_nodes : ndarray, shape (n_y,)
        Lateral displacements of the wheelset's centre [m].
    roll, yaw : float
        Attitude [rad].
    centre_height : float
        Height of the wheelset's centre above the rail tops at z = 0 [m].
    wheel, rail, elastic, hertz, strips
        See the classes of these names.
    """
    n, n_patch = wheel.u.size, values.shape[0]
    c_x, c_y, c_z, stretch = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    h, lift, du, length = np.empty(n), np.empty(n), np.zeros(n), np.empty(n)
    slope, node, least = np.empty(n), np.empty(n, dtype=np.int64), np.empty(n_patch)
    trace_line(wheel.u, wheel.r, wheel.t, roll, yaw, c_x, c_y, c_z, stretch)
    for k in range(n):
        after, before = min(k + 1, n - 1), max(k - 1, 0)
        du[k] = wheel.u[after] - wheel.u[k]
        across = 0.5 * (wheel.u[after] - wheel.u[before])
        length[k] = across * math.sqrt(1.0 + wheel.t[k] * wheel.t[k])
    for i in range(y_nodes.size):
        y = y_nodes[i]
        for p in range(n_patch):
            lowest = wheel.first[p]
            least[p] = FAR_AWAY
            for k in range(wheel.first[p], wheel.last[p], STRIDE):
                if stretch[k] > 0.0:
                    gap = (
                        centre_height
                        - c_z[k]
                        + rail_height(y + c_y[k], rail.Y0, rail.dY, rail.z, rail.slope)[0]
                    )
                    if gap < least[p]:
                        least[p], lowest = gap, k
            out = values[p, i]
            out[:] = 0.0  # what touches nothing has neither stiffness nor, nearly, an ellipse
            out[G], out[C_Y], out[C_Z] = least[p], c_y[lowest], c_z[lowest]
            out[A1] = out[B1] = SMALL_AXIS
        nearest = least.min()
        for p in range(n_patch):
            if least[p] > nearest + OUT_OF_REACH or least[p] == FAR_AWAY:
                continue
            first, last = wheel.first[p], wheel.last[p]
            start, end = near_candidates(
                y, first, last, least[p], c_y, c_z, stretch, centre_height, wheel, rail
            )
            low, high = start, end
            if elastic.non_elliptic:  # whose patches go on in the neighbouring zones
                first %= STRIDE  # so that the lowest one is among those that are tried
                low, high = near_candidates(
                    y, first, n, least[p], c_y, c_z, stretch, centre_height, wheel, rail
                )
            for k in range(low, high):
                height, along, node[k] = rail_height(
                    y + c_y[k], rail.Y0, rail.dY, rail.z, rail.slope
                )
                h[k] = height + centre_height - c_z[k]
                lift[k] = 0.5 * (stretch[k] + math.sqrt(1.0 + along * along))
                slope[k] = -along
            zone = Zone(
                h,
                lift,
                du,
                length,
                c_y,
                c_z,
                wheel.r,
                slope,
                wheel.window[p],
                wheel.curvature,
                rail.curvature,
                node,
                low,
                high,
            )
            fill_zone(values[p, i], zone, start, end, elastic, hertz, strips)


@compiled(in_loop=False)
def near_candidates(y, first, last, least, c_y, c_z, stretch, centre_height, wheel, rail):
    """Range of candidates from `first` to `last` around those that can touch, ends exclusive."""
    start, end = last, first
    for k in range(first, last, STRIDE):
        height, slope, _ = rail_height(y + c_y[k], rail.Y0, rail.dY, rail.z, rail.slope)
        reach = NEAR * max(stretch[k], math.sqrt(1.0 + slope * slope))
        if stretch[k] > 0.0 and height + centre_height - c_z[k] < least + reach:
            start, end = min(start, k), k
    start, end = max(start - STRIDE, first), min(end + STRIDE + 1, last)
    while not stretch[start] > 0.0:
        start += 1
    while not stretch[end - 1] > 0.0:
        end -= 1
    return start, end


@compiled(in_loop=False)
def fill_zone(out, zone, start, end, elastic, hertz, strips):
    """Fields of one zone at one node of the table into `out`, shape (N_FIELD,)."""
    least = zone.h[start:end].min()
    # ellipse of the averaged curvatures, which gives the foundation its stiffness
    k = FOUNDATION * elastic.E_star
    h, lift, du = zone.h[start:end], zone.lift[start:end], zone.du[start:end]
    z = height_under_load(least + 5e-5, elastic.reference, k, FIRST_THETA, h, lift, du)
    scratch, weight = np.empty(end - start), np.empty(end - start)
    along, across, _, carried, _ = patch_sums(
        z, FIRST_THETA, h, lift, du, zone.window[start:end], scratch, weight
    )
    A = 0.5 * along * carried / (across * weighted_sum(weight, zone.radius[start:end]))
    curvature = curvature_sums(zone, start, weight) / carried
    B = averaged_curvature(
        A, curvature, elastic.half_widths, hertz, elastic.reference, elastic.floor_ratio
    )
    _, b1, d1 = unit_ellipse(A, B, hertz)
    start, end = loaded_candidates(z + MORE_LOAD * across / along, h, start, end)
    h, lift, du = zone.h[start:end], zone.lift[start:end], zone.du[start:end]
    scratch, weight = np.empty(end - start), np.empty(end - start)
    depth = (z - least) / elastic.reference ** (2.0 / 3.0)
    k = (k**4 + (LONG_PATCH * 0.75 / (B * b1**3)) ** 4) ** 0.25
    kappa = d1 - B ** (1.0 / 3.0) * (0.75 / k) ** (2.0 / 3.0)
    heights, energies = np.empty(3), np.empty(3)
    fields, axis = np.empty((N_OF_LOAD, 3)), np.empty(3)
    for j in range(3):
        load = LOADS[j]
        theta = kappa * load ** (2.0 / 3.0)
        z = height_under_load(least + depth * load ** (2.0 / 3.0), load, k, theta, h, lift, du)
        along, across, energy, carried, deepest = patch_sums(
            z, theta, h, lift, du, zone.window[start:end], scratch, weight
        )
        heights[j] = z
        energies[j] = k * energy + carried / along * 0.4 * kappa * load ** (5.0 / 3.0)
        A = 0.5 * along * carried / (across * weighted_sum(weight, zone.radius[start:end]))
        B = smooth_maximum((4.0 / 3.0 * k / load) ** 2 * deepest**3, elastic.floor_ratio * A)
        ellipse = unit_ellipse(A, B, hertz)
        axis[j], fields[2, j] = ellipse[0], ellipse[1]
        fields[0, j] = weighted_sum(weight, zone.c_y[start:end]) / carried
        fields[1, j] = weighted_sum(weight, zone.c_z[start:end]) / carried
        fields[3, j] = weighted_sum(weight, zone.slope[start:end]) / carried
        if elastic.non_elliptic:
            a, b = non_elliptic_axes(
                zone, start, end, fields[0, j], A, B, ellipse, load, elastic.E_star, strips
            )
            if a > 0.0:
                axis[j], fields[2, j] = a, b
    out[G], out[K], out[K2] = fit_energy(heights, energies)
    out[A1] = axis[1]
    fit_load_dependence(out, fields)


@compiled(in_loop=False)
def loaded_candidates(limit, h, start, end):
    """Range of the candidates from the first to the last whose gap is below a limit, and one more.

    `h`, shape (end - start,), holds the gaps from `start` on [m].
    """
    first, last = 0, h.size
    while h[first] > limit:
        first += 1
    while h[last - 1] > limit:
        last -= 1
    return start + max(first - 1, 0), start + min(last + 1, h.size)


@compiled(in_loop=False)
def curvature_sums(zone, start, weight):
    """Weighted sums of the relative curvature, for each width over which it is averaged."""
    sums = np.zeros(zone.wheel_curvature.shape[0])
    for i in range(weight.size):
        if weight[i] > 0.0:
            k = start + i
            for m in range(sums.size):
                sums[m] += weight[i] * (
                    zone.wheel_curvature[m, k] + zone.rail_curvature[m, zone.node[k]]
                )
    return sums


@compiled(in_loop=False)
def fit_load_dependence(out, fields):
    """Fields of the form v + dv N/(N + HALF_LOAD), as near as possible to the three loads'."""
    loads = np.array(LOADS)
    tau = loads / (loads + HALF_LOAD)
    deviation = tau - tau.mean()
    for m in range(N_OF_LOAD):
        mean = fields[m].mean()
        difference = np.sum(deviation * fields[m]) / np.sum(deviation * deviation)
        start = mean - difference * tau.mean()
        if m == 2:
            start = max(start, LEAST_AXIS * mean)
            difference = max(start + difference, LEAST_AXIS * mean) - start
        out[C_Y + m] = start
        out[C_Y + m + N_OF_LOAD] = difference
