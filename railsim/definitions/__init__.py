"""What a user may write: frozen, typed, validated definitions in SI units.

The three that a run needs are taken from here.  Begin with `loading` (from a file to a
definition), then read `vehicle` and `track`.

=============  ==================================================================================
module         job
=============  ==================================================================================
base           the common base class and the number types
file_definition  definitions that fill a file: what is checked, changed, written
faults         wrong values in the words of a user
elements       force elements of a vehicle, a package
excitations    irregularities of a track, a package
vehicle        vehicle files: bodies, wheelsets, elements, assemblies, load cases, wheels out of
               round, laws of one's own, a package
track          track files: plan, cant, vertical profile, rails, friction, support, check rails,
               sections of rails, a package
study          studies, designs, campaigns, a package
mechanism      planar linkages, a package
spring         coil springs on trailing arms
settings       settings files: how to compute, not what
measurement    measured runs
embedding      files that others name
section_files  lists of profile sections along a rail or around a wheel
own_sections   test sections of the user's own
limits, wear_law, published  limit values, laws of wear, published results, each with its source
mirror         mirror images of vehicles and tracks
creep_law      the creep laws: names, numbers, labels
loading        files to definitions
=============  ==================================================================================
"""

from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle

__all__ = ["Settings", "Track", "Vehicle"]
