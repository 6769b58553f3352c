"""Contact geometry of one wheel on one rail, for the contact table.

The wheel, turned by roll and yaw, is reduced to its trace (silhouette) line in the track's
cross-section: at the lateral place u of the axle the point u l + r e with

    e_x = t l_x,   e_y l_y + e_z l_z = -e_x l_x,   |e| = 1,   t = dr/du,   l the axle's direction,

is the one whose normal has no component along the rail.  The gap is measured vertically between
that line and the rail; a soft minimum over a zone of the wheel's profile gives the height at
which the zone touches.
"""

import math

import numpy as np

from railsim.kernels import jit_outside

SPREAD = 16.0  # candidates whose gap exceeds the least by more than SPREAD eps have no weight
WIDTH_ITERATIONS = 8
VIRTUAL_SHARE = 0.55  # of the approach, Kik and Piotrowski (1996)
FAR_PATCH = 5e-4  # a patch that touches this much later carries nothing [m]

# Fields of a table, see `railsim.contact.table`.
G, K, C_Y, C_Z, C_X, A1, B1, TAN_GAMMA = range(8)
N_FIELD = 8


@jit_outside
def trace_line(u, r, t, roll, yaw, c_x, c_y, c_z, stretch):
    """Trace line of a wheel relative to the wheelset's centre, in track axes.

    Parameters
    ----------
    u, r, t : ndarray, shape (n,)
        Place along the axle from the wheelset's centre [m], radius [m], and dr/du [1].
    roll, yaw : float
        Attitude of the wheelset, C = Rz(yaw) Rx(roll) [rad].
    c_x, c_y, c_z : ndarray, shape (n,)
        Points of the line (output) [m].
    stretch : ndarray, shape (n,)
        1/cos of the angle between the wheel's surface there and the track plane, 0 where the
        profile is so steep against the yaw that no trace point exists (output) [1].
    """
    l_x = -math.sin(yaw) * math.cos(roll)
    l_y = math.cos(yaw) * math.cos(roll)
    l_z = math.sin(roll)
    m = math.sqrt(l_y * l_y + l_z * l_z)
    for k in range(u.size):
        e_x = t[k] * l_x
        along = -e_x * l_x / m
        rest = 1.0 - e_x * e_x - along * along
        across = math.sqrt(max(rest, 0.0))
        n_z = (along * l_z + across * l_y) / m - t[k] * l_z
        stretch[k] = math.sqrt(1.0 + t[k] * t[k]) / n_z if rest > 0.0 and n_z > 0.0 else 0.0
        c_x[k] = u[k] * l_x + r[k] * e_x
        c_y[k] = u[k] * l_y + r[k] * (along * l_y - across * l_z) / m
        c_z[k] = u[k] * l_z + r[k] * (along * l_z + across * l_y) / m


@jit_outside
def rail_height(Y, Y0, dY, z, slope):
    """Height of the rail's surface and its slope at the lateral place `Y`, cubic, straight beyond.

    Parameters
    ----------
    Y : float
        Lateral place [m].
    Y0, dY : float
        First place and spacing of the nodes [m].
    z, slope : ndarray, shape (n_rail,)
        Height [m] and slope [1] at the nodes.

    Returns
    -------
    float, float, int
        Height [m], slope [1] and nearest lower node.
    """
    x = (Y - Y0) / dY
    n = z.size
    if not x > 0.0:
        return z[0] + slope[0] * (Y - Y0), slope[0], 0
    if not x < n - 1:
        return z[n - 1] + slope[n - 1] * (Y - Y0 - (n - 1) * dY), slope[n - 1], n - 2
    j = int(x)
    x -= j
    d0 = slope[j] * dY
    d1 = slope[j + 1] * dY
    rise = z[j + 1] - z[j]
    c2 = 3.0 * rise - 2.0 * d0 - d1
    c3 = d0 + d1 - 2.0 * rise
    return z[j] + x * (d0 + x * (c2 + x * c3)), (d0 + x * (2.0 * c2 + 3.0 * x * c3)) / dY, j


@jit_outside
def interpolated(x, x0, dx, values):
    """Linear interpolation on a uniform grid, constant beyond its ends."""
    s = (x - x0) / dx
    if not s > 0.0:
        return values[0]
    if not s < values.size - 1:
        return values[-1]
    i = int(s)
    return values[i] + (s - i) * (values[i + 1] - values[i])


