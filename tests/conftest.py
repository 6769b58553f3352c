"""Fixtures shared by all tests."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="session")
def reference_dir():
    """Folder of the reference numbers from outside; tests skip where it is missing."""
    folder = Path(os.environ.get("RAILSIM_REFERENCE", ROOT.parent / "shared" / "reference"))
    if not folder.is_dir():
        pytest.skip(f"no reference data at {folder}")
    return folder


# a first call may compile, and the machine may be busy: time is no property
settings.register_profile("railsim", deadline=None)
settings.load_profile("railsim")
