"""Runs and studies that are killed at any moment: whole results, or none; the rest is swept.

The moments are shares of the CPU time that the command takes when nobody disturbs it, so that they
fall into the same stages of its work on a slow machine, and on one that others use as well.
"""

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from cases import MORE, tried

from railsim.cli import main
from railsim.files.access import sweep
from railsim.result import check_result

sys.path.append(str(Path(__file__).parents[1] / "interface"))
from started import started

# two kills in five: 100 of 250, and 150 signals
SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGHUP)
WHAT = ["coach_manchester", "curve_r250", "--speed", "20", "--until", "150", "--quiet"]
STUDY = ["--vehicles", "coach_manchester", "--tracks", "curve_r250", "--until", "150", "--quiet"]
TICK = os.sysconf("SC_CLK_TCK")
# a process that has not ended by now never will: a second is usual, and one that does not answer
# is ended after eight (`railsim.cli.interrupts.PATIENCE`); others may use the machine as well
NEVER = 600.0


def cpu_time(process):
    """CPU time of a process so far [s]; None when it has ended."""
    try:
        facts = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return None if facts[0] == "Z" else (int(facts[11]) + int(facts[12])) / TICK


def undisturbed(command):
    """Let a command end; return its CPU time, without that of other processes [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = started(command)
    seen = 0.0
    while (now := cpu_time(process)) is not None:
        seen = now
        time.sleep(0.01)
    process.communicate()
    assert process.returncode == 0
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert seen <= after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime + 0.1
    return seen


def killed(command, kind, moment):
    """Send a signal at a moment of CPU time; return status, errors, and how long the end took."""
    process = started(command)
    while (now := cpu_time(process)) is not None and now < moment:
        time.sleep(0.005)
    if process.poll() is None:
        os.kill(process.pid, kind)
    begin = time.perf_counter()
    # the standard error is open for as long as a process of a study lives
    _, errors = process.communicate(timeout=NEVER)
    assert "Traceback" not in errors, errors
    assert process.returncode in (0, -kind, 128 + kind), errors
    return process.returncode, time.perf_counter() - begin


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Undisturbed run and study: their CPU times and results."""
    folder = tmp_path_factory.mktemp("whole")
    run = ["run", *WHAT, "--overwrite", "--out", folder / "run.h5"]
    study = ["study", *STUDY, "--speeds", "20", "21", "--out", folder / "study", "--overwrite"]
    assert main([str(word) for word in run]) == 0  # compiles and builds tables, if need be
    times = undisturbed(run), undisturbed([*study, "--workers", "2"])
    results = {path.name: check_result(path) for path in (folder / "study").glob("*.h5")}
    return *times, {"run.h5": check_result(folder / "run.h5"), **results}


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="CPU times are read from /proc")
def test_killed_runs_and_studies(whole, tmp_path):
    run_time, study_time, results = whole
    ends = []

    def same(path):
        np.testing.assert_array_equal(check_result(path).Q, results[path.name].Q)

    def run(folder, kind, moment):
        command = ["run", *WHAT, "--out", folder / "run.h5"]
        status, took = killed(command, kind, moment * run_time)
        ends.append(took)
        left = set(os.listdir(folder))
        assert kind == signal.SIGKILL or left <= {"run.h5"}
        sweep(folder)
        # a signal may come when the result has its name already
        assert set(os.listdir(folder)) <= {"run.h5"}
        assert status != 0 or (folder / "run.h5").exists()
        for path in folder.glob("*.h5"):
            same(path)

    def study(folder, kind, moment):
        command = ["study", *STUDY, "--speeds", "20", "21", "--out", folder, "--workers", "2"]
        _, took = killed(command, kind, moment * study_time)
        ends.append(took)
        for path in folder.glob("*.h5"):
            same(path)
        again = ["study", *STUDY, "--speeds", "20", "21", "--out", folder, "--workers", "1"]
        assert main([str(word) for word in again]) == 0
        names = {name for name in results if name != "run.h5"}
        index = {"study.json", "study.journal", "summary.csv"}
        assert set(os.listdir(folder)) == names | index
        for name in names:
            same(folder / name)

    def case(seed):
        kind = SIGNALS[seed % len(SIGNALS)]
        # Python's own start is the first tenth
        moment = np.random.default_rng(seed).uniform(0.1, 1.05)
        folder = tmp_path / str(seed)
        folder.mkdir()
        (study if seed // len(SIGNALS) % 4 == 3 or seed == 2 else run)(folder, kind, moment)

    tried(3, case)
    if MORE:
        print(f"\nslowest end after a signal: {max(ends):.2f} s", file=sys.__stderr__)


DESIGNS = """
format = "railsim-study/1"
name = "eight designs, one second each"
vehicles = ["coach_manchester"]
tracks = ["straight"]
speeds = [20.0]
duration = 1.0

[optimise.variables]
"vehicle.assemblies.bogie.elements.secondary_lateral_damper.damping" = { low = 2e4, high = 4e4 }

[[optimise.objectives]]
quantity = "Q_peak"
"""
CONTINUED = {
    "designs.csv": ["optimise", "designs.toml", "--evaluations", "8", "--workers", "1"],
    "wear.json": ["wear", "coach_manchester", "--route", "straight", "20", "1",
                  "--distance", "2", "--step", "1"],
    "critical_speed.json": ["critical-speed", "coach_manchester", "--method", "linear",
                            "--conicity", "0.1:0.3:2", "--from", "20", "--to", "60"],
}  # fmt: skip


@pytest.mark.further
@pytest.mark.parametrize("file", CONTINUED)
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="CPU times are read from /proc")
def test_killed_search_wear_and_map_go_on_to_the_same_end(file, tmp_path, monkeypatch):
    """The same command again computes the rest; the end is that of an undisturbed command."""
    monkeypatch.chdir(tmp_path)
    Path("designs.toml").write_text(DESIGNS)
    command = [*CONTINUED[file], "--quiet", "--out"]
    assert main([*command, "compiled"]) == 0
    whole = undisturbed([*command, "whole"])
    expected = (Path("whole") / file).read_bytes()

    def case(seed):
        moment = np.random.default_rng(seed).uniform(0.1, 1.0)
        killed([*command, f"case{seed}"], SIGNALS[seed % len(SIGNALS)], moment * whole)
        found = tmp_path / f"case{seed}" / file
        if not found.exists():  # else the signal came at the very end
            assert main([*command, f"case{seed}"]) == 0
        assert found.read_bytes() == expected

    tried(2, case)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="CPU times are read from /proc")