@jit_outside
def fill_table_slice(
    values,
    y_nodes,
    roll,
    yaw,
    centre_height,
    wheel_u,
    wheel_r,
    wheel_t,
    wheel_du,
    log_window,
    window,
    first,
    last,
    wheel_curvature,
    rail_Y0,
    rail_dY,
    rail_z,
    rail_slope,
    rail_curvature,
    half_widths,
    ellipse_x0,
    ellipse_dx,
    ellipse,
    eps,
    load,
    floor_ratio,
    approach,
    E_star,
    non_elliptic,
    strip_x0,
    strip_dx,
    strip,
    whole,
):
    """Fill the table for one roll and one yaw.

    Parameters
    ----------
    values : ndarray, shape (n_patch, n_y, N_FIELD)
        Slice of the table (output).  `K` is left without the normalisation of `g`.
    y_nodes : ndarray, shape (n_y,)
        Lateral displacements of the wheelset's centre [m].
    roll, yaw : float
        Attitude [rad].
    centre_height : float
        Height of the wheelset's centre above the rail tops at z = 0 [m].
    wheel_u, wheel_r, wheel_t, wheel_du : ndarray, shape (n_u,)
        Place along the axle [m], radius [m], slope [1] and quadrature weight [m] of the candidates.
    log_window, window : ndarray, shape (n_patch, n_u)
        Partition of unity over the candidates and its logarithm [1].
    first, last : ndarray of int, shape (n_patch,)
        Range of candidates with a window above zero, `last` exclusive.
    wheel_curvature : ndarray, shape (n_width, n_u)
        Curvature of the wheel averaged over a patch of each half-width, convex positive [1/m].
    rail_Y0, rail_dY, rail_z, rail_slope
        Rail as for `rail_height`.
    rail_curvature : ndarray, shape (n_width, n_rail)
        As `wheel_curvature`, for the rail [1/m].
    half_widths : ndarray, shape (n_width,)
        Half-widths of the averages, ascending [m].
    ellipse_x0, ellipse_dx : float
        Grid of `ellipse` over ln(A/B).
    ellipse : ndarray, shape (3, n)
        Logarithms of a1 A^(1/3), b/a and d1 A^(-1/3).
    eps : float
        Softness of the minimum [m].
    load : float
        Force for which the patch's width sets the averaging of the curvatures [N].
    floor_ratio : float
        B is kept above about this many A [1].
    approach : float
        Normal approach at which the place of contact is sought, see `railsim.contact.table` [m].
    E_star : float
        Equivalent modulus [Pa].
    non_elliptic : bool
        Stiffness and patch by `kik_piotrowski` instead of the averaged ellipse.
    strip_x0, strip_dx : float
        Grid of `strip` over the logarithm of distance over half length.
    strip : ndarray, shape (n,)
        Influence of a strip, see `kik_piotrowski` [1].
    whole : ndarray, shape (n,)
        Influence of an elliptic virtual patch over ln(b/a), on the grid of `strip` [1].
    """
    n_u = wheel_u.size
    n_patch = values.shape[0]
    n_width = half_widths.size
    c_x = np.empty(n_u)
    c_y = np.empty(n_u)
    c_z = np.empty(n_u)
    h = np.empty(n_u)
    slope = np.empty(n_u)
    lift = np.empty(n_u)
    tangent = np.empty(n_u)
    length = np.empty(n_u)
    node = np.empty(n_u, np.int64)
    stretch = np.empty(n_u)
    curvature = np.empty(n_width)
    hertz_a1, hertz_b1, mean_radius = np.empty(n_patch), np.empty(n_patch), np.empty(n_patch)
    half_B, stiffness = np.empty(n_patch), np.empty(n_patch)
    trace_line(wheel_u, wheel_r, wheel_t, roll, yaw, c_x, c_y, c_z, stretch)
    # c_x is odd in yaw: its ratio to yaw has a limit, taken at a yaw that is small but not zero
    yaw_for_x = yaw if abs(yaw) > 1e-6 else 1e-6
    sine = math.sin(yaw_for_x) / yaw_for_x * math.cos(roll)
    for k in range(n_u):
        c_x[k] = -(wheel_u[k] + wheel_r[k] * wheel_t[k]) * sine
    # distance of neighbouring candidates along the contour
    for k in range(n_u):
        length[k] = wheel_du[k] * math.sqrt(1.0 + wheel_t[k] * wheel_t[k])
    for i in range(y_nodes.size):
        for k in range(n_u):
            h[k], slope[k], node[k] = rail_height(
                y_nodes[i] + c_y[k], rail_Y0, rail_dY, rail_z, rail_slope
            )
            rail_stretch = math.sqrt(1.0 + slope[k] * slope[k])
            lift[k] = 0.5 * approach * (stretch[k] + rail_stretch)
            h[k] += centre_height - c_z[k] + lift[k]
            bend = approach * rail_curvature[0, node[k]] * rail_stretch * rail_stretch
            tangent[k] = -slope[k] * (1.0 + 0.5 * bend)
            if not stretch[k] > 0.0:
                h[k] = 1.0
        for p in range(n_patch):
            least = 1e9
            for k in range(first[p], last[p]):
                least = min(least, h[k] - eps * log_window[p, k])
            total = 0.0
            s_window = s_y = s_z = s_x = s_tangent = s_r = s_lift = 0.0
            for m in range(n_width):
                curvature[m] = 0.0
            for k in range(first[p], last[p]):
                excess = (h[k] - eps * log_window[p, k] - least) / eps
                if excess < SPREAD:
                    weight = math.exp(-excess) * wheel_du[k]
                    total += weight
                    s_window += weight * window[p, k]
                    s_y += weight * c_y[k]
                    s_z += weight * c_z[k]
                    s_x += weight * c_x[k]
                    s_tangent += weight * tangent[k]
                    s_r += weight * wheel_r[k]
                    s_lift += weight * lift[k]
                    for m in range(n_width):
                        curvature[m] += weight * (
                            wheel_curvature[m, k] + rail_curvature[m, node[k]]
                        )
            inverse = 1.0 / total
            for m in range(n_width):
                curvature[m] *= inverse
            tan_gamma = s_tangent * inverse
            cos_gamma = 1.0 / math.sqrt(1.0 + tan_gamma * tan_gamma)
            A = 0.5 * cos_gamma / (s_r * inverse)
            a1, b1, d1, B = averaged_ellipse(
                A,
                curvature,
                half_widths,
                ellipse_x0,
                ellipse_dx,
                ellipse,
                load,
                floor_ratio,
            )
            out = values[p, i]
            out[G] = least - eps * math.log(total) - s_lift * inverse
            out[K] = s_window * inverse * (cos_gamma**2.5) * d1**-1.5
            hertz_a1[p], hertz_b1[p] = a1, b1
            mean_radius[p] = s_r * inverse
            half_B[p] = B
            stiffness[p] = d1**-1.5
            out[C_Y] = s_y * inverse
            out[C_Z] = s_z * inverse
            out[C_X] = s_x * inverse
            out[A1] = a1
            out[B1] = b1
            out[TAN_GAMMA] = tan_gamma
        if non_elliptic:
            for p in range(n_patch):
                out = values[p, i]
                lowest = 1e9
                for q in range(n_patch):
                    lowest = min(lowest, values[q, i, G])
                if out[G] > lowest + FAR_PATCH:
                    continue
                # the approach at which the averaged ellipse carries the load, twice corrected
                delta = (load / stiffness[p]) ** (2.0 / 3.0)
                N = a = b = 0.0
                for _ in range(3):
                    N, a, b = kik_piotrowski(
                        h,
                        c_y,
                        wheel_r,
                        length,
                        lift,
                        approach,
                        window[p],
                        first[p],
                        last[p],
                        out[C_Y],
                        delta,
                        E_star,
                        strip_x0,
                        strip_dx,
                        strip,
                    )
                    N, a, b = corrected_by_hertz(
                        N,
                        a,
                        b,
                        0.5 / math.sqrt(1.0 + out[TAN_GAMMA] ** 2) / mean_radius[p],
                        half_B[p],
                        hertz_a1[p],
                        hertz_b1[p],
                        stiffness[p],
                        delta,
                        E_star,
                        strip_x0,
                        strip_dx,
                        whole,
                    )
                    power = N / (delta * math.sqrt(delta))
                    if N <= 0.0:
                        break
                    delta *= (load / N) ** (2.0 / 3.0)
                if N > 0.0:
                    third = N ** (1.0 / 3.0)
                    out[A1] = a / third
                    out[B1] = b / third
                    out[K] *= power / stiffness[p]


