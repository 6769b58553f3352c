"""Run of a case to a file."""

from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from railsim.result import Hdf5Sink, Result
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
) -> Result:
    """Run a case to its file, which carries name and key of the case.

    `path`: result file; None to keep the result in memory; `resume`: result whose final state is
    the initial state of this run; the file then carries no key; `only`: names of the quantities in
    a result in memory, with ``*`` for any characters; by default all. Raises InputError,
    ModelError: as `railsim.simulate`; the file cannot be written.
    """
    facts = {"run": case.name}
    if resume is None:
        facts["inputs_hash"] = case.key
    else:
        facts["continues"] = str(resume.attributes.get("run", "another run"))
    with _sink(path, overwrite, facts, only) as sink:
        return simulate(
            case.vehicle, case.track, **case.conditions, sink=sink, progress=progress, resume=resume
        )


def _sink(
    path: str | Path | None,
    overwrite: bool,
    facts: Mapping[str, str],
    only: Collection[str] = EVERYTHING,
) -> Hdf5Sink | MemorySink:
    if path is None:
        return MemorySink(facts, only)
    return Hdf5Sink(path, overwrite=overwrite, attributes=facts)
