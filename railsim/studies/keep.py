"""What a study keeps of each result: all of it, chosen quantities, or the summary only."""

from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from railsim.errors import Fault, InputError, nearest
from railsim.notation import QUANTITIES, REQUESTED
from railsim.result import Result
from railsim.result.hdf5 import PLAIN, Storage, write

ALL, SUMMARY = "all", "summary"
ALWAYS = ("time", "distance", "Q0")


@dataclass(frozen=True)
class Keep:
    """What is kept of a result.

    Attributes
    ----------
    quantities : tuple of str or None
        Names of quantities, ``*`` standing for any letters; None for all.
    summary : bool
        Keep no file at all.
    storage : Storage
        Compression and precision of the file.
    """

    quantities: tuple[str, ...] | None = None
    summary: bool = False
    storage: Storage = PLAIN

    def applied(self, path: Path, result: Result) -> str:
        """Make the result's file what is kept of it; return its name, empty where there is none."""
        if self.summary:
            path.unlink(missing_ok=True)  # a run before kept it
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


EVERYTHING = Keep()


def parse_keep(given: str, *, compress: bool = False, single: bool = False) -> Keep:
    """Return what ``all``, ``summary`` or a list of quantities asks for.

    Raises
    ------
    InputError : a quantity that there is not.

    Examples
    --------
    >>> parse_keep("Q,wheelset_*").quantities
    ('Q', 'wheelset_*')
    """
    storage = Storage(compress=compress, single=single)
    if given in (ALL, SUMMARY):
        return Keep(None, given == SUMMARY, storage)
    names = tuple(name.strip() for name in given.split(",") if name.strip())
    known = [*QUANTITIES, *REQUESTED]
    wrong = [name for name in names if not any(fnmatchcase(one, name) for one in known)]
    if wrong or not names:
        raise InputError(
            Fault("--keep", name, "no such quantity", nearest(name, [ALL, SUMMARY, *known]))
            for name in wrong or [given]
        )
    return Keep(names, False, storage)
