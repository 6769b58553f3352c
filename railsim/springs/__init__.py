"""Coil springs and the trailing-arm primary suspension.

=================  ==============================================================================
module             job
=================  ==============================================================================
helical            stiffness of one helical spring; the vehicle models use it too.  Begin here
arm                an axlebox arm on concentric springs: equilibrium, energy, all loads at once
design             the inverse: stiffnesses from two wanted deflections; why there are none
checks             solid height, stresses, Goodman-Smith line: pure functions
verification       a file's suspension under all its loads, against all limits; fatigue
datasheet          data sheet of each spring: mass, surge frequency, stresses, lateral stiffnesses
nests              thousands of nests in one call: what they do, how far from each limit
search             feasible nests ranked by mass or fatigue margin, with the limits that are active
tolerance          scatter of the ride height from wire, coils, heights, material, bush
vehicle_table      the suspension as a part of a vehicle file
summary            results as plain numbers by name: ``--json``
tables             results as texts in the field's units: for the terminal and the page
=================  ==============================================================================

`railsim.definitions.spring` is the file format, `railsim.plot.springs` draws,
`railsim.report.springs` writes the page, `railsim.cli.spring` holds the commands.
"""
