"""`Outcome`: results of a study in its folder, and its summary as a table or an array."""

import json
import math
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from railsim.errors import optional_package
from railsim.result import Result, open_result
from railsim.studies.journal import NOT_DONE, Records
from railsim.studies.records import Record
from railsim.studies.summary import summary_row, unit_of

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

MOST_COMPARED = 2000  # runs


@dataclass(frozen=True)
class Outcome:
    """Results of a study in its folder.

    Attributes
    ----------
    folder : Path
        Holds the result files, ``summary.csv`` and ``study.json``.
    records : sequence of dict
        One for every run, in the order of the combinations; read on access.
    computed : int
        Number of runs that were computed by this call; the others existed.
    """

    folder: Path
    records: Records
    computed: int

    def __repr__(self) -> str:
        ends = Counter(record["status"] for record in self.records)
        counts = ", ".join(f"{number} {status}" for status, number in ends.items())
        return f"<Outcome: {self.folder}, {counts}>"

    @property
    def failed(self) -> tuple[Record, ...]:
        """Runs without a result."""
        return self.records.of_status(lambda status: status == "failed")

    @property
    def ended_early(self) -> tuple[Record, ...]:
        """Runs that ended early for a physical reason."""
        return self.records.of_status(lambda status: status not in ("complete", "failed"))

    def without_effect(self) -> list[str]:
        """Return varied keys of files that change no peak of any run, such as what others replace.

        Looked for where no more than `MOST_COMPARED` runs are there.
        """
        names = [name for name in self._labels() if "." in name]
        found = list[str]()
        for name in names if len(self.records) <= MOST_COMPARED else ():
            alike: dict[str, list[str]] = {}  # runs that differ in this key only
            for record in self.records:
                if record.get("peaks"):
                    others = json.dumps({k: v for k, v in record["labels"].items() if k != name})
                    values = json.dumps([record["peaks"], record.get("mid_curves")])
                    alike.setdefault(others, []).append(values)
            groups = alike.values()
            if any(len(one) > 1 for one in groups) and all(len({*one}) == 1 for one in groups):
                found.append(name)
        return found

    def results(self) -> dict[str, Result]:
        """Return the results by the names of their runs; arrays are read on access."""
        return {
            record["name"]: open_result(self.folder / record["file"])
            for record in self.records
            if record["status"] not in NOT_DONE and record["file"]
        }

    def plot(
        self,
        *quantities: str,
        against: str | None = None,
        family: str | None = None,
        kind: str | None = None,
        path: str | Path | None = None,
        overwrite: bool = False,
    ) -> "Figure":
        """Draw values of the summary over what was varied, as ``railsim plot``; see `study_figure`.

        `path`: Where the picture is written too; the suffix tells its kind. `overwrite`: Whether a
        file may be replaced.
        """
        from railsim.plot.style import save
        from railsim.studies.picture import study_figure

        figure = study_figure(self.folder, quantities, against=against, family=family, kind=kind)
        if path is not None:
            save(figure, path, overwrite=overwrite)
        return figure

    def to_dataframe(self) -> "pandas.DataFrame":
        """Return the summary, one row per run, as a `pandas.DataFrame` [SI].

        Raises ImportError: pandas is not installed.
        """
        pandas = optional_package("pandas", "to_dataframe", "pandas")
        frame = pandas.DataFrame([summary_row(record) for record in self.records])
        for name in self._labels():  # values of a grid are texts, as in a file
            with suppress(ValueError, TypeError):
                frame[name] = pandas.to_numeric(frame[name])
        return frame

    def _labels(self) -> list[str]:
        return list(dict.fromkeys(name for record in self.records for name in record["labels"]))

    def to_xarray(self) -> "xarray.Dataset":
        """Return the numbers of the summary as an `xarray.Dataset` with the grid as dimensions.

        Dimensions are the parameters that differ between the runs; if these do not form a full
        grid, as in a sample, the dimension is ``run``.  Each variable has its ``units``.

        Raises ImportError: pandas or xarray is not installed.
        """
        package = optional_package("xarray", "to_xarray", "'railsim[xarray]'")
        frame = self.to_dataframe()
        labels = self._labels()
        varied = [name for name in labels if frame[name].nunique(dropna=False) > 1]
        numbers = frame.select_dtypes("number").columns.difference(labels, sort=False)
        full = math.prod(frame[name].nunique() for name in varied) == len(frame)
        data: xarray.Dataset
        if varied and full and not frame.duplicated(varied).any():
            data = package.Dataset.from_dataframe(frame.set_index(varied)[list(numbers)])
        else:
            indexed = frame.set_index("name").rename_axis("run")
            data = package.Dataset.from_dataframe(indexed[[*varied, *numbers]]).set_coords(varied)
        for name in data:
            data[name].attrs["units"] = unit_of(str(name)) or "1"
        return data
