"""Normal forces of wheels by themselves, not compiled: the gradient of their energy."""

from types import SimpleNamespace as Record

import numpy as np
import pytest
from dynamics import rotation
from scipy.optimize import approx_fprime

from railsim.kernels import contact_table, table_ends, wheel_contact
from railsim.kernels.contact_columns import (
    ANGLE_COS,
    ANGLE_SIN,
    B_E_PHI,
    B_K,
    B_K2,
    B_LEVER,
    B_RADIUS,
    B_RATE,
    B_RISE,
    BUMP_SIZE,
    CONTACT_JACOBIAN,
    FOOT_X,
    FOOT_X_PER_YAW,
    FOOT_Y,
    FOOT_Z,
    FORCE_PER_Z,
    GEOMETRIC_STIFFNESS,
    MU_N,
    NORMAL,
    NORMAL_DAMPING,
    PATCH_ROWS,
    PENETRATION,
    RISE,
    W_LIFT,
    W_Q,
    W_Y,
    WHEEL_COLUMNS,
    A,
    B,
)
from railsim.kernels.contact_table import (
    A1,
    B1,
    BELOW_Y,
    C_Y,
    C_Z,
    D_B1,
    D_C_Y,
    D_C_Z,
    D_TAN_GAMMA,
    G_ROLL,
    G_W,
    G_Y,
    INSIDE,
    LOOK_UP_SIZE,
    MIDDLE_SHARE,
    OUTSIDE_ROLL,
    OUTSIDE_W,
    TAN_GAMMA,
    stretched_roll,
)
from railsim.kernels.rails import (
    BEND_Z,
    COSINE,
    FRICTION,
    MIDDLE_Y,
    MIDDLE_Z,
    PLANE_SIZE,
    RAIL_BEND,
    RAIL_SIZE,
    RAIL_SLOPE,
    RATE_CHANGE_SIZE,
    ROLL,
    ROLL_SLOPE,
    SHIFT,
    SHIFT_SLOPE,
    SINE,
    SLOPE_Y,
    SLOPE_Z,
)
from railsim.kernels.state import SPEED
from railsim.kernels.status import INWARD_RANGE, ROLL_RANGE, YAW_RANGE
from railsim.kernels.support import SKIP, SUPPORT_STEP
from railsim.kernels.system import HORIZON, LATERAL, SECTIONS, Z_0

SHEAR, LEVER, EDGE, ROLL_END = 0.3, 0.7, 0.5, 0.02
AHEAD = 0.3  # m/s by which the wheelset gains on its frame
# penetrations of the patches of both wheels: some carry, one just so, one strikes soon, one is far
DEPTHS = np.array([[0.06, 0.09, -1e-3, 0.05, 0.03, -0.2], [1.5e-5, 0.07, -0.2, 0.04, -1e-3, 0.08]])
KINDS = ["plain", "yawed", "section", "beyond", "rolled"]


