"""Fill the contact table for one roll and one yaw of the wheelset.

Equations and sources: :mod:`railsim.contact.table`.
"""

import math
from typing import NamedTuple

import numpy as np

from railsim.kernels import jit_outside
from railsim.kernels.contact_geometry import rail_height, trace_line
from railsim.kernels.contact_table import A1, B1, C_Y, C_Z, HALF_LOAD, K2, LOADS, G, K
from railsim.kernels.elastic_patch import (
    averaged_curvature,
    fit_energy,
    height_under_load,
    kept_above,
    patch_sums,
    unit_ellipse,
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

# rows of the values that are averaged over the pressure; curvatures follow
V_Y, V_Z, V_SLOPE, V_RADIUS, V_CURVATURE = range(5)


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
    """Candidates of a wheel in their place on the rail, those of one zone filled as far as needed.

    h : gap at z = 0 [m]; lift : 1/cos(contact angle), mean of wheel and rail [1]; du, length :
    distance to the next candidate along the axle, and of the neighbours along the contour [m];
    c_y : lateral place from the wheelset's centre [m]; radius [m]; window [1].
    """

    h: np.ndarray
    lift: np.ndarray
    du: np.ndarray
    length: np.ndarray
    c_y: np.ndarray
    radius: np.ndarray
    window: np.ndarray


@jit_outside
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
    averaged = np.empty((V_CURVATURE + elastic.half_widths.size, n))
    least = np.empty(n_patch)
    trace_line(wheel.u, wheel.r, wheel.t, roll, yaw, c_x, c_y, c_z, stretch)
    for k in range(n):
        after, before = min(k + 1, n - 1), max(k - 1, 0)
        du[k] = wheel.u[after] - wheel.u[k]
        across = 0.5 * (wheel.u[after] - wheel.u[before])
        length[k] = across * math.sqrt(1.0 + wheel.t[k] * wheel.t[k])
        averaged[V_Y, k], averaged[V_Z, k], averaged[V_RADIUS, k] = c_y[k], c_z[k], wheel.r[k]
    for i in range(y_nodes.size):
        y = y_nodes[i]
        for p in range(n_patch):
            lowest = wheel.first[p]
            least[p] = FAR_AWAY
            for k in range(wheel.first[p], wheel.last[p], STRIDE):
                if stretch[k] > 0.0:
                    gap = centre_height - c_z[k] + rail_height(
                        y + c_y[k], rail.Y0, rail.dY, rail.z, rail.slope)[0]
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
            start, end = near_candidates(y, p, least[p], c_y, c_z, stretch, centre_height, wheel,
                                         rail)
            for k in range(start, end):
                height, slope, node = rail_height(
                    y + c_y[k], rail.Y0, rail.dY, rail.z, rail.slope)
                h[k] = height + centre_height - c_z[k]
                lift[k] = 0.5 * (stretch[k] + math.sqrt(1.0 + slope * slope))
                averaged[V_SLOPE, k] = -slope
                for m in range(elastic.half_widths.size):
                    averaged[V_CURVATURE + m, k] = wheel.curvature[m, k] + rail.curvature[m, node]
            zone = Zone(h, lift, du, length, c_y, wheel.r, wheel.window[p])
            fill_zone(values[p, i], zone, start, end, averaged, elastic, hertz, strips)


@jit_outside
def near_candidates(y, p, least, c_y, c_z, stretch, centre_height, wheel, rail):
    """Range of a zone's candidates around those that can touch, `end` exclusive."""
    first, last = wheel.first[p], wheel.last[p]
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


@jit_outside
def fill_zone(out, zone, begin, finish, averaged, elastic, hertz, strips):
    """Fields of one zone at one place into `out`, shape (N_FIELD,)."""
    h, lift, du, window = zone.h, zone.lift, zone.du, zone.window
    sums = np.empty(averaged.shape[0] + 4)
    place_sums = np.empty(V_CURVATURE + 4)
    placed = averaged[:V_CURVATURE]
    start, end = begin, finish
    least = h[start:end].min()
    # ellipse of the averaged curvatures, which gives the foundation its stiffness
    k = FOUNDATION * elastic.E_star
    z = height_under_load(least + 5e-5, elastic.reference, k, FIRST_THETA, h, lift, du, start, end)
    patch_sums(z, FIRST_THETA, h, lift, du, window, averaged, start, end, sums)
    A = 0.5 * sums[0] * sums[3] / (sums[1] * sums[4 + V_RADIUS])
    B = averaged_curvature(A, sums[4 + V_CURVATURE:] / sums[3], elastic.half_widths, hertz,
                           elastic.reference, elastic.floor_ratio)
    _, b1, d1 = unit_ellipse(A, B, hertz)
    limit = z + MORE_LOAD * sums[1] / sums[0]
    while h[start] > limit:
        start += 1
    while h[end - 1] > limit:
        end -= 1
    start, end = max(start - 1, begin), min(end + 1, finish)
    depth = (z - least) / elastic.reference ** (2.0 / 3.0)
    k = (k**4 + (LONG_PATCH * 0.75 / (B * b1**3)) ** 4) ** 0.25
    kappa = d1 - B ** (1.0 / 3.0) * (0.75 / k) ** (2.0 / 3.0)
    heights, energies = np.empty(3), np.empty(3)
    place, axis = np.empty((N_OF_LOAD, 3)), np.empty(3)
    for j in range(3):
        load = LOADS[j]
        theta = kappa * load ** (2.0 / 3.0)
        z = least + depth * load ** (2.0 / 3.0)
        z = height_under_load(z, load, k, theta, h, lift, du, start, end)
        deepest = patch_sums(z, theta, h, lift, du, window, placed, start, end, place_sums)
        heights[j] = z
        share = place_sums[3] / place_sums[0]
        energies[j] = k * place_sums[2] + share * 0.4 * kappa * load ** (5.0 / 3.0)
        mean = place_sums[4:] / place_sums[3]
        A = 0.5 * place_sums[0] / (place_sums[1] * mean[V_RADIUS])
        B = kept_above((4.0 / 3.0 * k / load) ** 2 * deepest**3, elastic.floor_ratio * A)
        ellipse = unit_ellipse(A, B, hertz)
        axis[j], place[2, j] = ellipse[0], ellipse[1]
        if elastic.non_elliptic:
            a, b = non_elliptic_axes(zone, start, end, mean[V_Y], A, B, ellipse, load,
                                     elastic.E_star, strips)
            if a > 0.0:
                axis[j], place[2, j] = a, b
        place[0, j], place[1, j], place[3, j] = mean[V_Y], mean[V_Z], mean[V_SLOPE]
    out[G], out[K], out[K2] = fit_energy(heights, energies)
    out[A1] = axis[1]
    over_load(out, place)


@jit_outside
def over_load(out, place):
    """Fields of the form v + dv N/(N + HALF_LOAD), as near as possible to the three loads'."""
    loads = np.array(LOADS)
    tau = loads / (loads + HALF_LOAD)
    away = tau - tau.mean()
    for m in range(N_OF_LOAD):
        mean = place[m].mean()
        difference = np.sum(away * place[m]) / np.sum(away * away)
        start = mean - difference * tau.mean()
        if m == 2:
            start = max(start, LEAST_AXIS * mean)
            difference = max(start + difference, LEAST_AXIS * mean) - start
        out[C_Y + m] = start
        out[C_Y + m + N_OF_LOAD] = difference
