"""Steady rolling of vehicles whose elements have kinks where they rest, and of worn wheels."""

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from dynamics import Settings, load_track
from hollow_wheels import hollow_wheel
from selection import points

import railsim.model.equilibrium
from railsim.constants import GRAVITY
from railsim.contact import contact_geometry
from railsim.definitions.loading import load_vehicle, load_vehicle_text
from railsim.errors import ModelError
from railsim.kernels.state import ARC_LENGTH, N_SCALARS, SPEED, velocity_begin
from railsim.kernels.system import AXLEBOX, RADIUS, RIGID, WHEELSET
from railsim.kernels.track_frame import OMEGA
from railsim.linear.vehicle import on_cones
from railsim.model.assembly import Index, assemble
from railsim.model.equilibrium import RESIDUAL, _at_rest, equilibrium, initial_state
from railsim.profiles import load_profile

DATA = Path(__file__).parents[1] / "data" / "vehicles"
WAGON = (DATA / "two_axle_wagon.toml").read_text(encoding="utf-8")
GUARDS = {
    "x": "table = [[0.0, 0.0], [0.0225, 0.0], [0.0235, 5e3]]",
    "y": "table = [[0.0, 0.0], [0.020, 0.0], [0.021, 5e3]]",
}
# forces over travel; each has its kink at rest
STOP = "table = [[-0.1, -5e6], [0.0, 0.0], [0.1, 0.0]]"  # without clearance, one direction
STIFF_STOP = "table = [[-0.1, -5e7], [0.0, 0.0], [0.1, 0.0]]"
PUSHER = "table = [[-0.1, -2.1e4], [-1e-5, -2e4], [0.0, 0.0], [0.1, 1e6]]"  # Lenoir's, pressed on
CLAMPED = "table = [[0.0, 0.0], [1e-6, 1e4], [0.1, 1.01e4]]"  # 10 GN/m within 1 um
SECOND_STAGE = """
[assemblies.axle.elements.stage]
kind = "bump_stop"
bodies = ["wagon", "wheelset"]
point = [0.0, 1.0, -0.46]
sides = "both"
axis = "z"
table = [[-0.1, -3e6], [0.0, 0.0], [0.1, 0.0]]
"""


def wagon(payload, along, across):
    text = WAGON.replace("mass = 20000.0", f"mass = {8000.0 + payload}")
    text = text.replace(GUARDS["x"], along).replace(GUARDS["y"], across)
    assert GUARDS["x"] not in text
    assert GUARDS["y"] not in text
    return load_vehicle_text(text + SECOND_STAGE)


def rolling(vehicle, speed, profiles=None):
    model = assemble(vehicle, load_track("straight"), Settings(), profiles)
    return equilibrium(model, speed)


@points(("along", "across"), [
    (STOP, STOP), (STIFF_STOP, STOP), (PUSHER, STOP), (CLAMPED, PUSHER), (CLAMPED, STIFF_STOP),
], always=(0, 3),
   ids=["stops", "stiff stops", "pushers", "clamped axles", "clamped axles and stops"])  # fmt: skip
def test_two_stage_wagon_rolls_steadily_with_kinks_at_rest(along, across):
    for payload, speed in itertools.product((0.0, 25e3, 50e3), (5.0, 20.0, 33.0)):
        found = rolling(wagon(payload, along, across), speed)
        assert found.residual < 1e3 * RESIDUAL
        weight = found.model.system.gravity * np.sum(found.model.system.bodies.mass)
        assert np.sum(found.Q0) == pytest.approx(weight, rel=1e-6)
        # what the step of a force is measured with
        assert found.model.system.contact.load == pytest.approx(np.full(2, weight / 4.0))


def test_message_names_bodies_where_the_forces_of_elements_change_faster():
    """Rates of internal forces, in N/s, are larger than any acceleration: they hid all bodies."""
    index, n = Index(("car", "frame"), (), (), ()), 2
    equations = np.array([6 * n + 2, 6 * n + 6 + 1, *(12 * n + np.arange(6))])
    message = index.largest_left(equations, np.array([0.5, -2.0, *(1e6 * np.ones(6))]), 5)
    assert message.endswith("accelerations: frame y'' = -2, car z'' = 0.5")


