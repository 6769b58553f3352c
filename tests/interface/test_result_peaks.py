"""Peaks and mid-curve values of a result whose arrays are known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from example_result import arrays, attributes, example_result

from railsim import load_track
from railsim.notation import QUANTITIES
from railsim.result import Result, mid_curves, peak, peaks
from railsim.result.tables import full_curve_table, full_curves_table


def small(values, distance=(0.0, 10.0, 20.0), **facts):
    return Result(
        {"time": [0.0, 1.0, 2.0], "distance": distance, "Q": values},
        {name: QUANTITIES[name] for name in ("time", "distance", "Q")},
        {"wheelset": ["lead"], "side": ["left", "right"]},
        {**attributes(), **facts},
    )


def test_peak_names_value_wheel_and_time():
    result = small([[[1.0, 2.0]], [[3.0, -7.0]], [[5.0, 6.0]]])
    largest = peak(result, "Q")
    assert (largest.value, largest.time, largest.distance) == (-7.0, 1.0, 10.0)
    assert largest.labels == {"wheelset": "lead", "side": "right"}
    assert largest.shown == pytest.approx(-0.007)
    assert peak(result, "Q", "max").value == 6.0
    assert peak(result, "Q", "min").value == -7.0


@pytest.mark.parametrize("more", [1e-9, -1e-9])
def test_of_equal_wheels_the_first_is_named(more):
    """Which of both is larger by rounding decides about no name and no sign."""
    result = small([[[1.0, -1.0]], [[7.0, -7.0 * (1.0 + more)]], [[5.0, -6.0]]])
    for kind, side in (("abs", "left"), ("max", "left"), ("min", "right")):
        assert peak(result, "Q", kind).labels["side"] == side
    assert peak(result, "Q").value == 7.0
    assert peak(small([[[1.0, 7.0]], [[-7.0, 7.0]], [[np.nan, 6.0]]]), "Q").value == -7.0


def test_peak_of_all_steps_has_their_time_and_place():
    """Largest and smallest of every wheel between the stored instants, as a run keeps them."""
    whole = small([[[1.0, 2.0]], [[3.0, -7.0]], [[5.0, 6.0]]])
    of_steps = {
        "Q": np.array([[[5.5, 8.0]], [[0.5, -9.0]]]),
        "Q_time": np.array([[[1.9, 0.3]], [[0.1, 0.7]]]),
        "Q_distance": np.array([[[19.0, 3.0]], [[1.0, 7.0]]]),
    }
    about = whole.quantities, whole.coordinates, whole.attributes
    result = Result({n: whole[n] for n in whole}, *about, groups={"peaks": of_steps})
    found = {kind: peak(result, "Q", kind) for kind in ("abs", "max", "min")}
    assert [found[k].value for k in found] == [-9.0, 8.0, -9.0]
    assert [found[k].time for k in found] == [0.7, 0.3, 0.7]
    assert [found[k].distance for k in found] == [7.0, 3.0, 7.0]
    assert {found[k].labels["side"] for k in found} == {"right"}


def test_peak_leaves_out_the_start():
    """From the attribute `evaluation_start` on; files without it count as a whole."""
    values = [[[9.0, 2.0]], [[3.0, -7.0]], [[5.0, 6.0]]]
    assert peak(small(values), "Q").value == 9.0
    late = peak(small(values, evaluation_start=1.0), "Q")
    assert (late.value, late.time, late.distance) == (-7.0, 1.0, 10.0)
    assert peak(small(values, evaluation_start=9.0), "Q").value == 9.0  # nothing is in it


def waves(rate=200.0, **facts):
    """A wheel load of 100 kN with 10 kN at 2 Hz and 30 kN at 60 Hz for 20 s, 20 m/s."""
    time = np.arange(0.0, 20.0, 1.0 / rate)
    load = 1e5 + 1e4 * np.sin(4.0 * np.pi * time) + 3e4 * np.sin(120.0 * np.pi * time)
    Q = np.stack([load, 0.5 * load], axis=-1)[:, None]
    return Result(
        {"time": time, "distance": 250.0 + 20.0 * time, "Q": Q, "Y": 0.1 * Q, "Y_over_Q": Q / Q},
        {name: QUANTITIES[name] for name in ("time", "distance", "Q", "Y", "Y_over_Q")},
        {"wheelset": ["lead"], "side": ["left", "right"]},
        {**attributes(), **facts},
    )


def test_peaks_after_the_low_pass_of_20_hz():
    """The wave of 60 Hz is gone to 1/sqrt(1 + 3^8), that of 2 Hz is whole; Y/Q after it."""
    found = {each.quantity.name: each for each in peaks(waves(1000.0))}
    rest = 1e5 + 1e4 + 3e4 / np.sqrt(1.0 + 3.0**8)
    assert found["Q"].value == pytest.approx(1.4e5, rel=1e-3)
    assert found["Q"].smooth == pytest.approx(rest, rel=2e-3)
    assert found["Q"].record()["low_pass_20_hz"] == found["Q"].smooth
    assert found["Y_over_Q"].smooth == pytest.approx(-0.1, rel=1e-6)  # left: outwards negative


@pytest.mark.parametrize("part", [slice(5, None), slice(None, -14)])
def test_low_pass_of_20_hz_is_none_at_the_ends_of_a_record(part):
    """Where it begins or ends at a crest of 60 Hz its mirror image leaves 130 instead of 110 kN."""
    whole = waves(1200.0)  # 20 instants a wave, crests from the sixth on
    about = whole.quantities, whole.coordinates, whole.attributes
    (found,) = peaks(Result({name: whole[name][part] for name in whole}, *about), ["Q"])
    assert found.smooth == pytest.approx(1e5 + 1e4 + 3e4 / np.sqrt(1.0 + 3.0**8), rel=2e-3)


def test_low_pass_of_20_hz_of_sums_and_changes_of_load():
    """At 25 Hz 1/sqrt(1 + 1.25^8) is left; wheels of a wheelset have static loads of their own."""
    time = np.arange(0.0, 20.0, 1e-3)
    wave, left = np.sin(50.0 * np.pi * time), 1.0 / np.sqrt(1.0 + 1.25**8)
    Q0 = np.array([[1e5, 6e4]])
    Q = Q0 * (1.0 + np.array([0.1, 0.3]) * wave[:, None, None])
    Y = np.array([[5e3, 2e3]]) * wave[:, None, None]
    values = {
        "time": time, "distance": 20.0 * time, "Q": Q, "Q0": Q0, "Y": Y, "dQ_over_Q0": Q / Q0 - 1.0,
        "sum_Y": Y.sum(axis=-1), "sum_abs_Y": np.abs(Y).sum(axis=-1),
    }  # fmt: skip
    labels = {"wheelset": ["lead"], "side": ["left", "right"]}
    facts = {**attributes(), "evaluation_start": 2.0}
    result = Result(values, {name: QUANTITIES[name] for name in values}, labels, facts)
    found = {(each.quantity.name, each.kind): each for each in peaks(result)}
    assert abs(found["sum_Y", "abs"].smooth) == pytest.approx(left * 7e3, rel=2e-3)
    assert found["dQ_over_Q0", "max"].smooth == pytest.approx(left * 0.3, rel=2e-3)
    assert found["dQ_over_Q0", "min"].smooth == pytest.approx(-left * 0.3, rel=2e-3)
    # |sin| is 2/pi and waves of 50 Hz and above
    assert found["sum_abs_Y", "abs"].smooth == pytest.approx(2.0 / np.pi * 7e3, rel=0.02)
    early = {name: x.copy() if name == "Q" else x for name, x in values.items()}
    early["Q"][:500] *= 3.0  # before the part that is evaluated
    (late,) = peaks(Result(early, result.quantities, labels, facts), ["Q"])
    assert late.smooth == pytest.approx(1e5 * (1.0 + 0.1 * left), rel=2e-3)


def test_a_lifted_wheel_has_no_quotient_of_the_ringing_of_the_low_pass():
    """Y is 0.4 Q and 3 kN at 15 Hz: at 5 % of 100 kN static load 1.0 at most, without load any."""
    result = waves(1000.0)
    time = result["time"]
    load = np.maximum(0.0, 1e5 * (1.0 + 1.3 * np.cos(2.0 * np.pi * time)) / 2.3)
    side = 0.4 * load + 3e3 * np.sin(30.0 * np.pi * time)
    arrays = {name: result[name] for name in result}
    arrays |= {
        "Q": np.stack([load, load], axis=-1)[:, None],
        "Y": np.stack([-side, side], axis=-1)[:, None],
        "Q0": np.full((1, 2), 1e5),
    }
    lifted = Result(
        arrays, {**result.quantities, "Q0": QUANTITIES["Q0"]}, result.coordinates, result.attributes
    )
    (found,) = (each for each in peaks(lifted, ["Y_over_Q"]))
    assert 0.5 < found.smooth <= 1.01


@pytest.mark.parametrize(("share", "smooth"), [(0.053, 0.9), (0.047, 0.1)])
def test_quotient_after_the_low_pass_counts_above_a_twentieth_of_the_static_load(share, smooth):
    """Y/Q is 0.1 under full load and 0.9 while the wheel carries a share of it, for 6 s."""
    whole = waves(1000.0)
    time = whole["time"]
    part = np.interp(time, [4.0, 6.0, 12.0, 14.0], [0.0, 1.0, 1.0, 0.0])
    part = part**2 * (3.0 - 2.0 * part)  # without kinks, which ring
    Q = 1e5 * (1.0 - (1.0 - share) * part)
    Y = Q * np.where(Q / (share * 1e5) < 1.04, 0.9, 0.1)
    arrays = {
        "time": time, "distance": whole["distance"], "Q0": np.full((1, 2), 1e5),
        "Q": np.stack([Q, Q], axis=-1)[:, None], "Y": np.stack([-Y, Y], axis=-1)[:, None],
    }  # fmt: skip
    arrays["Y_over_Q"] = np.abs(arrays["Y"] / arrays["Q"])
    quantities = {name: QUANTITIES[name] for name in arrays}
    (found,) = peaks(Result(arrays, quantities, whole.coordinates, attributes()), ["Y_over_Q"])
    assert found.smooth == pytest.approx(smooth, rel=0.2)


@pytest.mark.parametrize("result", [waves(40.0), small([[[1.0, 2.0]]] * 3)])
def test_no_low_pass_of_outputs_that_are_too_seldom(result):
    (found,) = (each for each in peaks(result, ["Q"]) if each.quantity.name == "Q")
    assert found.smooth is None
    assert "low_pass_20_hz" not in found.record()


def test_low_pass_needs_outputs_two_and_a_half_times_a_period():
    assert [peaks(waves(rate), ["Q"])[0].smooth is None for rate in (49.0, 51.0)] == [True, False]


def test_full_curve_values_are_medians_with_their_scatter():
    """Of a sine the percentiles 15.87 and 84.13 lie at 0.8778 of its amplitude to either side.

    R 250 m from 360 to 420 m; of the 60 m in the full curve the first third is left out.
    """
    (curve,) = mid_curves(waves(1000.0))
    assert curve.full_curve == pytest.approx((380.0, 420.0))
    assert curve.medians["Y"][0] == pytest.approx([1e4, 5e3], rel=2e-3)
    only = waves(1000.0)
    flat = Result(
        {**{name: only[name] for name in ("time", "distance")}, "Q": np.sin(only["Q"] / 1e4)},
        {name: QUANTITIES[name] for name in ("time", "distance", "Q")},
        {"wheelset": ["lead"], "side": ["left", "right"]},
        attributes(),
    )
    (curve,) = mid_curves(flat)
    rows = (flat["distance"] >= 380.0) & (flat["distance"] <= 420.0)
    low, high = np.percentile(flat["Q"][rows], [15.87, 84.13], axis=0)
    np.testing.assert_allclose(curve.scatter["Q"], 0.5 * (high - low))
    assert curve.record()["medians"]["Q"] == curve.medians["Q"].tolist()
    # a scatter that is shown as 0, or that is not known, is not shown
    for scatter, shown in (
        ([1234.0, 4.9], ["60.00 ± 1.23", "60.00"]),
        ([np.nan, 0.0], ["60.00"] * 2),
    ):
        values = {"medians": {"Q": np.full((1, 2), 60e3)}, "scatter": {"Q": np.array([scatter])}}
        table = full_curve_table(flat, replace(curve, **values))
        assert [row[-1] for row in table.rows] == shown


@pytest.mark.parametrize(
    ("offsets", "full", "words"),
    [
        (
            (7.2, -23.2),
            (383.2 + 29.6 / 3.0, 412.8),
            "s = 393.1 to 412.8 m",
        ),  # two cars, first leads
        ((40.0, -40.0), (390.0, 390.0), "shorter than the vehicle"),
    ],
)
def test_a_vehicle_is_in_the_full_curve_wherever_its_reference_body_stands(offsets, full, words):
    """From 360 to 420 m, the last wheelset behind its begin, the first before its end."""
    waved = waves(1000.0)
    arrays = {name: waved[name] for name in waved.quantities}
    arrays["wheelset_distance"] = waved["distance"][:, None] + np.array([offsets])
    arrays = {
        name: np.repeat(values, 2, axis=1) if name in ("Q", "Y", "Y_over_Q") else values
        for name, values in arrays.items()
    }
    quantities = {name: QUANTITIES[name] for name in arrays}
    names = {"wheelset": ["lead", "trail"], "side": ["left", "right"]}
    result = Result(arrays, quantities, names, attributes())
    (curve,) = mid_curves(result)
    assert curve.full_curve == pytest.approx(full)
    table = full_curve_table(result, curve)
    assert words in str(table)
    assert [column.heading for column in table.columns][-2:] == ["1", "2"]


def test_many_curves_are_a_line_each_with_their_largest_medians():
    result = small([[[1.0, 2.0]]] * 3)
    curves = [
        SimpleNamespace(
            radius=radius,
            full_curve=(begin, begin + 50.25),
            medians={"Q": None},
            median_peaks=[SimpleNamespace(quantity=QUANTITIES["Q"], value=value)],
        )
        for radius, begin, value in ((250.0, 10.0, 61e3), (-300.0, 400.0, 7e4))
    ]
    table = full_curves_table(result, curves)
    assert table.texts() == [
        ["250 m", "10.0 to 60.2", "61.00"],
        ["-300 m", "400.0 to 450.2", "70.00"],
    ]


def in_the_curve(*courses, **track):
    """Result whose wheel loads follow `courses` of the time from the begin of the full curve.

    One of both wheels of a wheelset, or those of the left and the right wheels, one axle after
    another.  The vehicle is in the full curve for 3 s; of these the last two count.
    """
    time = np.arange(round(25.0 * 200.0)) / 200.0
    loads = [60e3 + 1e3 * course(np.maximum(time - 18.0, 0.0)) for course in courses]
    loads = 2 * loads if len(loads) == 1 else loads
    facts = attributes()
    if track:
        facts["track_toml"] = load_track("curve_r250").replace(**track).to_toml()
    Q = np.stack(loads, axis=-1).reshape(len(time), -1, 2)
    arrays = {"time": time, "distance": 20.0 * time, "Q": Q}
    quantities = {name: QUANTITIES[name] for name in arrays}
    names = {"wheelset": [f"axle {k + 1}" for k in range(Q.shape[1])], "side": ["left", "right"]}
    return mid_curves(Result(arrays, quantities, names, facts))[0]


@pytest.mark.parametrize(
    ("course", "settling"),
    [
        (lambda t: np.exp(-t) * np.cos(2.0 * np.pi * 0.6 * t), True),  # sway of the car body
        (lambda t: np.exp(-2.0 * t) * np.cos(2.0 * np.pi * 5.0 * t), True),
        (lambda t: 0.1 * t, True),
        (lambda t: np.cos(2.0 * np.pi * 5.0 * t), False),  # hunting
        # in 2 s through the median five times and six times
        (lambda t: np.cos(2.0 * np.pi * 1.25 * t - 0.25 * np.pi), True),
        (lambda t: np.cos(2.0 * np.pi * 1.5 * t), False),
        # in the second of two seconds 0.37 and 0.44 times the mean square of the first one
        (lambda t: 0.37 ** (0.5 * t) * np.cos(2.0 * np.pi * 20.0 * t), True),
        (lambda t: 0.44 ** (0.5 * t) * np.cos(2.0 * np.pi * 20.0 * t), False),
        (lambda t: 0.0 * t, False),
    ],
)
def test_scatter_of_values_that_decay_is_called_settling(course, settling):
    curve = in_the_curve(course)
    assert curve.settling is curve.record()["settling"] is settling
    rough = [{"type": "random", "spectrum": "erri_b176_low"}]
    assert not in_the_curve(course, irregularities=rough).settling


@pytest.mark.parametrize(("decaying", "settling"), [(1, False), (2, False), (3, True), (4, True)])
def test_a_curve_is_settling_where_more_than_half_of_its_values_are(decaying, settling):
    def decays(t):
        return np.exp(-2.0 * t) * np.cos(10.0 * np.pi * t)

    def hunts(t):
        return np.cos(10.0 * np.pi * t)

    courses = decaying * [decays] + (4 - decaying) * [hunts]
    assert in_the_curve(*courses).settling is settling


def test_full_curve_has_both_its_first_and_its_last_instant():
    """From 380 to 420 m, with instants at both: of 3, 1, 2, 9 the median is 2.5."""
    distance = [379.0, 380.0, 385.0, 395.0, 420.0, 421.0]
    arrays = {"time": np.arange(6.0), "distance": distance, "Q": np.zeros((6, 1, 2))}
    arrays["Q"][:, 0] = np.array([-50.0, 3.0, 1.0, 2.0, 9.0, 80.0])[:, None] * [1.0, -1.0]
    quantities = {name: QUANTITIES[name] for name in arrays}
    names = {"wheelset": ["lead"], "side": ["left", "right"]}
    (curve,) = mid_curves(Result(arrays, quantities, names, attributes()))
    np.testing.assert_allclose(curve.medians["Q"], [[2.5, -2.5]])


def test_peak_leaves_out_what_is_not_a_number():
    assert peak(small([[[np.nan, 2.0]], [[3.0, 1.0]], [[0.0, np.nan]]]), "Q").value == 3.0


def test_unloading_and_overload_are_both_listed():
    found = [p.value for p in peaks(example_result()) if p.quantity.name == "dQ_over_Q0"]
    values = arrays()["dQ_over_Q0"]
    assert found == [values.max(), values.min()]


def test_mid_curve_values_are_those_at_the_middle_of_the_circle():
    (middle,) = mid_curves(example_result())
    assert middle.radius == pytest.approx(250.0)
    assert middle.time == pytest.approx(390.0 / 20.0)
    np.testing.assert_allclose(middle.values["wheelset_yaw"][0], -9.6e-3)
    yaw = next(p for p in middle.peaks if p.quantity.name == "wheelset_yaw")
    assert yaw.value == pytest.approx(-9.6e-3)
    assert yaw.labels == {"wheelset": "front.outer.wheelset"}


def test_mid_curve_values_are_interpolated_between_instants():
    result = small([[[0.0, 0.0]], [[1.0, 2.0]], [[2.0, 4.0]]], distance=[380.0, 385.0, 395.0])
    (middle,) = mid_curves(result)
    np.testing.assert_allclose(middle.values["Q"], [[1.5, 3.0]])


def test_no_mid_curve_values_before_the_curve():
    assert mid_curves(example_result(duration=15.0)) == ()
