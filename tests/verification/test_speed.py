"""Speed along the track, start, continuation, outputs in equal steps of distance."""

import numpy as np
import pytest
from dynamics import Settings, load_track, load_vehicle
from rig import test_vehicle
from selection import points

import railsim
from railsim.errors import Fault, InputError
from railsim.kernels.contact_columns import J_CROSS
from railsim.kernels.rhs import right_hand_side
from railsim.kernels.state import velocity_begin
from railsim.kernels.status import RUNNING
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.work import work_arrays
from railsim.result import open_result
from railsim.result.tables import result_parts
from railsim.simulation import Simulation, preparation, run_in, simulate

RAMP = ((0.0, 10.0), (50.0, 10.0), (150.0, 30.0), (200.0, 30.0))


def in_table(rows=RAMP, **more):
    return Settings(drive={"mode": "table", "speed_table": rows}, **more)


def speeds(result):
    """Speed of the reference body from its distances [m/s], between outputs."""
    return np.diff(result.distance) / np.diff(result.time)


@pytest.fixture(scope="module")
def bogie():
    return test_vehicle("single_bogie")


@pytest.fixture(scope="module")
def straight():
    return load_track("straight")


def test_speed_beside_a_table_is_that_of_the_table(bogie, straight):
    """Another one would have no effect."""
    settings = in_table()
    first = RAMP[0][1]
    assert simulate(bogie, straight, speed=first, settings=settings, until=1.0).speed == first
    with pytest.raises(InputError, match=f"found {first + 5:g} m/s; none, or {first:g} m/s"):
        simulate(bogie, straight, speed=first + 5.0, settings=settings, until=1.0)


def test_speed_table_is_met(bogie, straight):
    """V(s) of the table at every output, by the state's own speed: round-off of the table."""
    result = simulate(bogie, straight, settings=in_table(), until=200.0)
    assert result.status == "complete"
    end = result.groups["state"]["end"]
    assert end[-1] == pytest.approx(np.interp(end[-2], *np.array(RAMP).T), abs=1e-6)
    middle = 0.5 * (result.distance[1:] + result.distance[:-1])
    smooth = (np.abs(middle - 50.0) > 1.0) & (np.abs(middle - 150.0) > 1.0)
    smooth[-1] = False
    # mean over an interval of 5 ms against the table's value in its middle: V'' dt^2/24 < 1e-5
    expected = np.interp(middle, *np.array(RAMP).T)
    assert np.max(np.abs(speeds(result) - expected)[smooth]) < 1e-4


def test_run_passes_its_end_by_less_than_a_step_and_says_where_its_last_output_lies(
    bogie, straight
):
    """Outputs have equal steps of time: the last one lies up to 5 ms before the end."""
    result = simulate(bogie, straight, settings=in_table(), until=110.0)
    s, v = result.groups["state"]["end"][-2:]
    assert 110.0 <= s < 110.0 + v * result.attributes["step"] * 1.001
    last = result.distance[-1]
    assert last < 110.0 < last + v / 200.0
    assert (
        f"complete: the run reached its end; last output at t = {result.time[-1]:.3f} s, "
        f"s = {last:.2f} m" in result_parts(result)[0]
    )


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (RAMP, "asks for 6 m/s2 between 50 and 150 m"),  # 30 m/s of 0.2 m/s per m
        (((0.0, 10.0), (100.0, 10.0), (100.01, 20.0)), "asks for 2e+04 m/s2 between 100 and"),
        (((0.0, 20.0), (40.0, 10.0)), None),  # 5 m/s2
        (((0.0, 20.0),), None),
    ],
)
def test_steps_of_the_speed_are_remarked_on(rows, said):
    """A step within one step of the run has no force at all, whatever the bodies weigh."""
    found = in_table(rows).unusual()
    assert [remark.key for remark in found] == ["drive.speed_table"] * (said is not None)
    assert said is None or said in found[0].text


def test_ramp_pushes_the_bogie_with_mass_times_acceleration(bogie, straight):
    """Held reference: the wheelsets' rolling needs I/r0 V' at the rails, and nothing sways."""
    result = simulate(bogie, straight, settings=in_table(), until=140.0)
    assert np.max(np.abs(result.wheelset_lateral)) < 1e-7
    assert np.max(np.abs(result.Q.sum(axis=(1, 2)) / result.Q0.sum() - 1.0)) < 1e-2


