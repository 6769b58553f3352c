"""What a user may write: frozen, typed, validated definitions in SI units.

Begin with `loading` (from a file to a definition), then read `vehicle` and `track`.

=============  ==================================================================================
module         job
=============  ==================================================================================
base           the common base class and the number types
elements       force elements of a vehicle
vehicle        vehicle files: bodies, wheelsets, axleboxes, elements, assemblies
flatten        assemblies placed and mirrored, names resolved: the vehicle as plain lists
track          track files: plan, cant, vertical profile; what an engineer would object to
settings       settings files: how to compute, not what
sources        finding files, TOML, `extends`, overrides; remembers which file each key came from
loading        files to definitions with every fault at once
=============  ==================================================================================
"""
