"""Definitions that fill a whole file: checked with all faults at once, changed, written."""

import pickle
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar, get_args

import tomli_w
from pydantic import ValidationError

from railsim.definitions.base import Definition, Remark, once
from railsim.definitions.faults import validation_faults
from railsim.errors import Fault, InputError
from railsim.files.access import check_file, write_text
from railsim.files.overrides import apply_overrides, plain, with_values
from railsim.files.sources import Source, text_source
from railsim.table import Table
from railsim.text import printable, shortened

LONGEST_VALUE = 60  # characters of a value in the table of a notebook
MOST_RESTORED = 100  # definitions that a worker process keeps
D = TypeVar("D", bound="FileDefinition")


class FileDefinition(Definition):
    """Base of what fills a whole file; its `format` names it."""

    KIND: ClassVar[str]
    """Word for it: vehicle, track, settings."""
    format: str
    """Kind and version of the file"""
    OPEN_TABLES: ClassVar[tuple[str, ...]] = ()
    """Tables that an assignment makes where they are missing; their members are dotted names."""

    def __init__(self, /, **values: Any) -> None:
        """Check the values; raises InputError: everything that is wrong in them."""
        # as those of a file, so that faults are located alike
        values = {"format": self.format_name(), **plain(values)}
        try:
            super().__init__(**values)
        except ValidationError as error:
            faults = validation_faults(error, Source(self.KIND, values), type(self))
            raise InputError(dict.fromkeys(faults)) from None

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # not that of files

    @classmethod
    def format_name(cls) -> str:
        """Return the value of the key `format`."""
        return str(get_args(cls.model_fields["format"].annotation)[0])

    @classmethod
    def complete(cls, tables: dict[str, Any]) -> list[Fault]:
        """Complete the plain tables from further files, in place; return the faults of these."""
        return []

    @classmethod
    def table_faults(cls, tables: Mapping[str, Any]) -> list[Fault]:
        """Return what is wrong in the plain tables, valid or not; the faults' file is empty."""
        return []

    def contradictions(self) -> list[Fault]:
        """Return what is wrong between the parts of a valid definition; the file is empty."""
        return []

    def settled(self) -> Self:
        """Return the valid definition with what its keys ask to be done with it."""
        return self

    def unusual(self) -> list[Remark]:
        """Return what is allowed but unusual."""
        return []

    @classmethod
    def note_assigned(
        cls, tables: dict[str, Any], keys: Iterable[str], before: "FileDefinition | None" = None
    ) -> None:
        """Note in the plain tables which keys are assigned, where a definition keeps that."""

    def to_toml(self) -> str:
        """Return the whole definition as TOML text, defaults included, `extends` resolved."""
        # a study asks for it once for every run
        return once(self, "_toml", lambda: tomli_w.dumps(self.model_dump(exclude_none=True)))

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the definition as a file, which appears when it is whole.

        Raises InputError: the file exists or cannot be written.
        """
        path = Path(path)
        check_file(path, overwrite=overwrite, endings=[".toml"])
        write_text(path, self.to_toml())
        return path

    def replace(self, **changes: Any) -> Self:
        """Return a copy with top-level keys replaced, validated again; raises `InputError`."""
        copy = type(self)(**{**self.model_dump(exclude_none=True), **changes})
        if faults := copy.contradictions():
            raise InputError(replace(one, file=one.file or self.KIND) for one in faults)
        return copy.settled()

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """Return a copy with other values at some keys, checked as a file would be.

        Parameters
        ----------
        values : mapping of str to value
            Values by the dotted keys of the file, SI; members of lists by their `name` or index.

        Raises
        ------
        InputError
            A key that does not exist, or a value that is not allowed; all of them at once.

        Examples
        --------
        >>> import railsim
        >>> coach = railsim.load_vehicle("coach_manchester")
        >>> coach.with_values({"bodies.carbody.mass": 40e3}).bodies["carbody"].mass
        40000.0
        """
        kind = type(self)
        source = text_source(self.to_toml(), getattr(self, "name", kind.KIND), kind.KIND)
        kind.note_assigned(source.data, values, self)
        return validated(kind, with_values(source, values, kind.OPEN_TABLES, _defaults(kind)))

    def __reduce__(self) -> tuple[Any, ...]:
        # its values alone, without what was worked out
        values = {name: self.__dict__[name] for name in type(self).model_fields}
        keys = self.model_fields_set
        return restored, (type(self), once(self, "_pickled", lambda: pickle.dumps((keys, values))))

    def __repr__(self) -> str:
        kind, name = type(self).__name__, getattr(self, "name", None)
        if name:
            return f"<{kind} {printable(name)!r}>"
        fields = self.model_dump(exclude_defaults=True, exclude={"format"})
        values = shortened(", ".join(f"{key}={value!r}" for key, value in fields.items()))
        return f"<{kind}: {printable(values) or 'defaults'}>"

    __str__ = __repr__

    def __dir__(self) -> list[str]:
        """Return names to complete: keys and what users call."""
        inside = {"KIND", "OPEN_TABLES", "complete", "contradictions", "format_name",
                  "note_assigned", "settled", "table_faults"}  # fmt: skip
        return sorted(set(super().__dir__()) - inside)

    def _table(self) -> Table:
        """Return the table that a notebook shows: keys and their values."""
        entries = self.model_dump(exclude_none=True, exclude={"format", "name"})
        rows: list[list[object]] = []
        for key, value in entries.items():
            if isinstance(value, dict | list | tuple) and len(str(value)) > LONGEST_VALUE:
                value = f"{len(value)} entries"
            rows.append([key, value])
        return Table(["key", "value"], rows)

    def _repr_html_(self) -> str:
        table = self._table()
        table.caption = str(getattr(self, "name", type(self).__name__))
        return table.html()


@lru_cache(MOST_RESTORED)
def restored(kind: type[D], pickled: bytes) -> D:
    """Return a pickled definition: the same one each time, which keeps what was worked out.

    A process of a study gets a vehicle with each of its runs.
    """
    fields, values = pickle.loads(pickled)
    return kind.model_construct(fields, **values)


def loaded(model: type[D], source: Source, overrides: Iterable[str] | str) -> D:
    """Return the definition of a source with assignments; raises InputError: all that is wrong."""
    if source.data.get("format") != model.format_name():
        file = source.file_of(("format",))
        raise InputError([format_fault(file, source.data.get("format"), [model.format_name()])])
    overrides = [overrides] if isinstance(overrides, str) else list(map(str, overrides))
    model.note_assigned(source.data, [text.partition("=")[0].strip() for text in overrides])
    return validated(model, apply_overrides(source, overrides, model.OPEN_TABLES, _defaults(model)))


def _defaults(model: type[FileDefinition]) -> dict[str, Any]:
    return {**model.model_construct().model_dump(mode="json"), "format": model.format_name()}


def validated(model: type[D], source: Source) -> D:
    """Return the definition of a source; raises InputError: everything that is wrong."""

    def located(faults: Iterable[Fault]) -> list[Fault]:
        return [f if f.file else source.fault(f.key, f.found, f.allowed) for f in faults]

    faults = located([*model.complete(source.data), *model.table_faults(source.data)])
    try:
        definition = model.model_validate(source.data)
    except ValidationError as error:
        faults = validation_faults(error, source, model) + faults
    else:
        faults = faults or located(definition.contradictions())
    if faults:
        raise InputError(dict.fromkeys(faults))
    return definition.settled()


def format_fault(file: str, found: object, allowed: Iterable[str]) -> Fault:
    """Return the fault of a file whose `format` is another."""
    text = "missing" if found is None else shortened(repr(found))
    return Fault(file, "format", text, "allowed: " + ", ".join(allowed))
