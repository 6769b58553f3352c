"""The same rails written twice give the same run: plan, profile and cant, or irregularities.

Displaced rails are at rest, only their shape has a rate along the way: a wheelset that follows
them (yaw = y_r', y' = V y_r') has no lateral creepage, and cross level turns rail heads and the
axes of Y and Q as cant does.
"""

import numpy as np
import pytest
from dynamics import Settings, load_vehicle
from selection import points
from twin_tracks import Wave, alignment, cross_level, differences, level, runs, widening

SPEED = 20.0  # m/s
EXACT = Settings(scheme="rk4")
FREE = Settings(scheme="rk4", drive={"mode": "free"})
R300 = 1.0 / 300.0
LATERAL = [(100.0, 0.010), (40.0, 0.004), (20.0, 0.004), (10.0, 0.002)]
HEIGHT = [(40.0, 0.008), (20.0, 0.004), (10.0, 0.002)]


@pytest.fixture(scope="module")
def coach():
    return load_vehicle("coach_manchester")


def tolerance(length):
    """1 % of the amplitude: second order in slopes of 1 mrad, and the wave as ramps of 0.25 m."""
    return 0.01 if length >= 20.0 else 0.02


def assert_same(coach, tracks, length, settings=EXACT, **more):
    one, two = runs(coach, tracks, SPEED, settings=settings)
    assert one.attributes["status"] == two.attributes["status"] == "complete"
    found = differences(one, two, **more)
    assert max(found.values()) < tolerance(length), found


@points(("length", "height"), LATERAL, always=())  # a curve asks for more: the next test
def test_alignment_is_a_wave_of_the_plan(coach, length, height):
    assert_same(coach, alignment(Wave(length, height)), length)


@points(("length", "height"), LATERAL, always=(3,))
def test_alignment_is_a_wave_of_the_plan_in_a_curve(coach, length, height):
    """In free running: a constant speed along one line is none along the other."""
    assert_same(coach, alignment(Wave(length, height), R300, 0.10), length, FREE)


@points(("length", "height"), HEIGHT, always=(2,))
def test_longitudinal_level_is_a_wave_of_the_gradient(coach, length, height):
    assert_same(coach, level(Wave(length, height)), length, FREE)


@points(("length", "height"), HEIGHT, always=(2,))
def test_longitudinal_level_is_a_wave_of_the_gradient_in_a_curve(coach, length, height):
    """Q and the vertical acceleration; Y on the guiding flange differs by up to 40 N of 35 kN."""
    one, two = runs(coach, level(Wave(length, height), R300), SPEED, settings=FREE)
    found = differences(one, two)
    assert max(found["Q"], found["vertical acceleration"]) < tolerance(length), found
    assert np.max(np.abs(one.Y - two.Y)) < 60.0


@points(("length", "height"), HEIGHT, always=(2,))
@pytest.mark.parametrize(("curvature", "cant"), [(0.0, 0.0), (R300, 0.10)])
def test_cross_level_is_a_wave_of_the_cant(coach, length, height, curvature, cant):
    assert_same(coach, cross_level(Wave(length, height), curvature, cant), length)


@pytest.mark.usefixtures("small_contact_tables")
def test_widening_of_one_rail_is_a_wider_track_beside_its_position(coach):
    assert_same(coach, widening(0.005), 5.0)


@points("write", [alignment, cross_level], always=(0,))
def test_chosen_step_and_scheme_find_the_same_too(coach, write):
    """Within 2 %: at 1.25 ms the two differ by 1.3 % of Y on cant, at half of it by 0.5 %."""
    one, two = runs(coach, write(Wave(20.0, 0.004)), SPEED, settings=Settings())
    assert max(differences(one, two).values()) < 0.02


@pytest.mark.usefixtures("small_contact_tables")
def test_gauge_widening_gives_little_lateral_force(coach):
    """10 mm over 5 m: the treads roll on other radii, 0.4 kN; a slope taken as slip gives 9 kN."""
    wider, _ = widening(0.010)
    wider = wider.replace(gauge_widening=[[40.0, 0.0], [45.0, 0.010]])
    (run,) = runs(coach, [wider], SPEED)
    assert np.max(np.abs(run.Y - run.Y[0])) < 600.0
