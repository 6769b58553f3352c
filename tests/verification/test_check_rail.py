"""Check rails: first contact with sections of a real one, forces against equilibrium, mirror."""

from types import SimpleNamespace as Record

import numpy as np
import pytest

from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.definitions.mirror import mirrored_track, mirrored_vehicle
from railsim.definitions.settings import Settings
from railsim.definitions.track.check_rail import CheckRail
from railsim.definitions.vehicle.flatten import flatten
from railsim.errors import InputError
from railsim.kernels import check_rails as kernel
from railsim.kernels import rails
from railsim.kernels.contact_columns import W_CHECK, WHEEL_COLUMNS
from railsim.model.check_rails import check_rails, flange_back, standing_at
from railsim.profiles import Profile, load_profile
from railsim.simulation import simulate

# contour of the check rail of crossing 56E1-R245-1:9.25 where it is narrowest, and flange of the
# wheel used with it (program CONTACT, see tests/data/sections): y, z [mm]
FACE = [(-19.136, 1.0), (-6.016, 5.0), (-2.016, 10.0), (-1.026, 13.49), (-0.976, 14.0)]
FACE += [(-0.656, 20.0), (-0.256, 28.0), (0.0, 33.0)]
BACK = [(-69.61263, 13.48559), (-69.0, 16.6), (-67.0, 21.0), (-63.0, 25.3), (-56.0, 28.0)]


def clearance(back_to_back, gauge):
    """Lateral displacement at which the back of the flange touches [mm]."""
    wheelset = flatten(load_vehicle("coach_manchester")).of_kind("wheelset")[0].wheelset
    wheelset = wheelset.model_copy(update={"back_to_back": back_to_back})
    y, z = 1e-3 * np.array([*BACK, (-40.0, 9.0), (0.0, 0.0), (60.0, -2.6)]).T
    profiles = {name: Profile(name, "wheel", y, z) for name in wheelset.profile}
    profile = tuple((1e-3 * y, 1e-3 * z) for y, z in FACE)
    # the face is 76.00 mm inside of y = 0 of the rail, its gauge face 35.00 mm
    rail = CheckRail(rail="right", flangeway=0.041, profile=profile)
    offset, below, _, back = flange_back(wheelset, rail, gauge, profiles)
    assert below == pytest.approx(0.46 + 0.0135, abs=1e-3)
    assert back == pytest.approx(0.5 * back_to_back + 0.07 - 0.06961, abs=5e-4)
    return 1e3 * (offset + 0.041)


@pytest.mark.parametrize(
    ("back_to_back", "gauge", "expected"),
    [(1.360, 1.430, 6.44), (1.357, 1.430, 4.94), (1.363, 1.430, 7.94), (1.360, 1.435, 3.94)],
)
def test_first_contact(back_to_back, gauge, expected):
    assert clearance(back_to_back, gauge) == pytest.approx(expected, abs=0.08)


def penetration(yaw, contour):
    """How far yaw pushes the back of an S1002 wheel into a face of this contour, point by point."""
    wheel, angle = load_profile("S1002"), np.linspace(-0.6, 0.6, 1201)[:, None]
    tip = int(np.argmax(wheel.z))
    radius = 0.46 + np.linspace(-0.03, wheel.z[tip], 500)
    back = np.interp(radius - 0.46, wheel.z[: tip + 1], wheel.y[: tip + 1])
    height = radius * np.cos(angle) - 0.46  # under the top of the check rail
    face = np.interp(height, *np.transpose(contour)[::-1])

    def least(yaw):
        away = np.cos(yaw) * back - np.sin(yaw) * radius * np.sin(angle) - face
        return np.min(away[height >= 0.0])

    return least(0.0) - least(yaw)


