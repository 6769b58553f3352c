"""Wheel-rail contact: geometry, normal contact, tables for the time integration.

=========== ====================================================================
module      job
=========== ====================================================================
`hertzian`  elliptic Hertz contact, exact
`curves`    profiles placed on axle and track, with slopes and averaged curvatures
`conicity`  equivalent conicity of EN 15302
`geometry`  rigid contact functions of a wheelset
`table`     the contact table: generator, cache on disk
=========== ====================================================================

Read `table` first: it says what the simulation takes from this package.
"""

from railsim.contact.conicity import equivalent_conicity
from railsim.contact.geometry import ContactGeometry, contact_geometry
from railsim.contact.hertzian import HertzContact, hertz
from railsim.contact.table import ContactTable, build_contact_table, cached_contact_table

__all__ = [
    "ContactGeometry",
    "ContactTable",
    "HertzContact",
    "build_contact_table",
    "cached_contact_table",
    "contact_geometry",
    "equivalent_conicity",
    "hertz",
]
