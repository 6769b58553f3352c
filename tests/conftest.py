"""Fixtures shared by all tests."""

import functools
import os
from pathlib import Path

import pytest
from hypothesis import settings
from selection import LONG

import railsim.contact.stored_table  # uses the class that the fixture replaces
import railsim.contact.table
import railsim.model.solutions
from railsim.contact.table import TableGrid

ROOT = Path(__file__).parent.parent
SMALL_GRID = functools.partial(TableGrid, n_w=6)
collect_ignore = ["extending"]  # modules for a copy of the package, see docs/extending.md


@pytest.fixture(scope="session")
def reference_dir():
    """Folder of the reference numbers from outside; tests skip where it is missing."""
    folder = Path(os.environ.get("RAILSIM_REFERENCE", ROOT.parent / "shared" / "reference"))
    if not folder.is_dir():
        pytest.skip(f"no reference data at {folder}")
    return folder


@pytest.fixture(autouse=True)
def no_stored_solutions(monkeypatch):
    """Equilibria and steps are found anew: a test may replace what finds them."""
    monkeypatch.setattr(railsim.model.solutions, "solutions_folder", lambda _: None)


@pytest.fixture
def small_contact_tables(monkeypatch):
    """Contact tables of six nodes over the yaw, not seventeen: built in a third of the time.

    For tests that need another pair of profiles, another gauge or a new table, not fine values.
    """
    monkeypatch.setattr(railsim.contact.table, "TableGrid", SMALL_GRID)


@pytest.fixture(scope="module")
def small_contact_tables_in_module():
    """The same for all tests of a module and the fixtures that they share."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(railsim.contact.table, "TableGrid", SMALL_GRID)
        yield


# a first call may compile, and the machine may be busy: time is no property
settings.register_profile("railsim", deadline=None)
settings.load_profile("railsim")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Leave long tests to `tests/check --all`."""
    for item in items:
        if item.nodeid.removeprefix("tests/") in LONG:
            item.add_marker(pytest.mark.further)
