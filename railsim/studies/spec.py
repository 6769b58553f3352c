"""What a run or a study is asked to compute, and how: the same objects for all who ask.

The command line, Python's keyword arguments and study files make them; the journal and
``study.json`` hold a `StudySpec`, and a study is continued from it.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from numbers import Integral
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainSerializer, ValidationError

from railsim.definitions.base import Name
from railsim.definitions.study.analyses import Analysis
from railsim.definitions.study.definition import Sample, Study, value_texts
from railsim.errors import Fault, InputError, argument_error, argument_fault, input_error, nearest
from railsim.notation import QUANTITIES, REQUESTED
from railsim.studies.rows import PERMITTED, speed_of
from railsim.units import ALLOWED
from railsim.version import __version__

M = TypeVar("M", bound=BaseModel)
Progress = Callable[[float], None]
MOST_FAULTS = 20
MOST_RUNS = 200_000


@dataclass(frozen=True)
class RunSpec:
    """One run."""

    vehicle: str | Path  # file, or name of a shipped one
    track: str | Path  # likewise
    speed: float | None  # [m/s]; not needed where the settings have a speed table
    settings: str | Path | None = None  # file
    start: float = 0.0  # distance of the reference body at the start [m]
    duration: float | None = None  # until its end [s]
    until: float | None = None  # distance of its end [m]
    # ``key.path=value`` with ``vehicle.``, ``track.`` or ``settings.`` first
    assignments: tuple[str, ...] = ()


def _as_list(values: Any) -> list[Any]:
    several = isinstance(values, Iterable) and not isinstance(values, str)
    return list(values) if several else [values]


FileNames = Annotated[list[str], BeforeValidator(lambda values: [*map(str, _as_list(values))])]


def _texts(key: str, values: Any) -> list[str]:
    """Return one or several values of a key, or ranges, as they are written in assignments."""
    found: list[str] = []
    for value in _as_list(values):
        plain = value.item() if hasattr(value, "item") else value  # numpy's numbers
        try:
            found += value_texts(plain if isinstance(plain, str) else (plain,))
        except ValueError as error:
            raise input_error(key, str(error), f"allowed: {ALLOWED}") from None
    return found


def _speeds(speeds: Any) -> list[float | str | None]:
    """Return speeds, ranges and speeds with units as numbers [m/s]; `PERMITTED` unchanged."""
    found: list[float | str | None] = []
    for speed in [None] if speeds is None else _as_list(speeds):
        if isinstance(speed, str) and speed != PERMITTED:
            found += [speed_of(text) for text in _texts("speeds", speed)]
        else:
            found.append(speed)
    return found


def _table(table: Any, option: str = "grid") -> Any:
    """Return the values of keys as texts; what is no table is left to be refused."""
    if not isinstance(table, Mapping):
        return table
    return {key: _texts(f"{option} {key}", values) for key, values in table.items()}


def _linked_texts(table: Any) -> Any:
    """Return the values of linked keys as texts; raises InputError: not equally many of each."""
    texts = _table(table, "linked")
    if isinstance(texts, Mapping) and len(set(map(len, texts.values()))) > 1:
        found = ", ".join(f"'{key}' {len(values)}" for key, values in texts.items())
        raise argument_error("linked", found, "equally many values of each key")
    return texts


def _plain_data(value: Any) -> Any:
    """Return definitions as plain data without what is not given."""
    if isinstance(value, Mapping):
        return {name: _plain_data(definition) for name, definition in value.items()}
    return value if value is None else value.model_dump(mode="json", exclude_none=True)


class StudySpec(BaseModel):
    """A study: everything that its numbers and its files depend on; see `railsim.study`.

    Single values, ranges and numbers are taken too, and held as lists of texts.
    """

    model_config = ConfigDict(extra="ignore", frozen=True, defer_build=True)

    railsim_version: str = __version__
    name: str | None = None  # in a study file or scenario; no number depends on it
    purpose: str | None = None  # likewise
    folder: str = "."  # that relative file names refer to, from the folder of the study
    scenario: str | None = None  # of a campaign, which has tracks and speeds of its own
    vehicles: FileNames
    tracks: FileNames
    speeds: Annotated[list[float | str | None], BeforeValidator(_speeds)]
    grid: Annotated[dict[str, list[str]], BeforeValidator(_table)] = {}
    linked: list[Annotated[dict[str, list[str]], BeforeValidator(_linked_texts)]] = []
    sample: Annotated[Sample | None, PlainSerializer(_plain_data)] = None
    quantities: str | None = None  # ``FILE.py:FUNCTION``, see `railsim.studies.user_function`
    analyses: Annotated[dict[Name, Analysis], PlainSerializer(_plain_data)] = {}
    keep: str = "all"  # of each result, see `kept_quantities`
    compress: bool = False
    single: bool = False
    settings: Annotated[str | None, BeforeValidator(lambda v: v if v is None else str(v))] = None
    start: float = 0.0
    duration: float | None = None
    until: float | None = None
    assignments: list[str] = []

    @classmethod
    def of_file(cls, study: Study, **changes: Any) -> "StudySpec":
        """Return the study of a study file, with changes."""
        names = cls.model_fields.keys() & type(study).model_fields.keys()
        return validated(cls, {name: getattr(study, name) for name in names} | changes, "study")

    def changed(self, **changes: Any) -> "StudySpec":
        """Return a study with other inputs."""
        return self.model_copy(update=changes)

    @property
    def varied_keys(self) -> set[str]:
        """Keys of grid and linked tables."""
        return {*self.grid, *(key for table in self.linked for key in table)}

    @property
    def overruled(self) -> list[str]:
        """Assignments whose keys vary, so that no run has their values."""
        varied = self.varied_keys.union(self.sample.parameters if self.sample else ())
        return [one for one in self.assignments if one.partition("=")[0].strip() in varied]

    def as_data(self) -> dict[str, Any]:
        """Return the study as plain data."""
        return self.model_dump(mode="json")


@dataclass(frozen=True)
class Execution:
    """How the runs of a study are carried out, see `railsim.study`; no number depends on it."""

    workers: int | None = None
    scheduler: str | None = None
    resume: bool = False
    overwrite: bool = False
    plots: bool = False
    longest_first: bool = False  # to balance the load of the cores
    further_files: tuple[str, ...] = ()  # beside those of runs: files of others are refused
    trying: bool = False  # a run that cannot be computed is an outcome like others
    progress: Progress | None = None
    on_record: Callable[[dict[str, Any]], None] | None = None
    on_remark: Callable[[str], None] | None = None

    def __post_init__(self) -> None:
        """Raise InputError: a number of processes that is none."""
        number = self.workers
        if not (number is None or (isinstance(number, Integral) and number > 0)):
            raise argument_error("workers", f"found {number!r}", "a whole number above 0")
        if self.workers is not None and self.scheduler is not None:
            allowed = "not with it: the runs are on its own workers"
            raise argument_error("workers", f"{self.workers} beside `scheduler`", allowed)


def kept_quantities(keep: str) -> tuple[str, ...]:
    """Return the quantities of each result that a study keeps, with ``*`` for any characters.

    `keep`: ``all``; ``summary``, which keeps no file: none; or quantities separated by commas.
    Raises InputError: an unknown quantity.
    """
    if keep in ("all", "summary"):
        return ("*",) if keep == "all" else ()
    names = tuple(name.strip() for name in keep.split(",") if name.strip())
    known = [*QUANTITIES, *REQUESTED]
    wrong = [name for name in names if not any(fnmatchcase(quantity, name) for quantity in known)]
    if wrong or not names:
        known = ["all", "summary", *known]
        found = "no such quantity"
        raise InputError(
            argument_fault("keep", n, found, nearest(n, known)) for n in wrong or [keep]
        )
    return names


def validated(model: type[M], data: Any, file: str) -> M:
    """Return data as a model; raises InputError: all faults of the data."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise InputError(
            Fault(file, ".".join(map(str, detail["loc"])), *_found_and_allowed(detail))
            for detail in error.errors(include_url=False)[:MOST_FAULTS]
        ) from None


def _found_and_allowed(detail: Any) -> tuple[str, str]:
    if detail["type"] == "too_long":
        return "too many", f"{detail['ctx']['max_length']} at most"
    return repr(detail["input"])[:60], detail["msg"].lower()
