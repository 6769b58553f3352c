"""Run of a case to a file; runs of several cases in one call."""

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

from railsim.errors import InputError
from railsim.result import Hdf5Sink, Result
from railsim.result.sinks import EVERYTHING, MemorySink
from railsim.simulation import outcomes, simulate
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


def can_share_a_call(one: Case, other: Case) -> bool:
    """Whether two cases differ only in the vehicle."""
    return one.track == other.track and one.conditions == other.conditions


def run_cases(
    cases: Sequence[Case],
    paths: Sequence[Path | None],
    *,
    overwrite: bool = False,
    progress: Callable[[float], None] | None = None,
    only: Collection[str] = EVERYTHING,
) -> list[Result | Exception]:
    """Run cases that differ only in the vehicle in one call; failures do not affect the others.

    Arguments as of `run_case`.
    """
    found: dict[int, Result | Exception] = {}
    sinks: dict[int, Hdf5Sink | MemorySink] = {}
    with ExitStack() as stack:
        for number, (case, path) in enumerate(zip(cases, paths, strict=True)):
            facts = {"run": case.name, "inputs_hash": case.key}
            try:
                sink = _sink(path, overwrite, facts, only)
            except InputError as error:
                found[number] = error
            else:
                stack.enter_context(sink)
                sinks[number] = sink
        done = outcomes(
            [cases[number].vehicle for number in sinks],
            cases[0].track,
            **cases[0].conditions,
            sinks=list(sinks.values()),
            progress=progress,
        )
    found |= zip(sinks, done, strict=True)
    return [found[number] for number in range(len(cases))]
