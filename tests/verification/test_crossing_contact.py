"""Wing and nose of a crossing carry at once, each as its own contact: against CONTACT.

The range is cut to the transfer from wing to nose, whose tables take some seconds.
"""

import csv
from copy import copy
from pathlib import Path

import numpy as np
import pytest
from dynamics import Settings, advance, energy, undamped
from scipy.optimize import brentq

from railsim.contact.curves import inclined_to_track, wheel_curve
from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.definitions.mirror import mirrored_track, mirrored_vehicle
from railsim.kernels import contact_columns as column
from railsim.kernels.rhs import right_hand_side
from railsim.kernels.support import HEIGHTS
from railsim.kernels.system import HORIZON, RADIUS
from railsim.kernels.time_loop import FAST, Chunk, time_loop
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.time_step import empty_recorder
from railsim.model.uneven_wheels import rolling
from railsim.model.work import work_arrays
from railsim.profiles import load_profile
from railsim.simulation import simulate

pytestmark = pytest.mark.usefixtures("coarse_contact_tables_in_module")
DATA = Path(__file__).parents[1] / "data" / "sections"
NOSE = 50.0  # m, the theoretical nose on the track
ASIDE = 2.5e-3  # m: the results count y from rails 1.430 m apart, the track has 1.435 m
TREAD, ROOT = 0, 1


def crossing(**changes):
    """The transfer from wing to nose, the same as in `test_crossing_runs`: tables are shared."""
    track = load_track("crossing_56e1_r245_1in9.25")
    part = track.sections[0].model_dump(exclude_none=True) | {"begin": 49.6, "end": 50.5}
    return track.replace(sections=[part], check_rail=[], **changes)


def rows_of(name):
    with (DATA / name).open() as lines:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(lines)]


class OneWheel:
    """The leading right wheel held at a position over the crossing, V = 2 m/s; mm and N."""

    def __init__(self):
        settings = load_settings().with_values({"contact_damping": 0.0, "creep_law": "table"})
        track = crossing(support={"preset": "rigid"}, friction=0.3)
        self.model = assemble(load_vehicle("coach_manchester"), track, settings)
        model = self.model
        self.system = rolling(model.system, model.wheels, model.check, model.rails)
        self.rise = model.rails.tables[0].description["rise"]
        self.work = work_arrays(self.system)

    def at(self, s, y, z, down=0.0, aside=0.0):
        """Forces on the rail x, y, z, then the patches of wing and nose: number and column.

        `down`, `aside`: speed of the wheelset [m/s].
        """
        system, work = self.system, self.work
        b, n = int(system.contact.body[0]), len(system.bodies.kind)
        state = np.zeros(self.model.n_state)
        state[-2] = NOSE + 1e-3 * s - system.frame_offset[system.bodies.frame[b]]
        state[-1] = 2.0
        for other in system.contact.body:
            state[6 * other + 2] = -0.02
            state[6 * n + 6 * other + 4] = -4.3481181
        assert system.bodies.row[b, RADIUS] == 0.46
        state[6 * n + 6 * b + 1 : 6 * n + 6 * b + 3] = aside, down
        state[6 * b + 1 : 6 * b + 3] = 1e-3 * y + ASIDE, 1e-3 * z + self.rise
        status, _, count = right_hand_side(system, work, state, np.zeros_like(state))
        assert status == 0
        wheel, patches, x = work.wheel[0, 1], {}, 0.0
        for k in range(count):
            patch = work.patch[:, k]
            if tuple(work.patch_index[k, :2]) != (0, 1):
                continue  # the other wheel, far from any load
            sine, cosine = patch[column.NORMAL_Y], patch[column.NORMAL_Z]
            across = patch[column.TANGENT_Y] * cosine - patch[column.TANGENT_Z] * sine
            x += patch[column.T_X] - patch[column.T_Y] * across
            x += patch[column.NORMAL] * cosine * patch[column.RISE]
            patches[int(work.patch_index[k, 2])] = patch.copy()
        return np.array([x, wheel[column.W_Y], wheel[column.W_Q]]), patches

    def under(self, load, s, y):
        z = brentq(lambda z: self.at(s, y, z)[0][2] - load, -1.5, 0.0, xtol=1e-9)
        return z, *self.at(s, y, z)


@pytest.fixture(scope="module")
def wheel():
    return OneWheel()


