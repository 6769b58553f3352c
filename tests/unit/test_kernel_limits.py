"""What kernels do at the ends of what they take, called by themselves, not compiled."""

from types import SimpleNamespace as Record

import numpy as np
import pytest

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
