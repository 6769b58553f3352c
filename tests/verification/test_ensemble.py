"""Runs of several vehicles in one call: each is what it is alone.

They share no force, only the call.  Where FASTSIM is written in vector registers the results are
equal to the last bit; otherwise the compiler may round sums of few patches in another way than
those of many, hence `ROUND_OFF`.
"""

import numpy as np
import pytest
from rig import test_vehicle
from selection import points

from railsim import load_track, load_vehicle, simulate, simulate_together
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import InputError, ModelError
from railsim.kernels.contact_table import N_PATCH
from railsim.kernels.fastsim_simd import available
from railsim.model.assembly import SharedTables, assemble
from railsim.model.time_step import empty_recorder
from railsim.result import MemorySink
from railsim.simulation import outcomes, step_choice
from railsim.simulation.ensemble import Ensemble

COACH = "coach_manchester"
ROUND_OFF = 1e-9  # of the largest value: some operations' rounding, carried along for seconds
INTO_THE_CURVE = {"speed": 20.0, "start": 280.0, "duration": 3.0}


def coach(*changes):
    return load_vehicle(COACH, changes)


def with_mass(mass):
    return coach(f"bodies.carbody.mass={mass}")


def overturned(after=1.0, torque=2e6):
    """A coach that a torque throws over [s], [N m]."""
    rows = [[after, 0.0, 0.0, 0.0], [after + 0.2, torque, 0.0, 0.0]]
    gust = {"kind": "applied_force", "bodies": ["carbody"], "torque_table": rows}
    data = coach().model_dump(exclude_none=True)
    return Vehicle.model_validate(data | {"elements": {"gust": gust}})


def assert_same(run, alone):
    assert run.attributes["status_reason"] == alone.attributes["status_reason"]
    assert list(run) == list(alone)
    share = 0.0 if available() else ROUND_OFF
    for name in alone:
        finite = alone[name][np.isfinite(alone[name])]  # one that blows up ends in inf
        bound = share * np.max(np.abs(finite), initial=0.0)
        np.testing.assert_allclose(run[name], alone[name], rtol=0.0, atol=bound, err_msg=name)
    end, expected = (result.groups["state"]["end"] for result in (run, alone))
    np.testing.assert_allclose(end, expected, rtol=0.0, atol=share)
    counts = "patches_evaluated", "patches_out_of_range", "contacts_evaluated_again"
    for fact in ("step", *counts, "vehicle_toml", "duration"):
        assert run.attributes[fact] == alone.attributes[fact], fact


def assert_each_is_alone(vehicles, track, together=None, **how):
    """Run vehicles in one call and one by one; returns the results of the one call."""
    results = simulate_together(vehicles, track, **how)
    for result, vehicle in zip(results, vehicles, strict=True):
        assert_same(result, simulate(vehicle, track, **how))
    expected = together or [len(vehicles)] * len(vehicles)
    assert [result.attributes["runs_together"] for result in results] == expected
    return results


def test_parameters_of_a_coach_through_a_curve_with_all_outputs():
    """Masses, springs and dampers; elements, contact patches and the track are recorded too."""
    vehicles = [
        with_mass(40e3),
        coach("assemblies.bogie.elements.anti_roll_bar.stiffness=500e3"),
        coach("assemblies.bogie.elements.secondary_lateral_damper.damping=20e3"),
    ]
    settings = Settings(
        outputs={
            "elements": ["front.outer.primary.*", "*.secondary_lateral_damper.*"],
            "contact_patches": True,
            "track": True,
        }
    )
    heavy, *_ = assert_each_is_alone(
        vehicles, load_track("curve_r250"), settings=settings, **INTO_THE_CURVE
    )
    assert np.abs(heavy.Y).max() > 10e3  # into the curve indeed


def test_vehicles_with_memory_on_irregular_rails():
    """Maxwell dampers, friction pads and bump stops of different vehicles beside each other."""
    track = load_track("straight").replace(
        irregularities=[{"type": "random", "spectrum": "erri_b176_low"}]
    )
    vehicles = [load_vehicle("coach_flexicoil"), test_vehicle("two_axle_wagon"), coach()]
    settings = Settings(step=1e-3)  # the same for all, the wagon would take another one
    assert_each_is_alone(vehicles, track, speed=25.0, start=100.0, duration=2.0, settings=settings)


