"""The model of a vehicle on its track: from definitions to arrays, at rest, and its longest step.

- `assembly`: definitions to the arrays of `railsim.kernels.system`, names to numbers
- `element_arrays`: force elements as rows of these arrays
- `equilibrium`: preloads, static wheel loads, steady rolling on straight level track
- `plausibility`: remarks on vehicles unlike those that railways have
- `solutions`: equilibria and stable steps that were found before, from the disk
- `statics`: wheel loads and preloads at rest, as an object that shows itself
- `time_step`: the longest stable step
"""
