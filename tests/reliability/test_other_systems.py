"""Without what only some systems have: a start, a run and a study where it is missing.

macOS and Windows themselves were not tried.
"""

import os
import subprocess
import sys
from pathlib import Path

from selection import points

MODULES = ("fcntl", "resource", "termios", "tty", "pwd", "grp")
OS = (
    "geteuid getuid getgid getegid O_NOFOLLOW O_NONBLOCK O_DIRECTORY sched_getaffinity fork "
    "forkpty killpg getpgid statvfs getloadavg mkfifo register_at_fork"
)
SIGNALS = "SIGHUP SIGKILL SIGALRM SIGUSR1 pthread_sigmask"
PROGRAM = f"""
import multiprocessing, os, signal, sys
sys.modules.update(dict.fromkeys({MODULES!r}))
for module, names in ((os, {OS!r}), (signal, {SIGNALS!r})):
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)
multiprocessing.get_all_start_methods = lambda: ["spawn"]
if sys.argv[1] == "closed":  # Windows neither renames nor removes an open file
    import railsim.files.access
    railsim.files.access._CLOSED_FIRST = True
from railsim.cli import main
sys.exit(main(sys.argv[2:]))
"""
ROUTE = ["coach_manchester", "straight"]
MANY = ["--vehicles", "coach_manchester", "--tracks", "straight", "--speeds", "20", "30"]


@points(
    ("files", "command"),
    [
        ("open", ["list"]),
        ("open", ["bench", "--help"]),
        ("closed", ["run", *ROUTE, "--speed", "20", "--until", "2", "--out", "run.h5"]),
        ("closed", ["study", *MANY, "--until", "2", "--workers", "1", "--out", "all"]),
    ],
    always=(0, 1, 3),  # a study writes a run's result, too
    ids=["list", "bench", "run", "study"],
)
def test_command_works_without_what_posix_has(files, command, tmp_path):
    # without owners of folders the cache is trusted below the home of the user
    cache = os.environ.get("RAILSIM_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, files, *command],
        cwd=tmp_path,
        env={**os.environ, "HOME": cache or str(Path.home())},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    written = {"run": "run.h5", "study": "all/study.json"}.get(command[0])
    assert written is None or (tmp_path / written).is_file()
    assert "is not used" not in done.stderr  # the cache
