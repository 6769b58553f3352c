"""One page about result files, folders of studies, comparisons with tests and wear."""

from collections.abc import Sequence
from pathlib import Path

from railsim.assessment.assessment import Assessment
from railsim.errors import Faults, listed
from railsim.files.access import check_file, folder_of, write_text
from railsim.report.measured import as_section, is_measured, measured_page, read_part
from railsim.report.runs import page
from railsim.report.spread import worst_runs
from railsim.studies.gathered import gather
from railsim.studies.inputs import used_inputs

ENDINGS = (".html", ".htm")
MOST_CURVES = 16  # runs whose curves a page can tell apart


def write_report(
    files: str | Path | Sequence[str | Path],
    path: str | Path,
    *,
    title: str = "",
    curves: int = 8,
    assessments: Sequence[Assessment] = (),
    overwrite: bool = False,
) -> Path:
    """Write the page about result files, folders of studies, comparisons with tests and wear.

    Parameters
    ----------
    files : str or Path, or a sequence of them
        Result files; folders of studies, and those that `validate_model`, `identify` or studies of
        wear have written.
    path : str or Path
        The page, ``.html``.
    title : str
        By default the names of what is reported.
    curves : int
        Largest number of runs whose curves are shown, those with the largest values; 1 to 16.
    assessments : sequence of Assessment
        Assessments of the runs, shown with their limits.
    overwrite : bool
        Whether the page may be replaced.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        Nothing is given; something cannot be read or is given twice; a number of curves that cannot
        be shown; the page exists or cannot be written.

    Examples
    --------
    >>> import railsim
    >>> railsim.write_report("curves", "curves.html")  # doctest: +SKIP
    """
    target = Path(path)
    each = list(files) if isinstance(files, Sequence) and not isinstance(files, str) else [files]
    faults = Faults()
    faults.require(each, "files", "none", "a result file or a folder at least")
    for file in each:
        allowed = "the path of a result file, or the folder of a study"
        faults.require(isinstance(file, str | Path), "files", f"found {file!r}", allowed)
    faults.require(1 <= curves <= MOST_CURVES, "curves", f"found {curves}", f"1 to {MOST_CURVES}")
    faults.check()
    names = [str(file) for file in each]
    check_file(target, overwrite=overwrite, endings=ENDINGS)
    parts = [read_part(name) for name in names if is_measured(name)]
    names = [name for name in names if not is_measured(name)]
    if not names:
        write_text(target, measured_page(parts, title))
        return target
    found = gather(names)
    with_files = [record for record in found.records if record["name"] in found.paths]
    stems = list(dict.fromkeys(folder_of(name).resolve().stem for name in names))
    title = title or str(found.inputs.get("name") or listed(stems, 4))
    every = found.results([record["name"] for record in with_files])
    results = {name: every[name] for name in worst_runs(with_files, curves)}
    used = [] if results or not found.inputs else used_inputs(folder_of(names[0]))
    measured = [as_section(part, number) for number, part in enumerate(parts, start=1)]
    runs = found.records, results, found.remarks, every, found.inputs, used
    write_text(target, page(title, *runs, assessments, measured))
    return target
