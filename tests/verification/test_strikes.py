"""Wheels that lift and strike, bodies on stops: divided steps against the reference; peaks.

A dip of 1 m and 2 mm at 40 m/s, in which the wheels leave the rail for milliseconds.  The reference
is RK4 at 0.125 ms; at 0.0625 ms its peaks change by less than 1e-4.
"""

import numpy as np
import pytest
import xarray
from dynamics import Settings, load_track, load_vehicle
from selection import points
from test_loads import wagon

import railsim
from railsim.definitions.loading import load_track as load_any_track
from railsim.definitions.mirror import mirrored_track, mirrored_vehicle
from railsim.definitions.vehicle.definition import Vehicle
from railsim.kernels.state import N_SCALARS
from railsim.kernels.support import LMS, STEP_RATIO, SUPPORT_SIZE
from railsim.simulation import simulate
from railsim.simulation.remarks import MOST_Q

SPEED, UNTIL = 40.0, 36.0
AT = {"type": "dip", "s": 20.0, "length": 1.0, "depth": 2e-3}


def over_the_dip(rail="left", support="rigid", vehicle="coach_manchester", **settings):
    track = load_track("straight").replace(
        irregularities=[{**AT, "rail": rail}], support={"preset": support}
    )
    return simulate(
        load_vehicle(vehicle), track, speed=SPEED, until=UNTIL, settings=Settings(**settings)
    )


def peak_values(result):
    return {(p.quantity.name, p.kind): p.value for p in railsim.peaks(result)}


@pytest.mark.parametrize("vehicle", ["coach_manchester", "metro_b_trailer"])
def test_wheels_that_ring_come_to_rest_on_smooth_rails(vehicle):
    """The contact damps by 1/e in some 10 ms; at 1.67 ms divided steps kept it ringing."""
    dropped = {name: {"z": 1e-4} for name in ("front.outer.wheelset", "rear.inner.wheelset")}
    vehicle, track = load_vehicle(vehicle), load_track("straight")
    result = simulate(vehicle, track, speed=20.0, until=20.0, settings=Settings(initial=dropped))
    assert result.attributes["step"] == 5e-3 / 3.0
    assert result.attributes["steps_divided"] > 0
    late = np.asarray(result["time"]) > 0.6
    assert np.abs(np.diff(result.Q[late], axis=0)).max() < 1e-3 * result.Q0.min()


@points(
    ("rail", "support", "vehicle"),
    [
        (rail, support, vehicle)
        for vehicle in ("coach_manchester", "coach_flexicoil")
        for rail, support in (("left", "rigid"), ("both", "rigid"), ("left", "co-running"))
    ],
    always=(2, 3),
)
def test_peaks_of_a_strike_are_those_of_the_reference(rail, support, vehicle):
    result = over_the_dip(rail, support, vehicle)
    reference = over_the_dip(rail, support, vehicle, scheme="rk4", step=0.125e-3, output_rate=1e3)
    elastic = 2.5e-3 if vehicle == "coach_manchester" else 5e-3 / 3.0
    assert result.attributes["step"] == (1.25e-3 if support == "rigid" else elastic)
    found, expected = peak_values(result), peak_values(reference)
    # 0.4 % of the ring's amplitude from parts of 0.1 ms; sum_Y takes the errors of both wheels
    for name, tolerance in (("Q", 0.01), ("sum_abs_Y", 0.02)):
        assert found[name, "abs"] == pytest.approx(expected[name, "abs"], rel=tolerance)
    assert found["dQ_over_Q0", "min"] == expected["dQ_over_Q0", "min"] == -1.0


def test_peaks_do_not_depend_on_the_output_rate():
    runs = [over_the_dip(output_rate=rate) for rate in (50.0, 200.0, 800.0)]
    assert {run.attributes["step"] for run in runs} == {1.25e-3}
    for run in runs[1:]:
        for name, values in run.groups["peaks"].items():
            np.testing.assert_array_equal(values, runs[0].groups["peaks"][name])
    # what the samples miss
    assert np.max(runs[0].Q) < 0.9 * peak_values(runs[0])["Q", "abs"]


