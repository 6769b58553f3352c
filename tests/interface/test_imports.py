"""What commands import: a start should cost what the command does."""

import json
import subprocess
import sys

import example_result
import pytest

PROBE = """
import json, sys
from railsim.cli import main
for missing, command in json.loads(sys.argv[1]):
    assert main(command) == 0, command
    heavy = {name for name in missing.split() if name in sys.modules}
    assert not heavy, (command, sorted(heavy))
"""
PICTURES = "matplotlib plotly pandas"
SCIPY = "scipy.fft scipy.interpolate scipy.optimize scipy.signal scipy.sparse scipy.stats"
NOTHING_COMPILED = f"{PICTURES} {SCIPY} numba scipy"


RUN = ["run", "coach_manchester", "curve_r250", "--speed", "20", "--until", "5"]


@pytest.mark.parametrize(
    "commands",
    [
        [
            (
                f"{NOTHING_COMPILED} railsim.definitions.mechanism.definition",
                ["info", "coach_manchester"],
            ),
            (NOTHING_COMPILED, ["list"]),
            (NOTHING_COMPILED, ["info", "curve_r250"]),
            (NOTHING_COMPILED, ["compare", "result.h5", "other.h5"]),
        ],
        [
            (NOTHING_COMPILED, ["info", "result.h5"]),
            (f"{SCIPY} numba scipy pandas railsim.model railsim.studies", ["plot", "result.h5"]),
        ],
        [
            (
                f"{PICTURES} {SCIPY} railsim.report railsim.assessment railsim.stability"
                " railsim.studies.execute railsim.studies.summary",
                RUN,
            )
        ],
    ],
    ids=["definitions", "result", "run"],
)
def test_commands_import_nothing_that_they_do_not_use(commands, tmp_path):
    """Given one after the other, those first that need the least."""
    for name in ("result.h5", "other.h5"):
        example_result.example_result().to_hdf5(tmp_path / name)
    command = [sys.executable, "-c", PROBE, json.dumps(commands)]
    subprocess.run(command, cwd=tmp_path, check=True)
