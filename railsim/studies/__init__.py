"""Studies: every combination of vehicles, tracks, speeds and further values, one file a run.

================  ===========================================================================
`case.py`       `Case`: all that one run depends on, with its name and its key
`points.py`     what each run is asked for, with a key, before anything is loaded
`given.py`      definitions given in Python become files of the folder
`rows.py`       values of grids, linked keys and samples
`combine.py`    from lists and grids to cases; every fault of all of them at once
`run.py`        a case becomes a file
`execute.py`    cases over processes or a dask cluster
`journal.py`    what is done, one line a run, appended
`own.py`        own quantities by a Python function
`summary.py`    ``summary.csv`` and ``study.json``
`study.py`      `study`: inputs become a plan, which is carried out
`state.py`      what of a plan is done, and what is to be computed
`carry_out.py`  `carry_out`: the runs that are not done, with the folder's journal
`outcome.py`    `Outcome`: summary and results of a folder
`analyses.py`   what is computed at a point besides a run: curving, critical speed, modes
`optimise.py`   `optimise`: parameters against objectives and constraints
`designs.py`    designs through a study, and what came of them
`chosen.py`     the chosen design as a vehicle file
`search.py`     ways to propose designs
`front.py`      Pareto fronts and their volume
`sensitivity.py`  what the values of an optimisation depend on
`stationary.py` a vehicle at a stand on twisted track and on cant, against limits
================  ===========================================================================

Begin reading in `study.py`.
"""

from railsim.studies.case import Case
from railsim.studies.outcome import Outcome
from railsim.studies.study import study

__all__ = ["Case", "Outcome", "study"]
