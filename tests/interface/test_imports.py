"""What commands import: a start should cost what the command does."""

import subprocess
import sys

import example_result
import pytest

PROBE = """
import sys
from railsim.cli import main
assert main(sys.argv[2:]) == 0
heavy = {name for name in sys.argv[1].split() if name in sys.modules}
assert not heavy, sorted(heavy)
"""
PICTURES = "matplotlib plotly pandas"
SCIPY = "scipy.fft scipy.interpolate scipy.optimize scipy.signal scipy.sparse scipy.stats"
NOTHING_COMPILED = f"{PICTURES} {SCIPY} numba scipy"


@pytest.mark.parametrize(
    ("missing", "command"),
    [
        (NOTHING_COMPILED, ["list"]),
        (NOTHING_COMPILED, ["info", "curve_r250"]),
        (NOTHING_COMPILED, ["info", "result.h5"]),
        (
            f"{NOTHING_COMPILED} railsim.definitions.mechanism.definition",
            ["info", "coach_manchester"],
        ),
        (f"{SCIPY} numba scipy pandas railsim.model railsim.studies", ["plot", "result.h5"]),
        (
            f"{PICTURES} {SCIPY} railsim.report railsim.assessment railsim.stability"
            " railsim.studies.execute railsim.studies.summary",
            ["run", "coach_manchester", "curve_r250", "--speed", "20", "--until", "5"],
        ),
    ],
    ids=["list", "info-track", "info-result", "info-vehicle", "plot", "run"],
)
def test_command_imports_nothing_that_it_does_not_use(missing, command, tmp_path):
    if "result.h5" in command:
        example_result.example_result().to_hdf5(tmp_path / "result.h5")
    subprocess.run([sys.executable, "-c", PROBE, missing, *command], cwd=tmp_path, check=True)
