"""Progress on stderr: a bar on a terminal, and what is being prepared where that takes its time.

What comes before a run, and may take as long, stands in the words of the bar.

Whoever tells its progress also hears of an interrupt that was lost, see `railsim.cli.interrupts`.
"""

import logging
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from threading import Event, Thread, main_thread
from typing import Any

from railsim.cli.interrupts import raise_pending_signal
from railsim.cli.terminal import echo
from railsim.text import merge_remarks

PATIENCE = 2.0  # seconds between looks at what the program is doing
BETWEEN = 60.0  # seconds between lines in a log
COMPILING = "preparing: compiling (after an installation; about a minute, kept for later)"
UNCACHED = "not kept: there is no folder for it, give one by RAILSIM_CACHE_DIR"
CAUSES = {
    "numba.core.compiler_machinery": COMPILING,  # runs the passes; loading is elsewhere
    "railsim.simulation.first_start": COMPILING,  # in another process
    "railsim.kernels.lock": "preparing: waiting for what another process compiles or builds",
    "railsim.contact.table": "preparing: the contact table of new profiles (kept for later)",
}
"""What takes long before a run, by the module that is at work."""

_reported: set[str] = set()


def _cause() -> str:
    """What the main thread, or a worker that others wait for, prepares; nothing if it does not."""
    frame = sys._current_frames().get(main_thread().ident or 0)
    while frame is not None:
        module = frame.f_globals.get("__name__", "")
        if module in CAUSES:
            return CAUSES[module]
        frame = frame.f_back
    execute = sys.modules.get("railsim.studies.execute")
    return COMPILING if execute is not None and not execute.is_compiled() else ""


def _report_causes(end: Event) -> None:
    """Report every cause once in a process, until the work has ended."""
    while not end.wait(PATIENCE):
        words = _cause()
        if words and words not in _reported:
            _reported.add(words)
            notices = getattr(sys.modules.get("railsim.kernels.cache"), "notices", ())
            if any("is not used" in notice for notice in notices):
                words = words.replace("kept for later", UNCACHED)
            echo(words, err=True)


@contextmanager
def progress_bar(words: str, *, quiet: bool) -> Iterator[Callable[[float], None]]:
    """Give a function that takes the finished fraction and shows it.

    `words`: what is going on; `quiet`: show nothing at all. Without a terminal, as in a log, lines
    instead of a bar: for every twentieth, and one a minute at most.
    """
    raise_pending_signal()
    if quiet:
        yield lambda _: raise_pending_signal()
        return
    from tqdm import tqdm

    ended = Event()
    Thread(target=_report_causes, args=(ended,), daemon=True).start()
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

    last = time.monotonic(), 0.0  # when a line was printed, and of how much

    def show(fraction: float) -> None:
        nonlocal last
        raise_pending_signal()
        bar.update(fraction - bar.n)
        if bar.disable and fraction >= last[1] + 0.05 and time.monotonic() >= last[0] + BETWEEN:
            last = time.monotonic(), fraction
            echo(f"{getattr(bar, 'desc', words)}: {100.0 * fraction:.0f} %", err=True)

    doing.setLevel(logging.INFO)
    doing.addHandler(handler)
    try:
        yield show
    finally:
        doing.removeHandler(handler)
        doing.setLevel(before)
        ended.set()
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


class RunLines:
    """Lines about the runs of a study as they end: one each, later one for every ten.

    Runs that do not reach their end always have a line.  Remarks are counted, and stand once at the
    end.
    """

    EACH = 20  # runs with a line of their own
    SHOWN = (("dQ_over_Q0", "dQ/Q0"), ("Y_over_Q", "Y/Q"), ("sum_Y", "sum Y"))

    def __init__(self) -> None:
        self._number = 0
        self._last: list[Mapping[str, Any]] = []  # without a line yet
        self._remarks: list[tuple[str, str]] = []

    def __call__(self, record: Mapping[str, Any]) -> None:
        """Take the record of a run that has ended."""
        self._number += 1
        name, status = record["name"], record["status"]
        self._remarks += [(name, str(remark)) for remark in record.get("remarks", ())]
        why = "" if status == "complete" else f" ({record['status_reason']})"
        if why or self._number <= self.EACH:
            _print(f"{name}  {status}{why}", *self._values([record]))
        if self._number > self.EACH:
            self._last.append(record)
        if len(self._last) == 10:
            self._print_last()

    def end(self, *, remarks: bool = True) -> None:
        """Print what is left: the last runs, and the remarks with the number of runs."""
        self._print_last()
        for text in merge_remarks(self._remarks) if remarks else ():
            echo(f"remark: {text}")

    def _print_last(self) -> None:
        if not self._last:
            return
        first = self._number - len(self._last) + 1
        complete = sum(record["status"] == "complete" for record in self._last)
        values = self._values(self._last)
        largest = "largest " if values else ""
        values[:1] = [largest + value for value in values[:1]]
        _print(f"runs {first} to {self._number}  {complete} complete", *values)
        self._last = []

    def _values(self, records: Sequence[Mapping[str, Any]]) -> list[str]:
        """Largest peaks of some runs, by magnitude; of dQ/Q0 the largest load."""
        from railsim.notation import QUANTITIES

        texts = []
        peaks = [peak for record in records for peak in record.get("peaks", ())]
        for name, words in self.SHOWN:
            hits = (peak for peak in peaks if peak["quantity"] == name and peak["kind"] != "min")
            if found := [peak["value"] for peak in hits]:
                quantity = QUANTITIES[name]
                unit = "" if quantity.shown_unit == "-" else f" {quantity.shown_unit}"
                texts.append(f"{words} {quantity.text(max(found, key=abs))}{unit}")
        return texts


def _print(*parts: str) -> None:
    from tqdm import tqdm

    with tqdm.external_write_mode():
        echo("  ".join(parts))
