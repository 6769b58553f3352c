"""Studies: every combination of vehicles, tracks, speeds and further values, one file per run.

==================== ========================================================================
`spec.py`            `RunSpec`, `StudySpec`, `Execution`: what is asked for, by whomever
`case.py`            `Case`: all inputs of one run, loaded, with its name and its key; its run
`rows.py`            values of grids, linked keys and samples
`plan.py`            `Plan`: from a study to points and cases; all faults are reported together
`execute.py`         cases over processes or a dask cluster
`records.py`         records of finished work as JSON, with checksums
`journal.py`         finished runs, one line per run, appended
`user_function.py`   user-defined quantities by a Python function
`summary.py`         ``summary.csv`` and ``study.json``
`study.py`           `study`: from inputs, files or definitions, to a plan, which is carried out
`carry_out.py`       `carry_out`: which runs are done; computes the missing ones, with the journal
`outcome.py`         `Outcome`: summary and results of a folder
`gathered.py`        runs from result files and from folders of studies
`comparable.py`      which results are compared with each other
`columns.py`         what runs have, by column: parameters that differ, values of the summary
`inputs.py`          vehicles, tracks and settings of runs, and units of what was varied
`picture.py`         the picture of a study: values over what was varied
`analyses.py`        analyses at a point besides a run: curving, critical speed, modes
`optimise.py`        `optimise`: objectives, constraints, the design that is chosen
`designs.py`         designs evaluated by a study
`search.py`          search methods; Pareto fronts
`sensitivity.py`     sensitivity of objectives and constraints to the variables
`campaign.py`        a scenario for vehicles: all its runs, and their assessment
`assess_track.py`    a recorded track judged by vehicles
`geometry_limits.py` a recorded track judged by its geometry
`stability_map.py`   critical speeds over parameters
`wear_loop.py`       wear of wheels over the distance, with an update of the profiles
`rail_wear.py`       wear of rails over the tonnage of a mix of traffic
`stationary.py`      stationary tests on twisted and canted track, with limits
`worker.py`          imported by the server of the processes
==================== ========================================================================

Begin reading in `study.py`.
"""
