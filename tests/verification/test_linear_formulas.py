"""Eigenmodes, their names, responses and stretches of motion, of matrices and shapes made up."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from railsim.kernels.system import RIGID, WHEELSET
from railsim.linear.coordinates import Coordinates
from railsim.linear.eigenmodes import Eigenmodes, eigenmodes, oscillations, pairing
from railsim.linear.naming import Parts, mode_name, parts_of
from railsim.linear.system import Linearisation, jacobian, without_forceless
from railsim.linear.track_response import (
    RAILS,
    TrackResponse,
    _forces_of,
    _of_wheelsets,
    _power,
    _readings,
)
from railsim.result.sensors import Sensor
from railsim.stability.branches import Branch, Point, first_beyond, jumps, lowest_of
from railsim.stability.motion import Stretch

SEEDS = st.integers(0, 10_000)


def linearisation(seed, n=8, p=20.0):
    matrix = np.random.default_rng(seed).normal(size=(n, n))
    return Linearisation(tuple(f"x{k}" for k in range(n)), matrix, np.zeros(n), p)


@settings(max_examples=25)
@given(SEEDS)
def test_eigenmodes_of_any_matrix(seed):
    """A r = lambda r, l A = lambda l, l r = 1, the largest component 1; one of a conjugate pair."""
    at = linearisation(seed)
    modes = eigenmodes(at)
    values = np.linalg.eigvals(at.matrix)
    kept = values[values.imag >= 0.0]
    order = np.argsort(np.abs(modes.eigenvalues))
    assert (order == np.arange(len(order))).all()
    assert np.sort_complex(modes.eigenvalues) == pytest.approx(np.sort_complex(kept))
    diagonal = modes.eigenvalues[:, None]
    assert modes.shapes @ at.matrix.T == pytest.approx(diagonal * modes.shapes, abs=1e-10)
    assert modes.left @ at.matrix == pytest.approx(diagonal * modes.left, abs=1e-8)
    assert np.diag(modes.left @ modes.shapes.T) == pytest.approx(1.0)
    largest = np.argmax(np.abs(modes.shapes), axis=1)
    assert modes.shapes[np.arange(len(largest)), largest] == pytest.approx(1.0)
    assert pairing(modes, modes) == pytest.approx(np.eye(len(order)), abs=1e-8)
    f, f0 = modes.frequencies, modes.natural_frequencies
    assert f == pytest.approx(modes.eigenvalues.imag / (2.0 * np.pi))
    # exp(lambda t) falls by exp(-2 pi zeta f0/f) a period
    decay = np.exp(modes.eigenvalues.real[f > 0.0] / f[f > 0.0])
    assert decay == pytest.approx(
        np.exp(-2.0 * np.pi * (modes.damping_ratios * f0 / np.where(f > 0.0, f, 1.0))[f > 0.0])
    )
    most = 1.0001 * float(np.median(f0))
    inside = oscillations(modes, most)
    assert inside.eigenvalues.tolist() == [
        v for v in modes.eigenvalues.tolist()
        if v.imag > 2e-3 * np.pi and abs(v) <= 2.0 * np.pi * most
    ]  # fmt: skip
    # other units of the coordinates: other vectors, the same modes
    scale = np.exp(np.random.default_rng(seed).normal(size=8))
    other = eigenmodes(
        Linearisation(at.names, scale[:, None] * at.matrix / scale, at.state, at.parameter)
    )
    assert other.eigenvalues == pytest.approx(modes.eigenvalues)


@settings(max_examples=20)
@given(SEEDS)
def test_differences_of_a_quadratic_are_its_derivatives(seed):
    random = np.random.default_rng(seed)
    A, b = random.normal(size=(3, 4, 4)), random.normal(size=(3, 4))
    x, steps = random.normal(size=4), 10.0 ** random.uniform(-3.0, -1.0, 4)

    def function(rows):
        return np.einsum("mij,ki,kj->km", A, rows, rows) + rows @ b.T

    exact = np.einsum("mij,i->mj", A + A.transpose(0, 2, 1), x) + b
    assert jacobian(function, x, steps) == pytest.approx(exact, abs=1e-9)


@settings(max_examples=20)
@given(SEEDS)
def test_rates_without_mass_follow_from_the_balance_of_forces(seed):
    """Of y = M x, with x_w such that y_w = 0; further rows are outputs, further columns inputs."""
    random = np.random.default_rng(seed)
    matrix, w = random.normal(size=(9, 8)), np.array([2, 5])
    x, kept = random.normal(size=8), np.array([0, 1, 3, 4, 6, 7])
    x[w] = np.linalg.solve(matrix[np.ix_(w, w)], -matrix[np.ix_(w, kept)] @ x[kept])
    assert (matrix @ x)[w] == pytest.approx(0.0, abs=1e-9)
    found = without_forceless(matrix, w) @ x[kept]
    assert found == pytest.approx(np.delete(matrix @ x, w), rel=1e-7, abs=1e-9)
    assert without_forceless(matrix, np.array([], dtype=int)) is matrix


@pytest.mark.parametrize("seed", range(3))
def test_response_of_a_state_space_is_that_of_its_equations(seed):
    """x' = A x + B u + e d, y = C x + D u + R x' + own d with u = exp(i k s) at each wheelset."""
    random = np.random.default_rng(seed)
    n, m, wheelsets, speed = 7, 4, 2, 30.0
    A = random.normal(size=(n, n))
    B, C = random.normal(size=(n, wheelsets, 4, 3)), random.normal(size=(m, n))
    D, R = random.normal(size=(m, wheelsets, 4, 3)), random.normal(size=(m, n))
    rows = np.array([[1, 2, 3, 4], [3, 4, 5, 6]])
    own, offsets = random.normal(size=(m, wheelsets, 4)), np.array([4.3, -5.1])
    outputs = tuple(f"y{i}" for i in range(m))
    space = TrackResponse(speed, outputs, offsets, A, B, C, D, R, rows, own, np.zeros(m))
    k = np.array([0.05, 0.4, 1.7])
    for number, H in zip(k, space.over(k), strict=True):
        for quantity in range(12):
            u = np.zeros((wheelsets, 4, 3), dtype=complex)
            d = np.zeros((wheelsets, 4))
            if quantity < 4:
                for j in range(3):
                    u[:, quantity, j] = (1j * number) ** j * np.exp(1j * number * offsets)
            else:
                d.flat[quantity - 4] = 1.0
            drive = np.einsum("nwqj,wqj->n", B, u)
            np.add.at(drive, rows, d)
            x = np.linalg.solve(1j * speed * number * np.eye(n) - A, drive)
            rate = A @ x + drive
            y = C @ x + np.einsum("mwqj,wqj->m", D, u) + R @ rate + np.einsum("mwc,wc->m", own, d)
            assert H[:, quantity] == pytest.approx(y, rel=1e-9)


def test_irregularities_displace_both_rails_as_they_are_measured():
    """Alignment and level are means of both, cross level and gauge their differences."""
    for k, (y_left, z_left, y_right, z_right) in enumerate(RAILS):
        read = (
            (y_left + y_right) / 2.0,
            (z_left + z_right) / 2.0,
            z_right - z_left,
            y_right - y_left,
        )
        assert read == pytest.approx(np.eye(4)[k])
    for order in range(3):
        v, u = np.array([-0.3, 0.2, 1.1]), 0.4
        exact = (v - u) ** order / [1.0, 1.0, 2.0][order]
        assert np.polynomial.polynomial.polyval(v, _power(order, u)) == pytest.approx(exact)


def test_forces_on_the_rails_of_unknown_accelerations_balance_two_wheelsets():
    """Newton and Euler about the axle: the lateral force acts at the radius below it."""
    random = np.random.default_rng(4)
    mass, roll, radius = random.uniform(1.0, 2.0, (3, 6))
    bodies = SimpleNamespace(mass=mass, inertia=np.column_stack([roll] * 3), radius=radius)
    contact, track = SimpleNamespace(body=np.array([5, 2])), SimpleNamespace(rail_base=1.5)
    own = _forces_of(SimpleNamespace(bodies=bodies, contact=contact, track=track), 3)
    names = dict(zip(_of_wheelsets(2), range(3, 15), strict=True))
    assert own.shape == (15, 2, 4)
    assert not own[:3].any()
    for w, b in enumerate(contact.body):
        d = random.normal(size=4)  # y, z, roll, yaw
        there = dict(zip(names, own[list(names.values()), w] @ d, strict=True))
        own_names = [n for n in names if n.split(".")[1] == str(w + 1)]
        assert {n for n, force in there.items() if force} == {n for n in own_names if n[0] != "l"}
        Y = there[f"Y.{w + 1}.left"], there[f"Y.{w + 1}.right"]
        Q = there[f"Q.{w + 1}.left"], there[f"Q.{w + 1}.right"]
        assert sum(Y) == pytest.approx(-mass[b] * d[0])
        assert there[f"sum_Y.{w + 1}"] == pytest.approx(sum(Y))
        assert Y[0] == pytest.approx(Y[1])
        assert sum(Q) == pytest.approx(-mass[b] * d[1])
        # of the rails on the wheelset: y sum(Y) below the axle, z at half the base on either side
        moment = 0.75 * (Q[0] - Q[1]) + radius[b] * sum(Y)
        assert moment == pytest.approx(roll[b] * d[2])


@pytest.mark.parametrize("axlebox", [False, True])
def test_accelerometers_read_motion_and_the_gravity_of_their_tilt(axlebox):
    """a + alpha x arm - g in the tilted axes of a body, z down; an axlebox does not pitch."""
    random = np.random.default_rng(5)
    arm, n = random.normal(size=3), 12
    places = {(1, k): k for k in range(6)}
    velocities = {(1, k): 6 + k for k in range(6)}
    free = SimpleNamespace(
        model=SimpleNamespace(index=SimpleNamespace(bodies=("other", "body"))),
        coordinates=SimpleNamespace(position_of=places, velocity_of=velocities),
    )
    C, R, names = _readings({"here": Sensor("body", 0.0, tuple(arm), axlebox)}, free, n)
    assert names == ["here.x", "here.y", "here.z", "here.roll_rate"]
    tilt = 1e-5 * random.normal(size=3)
    state, rate = np.zeros(n), random.normal(size=n)
    state[3:6], state[9:] = tilt, random.normal(size=3)
    turning = rate[9:] * [1.0, not axlebox, 1.0]
    axes = Rotation.from_rotvec(tilt * [1.0, not axlebox, 1.0])
    gravity = axes.inv().apply([0.0, 0.0, 9.81]) - [0.0, 0.0, 9.81]
    expected = rate[6:9] + np.cross(turning, arm) - gravity
    assert (C @ state + R @ rate)[:3] == pytest.approx(expected, abs=1e-8)
    assert (C @ state + R @ rate)[3] == pytest.approx(state[9])


# names ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("second", "cars"), [(4.9, (0,)), (5.1, ()), (10.0, ())])
def test_without_bogies_what_is_half_as_heavy_as_the_heaviest_is_its_equal(second, cars):
    """Bodies on wheelsets alone: a car and a part of it, or two bogies without a car."""
    kinds, masses = np.array([RIGID, RIGID, WHEELSET, WHEELSET]), np.array([10.0, second, 1.5, 1.5])
    pairs = np.array([[0, 2], [3, 0], [1, 2], [3, 1]])
    system = SimpleNamespace(
        bodies=SimpleNamespace(kind=kinds, mass=masses),
        links=SimpleNamespace(body=pairs[:3]),
        mounts=SimpleNamespace(body=pairs[3:]),
        contact=SimpleNamespace(body=np.array([2, 3])),
    )
    found = parts_of(SimpleNamespace(system=system), None)
    assert found.cars == cars
    assert found.frames == tuple(b for b in (0, 1) if b not in cars)
    assert found.wheelsets == (2, 3)


BODIES = ("carbody", "front.frame", "rear.frame", "front.outer.wheelset", "front.inner.wheelset",
          "rear.inner.wheelset", "rear.outer.wheelset")  # fmt: skip
INERTIA = np.array(
    [[40e3, 6e4, 2e6, 2e6], *[[3e3, 2e3, 1.5e3, 3e3]] * 2, *[[1.8e3, 1e3, 1e2, 1e3]] * 4]
)
PLACES = [(b, k) for b in range(7) for k in range(6)]
X, Y, Z, ROLL, PITCH, YAW = range(6)
SPEED, OMEGA = 50.0, 25.0


def named(moves, eigenvalue=None, bodies=BODIES, cars=(0,)):
    """Name of a mode whose displacements by body and component are given."""
    value = complex(-1.0, OMEGA) if eigenvalue is None else eigenvalue
    n = len(PLACES)
    both = [*PLACES, *PLACES]
    c = Coordinates(
        tuple(map(str, both)), np.arange(2 * n), np.array([b for b, _ in both]),
        np.array([k for _, k in both]), n, n, np.ones(2 * n), np.array([], dtype=int),
        np.array([b - 3 for b, _ in both]),
    )  # fmt: skip
    kind = np.array([RIGID] * 3 + [WHEELSET] * 4)
    system = SimpleNamespace(
        bodies=SimpleNamespace(mass=INERTIA[:, 0], inertia=INERTIA[:, 1:], kind=kind)
    )
    model = SimpleNamespace(system=system, index=SimpleNamespace(bodies=bodies))
    frames = tuple(b for b in range(3) if b not in cars)
    parts = Parts(model, c, cars, frames, (3, 4, 5, 6))
    shape = np.zeros(2 * n, dtype=complex)
    for (b, k), size in moves.items():
        shape[PLACES.index((b, k))] = size
        shape[n + PLACES.index((b, k))] = value * size
    at = Linearisation(c.names, np.zeros((2 * n, 2 * n)), np.zeros(2 * n), SPEED)
    shapes = shape[None] / np.max(np.abs(shape))
    return mode_name(parts, Eigenmodes(at, np.array([value]), shapes, shapes.conj()))


# wheelsets that run like a cone: yaw = i omega y/V
ROLLS = 1j * OMEGA / SPEED


def wheelsets(component, sizes):
    return {(3 + w, component): size for w, size in enumerate(sizes)}


@pytest.mark.parametrize(
    ("moves", "name"),
    [
        ({(0, Z): 1.0}, "car body bounce"), ({(0, PITCH): 1.0}, "car body pitch"),
        ({(0, YAW): 1.0}, "car body yaw"), ({(0, X): 1.0}, "car body longitudinal"),
        ({(0, Y): 1.0, (0, ROLL): 0.5}, "lower sway"),
        ({(0, Y): 1.0, (0, ROLL): -0.5}, "upper sway"),
        ({(0, Y): 1j, (0, ROLL): 0.5j + 0.1}, "lower sway"),
        # 51 % and 49 % of the energy in the car body
        ({(0, Z): 1.0, (1, Z): np.sqrt(40.0 / 3.0 * 0.49 / 0.51)}, "car body bounce"),
        ({(0, Z): 1.0, (1, Z): np.sqrt(40.0 / 3.0 * 0.51 / 0.49)}, "bogie bounce, front"),
        ({(1, Z): 1.0, (2, Z): 1.0}, "bogie bounce, in phase"),
        ({(1, Z): 1.0, (2, Z): -1.0}, "bogie bounce, out of phase"),
        ({(1, PITCH): 1.0, (2, PITCH): 0.05}, "bogie pitch, front"),
        ({(1, PITCH): 0.05, (2, PITCH): 1.0}, "bogie pitch, rear"),
        ({(1, ROLL): 1.0, (2, ROLL): 0.2}, "bogie roll, in phase"),
        ({(1, Y): 1.0, (2, Y): -0.2}, "bogie lateral, out of phase"),
        ({(1, YAW): 1.0, (2, YAW): 1.0}, "bogie yaw, in phase"),
        ({(1, X): 1.0, (2, X): 1.0j + 0.1}, "bogie longitudinal, in phase"),
        (wheelsets(Z, [1.0, 1.0, -1.0, 1.0]), "wheelsets vertical"),
        (wheelsets(Z, [1.0, 0.6, 0.0, 0.0]), "wheelsets vertical, front"),
        (wheelsets(Z, [1.0, 0.5, 0.0, 0.0]), "wheelset vertical, front.outer"),
        (wheelsets(PITCH, [0.0, 0.0, 1.0, 1.0]), "wheelsets rotation, rear"),
        (wheelsets(X, [1.0, 0.0, 1.0, 0.0]), "wheelsets longitudinal, front.outer and rear.inner"),
        (wheelsets(Y, [1.0, 0.3, 0.0, 0.0]) | wheelsets(YAW, [ROLLS, 0.3 * ROLLS, 0.0, 0.0]),
         "front hunting"),
        (wheelsets(Y, [0.2, 0.0, 0.0, 1.0]) | wheelsets(YAW, [0.2 * ROLLS, 0.0, 0.0, 1.29 * ROLLS]),
         "rear hunting"),
        (wheelsets(Y, [0.0, 0.0, 0.0, 1.0]) | wheelsets(YAW, [0.0, 0.0, 0.0, 1.31 * ROLLS]),
         "wheelset lateral, rear.outer"),
        (wheelsets(Y, [0.0, 0.0, 0.0, 1.0]) | wheelsets(YAW, [0.0, 0.0, 0.0, 0.69 * ROLLS]),
         "wheelset lateral, rear.outer"),
        # 44 and 46 degrees from a right angle
        (wheelsets(Y, [1.0]) | wheelsets(YAW, [ROLLS * np.exp(1j * np.radians(44.0))]),
         "front hunting"),
        (wheelsets(Y, [1.0]) | wheelsets(YAW, [ROLLS * np.exp(1j * np.radians(46.0))]),
         "wheelset lateral, front.outer"),
        # a body that moves sideways twice as far, and farther
        (wheelsets(Y, [1.0] * 4) | wheelsets(YAW, [ROLLS] * 4) | {(1, Y): 1.9}, "front hunting"),
        (wheelsets(Y, [1.0] * 4) | wheelsets(YAW, [ROLLS] * 4) | {(1, Y): 2.1},
         "bogie lateral, front"),
    ],
)  # fmt: skip
def test_a_mode_is_named_by_what_moves(moves, name):
    assert named(moves) == name


def test_other_bodies_and_free_rolling_have_their_names():
    all_along = {(b, X): 1.0 for b in range(7)} | {(3 + w, PITCH): 2.0 for w in range(4)}
    assert named(all_along, complex(0.0, 0.04)) == "rolling"
    assert named(all_along, complex(0.0, 0.06)) == "car body longitudinal"
    tanks = ("carbody.tank_upper", *BODIES[1:])
    assert named({(0, YAW): 1.0}, bodies=tanks) == "tank upper yaw"
    assert named({(0, Z): 1.0, (1, Z): 1.0}, cars=(0, 1)) == "car bodies bounce"


def test_axle_hung_motors_have_their_name_and_are_compared_with_their_like():
    """Of the bogies only like bodies tell the phase: a motor says nothing of another's frame."""
    bodies = ("front.frame", "front.motor", "rear.motor", *BODIES[3:])

    def name(moves):
        return named(moves, bodies=bodies, cars=())

    assert name({(1, Z): 1.0, (2, Z): -1.0}) == "motor bounce, out of phase"
    assert name({(1, PITCH): 1.0, (2, PITCH): 0.05}) == "motor pitch, front"
    assert name({(0, Z): 1.0, (2, Z): -0.5}) == "bogie bounce"


