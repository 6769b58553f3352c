"""The runtime benchmark: what `railsim bench` measures on this machine.

machine.py    hardware, versions, and whether the machine is quiet enough for what is measured
scenarios.py  the runs that are timed
runs.py       speed of the time loop, each with its error against RK4 at 0.125 ms; two cores
ensembles.py  many runs per call
loops.py      compiled loops over parts of the right-hand side
parts.py      time per right-hand side and per part, FASTSIM over its grid, table look-up
commands.py   start-up cold and warm, whole commands, peak memory
report.py     everything together, as numbers and as text

Times are CPU times of the process where one process computes, and the least of many repetitions
where a part takes microseconds: what another program takes from the machine only adds to a time.
"""
