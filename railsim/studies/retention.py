"""Parts of each result that a study keeps: all, selected quantities, or the summary only."""

from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from railsim.errors import InputError, argument_fault, nearest
from railsim.notation import QUANTITIES, REQUESTED
from railsim.result import Result
from railsim.result.hdf5 import PLAIN, Storage, write
from railsim.studies.spec import StudySpec

ALL, SUMMARY = "all", "summary"
ALWAYS = ("time", "distance", "Q0")


@dataclass(frozen=True)
class Retention:
    """Parts of a result that are kept.

    `quantities`: names of quantities, with ``*`` for any characters; None for all; `summary`: keep
    no file at all; `storage`: compression and precision of the file.
    """

    quantities: tuple[str, ...] | None = None
    summary: bool = False
    storage: Storage = PLAIN

    def applied(self, path: Path, result: Result) -> str:
        """Reduce a result file to the parts kept; return its name, empty without a file."""
        if self.summary:
            path.unlink(missing_ok=True)  # kept by an earlier run
            return ""
        if self.quantities is not None or self.storage != PLAIN:
            write(result, path, overwrite=True, names=self._names(result), storage=self.storage)
        return path.name

    def _names(self, result: Result) -> list[str]:
        wanted = None if self.quantities is None else (*self.quantities, *ALWAYS)
        return [
            name
            for name in result
            if wanted is None or any(fnmatchcase(name, pattern) for pattern in wanted)
        ]


EVERYTHING = Retention()


def retention(spec: StudySpec) -> Retention:
    """Return what a study keeps: ``all``, ``summary`` or a list of quantities.

    Raises InputError: an unknown quantity.
    """
    storage = Storage(compress=spec.compress, single=spec.single)
    if spec.keep in (ALL, SUMMARY):
        return Retention(None, spec.keep == SUMMARY, storage)
    names = tuple(name.strip() for name in spec.keep.split(",") if name.strip())
    known = [*QUANTITIES, *REQUESTED]
    wrong = [name for name in names if not any(fnmatchcase(one, name) for one in known)]
    if wrong or not names:
        raise InputError(
            argument_fault("keep", name, "no such quantity", nearest(name, [ALL, SUMMARY, *known]))
            for name in wrong or [spec.keep]
        )
    return Retention(names, False, storage)
