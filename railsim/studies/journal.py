"""The journal of a study: one line for every finished run, appended when the run ends.

Lines are never rewritten, so that the cost per run does not grow with the number of runs, and a
process that is killed loses at most the line that it was writing.
Each line holds the CRC-32 of the rest, a *head* with the data needed to continue the study, and a
*body*, the whole record; both are JSON, separated by tabs.  A damaged line is ignored, and its run
is examined again.  The first line of a session holds the inputs of the study.  A running study
holds a lock on the file.

Opening 100 000 runs reads the heads only; a record is read on access.
"""

import os
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, suppress
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, overload

from railsim.errors import argument_error, input_error
from railsim.files.access import locked
from railsim.studies.records import Record, json_bytes, parse_json

JOURNAL = "study.journal"
FORMAT = "railsim-study-journal/1"
LONGEST_LINE = 100_000_000  # bytes; the inputs of 200 000 runs take some 5 MB for each key

RECORD = {"name", "file", "labels", "status"}  # keys of every record
NOT_DONE = ("failed", "waiting")  # status of runs that are computed again


class Entry(NamedTuple):
    """Data of a run that are available without reading its record."""

    name: str  # of the run
    status: str  # as in its result, or ``failed``
    key: str  # hash of the inputs of the run, see `railsim.studies.plan`
    size: int  # of its result file [bytes]; 0 without a file
    changed: int  # time of its last change [ns]
    offset: int  # of its record in the journal [bytes]
    length: int  # of its record [bytes]

    @property
    def is_done(self) -> bool:
        """Whether the run has a result, even if it ended early."""
        return self.status not in NOT_DONE

    def is_of(self, file: os.stat_result | None) -> bool:
        """Whether a file is unchanged since the run ended."""
        return size_and_time(file) == (self.size, self.changed)


def size_and_time(file: os.stat_result | None) -> tuple[int, int]:
    """Return size [bytes] and time of the last change [ns] of a file; 0 without one."""
    return (0, 0) if file is None else (file.st_size, file.st_mtime_ns)


class Journal(AbstractContextManager["Journal"]):
    """The journal of a folder, open for reading and appending; locked for other processes.

    `folder`: folder of the study; it must exist; `entries`: the last entry of every run, by its
    name; `inputs`: inputs of the study at its last start; None in a new journal; `damaged`: number
    of lines that could not be read. Raises InputError: another study is writing into the folder.
    OSError: the journal cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / JOURNAL
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND
        for name in ("O_NOFOLLOW", "O_BINARY"):  # not everywhere
            flags |= getattr(os, name, 0)
        self._handle = os.open(self.path, flags, 0o666)
        with suppress(OSError):  # a file system without locks
            if not locked(self._handle):
                self.close()
                found = f"another study is writing into {folder}"
                raise argument_error("out", found, "wait for it, or choose another folder")
        self.entries: dict[str, Entry] = {}
        self.inputs: Mapping[str, Any] | None = None
        self.damaged = 0
        self._end = 0
        self._read()

    def _read(self) -> None:
        last = b"\n"
        with open(self.path, "rb", buffering=1 << 20) as file:
            # a longer line comes in parts, each of which is damaged
            for line in iter(lambda: file.readline(LONGEST_LINE), b""):
                self._take(line, self._end)
                self._end += len(line)
                last = line
        if not last.endswith(b"\n"):
            self._append(b"\n")  # the line that a killed process was writing ends here

    def _take(self, line: bytes, offset: int) -> None:
        if line == b"\n":
            return
        try:
            crc = zlib.crc32(memoryview(line)[9:-1])
            if line[:9] != b"%08x\t" % crc or not line.endswith(b"\n"):
                raise ValueError
            end = line.index(b"\t", 9)
            facts = parse_json(line[9:end])
            if "format" in facts:
                self.inputs = parse_json(line[end + 1 :]) if facts["format"] == FORMAT else None
                return
            entry = Entry(**facts, offset=offset + end + 1, length=len(line) - end - 2)
            self.entries[entry.name] = entry
        except (ValueError, TypeError, KeyError):
            self.damaged += 1

    def clear(self) -> None:
        """Delete all entries."""
        os.ftruncate(self._handle, 0)
        self.entries.clear()
        self.inputs, self._end = None, 0

    def begin(self, inputs: Mapping[str, Any]) -> None:
        """Write the inputs of the study if they differ from those of its last start."""
        if self.inputs != inputs:
            self._line({"format": FORMAT}, json_bytes(inputs))
            self.inputs = inputs

    def add(self, record: Record, key: str, file: os.stat_result | None) -> None:
        """Append the record of a run; it is on disk when the function returns."""
        size, changed = size_and_time(file)
        facts: dict[str, Any] = {"name": record["name"], "status": record["status"], "key": key}
        facts |= {"size": size, "changed": changed}
        body = json_bytes(record)
        entry = Entry(**facts, offset=self._line(facts, body), length=len(body))
        self.entries[entry.name] = entry

    def _line(self, head: Mapping[str, Any], body: bytes) -> int:
        text = json_bytes(head) + b"\t" + body
        offset = self._end + 9 + len(text) - len(body)
        self._append(b"%08x\t%s\n" % (zlib.crc32(text), text))
        os.fsync(self._handle)
        return offset

    def _append(self, data: bytes) -> None:
        """Append the whole line or nothing: half a line would corrupt the next one."""
        try:
            written = os.write(self._handle, data)
            while written < len(data):
                written += os.write(self._handle, data[written:])
        except OSError:
            os.ftruncate(self._handle, self._end)
            raise
        self._end += len(data)

    def close(self) -> None:
        """Close the file and release the lock; may be called repeatedly."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1

    def __exit__(self, *_: object) -> None:
        self.close()


