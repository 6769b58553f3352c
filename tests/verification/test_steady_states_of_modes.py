"""The steady rolling about which `modes` linearises."""

import numpy as np
import pytest
from dynamics import Settings, load_track, load_vehicle

import railsim
from railsim.contact.creep import LAWS, creep_force
from railsim.definitions.vehicle.definition import Vehicle
from railsim.linear.vehicle import LinearVehicle

CURVE = {"radius": 500.0, "cant": 0.1}
pytestmark = pytest.mark.usefixtures("small_contact_tables")


@pytest.fixture(scope="module")
def coach():
    return load_vehicle("coach_manchester")


def eigenvalues(modes):
    return [mode.eigenvalue for mode in modes.oscillations if mode.natural_frequency < 20.0]


def test_wheelsets_without_friction_on_one_side_roll_where_a_run_leaves_them(coach):
    lateral = {}
    for side, friction in ((1.0, [0.4, 0.0]), (-1.0, [0.0, 0.4])):
        track = load_track("straight").replace(friction=friction)
        linear = LinearVehicle(coach, track)
        wheelsets = 6 * linear.model.system.contact.body
        lateral[side] = linear.steady(20.0)[wheelsets + 1]
    # after 25 s of a run, from 0.3 mm; on finer contact tables, 0.026 mm further
    np.testing.assert_allclose(lateral[1.0], [-2.347e-3, -2.317e-3] * 2, atol=4e-5)
    np.testing.assert_allclose(lateral[-1.0], -lateral[1.0], atol=1e-7)


def test_applied_forces_are_left_out_in_curves_too(coach):
    data = coach.model_dump(exclude_none=True)
    wind = {"kind": "applied_force", "bodies": ["carbody"], "axes": "track"}
    data["elements"]["wind"] = {**wind, "force_table": [[0.0, 0.0, 2e4, 0.0], [1.0, 0.0, 2e4, 0.0]]}
    blown, calm = (
        eigenvalues(railsim.modes(one, speed=25.0, **CURVE))
        for one in (Vehicle.model_validate(data), coach)
    )
    np.testing.assert_allclose(blown, calm, rtol=1e-6)


def test_held_wheelsets_stand_where_each_speed_has_them(coach):
    alone = railsim.modes(coach, speed=25.0, held=True, **CURVE)
    second = railsim.root_locus(coach, speeds=[10.0, 25.0], held=True, **CURVE).sets[1]
    np.testing.assert_allclose(eigenvalues(second), eigenvalues(alone), rtol=1e-6)


def test_only_laws_without_a_tangent_at_zero_creepage_are_remarked_on(coach):
    """Of a wide patch, c11 > c22: the force for creepage in both directions is not the sum."""
    patch, small = {"a": 4e-3, "b": 12e-3, "N": 7e4, "mu": 0.4, "phi": 0.0}, 1e-8
    for law in LAWS:
        along, across, both = (
            np.array(creep_force(**patch, xi_x=x, xi_y=y, law=law)[:2])
            for x, y in ((small, 0.0), (0.0, small), (small, small))
        )
        has_tangent = np.allclose(both, along + across, rtol=1e-3)
        remarks = LinearVehicle(
            coach, load_track("straight"), settings=Settings(creep_law=law)
        ).remarks
        assert has_tangent != any("no tangent at zero creepage" in one for one in remarks)
