"""Non-linear stability: periodic motions and their branches, ramps of speed, curving on grids.

=====================  ==============================================================
`periodic`             periodic motions by shooting, followed by arc length
=====================  ==============================================================
"""