@pytest.mark.parametrize("yaw", [0.005, 0.01, 0.018])
@pytest.mark.parametrize("rounded", [False, True])
def test_yaw_brings_the_rounded_flange_as_near_as_its_points(rounded, yaw):
    """Within 0.1 mm; a disc as large as the tip of the flange would reach 0.3 to 1.9 mm further."""
    profile = tuple((1e-3 * y, 1e-3 * z) for y, z in FACE) if rounded else None
    rail = CheckRail(rail="right", flangeway=0.041, profile=profile)
    wheelset = flatten(load_vehicle("coach_manchester")).of_kind("wheelset")[0].wheelset
    known = {name: load_profile(name) for name in wheelset.profile}
    _, _, reach, _ = flange_back(wheelset, rail, 1.435, known)
    found = penetration(yaw, profile or [(0.0, 0.0), (0.0, 0.1)])
    assert reach * yaw == pytest.approx(found, abs=1e-4)


def curve(rails=(), **more):
    """Curve of 150 m radius with a check rail beside the inner (right) rail."""
    plan = [
        {"type": "STR", "length": 25.0},
        {"type": "CLO", "length": 20.0},
        {"type": "CIR", "length": 60.0, "radius": 150.0},
    ]
    values = {"plan": plan, "cant": [{"type": "CST", "length": 105.0, "cant": 0.0}]}
    return load_track("straight").replace(**values, check_rail=list(rails), speed=None, **more)


RAIL = {"rail": "right", "flangeway": [[5.0, 0.060], [8.0, 0.040], [120.0, 0.040]]}
HOW = {"speed": 8.0, "start": 12.0, "until": 85.0}


def test_check_rail_relieves_the_outer_rail_in_a_sharp_curve():
    """Its force guides the leading wheelset; Newton's law holds for the sum of lateral forces."""
    coach = load_vehicle("coach_manchester")
    plain, guided = simulate(coach, curve(), **HOW), simulate(coach, curve([RAIL]), **HOW)
    assert "check_rail_force" not in plain
    force = guided["check_rail_force"]
    at_end = slice(-20, None)
    N = force[at_end, 0, 1].mean()
    assert N > 5e3
    assert np.all(force[:, :, 0] == 0.0)
    assert np.all(force >= 0.0)
    # the outer (left) flange of the leading wheelset carries nothing any more
    assert plain["Y"][at_end, 0, 0].mean() < -0.5 * N
    assert guided["Y"][at_end, 0, 0].mean() > 0.0
    relief = (guided["sum_Y"] - plain["sum_Y"])[at_end, 0].mean()
    assert relief == pytest.approx(N, rel=0.1)
    shift = guided["wheelset_lateral"] - plain["wheelset_lateral"]
    assert shift[at_end, 0].mean() > 2e-3  # to the inner side
    # lateral forces of all rails balance the same inertia
    total = [
        (result["sum_Y"].sum(axis=1) - extra)[at_end].mean()
        for result, extra in ((plain, 0.0), (guided, force[:, :, 1].sum(axis=1)))
    ]
    assert total[1] == pytest.approx(total[0], rel=0.02)
    # the back slides down ahead of the axle, at V x_c/r, where its rounding begins
    wear = guided["check_rail_T_gamma"][at_end, 0, 1].mean()
    first, last = (np.sqrt((0.46 + z) ** 2 - 0.46**2) / 0.46 for z in (9.5e-3, 12e-3))
    assert 0.3 * N * first < wear < 0.3 * N * last


