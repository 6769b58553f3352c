"""Wheel-rail contact: geometry, normal contact, tables for the time integration.

============== ==================================================================
module         job
============== ==================================================================
`hertzian`     elliptic Hertz contact, exact
`curves`       profiles placed on axle and track, with slopes and averaged curvatures
`conicity`     equivalent conicity of EN 15302
`geometry`     rigid contact functions of a wheelset
`out_of_round` surfaces of wheels that are not round
`rail_sections` rails whose section changes: parts, blending, contact ahead of the axle
`section_tables` contact tables of such rails
`table`        the contact table: generator, cache on disk
`kalker`       creepage coefficients of linear theory
`creep`        creep force by every law, for scripts and plots
`exact_creep`  full half-space theory of rolling, with traction and slip
`creep_table`  its table for the time loop: generator and data
`creep_curves` creep forces of one patch by every law
`summary`      functions, conicity and loaded patches of a wheelset in one object
`tables`       its tables
`gauges`       gauge values of wheels and wheelsets, with limits
============== ==================================================================

Read `table` first: it says what the simulation takes from this package.  The public names are
loaded when they are first used: a run with cached tables needs no generator.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from railsim.contact.conicity import equivalent_conicity
    from railsim.contact.creep import CreepForce, creep_force
    from railsim.contact.exact_creep import ExactCreepForce, exact_creep_force
    from railsim.contact.geometry import ContactGeometry, contact_geometry
    from railsim.contact.hertzian import HertzContact, hertz
    from railsim.contact.stored_table import cached_contact_table
    from railsim.contact.summary import ContactSummary, contact_summary
    from railsim.contact.table import ContactTable, build_contact_table

_HOMES = {
    "ContactGeometry": "geometry",
    "ContactSummary": "summary",
    "ContactTable": "table",
    "CreepForce": "creep",
    "ExactCreepForce": "exact_creep",
    "HertzContact": "hertzian",
    "build_contact_table": "table",
    "cached_contact_table": "stored_table",
    "contact_geometry": "geometry",
    "contact_summary": "summary",
    "creep_force": "creep",
    "equivalent_conicity": "conicity",
    "exact_creep_force": "exact_creep",
    "hertz": "hertzian",
}

__all__ = [
    "ContactGeometry",
    "ContactSummary",
    "ContactTable",
    "CreepForce",
    "ExactCreepForce",
    "HertzContact",
    "build_contact_table",
    "cached_contact_table",
    "contact_geometry",
    "contact_summary",
    "creep_force",
    "equivalent_conicity",
    "exact_creep_force",
    "hertz",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'railsim.contact' has no attribute '{name}'")
    return getattr(import_module(f"railsim.contact.{_HOMES[name]}"), name)