# motion -----------------------------------------------------------------------------------------


@settings(max_examples=25)
@given(
    sizes=st.lists(st.floats(1e-4, 8e-3), min_size=2, max_size=4, unique=True),
    frequency=st.floats(1.0, 9.0), offset=st.floats(-2e-3, 2e-3), seed=SEEDS,
)  # fmt: skip
def test_amplitude_frequency_and_force_of_a_stretch_of_sines(sizes, frequency, offset, seed):
    phases = np.random.default_rng(seed).uniform(0.0, 6.3, len(sizes))
    time = np.arange(0.0, 4.0, 1.0 / 400.0)
    waves = np.sin(2.0 * np.pi * frequency * time[:, None] + phases)
    seen = Stretch(np.zeros(3), time, offset + waves * sizes, 2e6 * waves * sizes + 1e3)
    # between samples the largest value is missed by (pi f/400)^2/2 of the amplitude
    assert seen.amplitude == pytest.approx(max(sizes), rel=3e-3)
    assert seen.frequency == pytest.approx(frequency, rel=2e-3)
    exact = np.max(np.sqrt(np.mean((2e6 * waves * sizes + 1e3) ** 2, axis=0)))
    assert seen.sum_Y_rms == pytest.approx(exact, rel=1e-9)
    still = Stretch(np.zeros(3), time, np.zeros((len(time), 1)), np.zeros((len(time), 1)))
    assert np.isnan(still.frequency)


