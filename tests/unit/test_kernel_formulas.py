"""Formulas of the kernels by themselves, not compiled, against equations written anew."""

from math import cos, pi, sin
from types import SimpleNamespace as Record

import numpy as np
import pytest
from dynamics import rotation as turn
from scipy.integrate import trapezoid
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import approx_fprime
from scipy.signal import butter
from scipy.spatial.transform import Rotation

from railsim.kernels import (
    contact_damping,
    contact_table,
    controllers,
    creepages,
    driving,
    elastic_patch,
    elements,
    rail_parts,
    rhs,
    rotation,
    step_fast,
    vibration,
    wheel_contact,
    wheel_surface,
)
from railsim.kernels.contact_columns import (
    ANGLE_COS,
    ANGLE_SIN,
    B_E_Y,
    B_HEIGHT,
    BUMP_SIZE,
    C11,
    C22,
    C_X,
    C_Y,
    C_Z,
    CONTACT_JACOBIAN,
    FOOT_X,
    FOOT_X_PER_YAW,
    FOOT_Y,
    FOOT_Z,
    J_NORMAL,
    J_SECANT,
    J_SECANT_C_Z,
    J_SECANT_YAW,
    J_SLIP,
    NORMAL_Y,
    NORMAL_Z,
    PATCH_ROWS,
    PATCH_SPEED,
    PHI,
    RISE,
    SECANT_ALONG,
    SLOPE_ACROSS,
    SLOPE_ALONG,
    T_X,
    T_Y,
    TANGENT_Y,
    TANGENT_Z,
    XI_X,
    XI_Y,
)
from railsim.kernels.contact_table import (
    G_ROLL,
    G_Y,
    K2,
    K2_ROLL,
    K2_Y,
    K_ROLL,
    K_Y,
    LOOK_UP_SIZE,
    K,
)
from railsim.kernels.internal import PAD
from railsim.kernels.rails import (
    COSINE,
    MIDDLE_Y,
    MIDDLE_Z,
    MOTION_Y_RATE,
    MOTION_Z_RATE,
    RAIL_SLOPE,
    ROLL,
    ROLL_SLOPE,
    SHIFT,
    SINE,
    SLOPE_Z,
)
from railsim.kernels.state import ARC_LENGTH, SPEED, velocity_begin
from railsim.kernels.system import (
    COS_ROLL,
    FORCE,
    FREE,
    I_1,
    I_2,
    I_3,
    MASS,
    MOMENT,
    POSE_SIZE,
    RADIUS,
    SIN_ROLL,
    Y_0,
    Z_0,
)
from railsim.kernels.track_frame import ATTITUDE, FRAME_SIZE, OMEGA, PSI, TrackTables
from railsim.kernels.track_frame import PHI as CANT_ANGLE


@pytest.mark.parametrize("h", [1e-4, 1e-3, 8e-3])
def test_high_pass_of_the_wheel_loads_is_that_of_scipy(h):
    b0, a1, a2, fading = vibration.high_pass_coefficients.py_func(h)
    zeros, poles = butter(2, 40.0, "highpass", fs=1.0 / h)
    assert [b0, -2.0 * b0, b0] == pytest.approx(zeros, rel=1e-10)
    assert [1.0, a1, a2] == pytest.approx(poles, rel=1e-10)
    assert fading == pytest.approx(np.exp(-h / 0.1), rel=1e-12)


def test_angles_of_eight_lanes_are_those_of_numpy(plain):
    plain(rotation)
    for x in ([0.0, 1e-300, -1e-9, 1e-3, 0.02, -0.1, 0.12499, 0.125], np.linspace(-0.99, 0.99, 8)):
        x = np.array(x)
        np.testing.assert_allclose(rotation.arc_sine_lanes(x), np.arcsin(x), rtol=2e-15)
        sine, cosine = rotation.sine_cosine_lanes(x)
        np.testing.assert_allclose(sine, np.sin(x), rtol=2e-15)
        np.testing.assert_allclose(cosine, np.cos(x), rtol=2e-15)


def test_moment_of_a_bushing_is_the_gradient_of_its_potential(plain):
    """tr(K_d (1 - R_1^T R_2)) of large rotations; the damper takes the rate in body 1's axes."""
    random, stiffness = np.random.default_rng(14), np.array([3.0, 5.0, 11.0])
    R1, R2 = Rotation.random(2, random_state=3)
    omega_1, omega_2, damping = random.normal(size=(3, 3))

    def potential(turned):
        part = (R1 * Rotation.from_rotvec(turned)).as_matrix().T @ R2.as_matrix()
        return stiffness @ (1.0 - np.diag(part))

    plain(elements)
    axes = R1.as_matrix(), R2.as_matrix()
    angle, rate, moment = elements.rotation_moment(
        axes[0].ravel(), axes[1].ravel(), omega_1, omega_2, (stiffness, damping)
    )
    assert rate == pytest.approx(axes[0].T @ (omega_2 - omega_1))
    spring = -approx_fprime(np.zeros(3), potential)
    assert moment == pytest.approx(spring + damping * rate, abs=1e-6)
    assert angle == pytest.approx(np.sin((R1.inv() * R2).magnitude()) * direction(R1.inv() * R2))


