"""Runs that are killed at any moment: a whole result, or none; and what is left is swept."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from cases import number

from railsim.files import sweep
from railsim.result import check_result

sys.path.append(str(Path(__file__).parents[1] / "interface"))
from started import started

SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.mark.slow
def test_killed_runs(tmp_path):
    path = tmp_path / "run.h5"
    begin = time.perf_counter()
    given = ["run", "coach_manchester", "curve_r250", "--speed", "20", "--until", "300"]
    given += ["--quiet", "--overwrite", "--out", path]
    assert started(given).wait(timeout=300) == 0
    whole, took = check_result(path), time.perf_counter() - begin
    for seed in range(number(4)):
        path.unlink(missing_ok=True)
        moment = np.random.default_rng(seed).uniform(0.1, 1.05) * took
        kind = SIGNALS[seed % len(SIGNALS)]
        process = started(given)
        try:
            process.wait(timeout=moment)
        except subprocess.TimeoutExpired:
            os.kill(process.pid, kind)
        # Ctrl-C and the like are obeyed within ten seconds of a busy machine
        _, errors = process.communicate(timeout=60)
        assert "Traceback" not in errors, errors
        if process.returncode == 0:
            np.testing.assert_array_equal(check_result(path).Q, whole.Q)
        else:
            assert process.returncode in (-kind, 128 + kind), errors
            assert not path.exists()
        left = os.listdir(tmp_path)
        assert kind == signal.SIGKILL or set(left) <= {"run.h5"}
        sweep(tmp_path)
        assert set(os.listdir(tmp_path)) <= {"run.h5"}
