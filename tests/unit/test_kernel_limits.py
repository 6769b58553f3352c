"""What kernels do at the ends of what they take, called by themselves, not compiled."""

from types import SimpleNamespace as Record

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from railsim.kernels import contact_geometry, linkage
from railsim.kernels.linkage import CAM, REVOLUTE


@pytest.mark.parametrize("touch", [0.3e-3, 0.7e-3, 2.2e-3, 4.3e-3, 4.7e-3])
def test_a_wheel_may_touch_between_the_last_two_of_its_candidates(touch, plain):
    """Of a round tread on level rails the lowest point, not the end of the wheel."""
    u, level, found = 1e-3 * np.arange(6.0), np.zeros(4), np.zeros(6)
    wheel = np.array([u, 0.46 - 2.0 * (u - touch) ** 2, -4.0 * (u - touch)])
    plain(contact_geometry)
    contact_geometry.rigid_contact(wheel, -0.01, 0.01, level, level, 0.46, 0.0, 0.0, found)
    assert found == pytest.approx([0.0, touch, 0.46, touch, 0.0, round(1e3 * touch)])


@pytest.mark.parametrize("roll", [-0.4, 0.0, 0.17, 0.31])
def test_a_rolled_wheel_touches_level_rails_where_its_tread_is_level(roll, plain):
    """Of a parabola r = R - (u - u0)^2/(2 rho) at u0 + rho tan(roll), whatever its candidates."""
    u, level, found, rho = 1e-3 * np.arange(-9.0, 10.0), np.zeros(4), np.zeros(6), 0.012
    wheel = np.array([u, 0.46 - (u - 1.3e-3) ** 2 / (2.0 * rho), -(u - 1.3e-3) / rho])
    plain(contact_geometry)
    contact_geometry.rigid_contact(wheel, -1.0, 0.01, level, level, 0.46, 0.0, roll, found)
    t = np.tan(roll)
    at, radius = 1.3e-3 + rho * t, 0.46 - 0.5 * rho * t**2
    gap = 0.46 - at * np.sin(roll) - radius * np.cos(roll)
    aside = at * np.cos(roll) - radius * np.sin(roll)
    expected = [gap, at, radius, aside, 0.0]
    assert found[:5] == pytest.approx(expected, abs=1e-12)


def one_driver(kind, point_1, point_2):
    """Two bodies with points on them, and a driver."""
    random = np.random.default_rng(3)
    return Record(
        n_bodies=2, joint=np.zeros((0, 6), dtype=np.int64), point=random.normal(size=(1, 2, 2)),
        point_body=np.array([1, 2]), driver=np.array([kind, point_1, point_2]),
        driver_value=np.array([0.3]), value=np.zeros((1, 0, 2)),
    )  # fmt: skip


@pytest.mark.parametrize(
    "driver", [(linkage.ANGLE, 2, 0), (linkage.LENGTH, 0, 1), (linkage.X, 1, 0), (linkage.Y, 1, 0)]
)
def test_what_drives_a_mechanism_has_its_own_derivatives(driver, plain):
    """Row of the Jacobian, and -(Phi_qq v) v along any motion."""
    given, (one, two) = one_driver(*driver), np.zeros((2, 4))
    random, J, right = np.random.default_rng(4), np.zeros((6, 6)), np.zeros(6)
    q, v = random.normal(size=(2, 3, 3))
    q[0] = v[0] = 0.0
    plain(linkage)

    def residual(moved):
        Phi, pose = np.zeros(6), q.copy()
        pose[1:] = np.reshape(moved, (2, 3))
        linkage.write_driver_row(given, 0, pose, 0.2, Phi, np.zeros((6, 6)), 5, one, two)
        return Phi[5]

    linkage.write_driver_row(given, 0, q, 0.2, np.zeros(6), J, 5, one, two)
    at, way = q[1:].ravel(), v[1:].ravel()
    assert J[5] == pytest.approx(approx_fprime(at, residual), abs=1e-6)
    linkage.write_acceleration_side(given, 0, None, q, v, right, one, two)
    h = 1e-4
    second = (residual(at + h * way) - 2.0 * residual(at) + residual(at - h * way)) / h**2
    assert right[5] == pytest.approx(-second, abs=1e-5)


@pytest.mark.parametrize(("angle", "found"), [(0.5, 0), (-0.2, -2), (1.8, -2)])
def test_a_roller_that_leaves_its_cam_is_told_by_the_number_of_its_joint(angle, found, plain):
    """One arc of a quarter of a circle about the origin, as the second of two joints."""
    cam = Record(
        joint=np.array([[REVOLUTE, 0, 0, 0, 0, 0], [CAM, 0, 1, 2, 0, 1]]),
        point=np.array([[[np.cos(angle), np.sin(angle)], [0.0, 0.0]]]),
        point_body=np.array([1, 0]),
        arc_point=np.array([1]),
        arc_ends=np.array([[1.0, 0.0, 0.0, 1.0, 1.0]]),
        size=1.0,
    )
    at = np.zeros((2, 4))
    plain(linkage)
    given = cam, np.zeros((2, 3)), np.zeros(2, dtype=np.int64), *at
    assert linkage.move_along_cams(*given) == found
