"""A model against a test whose values lie between those of the simulation."""

from types import SimpleNamespace

import numpy as np
import pytest
from example_result import OFFSETS
from made_record import Q0, curve, made, track
from test_section_values import FORCE, OUT, RIDE, Expected, Tones

import railsim
from railsim.assessment.model_validation import _same_track, matched_results
from railsim.assessment.sections import TestSection
from railsim.definitions.measurement import MeasurementFile
from railsim.errors import InputError
from railsim.measurement import Measurement
from railsim.notation import REQUESTED, SIDES
from railsim.result import Result

SPEED, RATE = 23.0, 200.0
RECORD = {"type": "measured", "rows": [(float(s), 0.0, 1e-3 * s, 0.0, 0.0) for s in range(5)]}


def load(t):
    """A wheel load with a tone of 18 Hz, below the filter of 20 Hz [N]."""
    return Q0 + 10e3 * np.sin(2.0 * np.pi * 18.0 * t) * (1.0 + 0.3 * np.sin(2.0 * np.pi * 0.17 * t))


def test_no_difference_where_only_the_instants_of_the_samples_differ():
    """Straight lines between 200 values a second would take cos(pi 18/200), 4 %, of the tone."""
    on = track(*curve(300.0, 900.0), cant=0.12)
    result = made(
        on, SPEED, rate=RATE, Q=lambda t, s: np.tile(load(t)[:, None, None], (1, 4, 2)),
        settings='{"outputs": {"low_pass": {"frequency": 80.0}}, "output_rate": 200.0}',
    )  # fmt: skip
    t = (0.5 + np.arange(round(on.length / SPEED * RATE) - 1)) / RATE
    how = MeasurementFile.model_validate({
        "format": "railsim-measurement/1", "name": "m", "file": ["a.csv"], "rate": RATE,
        "speed": SPEED, "channels": {"load": {"quantity": "Q:1:left"}},
    })  # fmt: skip
    run = Measurement(how, t, SPEED * t, np.full(len(t), SPEED), {"load": load(t)})
    found = railsim.validate_model(run, result)["Q_max"]
    assert len(found.pairs) > 5
    for pair in found.pairs:
        assert pair.measured - Q0 > 8e3
        assert pair.simulated - Q0 == pytest.approx(pair.measured - Q0, rel=3e-3)


def test_a_quotient_that_was_measured_is_not_formed_of_its_forces_again():
    on = track(*curve(300.0, 400.0), cant=0.12)
    result = made(on, SPEED, rate=RATE, Y=lambda t, s: np.full((*s.shape, 2), -20e3),
                  settings='{"outputs": {"low_pass": {"frequency": 80.0}}}')  # fmt: skip
    t = np.arange(round(on.length / SPEED * RATE)) / RATE
    measured = {"Y:1:left": -22e3, "Q:1:left": Q0, "Y_over_Q:1:left": 22e3 / Q0}
    how = MeasurementFile.model_validate({
        "format": "railsim-measurement/1", "name": "m", "file": ["a.csv"], "rate": RATE,
        "speed": SPEED, "channels": {f"c{k}": {"quantity": q} for k, q in enumerate(measured)},
    })  # fmt: skip
    channels = {f"c{k}": np.full(len(t), value) for k, value in enumerate(measured.values())}
    run = Measurement(how, t, SPEED * t, np.full(len(t), SPEED), channels)
    found = railsim.validate_model(run, result)
    assert len(found["Y_over_Q_qst"].pairs) == len(found["Y_qst"].pairs) > 3
    assert found["Y_over_Q_qst"].mean == pytest.approx(-2e3 / Q0)
    assert found["Y_qst"].mean == pytest.approx(-2e3)


