"""Wear of rails: volume of the laws, position on the head, tonnage, both hands."""

import numpy as np
import pytest

import railsim
from railsim.assessment.wear_depth import (
    SPACING,
    grid,
    parts_of_step,
    rail_depth,
    upper_side,
    wheel_dimensions,
    worn_profile,
)
from railsim.assessment.wear_depth import worn_depth as wheel_depth
from railsim.constants import GRAVITY
from railsim.definitions.settings import Settings
from railsim.errors import InputError
from railsim.profiles import load_profile
from railsim.profiles.profile import Profile
from railsim.studies.rail_wear import rail_rows, rail_wear

SETTINGS = Settings(start_state="steady")
pytestmark = pytest.mark.usefixtures("small_contact_tables")


def curve(hand=1):
    return railsim.load_track("curve_r250").replace(
        plan=[{"type": "CIR", "length": 6.0, "radius": 500.0 * hand}],
        cant=[{"type": "CST", "length": 6.0, "cant": 0.1 * hand}],
    )


@pytest.fixture(scope="module")
def run():
    outputs = {"contact_patches": True, "track": True}
    return railsim.simulate(railsim.load_vehicle("coach_manchester"), curve(), speed=20.0,
                            settings=SETTINGS.model_copy(update={"outputs": Settings(
                                outputs=outputs).outputs}))  # fmt: skip


@pytest.mark.parametrize("side", [0, 1])
def test_rail_loses_the_volume_of_the_wheel_where_it_is_touched(run, side):
    worn, wheel = rail_depth(run, 0, side), wheel_depth(run, 0, side)
    assert np.sum(worn) == pytest.approx(np.sum(wheel) * np.pi * 0.92, rel=1e-6)
    middle = np.sum(worn * grid()) / np.sum(worn)
    # the outer rail, the left one, on its gauge side; the inner one on its head
    assert middle < -0.015 if side == 0 else abs(middle) < 0.03


def test_rails_that_are_wider_apart_wear_in_the_place_of_the_contact():
    """The slope of the head, R 300 mm, where it wears is the mean one of the contacts.

    The right rail stands 3 mm aside, and deflects by up to 0.7 mm: 0.0100 and 0.0023 of slope.
    """
    coach, outputs = railsim.load_vehicle("coach_manchester"), {"contact_patches": True}
    wider = curve().replace(gauge_widening=[[-1e3, 0.0, 3e-3], [1e3, 0.0, 3e-3]])
    (step,) = rail_wear(wider, [(coach, 20.0, 1.0)], step=5e6, steps=1, settings=SETTINGS)
    depth = step.depths["right"]
    middle = np.sum(depth * grid()) / np.sum(depth)
    y, z = step.profiles["right"].y, step.profiles["right"].z
    slope = np.interp(middle, 0.5 * (y[1:] + y[:-1]), np.diff(z) / np.diff(y)) - 1.0 / 40.0
    run = railsim.simulate(
        coach, wider, speed=20.0, settings=Settings(start_state="steady", outputs=outputs)
    )
    worn = [np.sum(wheel_depth(run, w, 1)) for w in range(4)]
    most = np.argmax(run["patch_N"][-1, :, 1], axis=-1)[:, None]
    angles = np.take_along_axis(run["patch_angle"][-1, :, 1], most, axis=-1)[:, 0]
    assert slope == pytest.approx(-np.average(np.tan(angles), weights=worn), abs=0.001)


@pytest.mark.parametrize("place", [-0.034, -0.02, 0.0, 0.02])
def test_worn_rail_loses_the_area_and_nothing_below_its_head(place):
    from railsim.assessment.wear_depth import spread

    new = load_profile("60E1")
    worn = worn_profile(new, spread(np.array([place]), np.array([4e-3]), np.array([5e-7])), 1.0)
    y = np.concatenate([new.y, np.asarray(worn.y)[::-1]])
    z = np.concatenate([new.z, np.asarray(worn.z)[::-1]])
    between = 0.5 * abs(np.sum(y * np.roll(z, -1) - z * np.roll(y, -1)))
    assert between == pytest.approx(5e-7, rel=1e-4)
    assert np.min(worn.z - new.z) >= 0.0


