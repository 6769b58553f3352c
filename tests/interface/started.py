"""A command in a process of its own, to be interrupted."""

import subprocess
import sys


def started(arguments):
    """Start railsim; Ctrl-C and hang-ups count even where a shell started the tests without.

    It is there when this returns, however long Python takes to begin.
    """
    call = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler);"
        "signal.signal(signal.SIGHUP, signal.SIG_DFL);"
        "from railsim.cli import main; print('begun', flush=True); sys.exit(main())"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", call, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout.readline() == "begun\n"
    return process
