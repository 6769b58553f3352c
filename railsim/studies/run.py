"""Run of a case to a file."""

from collections.abc import Callable, Collection
from pathlib import Path

from railsim.result import Hdf5Sink, Result
from railsim.result.hdf5 import PLAIN, Storage
from railsim.result.sinks import EVERYTHING, MemorySink
from railsim.simulation import simulate
from railsim.studies.case import Case


def run_case(
    case: Case,
    path: str | Path | None,
    *,
    overwrite: bool,
    progress: Callable[[float], None] | None,
    resume: Result | None = None,
    only: Collection[str] = EVERYTHING,
    storage: Storage = PLAIN,
) -> Result:
    """Run a case to its file, which carries name and key of the case.

    `path`: result file; None to keep the result in memory; `resume`: result whose final state is
    the initial state of this run; the file then carries no key; `only`: names of the quantities in
    a result in memory, with ``*`` for any characters; by default all; `storage`: of the file.
    Raises InputError, ModelError: as `railsim.simulate`; the file cannot be written.
    """
    facts = {"run": case.name}
    if resume is None:
        facts["inputs_hash"] = case.key
    else:
        facts["continues"] = str(resume.attributes.get("run", "another run"))
    with (
        MemorySink(facts, only)
        if path is None
        else Hdf5Sink(path, overwrite=overwrite, attributes=facts, storage=storage)
    ) as sink:
        return simulate(
            case.vehicle, case.track, **case.conditions, sink=sink, progress=progress, resume=resume
        )
