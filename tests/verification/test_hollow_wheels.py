"""Wheels worn hollow: two branches of the contact, 40 mm apart on the wheel, share the load."""

import itertools
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hollow_wheels import hollow_wheel
from selection import points

from railsim.contact.elastic import loaded_contact
from railsim.contact.exact_normal import exact_contact
from railsim.contact.table import TableGrid, build_contact_table
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.definition import Vehicle
from railsim.linear.eigenmodes import eigenmodes
from railsim.linear.vehicle import LinearVehicle
from railsim.profiles import load_profile
from railsim.profiles.profile import Profile
from railsim.simulation import simulate
from railsim.stability.motion import VehicleMotion

CROSSING = Path(__file__).parents[1] / "data" / "crossing"
LOAD = 60e3
NARROW = TableGrid(s_min=-4e-3, s_max=6e-3, roll_max=3e-3, n_w=2)
FIELD_SIDE = 0.75  # m, beyond it lies the rim of the hollow


@points(
    ("depth", "inclination", "lateral"),
    [(1.5e-3, 0.05, 3.2e-3), (2.5e-3, 0.025, 0.1e-3), (2.5e-3, 0.05, 2.7e-3), (4e-3, 0.025, 0.0)],
    always=(0,),
)
def test_load_moves_across_a_hollow_as_by_boundary_elements(depth, inclination, lateral):
    # the boundary elements know no zones: all patches at once, each in the field of the others
    wheel, rail = hollow_wheel(depth), load_profile("60E1")
    table = build_contact_table(wheel, rail, inclination=inclination, grid=NARROW)
    shares = []
    for y in lateral + np.array([-0.1e-3, 0.0]):
        found = loaded_contact(table, y, 0.0, LOAD)
        exact = exact_contact(wheel, rail, y, 0.0, LOAD, inclination=inclination, elements=20)
        rim, exact_rim = (
            sum(p.N_z for p in contact.patches if p.y > FIELD_SIDE) for contact in (found, exact)
        )
        across, exact_across = (sum(p.N_y for p in contact.patches) for contact in (found, exact))
        assert rim == pytest.approx(exact_rim, abs=0.01 * LOAD)
        assert across == pytest.approx(exact_across, abs=0.005 * LOAD)
        assert found.z == pytest.approx(exact.z, abs=2e-6)
        shares.append(rim / LOAD)
    assert shares == sorted(shares, reverse=True)
    assert 0.05 < shares[1] < 0.95  # both carry


def crossing_rail(s):
    """Wing rail and nose of a crossing where a wheel at `s` touches them, and their gauge.

    Both slope along the track: the wheel touches the wing 3.2 mm behind, the nose 4.6 mm before
    its axle's plane (CONTACT), x^2/(2 r) higher than there.  The flangeway between them is filled
    up to 10 mm below the top and given slopes that a rail may have.
    """
    places = 0.22871, 0.24836
    sections = [1e-3 * np.loadtxt(CROSSING / f"section_{n}.txt") for n in (70, 71)]
    y = np.arange(-0.040, 0.0651, 1e-4)

    def height(x):
        share = (s + x - places[0]) / (places[1] - places[0])
        low, high = (np.interp(y, *section.T) for section in sections)
        return low + share * (high - low) + x**2 / (2 * 0.46)

    z = np.where(y < 0.0, height(4.6e-3), height(-3.2e-3))
    z[y > -0.024] = np.minimum(z[y > -0.024], 0.010)
    z = np.min(z + 4.0 * np.abs(y[:, None] - y), axis=1)
    z -= z.min()
    last = int(np.flatnonzero(z >= 0.014)[-1])
    face = np.interp(-0.014, -z[last : last + 2], y[last : last + 2])
    return Profile("crossing", "rail", y, z), 2.0 * (0.75 + face)


def test_load_moves_from_wing_rail_to_nose_as_by_contact():
    rail, gauge = crossing_rail(0.239)
    lateral, wing, nose = np.loadtxt(CROSSING / "loads.csv", delimiter=",", skiprows=1).T
    grid = TableGrid(s_min=-1e-3, s_max=3e-3, roll_max=3e-3, n_w=2)
    table = build_contact_table(
        load_profile("S1002"), rail, gauge=gauge, inclination=0.0, grid=grid
    )

    def wing_share(y):
        patches = loaded_contact(table, y, 0.0, 10e3).patches
        loads = [sum(p.N for p in patches if (p.y > FIELD_SIDE) == on_wing) for on_wing in (1, 0)]
        return loads[0] / sum(loads)

    share = wing / (wing + nose)
    places = np.arange(0.70, 1.30, 0.01)  # mm
    found = np.array([wing_share(1e-3 * y) for y in places])
    limits = np.array([0.9, 0.7, 0.5, 0.3, 0.1])
    exact, ours = np.interp(-limits, -share, lateral), np.interp(-limits, -found, places)
    # the corner of the wing is not the same between two sections 20 mm apart
    assert ours[2] == pytest.approx(exact[2], abs=0.08)
    np.testing.assert_allclose(ours - ours[2], exact - exact[2], atol=0.002)


def run(depth, inclination, support, radius, speed, **settings):
    """Run of the Manchester coach through a curve, and on straight track from 3 mm aside."""
    track = load_track("curve_r250" if radius < np.inf else "straight")
    track = track.replace(inclination=inclination, support={"preset": support})
    if radius < np.inf:
        plan = [element.model_dump(exclude_none=True) for element in track.plan]
        plan[2]["radius"] = radius
        track, way = track.replace(plan=plan), {"start": 250.0, "until": 780.0}
    else:
        settings["initial"], way = {"front.outer.wheelset": {"y": 3e-3}}, {}
    return simulate(
        load_vehicle("coach_manchester"),
        track,
        speed=speed,
        **way,
        settings=Settings(**settings),
        profiles={"S1002": hollow_wheel(depth)},
    )