@jit_outside
def corrected_by_hertz(N, a, b, A, B, a1, b1, stiffness, delta, E_star, x0, dx, whole):
    """Force and axes of `kik_piotrowski`, made exact for elliptic patches.

    Each is multiplied by the ratio of Hertz' to the method's own value for the ellipse of the
    half relative curvatures A and B at the approach `delta`.
    """
    if N <= 0.0:
        return 0.0, 0.0, 0.0
    virtual = VIRTUAL_SHARE * delta
    a_virtual, b_virtual = math.sqrt(virtual / A), math.sqrt(virtual / B)
    influence = math.exp(interpolated(math.log(b_virtual / a_virtual), x0, dx, whole))
    N_virtual = math.pi * E_star * delta * (2.0 * math.pi / 3.0) * a_virtual / influence
    N_hertz = stiffness * delta * math.sqrt(delta)
    third = N_hertz ** (1.0 / 3.0)
    return N * N_hertz / N_virtual, a * a1 * third / a_virtual, b * b1 * third / b_virtual


@jit_outside
def kik_piotrowski(
    h,
    place,
    radius,
    length,
    lift,
    approach,
    window,
    first,
    last,
    centre,
    delta,
    E_star,
    x0,
    dx,
    strip,
):
    """Non-elliptic patch at a given approach.

    The patch is where the undeformed surfaces would overlap if they approached by
    `VIRTUAL_SHARE` of the real approach; in each strip along the rail the pressure is a
    semi-ellipse, highest in proportion to the strip's length.  The real approach fixes the
    pressure at the patch's centre:

        N = pi E* delta I1/I2,   I1 = integral pi/2 x_l^2 ds,
        I2 = integral x_l J(|s|/x_l) ds,   J(q) = integral_-1^1 sqrt(1 - t^2)/sqrt(t^2 + q^2) dt.

    Parameters
    ----------
    h : ndarray, shape (n,)
        Height at which each candidate reaches the rail, with `lift` [m].
    place, radius, length, lift : ndarray, shape (n,)
        Lateral place [m], rolling radius [m], length along the contour [m], approach over the
        cosine of the contact angle [m] of each candidate.
    window : ndarray, shape (n,)
        Window of the zone [1].
    first, last : int
        Candidates of the zone.
    approach : float
        Approach that `h` and `lift` hold [m].
    centre : float
        Lateral place of the patch [m].
    delta : float
        Approach of the bodies along the normal [m].
    E_star : float
        Equivalent modulus [Pa].
    x0, dx, strip
        Logarithm of J over the logarithm of q: grid and values.

    Returns
    -------
    N : float
        Normal force, 0 if there is no patch [N].
    a, b : float
        Semi-axes of the ellipse with the patch's area and its ratio of length to width [m].

    Notes
    -----
    Source: W. Kik, J. Piotrowski, A fast, approximate method to calculate normal load at contact
    between wheel and rail and creep forces during rolling, 2nd mini conference on contact
    mechanics and wear of rail/wheel systems, Budapest (1996).
    """
    z = 1e9
    best = first
    for k in range(first, last):
        height = h[k] + lift[k] * (delta / approach - 1.0)
        if height < z:
            z = height
            best = k
    # candidate nearest to the patch's centre, from which the patch is followed to both sides
    middle = best
    for k in range(first, last):
        if abs(place[k] - centre) < abs(place[middle] - centre):
            middle = k
    if _virtual_overlap(h, lift, approach, z, delta, middle) <= 0.0:
        middle = best
    start = _patch_end(h, lift, approach, z, delta, window, middle, -1)
    end = _patch_end(h, lift, approach, z, delta, window, middle, 1)
    area = load_sum = depth_sum = width = longest = 0.0
    s = 0.0
    for k in range(start, middle):
        s -= 0.5 * (length[k] + length[k + 1])
    for k in range(start, end + 1):
        overlap = _virtual_overlap(h, lift, approach, z, delta, k)
        # 2 R, with the normal curvature radius r/cos(gamma) in rolling direction
        squared = 2.0 * radius[k] * lift[k] / approach * overlap
        half = math.sqrt(squared)
        # the centre's own element: the mean of the logarithm over it
        distance = max(abs(s), length[k] / (2.0 * math.e))
        influence = math.exp(interpolated(math.log(distance / half), x0, dx, strip))
        load_sum += 0.5 * math.pi * squared * length[k]
        depth_sum += half * influence * length[k]
        area += 2.0 * half * length[k]
        width += length[k]
        longest = max(longest, half)
        if k < end:
            s += 0.5 * (length[k] + length[k + 1])
    if load_sum <= 0.0:
        return 0.0, 0.0, 0.0
    N = math.pi * E_star * delta * load_sum / depth_sum
    ratio = longest / (0.5 * width)
    a = math.sqrt(area / math.pi * ratio)
    return N, a, a / ratio


