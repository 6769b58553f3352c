"""Rails, sleepers and slopes of contact forces by themselves, not compiled, against matrices."""

from types import SimpleNamespace as Record

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.optimize import approx_fprime

from railsim.kernels import (
    contact_damping,
    rails,
    rotation,
    slope_adaptation,
    support,
    support_step,
    track_frame,
    transient,
    wheel_rail,
)
from railsim.kernels.contact_columns import (
    ANGLE_COS,
    ANGLE_SIN,
    BEYOND,
    C11,
    C22,
    C_X,
    C_Y,
    C_Z,
    CONTACT_JACOBIAN,
    FORCE_PER_ROLL,
    FORCE_PER_Y,
    FORCE_PER_Z,
    J_CROSS,
    J_NORMAL,
    J_SLIP,
    M_Z,
    NORMAL,
    NORMAL_STIFFNESS,
    NORMAL_Y,
    NORMAL_Z,
    PATCH_ROWS,
    PATCH_SPEED,
    PHI,
    SECANT_ALONG,
    SLOPE_ACROSS,
    SLOPE_ALONG,
    T_X,
    T_Y,
    TANGENT_Y,
    TANGENT_Z,
    W_C_Y,
    W_C_Z,
    W_NORMAL,
    W_PHI,
    W_Q,
    W_T_GAMMA,
    W_T_GAMMA_SPIN,
    W_XI_X,
    W_XI_Y,
    W_Y,
    WHEEL_COLUMNS,
    XI_X,
    XI_Y,
    A,
)
from railsim.kernels.contact_table import G_ROLL, G_Y, K2_ROLL, K2_Y, K_ROLL, K_Y, LOOK_UP_SIZE
from railsim.kernels.lanes import LANES
from railsim.kernels.rails import (
    CHANGE_ROLL,
    CHANGE_Y,
    CHANGE_Z,
    COSINE,
    PLANE_SIZE,
    RAIL_SIZE,
    RATE_CHANGE_SIZE,
    SINE,
)
from railsim.kernels.slope_adaptation import LMS_SIZE
from railsim.kernels.state import ARC_LENGTH, LAST_STEP, SPEED, smoothed_begin
from railsim.kernels.support import (
    ACCELERATION,
    BALLAST,
    C_BALLAST_ROLL,
    C_BALLAST_Y,
    C_BALLAST_Z,
    C_PAD_Y,
    C_PAD_Z,
    D_Y_SLIP,
    D_Z_SLIP,
    DOF,
    ERROR_Y,
    ERROR_Z,
    F_Y,
    F_Z,
    FOOT_Y_STIFFNESS,
    FOOT_Z_STIFFNESS,
    HALF_BASE,
    I_SLEEPER,
    K_BALLAST_ROLL,
    K_BALLAST_Y,
    K_BALLAST_Z,
    K_PAD_Y,
    K_PAD_Z,
    L_MOTION,
    L_PATCHES,
    L_Y_Y,
    L_Z_Y,
    LMS,
    M_RAIL,
    M_SLEEPER,
    MEAN_CHANGE,
    MEAN_RATE,
    PADS,
    PATCHES,
    PENDING,
    RATE,
    SKIP,
    STEP_RATIO,
    STIFFNESS,
    SUPPORT_COLUMNS,
    SUPPORT_ROW,
    SUPPORT_SIZE,
    SUPPORT_STEP,
    URGENT,
)
from railsim.kernels.system import ALL_WHEELS, HORIZON, N_EVENTS, N_STEPPING, RATES_SIZE
from railsim.kernels.track_frame import TrackTables

SIDES = np.array([-1.0, 1.0])


def matrices(row, pads, ballast):
    """Mass, damping and stiffness of left rail (y, z), right rail and sleeper (y, z, roll).

    A pad is deflected by how far its rail moves from the end of the sleeper, y and z + base roll.
    """
    deflected = np.zeros((4, 7))
    for k, side in enumerate(SIDES):
        deflected[2 * k, [2 * k, 4]] = 1.0, -1.0
        deflected[2 * k + 1, [2 * k + 1, 5, 6]] = 1.0, -1.0, -side * row[HALF_BASE]
    found = [np.diag(row[[M_RAIL] * 4 + [M_SLEEPER] * 2 + [I_SLEEPER]])]
    for pad, below in (
        ([C_PAD_Y, C_PAD_Z], [C_BALLAST_Y, C_BALLAST_Z, C_BALLAST_ROLL]),
        ([K_PAD_Y, K_PAD_Z], [K_BALLAST_Y, K_BALLAST_Z, K_BALLAST_ROLL]),
    ):
        under = np.zeros((7, 7))
        under[4:, 4:] = ballast * np.diag(row[below])
        found.append(deflected.T @ np.diag(pads * np.tile(row[pad], 2)) @ deflected + under)
    return found


def in_lanes(motion):
    """Motions of four tracks, shape (4, 7), as kernels take them: wheel by wheel."""
    return [motion[:, :4].reshape(-1, 2)[:, k] for k in (0, 1)] + [
        np.repeat(motion[:, 4 + k], 2) for k in (0, 1, 2)
    ]