def test_message_names_the_elements_that_alternate(monkeypatch):
    monkeypatch.setattr(
        railsim.model.equilibrium._Balance,
        "_over_kinks",
        lambda self, state, rest, change: (state, rest, False),
    )

    def all_of_them():
        for payload, speed in itertools.product((0.0, 25e3, 50e3), (5.0, 20.0, 33.0)):
            rolling(wagon(payload, PUSHER, PUSHER), speed)

    with pytest.raises(ModelError, match=r"alternating between two branches: .*(guard|stage)"):
        all_of_them()


@pytest.mark.slow
@points("depth", [2e-3, 4e-3], always=(0,))
@pytest.mark.usefixtures("small_contact_tables")
def test_coach_on_hollow_wheels_stands_and_rolls_in_the_middle(depth):
    coach = railsim.load_vehicle("coach_manchester")
    found = rolling(coach, 20.0, {"S1002": hollow_wheel(depth)})
    assert found.residual < 1e3 * RESIDUAL
    np.testing.assert_allclose(found.Q0, found.Q0[0, 0], rtol=1e-6)
    for body in found.model.system.contact.body:
        assert abs(found.state[6 * body + 1]) < 1e-9


def test_wheels_roll_on_the_radius_on_which_they_stand_whatever_the_nominal_one_is():
    """A creepage of 1 % on the nominal radius saturates the creep force, which has no slope left.

    From there Newton's method went astray: the radius of the points of contact is the one to roll
    on, as on steep cones, which touch the rails farther in.
    """
    track = load_track("straight").replace(support={"preset": "rigid"})
    model = assemble(load_vehicle("coach_manchester"), track, Settings())
    expected, bodies = equilibrium(model, 1.0), model.system.bodies
    row = bodies.row * np.where(np.arange(bodies.row.shape[1]) == RADIUS, 0.99, 1.0)
    other = replace(model, system=model.system._replace(bodies=bodies._replace(row=row)))
    np.testing.assert_allclose(equilibrium(other, 1.0).state, expected.state, atol=1e-9)


@pytest.mark.slow
@pytest.mark.usefixtures("small_contact_tables")
def test_steep_cones_roll_on_the_radius_on_which_they_stand():
    """Cones of 1:5 touch the rails 18 mm farther in: a creepage of 0.8 % on the nominal radius."""
    vehicle, profile = on_cones(load_vehicle("coach_manchester"), 0.2)
    geometry = contact_geometry(profile, load_profile("60E1"), lateral=[-1e-4, 0.0, 1e-4])
    track = load_track("straight").replace(support={"preset": "rigid"})
    for friction in (0.1, 0.4, 1.0):
        rough = track.replace(friction=friction)
        model = assemble(vehicle, rough, Settings(), {profile.name: profile})
        found, first = equilibrium(model, 1.0), velocity_begin(model.index.n_bodies)
        spins = found.state[first + 6 * model.system.contact.body + 4]
        np.testing.assert_allclose(-1.0 / spins, geometry.rolling_radius[1, 0], atol=0.2e-3)


# one the mirror image of the other: two contact tables serve both
@pytest.mark.parametrize("difference", [1e-3, -1e-3])
@pytest.mark.usefixtures("small_contact_tables")
def test_wheels_of_unequal_radii_stand_on_both_rails(difference):
    """The larger wheel lifts its side by 2/3 mrad a millimetre; the weights lean to the other one.

    Moments of the weights about the middle of the track against those of the wheel loads, whose
    places move with the wheelset.
    """
    radii = [0.46 + 0.5 * difference, 0.46 - 0.5 * difference]
    key = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.radius"
    model = assemble(
        load_vehicle("coach_manchester", [f"{key}={radii}"]),
        load_track("straight").replace(support={"preset": "rigid"}),
        Settings(),
    )
    balance = equilibrium(model, 1.0)
    rest, index = _at_rest(model).state, model.index
    roll, y = ([rest[index.coordinate(w, k)] for w in index.wheelsets] for k in (3, 1))
    assert roll == pytest.approx([difference / 1.5] * 4, rel=0.05)
    lean = sum(
        GRAVITY * mass * rest[index.coordinate(name, 1)]
        for name, mass in zip(index.bodies, model.system.bodies.mass, strict=True)
    )
    right_less_left = np.sum(balance.Q0[:, 1] - balance.Q0[:, 0])
    assert 0.75 * right_less_left == pytest.approx(lean, rel=0.1)
    assert np.sign(lean) == np.sign(difference) == np.sign(y[0])


