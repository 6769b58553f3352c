"""The track, and the wheel forces, from what a vehicle in service reads.

==================  ============================================================================
`irregularity.py`   `irregularity`: pieces of a run, their signals, the smoother
`estimate.py`       `Irregularity`: values with their uncertainty, tables, files
`smoother.py`       smoother of stationary Gaussian fields, with gaps
`contact.py`        wheel-rail contact on a rough track, linear in the mean, and its noise
`grid.py`           signals over arc length at equal steps
==================  ============================================================================
"""

from railsim.observation.estimate import Irregularity
from railsim.observation.irregularity import Assumed, irregularity

__all__ = ["Assumed", "Irregularity", "irregularity"]
