"""How many cases the seeded suites try, and how a command is judged."""

import os
import re
import signal
import sys
import time
import traceback
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

from railsim.cli import main

# cases of each suite in the normal run; RAILSIM_CASES=4000 asks for more of every kind, and
# RAILSIM_CASES=2000:4000 for those with seeds from 2000 on
FIRST, MORE = (int(part or 0) for part in os.environ.get("RAILSIM_CASES", "0").rpartition(":")[::2])
SECONDS = 10.0
MEGABYTES = 2000.0


def tried(normal: int, case) -> list:
    """Call `case` with every seed and return what it returns; all failures are told at the end."""
    outcomes, failed, end = [], [], max(normal, MORE)
    count = end - FIRST
    for seed in range(FIRST, end):
        try:
            outcomes.append(case(seed))
        except Exception as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            words = f"seed {seed}: {type(error).__name__}: {error} ({frame.name}:{frame.lineno})"
            failed.append(words[:2000])
            if MORE:
                print(f"\n{words[:2000]}", file=sys.__stderr__, flush=True)
        if MORE and seed % 20 == 19:
            print(f"\n{case.__qualname__} {seed + 1} of {end}", file=sys.__stderr__, flush=True)
    assert not failed, f"{len(failed)} of {count} cases failed:\n" + "\n".join(failed[:20])
    return outcomes


@contextmanager
def bounded(what: str):
    """Fail where the block takes longer than `SECONDS` of CPU time, or more than `MEGABYTES`.

    What tests before it in the same process have left in memory is not the block's.
    """
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    begin, memory = time.process_time(), _memory("VmRSS")
    yield
    assert time.process_time() - begin < SECONDS, f"{what}: a hang"
    assert _memory("VmHWM") - memory < MEGABYTES, f"{what}: memory"


def _memory(key):
    """Memory of this process, now (VmRSS) or at most (VmHWM) [MB]."""
    status = Path("/proc/self/status").read_text()
    return float(re.search(rf"^{key}:\s+(\d+) kB", status, re.MULTILINE)[1]) / 1e3


@contextmanager
def stopped(what: str):
    """Ask a command to end that goes on; fail where it was deaf for `SECONDS` of CPU time.

    A model far from all experience may have to be computed with a million steps a second: that
    takes its time, and is no hang for as long as the program can be told to stop.
    """
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    begin, memory = time.process_time(), _memory("VmRSS")
    heard, asked = [begin], []

    def look(*_):
        heard.append(time.process_time())
        if heard[-1] - begin > (SECONDS if MORE else 2.0) and not asked:
            asked.append(True)
            signal.raise_signal(signal.SIGTERM)

    before = signal.signal(signal.SIGPROF, look)
    signal.setitimer(signal.ITIMER_PROF, 0.2, 0.2)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    heard.append(time.process_time())
    longest = max(later - earlier for earlier, later in pairwise(heard))
    assert longest < SECONDS, f"{what}: deaf for {longest:.1f} s"
    assert _memory("VmHWM") - memory < MEGABYTES, f"{what}: memory"


def outcome(arguments, capsys, what, bound=bounded, allowed=(0, 2, 3)):
    """Call a command; return its exit status, which is never that of an unforeseen error."""
    with bound(what):
        status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err, f"{what}: {err}"
    assert "should not happen" not in err, f"{what}: {arguments}\n{err}"
    assert status in allowed, f"{what}: status {status}: {err}"
    assert (status == 2) == bool(err.strip()) or status != 2, f"{what}: no word on stderr"
    return status