@pytest.mark.parametrize("normal", [0.0, 3e3])
def test_friction_of_a_pad_is_at_most_its_coefficients_times_its_load(normal, plain):
    """Of one that slides in two directions sqrt(sum (f/limit)^2) <= 1; without load nothing."""
    random, mu = np.random.default_rng(27), np.array([0.3, 0.2])
    mounts = Record(curve=np.full((1, 3), -1), internal=np.array([[-1, 0, 1]]))
    mounts.flags = np.zeros((1, elements.FRICTION + 1))
    internal = Record(kind=[PAD, PAD], parameter=np.array([[1e6, 1.0, 0.0]] * 2))
    work = Record(friction=np.zeros((1, 3, 2)), drive=np.zeros((2, 2)), laws=None)
    work.friction[0, 1:, 1] = mu
    plain(elements)
    system, shares = Record(mounts=mounts, internal=internal, curves=None), []
    for inner in random.normal(size=(20, 2)) * mu * 3e3:
        force = [
            elements.axis_force(system, work, 0, k, (0.0, 1.0, normal), inner) for k in range(3)
        ]
        assert force[0] == 0.0
        assert force[1] * inner[1] == pytest.approx(force[2] * inner[0])
        shares.append(np.hypot(*(np.array(force[1:]) / (mu * 3e3))))
    assert np.max(shares) == pytest.approx(normal / 3e3)
    assert np.min(shares) < 0.9


def direction(rotation):
    """Axis of a rotation."""
    return rotation.as_rotvec() / rotation.magnitude()


X = np.array([1.0, 0.0, 0.0])


def placed(random, frames):
    """Bodies of these frames at random nominal positions."""
    n = len(frames)
    return Record(kind=np.zeros(n), frame=frames, row=random.normal(size=(n, max(Y_0, Z_0) + 1)))


def place(bodies, b, state):
    """Position of a body in its frame."""
    return state[6 * b : 6 * b + 3] + np.array([0.0, *bodies.row[b, [Y_0, Z_0]]])


def wheelset_on_track(seed):
    """Kernel arrays of a yawed and rolled wheelset on a track that twists, rises and curves.

    With its axes and those after the yaw in the track's, the track's turn omega per metre, and how
    the wheelset moves with all relative coordinates held, e_x + omega x r.
    """
    random = np.random.default_rng(seed)
    yaw, roll = random.normal(0.0, 0.3, 2)
    yawed = turn(yaw, 2)
    axes, relative = yawed @ turn(roll, 0), np.zeros((1, 16))
    relative[0, :9], relative[0, SIN_ROLL], relative[0, COS_ROLL] = axes.flat, sin(roll), cos(roll)
    frames, bodies = random.normal(size=(1, FRAME_SIZE)), placed(random, [0])
    omega, state = frames[0, OMEGA : OMEGA + 3], random.normal(size=12)
    moved = X + np.cross(omega, place(bodies, 0, state))
    system = Record(bodies=bodies, contact=Record(body=np.zeros(1, np.int64)))
    return system, Record(frames=frames, relative=relative), state, (axes, yawed), (omega, moved)


@pytest.mark.parametrize("seed", range(5))
def test_normal_force_does_no_work_along_a_turning_track(seed):
    """Only its given share of irregular rails; its moments about roll, axle and normal are kept."""
    system, work, state, (axes, yawed), (omega, moved) = wheelset_on_track(seed)
    given = np.random.default_rng(seed + 100).normal(size=6)
    work.rail_force = given[None].copy()
    wheel_contact.complete_normal_force.py_func(system, work, 0, state)
    force, moment = work.rail_force[0, :3], work.rail_force[0, 3:6]
    assert force[1:] == pytest.approx(given[1:3])
    assert (moment @ yawed[:, 0], moment @ axes[:, 1], moment[2]) == pytest.approx(given[3:])
    assert force @ moved + moment @ omega == pytest.approx(given[0])


@pytest.mark.parametrize("seed", range(5))
def test_what_keeps_axleboxes_upright_does_no_work_along_a_turning_track(seed, plain):
    """Moments about roll and the track's normal are kept, none is left about the axle.

    The couple that is taken away and the force along the track do no work together.
    """
    system, work, state, (axes, yawed), (omega, moved) = wheelset_on_track(seed)
    random = np.random.default_rng(seed + 100)
    track = turn(random.normal(), 0) @ turn(random.normal(), 1) @ turn(random.normal(), 2)
    work.frames[0, ATTITUDE : ATTITUDE + 9] = track.flat
    work.pose = random.normal(size=(1, POSE_SIZE))
    work.pose[0, :9] = (track @ axes).flat
    before = work.pose[0].copy()
    plain(rhs)
    rhs.remove_axle_moments(system, work, state)
    force, moment = ((work.pose[0] - before)[k : k + 3] @ track for k in (FORCE, MOMENT))
    assert [moment @ yawed[:, 0], moment[2]] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert work.pose[0, MOMENT : MOMENT + 3] @ track @ axes[:, 1] == pytest.approx(0.0, abs=1e-12)
    assert force[1:] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert force @ moved + moment @ omega == pytest.approx(0.0, abs=1e-12)


