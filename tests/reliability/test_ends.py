"""A physical end keeps its result, however early it comes, and every command answers to it."""

import gc
import weakref

import pytest

import railsim
import railsim.simulation.preparation
from railsim.cli import main
from railsim.result import check_result

RUN = ["run", "coach_manchester", "straight", "--speed", "0.5", "--duration", "3", "--quiet"]
FREE = ["--set", "settings.drive={mode='free', resistance=[4e5, 0.0, 0.0]}"]
BESIDE = ["--set", "settings.initial={'front.outer.wheelset'={y=%s}}"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = str(tmp_path_factory.mktemp("whole") / "whole.h5")
    assert main([*RUN[:-2], "0.1", "--quiet", "--out", path]) == 0
    return path


@pytest.mark.parametrize(
    ("changed", "instants", "reason"),
    [
        (FREE, range(2, 600), "came to a standstill"),
        ([BESIDE[0], BESIDE[1] % 0.025], [1], "beyond the range"),
        ([BESIDE[0], BESIDE[1] % 1e300], [0], "beyond the range"),
    ],
    ids=["standstill", "in the first step", "before the first instant"],
)
def test_physical_end_keeps_its_result(changed, instants, reason, whole, tmp_path, capsys):
    path = str(tmp_path / "run.h5")
    assert main([*RUN, *changed, "--out", path]) == 3
    result = check_result(path)
    assert result.status == "stopped"
    assert reason in result.attributes["status_reason"]
    assert len(result.time) in instants
    assert reason in capsys.readouterr().out
    drawn, moving = 2 if not len(result.time) else 0, 2 if len(instants) == 1 else 0
    onwards = [*RUN[:3], "--continue", path, "--duration", "0.1", "--out", str(tmp_path / "on.h5")]
    for command, status in [
        (["info", path], 0),
        (["validate", path], 0),
        (["plot", path, "Q", "--out", str(tmp_path / "run.png")], drawn),
        (["compare", whole, path], drawn),
        (["animate", path, "--out", str(tmp_path / "run.html")], moving),
        (["assess", path, "--coarse"], 0),
        (onwards, 2 if changed is FREE else 3),  # too slow; off the rails
    ]:
        assert main(command) == status, command
        errors = capsys.readouterr().err
        assert status != 2 or errors.count("\n") == 1, errors


def test_run_that_has_ended_lets_go_of_its_tables(monkeypatch):
    """Its hundred megabytes do not wait for the collector: hundreds of runs follow each other."""
    prepare, prepared = railsim.simulation.preparation.prepare, []

    def watched(*arguments, **how):
        found = prepare(*arguments, **how)
        prepared.append(weakref.ref(found))
        return found

    monkeypatch.setattr(railsim.simulation.preparation, "prepare", watched)
    vehicle, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("straight")
    gc.disable()
    try:
        railsim.simulate(vehicle, track, speed=20.0, duration=0.1)
        assert [found() for found in prepared] == [None]
    finally:
        gc.enable()
