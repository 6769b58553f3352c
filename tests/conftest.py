"""Fixtures shared by all tests."""

import contextlib
import functools
import gc
import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings
from selection import LONG

import railsim.contact.section_tables
import railsim.contact.stored_table  # uses the class that the fixture replaces
import railsim.contact.table
import railsim.model.solutions
from railsim.contact.table import TableGrid
from railsim.kernels import lanes_plain
from railsim.laws import PERMITTED
from railsim.threads import restored_environment

gc.disable()  # until all is collected
ROOT = Path(__file__).parent.parent
SMALL_GRID = functools.partial(TableGrid, n_w=3, ds=3e-4, spacing=3e-4)
SMOOTH_GRID = functools.partial(TableGrid, n_w=3, ds=2e-4)
COARSE_GRID = functools.partial(TableGrid, n_w=3, ds=4e-4, spacing=2e-4)
collect_ignore = ["extending"]  # modules for a copy of the package, see docs/extending.md


def pytest_collection_finish():
    """What has been imported stays: to search it for garbage took a tenth of the tests' time."""
    gc.collect()
    gc.freeze()
    gc.enable()
    gc.set_threshold(10_000, 10, 50)


@pytest.fixture(scope="session")
def reference_dir():
    """Folder of the reference numbers from outside; tests skip where it is missing."""
    folder = Path(os.environ.get("RAILSIM_REFERENCE", ROOT.parent / "shared" / "reference"))
    if not folder.is_dir():
        pytest.skip(f"no reference data at {folder}")
    return folder


@pytest.fixture(scope="module", autouse=True)
def permitted_laws():
    """What tests permit by `railsim.laws.allow` ends with their file.

    In an environment that is not that of the server of workers, all workers begin by themselves:
    two seconds each.
    """
    with restored_environment(PERMITTED):
        yield


@pytest.fixture(scope="session")
def solutions_of_session(tmp_path_factory):
    """Empty folder for equilibria and steps that all processes of this session share."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "solutions"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(autouse=True)
def stored_solutions(request, solutions_of_session):
    """Equilibria and steps are found once a session: of six files of runs a fifth less time.

    A test that has replaced something, the folder it works in and arguments of a command apart, may
    have replaced what finds them: it finds them anew, once after each replacement.
    """
    folder = solutions_of_session
    for kind in ("small", "smooth", "coarse"):  # tables are no part of a solution's key
        if any(name.startswith(f"{kind}_contact_tables") for name in request.fixturenames):
            folder = folder / kind
            folder.mkdir(exist_ok=True)

    def folder_now(_):
        if "monkeypatch" not in request.fixturenames:
            return folder
        patch = request.node.funcargs.get("monkeypatch")
        if patch is None:  # a fixture is at work
            return None
        replaced = [at for at, *_ in patch._setattr if at is not sys]
        if not replaced and not patch._setitem:
            return folder
        own = request.getfixturevalue("tmp_path_factory").getbasetemp() / "solutions_of_tests"
        own /= f"{id(request.node)}_{len(replaced)}_{len(patch._setitem)}"
        own.mkdir(exist_ok=True, parents=True)
        return own

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(railsim.model.solutions, "solutions_folder", folder_now)
        patch.setattr(railsim.model.solutions, "MOST_NEW", sys.maxsize)
        patch.setattr(railsim.model.solutions, "MOST_STORED", sys.maxsize)
        yield


@contextlib.contextmanager
def small_tables(grid=SMALL_GRID):
    """Contact tables of three nodes over the yaw, not seventeen, 0.3 mm apart: 1/25 of the time.

    For tests that need another pair of profiles, another gauge or a new table, not fine values.
    """
    generator = railsim.contact.stored_table.generator_hash
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(railsim.contact.table, "TableGrid", grid)
        # those of sections have keys without the grid
        patch.setattr(
            railsim.contact.section_tables, "generator_hash", lambda: f"{generator()} {grid}"
        )
        yield


@pytest.fixture
def small_contact_tables():
    """See `small_tables`."""
    with small_tables():
        yield


@pytest.fixture(scope="module")
def small_contact_tables_in_module():
    """The same for all tests of a module and the fixtures that they share."""
    with small_tables():
        yield


@pytest.fixture
def smooth_contact_tables():
    """Likewise, 0.2 mm apart, candidates 0.1 mm, a tenth of the time: for flanks and means."""
    with small_tables(SMOOTH_GRID):
        yield


@pytest.fixture(scope="module")
def smooth_contact_tables_in_module():
    """The same for all tests of a module and the fixtures that they share."""
    with small_tables(SMOOTH_GRID):
        yield


@pytest.fixture(scope="module")
def coarse_contact_tables_in_module():
    """Likewise, 0.4 mm apart, candidates 0.2 mm: for a hundred tables along rail sections."""
    with small_tables(COARSE_GRID):
        yield


@contextlib.contextmanager
def empty_pictures():
    """Pictures are empty files: a second each where a test looks at other files only."""

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("railsim.plot.style.to_bytes", lambda *_: b"")
        yield


@pytest.fixture
def undrawn():
    """See `empty_pictures`: a block of a test."""
    return empty_pictures


# The same examples in every run; `--hypothesis-profile search` draws new ones. A first call may
# compile, and the machine may be busy: time is no property.
settings.register_profile("railsim", deadline=None, derandomize=True, max_examples=40)
settings.register_profile("search", deadline=None)
settings.load_profile("railsim")
# Nor mixed with the numbers that stand in railsim's files: a number changed there would change them
# everywhere, and to read all files takes 6 s of each process. Versions without it have no such mix.
with contextlib.suppress(ImportError, AttributeError):
    from hypothesis.internal.conjecture import providers

    providers._get_local_constants = providers.Constants


@pytest.hookimpl(tryfirst=True)
@pytest.fixture
def plain(monkeypatch):
    """Functions of a module of the kernels as they are without compilation, lanes too."""

    def without_compiler(module):
        monkeypatch.setattr(module, "unlikely", bool, raising=False)
        for name, thing in list(vars(module).items()):
            function = getattr(lanes_plain, name, getattr(thing, "py_func", thing))
            monkeypatch.setattr(module, name, getattr(module, f"{name}_plain", function))

    return without_compiler


def pytest_collection_modifyitems(config, items):
    """Leave long tests to `tests/check --all`; one that is named but not there is an error."""
    names = {item.nodeid.removeprefix("tests/"): item for item in items}
    for name in LONG & names.keys():
        names[name].add_marker(pytest.mark.further)
    files = {name.partition("::")[0] for name in names}
    missing = [name for name in LONG - names.keys() if name.partition("::")[0] in files]
    # of a file in which tests failed only these are collected again
    part = config.getoption("lf", False) or any("::" in argument for argument in config.args)
    if missing and not part:
        raise pytest.UsageError(f"tests/selection.py names what is no test: {missing}")
