"""Steps of the fast scheme by themselves, not compiled: their formulas, and where they divide."""

from types import SimpleNamespace as Record

import numpy as np
import pytest
from dynamics import rotation

from railsim.kernels import step_division, step_fast, system
from railsim.kernels.actuators import ACTION, AXLE
from railsim.kernels.contact_columns import (
    CONTACT_JACOBIAN,
    J_ALONG,
    J_NORMAL,
    J_SECANT,
    J_SECANT_C_Z,
    J_SECANT_YAW,
    J_SLIP,
)
from railsim.kernels.rails import BEND_ROLL, BEND_Z, PLANE_SIZE, THIRD_ROLL, THIRD_Z
from railsim.kernels.state import ARC_LENGTH, LAST_STEP, SPEED, TIME
from railsim.kernels.step_fast import BODY_SMOOTHING, RAIL_FACTOR, SMOOTHING
from railsim.kernels.system import (
    AXLEBOX,
    COS_PITCH,
    COS_ROLL,
    HORIZON,
    I_1,
    I_2,
    I_3,
    IMPLICIT,
    MASS,
    MAX_PARTS,
    PART_SHARE,
    RIGID,
    SECTIONS,
    SHARE,
    SIN_PITCH,
    SIN_ROLL,
    WHEELSET,
)
from railsim.kernels.track_frame import FRAME_SIZE, OMEGA_S

KIND = np.array([RIGID, WHEELSET, AXLEBOX, WHEELSET])
N, M = len(KIND), 2  # bodies, internal states
LAST = slice(12 * N + M, 18 * N + M)  # smoothed accelerations


def vehicle(seed, *, elastic=0, irregular=0):
    """System, work arrays, state and derivative at random, without damping by contacts.

    Something drives the last wheelset; angles against the frames are finite.
    """
    random = np.random.default_rng(seed)
    row, plane = random.uniform(0.5, 1.5, (N, 8)), random.normal(size=(2, PLANE_SIZE))
    codes = np.zeros((1, 8), int)
    codes[0, ACTION] = AXLE + 1
    given = Record(
        bodies=Record(kind=KIND, row=row, frame=np.array([1, 0, 0, 1])),
        internal=Record(kind=np.zeros(M)), curves=None, support=Record(elastic=elastic),
        track=Record(has_irregularity=irregular), drive=Record(mode=0, table=None),
        drives=Record(body=np.array([[0, 3]])), contact=Record(transient=0, body=np.array([1, 3])),
        actuators=Record(body=np.array([[0, 1]]), codes=codes),
    )  # fmt: skip
    angles, relative = random.normal(0.0, 0.4, (N, 2)), random.normal(size=(N, 20))
    relative[:, [SIN_ROLL, SIN_PITCH]] = np.sin(angles)
    relative[:, [COS_ROLL, COS_PITCH]] = np.cos(angles)
    jacobian, drive = np.zeros((N, CONTACT_JACOBIAN)), random.normal(size=(M, 2))
    work = Record(
        relative=relative, frames=random.normal(size=(2, FRAME_SIZE)), drive=drive, plane=plane,
        contact_jacobian=jacobian,
    )  # fmt: skip
    state, derivative = random.normal(size=(2, 18 * N + 2 * M + 4))
    state[SPEED] = 3.0
    return given, work, state, derivative


def weights(kind, number, *, elastic, irregular):
    """Weights of the last acceleration in the smoothed one, of the six speeds of a body."""
    weight = np.full(6, SMOOTHING)
    if kind != AXLEBOX and elastic:
        weight[:] = 1.0
    elif kind != AXLEBOX and irregular:
        weight[:] = SMOOTHING if kind == WHEELSET else BODY_SMOOTHING
        weight[1] = 1.0 if kind == WHEELSET else BODY_SMOOTHING
    if number == 3:  # driven
        weight[4] = SMOOTHING
    return weight


