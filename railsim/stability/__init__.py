"""Non-linear stability: periodic motions and their branches, ramps of speed, curving on grids.

=====================  ==============================================================
`critical_speed`       from which speed a vehicle hunts, by the modules below
`result`, `branches`   what it returns; branches of motions over speed
`motion`               stretches of time
`ramp`, `diagram`      ramps of speed and bifurcation diagrams
`periodic`             periodic motions by shooting, followed by arc length
`continuation`         branches of a vehicle followed so
`vehicle_flow`         the time loop as the flow of such motions
`curving`              steady curving on a grid, by Newton's method or in time
=====================  ==============================================================
"""
