"""How contact forces change with motions of wheelset and rail, for the implicit part of a step."""

from math import copysign, sqrt

from railsim.kernels import compiled
from railsim.kernels.contact_columns import (
    ANGLE_COS,
    ANGLE_SIN,
    C11,
    C22,
    C_Y,
    C_Z,
    FOOT_Y,
    FOOT_Z,
    FORCE_PER_ROLL,
    FORCE_PER_Y,
    FORCE_PER_Z,
    GEOMETRIC_STIFFNESS,
    J_CROSS,
    J_CROSS_YAW,
    J_NORMAL,
    J_SECANT_C_Y,
    J_SLIP,
    NORMAL,
    NORMAL_DAMPING,
    NORMAL_STIFFNESS,
    NORMAL_Y,
    NORMAL_Z,
    SECANT_ALONG,
    SLOPE_ACROSS,
    SLOPE_ALONG,
    T_X,
    T_Y,
)
from railsim.kernels.contact_table import (
    FLANGE_ROOT,
    G_ROLL,
    G_Y,
    G_YY,
    K2_ROLL,
    K2_Y,
    K_ROLL,
    K_Y,
    N_PATCH,
)
from railsim.kernels.lanes import LANES, load_lanes, splat, square_root, store_lanes, where_beyond
from railsim.kernels.support import (
    D_Y_SLIP,
    D_Z_SLIP,
    FOOT_Y_STIFFNESS,
    FOOT_Z_STIFFNESS,
    SKIP,
    STIFFNESS,
    SUPPORT_COLUMNS,
    D,
    K,
)

# m/s, speed of travel below which the implicit part knows how creep forces in one direction follow
# the slip in the others: without, steps in tight curves had to be up to 26 times as short.  Just
# below the lowest speed of a class of runs, 1.2^6, so that all of a class do without
COUPLING_SPEED = 2.98
# there the slope across is this share of the force over the slip at least: spin turns the force of
# a patch that slides, which the slopes do not know
MIN_LATERAL_SLOPE = 0.2
# static wheel loads up to which the gradients of the table count in full, to nothing at twice that
GRADIENT_LOAD = 4.0
# by how much a patch's change of stiffness may change its force, over its stiffness against the
# vertical and over that along the motion
VERTICAL_SHARE, MOTION_SHARE = 0.03, 0.5


@compiled(python=False)
def estimate_creep_slopes(n, patches, speed, G, along, across, secant_along):
    """Slopes of the creep force along and across over the slip in that direction [N s/m].

    Those of the force mu N (1 - (1 - u/3)^3) in the direction of the linear one, u = |T_linear|/
    (mu N) <= 3 (Vermeulen and Johnson 1964, spin as in the linear theory): an estimate that serves
    the time step and does not enter the forces.

    Parameters
    ----------
    n : int
        Number of patches.
    patches : Patches
        Read only.
    speed, G : float
        Speed of travel [m/s]; shear modulus, reduced by the third body [Pa].
    along, across, secant_along : float64[>= n, by eights]
        Written; zero without friction or load.  `secant_along`: the force along over the slip.
    """
    a, b, mu_N = patches.a, patches.b, patches.mu_N
    c11, c22, c23 = patches.c11, patches.c22, patches.c23
    xi_x, xi_y, phi = patches.xi_x, patches.xi_y, patches.phi
    one, zero, per_speed = splat(1.0), splat(0.0), 1.0 / speed
    for i in range(0, n, LANES):
        k11, k22, load = load_lanes(c11, i), load_lanes(c22, i), load_lanes(mu_N, i)
        ab = load_lanes(a, i) * load_lanes(b, i)
        unit = G * ab
        limit = unit / where_beyond(load, 0.0, load, one)
        spin = load_lanes(c23, i) * square_root(ab) * load_lanes(phi, i)
        x = limit * k11 * load_lanes(xi_x, i)
        y = limit * (k22 * load_lanes(xi_y, i) + spin)
        square = x * x + y * y
        u = square_root(square)
        v = one - u * (1.0 / 3.0)
        secant = where_beyond(u, 3.0, one / u, v + square * (1.0 / 27.0))
        tangent = where_beyond(u, 3.0, zero, v * v)
        share = x * x / (square + 1e-300)
        scale = where_beyond(load, 0.0, unit * per_speed, zero)
        store_lanes(along, i, scale * k11 * (secant + share * (tangent - secant)))
        store_lanes(across, i, scale * k22 * (tangent + share * (secant - tangent)))
        store_lanes(secant_along, i, scale * k11 * secant)


