"""Non-elliptic contact patches after Kik and Piotrowski, for the contact table."""

import math

from railsim.kernels import compiled
from railsim.kernels.elastic_patch import interpolate

VIRTUAL_SHARE = 0.55  # of the approach, Kik and Piotrowski (1996)


@compiled(in_loop=False)
def kik_piotrowski(zone, first, last, centre, delta, E_star, strips):
    """Non-elliptic patch at a given approach.

    The patch is where the undeformed surfaces would overlap if they approached by
    `VIRTUAL_SHARE` of the real approach; in each strip along the rail the pressure is a
    semi-ellipse, highest in proportion to the strip's length.  The real approach fixes the
    pressure at the patch's centre:

        N = pi E* delta I1/I2,   I1 = integral pi/2 x_l^2 ds,
        I2 = integral x_l J(|s|/x_l) ds,   J(q) = integral_-1^1 sqrt(1 - t^2)/sqrt(t^2 + q^2) dt.

    Parameters
    ----------
    zone
        Candidates, see `railsim.kernels.table_slice.Zone`.
    first, last : int
        Candidates of the zone.
    centre : float
        Lateral position of the patch [m].
    delta : float
        Approach of the bodies along the normal [m].
    E_star : float
        Equivalent modulus [Pa].
    strips
        Influences, see `railsim.contact.table.strip_influence`.

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
    h, lift, y, length = zone.h, zone.lift, zone.c_y, zone.length
    z = 1e9
    lowest = first
    for k in range(first, last):
        height = h[k] + lift[k] * delta
        if height < z:
            z = height
            lowest = k
    # candidate nearest to the patch's centre, from which the patch is followed to both sides
    middle = lowest
    for k in range(first, last):
        if abs(y[k] - centre) < abs(y[middle] - centre):
            middle = k
    if _virtual_overlap(zone, z, delta, middle) <= 0.0:
        middle = lowest
    start = _patch_end(zone, z, delta, middle, -1)
    end = _patch_end(zone, z, delta, middle, 1)
    area = load_sum = depth_sum = width = longest = 0.0
    s = 0.0
    for k in range(start, middle):
        s -= 0.5 * (length[k] + length[k + 1])
    for k in range(start, end + 1):
        # 2 R, with the normal curvature radius r/cos(gamma) in rolling direction
        squared = 2.0 * zone.radius[k] * lift[k] * _virtual_overlap(zone, z, delta, k)
        half = math.sqrt(squared)
        # the centre's own element: the mean of the logarithm over it
        distance = max(abs(s), length[k] / (2.0 * math.e))
        influence = math.exp(
            interpolate(math.log(distance / half), strips.start, strips.spacing, strips.strip)
        )
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


@compiled(in_loop=False)
def _patch_end(zone, z, delta, middle, step):
    """Last candidate of the patch in one direction.

    The patch ends where the virtual overlap does; in a neighbouring zone also where the overlap
    begins to grow again, for there another patch begins.
    """
    k = middle
    overlap = _virtual_overlap(zone, z, delta, k)
    while zone.low <= k + step < zone.high:
        following = _virtual_overlap(zone, z, delta, k + step)
        if following <= 0.0 or (zone.window[k + step] < 0.5 and following > overlap):
            break
        k += step
        overlap = following
    return k


@compiled(in_loop=False)
def _virtual_overlap(zone, z, delta, k):
    """Overlap of a candidate along the normal at the virtual approach [m]."""
    return (z - zone.h[k]) / zone.lift[k] - (1.0 - VIRTUAL_SHARE) * delta


@compiled(in_loop=False)
def scale_to_hertz(patch, A, B, ellipse, delta, E_star, strips):
    """Force and axes of `kik_piotrowski`, made exact for elliptic patches.

    Each is multiplied by the ratio of Hertz' to the method's own value for the ellipse of the
    half relative curvatures A and B at the approach `delta`; `ellipse` as from
    `railsim.kernels.elastic_patch.unit_ellipse`.
    """
    N, a, b = patch
    if N <= 0.0:
        return 0.0, 0.0, 0.0
    virtual = VIRTUAL_SHARE * delta
    a_virtual, b_virtual = math.sqrt(virtual / A), math.sqrt(virtual / B)
    influence = math.exp(
        interpolate(math.log(b_virtual / a_virtual), strips.start, strips.spacing, strips.whole)
    )
    N_virtual = math.pi * E_star * delta * (2.0 * math.pi / 3.0) * a_virtual / influence
    N_hertz = (delta / ellipse[2]) ** 1.5
    third = N_hertz ** (1.0 / 3.0)
    return (
        N * N_hertz / N_virtual,
        a * ellipse[0] * third / a_virtual,
        b * ellipse[1] * third / b_virtual,
    )


@compiled(in_loop=False)
def non_elliptic_axes(zone, first, last, centre, A, B, ellipse, load, E_star, strips):
    """Semi-axes at unit load of the non-elliptic patch under a load, 0 if there is none.

    Returns
    -------
    float, float
        a, b [m/N^(1/3)].
    """
    # the approach at which the averaged ellipse carries the load, twice corrected
    delta = ellipse[2] * load ** (2.0 / 3.0)
    for _ in range(3):
        patch = kik_piotrowski(zone, first, last, centre, delta, E_star, strips)
        N, a, b = scale_to_hertz(patch, A, B, ellipse, delta, E_star, strips)
        if N <= 0.0:
            return 0.0, 0.0
        last_load = N
        delta *= (load / N) ** (2.0 / 3.0)
    third = last_load ** (1.0 / 3.0)
    return a / third, b / third