@pytest.mark.parametrize("speed", [1.0, 3.0, 100.0])
def test_runs_from_1_to_100_m_s(straight, speed):
    """The step follows the speed; a small disturbance of a stable coach stays small.

    0.1 mm aside at unchanged height and roll the wheel loads change by 1.5 dy tan(gamma)/p, some
    6 % of an approach of 60 um; after 0.1 s the wheelset has found its height.
    """
    coach = load_vehicle("coach_flexicoil")
    initial = {"front.outer.wheelset": {"y": 1e-4}} if speed < 50.0 else {}
    result = simulate(
        coach,
        straight,
        speed=speed,
        duration=min(4.0, 200.0 / speed),
        settings=Settings(initial=initial),
    )
    assert result.status == "complete"
    assert np.max(np.abs(result.wheelset_lateral)) < 1.5e-4
    assert np.max(np.abs(result.dQ_over_Q0)) < 0.1
    assert np.max(np.abs(result.dQ_over_Q0[result.time > 0.1])) < 5e-3


@pytest.mark.further
def test_jump_at_low_speed_is_off_by_the_square_of_the_step(straight):
    """Creep forces stiffen as 1/V: at 3 m/s a wheelset 2 mm aside falls into place in 0.1 s.

    The first milliseconds of that jump, which no vehicle makes, are shorter than the step.  What
    they leave behind is off by 2 % of the largest force at the default step, and by a quarter of
    that at half of it.  On irregular rails at this speed the step is converged: test_step_halving.
    """
    coach = load_vehicle("coach_manchester")
    settings = Settings(initial={"front.outer.wheelset": {"y": 2e-3}})
    whole = simulate(coach, straight, speed=3.0, duration=2.0, settings=settings)
    half, quarter = (
        simulate(coach, straight, speed=3.0, duration=2.0, settings=settings.replace(step=step))
        for step in (0.625e-3, 0.3125e-3)
    )
    late = whole.time > 0.1
    largest = np.max(np.abs(quarter.Y[late]))
    assert largest > 1e3
    error = np.max(np.abs(half.Y - whole.Y)[late])
    assert error < 0.03 * largest
    assert np.max(np.abs(quarter.Y - half.Y)[late]) < error / 3.0


def test_wheelsets_that_stand_alike_are_damped_alike_at_walking_pace(straight):
    """Aside and yawed by the same: the last patch couples its directions as the first one does.

    And once more: nothing is left of the evaluation before.
    """
    model = assemble(load_vehicle("coach_manchester"), straight, Settings())
    system, state = model.system, equilibrium(model, 0.5).state.copy()
    body, begin = system.contact.body, velocity_begin(system.bodies.kind.size)
    for first in (0, begin):
        for k in range(first, first + 6):
            state[6 * body + k] = state[6 * body[0] + k]
    state[6 * body + 1], state[6 * body + 5] = 3e-3, 2e-3
    work = work_arrays(system)
    status, _, _ = right_hand_side(system, work, state, np.zeros_like(state))
    assert status == RUNNING
    found = work.contact_jacobian[body]
    assert abs(found[0, J_CROSS : J_CROSS + 3]).max() > 50.0  # kg/s; those of the first one
    np.testing.assert_allclose(found, found[:1].repeat(len(body), axis=0), rtol=1e-6, atol=1e-3)
    right_hand_side(system, work, state, np.zeros_like(state))
    np.testing.assert_array_equal(work.contact_jacobian[body], found)


def test_a_disturbance_of_its_own_is_refused_where_a_run_goes_on(bogie, straight):
    """It would have no effect; that of the first run, or none, is no other."""
    pushed, more = (Settings(initial={"front.outer.wheelset": {"y": y}}) for y in (1e-3, 2e-3))
    first = simulate(bogie, straight, speed=10.0, duration=0.2, settings=pushed)
    for settings in (pushed, Settings()):
        assert simulate(bogie, straight, resume=first, duration=0.1, settings=settings).status
    with pytest.raises(InputError, match=r"settings\.initial: given, and the run has no start"):
        simulate(bogie, straight, resume=first, duration=0.1, settings=more)


@pytest.mark.parametrize("start", [123.4, 390.0, 700.0])
def test_start_anywhere(start):
    """On the straight nothing happens, in the curve the vehicle has settled."""
    wagon, track = test_vehicle("single_bogie"), load_track("curve_r500")
    result = simulate(wagon, track, speed=10.0, start=start, duration=1.0)
    assert result.distance[0] == start
    assert result.distance[-1] == pytest.approx(start + 10.0)
    assert np.max(np.abs(result.Q / result.Q[0] - 1.0)) < 0.02