def test_forces_of_tracks_and_their_implicit_motion_are_those_of_matrices(plain):
    """Four tracks of other pads and ballast; wheels are in contact with their rails."""
    random = np.random.default_rng(3)
    given = Record(row=random.uniform(0.5, 2.0, SUPPORT_ROW), sleeper=1)
    factors = random.uniform(0.5, 2.0, (4, 2))
    own = [matrices(given.row, *pair) for pair in factors]
    u, rate, load = random.normal(size=(3, 4, 7))
    contact = random.uniform(0.1, 0.4, (2, 6, LANES))
    plain(support)
    in_pairs = np.repeat(factors.T, 2, axis=1)
    found = support.track_forces(given, in_pairs, in_lanes(u), in_lanes(rate), -0.7)
    expected = [-0.7 * C @ v - K @ x for (_, C, K), v, x in zip(own, rate, u, strict=True)]
    np.testing.assert_allclose(found, in_lanes(np.array(expected)), rtol=1e-12, atol=1e-12)
    m, c, k = 1.7, 0.6, 0.9
    found = support.solve_track(given, in_pairs, *contact, in_lanes(load), m, c, k)
    for w, (M, C, K) in enumerate(own):
        for side in range(2):
            here = slice(2 * side, 2 * side + 2)
            stiff, damped = contact[:, [0, 1, 3, 4], 2 * w + side].reshape(2, 2, 2)
            K[here, here] += stiff
            C[here, here] += damped
        load[w] = np.linalg.solve(m * M + c * C + k * K, load[w])
    np.testing.assert_allclose(found, in_lanes(load), rtol=1e-10)
    weights = support.inertia(given.row, in_lanes(u))
    expected = np.array([M @ x for (M, _, _), x in zip(own, u, strict=True)])
    np.testing.assert_allclose(weights, in_lanes(expected))
    masses = [support.mass_of(given.row, k) for k in range(DOF)]
    assert masses == pytest.approx(np.diag(own[0][0]))


def test_stiffness_of_the_track_is_that_where_each_wheelset_stands(plain):
    """Factors of pads and ballast, linear between their rows; the frames are apart."""
    variation = np.array([[0.0, 1.0, 2.0], [4.0, 3.0, 0.5], [10.0, 0.8, 1.4]])
    system = Record(support=Record(variation=variation), frame_offset=[0.0, -2.5, 1.0])
    system.bodies, system.contact = Record(frame=[0, 2, 1]), Record(body=[1, 2])
    work = Record(support_step=np.full((2, SUPPORT_STEP), 7.0))
    plain(support)
    support.update_factors(system, work, 6.0)
    for w, s in enumerate((7.0, 3.5)):
        found = work.support_step[w, [PADS, BALLAST, PENDING, SKIP]]
        expected = [np.interp(s, variation[:, 0], variation[:, k]) for k in (1, 2)]
        assert found == pytest.approx([*expected, 0.0, 0.0])


def creep_force(xi, G, a, b, mu_N, c11, c22, c23, phi):
    """Linear force with spin, saturated by the cubic of Vermeulen and Johnson (1964)."""
    linear = np.array([c11 * xi[0], c22 * xi[1] + np.sqrt(a * b) * c23 * phi]) * G * a * b
    u = np.linalg.norm(linear) / mu_N
    return linear / u * (1.0 - (1.0 - min(u, 3.0) / 3.0) ** 3)


def test_slopes_of_the_creep_force_are_its_derivatives(plain):
    """Over the slip along and across; eight patches of other loads, one of which slides.

    At walking pace also over the slip in the other direction, the mean of both.
    """
    random, G, speed = np.random.default_rng(5), 8e10, 20.0
    a, b = random.uniform(2e-3, 6e-3, (2, LANES))
    c11, c22, c23 = random.uniform([[4.0], [3.0], [1.0]], [[5.0], [4.0], [2.0]], (3, LANES))
    mu_N = random.uniform(1e4, 3e4, LANES)
    xi, phi = 1e-3 * random.normal(size=(2, LANES)), 0.1 * random.normal(size=LANES)
    xi[0, -1] = 0.1
    patches = Record(
        a=a, b=b, mu_N=mu_N, c11=c11, c22=c22, c23=c23, xi_x=xi[0], xi_y=xi[1], phi=phi
    )
    found = np.zeros((3, LANES))
    plain(contact_damping)
    contact_damping.estimate_creep_slopes(LANES, patches, speed, G, *found)
    for k in range(LANES):
        given = G, a[k], b[k], mu_N[k], c11[k], c22[k], c23[k], phi[k]
        slopes = approx_fprime(xi[:, k], lambda x, g=given: creep_force(x, *g), 1e-9)
        secant = creep_force(xi[:, k], *given)[0] / xi[0, k]
        assert speed * found[:, k] == pytest.approx([*np.diag(slopes), secant], rel=1e-4, abs=1.0)
        work = Record(patch=np.zeros((PATCH_ROWS, 1)), patch_index=np.zeros((1, 1), int))
        work.patch[[SLOPE_ALONG, SLOPE_ACROSS, SECANT_ALONG], 0] = found[:, k]
        work.patch[[C11, C22, NORMAL_Z], 0] = c11[k], c22[k], 1.0
        work.patch[[T_X, T_Y], 0] = creep_force(xi[:, k], *given)
        work.contact_jacobian = np.zeros((1, CONTACT_JACOBIAN))
        system = Record(support=Record(elastic=0), contact=Record(body=[0]))
        contact_damping.add_slip_coupling(system, work, 1)
        cross = speed * work.contact_jacobian[0, J_CROSS]
        mean = np.sqrt(slopes[0, 1] * slopes[1, 0])
        assert cross == pytest.approx(np.copysign(mean, slopes[0, 1]), rel=2e-3, abs=0.02 * secant)