def steady(read, *, length=1100.0, until=None, faster=1.0, sensors=(), change=lambda t, x: x):
    """Comparison in R 300 m of constant channels with -20 kN of Y and the static loads.

    `read`: by quantity; `faster`: measured over simulated speed; `sensors`: at which nothing is
    read; `change`: of what was measured over time.
    """
    on = track(*curve(300.0, length, 20.0, 20.0), cant=0.12)
    made_up = made(on, SPEED, until=until, Y=lambda t, s: np.full((*s.shape, 2), -20e3))
    arrays = {name: made_up[name] for name in made_up}
    arrays["sensor_acceleration"] = np.zeros((len(made_up["time"]), len(sensors), 3))
    quantities = dict(made_up.quantities)
    quantities["sensor_acceleration"] = REQUESTED["sensor_acceleration"]
    coordinates = dict(made_up.coordinates) | {"sensor": sensors, "axis": tuple("xyz")}
    result = Result(arrays, quantities, coordinates, made_up.attributes, made_up.profiles)
    t = np.arange(round(on.length / SPEED * RATE)) / RATE
    how = MeasurementFile.model_validate({
        "format": "railsim-measurement/1", "name": "m", "file": ["a.csv"], "rate": RATE,
        "speed": SPEED, "channels": {f"c{k}": {"quantity": q} for k, q in enumerate(read)},
    })  # fmt: skip
    channels = {f"c{k}": change(t, np.full(len(t), x)) for k, x in enumerate(read.values())}
    speed = np.full(len(t), faster * SPEED)
    return railsim.validate_model(Measurement(how, t, SPEED * t, speed, channels), result)


@pytest.mark.parametrize(
    ("quantity", "channel", "simulated", "limit"),
    [
        ("Y_qst", "Y:1:left", -20e3, 5e3),
        ("Q_qst", "Q:1:left", Q0, 4e3 * (1.0 + 0.01 * 1e-3 * Q0)),
        ("Q_max", "Q:4:right", Q0, 6e3 * (1.0 + 0.01 * 1e-3 * Q0)),
    ],
)
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_mean_difference_passes_up_to_two_thirds_of_its_limit(
    quantity, channel, simulated, limit, sense
):
    """EN 14363, Annex T, as the limits file recalls it, over twelve sections at least."""
    for share, verdict in ((0.99, "pass"), (1.00005, "fail"), (1.01, "fail")):
        whole = steady({channel: simulated + sense * share * 2.0 / 3.0 * limit})
        found, rows = whole[quantity], {row[0]: row for row in whole.table().texts()}
        assert rows[quantity][5].lstrip("-") != rows[quantity][6]  # it does not read like its limit
        assert found.sections >= 12
        assert abs(found.mean) == pytest.approx(share * 2.0 / 3.0 * limit)
        assert (found.limit, found.verdict) == (pytest.approx(limit), verdict)


def test_a_gap_of_more_than_a_hundredth_leaves_a_section_out():
    """Of the 609 values over 70 m from 300 m on 5 or 7 are missing."""

    def without(number):
        def change(t, x):
            return np.where((t > 330.0 / SPEED) & (t < 330.0 / SPEED + number / RATE), np.nan, x)

        return steady({"Y:1:left": -21e3}, length=500.0, change=change)["Y_qst"].pairs

    assert len(without(0)) == len(without(5)) == len(without(7)) + 1


@pytest.mark.parametrize(("faster", "said"), [(1.019, False), (0.982, False), (1.021, True),
                                              (0.979, True)])  # fmt: skip
def test_speeds_may_differ_by_two_percent(faster, said):
    remarks = "".join(steady({"Y:1:left": -21e3}, length=500.0, faster=faster).remarks)
    assert (f"measured at {faster * SPEED:.1f} m/s, simulated at 23.0 m/s" in remarks) is said


@pytest.mark.parametrize(("share", "said"), [(0.905, False), (0.895, True)])
def test_a_comparison_of_less_than_nine_tenths_of_the_record_is_said(share, said):
    """On 1000 m; what is simulated in the first three seconds, 69 m, is not compared."""
    found = steady({"Y:1:left": -21e3}, length=920.0, until=69.0 + share * 1000.0)
    assert any("compared from 69 to" in remark for remark in found.remarks) is said


def test_accelerations_of_axleboxes_and_frames_are_not_those_of_the_floor():
    sensors = "floor_front", "frame_1", "axlebox_1_left"
    read = {f"sensor_acceleration:{name}:{axis}": 0.1 for name in sensors for axis in "yz"}
    found = steady(read, length=300.0, sensors=sensors)
    assert {one.quantity.name[:6] for one in found.comparisons} == {"body_y", "body_z"}
    assert {pair.place for one in found.comparisons for pair in one.pairs} == {"floor_front"}


