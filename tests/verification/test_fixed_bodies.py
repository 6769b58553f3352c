"""Bodies fixed to the ground or to their moving track frames: rigs, bogies under a held car."""

import numpy as np
import pytest
from dynamics import load_track, load_vehicle
from rig import test_vehicle

import railsim
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import InputError
from railsim.linear.stability_loss import loss_of_stability
from railsim.linear.vehicle import Contact, LinearVehicle
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium

STRAIGHT = load_track("straight")
CURVE = load_track("curve_r250")
BODY = {"mass": 1e3, "inertia": [1e3, 1e3, 1e3], "position": [0.0, 0.0, -1.0]}


def rig(*free, **elements):
    """A single wheelset with an anchor fixed to the ground above it, and bodies that are free."""
    data = test_vehicle("single_wheelset").model_dump(exclude_none=True)
    bodies = {"anchor": {**BODY, "fixed": "ground"}} | dict.fromkeys(free, BODY)
    return Vehicle.model_validate({**data, "bodies": bodies, "elements": elements})


def held_coach(name="coach_manchester"):
    """A shipped coach whose car body is held in the track frame."""
    data = load_vehicle(name).model_dump(exclude_none=True)
    data["bodies"]["carbody"]["fixed"] = "track"
    return Vehicle.model_validate(data)


def hanging(stiffness):
    """A spring between anchor and probe, stiff about all axes."""
    return {
        "kind": "bushing",
        "bodies": ["anchor", "probe"],
        "point": [0.0, 0.0, -1.0],
        "stiffness": stiffness,
        "rotational_stiffness": [1e5, 1e5, 1e5],
    }


@pytest.mark.usefixtures("small_contact_tables")
def test_a_mass_on_springs_to_the_ground_has_its_closed_frequencies():
    """sqrt(k/m)/2pi along three axes; about each sqrt(k_r/I)/2pi."""
    found = railsim.modes(
        rig("probe", spring=hanging([2e5, 3e5, 4e5])), STRAIGHT, speed=5.0, held=True
    )
    frequencies = [mode.natural_frequency for mode in found.oscillations]
    closed = np.sqrt([1e5] * 3 + [2e5, 3e5, 4e5]) / np.sqrt(1e3) / (2.0 * np.pi)
    assert frequencies == pytest.approx(closed, rel=1e-6)


@pytest.mark.usefixtures("small_contact_tables")
def test_a_run_on_the_rig_oscillates_as_the_closed_solution():
    """z = z0 cos(omega t); the frequency is wrong by (omega h)^2/24, 4e-6."""
    vehicle = rig("probe", spring=hanging([2e5, 3e5, 4e5]))
    settings = Settings.model_validate({"initial": {"probe": {"z": 0.01}}, "step": 5e-4})
    result = railsim.simulate(vehicle, STRAIGHT, speed=5.0, duration=0.5, settings=settings)
    position = result.body_position
    probe, anchor = (list(result.coordinates["body"]).index(name) for name in ("probe", "anchor"))
    assert position[:, probe, 2] == pytest.approx(0.01 * np.cos(20.0 * result.time), abs=1e-6)
    assert not position[:, anchor].any()


@pytest.mark.usefixtures("small_contact_tables")
def test_wheelset_on_springs_to_the_ground_hunts_at_the_speed_computed_independently():
    """L2: cones 1:20, friction 1, k_y 2e5 N/m, k_yaw 4e5 N m; 41.37 m/s, 2.524 Hz, 2 %."""
    spring = {
        "kind": "bushing",
        "bodies": ["anchor", "wheelset"],
        "point": [0.0, 0.0, -0.46],
        "stiffness": [1e6, 2e5, 0.0],  # what holds the wheelset along the track moves nothing else
        "rotational_stiffness": [0.0, 0.0, 4e5],
    }
    vehicle = LinearVehicle(
        rig(guide=spring), STRAIGHT.replace(friction=1.0), contact=Contact("harmonic", 1e-3)
    )
    lost = loss_of_stability(vehicle.linearised, 20.0, 70.0, points=4)
    assert lost.parameter == pytest.approx(41.37, rel=0.02)
    assert lost.modes[0].frequencies[0] == pytest.approx(2.524, rel=0.02)