@points("start", [330.0, 355.0, 425.0], always=(0, 2))
def test_start_on_a_transition_is_the_state_on_the_way(start):
    """In the transitions of R 250 m the vehicle stands on the twist that it came over.

    0.5 kN: the run from the beginning of the track has other steps to this position.
    """
    coach, track = load_vehicle("coach_manchester"), load_track("curve_r250")
    here = simulate(coach, track, speed=20.0, start=start, duration=0.5)
    way = simulate(coach, track, speed=20.0, until=start + 10.0)
    row = int(np.argmin(np.abs(way.distance - start)))
    rows = slice(row, row + len(here.time))
    assert way.distance[row] == pytest.approx(start, abs=1e-6)
    assert np.max(np.abs(here.Q - way.Q[rows])) < 500.0
    assert np.max(np.abs(here.Y - way.Y[rows])) < 500.0


@pytest.mark.parametrize("start", [0.0, 100.0])
def test_start_on_irregular_rails_makes_no_shock(straight, start):
    """The vehicle comes over the irregular rails before: loads change no more than on the way.

    1.2 times the largest change of a run that passes there.  Put on leaning rails at rest instead,
    a wheelset's springs and elastic contacts (60 um) would unload its wheels.
    """
    track = straight.replace(
        irregularities=[{"type": "random", "spectrum": "erri_b176_low", "seed": 1}]
    )
    coach = load_vehicle("coach_manchester")
    here = simulate(coach, track, speed=40.0, start=start, duration=0.5)
    way = simulate(coach, track, speed=40.0, until=120.0)
    usual = np.max(np.abs(way.dQ_over_Q0[way.distance > 40.0]))
    assert (here.time[0], here.distance[0]) == (0.0, start)
    assert np.max(np.abs(here.dQ_over_Q0)) < 1.2 * usual


def test_start_on_irregular_rails_is_the_state_on_the_way(straight):
    """What was met more than 4 s before the start is forgotten: 1 % of the largest force."""
    track = straight.replace(
        irregularities=[{"type": "random", "spectrum": "erri_b176_low", "seed": 1}]
    )
    coach = load_vehicle("coach_manchester")
    here = simulate(coach, track, speed=20.0, start=150.0, duration=1.0)
    way = simulate(coach, track, speed=20.0, until=170.0)
    rows = way.distance > 150.0 - 1e-6
    assert np.max(np.abs(here.Y - way.Y[rows])) < 0.01 * np.max(np.abs(way.Y[rows]))


def test_start_where_the_run_in_leaves_the_rails_comes_over_the_whole_track(straight, monkeypatch):
    """Then it is the state of the run from the beginning; the scheme's memory begins anew: 1 %."""
    track = straight.replace(
        irregularities=[{"type": "random", "spectrum": "erri_b176_low", "seed": 1, "begin": 10.0}]
    )
    coach = load_vehicle("coach_manchester")
    way = simulate(coach, track, speed=20.0, until=150.0)
    usual = run_in.settle_in_curve

    def refused(model, balance, track, start, step, progress):
        if start > 1.0:
            raise InputError([Fault("--start", "", "off the rails", "another position")])
        return usual(model, balance, track, start, step, progress)

    monkeypatch.setattr(run_in, "settle_in_curve", refused)
    here = simulate(coach, track, speed=20.0, start=140.0, until=150.0)
    rows = way.distance > 140.0 - 1e-6
    np.testing.assert_allclose(here.Y, way.Y[rows], atol=0.01 * np.max(np.abs(way.Y)))


@points("speed", [2.0, 6.0], always=(1,))
def test_start_in_a_curve_at_walking_speed_is_the_state_on_the_way(speed):
    """All wheelsets are in the curve by then: 0.2 % of the largest load, wheel by wheel.

    A run-in of ten seconds alone would end before the last wheelset has reached the curve.  On
    elastic rails: on rigid ones friction at the flange lets the loads vibrate by 5 %.
    """
    coach, track = load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    here = simulate(coach, track, speed=speed, start=390.0, duration=0.01)
    way = simulate(coach, track, speed=speed, start=290.0, until=390.0)
    np.testing.assert_allclose(here.Q[0], way.Q[-1], atol=2e-3 * np.max(way.Q[-1]))