@jit_outside
def _patch_end(h, lift, approach, z, delta, window, middle, step):
    """Last candidate of the patch in one direction.

    The patch ends where the virtual overlap does; in a neighbouring zone also where the overlap
    begins to grow again, for there another patch begins.
    """
    k = middle
    overlap = _virtual_overlap(h, lift, approach, z, delta, k)
    while 0 <= k + step < h.size:
        following = _virtual_overlap(h, lift, approach, z, delta, k + step)
        if following <= 0.0 or (window[k + step] < 0.5 and following > overlap):
            break
        k += step
        overlap = following
    return k


@jit_outside
def _virtual_overlap(h, lift, approach, z, delta, k):
    """Overlap of a candidate at the virtual approach [m]."""
    return approach * ((z - h[k]) / lift[k] + 1.0) - (1.0 - VIRTUAL_SHARE) * delta


@jit_outside
def averaged_ellipse(A, curvature, half_widths, ellipse_x0, ellipse_dx, ellipse, load, floor_ratio):
    """Unit-load ellipse with the lateral curvature averaged over the patch itself.

    Parameters
    ----------
    A : float
        Half the relative curvature along the rail [1/m].
    curvature : ndarray, shape (n_width,)
        Relative curvature across, averaged over each of `half_widths` [1/m].
    half_widths, ellipse_x0, ellipse_dx, ellipse, load, floor_ratio
        See `fill_table_slice`; `ellipse` holds the material as well.

    Returns
    -------
    a1, b1, d1 : float
        As `railsim.kernels.hertz.unit_load_ellipse`.
    B : float
        Half the relative curvature across that was used [1/m].
    """
    n = half_widths.size
    b = 0.004
    third = load ** (1.0 / 3.0)
    a1 = b1 = d1 = B = 0.0
    scale = A ** (1.0 / 3.0)
    least_B = floor_ratio * A
    for _ in range(WIDTH_ITERATIONS):
        j = 0
        while j < n - 2 and b > half_widths[j + 1]:
            j += 1
        x = (b - half_widths[j]) / (half_widths[j + 1] - half_widths[j])
        x = min(max(x, 0.0), 1.0)
        B = 0.5 * (curvature[j] + x * (curvature[j + 1] - curvature[j]))
        # a smooth maximum of B and the floor: B + floor^2/B far above, floor at B = 0
        B = 0.5 * (B + math.sqrt(B * B + 4.0 * least_B * least_B))
        place = math.log(A / B)
        a1 = math.exp(interpolated(place, ellipse_x0, ellipse_dx, ellipse[0])) / scale
        b1 = a1 * math.exp(interpolated(place, ellipse_x0, ellipse_dx, ellipse[1]))
        d1 = math.exp(interpolated(place, ellipse_x0, ellipse_dx, ellipse[2])) * scale
        # the geometric mean damps the iteration, which may swing in the flange root
        b = math.sqrt(b * b1 * third)
    return a1, b1, d1, B