def test_few_steps_are_divided_where_nothing_strikes():
    """None in a smooth curve; on rough rigid rails, where wheel loads swing, a fifth of them.

    Behind parts of a step the steps at most double, so each blow takes some four of 1.67 ms.
    """
    coach = load_vehicle("coach_manchester")
    rough = load_track("straight").replace(
        irregularities=[{"type": "random", "spectrum": "erri_b176_low", "seed": 1}]
    )
    curve = load_track("curve_r250")
    for track, speed, until, share in ((curve, 20.0, 400.0, 0.0), (rough, 40.0, 150.0, 0.2)):
        result = simulate(coach, track, speed=speed, until=until)
        steps = result.time[-1] / result.attributes["step"]
        assert result.attributes["steps_divided"] <= share * steps


def test_run_that_ends_while_a_wheel_rings_goes_on_to_the_same_bytes():
    whole = over_the_dip()
    coach, track = whole.vehicle(), whole.track()
    first = simulate(coach, track, speed=SPEED, until=10.0)  # the leading wheelset is in the dip
    assert 0 < first.attributes["steps_divided"] < whole.attributes["steps_divided"]
    second = simulate(coach, track, until=UNTIL, resume=first)
    np.testing.assert_array_equal(second.groups["state"]["end"], whole.groups["state"]["end"])


@points(("support", "tolerance"), [("ballasted", 5e-3 * 68.8e3), ("rigid", 1e-2)], always=(0,))
def test_mirrored_irregular_curve_has_the_same_divided_steps(support, tolerance):
    """Which steps are divided depends on the contacts alone, not on the side they are on.

    On elastic rails round-off decides now and then whether a contact is evaluated again or its
    forces are corrected by their slopes: a few tenths of a per cent of the wheel load.
    """
    track = load_any_track("en14363_zone4").replace(support={"preset": support})
    coach, how = load_vehicle("coach_manchester"), {"speed": 23.0, "start": 180.0, "until": 290.0}
    here = simulate(coach, track, **how)
    there = simulate(mirrored_vehicle(coach), mirrored_track(track), **how)
    for name in ("steps", "steps_divided", "evaluations"):
        assert here.attributes[name] == there.attributes[name]
    assert np.max(np.abs(here.Q - there.Q[:, :, ::-1])) < tolerance
    assert np.max(np.abs(here.Y + there.Y[:, :, ::-1])) < tolerance


HEAVIER = "bodies.carbody.mass=35e3"
IRREGULAR = [{"type": "random", "spectrum": "erri_b176_low", "seed": 1}]


def test_run_on_irregular_elastic_rails_goes_on_to_the_same_bytes():
    """What slopes have learnt is part of the state."""
    coach = load_vehicle("coach_manchester")
    track = load_any_track("straight").replace(irregularities=IRREGULAR)
    whole = simulate(coach, track, speed=SPEED, until=60.0)
    first = simulate(coach, track, speed=SPEED, until=33.0)
    state = first.groups["state"]["end"][:-N_SCALARS]
    assert np.count_nonzero(state[-SUPPORT_SIZE:][LMS:STEP_RATIO]) > 7
    second = simulate(coach, track, until=60.0, resume=first)
    np.testing.assert_array_equal(second.groups["state"]["end"], whole.groups["state"]["end"])
    for name in ("steps", "steps_divided", "evaluations", "contacts_evaluated_again"):
        parts = first.attributes[name] + second.attributes[name]
        # the evaluation that records the end of the first is done again by the second
        assert 0 <= parts - whole.attributes[name] <= 1


def test_recorded_patches_change_no_bit_of_a_run_on_elastic_rails():
    """Where patches are recorded no wheelset is left out of a further evaluation."""
    coach = load_vehicle("coach_manchester")
    track = load_any_track("straight").replace(irregularities=IRREGULAR)
    plain, recorded = (
        simulate(
            coach,
            track,
            speed=60.0,  # hunts
            until=40.0,
            settings=Settings(outputs={"contact_patches": patches}),
        )
        for patches in (False, True)
    )
    assert plain.attributes["contacts_evaluated_again"] > 100
    np.testing.assert_array_equal(plain.groups["state"]["end"], recorded.groups["state"]["end"])
    N = np.nansum(recorded["patch_N"], axis=3)
    assert np.all((N > 0.0) == (plain.Q > 0.0))


