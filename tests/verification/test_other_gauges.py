"""Tracks of other gauges: the rails, and what stands on them, are as far apart as they are."""

from types import SimpleNamespace

import numpy as np
import pytest
from selection import points

import railsim
from railsim.assessment.criteria import steering, steering_index
from railsim.assessment.sections import TestSection
from railsim.constants import GRAVITY
from railsim.contact import contact_geometry
from railsim.contact.geometry import geometry_of
from railsim.definitions.vehicle.definition import Vehicle
from railsim.linear.stationary import WALKING_PACE, on_cant
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.profiles import load_profile

METRE, BROAD = (1.000, 0.925), (1.668, 1.593)  # m: gauge and back-to-back distance
STRAIGHT = ["support.preset='rigid'"]


def wagon(back_to_back, **frame):
    """Two axles 6 m apart under one frame."""
    wheelset = {
        "mass": 1300.0, "inertia": [800.0, 90.0, 800.0], "radius": 0.46, "profile": "cone_1in40",
        "back_to_back": back_to_back,
    }  # fmt: skip
    spring = {
        "kind": "bushing", "sides": "both", "stiffness": [5e6, 5e6, 1e6],
        "damping": [1e4, 1e4, 1e4],
    }  # fmt: skip
    body = {"mass": 16e3, "inertia": [2e4, 6e4, 6e4], "position": [0.0, 0.0, -1.3], **frame}
    axles = {"front": 3.0, "rear": -3.0}
    return Vehicle.model_validate({
        "format": "railsim-vehicle/1", "name": "wagon", "bodies": {"frame": body},
        "wheelsets": {n: {**wheelset, "position": [x, 0.0, -0.46]} for n, x in axles.items()},
        "elements": {
            n: {**spring, "bodies": ["frame", n], "point": [x, 0.5, -0.46]}
            for n, x in axles.items()
        },
    })  # fmt: skip


pytestmark = pytest.mark.usefixtures("small_contact_tables")


@points(("gauge", "back_to_back"), [METRE, BROAD], always=(0,))
def test_dip_of_one_rail_lowers_its_wheel_and_not_the_other(gauge, back_to_back):
    """6 mm over 20 m at 1 m/s: heights where the wheels stand, 32.5 mm outside the gauge face."""
    dip = "irregularities=[{type='dip', s=20.0, length=20.0, depth=0.006, rail='right'}]"
    track = railsim.load_track("straight", [*STRAIGHT, f"gauge={gauge}", dip])
    result = railsim.simulate(wagon(back_to_back), track, speed=1.0, until=20.0)
    front = result.body_position[:, result.bodies.index("front")]
    half = 0.5 * gauge + 0.0325
    left, right = (front[:, 2] + side * half * front[:, 3] for side in (-1.0, 1.0))
    middle = np.argmin(np.abs(result.wheelset_distance[:, 0] - 20.0))
    assert right[middle] - right[0] == pytest.approx(6e-3, abs=0.05e-3)
    assert left[middle] - left[0] == pytest.approx(0.0, abs=0.05e-3)


@pytest.mark.parametrize(("gauge", "back_to_back"), [METRE, BROAD])
def test_wheel_loads_on_cant_balance_the_weights_about_the_rails(gauge, back_to_back):
    cant, track = 0.1, railsim.load_track("straight", [*STRAIGHT, f"gauge={gauge}"])
    model = assemble(wagon(back_to_back), track, railsim.Settings())
    standing = on_cant(equilibrium(model, WALKING_PACE), track, cant, held=True)
    phi, moment = np.arcsin(cant / 1.5), 0.0
    for b, mass in enumerate(model.system.bodies.mass):
        y, z = model.system.bodies.nominal[b] + standing.state[6 * b + 1 : 6 * b + 3]
        moment += mass * GRAVITY * (y * np.cos(phi) - z * np.sin(phi))
    right_less_left = standing.Q[:, 1].sum() - standing.Q[:, 0].sum()
    assert (0.5 * gauge + 0.0325) * right_less_left == pytest.approx(moment, rel=1e-3)


def test_steering_index_grows_with_the_distance_of_the_wheels():
    """Redtenbacher's e r0/R of the same wheels and play between flange and rail."""
    wheel, rail = load_profile("cone_1in40"), load_profile("60E1")
    lateral = np.arange(0.0, 9.0e-3, 1e-5)
    index = {
        gauge: steering_index(
            contact_geometry(wheel, rail, gauge=gauge, back_to_back=gauge - 0.075, lateral=lateral),
            -500.0,
            0.46,
        )
        for gauge in (1.435, 1.0)
    }
    assert index[1.0] / index[1.435] == pytest.approx(1.065 / 1.5, rel=0.02)


def test_steering_index_is_that_of_the_widened_gauge():
    """Cones: the radius difference before the flange grows with the play, by half of 18 mm here."""
    vehicle, curve = wagon(1.36), {"type": "CIR", "length": 400.0, "radius": -500.0}
    plan, rows = [curve], [[0.0, 0.0, 0.0], [200.0, 0.018, 0.0]]
    track = railsim.load_track("straight").replace(plan=plan, gauge_widening=rows)
    profiles = {name: load_profile(name) for name in ("cone_1in40", "60E1")}
    wheelset = vehicle.wheelsets["front"]
    record = SimpleNamespace(
        result=SimpleNamespace(track=lambda: track, vehicle=lambda: vehicle),
        geometry_with=lambda widening: geometry_of(wheelset, track, profiles, widening),
    )
    (wide,) = steering(
        SimpleNamespace(record=record), TestSection("3", 250.0, 350.0, -500.0, 0.1, 20.0, "")
    ).values()
    geometry = contact_geometry(*profiles.values(), lateral=np.arange(0.0, 9e-3, 1e-5))
    narrow = steering_index(geometry, -500.0, 0.46)
    play = geometry.lateral[np.abs(geometry.contact_angle).max(axis=1) > 0.5][0]
    assert wide[0] / narrow == pytest.approx(play / (play + 0.009), rel=0.05)
