"""Non-linear stability: periodic motions and their branches, ramps of speed, curving on grids.

=====================  ==============================================================
`critical_speed`       from which speed a vehicle hunts, by the rooms below
`motion`, `ramp`       stretches of time; ramps of speed and bifurcation diagrams
`periodic`             periodic motions by shooting, followed by arc length
`vehicle_flow`         the time loop as the flow of such motions
`conicity`             equivalent conicity over amplitude, to read diagrams by
`curving`              steady curving on a grid, by Newton's method or in time
=====================  ==============================================================
"""