@pytest.mark.parametrize(
    ("change", "same"),
    [
        ({"name": "another name"}, True), ({"friction": (0.2, 0.2)}, True),
        ({"plan": [{"type": "STR", "length": 99.0}]}, False),
        ({"cant": [{"type": "CST", "length": 99.0, "cant": 0.01}]}, False),
        ({"vertical": [{"type": "CST", "length": 99.0, "gradient": 0.01}]}, False),
        ({"gauge": 1.44}, False),
        ({"irregularities": [{"type": "dip", "s": 9.0, "length": 2.0, "depth": 0.01}]}, False),
        ({"irregularities": [RECORD]}, False),  # its file is None once its rows are read
    ],
)  # fmt: skip
def test_tracks_are_alike_in_course_gauge_and_irregularities(change, same):
    one = track({"type": "STR", "length": 700.0})
    assert _same_track(one, one.replace(**change)) is same
    assert _same_track(one.replace(**change), one) is same
    assert _same_track(one.replace(**change), one.replace(**change))


OTHER = np.array([0.27, 1.13, 2.6, 4.1, 7.3, 11.9, 19.1])  # Hz: not alike, so that no place moves
B, M = Tones(11, (1, 3), 0.4, 0.3), Tones(12, (1, 3), 0.5, 0.3, OTHER)
MEASURED = {
    "Y": Tones(13, (4, 2), 2e3, 4e3, OTHER), "Q": Tones(14, (4, 2), Q0 + 1e3, 3e3, OTHER),
}  # fmt: skip
SIMULATED = {"Y": Tones(15, (4, 2), 3e3, 4e3), "Q": Tones(16, (4, 2), Q0, 3e3)}
CHANNELS = [f"{f}:{w}:{side}" for f in "YQ" for w in (1, 4) for side in ("left", "right")]


def values_of(tones, body, section, turn, t):
    """By quantity and place, of tones of forces and of the floor's accelerations."""
    found, names = {}, Expected(section, turn, SPEED).names

    def there(offset):
        s = SPEED * t + offset
        return t[(s >= section.begin) & (s <= section.end)]

    def top(x, sense=1):
        return [np.percentile(x, 99.85)] if sense else [-np.percentile(x, 0.15),
                                                        np.percentile(x, 99.85)]  # fmt: skip

    for w in (0, 3):
        at, label = there(OFFSETS[w]), f"wheelset {w + 1}"
        means = Expected(section, turn, SPEED).windows
        total = (-turn or 1) * tones["Y"](at, FORCE, w).sum(axis=1)
        moved = means(lambda t, w=w: tones["Y"](t, FORCE, w).sum(axis=1), OFFSETS[w])
        found["sum_Y_max", label] = top((-turn or 1) * moved, abs(turn))
        if turn:
            found["sum_Y_qst", label] = [np.median(total)]
        for side in (0, 1):
            place, own = f"{label} {names[side]}", (w, side)
            q, y = tones["Q"](at, FORCE, own), OUT[side] * tones["Y"](at, FORCE, own)
            found["Q_max", place] = top(q)
            if turn:
                found["Q_qst", place] = [np.median(q)]
            if names[side] == "inner":
                continue
            found["Y_max", place] = top(y, abs(turn))
            if turn:
                found["Y_qst", place] = [np.median(y)]
                found["Y_over_Q_qst", place] = [np.median(y / q)]

                def over(t, own=own, side=side):
                    return OUT[side] * tones["Y"](t, FORCE, own) / tones["Q"](t, FORCE, own)

                found["Y_over_Q_max", place] = top(means(over, OFFSETS[w]))
    at = there(9.5)
    lateral, vertical = ((turn or 1) if k == 1 else 1 for k in (1, 2))
    ride = [sign * body(at, RIDE, (0, k)) for k, sign in ((1, lateral), (2, vertical))]
    for name, x in zip("yz", ride, strict=True):
        found[f"body_{name}_max", "floor_front"] = top(x, 0)
        found[f"body_{name}_rms", "floor_front"] = [np.sqrt(np.mean(x**2))]
    if turn:
        found["body_y_qst", "floor_front"] = [np.median(turn * body(at, FORCE, (0, 1)))]
    return found