def test_creepages_are_the_velocity_of_the_wheel_against_the_rail():
    """Of three patches on two wheelsets, in vectors; slopes of second order are left out.

    Wheel: V (e_x + omega x r) + v + a x c.  The rail goes along with the track's sections, its own
    slope and the turn of its plane; c leads by as much.
    """
    random, speed, angles = np.random.default_rng(9), 20.0, np.array([0.3, 0.9, -0.5])
    system = Record(bodies=placed(random, [1, 0, 0, 1]), contact=Record(body=[2, 0]))
    state, index = random.normal(size=60), np.array([[0, 1], [1, 0], [1, 1]])
    patch, plane = random.normal(size=(PATCH_ROWS, 3)), random.normal(size=(2, 16))
    patch[RISE] *= 1e-3
    patch[[ANGLE_SIN, ANGLE_COS]] = np.sin(angles), np.cos(angles)
    plane[:, [SLOPE_Z, ROLL_SLOPE]] *= 1e-3
    plane[:, [SINE, COSINE]] = [[sin(a), cos(a)] for a in (0.2, -0.4)]
    rail, relative = np.zeros((2, 2, 8)), np.zeros((4, 16))
    rail[..., RAIL_SLOPE] = 1e-3 * random.normal(size=(2, 2))
    relative[:, :9] = [(turn(a, 2) @ turn(-a, 0)).ravel() for a in (0.1, 0.3, -0.2, 0.5)]
    frames, motion = 1e-3 * random.normal(size=(2, FRAME_SIZE)), random.normal(size=(2, 2, 4))
    work = Record(
        patch_index=index, patch=patch, plane=plane, rail=rail, relative=relative, frames=frames,
        rail_motion=motion,
    )  # fmt: skip
    creepages.set_creepages.py_func(system, work, 3, speed, state)
    for k, (w, side) in enumerate(index):
        b, slope = system.contact.body[w], rail[w, side, RAIL_SLOPE]
        omega, r = frames[system.bodies.frame[b], OMEGA : OMEGA + 3], place(system.bodies, b, state)
        v, u = state[24:].reshape(-1, 3)[2 * b : 2 * b + 2]
        a = relative[b, :9].reshape(3, 3) @ u
        lean = turn(np.arctan2(plane[w, SINE], plane[w, COSINE]), 0)
        c, d = patch[[C_X, C_Y, C_Z], k], np.array([1.0, *patch[[TANGENT_Y, TANGENT_Z], k]])
        n = lean @ [0.0, *patch[[ANGLE_SIN, ANGLE_COS], k]]
        assert patch[[NORMAL_Y, NORMAL_Z], k] == pytest.approx(n[1:])
        middle = np.array([0.0, *plane[w, [MIDDLE_Y, MIDDLE_Z]]])
        along = np.cross(omega, r + c) + np.cross(X * plane[w, ROLL_SLOPE], r + c - middle)
        along += [0.0, slope, plane[w, SLOPE_Z] - patch[RISE, k]]
        assert d[1:] == pytest.approx(along[1:], abs=3e-5)
        foot = lean @ [0.0, *patch[[FOOT_Y, FOOT_Z], k]]
        leads = patch[FOOT_X, k] - slope * c[1] - d[2] * c[2]
        leads -= (patch[FOOT_X_PER_YAW, k] + c[1]) * (d[1] - slope)
        assert c == pytest.approx([leads, *foot[1:]])
        rest = lean @ [0.0, *motion[w, side, [MOTION_Y_RATE, MOTION_Z_RATE]]]
        slip = speed * (X + np.cross(omega, r)) + v + np.cross(a, c) - rest
        rolling = speed * (1.0 + np.cross(omega, r + c)[0]) + v[0]
        assert patch[PATCH_SPEED, k] == pytest.approx(rolling)
        t = np.array([0.0, n[2], -n[1]])
        n, t = n - (d @ n) * X, t - (d @ t) * X  # at right angles to the rail
        found = patch[[XI_X, XI_Y, PHI], k] * rolling
        assert found == pytest.approx([d @ slip, t @ slip, a @ n])


def test_reference_of_a_free_run_keeps_its_place_in_the_frames():
    """V' takes up its acceleration along the track; each body loses V' (e_x + omega x r)."""
    random, n = np.random.default_rng(2), 3
    system = Record(drive=Record(mode=FREE), bodies=placed(random, [1, 0, 1]))
    system.bodies.reference = 1
    frames, state, derivative = random.normal(size=(2, FRAME_SIZE)), *random.normal(size=(2, 50))
    work, before = Record(frames=0.1 * frames), derivative.copy()
    rate = driving.speed_change.py_func(system, work, state, derivative)
    driving.apply_speed_change.py_func(system, work, state, rate, derivative)
    change = (derivative - before)[6 * n : 12 * n].reshape(n, 6)
    for b, f in enumerate(system.bodies.frame):
        omega = work.frames[f, OMEGA : OMEGA + 3]
        moved = X + np.cross(omega, place(system.bodies, b, state))
        assert change[b] == pytest.approx([*(-rate * moved), 0.0, 0.0, 0.0])
    assert derivative[6 * (n + 1)] == pytest.approx(0.0, abs=1e-12)