def test_no_wheel_reaches_the_web_of_a_rail_or_below_its_head():
    """A head 72 mm wide on a web of 16 mm, undercut by 28 mm on both sides."""
    web, rise = np.linspace(0.06, 0.04, 5), np.array([0.038, 0.03, 0.02, 0.01])
    half = np.concatenate([[0.008] * 5, [0.02, 0.036, 0.0361, 0.0362]]), np.append(web, rise)
    y = np.concatenate([-half[0], [-0.02, 0.0, 0.02], half[0][::-1]])
    z = np.concatenate([half[1], [0.001, 0.0, 0.001], half[1][::-1]])
    assert (y[8], y[12]) == (-0.0362, 0.0362)  # the widest points of the head
    assert upper_side(Profile("a whole rail", "rail", y, z, "drawn")) == slice(8, 13)


def test_a_wrong_step_is_named_as_tonnage():
    mix = [(railsim.load_vehicle("coach_manchester"), 20.0, 1.0)]
    with pytest.raises(railsim.InputError, match="step: found -1 Mt; above 0"):
        rail_wear(curve(), mix, step=-1e9, steps=1)


def test_rails_wear_over_the_tonnage_of_a_mix():
    coach, told = railsim.load_vehicle("coach_manchester"), []
    mix = [(coach, 20.0, 3.0), (coach, 18.0, 1.0)]
    (step,) = rail_wear(curve(), mix, step=5e6, steps=1, settings=SETTINGS, on_step=told.append)
    assert told == [step]
    rows = rail_rows([step])

    # a train of all its axles passes for every mass of the coach
    def passed(speed):
        run = railsim.simulate(coach, curve(), speed=speed, settings=Settings(
            start_state="steady", outputs={"contact_patches": True, "track": True}))  # fmt: skip
        trains = 5e6 / (float(np.sum(run["Q0"])) / GRAVITY)
        return [sum(rail_depth(run, w, side) for w in range(4)) * trains for side in (0, 1)]

    fast, slow = passed(20.0), passed(18.0)
    for k, side in enumerate(("left", "right")):
        expected = 0.75 * fast[k] + 0.25 * slow[k]
        np.testing.assert_allclose(step.depths[side] * 5e6, expected, rtol=1e-9, atol=1e-15)
        assert [row["distance"] for row in rows[side]] == [0.0, 5e6]
        assert rows[side][1]["area"] == pytest.approx(SPACING * np.sum(expected), rel=1e-4)
        worn = step.worn_profiles[side]
        assert (worn.kind, worn.name) == ("rail", f"60E1, {side} worn")


def test_every_vehicle_of_a_mix_that_hunts_is_named():
    """Two coaches hunt at 60 m/s on the straight: one remark each, with its name."""
    straight = railsim.load_track("straight").replace(plan=[{"type": "STR", "length": 60.0}])
    coach, told = railsim.load_vehicle("coach_manchester"), []
    names = ["coach A", "coach B"]
    mix = [(coach.model_copy(update={"name": name}), 60.0, 1.0) for name in names]
    rail_wear(straight, mix, step=1e3, steps=1, on_remark=told.append)
    began = [words.split(": The vehicle hunts at")[0] for words in told]
    assert began == [f"after 0 Mt on {straight.name} at 60 m/s, {name}" for name in names]


def test_left_hand_curve_wears_the_other_rail_alike():
    coach = railsim.load_vehicle("coach_manchester")
    (right,), (left,) = (
        rail_wear(curve(hand), [(coach, 20.0, 1.0)], step=5e6, steps=1, settings=SETTINGS)
        for hand in (1, -1)
    )
    np.testing.assert_allclose(
        left.depths["right"], right.depths["left"], atol=1e-3 * np.max(right.depths["left"])
    )


def test_dimensions_of_the_wheel():
    found = wheel_dimensions(load_profile("S1002"))
    assert found.flange_height == pytest.approx(28e-3, abs=0.05e-3)
    assert found.flange_thickness == pytest.approx(32.5e-3, abs=0.05e-3)
    assert found.flange_slope == pytest.approx(10.8e-3, abs=0.05e-3)
    assert found.hollow == 0.0
    hollow = wheel_dimensions(load_profile("S1002_hollow"))
    assert 0.2e-3 < hollow.hollow < 0.9e-3
    assert hollow.flange_height > found.flange_height


@pytest.mark.parametrize("steps", [parts_of_step, worn_profile])
def test_too_much_wear_of_a_rail_is_told_with_the_tonnage(steps):
    """10 Mt that wear it 20 mm deep: they were called 1e+07 km."""
    depth = np.where(np.abs(grid()) < 0.03, 2e-12, 0.0)  # m/kg
    with pytest.raises(InputError, match=r"10 Mt wear (it )?20 mm deep; at most"):
        steps(load_profile("60E1"), depth, 1e10)