class Records(Sequence[Record]):
    """Records of runs from a journal, each read on access; of a run not done the record itself."""

    def __init__(self, path: Path, entries: Sequence[Entry | Record]) -> None:
        self._path = path
        self._entries = tuple(entries)

    def __len__(self) -> int:
        return len(self._entries)

    @overload
    def __getitem__(self, index: int) -> Record: ...
    @overload
    def __getitem__(self, index: slice) -> list[Record]: ...
    def __getitem__(self, index: int | slice) -> Record | list[Record]:
        if isinstance(index, slice):
            return [record for record, _ in self._read(self._entries[index])]
        return next(self._read([self._entries[index]]))[0]

    def __iter__(self) -> Iterator[Record]:
        return (record for record, _ in self._read(self._entries))

    def of_status(self, accepts: Callable[[str], bool]) -> tuple[Record, ...]:
        """Return the records of runs of a chosen status."""
        each = ((e.status if isinstance(e, Entry) else e["status"], e) for e in self._entries)
        found = [entry for status, entry in each if accepts(status)]
        return tuple(record for record, _ in self._read(found))

    def with_texts(self) -> Iterator[tuple[Record, bytes]]:
        """Yield every record and its JSON."""
        return self._read(self._entries)

    def _read(self, entries: Sequence[Entry | Record]) -> Iterator[tuple[Record, bytes]]:
        with ExitStack() as stack:
            file: BinaryIO | None = None
            for entry in entries:
                if isinstance(entry, Entry):
                    file = file or stack.enter_context(open(self._path, "rb"))
                    file.seek(entry.offset)
                    text = file.read(entry.length)
                    yield self._record(entry, text), text
                else:
                    yield dict(entry), json_bytes(entry)

    def _record(self, entry: Entry, text: bytes) -> Record:
        try:
            record: Record = parse_json(text)
            if not record.keys() >= RECORD or not isinstance(record["labels"], dict):
                raise ValueError("it lacks " + ", ".join(sorted(RECORD - record.keys())))
        except (ValueError, AttributeError) as error:
            found = f"a record that cannot be used ({error})"
            allowed = "remove the journal: existing results are kept"
            raise input_error(self._path, found, allowed, key=entry.name) from None
        return record