@pytest.mark.parametrize("right", [-1.0, 1.0])
def test_force_is_stiffness_and_damping_of_the_penetration(right):
    """N = k p + c p', where rails widen, lean and bend and the flangeway is flared: p over time."""
    speed, z_c, reach, q = 8.0, 0.474, 0.12, -0.045
    side = int(right > 0.0)

    def at(t):
        """Wheelset's y, roll, yaw; rails' middle, distance aside, lean, slope; flangeway."""
        s = speed * t
        under = 0.001 + 0.004 * s, 0.002 + 0.003 * s, 0.003 - 0.006 * s, 0.002 + 0.005 * s
        return 0.002 + 0.03 * t, 0.01 + 0.2 * t, right * (0.02 + 0.5 * t), *under, 0.04 - 0.01 * s

    def penetration(t):
        y, roll, yaw, middle, aside, lean, slope, flangeway = at(t)
        y, psi = right * (y - middle - aside - z_c * (roll - lean)), abs(yaw - slope)
        return -(q + flangeway + y) + reach * psi**2 / (psi + kernel.SMALL_YAW)

    contact = Record(body=[0], check=np.array([[side, 0.0, 0.0, 5e7, 5e4, 0.3]]))
    contact.check_wheel = np.array([[[q, z_c, reach, 0.68]]])
    work = Record(rail_force=np.zeros((1, 6)), force_rate=np.zeros(1))
    work.wheel = np.zeros((1, 2, WHEEL_COLUMNS))
    work.plane, work.rail = np.zeros((1, rails.PLANE_SIZE)), np.zeros((1, 2, rails.RAIL_SIZE))
    state, work.acceleration = np.zeros(12), np.zeros((1, 6))
    state[1], state[3], state[5], *now, flangeway = at(0.0)
    state[7], work.acceleration[0, 3], work.acceleration[0, 5] = 0.03, 0.2, right * 0.5
    work.plane[0, [rails.MIDDLE_Y, rails.SLOPE_Y]] = now[0], 0.004
    work.plane[0, [rails.ROLL, rails.ROLL_SLOPE]] = now[2], -0.006
    of_rail = [rails.SHIFT, rails.SHIFT_SLOPE, rails.RAIL_SLOPE, rails.RAIL_BEND]
    work.rail[0, side, of_rail] = now[1], 0.003, now[3], 0.005
    system = Record(contact=contact, bodies=Record(kind=np.zeros(1)))
    kernel.add_check_rail.py_func(system, work, speed, state, 0, 0, flangeway, -0.01)
    rate = (penetration(1e-5) - penetration(-1e-5)) / 2e-5
    expected = 5e7 * penetration(0.0) + 5e4 * rate
    assert work.wheel[0, side, W_CHECK] == pytest.approx(expected, rel=1e-9)


def test_check_rail_in_the_mirror():
    coach, track = load_vehicle("coach_manchester"), curve([RAIL])
    settings = load_settings()
    mine = simulate(coach, track, settings=settings, **{**HOW, "until": 50.0})
    other = simulate(
        mirrored_vehicle(coach), mirrored_track(track), settings=settings, **{**HOW, "until": 50.0}
    )
    assert mine["check_rail_force"].max() > 1e3
    np.testing.assert_allclose(
        mine["check_rail_force"], other["check_rail_force"][:, :, ::-1], atol=50.0
    )


def test_check_rail_that_is_out_of_reach_changes_nothing():
    coach = load_vehicle("coach_manchester")
    far = {"rail": "left", "flangeway": 0.15}
    how = {"speed": 8.0, "start": 12.0, "until": 30.0}
    mine, plain = simulate(coach, curve([far]), **how), simulate(coach, curve(), **how)
    np.testing.assert_array_equal(mine["Q"], plain["Q"])
    assert not mine["check_rail_force"].any()


def test_the_step_follows_a_wheelset_on_a_strongly_damped_check_rail():
    """No longer than 0.4 m/c; at 2.5 ms, h c/m = 2.8, the force would be 308 instead of 73 kN."""
    damping, mass = 2e6, 1813.0
    flangeway = [[11.0, 0.06], [13.0, 0.034], [60.0, 0.034]]
    track = load_track("straight").replace(
        check_rail=[{"rail": "right", "flangeway": flangeway, "damping": damping}]
    )

    def run(step=None):
        how = {"speed": 10.0, "duration": 0.8, "settings": Settings(step=step)}
        result = simulate(load_vehicle("coach_manchester"), track, **how)
        return result.attributes["step"], result["check_rail_force"].max()

    step, force = run()
    assert step == pytest.approx(5e-3 / np.ceil(5e-3 / (0.4 * mass / damping)))
    assert force > 5e4
    assert force == pytest.approx(run(0.5 * step)[1], rel=5e-3)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"flangeway": 0.5}, "flangeway"),
        ({"flangeway": [[3.0, 0.04], [1.0, 0.04]]}, "increase"),
        ({"rail": "both"}, "rail"),
        ({"stiffness": 1e12}, "stiffness"),
    ],
)
def test_wrong_check_rails_are_refused(wrong, said):
    with pytest.raises(InputError, match=said):
        curve([{**RAIL, **wrong}])