def test_slopes_of_followed_creepages_are_those_of_what_the_step_takes_up(plain):
    """dc/dxi of the followed creepage c is what a step leaves of the creep force's slopes."""
    system = Record(
        bodies=Record(kind=np.zeros(1)),
        internal=Record(kind=np.zeros(0)),
        support=Record(elastic=0),
    )
    random = np.random.default_rng(8)
    for module in (support, transient):
        plain(module)
    first = transient.transient_begin(system)
    state = random.normal(size=first + transient.TRANSIENT_SIZE)
    state[LAST_STEP] = 1.5e-3
    index = np.array([[0, 0, 1], [0, 1, 0]])
    for _, side, p in index:
        state[first + transient.PATCH_STATE * (transient.TRACED * side + p) + transient.LOADED] = (
            transient.CARRYING
        )
    given = random.uniform(0.5, 2.0, (PATCH_ROWS, 2))
    given[A], given[PATCH_SPEED] = [4e-3, 9e-3], [20.0, 8.0]
    shape = 1, 2, transient.TRACED, transient.TRANSIENT
    work = Record(patch_index=index, transient=np.zeros(shape))

    def followed(change):
        work.patch = given.copy()
        work.patch[XI_X] += change
        transient.delay_creepages(system, work, 2, state)
        return work.patch[XI_X].copy()

    before = followed(0.0)
    slope = followed(1.0) - before
    transient.restore_creepages(system, work, 2, state)
    rows = [SLOPE_ALONG, SLOPE_ACROSS, SECANT_ALONG]
    np.testing.assert_allclose(work.patch[rows], given[rows] * slope, rtol=1e-10)
    z = 1.5e-3 * given[PATCH_SPEED] / given[A]
    assert slope == pytest.approx(1.0 - (1.0 - np.exp(-z)) / z)
    assert work.patch[XI_X] == pytest.approx(given[XI_X] + 1.0)


@pytest.mark.parametrize("touching", [(0, 1, 2), (0, 1), (1, 2), (0, 2), (1,)])
def test_patches_that_load_each_other_share_a_motion_as_their_equations_say(touching):
    """dN_i = k_i (n_i d - sum_j kappa_ij dN_j) of neighbours, along y, z and roll."""
    random, n = np.random.default_rng(17), len(touching)
    kappa = np.array([[0.0, 0.3, 0.0], [0.3, 0.0, 0.2], [0.0, 0.2, 0.0]])
    k, normal = random.uniform(0.5, 1.5, 3), random.normal(size=(3, 3))
    normal[1] = 1.0  # along z
    patch = np.zeros((PATCH_ROWS, n + 2))
    rows = [FORCE_PER_Y, FORCE_PER_Z, FORCE_PER_ROLL]
    of = list(touching)
    patch[rows, 1:-1] = (k * normal)[:, of]
    index = np.zeros((n + 2, 3), dtype=np.int64)
    index[:, 2] = [2, *touching, 0]  # of other wheels before and after
    work = Record(patch=patch, patch_index=index)
    contact_damping.couple_patch_stiffness.py_func(
        work, np.array([[9.0, 9.0], [0.3, 0.2]]), 1, 1, n + 1
    )
    matrix = np.eye(n) + k[of, None] * kappa[np.ix_(of, of)]
    np.testing.assert_allclose(patch[rows, 1:-1].T, np.linalg.solve(matrix, (k * normal)[:, of].T))
    assert not patch[:, [0, -1]].any()


