"""Halving the step, doubling the contact table's grid: no peak moves by more than 0.5 %."""

import dataclasses

import numpy as np
import pytest
from dynamics import Settings, load_track, load_vehicle
from selection import points

import railsim.model.assembly as assembly
from railsim.contact.table import TableGrid, build_contact_table
from railsim.result.filters import low_passed
from railsim.simulation import simulate

QUANTITIES = ("dQ_over_Q0", "sum_abs_Y", "Y_over_Q", "wheelset_lateral", "wheelset_yaw")


@pytest.fixture(scope="module")
def run():
    vehicle, track = load_vehicle("coach_manchester"), load_track("curve_r250")

    def result(**settings):  # from the last metres of the straight before the transition
        return simulate(
            vehicle, track, speed=20.0, start=270.0, until=520.0, settings=Settings(**settings)
        )

    return result


@pytest.fixture(scope="module")
def default(run):
    return run()


def peaks(result):
    return {name: np.nanmax(np.abs(result[name])) for name in QUANTITIES}


@points("vehicle", ["coach_manchester", "coach_flexicoil"], always=(0,))
def test_slow_in_a_curve_the_default_step_finds_the_position_of_a_short_one(vehicle):
    """120 mm of cant excess at 5 m/s.

    The slip of wheelsets that slide along the track once alternated from step to step, which held
    the trailing bogie elsewhere: guiding forces of -9 instead of -22 kN.
    """
    lengths, cant = (20.0, 40.0, 45.0), (0.0, None, 0.15)
    track = load_track("curve_r250").replace(
        plan=[
            {"type": kind, "length": length} | ({"radius": 250.0} if kind == "CIR" else {})
            for kind, length in zip(("STR", "CLO", "CIR"), lengths, strict=True)
        ],
        cant=[
            {"type": "LIR" if value is None else "CST", "length": length}
            | ({} if value is None else {"cant": value})
            for value, length in zip(cant, lengths, strict=True)
        ],
    )
    runs = [
        simulate(load_vehicle(vehicle), track, speed=5.0, until=95.0, settings=Settings(step=step))
        for step in (None, 5e-4)
    ]
    assert runs[0].attributes["step"] >= 1e-3
    np.testing.assert_allclose(runs[0].Y, runs[1].Y, rtol=0.0, atol=100.0)
    np.testing.assert_allclose(runs[0].Y[-1], runs[1].Y[-1], rtol=0.0, atol=20.0)


@points("speed", [35.0, 30.0], always=(0,))
def test_the_long_step_follows_irregular_rigid_rails(speed):
    """Peaks within 1 % of the reference scheme, Q within 3 % rms of its standard deviation.

    Where smoothed accelerations of wheelsets lag behind those of the rails: 7.5 % rms at 30 m/s.
    """
    vehicle = load_vehicle("coach_manchester")
    track = load_track("straight").replace(
        irregularities=[{"type": "random", "spectrum": "erri_b176_low", "seed": 1}],
        support={"preset": "rigid"},
    )
    run, reference = (
        simulate(vehicle, track, speed=speed, duration=1.5, settings=Settings(**settings))
        for settings in ({}, {"scheme": "rk4", "step": 0.25e-3})
    )
    assert run.attributes["step"] == pytest.approx(5e-3 / 3.0)
    for name in ("Q", "Y", "sum_Y"):
        found, expected = (np.max(np.abs(of.groups["peaks"][name])) for of in (run, reference))
        assert found == pytest.approx(expected, rel=0.01)
    assert np.std(run.Q - reference.Q) < 0.03 * np.std(reference.Q)


def test_a_run_begins_on_irregular_rigid_rails_as_if_it_had_come_along_them():
    """Q of the first 50 ms within 0.4 kN of the reference scheme.

    Where smoothed accelerations do not begin with those of the rails: 1.1 without z, 3.5 kN
    without both.
    """
    vehicle = load_vehicle("coach_manchester")
    track = load_track("straight").replace(
        irregularities=[{"type": "random", "spectrum": "erri_b176_high", "seed": 2}],
        support={"preset": "rigid"},
    )
    run, reference = (
        simulate(vehicle, track, speed=40.0, start=50.0, duration=0.05, settings=Settings(**how))
        for how in ({}, {"scheme": "rk4", "step": 0.125e-3})
    )
    np.testing.assert_allclose(run.Q, reference.Q, rtol=0.0, atol=400.0)


