"""A run is `derailed` where position, lift and forces say so; what blows up is `stopped`."""

import numpy as np
import pytest
from selection import points

from railsim.contact.elastic import TableArrays
from railsim.contact.table import TableGrid, build_contact_table
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.mirror import mirrored_track
from railsim.definitions.settings import Settings
from railsim.kernels.table_ends import has_climbed
from railsim.kernels.wheel_contact import WheelOnRail
from railsim.profiles import load_profile
from railsim.simulation import Simulation, simulate

FLANGE = 0.028  # m, height of the flange of S1002
COACH = load_vehicle("coach_manchester")


@pytest.mark.parametrize("widening", [0.0, 0.015])
@pytest.mark.usefixtures("smooth_contact_tables")
def test_wheel_that_climbs_is_derailed_and_stands_on_its_flange(widening):
    """Where the gauge is wider the inner wheel goes further inwards before the outer one is up."""
    # far too tight and dry for a coach
    track = load_track("curve_r250", ["plan.2.radius=90", "friction=0.9"])
    track = track.replace(gauge_widening=[[0.0, 0.0, widening]])
    result = simulate(COACH, track, speed=15.0)
    assert result.status == "derailed"
    assert "front.outer.wheelset climbed" in result.attributes["status_reason"]
    assert result.wheelset_lateral[-1, 0] < -0.020 - 0.5 * widening
    # the wheelset turns about the inner wheel, 1.5 m away
    assert result.wheelset_roll[-1, 0] > 0.9 * FLANGE / 1.5
    assert np.max(result.Q) < 3.0 * np.max(result.Q0)


def test_wheelset_that_is_thrown_off_the_rails_is_not_derailed():
    settings = Settings(initial={"front.outer.wheelset": {"vy": -6.0}})
    track = load_track("straight", ["support.preset=rigid"])
    result = simulate(COACH, track, speed=20.0, until=5.0, settings=settings)
    assert result.status == "stopped"
    assert "under forces beyond all experience" in result.attributes["status_reason"]


def overturning_speed(vehicle, radius, cant, base=1.5):
    """Speed at which the resultant of weight and centrifugal force passes the outer rail [m/s].

    A rigid vehicle, h its centre of mass: (v^2/R cos p - g sin p) h = (g cos p + v^2/R sin p) b/2.
    """
    mass = np.array([body.mass for body in vehicle.bodies.values()])
    h = -mass @ [body.position[2] for body in vehicle.bodies.values()] / mass.sum()
    s, c = cant / base, np.sqrt(1.0 - (cant / base) ** 2)
    return np.sqrt(9.81 * radius * (c * base / 2 + s * h) / (c * h - s * base / 2))


@points("hand", ["right", "left"], always=(1,))
def test_vehicle_that_overturns_is_derailed(hand):
    """A verdict "stopped" had left it unassessed."""
    right = load_track("curve_r250")
    track = right if hand == "right" else mirrored_track(right)
    speed = overturning_speed(COACH, 250.0, 0.15)
    stands = simulate(COACH, track, speed=0.9 * speed, until=400.0)
    run = Simulation(COACH, track, speed=1.05 * speed, until=400.0)
    run.run()
    on_the_way, falls = run.status, run.result()
    assert stands.status == "complete"
    assert on_the_way == falls.status == "derailed"
    assert "higher above its rail than its flange" in falls.attributes["status_reason"]
    assert falls.distance[-1] > 300.0  # in the full curve


@points("roll", [-0.002, 0.0, 0.002], always=(0,))
def test_wheel_beyond_the_rail_that_was_not_lifted_is_not_derailed(roll):
    table = build_contact_table(
        load_profile("S1002"), load_profile("60E1"), grid=TableGrid(roll_max=3e-3, n_w=2)
    )
    arrays = TableArrays(
        table.values[None], np.array([table.shear]), table.y0, table.dy, table.roll0, table.droll,
        table.w,
    )  # fmt: skip

    def climbed(z):
        meet = WheelOnRail(1.0, 0.1, z, roll, 0.0, 0.0, 0.0, 0.0, 0.0)
        return has_climbed(arrays, 0, meet, roll)

    on_top = -FLANGE - 0.75 * roll
    assert climbed(on_top)
    assert climbed(on_top - 0.01)  # in the air
    assert not climbed(on_top + 0.005)
    assert not climbed(0.0)
