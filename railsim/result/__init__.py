"""Results: named arrays with units, in memory and in HDF5.

==============  ===========================================================================
`data.py`       `Result`: arrays by name, coordinates, attributes, the embedded inputs
`labels.py`     names and numbers of wheelsets along the dimensions of a result
`extremes.py`   largest values with wheelset, side, time and distance; values at mid-curve; facts
`sinks.py`      `Sink`, what a simulation writes to; `MemorySink`
`hdf5.py`       layout of the result file, `Hdf5Sink`
`reading.py`    `open_result`, `open_run`, `check_result`: any damage is an input error
`integrity.py`  checksums, digest and seal of a result file
==============  ===========================================================================

Begin reading in `data.py`.
"""

from railsim.result.data import Result, Results
from railsim.result.extremes import MidCurve, Peak, mid_curves, peak, peaks
from railsim.result.hdf5 import Hdf5Sink
from railsim.result.reading import check_result, open_result, open_run
from railsim.result.sinks import MemorySink, Sink

__all__ = [
    "Hdf5Sink", "MemorySink", "MidCurve", "Peak", "Result", "Results", "Sink", "check_result",
    "mid_curves", "open_result", "open_run", "peak", "peaks",
]  # fmt: skip
