"""Pictures of results and tracks.

=================  ==========================================================================
`style.py`         what all pictures share: colours, fonts, the shading of curves
`selection.py`     which quantities and labels to draw: ``Q``, ``Y:1:left``
`histories.py`     quantities over time or distance
`overlay.py`       the same quantities of several results in one picture
`track.py`         a track: plan, curvature and cant
`vehicle.py`       a vehicle: side, top and front view with its elements
=================  ==========================================================================

Every function returns a `matplotlib.figure.Figure` that is not shown anywhere; `save` writes it.
"""