def test_traction_of_a_free_run_pulls_along_the_track_where_the_reference_body_is(plain):
    """Less the running resistance, a polynomial of the speed; nothing on any other body."""
    random, frames, pose = np.random.default_rng(25), np.zeros((2, FRAME_SIZE)), np.zeros((3, 30))
    axes = [turn(a, 2) @ turn(0.1 * a, 1) @ turn(-a, 0) for a in random.normal(size=2)]
    frames[:, ATTITUDE : ATTITUDE + 9] = np.reshape(axes, (2, 9))
    drive = Record(table=np.array([[0.0, 900.0], [10.0, 500.0]]), resistance=[20.0, 3.0, 0.5])
    bodies = Record(frame=[0, 0, 1], reference=2)
    work, expected = Record(frames=frames, pose=pose), np.zeros((3, 30))
    expected[2, FORCE : FORCE + 3] = (900.0 - 160.0 - (20.0 + 12.0 + 8.0)) * axes[1][:, 0]
    plain(driving)
    driving.add_traction(Record(drive=drive, bodies=bodies), work, 4.0)
    np.testing.assert_allclose(pose, expected, atol=1e-12)


def test_bodies_fixed_to_the_track_turn_with_their_own_frames(plain):
    """In their own axes V C^T omega; two of four bodies, and nothing else of the state."""
    random, n, speed, bodies = np.random.default_rng(26), 4, 3.0, Record(fixed=np.array([1, 3]))
    bodies.kind, bodies.frame = np.zeros(n), [2, 1, 0, 0]
    frames, state = random.normal(size=(3, FRAME_SIZE)), random.normal(size=60)
    state[SPEED] = speed
    expected = state.copy()
    for b in bodies.fixed:
        roll, pitch, yaw = state[6 * b + 3 : 6 * b + 6]
        C, begin = turn(yaw, 2) @ turn(roll, 0) @ turn(pitch, 1), velocity_begin(n) + 6 * b
        omega = frames[bodies.frame[b], OMEGA : OMEGA + 3]
        expected[begin : begin + 6] = *np.zeros(3), *(speed * C.T @ omega)
    plain(driving)
    driving.turn_fixed(bodies, frames, state)
    np.testing.assert_allclose(state, expected, atol=1e-12)


def test_signals_of_the_track_ahead_are_the_slope_of_its_heading_and_its_cant(plain):
    coefficients = np.random.default_rng(1).normal(size=(3, 6, 4))
    which, row = np.zeros((2, 6), dtype=np.int64), np.zeros((2, 8))
    which[:, controllers.KIND] = controllers.CURVATURE, controllers.CANT
    row[:, controllers.LOOKAHEAD] = 2.5
    track = TrackTables(1.0, 2.0, coefficients, np.zeros((3, 6, 4)), 0, 1.5)
    system, state = Record(signals=Record(codes=which, row=row), track=track), np.zeros(20)
    plain(controllers)
    inside, beyond = ((-1.4, 0, 0.1), (1.2, 1, 0.7), (3.9, 2, 1.4)), ((-9.0, 0, 0.0), (9.0, 2, 2.0))
    for at, cell, u in inside + beyond:  # where the track goes on as it ends
        heading, cant = (np.polynomial.Polynomial(coefficients[cell, k]) for k in (PSI, CANT_ANGLE))
        state[ARC_LENGTH] = at
        found = [controllers.track_signal(system, state, i) for i in (0, 1)]
        assert found == pytest.approx([heading.deriv()(u), cant(u)])


@pytest.mark.parametrize("h", [1e-3, 3.0])
def test_implicit_damping_of_a_step_solves_its_matrix(h, plain):
    """(1 + M^-1 D) (a_n - b) = a - b, in y, z and roll and for a slip of two coordinates.

    D of the creep forces is symmetric and taken to a share theta, that of the normal forces is not
    and taken to a half.
    """
    random = np.random.default_rng(7)
    plain(step_fast)
    before, given = random.normal(size=(2, 12))
    J, (mass, roll, damping) = random.normal(size=(2, CONTACT_JACOBIAN)), (0.7, 0.3, 1.9)
    inverse = np.diag([mass, mass, roll])
    slip, normal = np.zeros((3, 3)), J[1, J_NORMAL : J_NORMAL + 9].reshape(3, 3)
    slip[np.triu_indices(3)] = J[1, J_SLIP : J_SLIP + 6] = np.abs(J[1, J_SLIP : J_SLIP + 6])
    slip = slip + slip.T - np.diag(np.diag(slip))
    theta = step_fast.implicitness(h * np.trace(inverse @ slip))
    matrix = np.eye(3) + h * inverse @ (theta * slip + 0.5 * normal)
    found = given.copy()
    step_fast.damp_cross_section(J, 1, found, before, 6, mass, roll, h)
    expected = before[7:10] + np.linalg.solve(matrix, (given - before)[7:10])
    assert found == pytest.approx([*given[:7], *expected, *given[10:]])
    lever, found = np.array([1.0, -0.6]), given.copy()
    inverse = np.diag([mass, roll])
    theta = step_fast.implicitness(h * damping * lever @ inverse @ lever)
    matrix = np.eye(2) + theta * h * damping * inverse @ np.outer(lever, lever)
    step_fast.damp_slip(found, before, 2, 4, lever[1], damping, mass, roll, h)
    expected = before[[2, 4]] + np.linalg.solve(matrix, (given - before)[[2, 4]])
    assert found[[2, 4]] == pytest.approx(expected)


