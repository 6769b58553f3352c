"""Files: read within bounds, layered, addressed by keys, and written whole or not at all.

`access` reads and writes; `sources` finds definition files and lays `extends` over each other,
remembering which file each key came from; `key_paths` and `overrides` reach into their tables.
"""