@points(("hand", "speed", "friction"), [(1.0, 15.0, 0.4), (-1.0, 18.0, 0.2)], always=(0,))
def test_the_long_step_on_smooth_rigid_rails_agrees_with_the_reference_scheme(
    hand, speed, friction
):
    """Over the transition, where flanges come into contact: peaks within 0.5 %, no more than 1 %
    of the largest guiding force at any instant."""
    lengths = (30.0, 30.0, 20.0)
    plan = [
        {"type": kind, "length": length} | ({"radius": hand * 250.0} if kind == "CIR" else {})
        for kind, length in zip(("STR", "CLO", "CIR"), lengths, strict=True)
    ]
    track = load_track("curve_r250").replace(
        plan=plan, cant=[], support={"preset": "rigid"}, friction=friction
    )
    fast, reference = (
        simulate(
            load_vehicle("coach_manchester"),
            track,
            speed=speed,
            until=80.0,
            settings=Settings(**scheme),
        )
        for scheme in ({}, {"scheme": "rk4", "step": 5e-4})
    )
    assert fast.attributes["step"] == pytest.approx(5e-3 / 3.0)
    for name in ("Q", "Y", "sum_Y"):
        found, expected = (np.abs(r.groups["peaks"][name]).max() for r in (fast, reference))
        assert found == pytest.approx(expected, rel=5e-3)
    rows = min(len(fast.time), len(reference.time))  # a run may end with one more output
    difference = np.abs(fast.Y[:rows] - reference.Y[:rows])
    assert difference.max() < 0.01 * np.abs(fast.Y).max()


def test_halving_the_step_moves_no_peak_by_half_a_per_cent(run, default):
    assert peaks(run(step=0.5 * default.attributes["step"])) == pytest.approx(
        peaks(default), rel=5e-3
    )


def test_default_scheme_agrees_with_the_reference_scheme(run, default):
    """RK4 at 0.25 ms: dQ/Q0 within 0.01 percentage points, Y within 50 N at peak and mid-curve."""
    reference = run(scheme="rk4", step=0.25e-3)
    middle = int(np.argmin(np.abs(default.distance - 396.0)))
    assert default.dQ_over_Q0.max() == pytest.approx(reference.dQ_over_Q0.max(), abs=1e-4)
    assert np.abs(default.Y).max() == pytest.approx(np.abs(reference.Y).max(), abs=50.0)
    assert np.max(np.abs(default.Y[middle] - reference.Y[middle])) < 50.0
    assert default.wheelset_yaw[middle, 0] == pytest.approx(
        reference.wheelset_yaw[middle, 0], rel=1e-3
    )


@points(
    ("vehicle", "track", "speed", "until"),
    [
        ("coach_manchester", "en14363_zone2", 44.0, 480.0),  # most sensitive: close to hunting
        ("coach_flexicoil", "en14363_zone4", 23.0, 300.0),
    ],
    always=(),
)
def test_default_scheme_agrees_with_the_reference_scheme_on_irregular_elastic_rails(
    vehicle, track, speed, until
):
    """Forces after the 20 Hz low pass: largest within 0.5 %, differences 2 % of their deviation."""

    def forces(**settings):
        result = simulate(
            load_vehicle(vehicle),
            load_track(track).replace(support={"preset": "ballasted"}),
            speed=speed,
            until=until,
            settings=Settings(output_rate=1000.0, **settings),
        )
        assert result.status == "complete"
        return [low_passed(np.asarray(result[name]), 1000.0, 20.0) for name in ("Q", "Y")]

    reference = forces(scheme="rk4", step=0.25e-3)
    for found, expected in zip(forces(), reference, strict=True):
        rows = min(len(found), len(expected))  # a run may end with one more output
        found, expected = found[:rows], expected[:rows]
        assert np.abs(found).max() == pytest.approx(np.abs(expected).max(), rel=5e-3)
        assert np.sqrt(np.mean((found - expected) ** 2)) < 0.02 * np.std(expected)


@pytest.mark.xfail(reason="sum_abs_Y moves by 0.9 %, 0.5 % asked", strict=True)
@pytest.mark.further
def test_doubling_the_contact_tables_grid_moves_no_peak_by_half_a_per_cent(
    run, default, monkeypatch
):
    usual = TableGrid()
    # half the spacing in all three directions, over the range that this run needs
    finer = dataclasses.replace(
        usual,
        s_min=-0.012,
        s_max=0.010,
        ds=usual.ds / 2,
        roll_max=9e-3,
        droll=usual.droll / 2,
        yaw_max=usual.yaw_max / 2**0.5,
        n_w=usual.n_w,
    )

    def fine_table(wheel, rail, **geometry):
        return build_contact_table(wheel, rail, grid=finer, **geometry)

    monkeypatch.setattr(assembly, "cached_contact_table", fine_table)
    assert peaks(run()) == pytest.approx(peaks(default), rel=5e-3)