@pytest.mark.parametrize("h", [1e-3, 3.0])
def test_implicit_damping_at_walking_pace_solves_the_matrix_of_all_directions(h, plain):
    """(1 + h M^-1 D) (a_n - b) = a - b with D = sum G^T S G over the patches, G of two slips.

    Along, x' + c_z pitch' - c_y yaw'; across, c y' - s z' + arm roll'; S has the slopes of the
    force over both, E in the corners.  What the normal forces take goes to a half.
    """
    random = np.random.default_rng(11)
    plain(step_fast)
    plain(contact_damping)
    patch, cz, angle = random.uniform(0.2, 1.0, (PATCH_ROWS, 2)), 0.45, np.array([0.02, -1.1])
    patch[C_Z], patch[C_Y] = cz, [0.75, -0.75]
    patch[NORMAL_Y], patch[NORMAL_Z] = np.sin(angle), np.cos(angle)
    secant, along, across = random.uniform([[1.2], [0.5], [0.5]], [[1.5], [1.1], [1.1]], (3, 2))
    patch[[SECANT_ALONG, SLOPE_ALONG, SLOPE_ACROSS]], patch[C11] = (secant, along, across), 4.0
    patch[C22], patch[T_X] = 4.0, [-1.0, 1.0]
    patch[T_Y] = 1e-9
    cross = np.sqrt((secant - along) * (secant - across)) * [1.0, -1.0]
    work = Record(patch=patch, slip_matrix=np.zeros((5, 8)), patch_index=np.zeros((2, 1), int))
    work.contact_jacobian = np.zeros((2, CONTACT_JACOBIAN))
    system = Record(support=Record(elastic=0), contact=Record(body=[1]))
    contact_damping.add_slip_coupling(system, work, 2)
    D, N, J = np.zeros((6, 6)), np.zeros((6, 6)), work.contact_jacobian[1]
    for k, damping in enumerate((0.6, 1.3)):
        contact_damping.add_wheelset_damping(work, 1, k, across[k], damping)
        J[[J_SECANT, J_SECANT_C_Z]] += secant[k], secant[k] * cz
        J[J_SECANT_YAW] += secant[k] * patch[C_Y, k] ** 2
        s, c, cy = np.sin(angle[k]), np.cos(angle[k]), patch[C_Y, k]
        G = np.array([[1, 0, 0, 0, cz, -cy], [0, c, -s, -c * cz - s * cy, 0, 0]])
        D += G.T @ np.array([[secant[k], cross[k]], [cross[k], across[k]]]) @ G
        normal = np.array([0, s, c, c * cy - s * cz, 0, 0])
        N += damping * np.outer(normal, normal)
    row = np.zeros((2, 8))
    row[1, [MASS, I_1, I_2, I_3]] = 1.4, 0.7, 0.3, 0.9
    inverse = 1.0 / np.array([1.4, 1.4, 1.4, 0.7, 0.3, 0.9])
    z = h * inverse * np.diag(D)
    theta = np.zeros(6)
    theta[[0, 4]] = step_fast.implicitness(z[0] + z[4])
    theta[1:4], theta[5] = step_fast.implicitness(z[1:4].sum()), step_fast.implicitness(z[5])
    before, given = random.normal(size=(2, 12))
    matrix = np.eye(6) + h * inverse[:, None] * (np.sqrt(np.outer(theta, theta)) * D + 0.5 * N)
    expected = before[6:] + np.linalg.solve(matrix, (given - before)[6:])
    found = given.copy()
    step_fast.damp_coupled(Record(row=row), work, 1, found, before, J[J_SECANT], h, h)
    assert found == pytest.approx([*given[:6], *expected])


