"""Self-contained pages about results.

===============  =======================================================================
`springs.py`     a trailing-arm suspension: inputs, load cases, checks, pictures
`mechanisms.py`  a planar linkage: player, results, search, pictures, animation
===============  =======================================================================
"""
