"""Remarks on a run: what a reader of its result must know, one sentence each.

`status` says how a run ended; remarks say what to keep in mind when its numbers are used.  The root
attribute ``remarks`` holds them, one a line; tables, summaries and comparisons repeat them.  A
remark is added here, from what the run has counted, or to `Run.remarks` while it is computed.
"""

from railsim.advance import Run


def run_remarks(run: Run) -> tuple[str, ...]:
    """Return the remarks on a run that has ended, each once."""
    found = [*run.remarks, *creep_range(int(run.events[1]), int(run.events[0]))]
    return tuple(dict.fromkeys(found))


def creep_range(outside: int, patches: int) -> tuple[str, ...]:
    """Remark on contact patches outside the creep law's range of a/b.

    Parameters
    ----------
    outside, patches : int
        Loaded patches outside that range, and all of them, in the time loop.
    """
    if outside == 0:
        return ()
    return (
        f"{outside} of {patches} contact patches in the time loop ({outside / patches:.1e}) were "
        "narrower or wider than the creep law's range of a/b; they got the force of its end.",
    )