@pytest.mark.parametrize("roll", [0.0, 0.004, 0.02, -0.05])
@pytest.mark.parametrize("y", [-0.03, -0.01, 0.0, 0.012, 0.04])
def test_a_wheel_beyond_the_tables_of_rails_is_held_at_their_edge(y, roll):
    """What is left of displacement and roll is added to the edge; within, nothing is left."""
    tables = Record(shear=[0.4], y0=-0.02, dy=1e-3, roll0=-0.012, droll=1e-3)
    tables.values = np.zeros((1, 1, 1, 1, 41, 1))
    stretched, slope = contact_table.stretched_roll(roll)
    found, found_slope, aside, more = rail_parts.clamp.py_func(tables, y, roll, stretched, slope)
    foot = y - 0.4 * roll
    assert aside == pytest.approx(foot - np.clip(foot, -0.019, 0.019), abs=2e-9)
    assert (more == 0.0) == (abs(stretched) < 0.011)
    at_edge = contact_table.stretched_roll(roll - more)
    assert (found, found_slope) == pytest.approx(at_edge, rel=1e-9)
    assert found == pytest.approx(np.clip(stretched, -0.011, 0.011), rel=1e-5)


def test_slope_of_a_rail_is_that_between_its_nodes_and_stays_where_it_ends(plain):
    """Of the nearest node in y and roll; a zone that the next node has not goes on as it is."""
    random = np.random.default_rng(29)
    rails = Record(values=random.normal(size=(3, 3, 1, 2, 2, 1)), part=np.array([[0, 3]]))
    rails.node_s, rails.node_zone = np.array([0.0, 1.0, 3.0]), np.array([[0, 1], [3, 4], [6, -1]])
    weights = np.zeros(16)
    weights[[1, 2, 9, 10]] = 0.3, 0.7, 0.6, 0.4
    plain(rail_parts)

    def fall(zone, s):
        return rail_parts.section_slope(rails, 0, zone, s, 7.0, (0, 0, 0), weights)

    given = rails.values[:, 0, 0, 0, 1, 0], rails.values[:, 1, 0, 0, 1, 0]
    assert fall(0, 0.4) == pytest.approx(given[0][1] - given[0][0])
    assert fall(0, 1.5) == pytest.approx((given[0][2] - given[0][1]) / 2.0)
    assert fall(1, 0.4) == pytest.approx(given[1][1] - given[1][0])
    assert [fall(1, 1.5), fall(0, 3.1), fall(0, -0.1)] == [7.0] * 3


@pytest.mark.parametrize("same", [None, 0, 2, 4])
def test_tables_along_a_rail_are_joined_by_scipys_splines_of_the_slopes_at_their_nodes(same, plain):
    """Uneven nodes, slopes of parabolas through three; level where two nodes have one table."""
    random, n = np.random.default_rng(41), 6
    s = np.cumsum(random.uniform(0.2, 1.5, n + 3))
    zones, values = np.arange(3 * (n + 3)).reshape(-1, 3), random.normal(size=n + 3)
    rails = Record(part=np.array([[0, 2], [2, n]]), node_s=s, node_zone=zones)
    x, f = s[2 : 2 + n], values[2 : 2 + n]
    slopes = np.gradient(f, x)
    if same is not None:
        zones[3 + same], f[same + 1] = zones[2 + same], f[same]
        slopes = np.gradient(f, x)
        slopes[[same, same + 1]] = 0.0
    spline, weights = CubicHermiteSpline(x, f, slopes), np.zeros(20)
    plain(rail_parts)
    for at in np.linspace(x[0], x[-1], 25)[:-1]:
        i = rail_parts.section_cell(rails, 1, at)
        rail_parts.set_node_weights(rails, 1, i, at, weights, 9)
        own = [values[rail_parts.neighbour_node(rails, 1, i, k)] for k in range(4)]
        found = [weights[9:13] @ own, weights[13:17] @ own]
        assert found == pytest.approx([float(spline(at)), float(spline(at, 1))], abs=1e-12)
    assert rail_parts.section_cell(rails, 1, x[0] - 1e-9) < 0
    assert rail_parts.section_cell(rails, 1, x[-1] + 1e-9) < 0


def surface_of(values, y_0, dy):
    """Surface of a wheel, heights with their slopes at angles and widths, after another one."""
    n_phi, n_y, _ = values.shape
    row = np.zeros((1, 8))
    row[0, [wheel_surface.N_PHI, wheel_surface.N_Y]] = n_phi, n_y
    row[0, [wheel_surface.Y0, wheel_surface.DY, wheel_surface.FIRST]] = y_0, dy, 3
    return Record(surface_row=row, surface=np.vstack([np.ones((3, 4)), values.reshape(-1, 4)]))