# one the mirror image of the other: two contact tables serve both
@pytest.mark.parametrize("worn", ["left", "right"])
@pytest.mark.usefixtures("small_contact_tables")
def test_wheels_of_unequal_wear_stand_where_their_wheelset_is_lowest(worn):
    """On rigid rails it is lowest 4.25 mm aside; patches have a width, and it stands 0.2 mm nearer.

    Between the middle and there the lateral force has next to no slope.
    """
    names = ["S1002_hollow", "S1002"] if worn == "left" else ["S1002", "S1002_hollow"]
    text = WAGON.replace('profile = "S1002"', f"profile = {names}\nback_to_back = 1.353")
    track = load_track("straight").replace(support={"preset": "rigid"})
    model = assemble(load_vehicle_text(text), track, Settings())
    lateral = np.arange(-6e-3, 6e-3, 5e-5)
    wheels, rail = tuple(load_profile(name) for name in names), load_profile("60E1")
    geometry = contact_geometry(wheels, rail, back_to_back=1.353, lateral=lateral)
    found = equilibrium(model, 1.0)
    standing = _at_rest(model).state[6 * model.system.contact.body + 1]
    np.testing.assert_allclose(standing, lateral[np.argmax(geometry.centre_z)], atol=0.3e-3)
    assert found.Q0.sum() == pytest.approx(model.system.bodies.mass.sum() * GRAVITY)


@pytest.mark.usefixtures("small_contact_tables")
def test_wheels_of_unequal_wear_roll_where_their_radii_are_equal():
    """They stand on the other side of the middle: on the way both steer with next to no slope."""
    worn = hollow_wheel(0.5e-3)
    worn = replace(worn, z=worn.z - np.interp(0.0, worn.y, worn.z))  # of the nominal radius
    text = WAGON.replace('profile = "S1002"', 'profile = ["worn", "S1002"]\nback_to_back = 1.353')
    track = load_track("straight").replace(support={"preset": "rigid"})
    found = equilibrium(assemble(load_vehicle_text(text), track, Settings(), {"worn": worn}), 1.0)
    lateral = np.arange(1e-3, 6e-3, 5e-5)
    wheels, rail = (worn, load_profile("S1002")), load_profile("60E1")
    geometry = contact_geometry(wheels, rail, back_to_back=1.353, lateral=lateral)
    rolling = found.state[6 * found.model.system.contact.body + 1]
    equal = np.interp(0.0, geometry.delta_r, lateral)
    np.testing.assert_allclose(rolling, equal, atol=0.3e-3)


def test_bodies_begin_turning_with_the_track_below_them():
    """At 20 m/s by 20 times the turn per metre of their frames; axle boxes not at all."""
    kinds = [RIGID, AXLEBOX, WHEELSET]
    bodies = SimpleNamespace(kind=np.array(kinds), frame=np.array([2, 0, 1]))
    model = SimpleNamespace(
        index=SimpleNamespace(n_bodies=3), system=SimpleNamespace(bodies=bodies)
    )
    frames = np.zeros((3, 30))
    frames[:, OMEGA : OMEGA + 3] = [[9.0, 9.0, 9.0], [0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
    rest = np.zeros(6 * 3 * 2 + N_SCALARS)
    rest[SPEED] = 20.0
    before = rest.copy()
    found = initial_state(model, SimpleNamespace(state=rest), 150.0, frames)
    rates = found[18:36].reshape(3, 6)
    assert rates[:, 3:] == pytest.approx(np.array([[8.0, 10.0, 12.0], [0, 0, 0], [2.0, 4.0, 6.0]]))
    assert not rates[:, :3].any()
    assert not found[:18].any()
    assert found[ARC_LENGTH] == 150.0
    assert (rest == before).all()
