"""Shipped vehicles and tracks: their data against figures computed independently of railsim.

Masses, wheel loads and undamped vertical modes (vertical springs alone, wheels held) of the
vehicles were computed outside railsim from the sources' numbers; a mistyped number shows.
"""

import numpy as np
import pytest
from scipy.linalg import eigh

from railsim.definitions.flatten import flatten
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.sources import library_files
from railsim.model.element_arrays import vertical_support

GRAVITY = 9.81
# mass t, Q0 kN, bounce, bogie bounce, pitch, frame pitch Hz
FIGURES = {
    "coach_25t": (49.32, 60.48, 0.903, 7.44, 0.951, 7.98),
    "coach_crh380a": (53.01, 65.00, 0.762, 7.62, 1.043, 12.21),
    "coach_zhai_ordinary": (54.51, 66.84, 0.803, 5.54, 0.845, 6.86),
    "coach_zhai_high_speed": (45.60, 55.92, 0.929, 5.07, 1.020, 5.44),
    "power_car_china_star": (78.00, 95.65, 1.127, 7.17, 1.198, 7.59),
    "benchmark_vehicle1": (44.48, 54.55, 1.074, 7.47, 1.299, 11.71),
}
MASSES = {  # t, sums of the sources' tables
    "locomotive_coco_a": 138.0,
    "locomotive_coco_b": 124.0,
    "wagon_three_piece_25t": 90.0 + 2 * 0.596 + 4 * 0.46 + 4 * 1.145,
    "wagon_c62a_empty": 14.6 + 2 * 0.47 + 4 * 0.33 + 4 * 1.2,
}


def mass(flat):
    return sum(body.mass for body in flat.bodies)


def vertical_modes(flat):
    """Frequencies of z and pitch of sprung bodies on their vertical springs [Hz], and shapes."""
    index = {body.name: 2 * k for k, body in enumerate(flat.of_kind("body"))}
    M = np.diag([v for b in flat.of_kind("body") for v in (b.mass, b.inertia[1])])
    K = np.zeros_like(M)
    for element in flat.elements:
        # the bush of a trailing arm turns and carries nothing; links along a line are not vertical
        if "bush" in element.name or element.definition.kind == "spring_damper":
            continue
        k = vertical_support(element.definition)
        row = np.zeros(len(M))
        for name, sign, point in (
            (element.body1, 1.0, element.point1),
            (element.body2, -1.0, element.point2),
        ):
            if name in index:
                i = index[name]
                row[i] += sign
                row[i + 1] -= sign * (point[0] - flat.body(name).position[0])
        K += k * np.outer(row, row)
    squares, shapes = eigh(K, M)
    return np.sqrt(np.abs(squares)) / (2.0 * np.pi), shapes, index


def mode(flat, body, component):
    """Frequency of the mode in which one component of a body has most of its energy."""
    frequencies, shapes, index = vertical_modes(flat)
    M = np.array([v for b in flat.of_kind("body") for v in (b.mass, b.inertia[1])])
    energy = M[:, None] * shapes**2
    i = index[body] + component
    return frequencies[np.argmax(energy[i])]


@pytest.mark.parametrize("name", FIGURES)
def test_masses_loads_and_vertical_modes_are_those_computed_from_the_source(name):
    flat = flatten(load_vehicle(name))
    tonnes, load, bounce, bogie_bounce, pitch, frame_pitch = FIGURES[name]
    assert 1e-3 * mass(flat) == pytest.approx(tonnes, abs=0.006)  # half a unit of the last digit
    wheels = 2 * len(flat.of_kind("wheelset"))
    assert 1e-3 * mass(flat) * GRAVITY / wheels == pytest.approx(load, abs=0.006)
    # the figures' own digits
    assert mode(flat, "carbody", 0) == pytest.approx(bounce, abs=6e-4)
    assert mode(flat, "carbody", 1) == pytest.approx(pitch, rel=0.02)
    assert mode(flat, "front.frame", 0) == pytest.approx(bogie_bounce, rel=2e-3)
    assert mode(flat, "front.frame", 1) == pytest.approx(frame_pitch, rel=0.02)


@pytest.mark.parametrize("name", MASSES)
def test_mass_is_the_sum_of_the_source(name):
    assert 1e-3 * mass(flatten(load_vehicle(name))) == pytest.approx(MASSES[name], abs=0.05)


@pytest.mark.parametrize("name", [n for n in library_files("track") if n.startswith("turnout")])
def test_arc_of_a_turnout_turns_by_its_angle(name):
    track = load_track(name)
    arc = next(element for element in track.plan if element.type == "CIR")
    ratio = float(name.rsplit("1in", 1)[1])
    # arc lengths are given to the millimetre
    assert arc.length == pytest.approx(arc.radius * np.arctan(1.0 / ratio), abs=5e-4)


@pytest.mark.parametrize("name", library_files("vehicle"))
def test_every_vehicle_says_where_its_numbers_come_from(name):
    assert load_vehicle(name).source


@pytest.mark.parametrize("name", library_files("track"))
def test_every_track_says_where_its_numbers_come_from(name):
    assert load_track(name).source