# Results of `rigid_contact`.
R_GAP, R_U, R_RADIUS, R_PLACE, R_SLOPE, R_INDEX = range(6)


@jit_outside
def rigid_contact(wheel, rail_Y0, rail_dY, rail_z, rail_slope, centre_height, y, roll, out):
    """First contact of a rigid wheel that is lowered onto its rail, without yaw.

    Parameters
    ----------
    wheel : ndarray, shape (3, n)
        Candidates u [m], r [m], dr/du [1] along the axle.
    rail_Y0, rail_dY, rail_z, rail_slope
        Rail as for `rail_height`.
    centre_height, y, roll : float
        Height of the wheelset's centre above the rail tops, its lateral displacement [m], its
        roll [rad].
    out : ndarray, shape (6,)
        Height at which the wheel touches [m], place u on the axle [m], rolling radius [m], lateral
        place [m] and slope [1] on the rail, candidate (-1 if the contact is at the wheel's end).
    """
    cosine, sine = math.cos(roll), math.sin(roll)
    n = wheel.shape[1]
    least = 1e9
    best = 0
    for k in range(n):
        u, r = wheel[0, k], wheel[1, k]
        h = rail_height(y + u * cosine - r * sine, rail_Y0, rail_dY, rail_z, rail_slope)[0]
        h += centre_height - u * sine - r * cosine
        if h < least:
            least = h
            best = k
    u, r = wheel[0, best], wheel[1, best]
    # the gap's slope is interpolated to its zero between this candidate and a neighbour
    own = _gap_slope(wheel, best, rail_Y0, rail_dY, rail_z, rail_slope, y, cosine, sine)
    other = best - 1 if own > 0.0 else best + 1
    index = best
    if 0 <= other < n:
        there = _gap_slope(wheel, other, rail_Y0, rail_dY, rail_z, rail_slope, y, cosine, sine)
        if own * there < 0.0:
            x = own / (own - there)
            du = wheel[0, other] - u
            slope = wheel[2, best] + 0.5 * x * (wheel[2, other] - wheel[2, best])
            r += slope * x * du
            u += x * du
            least += 0.5 * own * x * du
    else:
        index = -1
    place = y + u * cosine - r * sine
    out[R_GAP] = least
    out[R_U] = u
    out[R_RADIUS] = r
    out[R_PLACE] = place
    out[R_SLOPE] = rail_height(place, rail_Y0, rail_dY, rail_z, rail_slope)[1]
    out[R_INDEX] = index