def test_stiffness_of_a_patch_is_how_its_force_changes_with_the_motion_of_the_wheel(plain):
    """Of V = p^1.5 (K + sqrt(p) K_2) over y, z and roll; of N = V/cos g along the normal, p cos g.

    p is z less the gap, of which G_Y, G_ROLL are the slopes as K_Y, K_ROLL are those of K; y and
    roll count from the left rail as if mirrored.
    """
    t, patch, g, k = np.zeros(2 * LOOK_UP_SIZE), np.zeros((PATCH_ROWS, 3)), 0.7, LOOK_UP_SIZE
    t[[k, k + 1, k + 2]] = -1e-4, 1e11, 3e12
    t[[k + G_Y, k + G_ROLL]] = -0.84, 0.21
    t[[k + K_Y, k + K_ROLL, k + K2_Y, k + K2_ROLL]] = 4e12, -3e12, 2e14, 1e14
    work = Record(patch=patch, look_up=t)
    system = Record(support=Record(elastic=1), contact=Record(load=[50e3]))
    patch[ANGLE_COS, 2] = np.cos(g)
    plain(contact_damping)

    def vertical(x, sign):
        y, z, roll = x
        p = z - t[k] - sign * (y * t[k + G_Y] + roll * t[k + G_ROLL])
        K, K2 = t[[k + 1, k + 2]] + sign * (
            y * t[[k + K_Y, k + K2_Y]] + roll * t[[k + K_ROLL, k + K2_ROLL]]
        )
        return p**1.5 * (K + np.sqrt(p) * K2)

    for sign in (-1.0, 1.0):
        V = vertical(np.zeros(3), sign)
        contact_damping.store_patch_stiffness(system, work, 0, 2, k, sign, 1e-4, V)
        slopes = approx_fprime(np.zeros(3), lambda x, sign=sign: vertical(x, sign), 1e-11)
        assert patch[[FORCE_PER_Y, FORCE_PER_Z, FORCE_PER_ROLL], 2] == pytest.approx(slopes, 1e-4)
        assert patch[NORMAL_STIFFNESS, 2] == pytest.approx(slopes[1] / np.cos(g) ** 2, 1e-4)


def test_a_patch_takes_its_slip_and_its_approach_from_the_wheelsets_speeds(plain):
    """Forces on the wheelset in y, z and roll: -across (t v) t and -c (n v) (n + T_y/N t)."""
    random, across, damping, g = np.random.default_rng(18), 3.0, 2.0, 0.7
    patch, jacobian = random.uniform(0.5, 2.0, (PATCH_ROWS, 3)), np.zeros((2, CONTACT_JACOBIAN))
    patch[[NORMAL_Y, NORMAL_Z], 2] = np.sin(g), np.cos(g)
    place = np.array([0.0, *patch[[C_Y, C_Z], 2]])
    n, t = np.array([0.0, np.sin(g), np.cos(g)]), np.array([0.0, np.cos(g), -np.sin(g)])
    share = patch[T_Y, 2] / patch[NORMAL, 2]
    plain(contact_damping)
    contact_damping.add_wheelset_damping(
        Record(patch=patch, contact_jacobian=jacobian), 1, 2, across, damping
    )
    slip, normal = np.zeros((2, 3, 3))
    for k, motion in enumerate(
        ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0], np.cross([1.0, 0.0, 0.0], place))
    ):
        force_t, force_n = across * (t @ motion) * t, damping * (n @ motion) * (n + share * t)
        for found, force in ((slip, force_t), (normal, force_n)):
            found[:, k] = *force[1:], np.cross(place, force)[0]
    assert jacobian[1, J_SLIP : J_SLIP + 6] == pytest.approx(slip[np.triu_indices(3)])
    np.testing.assert_allclose(jacobian[1, J_NORMAL : J_NORMAL + 9].reshape(3, 3), normal)


def test_a_track_that_is_corrected_is_as_if_its_step_had_had_the_corrected_mean_rate(plain):
    """Way h r, rate c r, its change c/h r and acceleration c^2/h r of a mean rate r, c = 1 + g."""
    random, h, g = np.random.default_rng(23), 2e-3, 0.4
    system = Record(
        bodies=Record(kind=np.zeros(1)), internal=Record(kind=np.zeros(0)),
        contact=Record(transient=0, body=np.zeros(2)),
        support=Record(row=random.uniform(0.5, 2.0, SUPPORT_ROW), sleeper=1),
    )  # fmt: skip
    for module in (support, slope_adaptation, support_step):
        plain(module)
    begin = support.support_begin(system)
    state = random.normal(size=begin + 2 * SUPPORT_SIZE)
    tracks = state[begin:].reshape(2, SUPPORT_SIZE)
    tracks[:, STEP_RATIO], tracks[:, LMS : LMS + 2 * LMS_SIZE] = g, 0.0
    before = tracks.copy()
    work = Record(
        support=random.uniform(0.1, 0.4, (2, 2, SUPPORT_COLUMNS)),
        support_step=random.uniform(0.5, 2.0, (2, SUPPORT_STEP)),
    )
    work.support_step[:, URGENT] = 1.0, 0.0
    support_step.correct_rails(system, work, state, support_step.paired_numbers(0, 2), h, True)
    change = tracks - before
    r = change[0, MEAN_RATE : MEAN_RATE + DOF].copy()
    assert np.all(r != 0.0)
    c = 1.0 + g
    for first, factor in ((0, h), (RATE, c), (MEAN_CHANGE, c / h), (ACCELERATION, c * c / h)):
        assert change[0, first : first + DOF] == pytest.approx(factor * r, abs=1e-12)
        assert not change[1, first : first + DOF].any()  # this one's forces are balanced


