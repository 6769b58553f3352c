"""Auxiliary runs of wear loop and recording car: on the track as it is where the vehicle is."""

from collections import namedtuple
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

import railsim
from railsim.definitions import Settings
from railsim.linear.track_response import track_response
from railsim.linear.vehicle import LinearVehicle
from railsim.observation import Assumed, contact
from railsim.simulation.run_in import _changing_ranges, _way_from_constant
from railsim.stability import curving
from railsim.studies import wear_loop
from railsim.track.alignment import Alignment


class Seen(Exception):
    """Ends an auxiliary run where it would begin."""


@pytest.fixture(scope="module")
def coach():
    return railsim.load_vehicle("coach_manchester")


@pytest.fixture(scope="module")
def track():
    """A lubricated curve of 300 m with widening and check rail on soft ballast, then a straight."""
    return railsim.load_track("straight").replace(
        plan=[
            {"type": "STR", "length": 50.0},
            {"type": "CIR", "length": 250.0, "radius": 400.0},
            {"type": "STR", "length": 700.0},
        ],
        friction_table=[[0.0, 0.1, 0.05], [300.0, 0.1, 0.05], [310.0, 0.4, 0.3]],
        gauge_widening=[[0.0, 0.01], [299.0, 0.01], [300.0, 0.0]],
        check_rail=[{"rail": "right", "flangeway": [[0.0, 0.04], [300.0, 0.04]]}],
        support={"preset": "ballasted", "variation": [[300.0, 0.5, 0.5], [310.0, 2.0, 3.0]]},
    )


def ran_on(monkeypatch, module, begin):
    """The track on which `begin` simulates."""
    seen = []

    def simulate(vehicle, track, **how):
        seen.append(track)
        raise Seen

    monkeypatch.setattr(module, "simulate", simulate)
    with pytest.raises(Seen):
        begin()
    return seen[0]


def as_on_the_straight(found):
    assert found.friction_at(0.0).tolist() == found.friction_at(1400.0).tolist() == [0.4, 0.3]
    assert found.support.variation[0][1:] == (2.0, 3.0)
    assert len(found.support.variation) == 1
    assert not found.check_rail
    assert not found.gauge_widening


def test_wear_loop_looks_for_hunting_on_the_straight_as_it_is(monkeypatch, coach, track):
    run = wear_loop.Run(coach, track, 40.0, 1.0)
    as_on_the_straight(
        ran_on(
            monkeypatch, wear_loop,
            lambda: wear_loop._hunting_when_disturbed(run, Settings(), {}),
        )
    )  # fmt: skip


def test_contact_of_a_recording_car_is_that_of_where_it_recorded(monkeypatch, coach, track):
    linear = LinearVehicle(coach, track, at=700.0)
    tangent = track_response(linear, {}, 30.0)
    rough = {"spectrum": "erri_b176_low", "wavelengths": [3.0, 70.0]}
    as_on_the_straight(
        ran_on(
            monkeypatch, contact,
            lambda: contact.with_mean_contact(coach, track, linear, tangent, rough),
        )
    )  # fmt: skip


def test_linear_vehicle_has_the_friction_and_support_of_its_place(coach, track):
    """As on a track that has no others."""
    there = track.replace(
        plan=[{"type": "STR", "length": 700.0}], friction_table=None, friction=[0.4, 0.3],
        support={"preset": "ballasted", "variation": [[0.0, 2.0, 3.0]]},
    )  # fmt: skip
    found, expected, begin = (
        LinearVehicle(coach, one, at=at).steady(30.0)
        for one, at in ((track, 700.0), (there, 0.0), (track, 0.0))
    )
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert begin != pytest.approx(expected, rel=1e-3, abs=1e-12)


def test_a_recording_car_is_linearised_in_the_middle_of_its_record(monkeypatch, coach, track):
    places = []

    def linear(vehicle, track, *, at):
        places.append(at)
        raise Seen

    module = import_module("railsim.observation.irregularity")
    monkeypatch.setattr(module, "LinearVehicle", linear)
    record = SimpleNamespace(name="run", distance=np.array([400.0, 420.0, 900.0]))
    with pytest.raises(Seen):
        module._Smooth(coach, track, Assumed(), record, {}, 0)
    assert places == [650.0]