def test_contact_facing_and_trailing_is_at_mirrored_places():
    """The same list about s = 60 m: what is d ahead of it in one is d behind it in the other."""
    rows = [[-10.0, 0.060], [-7.0, 0.040], [5.0, 0.041], [6.0, 0.066]]
    rail = CheckRail(rail="right", flangeway=rows, shift=60.0)
    flat = flatten(load_vehicle("coach_manchester"))
    known = {n: load_profile(n) for n in flat.of_kind("wheelset")[0].wheelset.profile}
    facing, trailing = (
        check_rails(flat, curve([one]), known)
        for one in (rail, rail.model_copy(update={"trailing": True}))
    )
    np.testing.assert_array_equal(facing.check_wheel, trailing.check_wheel)
    low = rail.model_copy(update={"rail": "left", "height": 0.02})
    alone, both = (check_rails(flat, curve(some), known) for some in ([low], [rail, low]))
    np.testing.assert_array_equal(both.check_wheel[:, :1], facing.check_wheel)
    np.testing.assert_array_equal(both.check_wheel[:, 1:], alone.check_wheel)
    assert np.ptp(both.check_wheel, axis=1).min(axis=0)[1] > 0.0  # each reaches another height
    d = np.linspace(-10.0, 6.0, 33)
    for s in (50.1, 53.0, 62.5, 65.9):
        there, mirrored = standing_at(facing, s), standing_at(trailing, 120.0 - s)
        np.testing.assert_allclose(there.check_flangeway, mirrored.check_flangeway, rtol=1e-12)
    widths = [
        np.interp(60.0 + sign * d, *found.check_flangeway.T)
        for sign, found in ((1.0, facing), (-1.0, trailing))
    ]
    np.testing.assert_allclose(*widths, rtol=1e-12)
    assert not len(standing_at(trailing, 51.0).check)  # a facing one stands there
    with pytest.raises(InputError, match="trailing"):
        curve([{**RAIL, "trailing": 1}])


@pytest.mark.parametrize("how", ["run-in", "steady"])
def test_run_begins_on_the_check_rail(how):
    """In the curve the vehicle starts as a run over the whole track arrives there."""
    coach = load_vehicle("coach_manchester")
    track = load_track("depot_r150_check_rail").replace(gauge_widening=None, check_rail=[RAIL])
    settings = load_settings().with_values({"start_state": how})
    begun = simulate(coach, track, speed=8.0, start=105.0, duration=0.1, settings=settings)
    arrived = simulate(coach, track, speed=8.0, start=105.0 - 8.0 * 5.0, until=105.5)
    at = np.argmin(np.abs(arrived["distance"] - 105.0))
    force = begun["check_rail_force"][0, :, 1]
    assert force[0] > 2e4
    np.testing.assert_allclose(force, arrived["check_rail_force"][at, :, 1], atol=1.5e3)
    np.testing.assert_allclose(begun["check_rail_force"][-1, :, 1], force, atol=500.0)


@pytest.mark.usefixtures("small_contact_tables")
def test_work_at_the_check_rail_is_part_of_the_frictional_power():
    """What a coasting coach loses in the curve, (m + sum(I/r0^2)) V V' = -P, within 1 %."""
    coach = load_vehicle("coach_manchester")
    track = load_track("depot_r150_check_rail")
    settings = load_settings().with_values({"drive.mode": "free", "outputs.frictional_power": True})
    result = simulate(coach, track, speed=8.6, start=110.0, duration=2.5, settings=settings)
    t, s = result["time"], result["distance"]
    late = t > 0.5
    rate, speed = np.polyfit(t[late] - 1.5, s[late], 2)[:2] * (2.0, 1.0)
    power = result["frictional_power"][late].sum(axis=(1, 2)).mean()
    at_back = 8.6 * result["check_rail_T_gamma"][late].sum(axis=(1, 2)).mean()
    assert at_back > 0.2 * power
    bodies = flatten(coach).bodies
    mass = sum(body.mass for body in bodies)
    axles = [body for body in bodies if body.wheelset]
    turning = sum(body.inertia[1] / body.wheelset.radius[0] ** 2 for body in axles)
    assert power == pytest.approx(-(mass + turning) * speed * rate, rel=0.01)
