"""Self-contained pages about results.

=============  =========================================================================
`springs.py`   a trailing-arm suspension: inputs, load cases, checks, pictures
=============  =========================================================================
"""
