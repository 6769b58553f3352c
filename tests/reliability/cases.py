"""How many cases the seeded suites try, and how a command is judged."""

import os
import resource
import time
from contextlib import contextmanager

from railsim.cli import main

# cases of each suite in the normal run; RAILSIM_CASES=4000 asks for more of every kind
MORE = int(os.environ.get("RAILSIM_CASES", "0"))
SECONDS = 10.0
MEGABYTES = 2000.0


def number(normal: int) -> int:
    """Return how many cases of a suite to try."""
    return max(normal, MORE)


@contextmanager
def bounded(what: str):
    """Fail where the block takes longer than `SECONDS` of CPU time, or the process `MEGABYTES`."""
    begin = time.process_time()
    yield
    assert time.process_time() - begin < SECONDS, f"{what}: a hang"
    # in kB on Linux, the most of this process so far
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3 < MEGABYTES, f"{what}: memory"


def outcome(arguments, capsys, what):
    """Call a command; return its exit status, which is never that of an unforeseen error."""
    with bounded(what):
        status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err, f"{what}: {err}"
    assert "should not happen" not in err, f"{what}: {arguments}\n{err}"
    assert status in (0, 2, 3), f"{what}: status {status}: {err}"
    assert (status == 2) == bool(err.strip()) or status != 2, f"{what}: no word on stderr"
    return status
