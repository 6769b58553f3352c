"""Ctrl-C and other requests to end: obeyed also where Python loses them.

Python raises the exception of a signal between any two of its instructions.  If these belong to a
callback of the import system or of the compiler, or to a finaliser, the exception is printed and
forgotten ("Exception ignored in ..."); a library that is being loaded may turn it into another one.
So the signal is remembered as well, and looked at where the work goes on: see `obey`.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

# Ctrl-C, and on POSIX what `kill` sends, and what a terminal that is closed
SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]

_heard: list[int] = []


class Interrupted(KeyboardInterrupt):
    """Somebody wants the program to end.

    Attributes
    ----------
    status : int
        Exit status: 128 and the number of the signal, as shells have it; 130 for Ctrl-C.
    """

    def __init__(self, number: int = signal.SIGINT) -> None:
        name = signal.Signals(number).name
        super().__init__("interrupted" if name == "SIGINT" else f"ended by {name}")
        self.status = 128 + number


@contextmanager
def remembered_interrupts() -> Iterator[None]:
    """Remember what is heard within the block; signals that the caller ignores stay ignored."""
    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                before[number] = signal.signal(number, _hear)
    _heard.clear()
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _hear(number: int, _: FrameType | None) -> None:
    _heard.append(number)
    raise Interrupted(number)


def obey() -> None:
    """Raise what was heard and lost.

    Raises
    ------
    Interrupted : a signal came since `remembered_interrupts` began.
    """
    if _heard:
        raise Interrupted(_heard[0])
