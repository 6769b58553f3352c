"""Killed in the middle (SIGKILL), the same command again: finished runs stay, the answer is one."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from test_identification import DAMPER, FACTORS, PRIMARY, SECONDARY, measured, quarter

import railsim
from railsim.track.irregularity import displacement

pytestmark = pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
PATIENCE = 300.0  # s


def command(*arguments):
    own = [sys.executable, "-m", "railsim", *map(str, arguments), "--quiet"]
    return subprocess.Popen(own, stdout=subprocess.DEVNULL, start_new_session=True)


def killed(process, ready):
    """Kill a command and its workers as soon as something is ready."""
    until = time.monotonic() + PATIENCE
    while not ready() and process.poll() is None and time.monotonic() < until:
        time.sleep(0.01)
    assert process.poll() is None, "the command ended before it was killed"
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def finished(*arguments):
    assert command(*arguments).wait(PATIENCE) == 0


def stamps(folder, pattern):
    return {path.name: path.stat().st_mtime_ns for path in folder.glob(pattern)}


@pytest.mark.further
def test_assess_track(tmp_path):
    track = railsim.load_track("straight").replace(
        irregularities=[{"type": "random", "spectrum": "erri_b176_low", "wavelengths": [3.0, 70.0]}]
    )
    s = np.arange(0.0, 700.0, 0.25)
    head = "s_m,y_left_mm,z_left_mm,y_right_mm,z_right_mm"
    rails = 1e3 * displacement(track)(s)[0].T
    recording = tmp_path / "line.csv"
    np.savetxt(recording, np.c_[s, rails], delimiter=",", header=head, comments="", fmt="%.6g")
    asked = [
        "assess-track",
        recording,
        "--vehicles",
        "coach_manchester",
        "--speeds",
        20,
        25,
        30,
        35,
    ]
    asked += ["--share", 0.3, "--workers", 1, "--resume", "--out"]
    one, two = tmp_path / "one", tmp_path / "two"
    journal = one / "study.journal"
    killed(command(*asked, one), lambda: journal.is_file() and journal.read_text().count("\n") >= 3)
    before = stamps(one, "*.h5")
    complete = [line.split("\t")[1] for line in journal.read_text().splitlines()[1:]]
    kept = {json.loads(line)["name"] + ".h5" for line in complete}
    assert 1 <= len(kept) < 4
    finished(*asked, one)
    after = stamps(one, "*.h5")
    assert len(after) == 4
    assert all(after[name] == before[name] for name in kept)
    finished(*asked, two)
    for name in ("places.csv", "sections.csv"):
        assert (one / name).read_text() == (two / name).read_text()


@pytest.mark.further
def test_identify(tmp_path):
    path = measured(tmp_path, quarter(), FACTORS)
    (tmp_path / "quarter.toml").write_text(quarter().to_toml())
    asked = ["identify", tmp_path / "quarter.toml", path, "-p", f"{PRIMARY},{DAMPER},{SECONDARY}"]
    asked += ["--band", "0.5:14", "--workers", 1, "--out"]
    one, two = tmp_path / "one", tmp_path / "two"
    kept = one / "evaluations"
    killed(command(*asked, one), lambda: kept.is_dir() and len(list(kept.iterdir())) >= 3)
    before = len(stamps(kept, "*"))
    finished(*asked, one)
    finished(*asked, two)
    a, b = (json.loads((out / "identified.json").read_text()) for out in (one, two))
    assert a["parameters"] == b["parameters"]
    assert a["simulations"] <= b["simulations"] - before + 1
