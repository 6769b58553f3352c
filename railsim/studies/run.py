"""A case becomes a file."""

from collections.abc import Callable
from pathlib import Path

from railsim.result import Hdf5Sink, Result
from railsim.simulation import simulate
from railsim.studies.case import Case


def run_case(
    case: Case,
    path: str | Path,
    *,
    overwrite: bool = False,
    progress: Callable[[float], None] | None = None,
    resume: Result | None = None,
) -> Result:
    """Run a case into its file, which carries the case's name and key.

    Parameters
    ----------
    case : Case
        What to run.
    path : str or Path
        Result file.
    overwrite : bool
        Replace an existing file.
    progress : callable, optional
        Called with the finished fraction now and then.
    resume : Result, optional
        A result whose end is the beginning of this run; the file then carries no key.

    Raises
    ------
    InputError, ModelError : as `railsim.simulate`; the file cannot be written.
    """
    facts = {"run": case.name}
    if resume is None:
        facts["inputs_hash"] = case.key
    else:
        facts["continues"] = str(resume.attributes.get("run", "another run"))
    with Hdf5Sink(path, overwrite=overwrite, attributes=facts) as sink:
        return simulate(
            case.vehicle,
            case.track,
            speed=case.speed,
            start=case.start,
            duration=case.duration,
            until=case.until,
            settings=case.settings,
            sink=sink,
            progress=progress,
            resume=resume,
        )
