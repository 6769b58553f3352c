"""FASTSIM: marches of the compiler and of vector registers, Python and numpy; all one algorithm.

    python benchmarks/fastsim_benchmark.py

Times per patch of ten patches of a curving coach, the least of many repetitions, one core.
"""

import json
from typing import Any

import numpy as np
from loops import many_fastsim_patches
from numpy_fastsim import numpy_patches, plain_python
from parts import PATCHES, least_time, patch_inputs

from railsim.bench.machine import hardware, vector_instructions, versions
from railsim.kernels import compiled
from railsim.kernels import fastsim as module
from railsim.kernels.fastsim import fastsim_workspace

G = 82e9
CELLS = 10


@compiled
def many_marches_plain(work, columns, nx, bounds, n):
    """The march as the compiler vectorises it."""
    for _ in range(n):
        module._march_plain(work, columns, nx, bounds)


@compiled
def many_marches(work, columns, nx, bounds, n):
    """The march that this machine uses."""
    for _ in range(n):
        module._march(work, columns, nx, bounds)


def measure() -> dict[str, Any]:
    """Return times per patch [s] and the largest difference of the forces [mu N]."""
    patches = patch_inputs(PATCHES)
    rows = np.array((*patches[:6], *patches[7:10]))
    a, b, mu_N, c11, c22, c23, xi_x, xi_y, phi = rows
    work = fastsim_workspace(PATCHES, CELLS, CELLS)
    found = {
        "railsim": least_time(
            lambda: many_fastsim_patches(PATCHES, CELLS, CELLS, patches, G, work, 20),
            200,
            20 * PATCHES,
        )
    }
    bounds = 1.0 - (1.0 - (2.0 * np.arange(CELLS) + 1.0) / CELLS) ** 2
    columns = -(-PATCHES * CELLS // 8) * 8
    for name, march in (("march, as used", many_marches), ("march, plain", many_marches_plain)):
        found[name] = least_time(
            lambda march=march: march(work, columns, CELLS, bounds, 20), 200, 20 * PATCHES
        )
    forces = {}

    def in_python() -> None:
        forces["Python"] = np.array(
            [
                plain_python(
                    CELLS, CELLS, *(float(v) for v in row[:6]), G, *(float(v) for v in row[6:])
                )
                for row in rows.T
            ]
        ).T

    def in_numpy() -> None:
        forces["numpy, all patches at once"] = numpy_patches(
            CELLS, CELLS, a, b, mu_N, c11, c22, c23, G, xi_x, xi_y, phi
        )

    def in_numpy_one_by_one() -> None:
        forces["numpy, patch by patch"] = np.concatenate(
            [
                numpy_patches(
                    CELLS,
                    CELLS,
                    *(v[i : i + 1] for v in rows[:6]),
                    G,
                    *(v[i : i + 1] for v in rows[6:]),
                )
                for i in range(PATCHES)
            ],
            axis=1,
        )

    found["Python"] = least_time(in_python, 10, PATCHES)
    found["numpy, patch by patch"] = least_time(in_numpy_one_by_one, 10, PATCHES)
    found["numpy, all patches at once"] = least_time(in_numpy, 50, PATCHES)
    ours = np.array((patches.T_x, patches.T_y))
    difference = {
        name: float(np.max(np.abs(force[:2] - ours) / mu_N)) for name, force in forces.items()
    }
    return {"per_patch": found, "difference": difference}


if __name__ == "__main__":
    facts = {"hardware": hardware() | {"vectors": vector_instructions()}, "versions": versions()}
    print(json.dumps(facts | measure(), indent=2))
