"""How a command answers: on the terminal, as JSON, in files."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railsim.cli.common import (
    F,
    collected,
    echo,
    json_option,
    option,
    overwrite_option,
    plain,
    print_json,
    quiet_option,
    show,
)
from railsim.files.access import check_file, check_folder, make_folder, whole_file, write_folder

if TYPE_CHECKING:
    from railsim.table import Table


@dataclass
class Output:
    """Values of ``--out``, ``--overwrite``, ``--json``, ``--quiet``.

    `written`: files written so far.
    """

    out: str | None = None
    overwrite: bool = False
    as_json: bool = False
    quiet: bool = False
    written: list[Path] = field(default_factory=list, init=False)

    @property
    def folder(self) -> Path | None:
        """The folder of ``--out``."""
        return Path(self.out) if self.out else None

    def reserve(self, *names: str) -> Path | None:
        """Refuse the folder before anything is computed, if these files cannot be written."""
        if self.folder is not None:
            check_folder(self.folder, names, overwrite=self.overwrite)
        return self.folder

    def file(self, default: str | Path, endings: Sequence[str] = (), suffix: str = "") -> Path:
        """Return the file of ``--out``, by default another with this suffix; refuse it early."""
        path = Path(self.out or default)
        if not self.out and path.name and suffix:
            path = path.with_suffix(suffix)
        check_file(path, overwrite=self.overwrite, endings=endings)
        return path

    def write(self, name: str, content: Any) -> None:
        """Write a file into the folder, if there is one.

        `name`: its name; `content`: bytes, a text, a `Table` (as CSV), a figure, or plain data (as
        JSON); a function that returns one of them is called only where something is written.
        """
        if self.folder is None:
            return
        make_folder(self.folder)
        path = self.folder / name
        content = content() if callable(content) else content
        if hasattr(content, "savefig"):
            from railsim.plot.style import save

            save(content, path, overwrite=True)
        else:
            with whole_file(path) as partial:
                partial.write_bytes(_bytes(content))
        self.written.append(path)

    def write_all(self, content: Mapping[str, Any]) -> None:
        """Write files into the folder, all of them or none; contents as of `write`."""
        if self.folder is not None:
            data = {name: _bytes(one) for name, one in content.items()}
            self.written += write_folder(self.folder, data, overwrite=self.overwrite)

    def answer(
        self, record: Any, parts: "Iterable[str | Table]" = (), remarks: Iterable[object] = ()
    ) -> None:
        """Print the record as JSON; or texts and tables, remarks, and what was written."""
        if self.as_json:
            print_json(record)
            return
        show(*parts, *(() if self.quiet else (f"remark: {remark}" for remark in remarks)))
        self.tell()

    def finish(
        self,
        names: Sequence[str],
        found: Any,
        parts: "Iterable[str | Table]",
        remarks: Iterable[object] = (),
    ) -> None:
        """Write the record and the plot of a result under two names, and answer with them."""
        record = found.record()
        self.write(names[0], record)
        self.write(names[1], found.plot)
        self.answer(record, parts, remarks)

    def remark(self, text: object) -> None:
        """Print a remark on stderr, as during a computation."""
        echo(f"remark: {text}", err=True)

    def tell(self) -> None:
        """Print the paths of what was written."""
        for path in self.written:
            echo(path)

    def wrote(self, path: str | Path, **facts: Any) -> None:
        """Answer with the only file that a command has written; ``--quiet`` not at all."""
        if self.as_json or not self.quiet:
            self.written.append(Path(path))
            self.answer({"file": str(path), **facts})


def _bytes(content: Any) -> bytes:
    from railsim.table import Table

    if isinstance(content, bytes):
        return content
    if isinstance(content, Table):
        content = content.csv()
    elif not isinstance(content, str):
        content = json.dumps(plain(content), indent=1, allow_nan=False) + "\n"
    return str(content).encode()


def output_options(out: str = "") -> Callable[[F], F]:
    """Add ``--overwrite``, ``--json``, ``--quiet``, and ``--out DIR`` where `out` says for what.

    The command takes them as `output`.
    """
    folder = [option("--out", out, "DIR")] if out else []
    return collected("output", Output, *folder, overwrite_option, json_option, quiet_option)


answer_options = collected("output", Output, json_option, quiet_option)
"""Adds ``--json`` and ``--quiet``; the command takes them as `output`."""
