"""Equilibria and stable steps on disk: found once, the same to the last bit, bounded."""

import json
import os
from collections import Counter
from contextlib import contextmanager

import numpy as np
import pytest

import railsim
from railsim.kernels import cache
from railsim.model import equilibrium, solutions
from railsim.simulation import step_choice


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """Folder of the solutions of this test."""
    place = cache.cache_subfolder("solutions", base=tmp_path)
    monkeypatch.setattr(solutions, "solutions_folder", lambda _: place)
    monkeypatch.setattr(solutions, "_new", Counter())
    monkeypatch.setattr(step_choice, "_JUDGED", {})
    return place


@pytest.fixture
def solved(monkeypatch):
    """Names of what was not found on the disk."""
    calls = []
    find, judge = equilibrium.equilibrium, step_choice.StepChoice._longest_stable
    monkeypatch.setattr(
        equilibrium, "equilibrium", lambda *a: calls.append("equilibrium") or find(*a)
    )
    monkeypatch.setattr(
        step_choice.StepChoice, "_longest_stable", lambda *a: calls.append("step") or judge(*a)
    )
    return calls


def run(speed=20.0, friction=0.4, vehicle="coach_manchester", **changes):
    track = railsim.load_track(changes.pop("track", "curve_r250"))
    track = track.replace(friction=(friction, friction), **changes)
    return railsim.simulate(railsim.load_vehicle(vehicle), track, speed=speed, until=5.0)


def same(one, other):
    names = [name for name in one.quantities if one[name].dtype.kind == "f"]
    return all(np.array_equal(one[name], other[name], equal_nan=True) for name in names)


def test_later_run_is_the_first_to_the_last_bit(folder, solved):
    first = run()
    assert solved == ["equilibrium", "step"]
    # and the class of the step, on straight track and in the curve
    assert len(list(folder.glob("*.json"))) == 4
    assert same(first, run())
    assert solved == ["equilibrium", "step"]


@pytest.mark.parametrize(
    "other", [{"speed": 21.0}, {"friction": 0.3}, {"vehicle": "coach_flexicoil"}]
)
def test_other_inputs_have_solutions_of_their_own(folder, solved, other):
    run()
    run(**other)
    assert solved == ["equilibrium", "step"] * 2


@pytest.mark.parametrize(
    ("other", "judged"),
    [({"track": "curve_r500"}, 1), ({"track": "curve_r500", "friction": 0.3}, 2),
     ({"track": "curve_r500", "support": {"preset": "rigid"}}, 2), ({"speed": 24.0}, 2)],
)  # fmt: skip
def test_tracks_of_other_curves_share_the_judgement_on_straight_track(
    folder, monkeypatch, other, judged
):
    """And take the step that they take by themselves."""
    asked = Counter()
    holds = step_choice.Stability._within

    def within(self, number, *how):
        asked[number] += number == 0
        return holds(self, number, *how)

    monkeypatch.setattr(step_choice.Stability, "_within", within)
    run()
    found = run(**other).attributes["step"]
    assert asked[0] == judged
    for path in folder.glob("*.json"):
        path.unlink()
    monkeypatch.setattr(step_choice, "_JUDGED", {})
    assert run(**other).attributes["step"] == found


def test_other_program_has_solutions_of_its_own(folder, solved, monkeypatch):
    run()
    monkeypatch.setattr(solutions, "program_hash", lambda: "another version")
    run()
    assert solved == ["equilibrium", "step"] * 2


def test_damaged_solution_is_found_again(folder, solved, monkeypatch):
    monkeypatch.setattr(cache, "notices", {})
    first = run()
    for path in folder.glob("*.json"):
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(data)
    assert same(first, run())
    assert solved == ["equilibrium", "step"] * 2


def test_number_of_solutions_is_bounded(folder, monkeypatch):
    monkeypatch.setattr(solutions, "MOST_STORED", 10)
    monkeypatch.setattr(solutions, "MOST_NEW", 25)  # one process leaves room for others
    left = []
    for number in range(30):
        solutions.solution("test", str(number), lambda number=number: {"number": number})
        left.append(set())
        for path in folder.glob("*.json"):
            left[-1].add(found := json.loads(cache.load(path))["number"])
            os.utime(path, (found, found))  # as old as its number says
    assert left[9] == {*range(10)}
    assert left[10] == {*range(5, 11)}  # the older half makes room
    assert max(map(len, left)) == 10
    assert solutions._new.total() == 25


def test_shared_solution_is_found_by_one_process_while_others_wait(folder, monkeypatch):
    @contextmanager
    def waits(path):
        """As if another process had found it and stored it meanwhile."""
        cache.store(path.with_suffix(".json"), b'{"holds": true}')
        yield

    monkeypatch.setattr(solutions, "exclusive", waits)
    found = solutions.solution("class", "inputs", lambda: pytest.fail("again"), shared=True)
    assert found == {"holds": True}


def test_all_shared_solutions_are_stored(folder, monkeypatch):
    monkeypatch.setattr(solutions, "MOST_NEW", 2)
    for number in range(5):
        solutions.solution("class", str(number), lambda: {"holds": True}, shared=True)
    assert len(list(folder.glob("*.json"))) == 5
    assert not list(folder.glob("*.lock"))
