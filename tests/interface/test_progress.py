"""What the user hears while something is prepared: once, and only if it is."""

import time
from types import SimpleNamespace

import pytest

import railsim.identification
from railsim.cli import main, progress
from railsim.errors import input_error
from railsim.kernels import cache
from railsim.simulation.auxiliary_track import DOING
from railsim.simulation.run_progress import RunProgress


@pytest.fixture(autouse=True)
def short_patience(monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE", 0.01)
    monkeypatch.setattr(progress, "_reported", set())


def work(module):
    """Be busy in a module of this name."""
    code = "import time\ntime.sleep(0.2)"
    exec(compile(code, "busy.py", "exec"), {"__name__": module})


@pytest.mark.parametrize(
    ("module", "words"),
    [("numba.core.compiler_machinery", "compiling"), ("railsim.contact.table", "contact table")],
)
def test_the_cause_is_named_once(module, words, capsys):
    for _ in range(2):
        with progress.progress_bar("run", quiet=False):
            work(module)
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert said[0].startswith("preparing: ")
    assert words in said[0]


def test_what_is_not_kept_is_not_said_to_be(capsys, monkeypatch):
    monkeypatch.setitem(cache.notices, "the cache /proc/x is not used, each start compiles", None)
    with progress.progress_bar("run", quiet=False):
        work("railsim.contact.table")
    said = capsys.readouterr().err
    assert "(not kept: there is no folder for it, give one by RAILSIM_CACHE_DIR)" in said


def test_nothing_is_said_where_nothing_is_prepared(capsys):
    with progress.progress_bar("run", quiet=False):
        time.sleep(0.1)
    with progress.progress_bar("run", quiet=False):
        work("numba.core.dispatcher")  # loads what has been compiled
    with progress.progress_bar("run", quiet=True):
        work("numba.core.compiler_machinery")
    assert capsys.readouterr().err == ""


def test_a_log_gets_lines_that_are_a_twentieth_apart(capsys, monkeypatch):
    for between in (60.0, 0.0):
        monkeypatch.setattr(progress, "BETWEEN", between)
        with progress.progress_bar("wear", quiet=False) as show:
            for hundredths in range(11):
                show(0.01 * hundredths)
    assert capsys.readouterr().err.splitlines() == ["wear: 5 %", "wear: 10 %"]


def test_a_line_in_a_log_says_what_is_being_done(capsys, monkeypatch):
    monkeypatch.setattr(progress, "BETWEEN", 0.0)
    with progress.progress_bar("critical speed", quiet=False) as show:
        DOING.info("ramp, method 1 of 3")
        show(0.3)
        DOING.info("")
        show(0.6)
    lines = ["critical speed, ramp, method 1 of 3: 30 %", "critical speed: 60 %"]
    assert capsys.readouterr().err.splitlines() == lines


def test_a_log_gets_a_line_for_every_ten_runs_of_identify(capsys, monkeypatch):
    def counting(*_, progress, **__):
        for count in range(1, 26):
            progress(count)
        raise input_error("run", "nothing", "something")

    monkeypatch.setattr(railsim.identification, "identify", counting)
    assert main(["identify", "coach_25t", "run.toml", "-p", "bodies.carbody.mass"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert said[:2] == ["10 runs simulated", "20 runs simulated"]
    assert len(said) == 3


def record(number, status="complete", value=1e3):
    peaks = [{"quantity": "sum_Y", "kind": "abs", "value": value}]
    remarks = [f"hunts at {number} Hz", "is too long"]
    return {"name": f"run{number}", "status": status, "status_reason": "off its rails",
            "peaks": peaks, "remarks": remarks}  # fmt: skip


def test_ten_runs_share_a_line_in_large_studies(capsys):
    lines = progress.RunLines()
    for number in range(1, 46):
        lines(record(number, "derailed" if number == 33 else "complete", value=-1e3 * number))
    lines.end()
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == 20 + 1 + 3 + 2
    assert printed[0] == "run1  complete  sum Y -1.00 kN"
    assert printed[20] == "runs 21 to 30  10 complete  largest sum Y -30.00 kN"
    assert printed[21] == "run33  derailed (off its rails)  sum Y -33.00 kN"
    assert printed[22:24] == [
        "runs 31 to 40  9 complete  largest sum Y -40.00 kN",
        "runs 41 to 45  5 complete  largest sum Y -45.00 kN",
    ]
    assert printed[24:] == [
        "remark: run1: hunts at 1 Hz (and 44 similar, in 45 runs altogether)",
        "remark: 45 runs: is too long",
    ]


def test_finished_fraction_is_that_of_the_simulated_time():
    """A run of 10 s, judged for 5 s and run in for 10 s: of 25 s in all."""
    told = []
    inputs = SimpleNamespace(
        track=SimpleNamespace(length=260.0), start=60.0, speed=20.0, until=None, duration=None
    )
    course = RunProgress(told.append, inputs)
    course.of_judgement(5.0, 5.0)  # a run-in is taken for as long, as the run does not start at 0
    course.of_run_in(4.0, 10.0)
    course.of_run_in(10.0, 10.0)
    for done in (0.0, 0.6, 1.0 - 1e-13):
        course.of_run(done)
    # what was told is not taken back
    expected = [0.0, 5.0 / 20.0, 9.0 / 25.0, 15.0 / 25.0, 15.0 / 25.0, 21.0 / 25.0, 1.0]
    assert told == pytest.approx(expected, abs=1e-12)
    assert told[-1] == 1.0
    for short in (SimpleNamespace(**{**vars(inputs), "until": 100.0}),
                  SimpleNamespace(**{**vars(inputs), "duration": 2.0})):  # fmt: skip
        other = RunProgress(told.append, short)
        other.of_judgement(6.0, 6.0)
        assert told[-1] == pytest.approx(6.0 / 14.0)
    RunProgress(told.append, SimpleNamespace(**{**vars(inputs), "start": 0.0})).of_judgement(
        2.0, 7.0
    )
    assert told[-1] == pytest.approx(2.0 / 20.0)  # 13 s of run, and no run-in