@pytest.mark.parametrize("before", [0.01, 0.013, -0.004, 0.0, 1e-5])
@pytest.mark.parametrize("rails", [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_a_step_is_that_of_its_formulas(rails, before, monkeypatch, plain):
    """Speeds in the middle of steps and after them, coordinates, drives and the way travelled."""
    elastic, irregular = rails
    h, track = 0.01, []
    given, work, state, derivative = vehicle(4, elastic=elastic, irregular=irregular)
    plain(step_fast)
    monkeypatch.setattr(step_fast, "store_wheelset_motion", lambda *_: track.append("stored"))
    monkeypatch.setattr(step_fast, "step_support", lambda *a: track.append(a[3:]))
    monkeypatch.setattr(
        step_fast, "state_after", lambda _0, _1, i, *a: (i + 1.0) * np.dot(a, POWERS)
    )
    monkeypatch.setattr(step_fast, "ends_pad", lambda *_: False)
    state[LAST_STEP], decay, start = before, np.array([0.3, 0.6]), state.copy()
    step_fast.step_fast(given, work, state, derivative, decay, h)
    last = abs(before) or h
    for b, kind in enumerate(KIND):
        at, rates = slice(6 * b, 6 * b + 6), slice(6 * (N + b), 6 * (N + b) + 6)
        a, smooth = derivative[rates], start[LAST][at]
        middle = start[rates] + 0.5 * (last - h) * (a - smooth) + h * (a - 0.5 * smooth)
        moved, turned = (middle - start[rates])[:3], (middle - start[rates])[3:]
        if kind != AXLEBOX:
            C, f = work.relative[b, :9].reshape(3, 3), given.bodies.frame[b]
            turned = turned - 0.5 * h * 9.0 * C.T @ work.frames[f, OMEGA_S : OMEGA_S + 3]
            sr, cr, sp, cp = work.relative[b, [SIN_ROLL, COS_ROLL, SIN_PITCH, COS_PITCH]]
            # columns: the body's angular velocity for a rate of roll, pitch and yaw of one
            roll, pitch = rotation(np.arctan2(sr, cr), 0), rotation(np.arctan2(sp, cp), 1)
            columns = [pitch.T[:, 0], [0.0, 1.0, 0.0], pitch.T @ roll.T[:, 2]]
            turned = np.linalg.solve(np.transpose(columns), turned)
        changes = [*(start[rates][:3] + moved), *(derivative[at][3:] + turned)]
        weight = weights(kind, b, elastic=elastic, irregular=irregular)
        new = smooth + weight * (a - smooth)
        if irregular and not elastic and kind == WHEELSET:
            third = work.plane[list(given.contact.body).index(b), [THIRD_Z, THIRD_ROLL]]
            new[2:4] += RAIL_FACTOR * h * 27.0 * third
        assert state[at] - start[at] == pytest.approx(h * np.array(changes))
        assert state[LAST][at] == pytest.approx(new)
        assert state[rates] == pytest.approx(middle + 0.5 * h * new)
    drives, (now, slope) = start[18 * N + M : 18 * N + 2 * M], work.drive.T
    ahead = now + 0.5 * (h / last if h < 100.0 * last else 0.0) * (now - drives)
    inside = [start[12 * N : 12 * N + M], ahead, slope, np.full(M, h), decay]
    assert state[12 * N : 12 * N + M] == pytest.approx(POWERS @ inside * [1.0, 2.0])
    assert list(state[18 * N + M : 18 * N + 2 * M]) == list(now)
    v, change = 3.0, derivative[SPEED]
    way = h * v + 0.5 * h * h * change
    assert (state - start)[[ARC_LENGTH, SPEED, TIME]] == pytest.approx([way, h * change, h])
    assert state[LAST_STEP] == h
    assert track == (["stored", (h, last)] if elastic else [])


POWERS = np.array([1.0, 0.5, 0.25, 0.125, 0.0625])


def test_a_speed_that_is_given_over_the_way_is_met_after_each_step(plain):
    plain(step_fast)
    (given, _, state, derivative), h = vehicle(5), 0.01
    given.drive = Record(mode=system.TABLE, table=np.array([[-50.0, 0.0], [50.0, 40.0]]))
    way = state[ARC_LENGTH] + h * 3.0 + 0.5 * h * h * derivative[SPEED]
    step_fast.advance_position(given.drive, state, derivative, h)
    assert (state[ARC_LENGTH], state[SPEED]) == pytest.approx((way, 0.4 * (way + 50.0)))


@pytest.mark.parametrize("action", [AXLE, AXLE + 1])
def test_an_actuator_on_an_axle_has_its_spin_smoothed(action, monkeypatch, plain):
    """The spin of the wheelset that it acts on alone, as that of one with a drive."""
    given, work, state, derivative = vehicle(6, elastic=1)
    plain(step_fast)
    monkeypatch.setattr(step_fast, "store_wheelset_motion", lambda *_: None)
    monkeypatch.setattr(step_fast, "step_support", lambda *_: None)
    monkeypatch.setattr(step_fast, "state_after", lambda *_: 0.0)
    monkeypatch.setattr(step_fast, "ends_pad", lambda *_: False)
    given.actuators.codes[0, ACTION], start = action, state[LAST].copy()
    step_fast.step_fast(given, work, state, derivative, np.zeros(M), 0.01)
    share = (state[LAST] - start) / (derivative[6 * N : 12 * N] - start)
    expected = np.ones((N, 6))
    expected[2], expected[3, 4] = SMOOTHING, SMOOTHING
    expected[1, 4] = SMOOTHING if action == AXLE else 1.0
    assert share.reshape(N, 6) == pytest.approx(expected)


@pytest.mark.parametrize("steps", [(1e-3, 1e-3), (1e-3, 3.0), (3.0, 1e-3), (3.0, 3.0)])
@pytest.mark.parametrize("slides", [False, True])
def test_damping_by_contacts_is_implicit_as_far_as_it_is_fast(slides, steps, plain):
    """Slip along the track with the lever of its patches, yaw, and y, z, roll in one matrix."""
    given, work, _, _ = vehicle(8)
    plain(step_fast)
    h, h_0 = steps
    J, b, row = work.contact_jacobian, 1, given.bodies.row[1]
    lever, secant = 0.45, 2.0
    J[b, [J_ALONG, J_SECANT, J_SECANT_C_Z]] = 0.0 if slides else 1.7, secant, secant * lever
    J[b, J_SECANT_YAW], J[b, J_SLIP : J_SLIP + 6] = 1.2, [0.9, 0.1, 0.2, 0.8, 0.1, 0.7]
    J[b, J_NORMAL : J_NORMAL + 9] = 0.1 * np.arange(9.0)
    random = np.random.default_rng(2)
    rate, smooth = random.normal(size=(2, 6 * N))
    change, expected = (rate - smooth)[6:12], rate.copy()
    G, inverse = np.array([1.0, lever]), np.diag(1.0 / row[[MASS, I_2]])
    step = max(h, h_0)
    z = step * secant * G @ inverse @ G
    along = max(J[b, J_ALONG], min(1.0, 1.4 - 1.0 / z) * secant)
    for at, D, inv, length in (
        ([0, 4], along * np.outer(G, G), inverse, step),
        ([5], np.array([[1.2 * along / secant]]), np.eye(1) / row[I_3], h_0),
    ):
        theta = step_fast.implicitness(length * np.trace(inv @ D))
        new = np.linalg.solve(np.eye(len(at)) + theta * length * inv @ D, change[at])
        expected[6 + np.array(at)] = smooth[6 + np.array(at)] + new
    step_fast.damp_cross_section(
        J, b, expected, smooth, 6, 1.0 / row[MASS], 1.0 / row[I_1], h_0
    )  # tested by itself
    step_fast.damp_contact(given.bodies, work, b, rate, smooth, h, h_0)
    assert rate == pytest.approx(expected)


def test_memory_begins_with_the_accelerations_of_wheelsets_on_their_rails(monkeypatch, plain):
    """As if all had been the same before; on irregular rails V^2 times their bend is known."""
    given, work, state, derivative = vehicle(12, irregular=1)
    plain(step_fast)
    seen = {}

    def damp(_bodies, _work, b, _rate, smooth, h, h_0):
        seen[b] = (smooth[6 * b : 6 * b + 6].copy(), h, h_0)

    monkeypatch.setattr(step_fast, "damp_contact", damp)
    step_fast.start_memory(given, work, state, derivative, 0.01)
    for w, b in enumerate(given.contact.body):
        z, roll = 9.0 * work.plane[w, [BEND_Z, BEND_ROLL]]
        assert seen[b][0] == pytest.approx([0.0, 0.0, z, roll, 0.0, 0.0])
        assert seen[b][1:] == (0.01, 0.01)
    assert sorted(seen) == [1, 3]
    assert list(state[LAST]) == list(derivative[6 * N : 12 * N])
    assert list(state[18 * N + M : 18 * N + 2 * M]) == list(work.drive[:, 0])
    assert state[LAST_STEP] == 0.0


def division(rates=(0.0, 0.0), most=8, last=1e-3, implicit=0.0, elastic=0, near=0):
    """What `required_division` says of two wheelsets whose forces change by shares of their loads.

    A step of 1 ms; a share of 0.2 divides it, its parts are for 0.1 each, at most eight.
    """
    state, stepping, counts = np.zeros(8), np.zeros(9), np.zeros(8, int)
    state[LAST_STEP], counts[MAX_PARTS] = last, most
    stepping[[SHARE, PART_SHARE, IMPLICIT, SECTIONS]] = 0.2, 0.1, implicit, 3.0
    rails, load = Record(range_row=np.zeros((near, 2))), np.array([50e3, 40e3])
    model = Record(
        contact=Record(body=np.zeros(2), load=load, rails=rails), support=Record(elastic=elastic)
    )
    work = Record(stepping=stepping, counts=counts, force_rate=np.array(rates) * load / 1e-3)
    return step_division.required_division(model, work, state, 1e-3)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, (-1, 2)),
        ({"rates": (0.19, 0.19)}, (-1, 2)),
        ({"rates": (0.21, 0.19)}, (0, 3)),
        ({"rates": (0.21, 0.45)}, (1, 5)),
        ({"rates": (0.45, 0.21)}, (0, 5)),
        ({"rates": (0.0, 9.0)}, (1, 8)),
        ({"rates": (0.0, 9.0), "most": 0}, (-1, 2)),
        ({"rates": (0.08, 0.095), "near": 1}, (1, 3)),  # three times as much where rails change
        # behind a part of a long step on rigid rails: parts at most twice as long, and a limit of
        # half a part's share
        ({"last": 0.21e-3, "implicit": 1.0}, (0, 3)),
        ({"last": 0.25e-3, "implicit": 1.0}, (0, 2)),
        ({"last": -0.2e-3, "implicit": 1.0}, (0, 3)),
        ({"last": 0.01e-3, "implicit": 1.0}, (0, 8)),
        ({"last": 0.6e-3, "implicit": 1.0}, (-1, 2)),
        ({"last": 0.6e-3, "implicit": 1.0, "rates": (0.0, 0.06)}, (1, 2)),
        ({"last": 0.6e-3, "implicit": 0.0, "rates": (0.0, 0.06)}, (-1, 2)),
        ({"last": 0.6e-3, "implicit": 1.0, "rates": (0.0, 0.06), "elastic": 1}, (-1, 2)),
        ({"last": 1e-3, "implicit": 1.0, "rates": (0.0, 0.06)}, (-1, 2)),
        ({"last": 0.0, "implicit": 1.0, "rates": (0.0, 0.06)}, (-1, 2)),
        ({"last": 0.2e-3, "implicit": 1.0, "elastic": 1}, (-1, 2)),
    ],
)
def test_steps_are_divided_where_a_force_changes_by_more_than_its_share(
    changes, expected, monkeypatch, plain
):
    plain(step_division)
    monkeypatch.setattr(step_division, "near_range", lambda _system, _state, w: w == 1)
    assert division(**changes) == expected


@pytest.mark.parametrize(("parts", "horizon"), [(0, 0.0), (1, 2e-3)])
def test_decays_and_the_horizon_are_those_of_the_step(parts, horizon, monkeypatch, plain):
    plain(step_division)
    seen = []
    monkeypatch.setattr(step_division, "set_decays", lambda *a: seen.append(a))
    counts = np.zeros(8, int)
    counts[MAX_PARTS] = parts
    work = Record(stepping=np.zeros(9), counts=counts, decay="whole", decay_part="part")
    step_division.prepare_steps(Record(internal="states"), work, 2e-3)
    assert work.stepping[HORIZON] == horizon
    assert np.isnan(work.stepping[system.RAILS_AT])
    for _ in range(2):
        step_division.begin_division(Record(internal="states"), work, 1e-3)
    assert seen == [("states", 2e-3, "whole"), *[("states", 1e-3, "part")] * 2]
    assert counts[system.DIVIDED_STEPS] == 2
