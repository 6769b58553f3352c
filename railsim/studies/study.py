"""`study`: vehicles x tracks x speeds x further values, one result file per run.

A run whose file exists with the same inputs is not computed again, so that an interrupted study is
continued when it is started again.  Finished runs are recorded in the journal.
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from railsim.definitions.analyses import Analyses, Analysis, needs_run
from railsim.definitions.base import Definition
from railsim.definitions.file_definition import FileDefinition
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
from railsim.studies.summary import Inputs, checked, read_index, refuse_too_many
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
        Files, names of shipped ones, or `Vehicle` and `Track`, which are written to ``inputs/`` in
        the folder.
    speeds : sequence of float, a single one, or a range such as ``"15:25:11"``; None
        Speeds [m/s]; None if the settings have a speed table, or `linked` or `sample` vary
        ``speed``; ``"permitted"`` is the lower of the speeds of vehicle and track.
    out : str or Path
        Folder of the study, created if it does not exist.
    grid : mapping of str to values, optional
        Values of further keys, ``{"track.friction": [0.3, 0.4]}`` or ``"0.2:0.5:4"``.
    linked : sequence of mappings, optional
        Keys whose values vary together, the first of one with the first of the others.
    sample : Sample or mapping, optional
        Random values of further keys, as the table ``sample`` of a study file.
    quantities : callable or str, optional
        Function of the result that returns further numbers by name, or ``FILE.py:FUNCTION``.
    analyses : mapping of str to Analysis or mapping, optional
        Analyses at each point, as the tables ``analyses`` of a study file; by default a run.
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
        Largest number of runs, different only in the vehicle, that share a call; the results do not
        change.
    scheduler : str, optional
        Address of a dask scheduler whose workers carry out the runs instead.
    resume : bool
        Continue the study in the folder: runs whose inputs have changed are computed again.
    overwrite : bool
        Compute everything again.
    plots : bool
        Draw every run, and comparisons of the vehicles.
    keep : str
        ``all``; ``summary``, no result files; or names of quantities separated by commas, with
        ``*`` for any characters.  Summaries are always made from the complete result.
    compress, single : bool
        Store arrays compressed, and with 4 bytes per number.
    progress : callable, optional
        Called repeatedly with the finished fraction.
    on_record : callable, optional
        Called with the record of every finished run.
    on_remark : callable, optional
        Called with every remark on files found in the folder, such as damaged results that are
        computed again; by default remarks are logged.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        All faults of the inputs; files in the folder belong to other inputs and neither `resume`
        nor `overwrite` is given.

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
        fault = Fault("--quantities", "", "no analysis computes a run", 'add one of kind = "run"')
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
        "folder": os.path.relpath(Path.cwd(), folder),  # folder that relative file names refer to
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
    """Return the inputs of the study in a folder, and the folder of its relative file names.

    Raises
    ------
    InputError
        There is no study, or its inputs cannot be read.
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
        refuse_too_many(data, str(folder / JOURNAL))
        inputs = checked(Inputs, data, str(folder / JOURNAL))
    base = (folder / inputs.folder).resolve()
    return inputs, base if os.path.isdir(base) else Path.cwd()


def _several(values: Any) -> list[Any]:
    """Return one or several values as a list."""
    single = isinstance(values, str | Path | float | int | FileDefinition)
    return [values] if single else list(values)


def _speeds(speeds: Any) -> list[float | str | None]:
    """Return speeds, ranges and speeds with units as numbers [m/s]; `PERMITTED` unchanged."""
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
    """Return numpy numbers as Python numbers."""
    return value.item() if hasattr(value, "item") and not isinstance(value, str) else value


def _analyses(given: Mapping[str, Analysis | Mapping[str, Any]]) -> dict[str, Analysis]:
    whole = {name: one if isinstance(one, Definition) else dict(one) for name, one in given.items()}
    return checked(Analyses, {"analyses": whole}, "analyses").analyses


def _sample(given: Sample | Mapping[str, Any]) -> Sample:
    return given if isinstance(given, Sample) else checked(Sample, dict(given), "sample")