class Wheelset:
    """The second of two bodies, on rails that rise, lean and go aside, in metres and newtons.

    `kind`: on "plain" rails, "yawed" beyond their nodes, where the "section" changes, there
    "beyond" the tables, or "rolled" beyond them.  Gap, K and K2 are linear in foot, stretched roll,
    yaw squared, place along the rail, so that the energy of the patches can be written down.
    """

    def __init__(self, kind, monkeypatch, plain):
        plain(wheel_contact)
        random = np.random.default_rng(5)
        self.sections = kind not in ("plain", "yawed")
        self.count = 6 if self.sections else 3
        # rails over s: middle y and z, roll of their plane; shift and slope of each
        self.plane, self.shift = 0.2 * random.normal(size=(3, 3)), random.normal(size=(2, 2))
        self.slope, self.motion = 0.1 * random.normal(size=(2, 2)), random.normal(size=(2, 4))
        self.shift, self.motion, self.height = 0.1 * self.shift, 0.1 * self.motion, 0.4
        # s, y, z, roll and yaw, the roll such that it is `lean` against the rails
        s, yaw, beyond = 0.3, 0.15, kind in ("beyond", "rolled")
        if kind in ("yawed", "beyond"):
            yaw = 1.216  # 1.05 against the left rail, 1.39 against the right one
        lean = (self.plane[2] @ [1.0, s, s * s]) - yaw * (self.plane[1] @ [0.0, 1.0, 2.0 * s])
        lean += 0.05 if beyond else 0.012
        self.x = np.array([s, 1.3 if kind == "beyond" else 0.1, -0.2, lean, yaw])
        self.rate = np.array([2.0, *random.normal(size=4)])  # of s, y, z, roll and yaw
        self.fields = 0.2 * random.normal(size=(2, self.count, 3, 5))
        self.fields[:, :, 1:, 0] = 2.0
        self.fields[..., 4] *= self.sections
        self.fields[:, :, 0, 0] += self.patches(self.x)[0] - DEPTHS[:, : self.count]
        self.shape = random.uniform(0.2, 0.5, (2, self.count, LOOK_UP_SIZE))
        rails = Record(
            range_of=np.zeros((int(self.sections), 1, 2)), piece=np.array([[0, 2, 0]]),
            lever=np.array([LEVER]), shear=np.full(1, SHEAR),
        )  # fmt: skip
        row, state = np.zeros((2, Z_0 + 1)), np.zeros(40)
        row[1, Z_0] = self.height
        self.system = Record(
            contact=Record(
                body=np.ones(1, int), table=np.array([[0, 1]]), rails=rails, damping=0.0,
                surface_of=np.full((int(self.sections), 2, 3), -1),
                values=np.full((2, 3, 1, 1, 1, 1), -9.0),
                shear=np.full(2, SHEAR), coupling=np.zeros((2, 2)),
            ),
            bodies=Record(kind=np.zeros(2), row=row),
            support=Record(elastic=0), track=Record(has_irregularity=False),
        )  # fmt: skip
        state[[7, 8, 9, 11]], state[[19, 20]] = self.x[1:], self.rate[1:3]
        state[[SPEED, 18]] = 2.0, AHEAD
        self.state, self.side = state, 0
        self.work = self.arrays(random)
        for name in ("find_cell", "set_cell_weights", "look_up", "look_up_rail", "clamp"):
            monkeypatch.setattr(wheel_contact, name, getattr(self, name))
        monkeypatch.setattr(wheel_contact, "position_in_range", self.position_in_range)
        self.far, self.reaches = np.array(DEPTHS < -0.1), {}
        monkeypatch.setattr(wheel_contact, "is_far", self.is_far)
        monkeypatch.setattr(contact_table, "HALF_LOAD", 0.02)

    def arrays(self, random):
        """What a step works on."""
        s, plane, rail = self.x[0], np.zeros((1, PLANE_SIZE)), np.zeros((1, 2, RAIL_SIZE))
        value, slope = self.plane @ [1.0, s, s * s], self.plane @ [0.0, 1.0, 2.0 * s]
        plane[0, [MIDDLE_Y, MIDDLE_Z, ROLL]], plane[0, [SLOPE_Y, SLOPE_Z, ROLL_SLOPE]] = (
            value,
            slope,
        )
        plane[0, [SINE, COSINE, BEND_Z]] = np.sin(value[2]), np.cos(value[2]), 2 * self.plane[1, 2]
        rail[0, :, SHIFT], rail[0, :, SHIFT_SLOPE] = self.shift @ [1.0, s], self.shift[:, 1]
        rail[0, :, RAIL_SLOPE], rail[0, :, RAIL_BEND] = self.slope @ [1.0, s], self.slope[:, 1]
        rail[0, :, FRICTION] = 0.3, 0.4
        acceleration = np.zeros((2, 6))
        acceleration[1, [3, 5]] = self.rate[3:]
        return Record(
            plane=plane, rail=rail, rail_motion=self.motion[None], acceleration=acceleration,
            rail_force=random.normal(size=(2, 6)), contact_jacobian=np.zeros((2, CONTACT_JACOBIAN)),
            wheelset=np.zeros(10), laws=np.full(80, 1e-3), stepping=np.zeros(9),
            force_rate=np.zeros(1), events=np.zeros((1, 8), int), weights=np.zeros(16),
            stiffness=np.zeros(12), approach=np.zeros(6), look_up=np.zeros(7 * LOOK_UP_SIZE),
            wheel=random.normal(size=(1, 2, WHEEL_COLUMNS)), bump=np.zeros((6, BUMP_SIZE)),
            rate_change=np.zeros((2, RATE_CHANGE_SIZE)), patch=np.zeros((PATCH_ROWS, 12)),
            patch_index=np.zeros((12, 3), int),
        )  # fmt: skip

    def evaluate(self):
        """Number of patches that carry, after all forces have been found."""
        status, _, n = wheel_contact.add_normal_contact(self.system, self.work, 2.0, self.state)
        assert status == 0
        return n

    # in place of the tables

    def position_in_range(self, _system, state, _w, side, _k, yaw):
        self.side = side
        return (self.x[0] - (2 * side - 1) * LEVER * yaw, 0) if self.sections else (0.0, -1)

    def is_far(self, _contact, table, patch, *cell):
        self.reaches[table, patch] = cell[-1]
        return self.far[table, patch]

    def find_cell(self, _contact, table, y, roll, stretched, yaw_2):
        self.side = self.side if self.sections else table
        return INSIDE, 0, 0, 0, y - SHEAR * roll, stretched, yaw_2

    def set_cell_weights(self, _contact, foot, stretched, slope, weights):
        weights[:3] = foot, stretched, slope

    def clamp(self, _rails, y, roll, stretched, slope):
        foot, end = y - SHEAR * roll, np.clip(roll, -ROLL_END, ROLL_END)
        if end != roll:
            stretched, slope = stretched_roll(end)
        return stretched, slope, foot - np.clip(foot, -EDGE, EDGE), roll - end

    def look_up(
        self, _contact, _table, patch, _iy, _ir, _iw, yaw_2, weights, out, first, place=0.0
    ):
        c, (foot, stretched, slope) = self.fields[self.side, patch], weights[:3]
        out[first : first + LOOK_UP_SIZE] = self.shape[self.side, patch]
        out[first : first + 3] = c @ [1.0, foot, stretched, yaw_2, place]
        out[first + G_Y : first + G_Y + 3] = c[:, 1]
        out[first + G_ROLL : first + G_ROLL + 3] = slope * c[:, 2] - SHEAR * c[:, 1]
        out[first + G_W : first + G_W + 3] = c[:, 3]

    def look_up_rail(self, _system, work, cell, place, _part, first):
        self.reaches[self.side, first] = cell[4]
        for patch in range(first, first + 3):
            far = self.far[self.side, patch]
            work.approach[patch] = -1.0 if far else 0.0
            if not far:
                k = patch * LOOK_UP_SIZE
                self.look_up(0, 0, patch, 0, 0, 0, cell[3], work.weights, work.look_up, k, place[0])
                g_s, work.bump[patch, B_K], work.bump[patch, B_K2] = self.fields[
                    self.side, patch, :, 4
                ]
                work.bump[patch, B_RISE], work.bump[patch, B_LEVER] = -g_s, place[2]
                work.bump[patch, B_RATE] -= g_s * place[1]
        return 0.0

    # the same from the definitions

    def patches(self, x, t=0.0):
        """Penetrations, K and K2 of all patches."""
        values, (s, y, z, roll, yaw) = np.zeros((3, 2, self.count)), x
        plane, slope = self.plane @ [1.0, s, s * s], self.plane[1] @ [0.0, 1.0, 2.0 * s]
        for side, sign in enumerate((-1.0, 1.0)):
            motion = self.motion[side, :2] + t * self.motion[side, 2:]
            _, across, up = rotation(plane[2], 0).T @ [0, y - plane[0], z - plane[1] + self.height]
            across = sign * (across - self.shift[side] @ [1.0, s] - motion[0])
            lean = sign * (roll - plane[2] + slope * yaw)
            foot, beyond, c = across - SHEAR * lean, 0.0, self.fields[side]
            stretched = stretched_roll(lean)[0]
            if self.sections:
                held, end = np.clip(foot, -EDGE, EDGE), np.clip(lean, -ROLL_END, ROLL_END)
                if end != lean:
                    stretched, per_roll = stretched_roll(end)
                    beyond = c[:, 0, 2] * per_roll * (lean - end)
                beyond, foot = beyond + c[:, 0, 1] * (foot - held), held
            square = (yaw - self.slope[side] @ [1.0, s]) ** 2
            place = s + t * AHEAD - sign * LEVER * yaw
            values[:, side] = (c @ [1.0, foot, stretched, square, place]).T
            values[0, side] = up - self.height - motion[1] - values[0, side] - beyond
        return values

    def energy(self, x):
        """Of the patches' own approaches e, and of the loads that bend each other's surface."""
        total, bent = 0.0, self.system.contact.coupling
        p, *stiffness = np.where(
            self.far[:, : self.count], [[[-1.0]], [[0.0]], [[0.0]]], self.patches(x)
        )
        for side, first in np.ndindex(2, self.count // 3):
            at = slice(3 * first, 3 * first + 3)
            e, (k, k2) = p[side, at].copy(), (one[side, at] for one in stiffness)
            contact_table.couple_approaches.py_func(bent, side, np.array([*k, *k2]), e)
            e = np.maximum(e, 0.0)
            N = k * e**1.5 + k2 * e**2
            total += np.sum(0.4 * k * e**2.5 + k2 * e**3 / 3.0) + bent[side] @ (N[:-1] * N[1:])
        return total


def force_of(patches):
    """Vertical forces of elastic patches."""
    p, k, k2 = np.maximum(patches, [[[0.0]], [[-np.inf]], [[-np.inf]]])
    return k * p**1.5 + k2 * p**2


@pytest.mark.parametrize("bent", [0.0, 0.4])
@pytest.mark.parametrize("kind", KINDS)
def test_normal_forces_are_the_gradient_of_their_energy(kind, bent, monkeypatch, plain):
    """Over all coordinates and along the track, on both sides; the rest is told of each wheel."""
    wheelset = Wheelset(kind, monkeypatch, plain)
    wheelset.system.contact.coupling[:] = [[bent, 0.5 * bent], [0.7 * bent, bent]]
    other = wheelset.work.rail_force[0].copy()
    n, force, wheel = wheelset.evaluate(), wheelset.work.rail_force, wheelset.work.wheel[0]
    gradient = approx_fprime(wheelset.x, wheelset.energy, 1e-7)
    assert force[1, [0, 1, 2, 3, 5]] == pytest.approx(-gradient, rel=2e-5, abs=1e-8)
    assert list(force[0]) == list(other)
    assert force[1, 4] == 0.0
    lean = rotation(wheelset.work.plane[0, ROLL], 0).T
    across, up = (lean @ [0.0, *force[1, 1:3]])[1:]
    assert (wheel[:, W_Y].sum(), wheel[:, W_Q].sum()) == pytest.approx((-across, -up))
    assert wheelset.work.events.sum() == wheelset.work.events[0, 4]
    assert wheelset.work.events[0, 4] == (2 if kind in ("yawed", "beyond") else 0)
    if bent == 0.0:
        assert n == np.count_nonzero(DEPTHS[:, : wheelset.count] > 0.0)
        loads = force_of(wheelset.patches(wheelset.x))
        assert wheel[:, W_Q] == pytest.approx(loads.sum(axis=1))
        assert wheel[:, W_LIFT] == pytest.approx(-DEPTHS[:, : wheelset.count].max(axis=1))


@pytest.mark.parametrize("kind", KINDS)
def test_patches_are_looked_up_that_may_touch_within_a_step(kind, monkeypatch, plain):
    """As far as the wheel stands up, comes closer, and slides along what goes on from an edge."""
    wheelset, reach = Wheelset(kind, monkeypatch, plain), {}
    for horizon in (0.0, 0.01):
        wheelset.work.stepping[HORIZON] = horizon
        wheelset.evaluate()
        reach[horizon] = dict(wheelset.reaches)
    wheels = [wheel_contact.relative_wheel_motion(wheelset.work, 0, side, 2.0) for side in range(2)]
    for (side, patch), first in reach[0.0].items():
        closing = wheel_contact.closing_distance(wheelset.work, side, wheels[side])
        assert reach[0.01][side, patch] - first == pytest.approx(closing)
        aside = roll = 0.0
        if wheelset.sections:
            wheel = wheels[side]
            _, _, aside, roll = wheelset.clamp(None, wheel.y, wheel.roll, 0.0, 0.0)
        assert first == pytest.approx(wheels[side].z + LEVER * roll + 3.0 * abs(aside))


def rates_of(wheelset):
    """Rates of the penetrations, the wheelset and its rails going on as they do."""
    step, rate = 1e-6, wheelset.rate.copy()
    after = wheelset.patches(wheelset.x + step * rate, step)[0]
    return (after - wheelset.patches(wheelset.x - step * rate, -step)[0]) / (2.0 * step)


@pytest.mark.parametrize("kind", KINDS)
def test_patches_are_damped_by_their_rates_and_stand_where_their_normals_meet_the_axle(
    kind, monkeypatch, plain
):
    wheelset = Wheelset(kind, monkeypatch, plain)
    wheelset.system.contact.damping = damping = 0.005
    wheelset.rate[2] = wheelset.state[20] = 3.0  # all come closer
    n, work = wheelset.evaluate(), wheelset.work
    assert n == np.count_nonzero(DEPTHS[:, : wheelset.count] > 0.0)
    rates, loads = rates_of(wheelset), force_of(wheelset.patches(wheelset.x))
    yaws = wheelset.x[4] - wheelset.slope @ [1.0, wheelset.x[0]]
    for (_, side, patch), row in zip(work.patch_index[:n], work.patch.T[:n], strict=True):
        shape, sign, p = wheelset.shape[side, patch], (-1.0, 1.0)[side], DEPTHS[side, patch]
        share = loads[side, patch] / (loads[side, patch] + 0.02)
        tangent = shape[TAN_GAMMA] + share * shape[D_TAN_GAMMA]
        c_y, c_z = (shape[k] + share * shape[d] for k, d in ((C_Y, D_C_Y), (C_Z, D_C_Z)))
        cosine, fade = 1.0 / np.hypot(1.0, tangent), min(1.0, p / 30e-6)
        vertical = loads[side, patch] + damping * cosine**2 * fade * rates[side, patch]
        assert row[[ANGLE_COS, ANGLE_SIN]] == pytest.approx([cosine, sign * tangent * cosine])
        assert row[NORMAL] == pytest.approx(max(vertical, 0.0) / cosine, rel=1e-6)
        assert row[MU_N] == pytest.approx((0.3, 0.4)[side] * row[NORMAL])
        assert row[[PENETRATION, NORMAL_DAMPING]] == pytest.approx([p, damping * fade])
        assert row[B] == pytest.approx(shape[B1] + share * shape[D_B1])
        assert row[[FOOT_Y, FOOT_Z]] == pytest.approx([sign * c_y, c_z])
        # from the patch along its normal to the height of the axle, which is yawed against the rail
        axle = sign * c_y - row[ANGLE_SIN] / row[ANGLE_COS] * c_z
        assert row[[FOOT_X, FOOT_X_PER_YAW]] == pytest.approx([-yaws[side] * axle, -axle])
        middle = shape[B1] + MIDDLE_SHARE * shape[D_B1]
        assert row[A] / shape[A1] == pytest.approx((middle / row[B]) ** 0.39, rel=0.02)


@pytest.mark.parametrize("down", [-1.5, 0.1, 1.5])
@pytest.mark.parametrize("stepping", [(0, 0, 0), (0.02, 4, 0), (1e-3, 0, 2)])
def test_the_change_of_a_contact_force_that_divides_steps(stepping, down, monkeypatch, plain):
    """Of each patch by itself: dV/dt at both rates, what a step of the horizon gains over it."""
    wheelset, damping = Wheelset("plain", monkeypatch, plain), 0.05
    wheelset.rate[2] = wheelset.state[20] = down
    work, (horizon, lateral, sections) = wheelset.work, stepping
    wheelset.system.contact.damping = damping
    work.stepping[[HORIZON, LATERAL, SECTIONS]] = stepping
    work.rate_change[:, :3] = changes = np.array([[0.3, 0.2, -0.1], [-0.2, 0.4, 0.3]])
    values, rates = wheelset.patches(wheelset.x), rates_of(wheelset)
    for side, patch in np.argwhere(values[0] > -0.1):
        wheelset.far[:] = True
        wheelset.far[side, patch] = False  # alone
        wheelset.evaluate()
        (p, k, k2), p_rate = values[:, side, patch], rates[side, patch]
        g_y, g_roll = wheelset.fields[side, patch, 0, 1:3]
        g_roll = stretched_roll(work.wheelset[2])[1] * g_roll - SHEAR * g_y
        aside = g_y * changes[side, 0] + g_roll * changes[side, 2]
        change = changes[side, 1] - (-1.0, 1.0)[side] * aside
        speed, start = max(abs(p_rate), abs(p_rate + change)), max(p, 0.0)
        end = max(start, p + horizon * (p_rate + max(change, 0.0)))
        load, gain = (k * x**1.5 + k2 * x**2 for x in (start, end))
        slope = 1.5 * k * start**0.5 + 2.0 * k2 * start
        rate = max(speed * slope, (gain - load) / (horizon or np.inf))
        if sections > 1:
            fades = np.minimum(1.0, np.array([start, end]) / 30e-6)
            rate += damping * speed * (fades[1] - fades[0]) / horizon
        rate = max(1e-3, rate * max(1.0, lateral * abs(g_y)))
        assert work.force_rate[0] == pytest.approx(rate, rel=1e-4)


def test_a_wheel_with_nothing_near_is_a_metre_above_its_rail(monkeypatch, plain):
    wheelset = Wheelset("plain", monkeypatch, plain)
    wheelset.far[1] = True
    assert wheelset.evaluate() == np.count_nonzero(DEPTHS[0, :3] > 0.0)
    wheel = wheelset.work.wheel[0, 1]
    assert (wheel[W_LIFT], wheel[W_Q], wheel[W_Y]) == (1.0, 0.0, 0.0)
    assert wheelset.work.approach[:3] == pytest.approx([-1.0] * 3)


def test_a_patch_comes_no_closer_than_a_steep_flange_does(plain):
    plain(wheel_contact)
    wheel, change = Record(z_rate=-0.1, y_rate=-0.2), np.zeros((2, RATE_CHANGE_SIZE))
    change[1, :2] = -0.3, -0.4
    work = Record(rate_change=change, stepping=np.array([2.0, *np.zeros(8)]))
    found = wheel_contact.closing_distance(work, 1, wheel)
    assert found == pytest.approx(2.0 * (0.1 + 0.4 + 3.0 * (0.2 + 0.3)))


def test_surfaces_that_are_not_round_bring_their_moments_rates_and_radii(monkeypatch, plain):
    """V e_phi about the axle; a rise takes V along the track at its lever; rates add to dp/dt."""
    wheelset = Wheelset("plain", monkeypatch, plain)
    wheelset.evaluate()
    before, work = wheelset.work.rail_force[1].copy(), wheelset.work
    feet = work.patch[[FOOT_X, FOOT_Z]].copy()
    wheelset.system.contact.surface_of = np.zeros((1, 2))
    work.bump[:] = np.random.default_rng(3).normal(size=work.bump.shape)
    work.bump[:, B_RATE] += 5.0  # all come closer
    monkeypatch.setattr(wheel_contact, "store_surface_heights", lambda *_: 0.0)
    monkeypatch.setattr(wheel_contact, "subtract_height", lambda *_: None)
    n = wheelset.evaluate()
    V, bump = (work.patch[NORMAL] * work.patch[ANGLE_COS])[:n], work.bump[work.patch_index[:n, 2]].T
    along = V @ bump[B_RISE]
    more = [-along, 0, 0, 0, V @ bump[B_E_PHI], V @ (bump[B_LEVER] * bump[B_RISE])]
    assert work.rail_force[1] - before == pytest.approx(more, abs=1e-12)
    assert work.patch[RISE, :n] == pytest.approx(bump[B_RISE])
    moved = work.patch[[FOOT_X, FOOT_Z]] - feet
    assert moved[:, :n] == pytest.approx(bump[[B_E_PHI, B_RADIUS]])
    wheelset.system.contact.damping = 1e-3
    wheelset.evaluate()
    damped = (work.patch[NORMAL] * work.patch[ANGLE_COS])[:n]
    p, rates = work.patch[PENETRATION, :n], rates_of(wheelset)
    rate = np.array([rates[side, patch] for _, side, patch in work.patch_index[:n]]) + bump[B_RATE]
    cosine, fade = work.patch[ANGLE_COS, :n], np.minimum(1.0, p / 30e-6)
    assert damped == pytest.approx(np.maximum(0.0, V + 1e-3 * cosine**2 * fade * rate), rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_forces_on_elastic_rails_have_their_slopes_over_the_height(kind, monkeypatch, plain):
    """Of patches that bend each other too; the contact angle turns by each gap's curvature."""
    wheelset = Wheelset(kind, monkeypatch, plain)
    work, system, step = wheelset.work, wheelset.system, 1e-7
    system.support.elastic, system.contact.load = 1, np.full(1, 1e3)
    system.contact.coupling[:] = 0.3, 0.2
    work.support_step = np.zeros((1, SUPPORT_STEP))
    monkeypatch.setattr(wheel_contact, "gap_curvature", lambda *a: 5.0 + a[2] + 10.0 * a[1])
    loads, lean = [], rotation(work.plane[0, ROLL], 0)
    for z in (step, -step, 0.0):
        wheelset.state[7:9] = wheelset.x[1:3] + (lean @ [0.0, 0.0, z])[1:]
        n = wheelset.evaluate()
        loads.append(work.wheel[0, :, W_Q].copy())
    side, patch = work.patch_index[:n, 1:].T
    found = np.bincount(side, work.patch[FORCE_PER_Z, :n])
    assert found == pytest.approx((loads[0] - loads[1]) / (2.0 * step), rel=1e-5)
    if not wheelset.sections:
        turned = -(work.patch[NORMAL] * work.patch[ANGLE_COS])[:n] * (5.0 + patch + 10.0 * side)
        assert work.patch[GEOMETRIC_STIFFNESS, :n] == pytest.approx(turned)
    work.support_step[0, SKIP], before = 1.0, work.rail_force.copy()
    assert wheelset.evaluate() == 0  # its forces stay
    assert (work.rail_force == before).all()


@pytest.mark.parametrize("kind", ["plain", "section"])
@pytest.mark.parametrize(
    ("code", "status"),
    [(BELOW_Y, INWARD_RANGE), (OUTSIDE_ROLL, ROLL_RANGE), (OUTSIDE_W, YAW_RANGE)],
)
def test_a_wheel_outside_its_table_ends_the_run(code, status, kind, monkeypatch, plain):
    plain(table_ends)
    wheelset = Wheelset(kind, monkeypatch, plain)
    monkeypatch.setattr(wheel_contact, "find_cell", lambda *_: (code, 0, 0, 0, 0.0, 0.0, 0.0))
    found = wheel_contact.add_normal_contact(wheelset.system, wheelset.work, 2.0, wheelset.state)
    assert found == (status, 0, 0)
