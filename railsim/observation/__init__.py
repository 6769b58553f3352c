"""The track, and the wheel forces, from what a vehicle in service reads.

==================  ============================================================================
`irregularity.py`   `irregularity`: the smoother of a vehicle for the pieces of a run
`pieces.py`         pieces of a run, their signals over arc length at equal steps
`innovations.py`    channels that disagree, sizes of errors
`simulated.py`      the run simulated on an estimate, and the estimate put right by it
`estimate.py`       `Irregularity`: values with their uncertainty, tables, files
`smoother.py`       smoother of stationary Gaussian fields, with gaps
`contact.py`        wheel-rail contact on a rough track, linear in the mean, and its noise
==================  ============================================================================
"""

from railsim.observation.estimate import Irregularity
from railsim.observation.irregularity import Assumed, irregularity

__all__ = ["Assumed", "Irregularity", "irregularity"]
