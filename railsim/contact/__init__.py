"""Wheel-rail contact: geometry, normal contact, tables for the time integration.

============= ==================================================================
module        job
============= ==================================================================
`hertzian`    elliptic Hertz contact, exact
`curves`      profiles placed on axle and track, with slopes and averaged curvatures
`conicity`    equivalent conicity of EN 15302
`geometry`    rigid contact functions of a wheelset
`table`       the contact table: generator, cache on disk
`kalker`      creepage coefficients of linear theory
`creep`       creep force by every law, for scripts and plots
`exact_creep` full half-space theory of rolling, with traction and slip
`creep_table` its table for the time loop: generator and data
============= ==================================================================

Read `table` first: it says what the simulation takes from this package.
"""

from railsim.contact.conicity import equivalent_conicity
from railsim.contact.creep import CreepForce, creep_force
from railsim.contact.exact_creep import ExactCreepForce, exact_creep_force
from railsim.contact.geometry import ContactGeometry, contact_geometry
from railsim.contact.hertzian import HertzContact, hertz
from railsim.contact.table import ContactTable, build_contact_table, cached_contact_table

__all__ = [
    "ContactGeometry",
    "ContactTable",
    "CreepForce",
    "ExactCreepForce",
    "HertzContact",
    "build_contact_table",
    "cached_contact_table",
    "contact_geometry",
    "creep_force",
    "equivalent_conicity",
    "exact_creep_force",
    "hertz",
]
