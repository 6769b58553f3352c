"""Borders of the test zones of EN 14363."""

import math

import pytest

from railsim.assessment.sections import section_length, zone_of
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


@pytest.mark.parametrize(
    ("zone", "km_h", "length"),
    [
        ("1", 220.0, 250.0),
        ("1", 221.0, 500.0),
        ("2", 140.0, 100.0),
        ("2", 141.0, 250.0),
        ("2", 220.0, 250.0),
        ("2", 221.0, 500.0),
    ],
)
def test_lengths_of_sections_hold_up_to_their_speeds(zone, km_h, length):
    """UIC 518: 100 m up to 140, 250 m up to 220 km/h: 1.1 times 200 km/h is still of these."""
    for standard in ("en14363", "uic518"):
        assert section_length(load_running_limits(standard).zones[zone], km_h / 3.6) == length
