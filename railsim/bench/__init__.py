"""The runtime benchmark: what `railsim bench` measures on this machine.

machine.py  hardware and versions
runs.py     the runs that are timed: speed of the time loop, error against RK4 at 0.125 ms

Times are CPU times of the process.  Parts of a step, two cores, whole commands and other programs
are measured by the scripts in `benchmarks/`.
"""