def test_peaks_are_at_least_those_of_the_outputs():
    result = over_the_dip()
    for name in (
        "Q",
        "Y",
        "Y_over_Q",
        "sum_Y",
        "sum_abs_Y",
        "T_gamma",
        "wheelset_lateral",
        "wheelset_roll",
        "wheelset_yaw",
        "dQ_over_Q0",
    ):
        largest, smallest = result.groups["peaks"][name]
        round_off = 1e-12 * np.abs(largest)  # outputs are computed apart
        assert (largest >= np.nanmax(result[name], axis=0) - round_off).all()
        assert (smallest <= np.nanmin(result[name], axis=0) + round_off).all()


def test_file_holds_peaks_with_units_times_and_distances(tmp_path):
    result = over_the_dip()
    path = result.to_hdf5(tmp_path / "run.h5")
    assert railsim.peaks(railsim.open_result(path)) == railsim.peaks(result)
    with xarray.open_dataset(path, group="peaks", engine="h5netcdf") as data:
        assert data.Q.dims == ("extreme", "wheelset", "side")
        assert list(data.extreme.values) == ["max", "min"]
        assert [data[name].units for name in ("Q", "Q_time", "Q_distance")] == ["N", "s", "m"]
        largest = data.Q.sel(extreme="max")[0, 0]
        assert float(largest) == result.groups["peaks"]["Q"][0, 0, 0]


def test_lifted_wheels_are_remarked_on():
    remark = over_the_dip().remarks[0]  # another one says that the wheels ring afterwards
    assert "lifts off its rail: front.outer.wheelset, left" in remark
    assert "4 wheels in all" in remark


def test_wheels_that_lift_in_the_start_alone_are_said_to():
    assert "leave out" not in over_the_dip().remarks[0]
    lifts = over_the_dip(outputs={"evaluate_after": 0.88}).remarks[0]
    assert lifts.endswith("all within the start of the run, which tables of peaks leave out.")


def test_forces_beyond_experience_are_remarked_on():
    track = load_track("straight").replace(irregularities=[{**AT, "depth": 8e-3, "rail": "left"}])
    result = simulate(load_vehicle("coach_manchester"), track, speed=SPEED, until=UNTIL)
    assert result.status == "complete"
    largest = np.max(result.groups["peaks"]["Q"][0] / result.Q0)
    assert largest > MOST_Q
    assert f"The largest Q is {largest:.3g} times the static wheel load" in result.remarks[0]


# stops between bodies -----------------------------------------------------------------------------


def box_on_a_stop(step):
    """A box of 1 t hits a lateral stop of 50 MN/m at 0.6 m/s, and rebounds."""
    mass, stiffness = 1e3, 5e7
    data = wagon().model_dump(exclude_none=True)
    place = [0.0, 0.0, -1.2]
    data["bodies"]["box"] = {"mass": mass, "inertia": [1e3, 1e3, 1e3], "position": place}
    data["elements"] = {
        "hold": {
            "kind": "bushing",
            "bodies": ["body", "box"],
            "point": place,
            "stiffness": [1e7, 1e3, 1e7],
            "rotational_stiffness": [1e7, 1e7, 1e7],
        },
        "stop": {
            "kind": "bump_stop",
            "bodies": ["body", "box"],
            "point": place,
            "axis": "y",
            "table": [[0.0, 0.0], [0.003, 0.0], [1.0, 0.997 * stiffness]],
        },
        "push": {
            "kind": "applied_force",
            "bodies": ["box"],
            "force_table": [[0.0] * 4, [0.01, 0.0, 60.0 * mass, 0.0], [0.02, 0.0, 0.0, 0.0]],
        },
    }
    result = simulate(
        Vehicle.model_validate(data),
        load_track("straight"),
        speed=10.0,
        duration=0.08,
        settings=Settings(step=step, output_rate=1000.0, outputs={"elements": ["stop"]}),
    )
    box = list(result.coordinates["body"]).index("box")
    return result, result.body_velocity[:, box, 1]


def test_a_bounce_on_a_stop_gives_back_what_it_took():
    """A stop has no damping; at a step of 1 ms, not divided, the box left it 5.9 % too fast."""
    result, rate = box_on_a_stop(1e-3)
    _, fine = box_on_a_stop(0.05e-3)
    assert 0 < result.attributes["steps_divided"] < 80
    assert rate.min() == pytest.approx(fine.min(), rel=0.005)
    assert rate.max() == pytest.approx(fine.max(), rel=0.005)