def test_signal_is_obeyed_while_python_cannot(tmp_path):
    """As while the time loop is compiled: one call outside Python that takes minutes."""
    program = (
        "import sys, hashlib, click; from pathlib import Path; import railsim.cli as cli;"
        "import railsim.cli.interrupts as interrupts; from railsim.files.access import PartialFile;"
        "interrupts.PATIENCE = 0.5;"
        "partial = PartialFile(Path(sys.argv[1]));"
        "cli._call = lambda _: print('begun', flush=True)"
        " or hashlib.pbkdf2_hmac('sha256', b'', b'', 10**9);"
        "sys.exit(cli.main([]))"
    )
    for kind, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)):
        process = subprocess.Popen(
            [sys.executable, "-c", f"import signal; {ALLOWED}{program}", str(tmp_path / "run.h5")],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert process.stdout.readline() == "begun\n"
        # before the call Python would hear it itself: wait until the process is within it
        begin = cpu_time(process)
        while cpu_time(process) < begin + 0.1:
            time.sleep(0.01)
        os.kill(process.pid, kind)
        _, errors = process.communicate(timeout=NEVER)
        assert process.returncode == status
        assert errors.startswith("railsim: ")
        assert errors.count("\n") == 1
        assert os.listdir(tmp_path) == []


def test_end_that_hangs_is_ended_and_a_second_signal_does_not_disturb_it():
    """As where a thread of a pool waits for a lock for ever: Python waits for it before it ends."""
    program = (
        "import atexit, sys, time; import railsim.cli as cli;"
        "import railsim.cli.interrupts as interrupts; interrupts.PATIENCE = 2.0;"
        "atexit.register(time.sleep, 600);"
        "cli._call = lambda _: print('begun', flush=True) or time.sleep(600);"
        "sys.exit(cli.main())"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", f"import signal; {ALLOWED}{program}"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    assert process.stderr.readline() == "railsim: interrupted\n"
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=NEVER)
    assert process.returncode == 130
    assert errors == "railsim: interrupted\n"  # by what ends it


# a shell that starts the tests in the background has them ignore Ctrl-C, nohup the hang-up
ALLOWED = (
    "signal.signal(signal.SIGINT, signal.default_int_handler);"
    "signal.signal(signal.SIGHUP, signal.SIG_DFL);"
)
