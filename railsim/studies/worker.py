"""Imported by the server of `railsim.processes`: all that a worker needs, with compiled code.

The code is loaded at the first call of each kernel, by a run of two steps.
"""

import sys
from types import TracebackType

from railsim.simulation.first_start import is_compiled
from railsim.studies.execute import run_briefly
from railsim.threads import keep_freed_memory

# what a worker meets whose study has ended while it began: no semaphores, no inputs
STUDY_HAS_ENDED = (FileNotFoundError, EOFError, ConnectionError)


def report_unless_ended(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Print why a worker could not begin, as Python does; nothing where its study has ended."""
    if not isinstance(error, STUDY_HAS_ENDED):
        sys.__excepthook__(kind, error, trace)


sys.excepthook = report_unless_ended  # inherited by the copies of the server
keep_freed_memory()  # likewise
if is_compiled():  # otherwise the first worker compiles
    run_briefly()
