"""The track as functions and tables over arc length.

=============  ==================================================================================
module         job
=============  ==================================================================================
alignment      plan, cant and vertical profile, rounded: exact functions of the arc length
curves         circular curves: equilibrium speed, cant deficiency
irregularity   displacements of the rails: sum of the irregularities, gauge widening
tables         all of it as piecewise cubic tables for the compiled kernels
=============  ==================================================================================
"""