def test_a_correction_that_has_waited_is_that_of_the_step_before(plain):
    """Of its length and weight; the track goes on by h r, its rate (1 + g) r - g times the last."""
    random, h, last, before = np.random.default_rng(24), 2e-3, 3e-3, 0.3
    system = Record(
        bodies=Record(kind=np.zeros(1)), internal=Record(kind=np.zeros(0)),
        contact=Record(transient=0, body=np.zeros(2)),
        support=Record(row=random.uniform(0.5, 2.0, SUPPORT_ROW), sleeper=1, massless=0),
    )  # fmt: skip
    for module in (support, support_step):
        plain(module)
    begin = support.support_begin(system)
    state = random.normal(size=begin + 2 * SUPPORT_SIZE)
    work = Record(
        support=random.uniform(0.1, 0.4, (2, 2, SUPPORT_COLUMNS)),
        support_step=random.uniform(0.5, 2.0, (2, SUPPORT_STEP)),
    )
    state[begin:].reshape(2, SUPPORT_SIZE)[:, STEP_RATIO] = before
    learnt = [begin + SUPPORT_SIZE * w + LMS + LMS_SIZE * k for w in (0, 1) for k in (0, 1)]
    wheels, change = support_step.paired_numbers(0, 2), random.normal(size=(7, LANES))
    change[:, 4:] = np.tile(change[:, 2:4], 2)

    def stepped(given, waits):
        after = given.copy()
        work.support_step[:, PENDING] = waits
        support_step.step_tracks(
            system, work, after, wheels, learnt + 2 * learnt[2:], change, h, last
        )
        return after[begin:].reshape(2, SUPPORT_SIZE)

    corrected, c = state.copy(), 1.0 + before
    moved = corrected[begin:].reshape(2, SUPPORT_SIZE)
    r = work.support_step[:, :DOF]
    for first, factor in ((0, last), (RATE, c), (MEAN_RATE, 1.0), (MEAN_CHANGE, c / last)):
        moved[:, first : first + DOF] += factor * r
    found = stepped(state, 1.0)
    np.testing.assert_allclose(found, stepped(corrected, 0.0), rtol=1e-9, atol=1e-9)
    u, rate, mean, slower = (moved[:, k : k + DOF] for k in (0, RATE, MEAN_RATE, MEAN_CHANGE))
    g, r = h / (h + last), found[:, MEAN_RATE : MEAN_RATE + DOF]
    after = (1.0 + g) * r - g * mean
    for first, expected in (
        (0, u + h * r),
        (RATE, after),
        (MEAN_CHANGE, (after - rate) / h),
        (ACCELERATION, (1.0 + g) * (after - rate) / h - g * slower),
    ):
        np.testing.assert_allclose(found[:, first : first + DOF], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("sleeper", [0, 1])
def test_rails_without_mass_yield_to_a_force_as_their_matrices_say(sleeper, plain):
    """(c M/h + C + h K/c) u' = F of equal forces on both rails; with a mass on rigid ground too."""
    row, h, c = np.random.default_rng(25).uniform(0.5, 2.0, SUPPORT_ROW), 0.1, 1.3
    system = Record(
        bodies=Record(kind=np.zeros(1)), internal=Record(kind=np.zeros(0)),
        contact=Record(transient=0, body=np.zeros(1)), support=Record(row=row, sleeper=sleeper),
    )  # fmt: skip
    plain(support)
    begin = support.support_begin(system)
    work, state = Record(compliance=np.zeros(3)), np.zeros(begin + SUPPORT_SIZE)
    state[begin + STEP_RATIO], state[LAST_STEP] = c - 1.0, h
    row[M_RAIL] *= 1 - sleeper
    support.set_compliance(system, work, state)
    M, C, K = (part[: 7 if sleeper else 4, : 7 if sleeper else 4] for part in matrices(row, 1, 1))
    force = np.zeros((len(M), 2))
    force[[0, 2], 0] = force[[1, 3], 1] = 1.0
    rate = np.linalg.solve(c / h * M + C + h / c * K, force)
    assert work.compliance == pytest.approx([rate[0, 0], rate[1, 1], h / c])


def test_rates_beside_the_rails_change_by_the_rails_slopes_and_the_acceleration(plain):
    """Until a time later: V (slope now less slope then) and h times the acceleration."""
    random, h, speed, now = np.random.default_rng(12), 5e-3, 20.0, 0.3
    c = 0.02 * random.normal(size=(1, 6, 4))
    plane, rail = np.zeros((1, PLANE_SIZE)), np.zeros((1, 2, RAIL_SIZE))
    for module in (rotation, track_frame, rails):
        plain(module)
    table = TrackTables(0.0, 1.0, c, c, 1, 1.5)
    rails.interpolate_rails(table, np.zeros(1, dtype=np.int64), np.array([now]), plane, rail)
    watch, state = np.zeros(N_STEPPING), random.normal(size=80)
    watch[HORIZON], state[SPEED], state[ARC_LENGTH] = h, speed, now - 0.1
    system = Record(
        track=table,
        bodies=Record(kind=np.zeros(2), frame=[0, 1]),
        frame_offset=[0.0, 0.1],
        contact=Record(body=[1]),
        internal=Record(kind=np.zeros(0)),
    )
    change = np.zeros((2, RATE_CHANGE_SIZE))
    work = Record(plane=plane, rail=rail, rate_change=change, stepping=watch)
    own = smoothed_begin(2, 0) + 6
    rails.predict_rate_changes(system, work, 0, state)
    y_a, z_a, roll_a = state[own + 1 : own + 4]
    for side in range(2):
        y, z = (Polynomial(c[0, 2 * side + k]).deriv() for k in (0, 1))
        assert change[side, [CHANGE_Y, CHANGE_Z, CHANGE_ROLL]] == pytest.approx(
            [
                speed * (y(now) - y(now + speed * h)) + h * y_a,
                speed * (z(now) - z(now + speed * h)) + h * z_a,
                h * roll_a,
            ]
        )


def test_forces_of_patches_on_their_wheels_and_what_is_told_of_them(plain):
    """In vectors, c x F; work per metre of way; creepages and place of the most loaded patch."""
    random, speed, angle, n = np.random.default_rng(29), 20.0, np.array([0.1, 0.9, -0.4]), 3
    patch = random.normal(size=(PATCH_ROWS, n))
    patch[[ANGLE_SIN, ANGLE_COS]] = np.sin(angle), np.cos(angle)
    patch[[NORMAL_Y, NORMAL_Z]] = np.sin(angle + 0.05), np.cos(angle + 0.05)
    patch[NORMAL], patch[PATCH_SPEED], patch[BEYOND] = [7e4, 2e4, 5e4], [21.0, 17.0, 19.0], 0.0
    system = Record(contact=Record(body=[1]), support=Record(elastic=0))
    work = Record(
        patch=patch, patch_index=np.array([[0, 1, 0], [0, 1, 2], [0, 0, 0]]),
        rail_force=np.zeros((2, 6)), wheel=np.zeros((1, 2, WHEEL_COLUMNS)),
        stepping=np.zeros(N_STEPPING), events=np.zeros((1, N_EVENTS), dtype=np.int64),
        contact_jacobian=np.zeros((2, CONTACT_JACOBIAN)),
    )  # fmt: skip
    for module in (contact_damping, wheel_rail):
        plain(module)
    wheel_rail.add_creep_forces(system, work, n, speed, np.zeros(20))
    force, told = np.zeros(6), np.zeros((2, 4))
    for k, side in enumerate((1, 1, 0)):
        s, c = patch[[NORMAL_Y, NORMAL_Z], k]
        along = np.array([1.0, *patch[[TANGENT_Y, TANGENT_Z], k]])
        normal, across = np.array([0.0, s, c]), np.array([0.0, c, -s])
        normal[0], across[0] = -along @ normal, -along @ across
        acts = -patch[T_X, k] * along - patch[T_Y, k] * across
        force[:3] += acts
        force[3:] += np.cross(patch[[C_X, C_Y, C_Z], k], acts) - patch[M_Z, k] * normal
        slip = patch[PATCH_SPEED, k] / speed * patch[[XI_X, XI_Y, PHI], k]
        told[side] += [
            *patch[T_Y, k] * np.array([-np.sin(angle[k]), np.cos(angle[k])]),
            patch[[T_X, T_Y], k] @ slip[:2], patch[M_Z, k] * slip[2],
        ]  # fmt: skip
    np.testing.assert_allclose(work.rail_force[1], force)
    np.testing.assert_allclose(work.wheel[0][:, [W_Q, W_Y, W_T_GAMMA, W_T_GAMMA_SPIN]], told)
    for side, k in ((0, 2), (1, 0)):
        slip = patch[PATCH_SPEED, k] / speed * patch[[XI_X, XI_Y, PHI], k]
        found = work.wheel[0, side, [W_NORMAL, W_XI_X, W_XI_Y, W_PHI, W_C_Y, W_C_Z]]
        assert found == pytest.approx([patch[NORMAL, k], *slip, *patch[[C_Y, C_Z], k]])


def tracks_under_two_wheelsets(seed, plain, **about):
    """System, work arrays and state of two wheelsets' tracks, at random; nothing waits."""
    random = np.random.default_rng(seed)
    support_row = random.uniform(0.5, 2.0, SUPPORT_ROW)
    system = Record(
        bodies=Record(kind=np.zeros(3)), internal=Record(kind=np.zeros(0)),
        contact=Record(transient=0, body=np.array([2, 0]), load=np.array([2.0, 3.0])),
        support=Record(row=support_row, **{"sleeper": 1, "massless": 0, "elastic": 1} | about),
    )  # fmt: skip
    for module in (support, slope_adaptation, support_step):
        plain(module)
    begin = support.support_begin(system)
    work = Record(
        support=random.uniform(0.1, 0.4, (2, 2, SUPPORT_COLUMNS)),
        support_step=random.uniform(0.5, 2.0, (2, SUPPORT_STEP)),
        wheel=random.normal(size=(2, 2, WHEEL_COLUMNS)), plane=random.normal(size=(2, PLANE_SIZE)),
        rail_force=random.normal(size=(3, RATES_SIZE)), counts=np.zeros(8, int),
        rail_motion=np.zeros((2, 2, 4)),
    )  # fmt: skip
    state = random.normal(size=begin + 2 * SUPPORT_SIZE)
    return system, work, state, state[begin:].reshape(2, SUPPORT_SIZE)


def test_forces_that_rails_will_have_are_linear_in_how_they_yield(plain):
    """The rails of the first wheelset wait for the step: Y, Q and the wheelset's forces change.

    A wheel in the air has no slopes and no place where its forces act.
    """
    system, work, state, tracks = tracks_under_two_wheelsets(31, plain)
    h, g, K, D = 2e-2, 0.4, support.K, support.D
    tracks[:, STEP_RATIO] = g
    work.support[0, 1, [*range(K, K + 6), *range(D, D + 6), STIFFNESS]] = 0.0
    load, factors = work.support_step[:, :DOF].copy(), work.support_step[0, [PADS, BALLAST]]
    before = [array.copy() for array in (work.support, work.wheel, work.rail_force)]
    wheels, waits = support_step.paired_numbers(0, 2), np.array([1.0, 1, 0, 0] * 2)
    with np.errstate(invalid="ignore"):  # 0/0 of the wheel in the air
        support_step.extrapolate_forces(system, work, state, wheels, waits, h)
    mass, damping, stiffness = matrices(system.support.row, *factors)
    contact = before[0][0, 0]
    own = contact[[[K, K + 1], [K + 3, K + 4]]], contact[[[D, D + 1], [D + 3, D + 4]]]
    stiffness[:2, :2] += own[0]
    damping[:2, :2] += own[1]
    c = 1.0 + g
    r = np.linalg.solve(c * c / h * mass + c * damping + h * stiffness, load[0])
    f = -(h * own[0] + c * own[1]) @ r[:2]
    forces, wheels, wheelsets = (
        now - then
        for now, then in zip((work.support, work.wheel, work.rail_force), before, strict=True)
    )
    assert forces[0, 0, [F_Y, F_Z]] == pytest.approx(f)
    assert wheels[0, 0, [W_Y, W_Q]] == pytest.approx(f)
    sine, cosine = work.plane[0, [SINE, COSINE]]
    foot = contact[[FOOT_Y_STIFFNESS, FOOT_Z_STIFFNESS]] / contact[STIFFNESS]
    across, up = np.array([[cosine, -sine], [sine, cosine]]) @ f
    moment = foot[0] * f[1] - foot[1] * f[0]
    assert wheelsets[2, 1:4] == pytest.approx([-across, -up, -moment])
    assert np.count_nonzero(wheelsets) == 3
    assert np.count_nonzero(forces) == np.count_nonzero(wheels) == 2


@pytest.mark.parametrize("massless", [0, 1])
@pytest.mark.parametrize(
    ("shares", "expected"),  # of the load: y and z, left and right; waits, rests, moves at once
    [
        ([0.0, 0.0, 1e-4, -1e-4], (0, 1, 0)),
        ([0.0, 0.0, 0.0, -3e-4], (1, 1, 0)),
        ([3e-4, 0.0, 0.0, 0.0], (1, 1, 0)),
        ([3e-3, 1e-2, 0.0, -1.9e-2], (1, 1, 0)),
        ([-5e-3, 0.0, 0.0, 0.0], (0, 0, 1)),
        ([0.0, 0.0, 3e-3, 2.1e-2], (0, 0, 1)),
    ],
)
def test_imbalances_wait_or_are_corrected_by_their_shares_of_the_load(
    shares, expected, massless, monkeypatch, plain
):
    """Half as much counts in half a step; nothing moves when no evaluation remains."""
    system, work, state, tracks = tracks_under_two_wheelsets(32, plain, massless=massless)
    tracks[:, ACCELERATION : ACCELERATION + DOF] = acceleration = np.arange(DOF) - 2.0
    inertia = matrices(system.support.row, 1.0, 1.0)[0] @ acceleration * (1 - massless)
    given = np.zeros((4, DOF))
    given[0, :4] = 0.5 * 2.0 * np.array(shares)
    monkeypatch.setattr(support_step, "imbalance", lambda *_: in_lanes(given + inertia))
    wheels = support_step.paired_numbers(0, 2)
    urgent = support_step.classify_imbalance(system, work, state, wheels, 0.5, 3)
    assert tuple(work.support_step[0, [PENDING, SKIP, URGENT]]) == expected
    assert tuple(work.support_step[1, [PENDING, SKIP, URGENT]]) == (0, 1, 0)
    assert urgent == expected[2]
    np.testing.assert_allclose(work.support_step[:, :DOF], given[:2], atol=1e-12)
    errors = work.support[:, :, [ERROR_Y, ERROR_Z]].reshape(2, 4)
    np.testing.assert_allclose(errors, given[:2, :4], atol=1e-12)
    work.counts[ALL_WHEELS] = 1  # the contacts of all are evaluated
    assert not support_step.classify_imbalance(system, work, state, wheels, 0.5, 0)
    waits = float(max(expected[0], expected[2]))
    assert tuple(work.support_step[0, [PENDING, SKIP, URGENT]]) == (waits, 0, 0)


def test_slopes_that_were_learnt_count_with_the_same_patches_alone(plain):
    """Forces on the rails are those of the wheels; what is not evaluated again keeps its slopes."""
    system, work, state, tracks = tracks_under_two_wheelsets(33, plain)
    learnt = tracks[:, LMS : LMS + 2 * LMS_SIZE].reshape(2, 2, LMS_SIZE)
    learnt[..., L_PATCHES] = work.support[..., PATCHES] = 3.0
    work.support[0, 1, PATCHES], work.support_step[:, SKIP] = 2.0, [0.0, 1.0]
    before = work.support.copy()
    support.add_lms_slopes(system, work, state)
    expected = before.copy()
    expected[..., [F_Y, F_Z]] = work.wheel[..., [W_Y, W_Q]]
    expected[0, 0, [support.K, support.K + 3]] += learnt[0, 0, [L_Y_Y, L_Z_Y]]
    np.testing.assert_allclose(work.support, expected)


@pytest.mark.parametrize("about", [{}, {"massless": 1}, {"sleeper": 0}, {"elastic": 0}])
def test_tracks_accelerate_by_what_is_left_of_their_forces(about, plain):
    """M u'' = F - C u' - K u; over 100 kg without masses; nothing of sleepers where none are."""
    system, work, state, tracks = tracks_under_two_wheelsets(34, plain, **about)
    derivative = np.zeros_like(state)
    support.set_support_rates(system, work, state, derivative)
    found = derivative[-2 * SUPPORT_SIZE :].reshape(2, SUPPORT_SIZE)
    kept = DOF if about.get("sleeper", 1) else 4
    if about.get("elastic", 1):
        for w, track in enumerate(tracks):
            M, C, K_ = matrices(system.support.row, *work.support_step[w, [PADS, BALLAST]])
            load = np.array([*work.support[w, :, [F_Y, F_Z]].T.ravel(), 0.0, 0.0, 0.0])
            u, rate = track[:DOF].copy(), track[RATE : RATE + DOF].copy()
            mass = 100.0 * np.ones(DOF) if about.get("massless") else np.diag(M)
            u[kept:] = rate[kept:] = 0.0
            assert found[w, :kept] == pytest.approx(rate[:kept])
            if kept == DOF:
                expected = (load - C @ rate - K_ @ u) / mass
                assert found[w, RATE : RATE + DOF] == pytest.approx(expected)
        support.set_rail_motions(system, work, state)
        at = [0, 1, RATE, RATE + 1]
        motion = [[track[at], track[np.array(at) + 2]] for track in tracks]
        np.testing.assert_array_equal(work.rail_motion, motion)
    assert not found[:, kept:DOF].any()
    assert not found[:, RATE + kept : RATE + DOF].any()
    assert about.get("elastic", 1) or not found.any()


@pytest.mark.parametrize("massless", [0, 1])
def test_a_step_of_the_tracks_balances_its_forces_where_it_ends(massless, plain):
    """M u'' + C u' + K u = F + K_c (dq - du) + D (dq' - du') + slip, by the state after it."""
    system, work, state, tracks = tracks_under_two_wheelsets(35, plain, massless=massless)
    system.support.row[[M_RAIL, M_SLEEPER, I_SLEEPER]] *= 1 - massless
    random, h, last = np.random.default_rng(36), 2e-2, 3e-2
    work.support_step[:, PENDING] = 0.0
    wheels, change = support_step.paired_numbers(0, 2), random.normal(size=(7, LANES))
    change[:, 4:] = np.tile(change[:, 2:4], 2)
    begin, before = support.support_begin(system), tracks.copy()
    lms = [begin + SUPPORT_SIZE * w + LMS + LMS_SIZE * k for w in (0, 1) for k in (0, 1)]
    support_step.step_tracks(system, work, state, wheels, lms + 2 * lms[2:], change, h, last)
    assert tracks[:, STEP_RATIO] == pytest.approx(h / (h + last))
    for w, (old, new) in enumerate(zip(before, tracks, strict=True)):
        M, C, K_ = matrices(system.support.row, *work.support_step[w, [PADS, BALLAST]])
        u, rate, acceleration = (new[k : k + DOF] for k in (0, RATE, ACCELERATION))
        moved, faster = u - old[:DOF], rate - old[RATE : RATE + DOF]
        load = np.zeros(DOF)
        for side in range(2):
            contact, at = work.support[w, side], [2 * side, 2 * side + 1]
            own = [contact[k : k + 6].reshape(2, 3) for k in (support.K, support.D)]
            y, z, roll, *rates, slip = change[:, 2 * w + side]
            load[at] = contact[[F_Y, F_Z]] + contact[[D_Y_SLIP, D_Z_SLIP]] * slip
            load[at] += own[0] @ [y - moved[at[0]], z - moved[at[1]], roll]
            load[at] += own[1] @ [rates[0] - faster[at[0]], rates[1] - faster[at[1]], rates[2]]
            learnt = new[LMS + LMS_SIZE * side + L_MOTION]
            assert learnt == pytest.approx(y - moved[at[0]])
        found = M @ acceleration + C @ rate + K_ @ u
        assert found == pytest.approx(load, abs=1e-9)
