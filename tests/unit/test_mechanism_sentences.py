"""What is said of a mechanism beside its tables: where it rests, how arcs meet, how it moves."""

from types import SimpleNamespace as Made

import numpy as np
import pytest

from railsim.mechanisms import tables
from railsim.mechanisms.cams import Transition
from railsim.mechanisms.contact import Rest
from railsim.mechanisms.tables import sentences


def said(monkeypatch, *, solves=False, loaded=True, **given):
    monkeypatch.setattr(tables, "is_loaded", lambda _: loaded)
    nothing = {
        "output": {},
        "force_zeros": (),
        "rests": (),
        "transitions": (),
        "contact": None,
        "timed": None,
        "release": None,
        "motion": None,
    }
    model = Made(start=np.radians(10.0), end=np.radians(50.0))
    of = Made(driver=Made(angle=0.0), solve="force" if solves else None)
    return sentences(Made(definition=of, model=model, **nothing | given))


@pytest.mark.parametrize("solves", [True, False])
@pytest.mark.parametrize("loaded", [True, False])
@pytest.mark.parametrize("rests", [True, False])
def test_no_position_of_rest_is_told_of_what_could_rest(monkeypatch, solves, loaded, rests):
    where = (Rest(0.2, 0.2, 0.2, True),) if rests else ()
    found = said(monkeypatch, solves=solves, loaded=loaded, rests=where)
    told = [words for words in found if words.startswith("no position of rest")]
    expected = not solves and loaded and not rests
    assert told == ["no position of rest from 10.0000 deg to 50.0000 deg"] * expected


def test_positions_of_rest_are_told_in_degrees(monkeypatch):
    one, two, three = np.radians([20.0, 30.0, 40.0])
    found = said(monkeypatch, rests=(Rest(two, one, three, True), Rest(two, two, two, False)))
    assert found == [
        "at rest at 20.0000 deg to 40.0000 deg (friction), stable",
        "at rest at 30.0000 deg, unstable",
    ]


def test_arcs_of_a_cam_meet_with_their_gap_and_jump(monkeypatch):
    """The rate changes from 0.5 to 0.51, by 1.961 % of the larger one."""
    found = said(
        monkeypatch,
        loaded=False,
        transitions=(Transition("cam", np.radians(15.0), 1, 2, 12.5e-6, 0.5, 0.51),),
    )
    assert found == ["cam: from arc 1 to 2 at 15.0000 deg, gap 0.0125 mm, jump of the rate 1.961 %"]


@pytest.mark.parametrize(
    ("s", "reached", "words"),
    [
        ([20.0, 30.0, 50.0], True, "reaches 50.0000 deg after 2.00000 s"),
        (
            [20.0, 53.0, 40.0],
            False,
            "is then at 40.0000 deg after 2.00000 s; it leaves the travel, up to 53.0000 deg",
        ),
        (
            [20.0, 5.0, 10.0],
            True,
            "reaches 10.0000 deg after 2.00000 s; it leaves the travel, up to 5.0000 deg",
        ),
    ],
)
def test_how_it_moves_once_let_go_is_told(monkeypatch, s, reached, words):
    released = Made(reached=reached, s=np.radians(s), time=np.array([0.0, 1.0, 2.0]))
    found = said(monkeypatch, loaded=False, release=released)
    assert found == [f"let go at 20.0000 deg it {words}"]


def test_a_contact_force_is_told_with_its_senses_and_rests(monkeypatch):
    both = {"least": 70.0, "most": np.nan}
    plain = Made(pressure=0.35e6, force=both, rising=both, falling=both, reason="", rests=())
    assert said(monkeypatch, loaded=False, contact=plain) == [
        "contact force at 0.35000 MPa: least 70.00 N, most no value",
        "rests nowhere within the travel without contact",
    ]
    silent = Made(**vars(plain) | {"reason": "why"})
    assert said(monkeypatch, loaded=False, contact=silent)[1:] == ["why"]
    rests = Rest(0.5, 0.4, 0.6, True), Rest(0.8, 0.8, 0.8, False)
    rough = Made(
        pressure=0.35e6,
        force=both,
        rising={"a": 80.0},
        falling={"a": 60.0},
        reason="why",
        rests=rests,
    )
    assert said(monkeypatch, loaded=False, contact=rough) == [
        "contact force at 0.35000 MPa: least 70.00 N, most no value (mean); rising a 80.00 N; "
        "falling a 60.00 N",
        "why",
        "rests at a height of 400.0 to 600.0 mm without contact, stable",
        "rests at a height of 800.0 mm without contact, unstable",
    ]
