"""Processes that share the cores do not start threads of the linear algebra library."""

import os
import subprocess
import sys

import pytest

from railsim.threads import VARIABLES, one_thread_each

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
