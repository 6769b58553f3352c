"""Progress on stderr: a bar on a terminal, and a word when the first run takes its time.

Whoever tells its progress also hears of an interrupt that was lost, see `railsim.cli.interrupts`.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer

from railsim.cli.common import echo
from railsim.cli.interrupts import obey

PATIENCE = 5.0  # seconds without progress before the user is told why
FIRST_RUN = (
    "preparing: the first run after an installation compiles the time loop and builds the contact "
    "tables of its profiles (up to a minute; kept for later runs)"
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

    def show(fraction: float) -> None:
        obey()
        if fraction > 0.0:
            notice.cancel()
        bar.update(fraction - bar.n)

    try:
        yield show
    finally:
        notice.cancel()
        bar.close()
