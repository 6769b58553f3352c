"""`study`: vehicles x tracks x speeds x further values, one result file a run.

A run whose file is there with the same inputs is not computed again, so an interrupted study goes
on where it was when it is started again.  What is done stands in the journal.
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from railsim.definitions.analyses import Analyses, Analysis, needs_run
from railsim.definitions.base import Definition, FileDefinition
from railsim.definitions.settings import Settings
from railsim.definitions.study import Sample, value_texts
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import Fault, InputError
from railsim.files import check_folder, is_file
from railsim.studies.carry_out import carry_out, cores
from railsim.studies.combine import Plan
from railsim.studies.given import as_files
from railsim.studies.journal import JOURNAL, Journal, Record
from railsim.studies.keep import ALL, parse_keep
from railsim.studies.outcome import Outcome
from railsim.studies.own import Function, fingerprint, named
from railsim.studies.rows import PERMITTED, speed_of
from railsim.studies.summary import Inputs, checked, read_index
from railsim.units import ALLOWED
from railsim.version import __version__


def study(
    vehicles: Sequence[str | Path | Vehicle] | str | Path | Vehicle,
    tracks: Sequence[str | Path | Track] | str | Path | Track,
    speeds: Sequence[float | str | None] | float | str | None,
    *,
    out: str | Path,
    grid: Mapping[str, Iterable[object] | float | str] | None = None,
    linked: Sequence[Mapping[str, Iterable[object] | str]] = (),
    sample: Sample | Mapping[str, Any] | None = None,
    quantities: str | Function | None = None,
    analyses: Mapping[str, Analysis | Mapping[str, Any]] | None = None,
    settings: str | Path | Settings | None = None,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    assignments: Sequence[str] = (),
    workers: int | None = None,
    together: int = 1,
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    plots: bool = False,
    keep: str = ALL,
    compress: bool = False,
    single: bool = False,
    progress: Callable[[float], None] | None = None,
    on_record: Callable[[Record], None] | None = None,
    on_remark: Callable[[str], None] | None = None,
) -> Outcome:
    """Run every combination of vehicles, tracks, speeds and the values of a grid.

    Parameters
    ----------
    vehicles, tracks : sequence of str, Path or definition, or a single one
        Files, names of shipped ones, or `Vehicle` and `Track`, which are written into ``inputs/``
        of the folder.
    speeds : sequence of float, a single one, or a range such as ``"15:25:11"``; None
        Speeds [m/s]; None where the settings have a speed table, or `linked` or `sample` vary
        ``speed``; ``"permitted"`` is the lower of the vehicle's and the track's speed.
    out : str or Path
        Folder of the study; made if need be.
    grid : mapping of str to values, optional
        Values of further keys, ``{"track.friction": [0.3, 0.4]}`` or ``"0.2:0.5:4"``.
    linked : sequence of mappings, optional
        Keys whose values go together, the first of one with the first of the others.
    sample : Sample or mapping, optional
        Random values of further keys, as the table ``sample`` of a study file.
    quantities : callable or str, optional
        Function of the result that returns further numbers by their names, or
        ``FILE.py:FUNCTION``.
    analyses : mapping of str to Analysis or mapping, optional
        What is computed at each point, as the tables ``analyses`` of a study file; by default a
        run.
    settings : str, Path or Settings, optional
        Settings for all runs.
    start : float
        Distance at which all runs start [m].
    duration, until : float, optional
        End of all runs: time [s] or distance [m].
    assignments : sequence of str
        ``key.path=value`` for all runs.
    workers : int, optional
        Processes; by default one for each core.
    together : int
        How many runs that differ in the vehicle only share a call at most; results are the same.
    scheduler : str, optional
        Address of a dask scheduler whose workers do the runs instead.
    resume : bool
        Go on with the study that is in the folder: runs whose inputs have changed are computed
        again.
    overwrite : bool
        Compute everything again.
    plots : bool
        Draw every run, and the vehicles against each other.
    keep : str
        ``all``; ``summary``, no result files; or names of quantities with commas between, ``*``
        standing for any letters.  Summaries are made before anything is left out.
    compress, single : bool
        Store arrays compressed, and with 4 bytes a number.
    progress : callable, optional
        Called with the finished fraction now and then.
    on_record : callable, optional
        Called with the record of every run that is done.
    on_remark : callable, optional
        Called with every sentence on what was found in the folder, such as damaged results that
        are computed again; by default they go to the log.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        Everything that is wrong in the inputs; files in the folder belong to other inputs and
        neither `resume` nor `overwrite` is given.

    Examples
    --------
    >>> import railsim, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = railsim.study(
    ...         ["coach_manchester"], ["curve_r250"], [20.0], until=10.0, out=folder, workers=1
    ...     )
    ...     print([record["status"] for record in outcome.records])
    ['complete']
    """
    folder = Path(out)
    check_folder(folder)
    kept = parse_keep(keep, compress=compress, single=single)
    vehicles = as_files(_several(vehicles), folder)
    tracks = as_files(_several(tracks), folder)
    (settings,) = as_files([settings], folder)
    asked = _speeds(speeds)
    written = _written("grid", grid or {})
    tables = [_written("linked", table) for table in linked]
    drawn = None if sample is None else _sample(sample)
    own = named(quantities)
    work = _analyses(analyses or {})
    if own and not needs_run(work):
        fault = Fault("--quantities", "", "no analysis makes a run", 'add one of kind = "run"')
        raise InputError([fault])
    plan = Plan(
        vehicles,
        tracks,
        asked,
        written,
        linked=tables,
        sample=drawn,
        told=fingerprint(own),
        analyses=work,
        settings=settings,
        start=start,
        duration=duration,
        until=until,
        assignments=assignments,
        workers=workers or cores(),
    )
    inputs = {
        "railsim_version": __version__,
        "folder": os.path.relpath(Path.cwd(), folder),  # where names of files begin
        "vehicles": [str(vehicle) for vehicle in vehicles],
        "tracks": [str(track) for track in tracks],
        "speeds": asked,
        "grid": written,
        "linked": tables,
        "sample": None if drawn is None else drawn.model_dump(exclude_none=True),
        "quantities": own,
        "analyses": {
            name: one.model_dump(mode="json", exclude_none=True) for name, one in work.items()
        },
        "keep": keep,
        "compress": compress,
        "single": single,
        "settings": None if settings is None else str(settings),
        "start": start,
        "duration": duration,
        "until": until,
        "assignments": list(assignments),
    }
    outcome = carry_out(
        plan, inputs, folder, own=own, keep=kept, workers=workers, together=together,
        scheduler=scheduler, resume=resume, overwrite=overwrite, plots=plots, progress=progress,
        on_record=on_record, on_remark=on_remark,
    )  # fmt: skip
    if plots:
        from railsim.studies.pictures import draw

        draw(outcome)
    return outcome


def stored_inputs(folder: Path) -> tuple[Inputs, Path]:
    """Return the inputs of the study in a folder, and the folder where its names of files begin.

    Raises
    ------
    InputError
        There is no study, or it cannot be read.
    """
    data: Any = None
    if is_file(folder / JOURNAL):
        with Journal(folder) as journal:
            data = journal.inputs
    if data is None:
        index = folder / "study.json"
        if not is_file(index):
            found = f"no study in {folder} to resume"
            fault = Fault("--resume", "", found, "give --vehicles, --tracks and --speeds")
            raise InputError([fault])
        inputs = read_index(index).inputs
    else:
        inputs = checked(Inputs, data, str(folder / JOURNAL))
    base = (folder / inputs.folder).resolve()
    return inputs, base if os.path.isdir(base) else Path.cwd()


def _several(values: Any) -> list[Any]:
    """Return values as a list, also where a single one is given."""
    single = isinstance(values, str | Path | float | int | FileDefinition)
    return [values] if single else list(values)


def _speeds(speeds: Any) -> list[float | str | None]:
    """Return speeds as numbers, those of a range, and with units [m/s]; `PERMITTED` as it is."""
    if speeds is None:
        return [None]
    found: list[float | str | None] = []
    for speed in _several(speeds):
        if isinstance(speed, str) and speed != PERMITTED:
            found += [speed_of(text) for text in _texts("speeds", speed)]
        else:
            found.append(speed)
    return found


def _written(what: str, values: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return values of keys as they are written in assignments."""
    found = {}
    for key, given in values.items():
        found[key] = [text for value in _several(given) for text in _texts(f"{what} {key}", value)]
    return found


def _texts(what: str, value: Any) -> list[str]:
    try:
        return value_texts(value if isinstance(value, str) else (_plain(value),))
    except ValueError as error:
        raise InputError([Fault(what, "", str(error), f"allowed: {ALLOWED}")]) from None


def _plain(value: Any) -> Any:
    """Return numbers of numpy as Python's own."""
    return value.item() if hasattr(value, "item") and not isinstance(value, str) else value


def _analyses(given: Mapping[str, Analysis | Mapping[str, Any]]) -> dict[str, Analysis]:
    whole = {name: one if isinstance(one, Definition) else dict(one) for name, one in given.items()}
    return checked(Analyses, {"analyses": whole}, "analyses").analyses


def _sample(given: Sample | Mapping[str, Any]) -> Sample:
    return given if isinstance(given, Sample) else checked(Sample, dict(given), "sample")
