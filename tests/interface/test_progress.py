"""What the user hears while something is prepared: once, and only if it is."""

import time

import pytest

from railsim.cli import progress


@pytest.fixture(autouse=True)
def short_patience(monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE", 0.01)
    monkeypatch.setattr(progress, "_reported", set())


def work(module):
    """Be busy in a module of this name."""
    code = "import time\ntime.sleep(0.2)"
    exec(compile(code, "busy.py", "exec"), {"__name__": module})


@pytest.mark.parametrize(
    ("module", "words"),
    [("numba.core.compiler_machinery", "compiling"), ("railsim.contact.table", "contact table")],
)
def test_the_cause_is_named_once(module, words, capsys):
    for _ in range(2):
        with progress.progress_bar("run", quiet=False):
            work(module)
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert said[0].startswith("preparing: ")
    assert words in said[0]


def test_nothing_is_said_where_nothing_is_prepared(capsys):
    with progress.progress_bar("run", quiet=False):
        time.sleep(0.1)
    with progress.progress_bar("run", quiet=False):
        work("numba.core.dispatcher")  # loads what has been compiled
    with progress.progress_bar("run", quiet=True):
        work("numba.core.compiler_machinery")
    assert capsys.readouterr().err == ""