@pytest.mark.further
def test_progress_of_a_run_counts_its_run_in():
    seen = []
    simulate(
        load_vehicle("coach_manchester"),
        load_track("curve_r250"),
        speed=2.0,
        start=390.0,
        duration=2.0,
        progress=seen.append,
    )
    assert seen == sorted(seen)
    assert seen[0] == 0.0
    assert seen[-1] == 1.0
    # 112 m in calls of ten thousand steps of 0.25 ms, behind the judgement of the step
    assert sum(0.0 < fraction < 0.9 for fraction in seen) >= 2


# continuation -------------------------------------------------------------------------------------


def test_continued_run_needs_no_run_in(straight, monkeypatch):
    coach = load_vehicle("coach_manchester")
    first = simulate(coach, straight, speed=20.0, until=5.0)

    def refused(*arguments):
        raise AssertionError("a run-in")

    monkeypatch.setattr(preparation, "start_state", refused)
    assert simulate(coach, straight, resume=first, until=10.0).status == "complete"


CASES = {
    "constant": (20.0, Settings()),
    "rk4": (20.0, Settings(scheme="rk4", step=0.5e-3)),
    "free": (20.0, Settings(drive={"mode": "free", "resistance": (500.0, 0.0, 4.0)})),
    "table": (None, in_table()),
    "distance": (None, in_table(output_spacing=0.25)),
}


@points(
    ("name", "case"),
    [("articulated_three_bogies", "constant"), *(("two_axle_wagon", case) for case in CASES)],
    always=(0, 3, 5),
)
def test_continued_run_gives_the_same_bytes(case, name, straight, tmp_path):
    """Through memory and through a file."""
    speed, settings = CASES[case]
    vehicle = test_vehicle(name)
    track = straight.replace(
        irregularities=[{"type": "random", "spectrum": "erri_b176_low", "seed": 3, "begin": 10.0}]
    )
    whole = simulate(vehicle, track, speed=speed, until=60.0, settings=settings)
    # the first part ends at an output of the whole run
    row = len(whole.time) // 2
    end = float(whole.distance[row])
    first = simulate(vehicle, track, speed=speed, settings=settings, until=end)
    first.to_hdf5(tmp_path / "first.h5")
    for begin in (first, open_result(tmp_path / "first.h5")):
        second = simulate(vehicle, track, settings=settings, resume=begin, until=60.0)
        for quantity in ("time", "distance", "Q", "Y", "body_position", "body_acceleration"):
            there, here = np.asarray(whole[quantity])[row:], np.asarray(second[quantity])
            assert np.array_equal(there, here), quantity


# outputs in distance ------------------------------------------------------------------------------


@points("scheme", ["fast", "rk4"], always=(0,))
@pytest.mark.parametrize(
    "settings",
    [
        Settings(output_spacing=0.25),
        in_table([(0.0, 10.0), (20.0, 10.0), (120.0, 30.0)], output_spacing=0.25),
        Settings(output_spacing=0.25, drive={"mode": "free", "resistance": (20e3, 0.0, 0.0)}),
    ],
)
def test_outputs_in_equal_steps_of_distance(bogie, straight, settings, scheme):
    """Also while the speed changes: within a micrometre of 0.25 m."""
    constant = settings.drive.mode != "table"
    result = simulate(
        bogie,
        straight,
        speed=10.0 if constant else None,
        until=30.0,
        settings=settings.replace(scheme=scheme),
    )
    assert result.status == "complete"
    inner = np.diff(result.distance)[:-1]
    assert np.max(np.abs(inner - 0.25)) < 1e-6


@pytest.mark.parametrize(
    ("drive", "speed", "spacing", "reason"),
    [
        ({"mode": "table", "speed_table": [[0.0, 0.5], [10.0, 5.0]]}, None, 2.5, "its end"),
        ({"mode": "free", "resistance": (60e3, 0.0, 0.0)}, 5.0, 0.5, "standstill"),
    ],
)
def test_outputs_in_equal_steps_of_distance_from_low_speed_and_to_a_standstill(
    bogie, straight, drive, speed, spacing, reason
):
    """The speed doubles, or is gone, within an interval; taken in parts, the run has its bits."""
    settings = Settings(output_spacing=spacing, drive=drive)
    way = {"speed": speed, "until": 10.0, "settings": settings}
    result = simulate(bogie, straight, **way)
    assert reason in result.attributes["status_reason"]
    assert np.all(np.diff(result["time"]) > 0.0)
    inner = result["distance"] / spacing
    assert np.max(np.abs(inner - np.round(inner))[:-1]) < 1e-5
    with Simulation(bogie, straight, **way) as sim:
        while sim.step(0.0331):
            pass
        stepped = sim.result()
    assert np.array_equal(stepped["Q"], result["Q"])
