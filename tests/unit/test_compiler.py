"""Without numba's private parts: the same numbers, by numba's public means."""

import os
import subprocess
import sys

import numpy as np
import pytest

PROGRAM = """
import sys
import numpy as np
from railsim.kernels import compiled, compiler
from railsim.kernels.cube_root import cube_root
from railsim.kernels.lanes import LANES, lane_numbers, load_rows, row_starts, store_rows

assert compiler.PRIVATE == (sys.argv[1] == "0")

@compiled
def formula(table, out, n):
    for first in range(0, n, LANES):
        rows = row_starts(lane_numbers(first, n), 3)
        a, b, c = load_rows(table, rows, 0, 3)
        store_rows(out, rows, 0, (a * b - 2.0 * c, -a / b + 1, (a - b) * c))

table = np.arange(1.0, 34.0).reshape(11, 3)
out = np.zeros_like(table)
formula(table, out, 11)
roots = np.array([cube_root(x) for x in range(1, 9)])
np.save(sys.argv[2], np.concatenate((out.ravel(), roots)))
"""


@pytest.mark.slow
def test_public_means_of_numba_give_the_same_numbers(tmp_path, monkeypatch):
    found = []
    for plain in ("0", "1"):
        file = tmp_path / f"{plain}.npy"
        if plain == os.environ.get("RAILSIM_PLAIN_NUMBA", "0"):  # as this process has it
            monkeypatch.setattr(sys, "argv", ["-c", plain, str(file)])
            exec(PROGRAM, {"__name__": "__main__"})
        else:
            subprocess.run(
                [sys.executable, "-c", PROGRAM, plain, str(file)],
                env=os.environ | {"RAILSIM_PLAIN_NUMBA": plain, "RAILSIM_CACHE_DIR": str(tmp_path)},
                check=True,
            )
        found.append(np.load(file))
    private, public = found
    table = np.arange(1.0, 34.0).reshape(11, 3)
    a, b, c = table.T
    expected = np.stack((a * b - 2.0 * c, 1.0 - a / b, (a - b) * c), axis=1)
    np.testing.assert_allclose(private[: table.size], expected.ravel(), rtol=1e-14)
    np.testing.assert_allclose(public, private, rtol=1e-13)