@pytest.mark.parametrize("turn", [1, -1, 0])
def test_every_value_measured_and_simulated_is_that_of_its_filtered_tones(turn):
    plan = curve(300.0 * turn, 440.0, 60.0, 40.0) if turn else [{"type": "STR", "length": 700.0}]
    on = track(*plan, cant=0.12 * turn)
    whole = made(
        on, SPEED, rate=500.0, Y=lambda t, s: SIMULATED["Y"](t), Q=lambda t, s: SIMULATED["Q"](t),
        settings='{"outputs": {"low_pass": {"frequency": 80.0}}, "output_rate": 500.0}',
    )  # fmt: skip
    arrays = {name: whole[name] for name in whole} | {"sensor_acceleration": B(whole["time"])}
    quantities = dict(whole.quantities)
    quantities["sensor_acceleration"] = REQUESTED["sensor_acceleration"]
    coordinates = dict(whole.coordinates) | {"sensor": ("floor_front",), "axis": tuple("xyz")}
    result = Result(arrays, quantities, coordinates, whole.attributes, whole.profiles)
    t = (0.4 + np.arange(round(on.length / SPEED * RATE) - 1)) / RATE
    floor = [f"sensor_acceleration:floor_front:{axis}" for axis in "yz"]
    names = {f"c{k}": {"quantity": q} for k, q in enumerate([*CHANNELS, *floor])}
    how = MeasurementFile.model_validate({
        "format": "railsim-measurement/1", "name": "m", "file": ["a.csv"], "rate": RATE,
        "speed": SPEED, "channels": names,
    })  # fmt: skip
    read = [MEASURED[q[0]](t, None, (int(q[2]) - 1, int(q.endswith("right")))) for q in CHANNELS]
    read += [M(t, None, (0, k)) for k in (1, 2)]
    run = Measurement(
        how, t, SPEED * t, np.full(len(t), SPEED), dict(zip(names, read, strict=True))
    )
    found = railsim.validate_model(run, result)
    assert not any("moved" in remark for remark in found.remarks)
    pairs = [pair for one in found.comparisons for pair in one.pairs]
    begins = sorted({pair.begin for pair in pairs})
    middle = begins[len(begins) // 2]  # far from the ends of the record
    length = next(pair.end for pair in pairs if pair.begin == middle) - middle
    section = TestSection("", middle, middle + length, 300.0 * turn or np.inf, 0.1, SPEED)
    expected = [values_of(*own, section, turn, t) for own in ((MEASURED, M), (SIMULATED, B))]
    seen = {}
    for pair in pairs:
        if pair.begin == middle:
            both = seen.setdefault((pair.quantity, pair.place), ([], []))
            for values, value in zip(both, (pair.measured, pair.simulated), strict=True):
                values.append(value)
    assert seen.keys() == expected[0].keys()
    scale = {"Q": 1e4, "Y": 1e4, "s": 1e4, "b": 0.5}
    for key, both in seen.items():
        near = 3e-5 if key[0].startswith("Y_over_Q") else 3e-3 * scale[key[0][0]]
        for values, wanted in zip(both, expected, strict=True):
            assert values == pytest.approx(wanted[key], rel=4e-3, abs=near), key


def equally_loaded(on):
    """A result in which all wheels have the same load, low-passed at 80 Hz."""
    return made(
        on,
        SPEED,
        rate=RATE,
        Q=lambda t, s: np.tile(load(t)[:, None, None], (1, 4, 2)),
        settings='{"outputs": {"low_pass": {"frequency": 80.0}}, "output_rate": 200.0}',
    )


@pytest.mark.parametrize("dies", [0.0, 700.0])
def test_sections_in_which_a_channel_rests_are_counted_and_left_out(dies):
    """One wheel's load rests from `dies` on, the other's does not: that one has all sections."""
    on = track(*curve(300.0, 900.0), cant=0.12)
    result = equally_loaded(on)
    t = np.arange(round(on.length / SPEED * RATE)) / RATE
    how = MeasurementFile.model_validate(
        {
            "format": "railsim-measurement/1",
            "name": "m",
            "file": ["a.csv"],
            "rate": RATE,
            "speed": SPEED,
            "channels": {f"c{k}": {"quantity": f"Q:1:{SIDES[k]}"} for k in (0, 1)},
        }
    )
    channels = {"c0": np.where(SPEED * t < dies, load(t), 55e3), "c1": load(t)}
    found = railsim.validate_model(
        Measurement(how, t, SPEED * t, np.full(len(t), SPEED), channels), result
    )
    places = [pair.place for pair in found["Q_max"].pairs]
    names = sorted(set(places), key=places.count)
    every, left = places.count(names[-1]), places.count(names[0]) if len(names) > 1 else 0
    assert every > 8
    assert left == 0 if dies == 0.0 else 0 < left < every
    words = f"m: c0 does not change in {every - left} of {every} sections: a dead sensor?"
    assert [r for r in found.remarks if r.startswith(words)]
    assert not [r for r in found.remarks if r.startswith("m: c1 does not change")]


def run_of(name, speed, load=None, track=None):
    made_of = SimpleNamespace(track=track, load=load)
    part, elsewhere = (SimpleNamespace(speed=np.full(10, x)) for x in (speed, 3.0 * speed))
    return SimpleNamespace(
        name=name,
        definition=made_of,
        speed=elsewhere.speed,
        part=lambda begin, end: part if begin == 50.0 < end else elsewhere,
    )


class Made(dict):
    """Arrays of a result and what else a comparison asks of it."""

    def __init__(self, speed, load=None):
        time = np.array([1.0, 11.0])
        super().__init__(time=time, distance=50.0 + speed * (time - 1.0))
        self.load = load

    def vehicle(self):
        return self


def test_a_measured_run_has_the_one_result_at_its_speed_and_in_its_load():
    results = {
        "slow": Made(20.0),
        "fast": Made(40.0),
        "laden": Made(20.0, "laden"),
        "other": Made(20.41),
    }
    runs = [run_of("a", 39.3), run_of("b", 20.4, "laden"), run_of("c", 19.7)]
    assert matched_results(runs[:2], results) == [results["fast"], results["laden"]]
    with pytest.raises(InputError) as refused:
        matched_results([*runs, run_of("d", 10.0), run_of("e", 20.2)], results)
    none, two = str(refused.value).strip().splitlines()[-2:]
    wanted = "one on any track at {} m/s in load 'design'"
    names = "there are slow, fast, laden, other"
    assert none.strip() == f"d: 0 results; {wanted.format('30.0')}; {names}"
    assert two.strip() == f"e: 2 results: slow, other; {wanted.format('60.6')}; name the file"


@pytest.mark.parametrize("wheelset", [1, 4])
@pytest.mark.parametrize(("over", "sections"), [(10.9, 8), (10.0, 7)])
def test_sections_lie_where_channel_and_reference_body_have_both_been(wheelset, over, sections):
    """A record over 8 sections of 70 m and 10.9 m in a curve; the wheelset is 10.78 m off the body.

    The leading one was nowhere in the first 10.78 m, the trailing one not in the last ones.
    """
    on = track(*curve(300.0, 1000.0), cant=0.12)
    result = equally_loaded(on)
    first, last = (round(s / SPEED * RATE) for s in (250.0, 250.0 + 8.0 * 70.0 + over))
    t = np.arange(first, last + 1) / RATE
    how = MeasurementFile.model_validate(
        {
            "format": "railsim-measurement/1",
            "name": "m",
            "file": ["a.csv"],
            "rate": RATE,
            "speed": SPEED,
            "channels": {"c": {"quantity": f"Q:{wheelset}:left"}},
        }
    )
    run = Measurement(how, t, SPEED * t, np.full(len(t), SPEED), {"c": load(t)})
    begins = sorted({pair.begin for pair in railsim.validate_model(run, result)["Q_max"].pairs})
    begin = SPEED * t[0] + max(0.0, OFFSETS[wheelset - 1])
    assert begins == pytest.approx(begin + 70.0 * np.arange(sections))
