"""Wheels worn hollow: two branches of the contact, 40 mm apart on the wheel, share the load."""

import itertools

import numpy as np
import pytest
from hollow_wheels import hollow_wheel
from selection import points

from railsim.contact.elastic import loaded_contact
from railsim.contact.exact_normal import exact_contact
from railsim.contact.table import TableGrid, build_contact_table
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import Settings
from railsim.profiles import load_profile
from railsim.simulation import simulate

LOAD = 60e3
NARROW = TableGrid(s_min=-4e-3, s_max=6e-3, roll_max=3e-3, n_w=2)
FIELD_SIDE = 0.75  # m, beyond it lies the rim of the hollow


@points(
    ("depth", "inclination", "lateral"),
    [(1.5e-3, 0.05, 3.2e-3), (2.5e-3, 0.025, 0.1e-3), (2.5e-3, 0.05, 2.7e-3), (4e-3, 0.025, 0.0)],
    always=(0, 1),
)
def test_load_moves_across_a_hollow_as_by_boundary_elements(depth, inclination, lateral):
    # the boundary elements know no zones: all patches at once, each in the field of the others
    wheel, rail = hollow_wheel(depth), load_profile("60E1")
    table = build_contact_table(wheel, rail, inclination=inclination, grid=NARROW)
    shares = []
    for y in lateral + np.array([-0.1e-3, 0.0, 0.1e-3]):
        found = loaded_contact(table, y, 0.0, LOAD)
        exact = exact_contact(wheel, rail, y, 0.0, LOAD, inclination=inclination)
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


def run(depth, inclination, support, radius, speed, **settings):
    """Run of the Manchester coach through a curve, and on straight track from 3 mm aside."""
    track = load_track("curve_r250" if radius < np.inf else "straight")
    track = track.replace(inclination=inclination, support={"preset": support})
    if radius < np.inf:
        plan = [element.model_dump(exclude_none=True) for element in track.plan]
        plan[2]["radius"] = radius
        track = track.replace(plan=plan)
    else:
        settings["initial"] = {"front.outer.wheelset": {"y": 3e-3}}
    return simulate(
        load_vehicle("coach_manchester"),
        track,
        speed=speed,
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
@pytest.mark.usefixtures("small_contact_tables")
def test_coach_on_hollow_wheels_runs_the_same_with_half_the_step(
    depth, inclination, support, radius, speed
):
    case = depth, inclination, support, radius, speed
    full = run(*case)
    half = run(*case, step=0.5 * full.attributes["step"])
    assert full.status == half.status == "complete"
    Q0 = float(np.max(full.Q0))
    last = full.time > full.time[-1] - 4.0
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
