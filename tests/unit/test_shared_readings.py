"""Readings of overlapping parts of a record are those of each part read by itself."""

import numpy as np
import pytest

import railsim
from railsim.assessment.record import Record, _Readings

ROWS = slice(0, 500), slice(300, 800), slice(310, 700), slice(0, 400), slice(900, 950)


@pytest.fixture(scope="module")
def run() -> railsim.Result:
    coach, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    return railsim.simulate(coach, track, speed=20.0, start=285.0, duration=5.0)


def test_parts_are_the_same_to_the_last_bit(run: railsim.Result) -> None:
    shared = Record(run, "run", coarse=True)
    for rows in ROWS:
        alone = Record(run, "run", coarse=True).readings(rows)
        for one, other in zip(shared.readings(rows), alone, strict=True):
            assert one.tobytes() == other.tobytes(), rows


def test_roll_that_is_read_adds_up_to_the_way_the_car_body_leans(run: railsim.Result) -> None:
    """Over time: cant angle and roll in the track frame, on the cant ramp before a curve."""
    record = Record(run, "run", coarse=True)
    roll = record.readings(slice(0, record.rows))[1][:, list(record.sensors).index("floor_middle")]
    lean = run["body_position"][: record.rows, run.bodies.index("carbody"), 3]
    lean = lean + record.alignment.cant_angle(record.distance[: record.rows])
    leaned = float(np.trapezoid(roll, record.time[: record.rows]))
    assert abs(lean[-1] - lean[0]) > 0.01
    assert leaned == pytest.approx(lean[-1] - lean[0], rel=2e-3)


def test_readings_of_another_speed_are_read_again() -> None:
    rows = slice(0, 400)
    known = _Readings(0, np.full(400, 20.0), *(np.zeros((400, 2)) for _ in range(2)))
    assert known.overlap(rows, np.full(400, 20.0)) is not None
    assert known.overlap(rows, np.full(400, 21.0)) is None
    assert known.overlap(slice(900, 950), np.full(50, 20.0)) is None


def test_what_overlaps_is_not_read_again(
    run: railsim.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = Record(run, "run", coarse=True)
    read: list[int] = []
    own = Record._readings_of_motion

    def counted(self: Record, rows: slice, speed: np.ndarray) -> object:
        read.append(rows.stop - rows.start)
        return own(self, rows, speed)

    monkeypatch.setattr(Record, "_readings_of_motion", counted)
    record.readings(slice(0, 500))
    record.readings(slice(300, 800))
    assert read == [500, 1, 301]
