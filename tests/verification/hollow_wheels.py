"""Wheels worn hollow, for the tests."""

import numpy as np

from railsim.profiles import load_profile
from railsim.profiles.profile import Profile


def hollow_wheel(depth, width=0.05):
    """S1002 with a hollow of the tread, one wave of 1 - cos about the nominal rolling circle."""
    new = load_profile("S1002", kind="wheel")
    y = np.linspace(np.min(new.y), np.max(new.y), 2001)
    u = np.clip(2.0 * y / width, -1.0, 1.0)
    z = np.interp(y, new.y, new.z) - 0.5 * depth * (1.0 + np.cos(np.pi * u))
    return Profile("hollow", "wheel", y, z, f"S1002, {1e3 * depth:g} mm hollow")
