"""What a user may write: frozen, typed, validated definitions in SI units.

Begin with `loading` (from a file to a definition), then read `vehicle` and `track`.

=============  ==================================================================================
module         job
=============  ==================================================================================
base           the common base class and the number types
elements       force elements of a vehicle
vehicle        vehicle files: bodies, wheelsets, axleboxes, elements, assemblies
names          which body a name means where it stands
flatten        assemblies placed and mirrored, names resolved: the vehicle as plain lists
track          track files: plan, cant, vertical profile, rails, friction
irregularity   track files: measured, single and random irregularities
layout         track elements to values over arc length; what an engineer objects to
measured       CSV files of measured irregularities
settings       settings files: how to compute, not what
spring         spring files: trailing-arm suspension
mirror         mirror images of vehicles and tracks
paths          dotted paths into nested tables
sources        finding files, TOML, `extends`; remembers which file each key came from
overrides      ``--set key.path=value``
loading        files to definitions with every fault at once
faults         wrong values in the words of a user
schema         JSON Schemas and the manual's key tables
creep_law      the creep laws: names, numbers, labels
offered        what a definition offers but modules built on the definitions do
=============  ==================================================================================
"""

from railsim.definitions import loading

__all__ = ["loading"]
