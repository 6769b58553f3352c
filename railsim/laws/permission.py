"""Permission to execute laws: of which sources, in this process and those that it starts."""

import hashlib
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.vehicle.laws import Law
from railsim.errors import Fault, Faults
from railsim.threads import restored_environment

D = TypeVar("D", Vehicle, Track)
PERMITTED = "RAILSIM_LAWS"
"""Environment variable with the hashes of permitted sources, for worker processes."""
ALL = "all"


def digest(source: str) -> str:
    """Return the hash by which a source is known."""
    return hashlib.sha256(source.encode()).hexdigest()


def allow(*sources: str) -> None:
    """Permit these sources, or all without any, in this process and those that it starts."""
    digests = [digest(source) for source in sources] or [ALL]
    present = [text for text in os.environ.get(PERMITTED, "").split(",") if text]
    os.environ[PERMITTED] = ",".join(dict.fromkeys([*present, *digests]))


@contextmanager
def allowed(everything: bool) -> Iterator[None]:
    """Permit all sources within a block, or change nothing."""
    with restored_environment(PERMITTED):
        if everything:
            allow()
        yield


def is_allowed(source: str) -> bool:
    """Whether a source may be executed."""
    digests = os.environ.get(PERMITTED, "").split(",")
    return ALL in digests or digest(source) in digests


def refused_laws(definition: Vehicle | Track | Settings) -> list[str]:
    """Return the names of its laws that are not permitted."""
    laws = (definition.laws or {}).items()
    return [name for name, law in laws if not is_allowed(law.source or "")]


def check_laws(laws: Iterable[tuple[str, Law]]) -> None:
    """Raise InputError with all of some named laws that are not permitted."""
    allowed = "--allow-code, or --law FILE with this file; in Python allow_code=True"
    text = "is code of {}, which is not executed"
    faults = (
        Fault("laws", name, f"'{name}' {text.format(law.file or 'a result')}", allowed)
        for name, law in laws
        if not is_allowed(law.source or "")
    )
    Faults(dict.fromkeys(faults)).check()  # runs of a study have a law in common


def permitted_part(definition: D) -> D:
    """Return a vehicle or track without what a law that is not permitted does, to be looked at."""
    if not refused_laws(definition):
        return definition
    if isinstance(definition, Track):
        parts = [part for part in definition.irregularities if part.type != "law"]
        return definition.replace(irregularities=parts, laws=None)

    def stripped(group: dict[str, Any]) -> dict[str, Any]:
        parts = {n: e for n, e in group.get("elements", {}).items() if e["kind"] != "law"}
        inner = {n: stripped(a) for n, a in group.get("assemblies", {}).items()}
        return {**group, "elements": parts, "assemblies": inner}

    tables = stripped(definition.model_dump(exclude_none=True))
    return definition.replace(
        elements=tables["elements"],
        assemblies=tables["assemblies"],
        signals=None,
        controllers=None,
        laws=None,
    )
