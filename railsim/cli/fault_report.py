"""The net under the command line: an unforeseen error becomes one line and a report.

The report is a text file in the system's folder for temporary files, which only its user can read:
what was called, where, with which files, which versions, and the traceback.  It is what the
developers need.
"""

import hashlib
import os
import platform
import sys
import tempfile
import traceback
from collections.abc import Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from railsim.version import __version__

PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "h5py", "matplotlib", "pydantic", "click")
WHOLE_TEXT = 100_000  # text files up to this size are copied into the report [bytes]


def write_report(error: Exception, arguments: Sequence[str]) -> str:
    """Write the report of an error; return one line for the user, with its path."""
    summary = f"unexpected {type(error).__name__}: {' '.join(str(error).split())[:200]}"
    try:
        text = "\n".join(_lines(error, arguments))
    except Exception as another:  # the net must hold, whatever else is broken
        text = f"{summary}\n{traceback.format_exc()}\n(and {another!r} while this was written)"
    for folder in (None, "."):  # where there is no temporary folder, beside the user
        try:
            handle, path = tempfile.mkstemp(prefix="railsim-report-", suffix=".txt", dir=folder)
            with open(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
                file.write(text)
        except OSError:
            continue
        return f"{summary}; this should not happen, please send us {path}"
    return f"{summary}; this should not happen, and no report could be written"


def _lines(error: Exception, arguments: Sequence[str]) -> Iterator[str]:
    yield f"railsim {__version__}, Python {platform.python_version()}, {platform.platform()}"
    yield ", ".join(f"{name} {_version(name)}" for name in PACKAGES)
    yield f"arguments: {list(arguments)!r}"
    yield f"folder: {os.getcwd() if os.path.isdir('.') else 'gone'}"
    yield f"locale: {sys.getfilesystemencoding()}, {os.environ.get('LANG', '')}"
    yield ""
    yield from traceback.format_exception(error)
    for argument in arguments:
        yield from _file(argument)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"


def _file(argument: str) -> Iterator[str]:
    """Describe an argument that is a file; short texts are there in full."""
    path = Path(argument)
    try:
        if not path.is_file():
            return
        size = path.stat().st_size
        if size > WHOLE_TEXT or path.suffix not in (".toml", ".csv", ".json", ".txt"):
            yield f"\n== {argument}: {size} bytes"
            return
        content = path.read_bytes()
    except (OSError, ValueError):
        return
    yield f"\n== {argument}: {size} bytes, SHA-256 {hashlib.sha256(content).hexdigest()}"
    yield content.decode("utf-8", errors="replace")