def test_modes_under_a_fixed_car_are_those_with_the_car_held():
    """The other way to hold a car: it is left out of the linearisation.

    Both bogies have the same modes; of such a pair the mean counts, which does not split.
    """
    held = railsim.modes(load_vehicle("coach_manchester"), STRAIGHT, speed=30.0, hold=["carbody"])
    fixed = railsim.modes(held_coach(), STRAIGHT, speed=30.0)
    one, other = ([m.eigenvalue for m in modes.oscillations] for modes in (held, fixed))
    means = [
        np.reshape(sorted(values, key=np.imag), (-1, 2)).mean(axis=1) for values in (one, other)
    ]
    assert means[1] == pytest.approx(means[0], rel=1e-5)


def test_a_fixed_car_carries_its_weight_on_its_springs():
    """It is let down before it is held: the wheel loads are those of the free vehicle."""
    loads = [
        equilibrium(assemble(vehicle, CURVE, Settings()), 20.0).Q0
        for vehicle in (held_coach(), load_vehicle("coach_manchester"))
    ]
    assert loads[0] == pytest.approx(loads[1], rel=1e-9)


def bogie_under_a_held_car():
    """One bogie of a coach with half of the car held above it."""
    data = load_vehicle("coach_manchester").model_dump(exclude_none=True)
    bogie = data["assemblies"]["bogie"]
    bogie["placements"] = [{"name": "front"}]
    car = data["bodies"]["carbody"]
    car |= {"mass": 0.5 * car["mass"], "fixed": "track"}
    return Vehicle.model_validate(data)


@pytest.fixture(scope="module")
def through_the_curve():
    """A bogie under a held car from the straight into a canted curve."""
    how = {"speed": 20.0, "start": 290.0, "until": 400.0}
    settings = Settings.model_validate({"outputs": {"elements": ["*secondary*"]}})
    return railsim.simulate(bogie_under_a_held_car(), CURVE, settings=settings, **how)


def test_a_fixed_car_stays_in_the_moving_track_frame(through_the_curve):
    """Through transition, curve and cant; nothing moves in its frame."""
    result = through_the_curve
    car = list(result.coordinates["body"]).index("carbody")
    assert np.ptp(result.body_position[:, car], axis=0) == pytest.approx(0.0, abs=0.0)
    assert result.body_velocity[:, car] == pytest.approx(0.0, abs=1e-15)


def test_a_fixed_car_turns_with_the_curve(through_the_curve):
    """Mid-curve it and the bogie turn alike: dampers between them take nothing; 100 W otherwise."""
    assert len(through_the_curve.coordinates["element"]) == 6
    assert through_the_curve.element_power[-1] == pytest.approx(0.0, abs=1e-2)


def test_a_fixed_car_has_the_acceleration_of_its_position_in_the_curve(through_the_curve):
    """V^2/R towards the centre in level axes, turned by the cant; R is the body's own."""
    result = through_the_curve
    car = list(result.coordinates["body"]).index("carbody")
    height = 1.8  # m above the rails
    cant = np.arcsin(0.15 / 1.5)
    # leaning inwards (to the right) the centre of gravity runs on a smaller circle
    radius = 250.0 - height * np.sin(cant)
    towards = 20.0**2 * radius / 250.0**2
    assert result.body_acceleration[-1, car, 1] == pytest.approx(towards * np.cos(cant), rel=1e-4)
    assert result.body_acceleration[-1, car, 2] == pytest.approx(-towards * np.sin(cant), rel=1e-3)


@pytest.mark.parametrize(
    ("vehicle", "track", "settings", "sentence"),
    [
        (rig(), CURVE, {}, "fixed to the ground beside curves, cant or gradients"),
        (held_coach(), STRAIGHT, {"drive": {"mode": "free"}}, "free running with carbody fixed"),
    ],
)
def test_what_cannot_be_fixed_is_told(vehicle, track, settings, sentence):
    """One line: where, what was found, what is allowed."""
    with pytest.raises(InputError, match=sentence):
        railsim.simulate(
            vehicle, track, speed=10.0, settings=Settings.model_validate(settings), duration=0.1
        )


@pytest.mark.usefixtures("small_contact_tables")
def test_a_body_that_cannot_stand_by_itself_is_held_in_its_nominal_position():
    """An anchor without springs; the run says so."""
    vehicle = rig("probe", spring=hanging([2e5, 3e5, 4e5]))
    assert equilibrium(assemble(vehicle, STRAIGHT, Settings()), 5.0).remarks == (
        "Held in the nominal position, where it could not stand on its springs alone: anchor.",
    )