def shares(patches):
    """Normal forces of wing and nose."""
    return [
        sum(patch[column.NORMAL] for k, patch in patches.items() if k // 3 == rail)
        for rail in range(2)
    ]


@pytest.fixture(scope="module")
def equal(wheel):
    def difference(y):
        wing, nose = shares(wheel.under(10e3, 239.0, y)[2])
        return wing - nose

    return brentq(difference, 0.93, 1.02, xtol=1e-3)


def test_wing_and_nose_share_the_load_equally_where_they_do_in_contact(equal):
    assert equal == pytest.approx(0.975, abs=0.02)


def test_transfer_from_wing_to_nose(wheel, equal):
    """Each share within 300 N, along the track 200 N, z 0.005 mm; patches within 0.5 mm.

    Across, 350 N of 10 kN: CONTACT takes the angle of the wing's surface 0.2 mm beside the first
    contact, 0.097; the force here is the gradient of the energy, and on the wheel's cone of 1:15
    it has the angle 0.067 (`test_force_across_is_that_of_the_wheels_cone`).
    """
    rows = rows_of("crossing_s239_dev.csv")
    both = [row for row in rows if 0.85 <= row["y_mm"] <= 1.09]
    assert len(both) == 26
    for row in both:
        z, force, patches = wheel.under(10e3, 239.0, row["y_mm"] + equal - 0.975)
        patch = patches[TREAD if row["patch"] == 1 else 3 + ROOT]
        assert patch[column.NORMAL] == pytest.approx(row["Fn_N"], abs=300.0)
        assert force[0] == pytest.approx(row["Fx_N"], abs=200.0)
        assert force[1] == pytest.approx(row["Fy_N"], abs=350.0)
        assert z == pytest.approx(row["z_mm"], abs=0.005)
        assert 1e3 * patch[column.C_X] == pytest.approx(row["xcp_tr_mm"], abs=0.5)
        y = 1e3 * (patch[column.C_Y] + ASIDE) + row["y_mm"]
        assert y == pytest.approx(row["ycp_tr_mm"] + 1e3 * ASIDE, abs=0.5)


def test_beyond_the_tables_a_flange_goes_on_climbing_along_its_force(wheel):
    """Without friction, under a constant load: dz/dy = -Y/Q; the tables end 12 mm aside."""
    smooth, track = copy(wheel), wheel.system.track
    rail = track.rail * np.array([1.0, 1.0, 1.0, 1.0, 0.0, 0.0])[:, None]
    smooth.system = wheel.system._replace(track=track._replace(rail=rail))

    def height(y):
        return brentq(lambda z: smooth.at(239.0, y, z)[0][2] - 10e3, -50.0, 0.0, xtol=1e-9)

    one, other = height(14.0), height(16.0)
    (_, Y, Q), patches = smooth.at(239.0, 15.0, 0.5 * (one + other))
    assert len(patches) == 1
    assert Y / Q > 1.0
    assert 0.5 * (other - one) == pytest.approx(-Y / Q, rel=1e-5)


def test_where_the_rail_slopes_less_of_the_wheel_is_below_its_axle(wheel):
    """By a slope tan t the wheel touches r cos t below its axle: here 12 to 23 um less than r."""
    curve = wheel_curve(load_profile("S1002", "wheel"), 0.46, 0.75, 1e-4)
    for y, rails in ((0.0, {TREAD}), (0.97, {TREAD, 3 + ROOT})):
        patches = wheel.under(10e3, 239.0, y)[2]
        assert set(patches) == rails
        for patch in patches.values():
            r = np.interp(patch[column.FOOT_Y] - 0.75, curve.y, curve.r)
            below = r / np.sqrt(1.0 + patch[column.RISE] ** 2)
            assert patch[column.FOOT_Z] == pytest.approx(below, abs=1e-6)


def test_force_across_is_that_of_the_wheels_cone(wheel, equal):
    """CONTACT's patch forces, the wing's at the angle of the cone of 1:15: within 100 N.

    A cone that goes sideways by dy is one that sinks by dy/15, whatever the rail: without friction
    its lateral force is 1/15 of its vertical one. CONTACT's 0.096 to 0.101 are the rail's alone.
    """
    tread = load_profile("S1002", kind="wheel")
    slope = np.diff(np.interp(1e-3 * np.arange(33.0, 46.0), tread.y, tread.z)) / 1e-3
    np.testing.assert_allclose(slope, -1.0 / 15.0, atol=1e-5)
    rows = [row for row in rows_of("crossing_s239_dev.csv") if 0.81 <= row["y_mm"] <= 1.09]
    for y in sorted({row["y_mm"] for row in rows}):
        across = 0.0
        for row in rows:
            if row["y_mm"] == y:
                on_wing = row["patch"] == 1
                if on_wing:
                    assert 33.0 < row["ycp_rail_mm"] - y < 45.0
                angle = np.arctan(1.0 / 15.0) if on_wing else -row["deltcp_rad"]
                across += row["patch_Fs_N"] * np.cos(angle) + row["Fn_N"] * np.sin(angle)
        _, force, _ = wheel.under(10e3, 239.0, y + equal - 0.975)
        assert force[1] == pytest.approx(across, abs=100.0)


def test_heights_along_the_wing(wheel):
    """Under the load that CONTACT has at a given height, within 0.003 mm."""
    for row in rows_of("crossing_along_dev.csv"):
        z, _, _ = wheel.under(row["Fz_N"], row["s_mm"], row["y_mm"])
        assert z == pytest.approx(row["z_mm"], abs=0.003)


def test_wing_and_flank_of_the_nose(wheel):
    """Two patches of different rails and zones: vertical shares within 600 N, places 0.5 mm.

    A millimetre along the track changes the shares by 2 kN.
    """
    wing, nose = rows_of("wing_rail_two_patches_dev.csv")
    z, _, patches = wheel.under(10e3, wing["s_mm"], wing["y_mm"])
    assert z == pytest.approx(wing["z_mm"], abs=0.005)
    for row, number in ((wing, TREAD), (nose, 3 + ROOT)):
        patch, angle = patches[number], -row["deltcp_rad"]
        vertical = row["Fn_N"] * np.cos(angle) - row["patch_Fs_N"] * np.sin(angle)
        found = patch[column.NORMAL] * patch[column.ANGLE_COS]
        found -= patch[column.T_Y] * patch[column.ANGLE_SIN]
        assert found == pytest.approx(vertical, abs=600.0)
        assert 1e3 * patch[column.C_Y] + row["y_mm"] == pytest.approx(row["ycp_tr_mm"], abs=0.5)
        assert 1e3 * patch[column.C_X] == pytest.approx(row["xcp_tr_mm"], abs=0.5)


def test_energy_is_conserved_over_the_crossing():
    """Without friction and damping, by 0.1 % of the elastic energy of a wheel's contact, 4 J.

    One wheelset runs over it; the others stand on plain rails before and after.
    """
    settings = Settings(contact_damping=0.0, drive={"mode": "free"})
    track = crossing(support={"preset": "rigid"}, friction=(0.0, 0.0))
    balance = equilibrium(assemble(undamped(load_vehicle("coach_manchester")), track, settings), 20)
    model = balance.model
    system = rolling(model.system, model.wheels, model.check, model.rails)
    state = balance.state.copy()
    state[model.index.coordinate("carbody", 0) + 1] += 0.002
    state[-2] = 49.43 - system.frame_offset[system.bodies.frame[system.contact.body[0]]]
    before = energy(model.system, state)
    after = advance(system, state, 3.125e-5, 1760, model=model)
    assert after[-2] - state[-2] > 1.09
    assert abs(energy(model.system, after) - before) < 0.004


HOW = {"start": 38.6, "until": 40.2, "speed": 20.0}


def test_constant_sections_are_plain_rail():
    """A run over sections that are those of the plain rail, to round-off."""
    track = load_track("crossing_56e1_r245_1in9.25").replace(sections=[], check_rail=[])
    rail = load_profile(track.rail[1], kind="rail")
    y, z = inclined_to_track(rail, track.gauge, track.inclination)
    points = {"y": (y - 0.5 * track.gauge - 0.035).tolist(), "z": z.tolist()}
    part = {
        "rail": "right",
        "contours": [{"s": s, **points} for s in (49.0, 50.0, 50.2, 51.0)],
        "gauge_face": -0.035,
        "begin": 49.9,
        "end": 50.5,
    }
    coach = load_vehicle("coach_manchester")
    mine = simulate(coach, track.replace(sections=[part]), **HOW)
    other = simulate(coach, track, **HOW)
    np.testing.assert_allclose(mine["Q"], other["Q"], rtol=1e-10)


def test_foreseen_rate_of_a_rails_height_is_that_of_the_height():
    """On elastic rails; by differences, of 40 steps but those over a kink of the path."""
    settings, h = load_settings().with_values({"creep_law": "table"}), 2e-4
    model = assemble(load_vehicle("coach_manchester"), crossing(), settings)
    system = rolling(model.system, model.wheels, model.check, model.rails)
    state, body = equilibrium(model, 20.0).state.copy(), int(system.contact.body[0])
    state[-2:] = NOSE - 0.1 - system.frame_offset[system.bodies.frame[body]], 20.0
    work, recorder = work_arrays(system), empty_recorder(model, 1)
    derivative, stages, found = np.zeros_like(state), np.zeros((3, len(state))), []
    for fresh in [1] + 40 * [0]:
        chunk = Chunk(1, 1, 1 << 40, fresh=fresh)
        time_loop(system, work, state, derivative, stages, recorder, FAST, h, chunk)
        found.append(work.support_step[0, [HEIGHTS + 1, HEIGHTS + 3]])
    height, rate = np.transpose(found[1:])
    quotient = np.diff(height) / h
    assert np.ptp(quotient) > 1e-5
    assert np.median(np.abs(0.5 * (rate[1:] + rate[:-1]) / quotient - 1.0)) < 0.01


def test_crossing_in_the_mirror():
    coach, track = load_vehicle("coach_manchester"), crossing()
    settings = load_settings().with_values({"output_rate": 1000.0})
    mine = simulate(coach, track, settings=settings, **HOW)
    other = simulate(mirrored_vehicle(coach), mirrored_track(track), settings=settings, **HOW)
    Q = mine["Q"][:, 0, 1]
    assert Q.max() > 1.5 * Q[0]
    np.testing.assert_allclose(mine["Q"], other["Q"][:, :, ::-1], rtol=0.0, atol=1e-3)


def test_a_wheelset_in_the_middle_is_foreseen_the_same_from_both_sides(wheel):
    """Where it stands on a node of the tables, round-off does not decide what its force becomes."""
    work = wheel.work
    work.stepping[HORIZON] = 1e-2
    rates = np.empty((2, 22))
    for k, place in enumerate(np.linspace(-380.0, 460.0, 22)):
        for side, aside in enumerate((-1e-9, 1e-9)):  # mm
            wheel.at(place, aside - 1e3 * ASIDE, -0.3)
            rates[side, k] = work.force_rate[0]
    work.stepping[HORIZON] = 0.0
    np.testing.assert_allclose(rates[1], rates[0], rtol=1e-6)


def test_forces_over_the_crossing_do_not_depend_on_how_far_is_foreseen(wheel):
    """Of a wheel that is pressed onto changing rails; what is foreseen divides steps alone."""
    work, found = wheel.work, []
    for ahead in (0.0, 1e-2):
        work.stepping[HORIZON] = ahead
        for place in np.linspace(-300.0, 460.0, 20):
            wheel.at(place, -1e3 * ASIDE, -0.3, down=0.2)
            found.append(work.rail_force[wheel.system.contact.body[0], :6].copy())
    work.stepping[HORIZON] = 0.0
    without, foreseen = np.reshape(found, (2, 20, 6))
    assert abs(without[:, 2]).max() > 1e4
    np.testing.assert_allclose(foreseen, without, rtol=1e-9, atol=1e-9)


def test_a_flange_that_comes_near_within_a_step_is_foreseen(wheel):
    """While the tread carries; by more than half of what the load will have risen by then."""
    work, ahead, speed, place = wheel.work, 5e-3, 1.0, -380.0
    loads, z = [], wheel.under(30e3, place, -1e3 * ASIDE)[0]
    for y in (0.0, 1e3 * speed * ahead):  # mm
        wheel.at(place, y - 1e3 * ASIDE, z)
        loads.append(-work.rail_force[wheel.system.contact.body[0], 2])
    work.stepping[HORIZON] = ahead
    wheel.at(place, -1e3 * ASIDE, z, aside=speed)
    work.stepping[HORIZON] = 0.0
    assert loads[0] > 1e3
    assert loads[1] > 2.0 * loads[0]
    assert work.force_rate[0] * ahead > 0.5 * (loads[1] - loads[0])


def test_shares_of_the_rails_add_up():
    """Patches of wing and nose are outputs of their own, and Q is their sum."""
    coach, track = load_vehicle("coach_manchester"), crossing()
    settings = load_settings().with_values({"outputs.contact_patches": True, "output_rate": 4000.0})
    run = simulate(coach, track, settings=settings, **HOW)
    assert tuple(run.coordinates["patch"][3:]) == (
        "tread, rail 2",
        "flange root, rail 2",
        "flange, rail 2",
    )
    N, angle, T_y = (run[name][:, 0, 1] for name in ("patch_N", "patch_angle", "patch_T_y"))
    of_rail = (N * np.cos(angle) - T_y * np.sin(angle)).reshape(-1, 2, 3).sum(axis=2)
    # of forces on elastic rails some are changed by their slopes after the evaluation
    np.testing.assert_allclose(of_rail.sum(axis=1), run["Q"][:, 0, 1], rtol=5e-3, atol=100.0)
    place = run["wheelset_distance"][:, 0] - NOSE
    assert (of_rail[place < 0.1, 1] == 0.0).all()
    assert (of_rail[(place > 0.4) & (place < 0.5), 0] == 0.0).all()


@pytest.mark.further
@pytest.mark.parametrize("vehicle", ["coach_manchester", "wagon_y25"])
def test_check_rail_guides_over_the_nose_of_the_diverging_route(vehicle):
    """The wagon met zones that end along the track, where interpolated stiffnesses are negative."""
    track = load_track("crossing_56e1_r245_1in9.25_diverging")
    result = simulate(load_vehicle(vehicle), track, speed=11.0)
    assert result.status == "complete"
    assert result["check_rail_force"].max() > 20e3
