"""Ctrl-C and SIGTERM end a command, also where Python loses the exception that they raise."""

import signal
import subprocess
import sys

import pytest

import railsim.cli.interrupts
import railsim.simulation.auxiliary_track
import railsim.simulation.flange
import railsim.simulation.preparation
import railsim.simulation.run_in
from railsim.cli import main
from railsim.cli.interrupts import remembered_interrupts
from railsim.cli.progress import progress_bar
from railsim.simulation import step_choice

RUN = ["run", "coach_manchester", "curve_r250", "--speed", "20", "--until", "10", "--quiet"]
STUDY = ["study", "--vehicles", "coach_manchester", "--tracks", "curve_r250", "--speeds", "20"]
STUDY += ["--until", "10", "--workers", "1", "--quiet"]


class Finalised:
    """A signal comes in a finaliser, where Python prints and forgets what it raises."""

    def __init__(self, number):
        self.number = number

    def __del__(self):
        signal.raise_signal(self.number)


def lost(number):
    Finalised(number)


def turned_into_another(number):
    """As the import of a library compiled from C++ does."""
    try:
        signal.raise_signal(number)
    except KeyboardInterrupt:
        raise ImportError("initialization failed") from None


@pytest.fixture(autouse=True)
def nothing_ignored(monkeypatch):
    """A shell that starts the tests in the background has them ignore Ctrl-C."""
    numbers = signal.SIGINT, signal.SIGTERM
    defaults = signal.default_int_handler, signal.SIG_DFL
    before = [signal.signal(*pair) for pair in zip(numbers, defaults, strict=True)]
    # where it is overdue the process is ended: here that of the tests
    monkeypatch.setattr(railsim.cli.interrupts, "PATIENCE", 600.0)
    yield
    for pair in zip(numbers, before, strict=True):
        signal.signal(*pair)


@pytest.fixture
def comes(monkeypatch):
    """Let a signal come, in one of the ways above, while a run is prepared."""

    def during_preparation(way, number):
        prepare = railsim.simulation.preparation.prepare

        def interrupted(*arguments, **how):
            way(number)
            return prepare(*arguments, **how)

        monkeypatch.setattr(railsim.simulation.preparation, "prepare", interrupted)

    return during_preparation


@pytest.mark.parametrize("way", [lost, turned_into_another])
@pytest.mark.parametrize(
    ("name", "status", "words"),
    [("SIGINT", 130, "railsim: interrupted\n"), ("SIGTERM", 143, "railsim: ended by SIGTERM\n")],
)
def test_run_obeys_a_signal_that_python_loses(tmp_path, comes, capsys, way, name, status, words):
    comes(way, getattr(signal, name))
    assert main([*RUN, "--out", str(tmp_path / "run.h5")]) == status
    assert capsys.readouterr().err == words
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("module", "speed"),
    [(railsim.simulation.run_in, "20"), (railsim.simulation.flange, "2")],
    ids=["run-in", "step"],
)
def test_run_obeys_a_signal_that_python_loses_before_it(
    tmp_path, monkeypatch, capsys, module, speed
):
    """At walking speed a run-in takes as long as a run, and so does the way to a flange contact.

    Either is left after the call in hand.
    """
    calls, time_loop = [], railsim.simulation.auxiliary_track.time_loop

    def interrupted(*arguments):
        calls.append(1)
        lost(signal.SIGINT)
        return time_loop(*arguments)

    def advance(*arguments):
        monkeypatch.setattr(railsim.simulation.auxiliary_track, "time_loop", interrupted)
        return settle(*arguments)

    settle = module.advance
    monkeypatch.setattr(step_choice, "_JUDGED", {})  # by another test, perhaps
    monkeypatch.setattr(module, "advance", advance)
    run = ["run", "coach_manchester", "curve_r250", "--speed", speed, "--start", "390", "--quiet"]
    assert main([*run, "--out", str(tmp_path / "run.h5")]) == 130
    assert capsys.readouterr().err == "railsim: interrupted\n"
    assert list(tmp_path.iterdir()) == []
    assert len(calls) == 1


def test_bar_says_what_comes_before_a_run(monkeypatch):
    """On a terminal; the finished fraction never falls."""
    said, fractions = [], []

    class Bar:
        n, disable = 0.0, False

        def __init__(self, *, desc, **how):
            said.append(desc)

        def set_description_str(self, words, refresh):
            said.append(words)

        def update(self, more):
            self.n += more
            fractions.append(self.n)

        def close(self):
            pass

    monkeypatch.setattr(step_choice, "_JUDGED", {})  # by another test, perhaps
    monkeypatch.setattr("tqdm.tqdm", Bar)
    monkeypatch.setattr(railsim.simulation.auxiliary_track, "WHEELSET_STEPS", 800)
    coach, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    with progress_bar("a run", quiet=False) as progress:
        railsim.simulate(coach, track, speed=20.0, start=390.0, duration=0.1, progress=progress)
    assert said == [
        "a run",
        "a run, settling in flange contact, for judging the time step",
        "a run, on the way to the start",
        "a run",
    ]
    assert fractions == sorted(fractions)
    assert 0.0 < fractions[3] < 0.5
    assert fractions[-1] == 1.0


@pytest.mark.parametrize("way", [lost, turned_into_another])
def test_study_obeys_a_signal_that_python_loses(tmp_path, comes, way):
    comes(way, signal.SIGINT)
    assert main([*STUDY, "--out", str(tmp_path)]) == 130
    assert {path.name for path in tmp_path.iterdir()} == {
        "study.journal",
        "study.json",
        "summary.csv",
    }


def test_signal_that_the_caller_ignores_stays_ignored(tmp_path, comes, monkeypatch):
    """So `nohup railsim ...` goes on when its terminal is closed."""
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        comes(lost, signal.SIGTERM)
        assert main([*RUN, "--out", str(tmp_path / "run.h5")]) == 0
    finally:
        signal.signal(signal.SIGTERM, before)


def test_handlers_of_the_caller_come_back():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with remembered_interrupts(), pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGTERM)
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


@pytest.mark.slow
def test_full_disk_leaves_nothing_and_is_told_in_a_line(tmp_path):
    """A limit of the file size stands for the disk."""
    run = [sys.executable, "-m", "railsim", *RUN[:-3], "--quiet", "--out", str(tmp_path / "run.h5")]
    limited = ["sh", "-c", 'ulimit -f 2000; exec "$@"', "sh", *run]
    done = subprocess.run(limited, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr == f"railsim: File too large: {tmp_path / 'run.h5'}\n"
    assert list(tmp_path.iterdir()) == []
