"""Progress on stderr: a bar on a terminal, and a word when the first run takes its time.

What comes before a run, and may take as long, stands in the words of the bar.

Whoever tells its progress also hears of an interrupt that was lost, see `railsim.cli.interrupts`.
"""

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer
from typing import Any

from railsim.cli.common import echo
from railsim.cli.interrupts import obey

PATIENCE = 5.0  # seconds without progress before the reason is printed
FIRST_RUN = (
    "preparing: the first run after an installation compiles the time loop and builds the contact "
    "tables of its profiles (one to five minutes; kept for later runs)"
)


@contextmanager
def progress_bar(words: str, *, quiet: bool) -> Iterator[Callable[[float], None]]:
    """Give a function that takes the finished fraction and shows it.

    Parameters
    ----------
    words : str
        What is going on.
    quiet : bool
        Show nothing at all.  Without a terminal there is no bar either.
    """
    obey()
    if quiet:
        yield lambda _: obey()
        return
    from tqdm import tqdm

    notice = Timer(PATIENCE, echo, (FIRST_RUN,), {"err": True})
    notice.daemon = True
    notice.start()
    bar = tqdm(
        total=1.0,
        desc=words,
        file=sys.stderr,
        disable=not sys.stderr.isatty(),
        leave=False,
        delay=0.3,
        bar_format="{desc}: {percentage:3.0f} % |{bar}| {elapsed}, {remaining} to go",
    )

    doing = logging.getLogger("railsim.doing")
    before, handler = doing.level, _Words(bar, words)

    def show(fraction: float) -> None:
        obey()
        if fraction > 0.0:
            notice.cancel()
        bar.update(fraction - bar.n)

    doing.setLevel(logging.INFO)
    doing.addHandler(handler)
    try:
        yield show
    finally:
        doing.removeHandler(handler)
        doing.setLevel(before)
        notice.cancel()
        bar.close()


class _Words(logging.Handler):
    """Adds to the words of a bar what the program logs that it is doing."""

    def __init__(self, bar: Any, words: str) -> None:
        super().__init__()
        self._bar, self._words = bar, words

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record; an empty one stands for what the bar is about."""
        parts = [part for part in (self._words, record.getMessage()) if part]
        self._bar.set_description_str(", ".join(parts), refresh=False)
