"""Processes that share the cores: no threads of linear algebra, no code but railsim's own."""

import os
import platform
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

import railsim
from railsim.processes import WorkerPool, workers_begin
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


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")
def test_freed_arrays_leave_their_memory_to_the_next_ones():
    program = (
        "import resource, numpy; from railsim.threads import keep_freed_memory;"
        "keep_freed_memory(); pages = [];\n"
        "for _ in range(3):\n"
        "    arrays = [numpy.ones(100_000) for _ in range(20)]; del arrays\n"
        "    pages.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)\n"
        "print(pages[2] - pages[1])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert int(done.stdout) < 100  # 16 MB are 3900 pages


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
    assert {name for name, text in texts.items() if "ProcessPoolExecutor" in text} == OWN
    assert {name for name, text in texts.items() if "WorkerPool(" in text} > OWN


def test_workers_end_with_a_process_that_ends_without_a_word():
    """They keep the pipe open from which they read their tasks: it has no end for them."""
    program = (
        "import os; from railsim.processes import WorkerPool;"
        "pool = WorkerPool(2); print(pool.submit(abs, -3).result(), flush=True); os._exit(0)"
    )
    # ends when nobody can write any more
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120
    )
    assert done.stdout == "3\n"


def test_exception_in_the_block_of_a_pool_kills_its_workers():
    pool = WorkerPool(2)
    with suppress(KeyError), pool:
        pool.submit(time.sleep, 600.0)
        raise KeyError
    # the server of the workers may end before it has said by which signal: 255
    assert {process.exitcode for process in pool.begun} <= {-signal.SIGKILL, 255}


def test_workers_that_end_by_themselves_in_time_are_not_killed():
    """By their task: of two threads that ask for an exit status one may get 255."""
    pool = WorkerPool(1)
    task = pool.submit(time.sleep, 0.2)
    while not task.running():  # what has not begun is cancelled
        time.sleep(0.001)
    pool.end(60.0)
    assert task.result(60.0) is None
    assert {process.exitcode for process in pool.begun} <= {0, 255}
