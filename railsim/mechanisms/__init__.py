"""Planar linkages with one degree of freedom: a design tool that stands alone, without a train.

=================  ====================================================================
module             job
=================  ====================================================================
`analysis`         everything that a file asks for: `analyse` returns an `Analysis`
`outputs`          named results at positions of the driver, positions that are asked for
`contact`          positions of rest, static contact force
`optimisation`     search for parameters under constraints: `optimise`
`tolerance`        what tolerances of the parameters do
`model`            from the file to the arrays of `kernels.linkage`
`assembly`         assembly by least squares, the loop that cannot close
`kinematics`       positions along the driver, with exact derivatives by parameters
`cams`             transitions of a roller from arc to arc, every arc alone
`inversion`        the driver's value at a height, a length, without a force
`links`            angles, speeds and accelerations of every link and actuator
`forces`           virtual work, inertia, unknown forces, reactions of the joints
`dynamics`         motion laws and free motion
`components`       gas spring, air spring, cylinder
`checks`           values against their limits
`remarks`          rules of thumb, narrow margins
`selection`        catalogues
`comparison`       several mechanisms at equal output
`targets`          positions and ratios of a reference
`judgement`        objective and constraints with exact gradients
`optimum`          what a search found, the file that it writes
`drawing`          lines and points for pictures
`summary`          results as plain numbers, for ``--json``
`tables`           results as texts, for the terminal and the page
`quantities`       names and units of the results
=================  ====================================================================
"""
