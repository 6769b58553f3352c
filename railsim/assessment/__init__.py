"""Assessment: results to estimates against limits and to a verdict.

=====================  =====================================================================
`assess.py`            `assess`: all runs of a vehicle to one `Assessment`
`record.py`            what is read of a result: equal steps, fine enough, part by part
`sections.py`          test sections and zones from the track under a run
`en14363.py`           filters and section values of EN 14363 and UIC 518
`statistics.py`        one- and two-dimensional estimates
`verdict.py`           estimates against limits, zones, verdict
`track_quality.py`     standard deviations of the rails under the run
`weighting.py`         frequency weightings Wb, Wc, Wd, Wk
`comfort.py`           EN 12299, ISO 2631-1, P_CT, P_DE
`sperling.py`          Sperling's index
`comfort_report.py`    comfort at all points of a run
`wear.py`              laws of wear and rolling contact fatigue
`wear_report.py`       wear and fatigue at all wheels of a run
`safety.py`            Nadal, climb distance, overturning
`safety_report.py`     the same over a run
=====================  =====================================================================

It reads results only and runs nothing.  Limits are data files, ``limits/*.toml``.
Begin reading in `assess.py`.
"""

from railsim.assessment.assess import Assessment, assess

__all__ = ["Assessment", "assess"]