def test_branches_give_the_speeds_at_which_a_curve_passes_limits_and_where_it_ends():
    """Amplitude 2 mm sqrt(v - 60) up to 64 m/s, where it jumps to 8 mm; at rest below."""
    speeds = np.arange(58.0, 70.01, 0.1)
    large = np.where(speeds < 64.05, 2e-3 * np.sqrt(np.maximum(speeds - 60.0, 0.0)), 8e-3)
    points = [
        Point(float(v), float(a), 5.0, 4e6 * float(a)) for v, a in zip(speeds, large, strict=True)
    ]
    up, down = Branch("up", points), Branch("down", points[::-1])
    for branch in (up, down):
        assert lowest_of([branch]).speed == pytest.approx(60.1)
        for limit in (1e-3, 2.5e-3, 3.9e-3):
            found = first_beyond([branch], limit, "amplitude", 70.0)
            assert found.speed == pytest.approx(60.0 + (limit / 2e-3) ** 2, abs=0.02)
            force = first_beyond([branch], 4e6 * limit, "sum_Y_rms", 70.0)
            assert force.speed == pytest.approx(found.speed)
        beyond = first_beyond([branch], 5e-3, "amplitude", 70.0)
        assert (beyond.speed, beyond.reached) == (pytest.approx(64.1), True)
        assert branch.amplitude_at(62.25) == pytest.approx(2e-3 * np.sqrt(2.25), rel=1e-3)
        assert branch.nearest(61.04).speed == pytest.approx(61.0)
        slow, fast = branch.pieces()
        assert (slow[0].speed, fast[0].speed) == pytest.approx((60.1, 64.1))
    (jump,) = jumps([up])
    assert (jump.speed, jump.amplitude, jump.to) == pytest.approx((64.0, 4e-3, 8e-3))
    (back,) = jumps([down])
    assert (back.direction, back.speed, back.to) == (
        "down",
        pytest.approx(64.1),
        pytest.approx(4e-3),
    )
    assert not jumps([Branch("continuation", points)])


@pytest.mark.parametrize("rounding", [0.0, 1e-17, -1e-17])
def test_a_double_zero_is_two_zeros_however_it_is_rounded(rounding):
    """A free mass beside an oscillator; the rounding would make it a pair, or a growth of 3e-9."""
    matrix = np.zeros((4, 4))
    matrix[0, 1], matrix[1, 0] = 1.0, rounding
    matrix[2:, 2:] = [[0.0, 1.0], [-4.0, -0.4]]
    found = eigenmodes(Linearisation(("x", "v", "y", "w"), matrix, np.zeros(4), 1.0))
    assert found.eigenvalues[:2].tolist() == [0.0, 0.0]
    assert len(found.eigenvalues) == 3