@compiled(python=False)
def clear_support(support, support_step):
    """Clear forces and slopes of the rails whose contact is evaluated."""
    for w in range(support.shape[0]):
        if support_step[w, SKIP] > 0.0:
            continue
        for side in range(2):
            for k in range(SUPPORT_COLUMNS):
                support[w, side, k] = 0.0


@compiled(inline=True)
def add_scaled(row, first, factor, vector):
    """Add a factor times a vector to three entries of a row."""
    row[first] += factor * vector[0]
    row[first + 1] += factor * vector[1]
    row[first + 2] += factor * vector[2]


@compiled(python=False)
def add_slip_coupling(system, work, n):
    """Add how `n` patches couple the speeds along the track, in yaw, and in y, z and roll.

    Slips of the wheel along, x' + c_z pitch' - c_y yaw', and across, c y' - s z' + arm roll'.  With
    the slopes of `estimate_creep_slopes`, C22/C11 times the secant along being that across, the
    slope of the force in one direction over the slip in the other one is the root of what both
    slopes are below their secants, against the sign of T_x T_y.
    """
    patch = work.patch
    for k in range(n):
        secant, across = patch[SECANT_ALONG, k], patch[SLOPE_ACROSS, k]
        square = secant * patch[C22, k] / patch[C11, k] - across
        square = max(0.0, square) * max(0.0, secant - patch[SLOPE_ALONG, k])
        cross = -copysign(sqrt(square), patch[T_X, k] * patch[T_Y, k])
        across = patch[SLOPE_ACROSS, k] = max(across, MIN_LATERAL_SLOPE * secant)
        s, c, cy = patch[NORMAL_Y, k], patch[NORMAL_Z, k], patch[C_Y, k]
        if system.support.elastic:  # a rail that gives way is in series
            cross /= 1.0 + across * (c * c * work.compliance[0] + s * s * work.compliance[1])
        row = work.contact_jacobian[system.contact.body[work.patch_index[k, 0]]]
        direction = c, -s, -c * patch[C_Z, k] - s * cy
        row[J_SECANT_C_Y] += secant * cy
        add_scaled(row, J_CROSS, cross, direction)
        add_scaled(row, J_CROSS_YAW, cross * cy, direction)


@compiled(python=False)
def store_patch_stiffness(system, work, w, n, k, sign, p, vertical):
    """Store how the `vertical` force of patch `n` of wheelset `w` changes with motions.

    `k`: where the patch begins in `work.look_up`; `sign`: of the side; `p`: penetration [m].
    The stiffness K of the patch changes along the profile, by the gradients of the table; they lead
    astray deep in a rail and beyond the table.
    """
    patch, t, root = work.patch, work.look_up, sqrt(p)
    stiffness = root * (1.5 * t[k + 1] + 2.0 * root * t[k + 2])
    patch[NORMAL_STIFFNESS, n] = stiffness / (patch[ANGLE_COS, n] * patch[ANGLE_COS, n])
    if not system.support.elastic:
        return
    part = min(1.0, max(0.0, 2.0 - vertical / (GRADIENT_LOAD * system.contact.load[w])))
    along_y, along_roll = stiffness * t[k + G_Y], stiffness * t[k + G_ROLL]
    K_y = part * p * root * (t[k + K_Y] + root * t[k + K2_Y])
    K_roll = part * p * root * (t[k + K_ROLL] + root * t[k + K2_ROLL])
    limit_y = VERTICAL_SHARE * stiffness + MOTION_SHARE * abs(along_y)
    limit_roll = VERTICAL_SHARE * stiffness + MOTION_SHARE * abs(along_roll)
    patch[FORCE_PER_Y, n] = sign * (max(-limit_y, min(limit_y, K_y)) - along_y)
    patch[FORCE_PER_Z, n] = stiffness
    patch[FORCE_PER_ROLL, n] = sign * (max(-limit_roll, min(limit_roll, K_roll)) - along_roll)
    patch[GEOMETRIC_STIFFNESS, n] = -part * vertical * t[k + G_YY]


