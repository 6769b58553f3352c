"""Measured runs: files of a test to arrays over time and arc length.

==================  ============================================================================
`reading.py`        `load_measurement`: a measurement file and its data to a `Measurement`
`columns.py`        columns of CSV, Parquet, MATLAB and HDF5 files, in pieces
`clock.py`          equal time steps, gaps, delays
`position.py`       arc length from mileage, distance or speed
`data.py`           `Measurement`: channels over time, arc length and speed
`alignment.py`      shift and stretch of the arc length by curvature or irregularities
`counterpart.py`    simulated counterparts of the channels
`likeness.py`       measured against simulated: signs, units, clocks, exchanges
==================  ============================================================================
"""

from railsim.measurement.data import Measurement
from railsim.measurement.reading import load_measurement

__all__ = ["Measurement", "load_measurement"]
