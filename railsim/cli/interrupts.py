"""Ctrl-C and other requests to end: obeyed also where Python loses them.

Python raises the exception of a signal between any two of its instructions.  If these belong to a
callback of the import system or of the compiler, or to a finaliser, the exception is printed and
forgotten ("Exception ignored in ..."); a library that is being loaded may turn it into another one.
So the signal is remembered as well, and looked at where the work goes on, by
`raise_pending_signal`; what Python would print of the lost exception is left out.

And Python raises nothing at all for as long as one call outside it takes: compiling the time loop
is minutes.  So a thread listens too; where the program has not ended `PATIENCE` after a signal, it
ends it, and leaves no hidden file behind.  Further signals change nothing: they would only disturb
the end that has begun.  Streams that are closed or full are made usable here.
"""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from types import FrameType

from railsim.cli.terminal import echo
from railsim.files.access import remove_partial_files

# Ctrl-C, and on POSIX what `kill` sends, and what a terminal that is closed
SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]

PATIENCE = 8.0  # seconds that the program has to end by itself: a study waits for its processes

_heard: list[int] = []


class Interrupted(KeyboardInterrupt):
    """Somebody wants the program to end.

    `status`: exit status: 128 and the number of the signal, as shells have it; 130 for Ctrl-C.
    """

    def __init__(self, number: int = signal.SIGINT) -> None:
        name = signal.Signals(number).name
        super().__init__("interrupted" if name == "SIGINT" else f"ended by {name}")
        self.status = 128 + number


@contextmanager
def remembered_interrupts(*, last: bool = False) -> Iterator[None]:
    """Remember what is heard within the block; signals that the caller ignores stay ignored.

    `last`: The process ends after the block. Once a signal is heard the thread listens until then:
    the end waits for other threads and processes.
    """
    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                before[number] = signal.signal(number, _hear)
    _heard.clear()
    previous = sys.unraisablehook

    def tell(lost: "sys.UnraisableHookArgs") -> None:
        if not isinstance(lost.exc_value, Interrupted):
            previous(lost)

    sys.unraisablehook = tell
    end_listening = _listening(set(before)) if before else None
    try:
        yield
    finally:
        if not (last and _heard):
            if end_listening is not None:
                end_listening()
            sys.unraisablehook = previous
            for number, handler in before.items():
                signal.signal(number, handler)
            _heard.clear()


def _listening(numbers: set[int]) -> Callable[[], None]:
    """Let a thread end the program where a signal of these is not obeyed; return how that ends."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    ended = threading.Event()
    listener = threading.Thread(target=_listen, args=(reader, numbers, ended), daemon=True)
    listener.start()
    before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)

    def end() -> None:
        signal.set_wakeup_fd(before)
        ended.set()
        os.close(writer)  # the listener reads an end
        listener.join()
        os.close(reader)

    return end


def _listen(reader: int, numbers: set[int], end: threading.Event) -> None:
    while heard := os.read(reader, 1):
        if heard[0] in numbers:
            if not end.wait(PATIENCE):
                _end_now(heard[0])
            return


def _end_now(number: int) -> None:
    request = Interrupted(number)
    with suppress(Exception):  # whatever holds the main thread may hold the stream as well
        remove_partial_files()
        echo(f"railsim: {request}", err=True)
    os._exit(request.status)


def _hear(number: int, _: FrameType | None) -> None:
    if hasattr(signal, "pthread_sigmask") and number in signal.pthread_sigmask(
        signal.SIG_BLOCK, ()
    ):
        # this thread lets it wait, and another one has taken it
        signal.pthread_kill(threading.get_ident(), number)
        return
    _heard.append(number)
    if len(_heard) == 1:
        raise Interrupted(number)


def raise_pending_signal() -> None:
    """Raise what was heard and lost.

    Raises Interrupted: a signal came since `remembered_interrupts` began.
    """
    if _heard:
        raise Interrupted(_heard[0])


def usable_streams() -> None:
    """Make sure that every text can be printed, or is dropped where the stream is closed.

    A character that the locale lacks is written as its code.
    """
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by the caller: `>&-`
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, TextIOWrapper):
            with suppress(OSError, ValueError):
                stream.reconfigure(errors="backslashreplace")


def silence() -> None:
    """Let what stdout still holds go nowhere: its reader has gone, or its disk is full."""
    with suppress(OSError, ValueError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())
        os.close(null)
