"""Self-contained pages about results.

===============  =======================================================================
`write.py`       `write_report`: one page about whatever files and folders hold
`runs.py`        runs and studies: inputs, comparison with limits, curves, spread
`measured.py`    comparisons with tests, identifications, wear: from their records
`springs.py`     a trailing-arm suspension: inputs, load cases, checks, pictures
`mechanisms.py`  a planar linkage: player, results, search, pictures, animation
===============  =======================================================================
"""
