"""`study`: from inputs to a plan, which is carried out."""

import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain, count
from pathlib import Path
from typing import Any

from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.study.analyses import Analysis, needs_run
from railsim.definitions.study.definition import Sample
from railsim.errors import argument_error
from railsim.files.access import check_folder, is_file, make_folder, relative, write_text
from railsim.processes import available_cores
from railsim.result import Result
from railsim.studies.carry_out import carry_out, comparison_picture
from railsim.studies.journal import JOURNAL, Journal
from railsim.studies.outcome import Outcome
from railsim.studies.plan import Plan
from railsim.studies.records import Record
from railsim.studies.spec import Execution, Progress, StudySpec, validated
from railsim.studies.summary import read_index, refuse_too_many
from railsim.studies.user_function import Function, full_name
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
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    plots: bool = False,
    keep: str = "all",
    compress: bool = False,
    single: bool = False,
    progress: Progress | None = None,
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
    scheduler : str, optional
        Address of a dask scheduler whose workers carry out the runs instead.
    resume : bool
        Continue the study in the folder: runs whose inputs have changed are computed again.
    overwrite : bool
        Compute everything again.
    plots : bool
        Draw every run; where results are kept also comparisons of the vehicles.
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
    inputs = {
        "vehicles": as_files(vehicles, folder),
        "tracks": as_files(tracks, folder),
        "speeds": speeds,
        "grid": grid or {},
        "linked": list(linked),
        "sample": sample,
        "quantities": full_name(quantities),
        "analyses": analyses or {},
        "settings": None if settings is None else as_files([settings], folder)[0],
        "start": start,
        "duration": duration,
        "until": until,
        "assignments": list(assignments),
        "keep": keep,
        "compress": compress,
        "single": single,
    }
    execution = Execution(
        workers=workers,
        scheduler=scheduler,
        resume=resume,
        overwrite=overwrite,
        plots=plots,
        progress=progress,
        on_record=on_record,
        on_remark=on_remark,
    )
    return run_study(validated(StudySpec, inputs, "study"), folder, execution)


def run_study(spec: StudySpec, folder: Path, execution: Execution) -> Outcome:
    """Carry out a study in its folder; see `study`."""
    check_folder(folder)
    if spec.quantities and not needs_run(spec.analyses):
        raise argument_error("quantities", "no analysis computes a run", 'add one of kind = "run"')
    plan = Plan(spec, execution.workers or available_cores())
    spec = spec.changed(railsim_version=__version__, folder=relative(Path.cwd(), folder))
    outcome = carry_out(plan.points, plan.cases, spec, folder, execution)
    if execution.plots:
        _draw(outcome)
    return outcome


def _draw(outcome: Outcome) -> None:
    """Draw runs whose picture is missing or old, and those of several vehicles into one."""
    from railsim.plot.histories import histories
    from railsim.plot.overlay import overlay
    from railsim.plot.style import save

    results = outcome.results()
    alike: dict[str, dict[str, Result]] = {}
    for record in outcome.records:
        result = results.get(record["name"])
        if result is None or not len(result["time"]):
            continue
        file = outcome.folder / record["file"]
        picture = file.with_suffix(".png")
        if not picture.exists() or picture.stat().st_mtime < file.stat().st_mtime:
            save(histories(result), picture, overwrite=True)
        vehicle = str(record["labels"]["vehicle"])
        together = comparison_picture(record["name"], record["labels"])
        alike.setdefault(together, {})[vehicle] = result
    for name, some in alike.items():
        if len(some) > 1:
            save(overlay(some), outcome.folder / name, overwrite=True)


def stored_spec(folder: Path) -> tuple[StudySpec, Path]:
    """Return the study in a folder, and the folder of its relative names; raises InputError."""
    data: Any = None
    if is_file(folder / JOURNAL):
        with Journal(folder) as journal:
            data = journal.inputs
    if data is None:
        index = folder / "study.json"
        if not is_file(index):
            found = f"no study in {folder} to resume"
            raise argument_error("resume", found, "give `vehicles`, `tracks` and `speeds`")
        inputs = read_index(index).inputs
    else:
        refuse_too_many(data, str(folder / JOURNAL))
        inputs = validated(StudySpec, data, str(folder / JOURNAL))
    base = (folder / inputs.folder).resolve()
    return inputs, base if os.path.isdir(base) else Path.cwd()


INPUTS = "inputs"


def as_files(inputs: Any, folder: Path) -> list[str]:
    """Return one or several inputs as files; definitions are written if they do not exist."""
    single = not isinstance(inputs, Iterable) or isinstance(inputs, str | Path | FileDefinition)
    texts: dict[str, str] = {}  # of the definitions, by name
    files = []
    for one in [inputs] if single else inputs:
        if not isinstance(one, str | Path | FileDefinition):
            words = "give files, names of shipped ones, or what railsim.load_vehicle returns"
            raise TypeError(f"one of the inputs of the study is a {type(one).__name__}; {words}")
        if not isinstance(one, FileDefinition):
            files.append(str(one))
            continue
        text = one.to_toml()
        base = _slug(str(getattr(one, "name", "settings")))
        names = chain([base], (f"{base}-{number}" for number in count(2)))
        name = next(name for name in names if texts.get(name, text) == text)
        texts[name] = text
        path = (folder / INPUTS / f"{name}.toml").absolute()
        if not (path.is_file() and path.read_bytes() == text.encode()):
            make_folder(path.parent)
            write_text(path, text)
        files.append(str(path))
    return files


def _slug(name: str) -> str:
    """Return a name in a form suitable for a file.

    >>> _slug("Passenger coach, soft primary")
    'passenger_coach_soft_primary'
    """
    return re.sub(r"\W+", "_", name.lower()).strip("_")[:60] or "definition"
