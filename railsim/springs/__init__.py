"""Coil springs and the trailing-arm primary suspension.

`helical`    stiffness of one helical spring; the vehicle models use it too.  Begin here.
`arm`        an axlebox arm on two concentric springs: equilibrium, energy, all loads at once
`design`     the inverse: spring stiffnesses from two wanted deflections; why there are none
`checks`     solid height, yield, buckling, fatigue with the Goodman-Smith margin
`search`     feasible nests ranked by mass or fatigue margin, with the limits that are active
`tolerance`  scatter of the ride height from the scatter of wire, coils, height and material
"""