@points("law", ["table", "fastrip", "polach", "linear"], always=(2,))
def test_every_patch_has_its_own_creep_force(law):
    settings = Settings(creep_law=law)
    assert_each_is_alone(
        [coach(), with_mass(35e3)], load_track("curve_r250"), settings=settings, **INTO_THE_CURVE
    )


def test_runge_kutta():
    settings = Settings(scheme="rk4", step=0.25e-3)  # on elastic rails they choose different steps
    assert_each_is_alone([coach(), with_mass(35e3)], load_track("curve_r250"), speed=20.0,
                         start=280.0, duration=0.5, settings=settings)  # fmt: skip


def test_one_speed_table_and_outputs_in_equal_steps_of_distance():
    drive = {"mode": "table", "speed_table": [[0.0, 20.0], [100.0, 20.0], [140.0, 17.0]]}
    settings = Settings(drive=drive, output_spacing=0.5)
    results = assert_each_is_alone(
        [coach(), with_mass(35e3)], load_track("straight"), until=150.0, settings=settings
    )
    np.testing.assert_allclose(np.diff(results[0].distance), 0.5, atol=1e-3)


def test_the_one_that_overturns_while_speeds_and_intervals_change():
    """What the others counted and recorded before is counted and recorded once."""
    drive = {"mode": "table", "speed_table": [[0.0, 20.0], [20.0, 20.0], [60.0, 17.0]]}
    settings = Settings(drive=drive, output_spacing=0.5)
    vehicles = [coach(), overturned(), with_mass(35e3)]
    results = assert_each_is_alone(vehicles, load_track("straight"), until=70.0, settings=settings)
    assert [result.status == "complete" for result in results] == [True, False, True]


def test_the_one_that_finds_no_step_on_the_way_fails_by_itself(monkeypatch):
    """Preparation goes well; at a lower speed one vehicle has no stable step."""
    drive = {"mode": "table", "speed_table": [[0.0, 20.0], [5.0, 20.0], [15.0, 15.0]]}
    vehicles = [coach(), with_mass(35e3)]

    class NoStepForTheSecond(step_choice.Stability):
        def __init__(self, model, system, state, *how):
            if state[-1] < 17.0 and model.system.bodies.mass[0] == 35e3:
                raise ModelError("no stable step")
            super().__init__(model, system, state, *how)

    monkeypatch.setattr(step_choice, "Stability", NoStepForTheSecond)
    fine, failure = outcomes(vehicles, load_track("straight"), until=20.0,
                             settings=Settings(drive=drive))  # fmt: skip
    assert fine.status == "complete"
    assert failure.status == "stopped"  # and kept, up to there
    assert "no stable step" in failure.attributes["status_reason"]


def test_the_one_that_overturns_ends_as_alone_and_the_others_go_on():
    vehicles = [coach(), overturned(), with_mass(35e3), overturned(after=1.5)]
    results = assert_each_is_alone(vehicles, load_track("straight"), speed=20.0, duration=4.0)
    assert [result.status == "complete" for result in results] == [True, False, True, False]
    assert results[1].time[-1] < results[3].time[-1] < 3.0


def test_the_one_that_blows_up_ends_as_alone_and_the_others_go_on():
    """A torque beyond all bounds: its numbers overflow, no others are touched."""
    results = assert_each_is_alone([coach(), overturned(torque=1e308)], load_track("straight"),
                                   speed=20.0, duration=2.0)  # fmt: skip
    assert [result.status for result in results] == ["complete", "stopped"]
    assert "not finite" in results[1].attributes["status_reason"]


@pytest.mark.further
def test_steps_that_differ_part_the_runs():
    light = coach("assemblies.bogie.assemblies.axle.wheelsets.wheelset.mass=250")
    rigid = load_track("straight").replace(support={"preset": "rigid"})
    results = assert_each_is_alone([coach(), light, with_mass(35e3)], rigid, [2, 1, 2],
                                   speed=20.0, duration=0.5)  # fmt: skip
    assert results[1].attributes["step"] < results[0].attributes["step"]


