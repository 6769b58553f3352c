"""Built-in profiles against points made by other programs (`contact/profiles`)."""

import csv

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from railsim.profiles import load_profile
from railsim.profiles.builtin import s1002_height


@pytest.fixture
def points(reference_dir):
    def read(name):
        with (reference_dir / "contact" / "profiles" / name).open() as file:
            rows = list(csv.DictReader(file))
        return [np.array([float(row[key]) for row in rows]) for key in ("y_mm", "z_mm")]

    return read


def distance(profile, y, z):
    """Largest distance of points [mm] from a profile's contour."""
    s = np.concatenate(([0], np.cumsum(np.hypot(np.diff(profile.y), np.diff(profile.z)))))
    fine = np.linspace(0, s[-1], 400_000)
    tree = cKDTree(1e3 * np.c_[CubicSpline(s, profile.y)(fine), CubicSpline(s, profile.z)(fine)])
    return tree.query(np.c_[y, z])[0].max()


def test_s1002_is_the_standards_polynomial(points):
    y, z = points("wheel_S1002_polynomial.csv")
    # print: eight digits of up to 28 mm
    assert np.max(np.abs(s1002_height(y) - z)) < 1e-6


def test_s1002_agrees_with_the_manchester_benchmark(points):
    y, z = points("wheel_S1002_mbench_raw.csv")  # flange at positive y there
    inside = y < 69.0
    assert np.max(np.abs(s1002_height(-y[inside]) - z[inside])) < 2e-6


def test_60e1_agrees_with_points_of_its_arcs(points):
    y, z = points("rail_60E1_EN_uncanted.csv")
    head = z < 37.0
    # distance of neighbouring sample points on the contour
    assert distance(load_profile("60E1"), y[head], z[head]) < 3e-4


def test_benchmark_rail_agrees_with_the_benchmarks_points(points):
    y, z = points("rail_UIC60_mbench_canted_1in40_raw.csv")
    head = z < 11.0  # lower down the benchmark's points leave the standard's flank
    profile = load_profile("benchmark")
    forward = np.diff(profile.y, prepend=-1.0) > 0
    contour = CubicSpline(1e3 * profile.y[forward], 1e3 * profile.z[forward])
    # the positions of the origins are free: the benchmark's lies off the rail's axis
    fit = least_squares(lambda d: contour(y[head] + d[0]) - z[head] - d[1], [7.5, 0.0])
    assert np.max(np.abs(fit.fun)) < 5e-5  # half-widths printed to 1e-5 mm
