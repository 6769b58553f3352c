"""Linearisation, eigenmodes and stationary states: analysis that needs no clock.

=====================  ==============================================================
`system`               a named system x' = f(x, p) and its linearisation
`eigenmodes`           modes, followed over the parameter
`stability_loss`       the parameter at which an oscillation is no longer damped
`coordinates`          the vehicle as such a system, its reference body free
`circle`, `steady`     steady rolling on constant curvature and cant, by Newton
`stationary`           standing on cant and on twisted track
=====================  ==============================================================
"""