@pytest.mark.slow
@points(
    ("depth", "inclination", "support", "radius", "speed"),
    [
        (*case, *route)
        for route, case in itertools.product(
            [(250.0, 20.0), (190.0, 10.0), (500.0, 25.0), (np.inf, 30.0)],
            itertools.product(
                [2.5e-3, 1.5e-3, 2e-3, 3e-3, 4e-3], [0.025, 0.05], ["ballasted", "rigid"]
            ),
        )
    ],
    always=(0, 1),
)
def test_coach_on_hollow_wheels_runs_the_same_with_half_the_step(
    depth, inclination, support, radius, speed, monkeypatch
):
    grid = partial(TableGrid, n_w=4, roll_max=9e-3)  # across the rail as fine as ever
    monkeypatch.setattr("railsim.contact.table.TableGrid", grid)
    case = depth, inclination, support, radius, speed
    full = run(*case)
    half = run(*case, step=0.5 * full.attributes["step"])
    assert full.status == half.status == "complete"
    Q0 = float(np.max(full.Q0))
    last = slice(-np.count_nonzero(full.time > full.time[-1] - 4.0), None)  # one may have one more
    motion, half_motion = (
        np.std(result.wheelset_lateral[last], axis=0).max() for result in (full, half)
    )
    if motion > 0.1e-3:  # a limit cycle
        assert motion == pytest.approx(half_motion, rel=0.02)
        for name in ("Q", "Y"):
            rms, half_rms = (
                np.sqrt(np.mean(result[name][last] ** 2, axis=0)) for result in (full, half)
            )
            np.testing.assert_allclose(rms, half_rms, rtol=0.02, atol=0.005 * Q0)
        return
    for name in ("Q", "Y", "sum_Y"):
        peak, half_peak = (np.abs(result.groups["peaks"][name]).max() for result in (full, half))
        assert peak == pytest.approx(half_peak, rel=0.02, abs=0.005 * Q0)


def test_step_holds_where_hollow_treads_keep_a_vehicle_beside_the_middle():
    """On one flange, 7.4 mm aside, wheel loads do not vibrate; at 2.5 ms by 18 % of Q0."""
    track = load_track("straight", ["inclination=0.05", "friction=0.32"])
    ends = itertools.product(("front", "rear"), ("outer", "inner"))
    aside = {f"{bogie}.{axle}.wheelset": {"y": 7.5e-3} for bogie, axle in ends}
    worn = {"S1002": load_profile("S1002_hollow")}
    how = {"settings": Settings(initial=aside), "profiles": worn}
    result = simulate(load_vehicle("coach_25t"), track, speed=25.0, until=50.0, **how)
    late = np.asarray(result["time"]) > 1.0
    assert np.all(result.wheelset_lateral[late] > 7e-3)
    from_output_to_output = np.abs(np.diff(result.Q[late], axis=0))  # the carbody still sways
    assert from_output_to_output.max() < 2e-3 * result.Q0.mean()


def test_step_holds_where_wind_presses_a_vehicle_on_one_flange():
    """At the step of the middle alone, 2.5 ms, the run ended with Y off by 7 % of Q0."""
    wind = '{kind="applied_force", bodies=["carbody"], axes="track", force_table='
    wind += "[[0.0, 0.0, 0.0, 0.0], [0.5, 0.0, 60766.0, 0.0]]}"
    vehicle = load_vehicle("metro_b_motor", [f"elements.wind={wind}"])
    track = load_track(
        "straight", ["inclination=0.05", "friction=0.11", 'support.preset="co-running"']
    )
    worn = {"S1002": load_profile("S1002_hollow")}
    ends = []
    for step in (None, 0.5e-3):
        how = {"settings": Settings(step=step), "profiles": worn}
        ends.append(simulate(vehicle, track, speed=5.7, duration=4.0, **how))
    for name in ("Q", "Y"):
        late, reference = (end[name][-100:].mean(axis=0) for end in ends)
        assert late == pytest.approx(reference, abs=2e-3 * ends[0].Q0.mean())


@pytest.mark.usefixtures("small_contact_tables")
def test_hunting_on_rigid_rails_is_no_wider_than_in_short_steps():
    """Steps of 1 ms threw a wheelset 8.2 mm to a side, those of 0.125 ms 6.56 mm."""
    speed, wheel = 55.0, hollow_wheel(2e-3)
    data = load_vehicle("coach_manchester").model_dump(exclude_none=True)
    axle = data["assemblies"]["bogie"]["assemblies"]["axle"]
    axle["wheelsets"]["wheelset"]["profile"] = wheel.name
    rails = load_track("straight").replace(support={"preset": "rigid"})
    linear = LinearVehicle(Vehicle.model_validate(data), rails, profiles={wheel.name: wheel})
    found = eigenmodes(linear.linearised(speed))
    hunting = np.argmin(np.where(found.frequencies > 1.0, found.damping_ratios, np.inf))
    motion = VehicleMotion(linear, "fast", found.taken([hunting]))
    moved = motion.stretch(motion.rest(speed, 6e-3), speed, speed, 12.0)
    late = moved.lateral[moved.time > 8.0]
    np.testing.assert_allclose(0.5 * np.ptp(late, axis=0)[[0, 2]], 6.56e-3, atol=0.1e-3)