BESIDE = {"type": "CST", "length": 100.0}
CHANGING = {
    "curvature": {
        "plan": [
            {"type": "STR", "length": 100.0},
            {"type": "CLO", "length": 40.0},
            {"type": "CIR", "length": 300.0, "radius": 500.0},
        ]
    },
    "cant": {
        "cant": [
            {**BESIDE, "cant": 0.0},
            {"type": "LIR", "length": 40.0},
            {"type": "CST", "length": 300.0, "cant": 0.1},
        ]
    },
    "gradient": {
        "vertical": [
            {**BESIDE, "gradient": 0.0},
            {"type": "LIR", "length": 40.0},
            {"type": "CST", "length": 300.0, "gradient": 0.01},
        ]
    },
    "rail sections": {},
}


@pytest.mark.parametrize("kind", CHANGING)
@pytest.mark.parametrize(
    ("start", "room", "way"),
    [
        (80.0, 60.0, 0.0),
        (89.0, 60.0, 0.0),  # the first axle at 94 m
        (92.0, 60.0, 2.0),
        (130.0, 60.0, 40.0),
        (164.0, 140.0, 74.0),  # the last axle at 144 m
        (164.0, 50.0, 50.0),  # as far as there is track
        (166.0, 140.0, 0.0),
    ],
)
def test_the_way_to_a_start_begins_where_nothing_changes_under_the_vehicle(kind, start, room, way):
    """From 100 to 140 m, and 5 m around by rounded corners, one of them changes.

    The axles are 5 m ahead and 20 m behind.
    """
    plan = [{"type": "STR", "length": 440.0}]
    track = railsim.load_track("straight").replace(**{"plan": plan, **CHANGING[kind]})
    ranges, axles = np.array([[95.0, 145.0]][kind != "rail sections" :]), np.array([5.0, -20.0])
    found = _way_from_constant(Alignment(track), ranges.reshape(-1, 2), start, axles, room, 10.0)
    assert found == pytest.approx(way, abs=0.51)
    assert (found > 0.0) == (way > 0.0)


def test_support_friction_and_check_rails_change_between_their_unequal_rows():
    """Where a check rail begins and ends it changes at once."""
    rows = np.array([[0.0, 1.0, 1.0], [40.0, 1.0, 1.0], [45.0, 1.0, 3.0], [60.0, 1.0, 3.0]])
    track = railsim.load_track("straight").replace(
        friction_table=[[10.0, 0.4, 0.4], [12.0, 0.4, 0.1], [90.0, 0.4, 0.1]],
        check_rail=[{"rail": "left", "flangeway": [[50.0, 0.06], [52.0, 0.04], [70.0, 0.04]]}],
    )
    found = _changing_ranges(np.array([[80.0, 83.0]]), rows, track)
    expected = [(10.0, 12.0), (40.0, 45.0), (50.0, 50.0), (50.0, 52.0), (70.0, 70.0), (80.0, 83.0)]
    assert sorted(map(tuple, found.tolist())) == expected
    plain = railsim.load_track("straight")
    assert _changing_ranges(np.zeros((0, 2)), np.zeros((0, 3)), plain).shape == (0, 2)


def test_a_run_into_a_curve_has_its_curvature_cant_and_friction(monkeypatch):
    """Of rails whose friction differs, in proportion to the one that is looked for."""
    asked = []

    def settle(model, track, speed, *to):
        asked.append((speed, *to[:3]))
        return railsim.load_track("straight")

    monkeypatch.setattr(curving, "curve_to_settle_in", settle)
    monkeypatch.setattr(curving._Search, "_advance", lambda *_: None)
    search = object.__new__(curving._Search)
    search.model = search.track = None
    search.shares = np.array([0.5, 1.5])
    straight = namedtuple("System", "track")(None)
    goal = np.array([1.0 / 300.0, 0.12, 400.0, 0.3])
    state = search._into(goal, 20.0, straight, np.arange(6.0), 1e-3)
    assert asked == [(20.0, 1.0 / 300.0, 0.12, (pytest.approx(0.15), pytest.approx(0.45)))]
    assert state.tolist() == [0.0, 1.0, 2.0, 0.0, 0.0, 20.0]
