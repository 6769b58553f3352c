"""Preloads that a process keeps are those of the same vehicle in the same load, and of no other."""

from dataclasses import replace

import pytest

import railsim
from railsim.errors import ModelError
from railsim.model import preloads
from railsim.model.assembly import Model, without_rails
from railsim.model.preloads import with_preloads


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(preloads, "_KEPT", {})


def _same(one: Model, other: Model) -> bool:
    rows = (
        (one.system.links.row, other.system.links.row),
        (one.system.mounts.row, other.system.mounts.row),
    )
    return all(a.tobytes() == b.tobytes() for a, b in rows)


def test_same_vehicle_takes_what_is_kept_to_the_last_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    model = without_rails(railsim.load_vehicle("coach_manchester"))
    solved = with_preloads(model)
    again = without_rails(railsim.load_vehicle("coach_manchester"))
    monkeypatch.delattr(preloads, "_solve_preloads")  # it must not be called
    assert _same(with_preloads(again), solved)


@pytest.mark.parametrize(
    "change",
    [
        {"bodies.carbody.mass": 40e3},
        {"bodies.carbody.position": [0.1, 0.0, -1.8]},
        {"assemblies.bogie.bodies.frame.mass": 2700.0},
    ],
)
def test_changed_vehicle_takes_its_own(change: dict[str, object]) -> None:
    coach = railsim.load_vehicle("coach_manchester")
    changed = coach.with_values(change)
    kept = with_preloads(without_rails(coach))
    found = with_preloads(without_rails(changed))
    preloads._KEPT.clear()
    assert _same(found, with_preloads(without_rails(changed)))
    assert not _same(found, kept)


def test_stiffness_that_shares_the_weight_counts() -> None:
    """Also where the arrays of a model do not tell: `vertical_stiffness` is of the definition."""
    model = without_rails(railsim.load_vehicle("coach_manchester"))
    with_preloads(model)
    nobody = replace(model, flat=replace(model.flat, elements=()))
    with pytest.raises(ModelError, match="cannot carry"):
        with_preloads(nobody)


def test_number_of_kept_vehicles_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(preloads, "MOST_KEPT", 2)
    coach = railsim.load_vehicle("coach_manchester")
    for mass in (30e3, 31e3, 32e3):
        with_preloads(without_rails(coach.with_values({"bodies.carbody.mass": mass})))
    assert len(preloads._KEPT) == 1
