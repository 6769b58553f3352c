"""Parameters of a model from measured runs, and derivatives of runs.

=================  =============================================================================
`fit.py`           `identify`: least squares over measured runs
`identified.py`    `Identified`: values, covariance, combinations, residuals, vehicle file
`parameters.py`    keys of a model with factors, shares of a second wheel profile
`runs.py`          measured runs made ready, and simulated at the same places
`residuals.py`     histories, spectra or section values as residuals; whiteness
`problem.py`       residuals and derivatives of all runs, over the cores
`derivatives.py`   `sensitivity`: derivatives of histories and values with their accuracy
=================  =============================================================================
"""

from railsim.identification.derivatives import Sensitivity, sensitivity
from railsim.identification.fit import identify
from railsim.identification.identified import Identified
from railsim.identification.parameters import Parameter

__all__ = ["Identified", "Parameter", "Sensitivity", "identify", "sensitivity"]
