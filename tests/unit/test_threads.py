"""Processes that share the cores: no threads of linear algebra, no code but railsim's own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import railsim
from railsim.processes import workers_begin
from railsim.threads import VARIABLES, one_thread_each

OWN = {"processes.py"}
SHOW = [sys.executable, "-c", f"import os; print(*(os.environ.get(n) for n in {VARIABLES}))"]


def seen_by_a_process():
    return subprocess.run(SHOW, capture_output=True, text=True, check=True).stdout.split()


@pytest.fixture(autouse=True)
def nothing_is_set(monkeypatch):
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)


def test_processes_started_within_have_one_thread_and_later_ones_their_own_choice():
    with one_thread_each():
        assert seen_by_a_process() == ["1"] * 3
    assert seen_by_a_process() == ["None"] * 3


def test_what_a_user_has_set_stands(monkeypatch):
    monkeypatch.setenv(VARIABLES[1], "4")
    with one_thread_each():
        assert seen_by_a_process() == ["1", "4", "1"]
    assert [name for name in VARIABLES if name in os.environ] == [VARIABLES[1]]


def test_workers_import_no_modules_of_the_folder_they_begin_in(tmp_path, monkeypatch):
    (tmp_path / "socket.py").write_text("raise SystemExit('foreign code')")
    monkeypatch.chdir(tmp_path)
    before = dict(os.environ), sys.modules["__main__"]
    with workers_begin():
        subprocess.run([sys.executable, "-c", "import socket"], check=True)
        assert not hasattr(sys.modules["__main__"], "__file__")  # the user's script
    assert (dict(os.environ), sys.modules["__main__"]) == before


def test_all_pools_of_processes_begin_so():
    paths = Path(railsim.__file__).parent.rglob("*.py")
    texts = {path.name: path.read_text(encoding="utf-8") for path in paths}
    pools = {name for name, text in texts.items() if "ProcessPoolExecutor(" in text}
    assert pools == {name for name, text in texts.items() if "workers_begin()" in text} - OWN
