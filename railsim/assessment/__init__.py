"""Assessment of results: estimates, limits, verdict.

=====================  =====================================================================
`assess.py`            `assess`: all runs of a vehicle to one `Assessment`
`assessment.py`        `Assessment`: what was found
`running.py`           running tests: runs, populations, zones, verdicts
`record.py`            a result read as a measured record, part by part
`sections.py`          test sections and zones of the track that a run covers
`criteria.py`          the assessed quantities, a row each: signal, filter, value, verdict
`signals.py`           filtered signals of a part of a run
`en14363.py`           section values of EN 14363 and UIC 518
`statistics.py`        one- and two-dimensional estimates
`zones.py`             section values of a population to estimates and limits
`conditions.py`        conditions of the test: met, not met, not checked
`verdict.py`           running safety, track loading, ride: verdicts with reasons
`influences.py`        for information: multiple regression
`track_quality.py`     standard deviations of the track irregularities along a run
`weighting.py`         frequency weightings Wb, Wc, Wd, Wk
`comfort.py`           EN 12299, ISO 2631-1, P_CT, P_DE
`sperling.py`          Sperling's index
`comfort_report.py`    comfort at all measuring points of a run
`wear.py`              laws of wear and rolling contact fatigue
`wear_depth.py`        depth over the profiles of wheels and rails, worn profiles
`wear_report.py`       wear and fatigue at all wheels of a run
`safety.py`            Nadal, climb distance, overturning: formulas, and over a run
`tables.py`            assessments as tables
=====================  =====================================================================

The package only reads results; it starts no runs.  Limits are data files, ``limits/*.toml``.
Begin reading in `assess.py`.
"""

from railsim.assessment.assess import assess
from railsim.assessment.assessment import Assessment

__all__ = ["Assessment", "assess"]
