"""What processes ask of libraries: no threads of linear algebra, and freed memory kept.

Matrices here have at most a few hundred rows, for which threads bring no gain; and after each call
they spin for a while on the core that another run could have: 32 runs on two cores took 5 to 12 s
with them, and 3 s without.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress

# read by the libraries when numpy is imported; what a user has set stands
VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h


def use_one_thread() -> None:
    """Let this process, which has not imported numpy yet, and those that it starts use one."""
    for name in VARIABLES:
        os.environ.setdefault(name, "1")


@contextmanager
def restored_environment(*names: str) -> Iterator[None]:
    """Let variables of the environment be after the block what they were before."""
    before = {name: os.environ.get(name) for name in names}
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Let processes that are started within the block use one thread each."""
    with restored_environment(*VARIABLES):
        use_one_thread()
        yield


def keep_freed_memory() -> None:
    """Let this process keep what arrays up to 32 MB leave when they are freed, 64 MB at most.

    The C library gives it back to the system and fetches it again page by page, for arrays of
    0.1 MB already: a tenth of what a short run costs beside its time loop.
    """
    import ctypes  # takes 3 ms, which `railsim --help` need not have

    with suppress(OSError, AttributeError, TypeError):  # other libraries than glibc
        for parameter, value in ((M_MMAP_THRESHOLD, 2**25), (M_TRIM_THRESHOLD, 2**26)):
            ctypes.CDLL(None).mallopt(parameter, value)