def test_heights_of_a_wheel_are_scipys_splines_around_and_across():
    """Node by node value, slope around, slope across and both; constant beside the surface."""
    values, (y_0, dy), step = np.random.default_rng(4).normal(size=(5, 4, 4)), (-2.0, 1.3), 0.4 * pi
    surface, y = surface_of(values, y_0, dy), y_0 + dy * np.arange(4)
    across = [[CubicHermiteSpline(y, v[:, k], v[:, k + 2]) for k in (0, 1)] for v in values]
    for phi in (0.3, 2.0, 6.0, -0.5, 8.0):
        i, begin = int(phi % (2.0 * pi) // step), phi // step * step
        ends = across[i], across[(i + 1) % 5]
        for at in (-2.5, -1.9, -0.5, 0.9, 1.8, 2.0):
            inside = min(max(at, y_0), y[-1])
            e, e_y = (
                CubicHermiteSpline(
                    [begin, begin + step], *([end[k](inside, n) for end in ends] for k in (0, 1))
                )
                for n in (0, 1)
            )
            expected = e(phi), e(phi, 1), e_y(phi) if inside == at else 0.0
            found = wheel_surface.surface_height.py_func(surface, 0, phi, at)
            np.testing.assert_allclose(found, expected, atol=1e-12)


def test_gap_of_a_wheel_that_is_not_round_has_the_slopes_of_its_height():
    """Over y and roll of the wheelset; the wheel is touched at y - shear roll."""
    surface = surface_of(np.random.default_rng(6).normal(size=(5, 4, 4)), -2.0, 1.3)
    shear, x = 0.4, np.array([0.3, -0.2])

    def height(x):
        return wheel_surface.surface_height.py_func(surface, 0, 0.7, x[0] - shear * x[1])

    look_up, bump = np.zeros(LOOK_UP_SIZE + 2), np.zeros((3, BUMP_SIZE))
    bump[1, B_HEIGHT], _, bump[1, B_E_Y] = height(x)
    given = 2.0, 0.5, -0.3
    look_up[2 + np.array([0, G_Y, G_ROLL])] = given
    wheel_surface.subtract_height.py_func(look_up, 2, bump, 1, shear)
    slopes = approx_fprime(x, lambda at: height(at)[0])
    expected = np.subtract(given, [height(x)[0], *slopes])
    assert look_up[2 + np.array([0, G_Y, G_ROLL])] == pytest.approx(expected, abs=1e-6)


def test_foreseen_height_of_a_wheel_changes_as_the_wheel_turns(plain):
    """Over time, at the wheel's speed of rotation; on both sides where it stands on its rail."""
    contact = surface_of(np.random.default_rng(6).normal(size=(5, 4, 4)), -2.0, 1.3)
    contact.surface_of, contact.table = np.zeros((1, 2, 3), dtype=np.int64), np.zeros((1, 2), int)
    contact.body, contact.shear, contact.rails = [0], [0.4], Record(range_of=np.zeros(0))
    bodies = Record(kind=np.zeros(1), row=np.full((1, RADIUS + 1), 0.46), frame=[0])
    system = Record(contact=contact, bodies=bodies, frame_offset=[0.0])
    work = Record(plane=np.zeros((1, 16)), rail=np.zeros((1, 2, 8)))
    state, track, speed, aside = np.zeros(40), np.zeros(6), 3.0, np.array([-0.2, 0.3])
    state[[1, 3]], work.plane[0, ROLL], work.rail[0, :, SHIFT] = [0.5, 0.2], 0.05, aside
    state[velocity_begin(1) + 4] = -speed / 0.46

    def heights(t):
        state[ARC_LENGTH] = 1.1 + speed * t
        wheel_surface.predict_tread_heights(system, work, state, 0, track, 0)
        return track[:4].copy()

    for module in (rail_parts, wheel_surface):
        plain(module)
    y = np.array([-1.0, 1.0]) * (0.5 - aside - 0.4 * 0.15)
    expected = [wheel_surface.surface_height(contact, 0, 1.1 / 0.46, at)[0] for at in y]
    found = heights(0.0)
    assert found[:2] == pytest.approx(expected)
    assert found[2:] == pytest.approx((heights(1e-6) - heights(-1e-6))[:2] / 2e-6, rel=1e-6)


def loads(e, stiffness):
    """N = K e^1.5 + K2 e^2 of three patches."""
    return stiffness[:3] * e**1.5 + stiffness[3:] * e**2


@pytest.mark.parametrize("seed", range(12))
def test_approaches_of_neighbours_are_those_of_the_penetrations_less_what_they_bend(seed):
    """One that would lift off carries nothing; one that is apart keeps its distance."""
    random = np.random.default_rng(seed)
    stiffness = np.concatenate([random.uniform(2e9, 2e10, 3), random.uniform(0.0, 2e10, 3)])
    p, (a, b) = random.uniform(-4e-5, 1e-4, 3), random.uniform(0.0, 4e-10, 2)
    e = p.copy()
    contact_table.couple_approaches(np.array([[0.0, 0.0], [a, b]]), 1, stiffness, e)
    bends = np.array([[0.0, a, 0.0], [a, 0.0, b], [0.0, b, 0.0]])
    left = p - bends @ loads(np.maximum(e, 0.0), stiffness)
    for patch in range(3):
        if p[patch] <= 0.0:
            assert e[patch] == p[patch]
        elif e[patch] > 0.0:
            assert e[patch] == pytest.approx(left[patch], abs=1e-10)
        else:
            assert left[patch] <= 1e-12


def test_slopes_of_a_limited_continuation_are_its_derivatives():
    """Of two values over y and roll, one near, one beyond half of what it is there."""

    def there(x):
        return 3.0 + 0.4 * x[0] - 0.7 * x[1]

    def here(x):
        return 0.2 - 0.3 * x[0] + 0.5 * x[1]

    def part(x):
        return contact_table.continuation_share.py_func(there(x), 0.4, -0.7, here(x), -0.3, 0.5)

    x = np.array([0.1, 0.2])
    share, part_y, part_roll = part(x)
    assert there(x) + share * (here(x) - there(x)) == pytest.approx(0.5 * there(x))
    assert [part_y, part_roll] == pytest.approx(approx_fprime(x, lambda at: part(at)[0]), rel=1e-5)
    assert contact_table.continuation_share.py_func(3.0, 0.4, -0.7, 2.0, -0.3, 0.5) == (
        1.0,
        0.0,
        0.0,
    )


@pytest.mark.parametrize("falls", [(0.9, 0.5), (0.4, 1.1)])
def test_stiffness_beyond_the_last_node_has_the_slopes_of_what_is_left(falls, plain, monkeypatch):
    """Of both its parts over y and roll, whichever of them limits it."""
    plain(contact_table)
    names = ((K, K_Y, K_ROLL), (K2, K2_Y, K2_ROLL))
    at_end = [lambda x: 2.0 + 0.3 * x[0] - 0.5 * x[1], lambda x: 9e2 - 90.0 * x[0] + 70.0 * x[1]]

    def nodes(x, start, row, slab, weights, tw, out, first):
        for columns, end, fall in zip(names, at_end, falls, strict=True):

            def value(x, end=end, fall=fall):
                return end(x) * (1.0 - (fall + 0.2 * x[0] + 0.1 * x[1]) * (tw - 1.0))

            out[first + np.array(columns)] = value(x), *approx_fprime(x, value)

    monkeypatch.setattr(contact_table, "_sum_nodes", nodes)

    def fields(x, tw=2.4):
        out = np.ones(2 * LOOK_UP_SIZE)
        contact_table.sum_nodes_limited(x, 0, 0, 0, None, tw, out, LOOK_UP_SIZE)
        return out[LOOK_UP_SIZE:]

    x = np.array([0.1, -0.2])
    found = fields(x)
    assert found[K] > 0.0 > 1.0 - 1.4 * max(falls)
    for value, *slopes in names:
        slope = approx_fprime(x, lambda x, value=value: fields(x)[value], 1e-6)
        np.testing.assert_allclose(found[slopes], slope, rtol=1e-4)


@pytest.mark.parametrize("z", [0.5e-4, 1.3e-4, 3.5e-4])
def test_overlap_of_a_patch_is_its_integral_and_its_width_the_slope_of_that(z):
    """Between candidates linear, nothing where it is negative."""
    random, theta = np.random.default_rng(28), 1e-5
    h = 1e-4 * np.array([3.0, 0.2, 0.9, 1.6, 4.0, 0.7])
    lift, du, x = random.uniform(1.0, 1.5, 6), random.uniform(size=5), np.linspace(0.0, 1.0, 20001)

    def over(z):
        v = z - h - theta * lift
        between = np.outer(1.0 - x, v[:-1]) + np.outer(x, v[1:])
        return trapezoid(np.maximum(between, 0.0), x, axis=0) @ du

    found = elastic_patch.overlap.py_func(z, theta, h, lift, du)
    slope = (over(z + 1e-8) - over(z - 1e-8)) / 2e-8
    assert found == pytest.approx((over(z), slope), rel=1e-4)


def test_sums_over_a_patch_are_integrals_of_its_overlap():
    """Linear overlap v, window and lengths between six candidates; two ends lie between them."""
    random, theta = np.random.default_rng(21), 1e-5
    h = 1e-4 * np.array([3.0, 0.2, 0.9, 1.6, 4.0, 0.7])
    lift, window, du = random.uniform(1.0, 1.5, 6), random.uniform(size=6), random.uniform(size=5)
    z, weight, x = 2e-4, np.empty(6), np.linspace(0.0, 1.0, 20001)
    sums, means = np.zeros(4), np.zeros(6)
    for i in range(5):
        share = np.array([1.0 - x, x])
        v = np.maximum(z - h[i : i + 2] @ share - theta * lift[i : i + 2] @ share, 0.0)
        w, L = window[i : i + 2] @ share, lift[i : i + 2].mean()
        values = v / L, v, 0.5 * w * v**2 / L, w * v / L
        sums += du[i] * trapezoid(values, x)
        means[i : i + 2] += du[i] * trapezoid(share * w * v / L, x)
    given = z, theta, h, lift, du, window, np.empty(6), weight
    *found, deepest = elastic_patch.patch_sums.py_func(*given)
    np.testing.assert_allclose(found, sums, rtol=1e-6)
    np.testing.assert_allclose(weight, means, rtol=1e-5)
    assert deepest == pytest.approx(max((z - h) / lift) - theta)
    assert weight[0] > 0.0
    assert elastic_patch.weighted_sum.py_func(weight, 2.0 + h) == pytest.approx(weight @ (2.0 + h))
