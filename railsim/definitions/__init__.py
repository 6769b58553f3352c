"""What a user may write: frozen, typed, validated definitions in SI units.

Begin with `loading` (from a file to a definition), then read `vehicle` and `track`.

=============  ==================================================================================
module         job
=============  ==================================================================================
base           the common base class and the number types
file_definition  definitions that fill a file: what is checked, changed, written
registry       kinds of a thing, one module each
elements       force elements of a vehicle, a package
excitations    irregularities of a track, a package
vehicle_tables, vehicle  vehicle files: bodies, wheelsets, elements, assemblies
names          which body a name means where it stands
flatten        assemblies placed and mirrored, names resolved: the vehicle as plain lists
out_of_round   wheels that are not round
check_rail     check rails and guard rails
rail_sections  rails whose section changes along the track
section_files  lists of sections along a rail or around a wheel, their files
track_tables, track  track files: plan, cant, vertical profile, rails, friction
section, rounded_profile  elements of a track as linear functions, and rounded
layout, alignment_rules  track elements to values over arc length; what an engineer objects to
settings       settings files: how to compute, not what
study, design, analyses, scenario  studies and campaigns
spring, mechanism*  design tools
mirror         mirror images of vehicles and tracks
paths          dotted paths into nested tables
sources        finding files, TOML, `extends`; remembers which file each key came from
overrides      ``--set key.path=value``
loading        files to definitions
faults         wrong values in the words of a user
schema         JSON Schemas and the manual's key tables
creep_law      the creep laws: names, numbers, labels
=============  ==================================================================================
"""
