"""Standard output and error, whatever the caller has made of them."""

import os
import sys
from contextlib import suppress
from io import TextIOWrapper
from typing import TextIO


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


def silence(stream: TextIO) -> None:
    """Let what a stream still holds go nowhere: its reader has gone, or its disk is full."""
    with suppress(OSError, ValueError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)