def test_free_running_vehicles_run_apart():
    settings = Settings(drive={"mode": "free", "resistance": [2000.0, 0.0, 5.0]})
    assert_each_is_alone([coach(), with_mass(35e3)], load_track("straight"), [1, 1], speed=20.0,
                         duration=0.5, settings=settings)  # fmt: skip


def test_one_vehicle_is_an_ensemble_of_one():
    assert_each_is_alone([coach()], load_track("straight"), speed=20.0, duration=0.2)


def test_a_vehicle_without_equilibrium_fails_by_itself():
    """The body hangs on nothing: no spring with preload carries it."""
    loose = coach(
        *(
            f"assemblies.bogie.elements.secondary_spring.{key}"
            for key in ("preload=[0.0, 0.0, 0.0]", "stiffness=[160e3, 160e3, 0.0]")
        )
    )
    vehicles, track = [coach(), loose, with_mass(35e3)], load_track("straight")
    first, failure, last = outcomes(vehicles, track, speed=20.0, duration=0.2)
    assert isinstance(failure, ModelError)
    assert first.status == last.status == "complete"
    with pytest.raises(ModelError, match="no static equilibrium") as caught:
        simulate_together(vehicles, track, speed=20.0, duration=0.2)
    assert caught.value.__notes__ == ["this was vehicle 2 of 3"]


def test_output_that_cannot_be_written_ends_its_own_run_only():
    class Full(MemorySink):
        def append(self, chunk):
            raise OSError("no space left")

    failure, other = outcomes([coach(), coach()], load_track("straight"), speed=20.0, duration=0.2,
                              sinks=[Full(), MemorySink()])  # fmt: skip
    assert isinstance(failure, OSError)
    assert other.status == "complete"


def test_wrong_inputs_of_all_are_refused_at_once():
    with pytest.raises(InputError, match="speed"):
        simulate_together([coach(), coach()], load_track("straight"), speed=-1.0)


def test_progress_covers_all_runs_and_times_are_shared():
    seen = []
    results = simulate_together([coach(), overturned(), coach()], load_track("straight"),
                                speed=20.0, duration=8.0, progress=seen.append)  # fmt: skip
    assert seen == sorted(seen)
    assert seen[0] == 0.0
    assert seen[-1] == pytest.approx(1.0)
    assert results[0].attributes["cpu_time"] > results[1].attributes["cpu_time"] > 0.0


def models(vehicles, track):
    shared = SharedTables()
    return [assemble(vehicle, track, Settings(), None, shared) for vehicle in vehicles]


def test_nothing_large_is_copied():
    members = models([with_mass(m) for m in (35e3, 40e3, 45e3)], load_track("curve_r250"))
    joint = Ensemble(members, [empty_recorder(model, 1) for model in members]).system
    for model in members:
        assert np.shares_memory(joint.contact.values, model.system.contact.values)
        assert np.shares_memory(joint.track.coefficients, model.system.track.coefficients)
    assert len(joint.frame_offset) == len(members[0].system.frame_offset)
    assert len(joint.bodies.kind) == 3 * len(members[0].system.bodies.kind)


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.further
def test_different_wheels_have_their_tables_side_by_side():
    track = load_track("curve_r250")
    worn = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.profile=cone_1in20"
    vehicles = [coach(), coach(worn)]
    members = models(vehicles, track)
    joint = Ensemble(members, [empty_recorder(model, 1) for model in members]).system
    assert joint.contact.values.shape[:2] == (2, N_PATCH)
    np.testing.assert_array_equal(joint.contact.table, np.repeat([0, 1], 4)[:, None] * [1, 1])
    assert_each_is_alone(vehicles, track, **INTO_THE_CURVE)


def test_states_come_back_as_they_went_in():
    members = models([coach(), test_vehicle("two_axle_wagon")], load_track("straight"))
    ensemble = Ensemble(members, [empty_recorder(model, 1) for model in members])
    rng = np.random.default_rng(0)
    common = 1e-3, 1.0, 2.0, 3.0  # last step, time, distance, speed
    own = [model.n_state - len(common) for model in members]
    states = [np.append(rng.normal(size=size), common) for size in own]
    joint = ensemble.state(states)
    assert len(joint) == sum(own) + len(common)
    for part, state in zip(ensemble.parts, states, strict=True):
        np.testing.assert_array_equal(joint[part.state], state)
