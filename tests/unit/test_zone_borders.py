"""Borders of the test zones of EN 14363."""

import math

import pytest

from railsim.assessment.sections import zone_of
from railsim.definitions.loading import load_running_limits

FULL = 0.150  # cant deficiency, m


@pytest.mark.parametrize(
    ("radius", "zone"),
    [
        (249.9, ""),
        (250.0, "4"),
        (399.9, "4"),
        (400.0, "3"),
        (600.0, "3"),
        (600.1, "2"),
        (math.inf, "1"),
    ],
)
def test_ends_of_zone_3_belong_to_it(radius, zone):
    """UIC 518: small radii 400 m <= R <= 600 m, very small ones 250 m <= R < 400 m."""
    for standard in ("en14363", "uic518"):
        limits = load_running_limits(standard)
        assert zone_of(radius, FULL, limits) == zone_of(-radius, FULL, limits) == zone
