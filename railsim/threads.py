"""Threads of the linear algebra library: none, where several runs share the cores.

Matrices here have at most a few hundred rows, for which threads bring no gain; and after each call
they spin for a while on the core that another run could have: 32 runs on two cores took 5 to 12 s
with them, and 3 s without.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager

# read by the libraries when numpy is imported; what a user has set stands
VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def use_one_thread() -> None:
    """Let this process, which has not imported numpy yet, and those that it starts use one."""
    for name in VARIABLES:
        os.environ.setdefault(name, "1")


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Let processes that are started within the block use one thread each."""
    unset = [name for name in VARIABLES if name not in os.environ]
    use_one_thread()
    try:
        yield
    finally:
        for name in unset:
            del os.environ[name]