@jit_outside
def _gap_slope(wheel, k, rail_Y0, rail_dY, rail_z, rail_slope, y, cosine, sine):
    """Derivative of the gap with respect to u at a candidate [1]."""
    u, r, t = wheel[0, k], wheel[1, k], wheel[2, k]
    slope = rail_height(y + u * cosine - r * sine, rail_Y0, rail_dY, rail_z, rail_slope)[1]
    return slope * (cosine - t * sine) - (sine + t * cosine)


@jit_outside
def rigid_sweep(
    lateral,
    wheel_right,
    right_Y0,
    right_z,
    right_slope,
    wheel_left,
    left_Y0,
    left_z,
    left_slope,
    rail_dY,
    centre_height,
    roll_max,
    roll,
    contacts,
):
    """Roll of a rigid wheelset on both rails, and its contacts, over the lateral displacement.

    The left side is given as a right one; it is looked up at -y and -roll.  The roll is the one
    nearest to the previous displacement's at which both wheels touch, found by bracketing and
    regula falsi (Illinois).

    Parameters
    ----------
    lateral : ndarray, shape (n,)
        Lateral displacements [m].
    wheel_right, wheel_left, right_*, left_*, rail_dY
        As for `rigid_contact`.
    centre_height, roll_max : float
        As for `rigid_contact`; largest roll that is tried [rad].
    roll : ndarray, shape (n,)
        Roll (output), nan where none was found [rad].
    contacts : ndarray, shape (n, 2, 6)
        Left and right contact as from `rigid_contact` (output).
    """
    left, right = np.empty(6), np.empty(6)
    previous = 0.0

    for i in range(lateral.size):
        y = lateral[i]
        step = 1e-4
        a = b = previous
        f_a = f_b = 0.0
        for trial in range(-1, 64):
            # away from the previous roll, in growing steps to both sides
            away = 0.0 if trial < 0 else step
            x = previous + (away if trial % 2 == 0 else -away)
            rigid_contact(
                wheel_right, right_Y0, rail_dY, right_z, right_slope, centre_height, y, x, right
            )
            rigid_contact(
                wheel_left, left_Y0, rail_dY, left_z, left_slope, centre_height, -y, -x, left
            )
            f = right[R_GAP] - left[R_GAP]
            if trial < 0:
                f_a = f_b = f
                if f == 0.0:
                    break
            elif f * f_b <= 0.0:
                a, f_a = x, f
                break
            elif trial % 2 == 1:
                step *= 1.5
                if step > 2.0 * roll_max:
                    break
        if f_a * f_b > 0.0:
            roll[i] = math.nan
            for k in range(6):
                contacts[i, 0, k] = math.nan
                contacts[i, 1, k] = math.nan
            continue
        x = b
        for _ in range(60):
            if f_a == f_b:
                break
            x = b - f_b * (b - a) / (f_b - f_a)
            rigid_contact(
                wheel_right, right_Y0, rail_dY, right_z, right_slope, centre_height, y, x, right
            )
            rigid_contact(
                wheel_left, left_Y0, rail_dY, left_z, left_slope, centre_height, -y, -x, left
            )
            f = right[R_GAP] - left[R_GAP]
            if f * f_b < 0.0:
                a, f_a = b, f_b
            else:
                f_a *= 0.5
            b, f_b = x, f
            if abs(f) < 1e-12 or abs(b - a) < 1e-13:
                break
        previous = x
        roll[i] = x
        contacts[i, 0] = left
        contacts[i, 1] = right