@compiled(python=False)
def couple_patch_stiffness(work, coupling, table, begin, n):
    """Forces per motion of patches `begin` to `n` of a wheel, which load each other's surface.

    With the approaches of `couple_approaches`, N_i changes by n_i k_i = dN_i/de_i times the motion
    less that part of it by which the neighbours' forces bend the surface: dN_i = k_i (n_i d - sum_j
    kappa_ij dN_j).  The flange root has two neighbours, each of these only the root.
    """
    patch, index = work.patch, work.patch_index
    for i in range(begin, n):
        if index[i, 2] % N_PATCH != FLANGE_ROOT:
            continue
        a = b = 0.0
        if i > begin and index[i - 1, 2] == index[i, 2] - 1:
            a = coupling[table, 0]
        if i + 1 < n and index[i + 1, 2] == index[i, 2] + 1:
            b = coupling[table, 1]
        before, after = max(i - 1, 0), min(i + 1, n - 1)
        k = patch[FORCE_PER_Z, i]
        k_a, k_b = a * patch[FORCE_PER_Z, before], b * patch[FORCE_PER_Z, after]
        pivot = max(1.0 - k * (a * k_a + b * k_b), 0.1)
        for row in (FORCE_PER_Y, FORCE_PER_Z, FORCE_PER_ROLL):
            slope = (patch[row, i] - k * (a * patch[row, before] + b * patch[row, after])) / pivot
            patch[row, i] = slope
            if a > 0.0:
                patch[row, before] -= k_a * slope
            if b > 0.0:
                patch[row, after] -= k_b * slope


@compiled(python=False)
def add_rail_slopes(work, w, side, k, across, shear):
    """Add patch `k` to the derivatives of the forces on a rail.

    By a motion of the wheel in y, z and roll its vertical force V changes by the rows `FORCE_PER_Y`
    to `FORCE_PER_ROLL`, and Y = V tan g + T_y cos g and Q = V - T_y sin g with it, the creep force
    being nearly proportional to N; by d, N changes by c_N n d'; T_y by the slope of the creep law,
    `across`, times t d'.  A wheelset that is yawed by psi against its rail slips along the inclined
    patch, v psi/cos g: its rolling circle moves across the rail, and the point of contact
    runs ahead and along the flange.

    Along y the angle of contact g turns, V d(tan g)/dy.  On the tread the creep force from spin,
    proportional to sin g, takes nearly all of that back, on a sliding flange nothing: |sin g| of it
    counts.  `shear`: lever of roll in the table's lateral coordinate [m].
    """
    patch = work.patch
    s, c = patch[ANGLE_SIN, k], patch[ANGLE_COS, k]
    cy, cz = patch[FOOT_Y, k], patch[FOOT_Z, k]
    share = patch[T_Y, k] / patch[NORMAL, k]
    f_y, f_z = s + share * c, c - share * s
    per_motion = patch[FORCE_PER_Y, k], patch[FORCE_PER_Z, k], patch[FORCE_PER_ROLL, k]
    stiffness, damping = patch[NORMAL_STIFFNESS, k], patch[NORMAL_DAMPING, k]
    arm = -c * cz - s * cy  # of the tangent about the wheelset's centre
    contact, normal = work.support[w, side], (s, c, c * cy - s * cz)
    add_scaled(contact, K, f_y / c, per_motion)
    add_scaled(contact, K + 3, f_z / c, per_motion)
    geometric = abs(s) * patch[GEOMETRIC_STIFFNESS, k]
    contact[K] += geometric
    contact[K + 2] -= shear * geometric
    add_scaled(contact, D, damping * f_y, normal)
    add_scaled(contact, D + 3, damping * f_z, normal)
    add_scaled(contact, D, across * c, (c, -s, arm))
    add_scaled(contact, D + 3, -across * s, (c, -s, arm))
    contact[D_Y_SLIP] += across
    contact[D_Z_SLIP] -= across * s / c
    contact[FOOT_Y_STIFFNESS] += stiffness * cy
    contact[FOOT_Z_STIFFNESS] += stiffness * cz
    contact[STIFFNESS] += stiffness


@compiled(python=False)
def add_wheelset_damping(work, b, k, across, damping):
    """Add the damping of the wheelset's speeds in y, z and roll by patch `k`.

    Across, -T_y t with the slope `across` of the creep law; along the normal, -(N n + T_y t) with
    the contact `damping`, the creep force being nearly proportional to N.
    """
    row, patch = work.contact_jacobian[b], work.patch
    s, c = patch[NORMAL_Y, k], patch[NORMAL_Z, k]
    cy, cz = patch[C_Y, k], patch[C_Z, k]
    arm = -c * cz - s * cy
    lever = c * cy - s * cz
    row[J_SLIP] += across * c * c
    row[J_SLIP + 1] -= across * c * s
    row[J_SLIP + 2] += across * c * arm
    row[J_SLIP + 3] += across * s * s
    row[J_SLIP + 4] -= across * s * arm
    row[J_SLIP + 5] += across * arm * arm
    share = patch[T_Y, k] / patch[NORMAL, k]
    normal = s, c, lever
    add_scaled(row, J_NORMAL, damping * (s + share * c), normal)
    add_scaled(row, J_NORMAL + 3, damping * (c - share * s), normal)
    add_scaled(row, J_NORMAL + 6, damping * (lever + share * arm), normal)
