"""Value and slope of a table against numpy's interpolation; the kernel as plain Python."""

import os
import subprocess
import sys

PROGRAM = """
import numpy as np
from railsim.kernels.driving import table_value_slope
table = np.array([[2.0, 5.0], [3.5, -1.0], [4.0, 7.0], [9.0, 6.0]])
for x in np.linspace(0.05, 11.05, 111):
    value, slope = table_value_slope(table, x)
    expected = [np.interp(at, *table.T) for at in (x - 1e-6, x, x + 1e-6)]
    np.testing.assert_allclose(value, expected[1], atol=1e-12)
    np.testing.assert_allclose(slope, (expected[2] - expected[0]) / 2e-6, atol=1e-6)
for x, found in ((2.0, (5.0, -4.0)), (3.5, (-1.0, 16.0)), (9.0, (6.0, 0.0))):  # at rows
    assert table_value_slope(table, x) == found
assert table_value_slope(table[:1], 3.0) == (5.0, 0.0)
"""


def test_table_is_linear_between_its_rows_and_constant_beyond():
    plain = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=plain, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
