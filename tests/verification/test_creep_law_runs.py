"""Every creep law in the time loop: the law of `creep_force`, limits, friction of the track."""

import logging
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from dynamics import Settings, evaluate, load_track, load_vehicle, steady
from rig import DATA, test_vehicle
from selection import points

from railsim import cli
from railsim.contact.creep import LAWS, creep_force
from railsim.definitions.mirror import mirrored_track
from railsim.kernels import contact_columns as columns
from railsim.kernels.contact_table import A1, B1, D_B1
from railsim.kernels.state import velocity_begin
from railsim.result import open_result
from railsim.simulation import preparation, prepare, simulate

SPEED = 20.0
MIDDLE = 390.0  # m, of the circular curve
laws = pytest.mark.parametrize("law", LAWS)
some_laws = points("law", LAWS, always=(1, 3))


def settings(law, **more):
    return Settings(creep_law=law, fastsim_grid=(20, 20), **more)


@pytest.fixture(scope="module")
def coach():
    return load_vehicle("coach_manchester")


@pytest.fixture(scope="module")
def bogie():
    return test_vehicle("single_bogie")


def curve(**changes):
    return load_track("curve_r250").replace(**changes)


def in_curve(vehicle, law, track=None, **more):
    """A short run in the curve, settled before; outputs at every 5 ms."""
    track = track or curve()
    return simulate(vehicle, track, speed=SPEED, start=MIDDLE, duration=0.2,
                    settings=settings(law, **more))  # fmt: skip


@pytest.fixture(scope="module")
def plain(coach):
    """Run in the curve by law, each once."""
    return cache(lambda law: in_curve(coach, law))


def patches(vehicle, law, track, result):
    """Work arrays at the end of a run, and how many patches carry load."""
    system = prepare(vehicle, track, settings(law), SPEED).model.system
    work, _ = evaluate(system, result.groups["state"]["end"])
    return system, work, int(work.events[:, 0].sum())


@laws
def test_loop_has_the_forces_of_creep_force(law, coach):
    """Same patches, same forces; falling friction and third body included."""
    track = curve(friction_falling={"rest": 0.5, "decay": 1.0}, third_body=(0.8, 0.5))
    _, work, n = patches(coach, law, track, in_curve(coach, law, track))
    patch = work.patch[:, :n]
    slip = patch[columns.PATCH_SPEED] * np.hypot(patch[columns.XI_X], patch[columns.XI_Y])
    mu_N = 0.4 * patch[columns.NORMAL] * (0.5 * np.exp(-1.0 * slip) + 0.5)
    np.testing.assert_allclose(patch[columns.MU_N], mu_N, rtol=1e-12)
    expected = creep_force(
        *patch[[columns.A, columns.B, columns.NORMAL]], mu_N / patch[columns.NORMAL],
        *patch[[columns.XI_X, columns.XI_Y, columns.PHI]], law=law, nx=20, ny=20, reduction=0.8,
        slip_reduction=0.5,
    )  # fmt: skip
    # the loop's table of Kalker's coefficients rounds the corners of the printed one, up to 0.9 %
    # of a slope; the tabulated law does not need it
    allowed = (1e-9 if law == "table" else 5e-3) * mu_N
    assert (np.abs(patch[columns.T_X] - expected.T_x) <= allowed).all()
    assert (np.abs(patch[columns.T_Y] - expected.T_y) <= allowed).all()
    arm = np.sqrt(patch[columns.A] * patch[columns.B])
    assert (np.abs(patch[columns.M_Z] - expected.M_z) <= allowed * arm).all()


@laws
def test_sum_of_lateral_forces_in_a_curve_does_not_depend_on_the_law(law, plain):
    """Newton's law for the whole coach: the wheels share it differently, the sum stays."""
    mean, fastsim = (plain(one).sum_Y.sum(axis=1).mean() for one in (law, "fastsim"))
    m, kappa, cant = 42.0e3, 1.0 / 250.0, 0.15
    scale = m * (SPEED**2 * kappa + 9.81 * cant / 1.5)
    # both have settled within 1 % of the forces that nearly balance here
    assert abs(mean - fastsim) < 0.01 * scale


@laws
def test_no_friction_no_creep_force(law, bogie):
    result = simulate(bogie, load_track("straight").replace(friction=0.0), speed=SPEED,
                      duration=0.5, settings=settings(law))  # fmt: skip
    assert result.status == "complete"
    assert not result.T_gamma.any()


@laws
def test_straight_track_stays_at_rest(law, bogie):
    """Zero creepage is zero force: nothing moves the bogie off the centre line."""
    result = simulate(bogie, load_track("straight"), speed=SPEED, duration=0.5,
                      settings=settings(law))  # fmt: skip
    assert result.status == "complete"
    # micrometres: the equilibrium's own round-off
    assert np.abs(result.wheelset_lateral).max() < 1e-6


@some_laws
def test_friction_that_falls_by_nothing_or_at_once(law, coach):
    """decay = 0 is friction as it is, to the last bit; decay without bound is rest times it."""
    track = curve(friction=0.5)
    plain = in_curve(coach, law, track)
    falls = {"rest": 0.5, "decay": 0.0}
    same = in_curve(coach, law, track.replace(friction_falling=falls))
    np.testing.assert_array_equal(same.Y, plain.Y)
    falls["decay"] = 1e12
    fallen = in_curve(coach, law, track.replace(friction_falling=falls))
    less = in_curve(coach, law, curve(friction=0.25))
    assert np.abs(less.Y - plain.Y).max() > 1e3
    # no patch is without slip but in the first steps of the run-in, from which 10 s have passed
    np.testing.assert_allclose(fallen.Y, less.Y, atol=1.0)


@some_laws
def test_third_body_softens_and_keeps_the_friction(law, coach, plain):
    """The curve imposes the leading wheelset's creepages: softer contact, smaller force."""
    stiff = plain(law)
    track = curve(third_body=0.25)
    soft = in_curve(coach, law, track)
    ratio = np.abs(soft.Y[-1, 0] / stiff.Y[-1, 0])
    # at normalised creepages of 4 to 5 a quarter of the stiffness leaves 3/4 of the force
    assert ((ratio > 0.6) & (ratio < 0.95)).all()
    _, work, n = patches(coach, law, track, soft)
    size = np.hypot(work.patch[columns.T_X, :n], work.patch[columns.T_Y, :n])
    # the bound summed over 20 x 20 cells exceeds mu N by 0.5 %
    assert (size <= 1.005 * work.patch[columns.MU_N, :n]).all()


@pytest.mark.parametrize("law", ["table", "polach"])
def test_mirrored_track_gives_the_mirrored_run(law, coach):
    track = curve(friction=(0.3, 0.4), friction_falling={"rest": 0.6, "decay": 0.5},
                  third_body=0.7)  # fmt: skip
    right, left = in_curve(coach, law, track), in_curve(coach, law, mirrored_track(track))
    # round-off of the equilibrium, grown during the run-in
    np.testing.assert_allclose(left.Y[:, :, ::-1], -right.Y, atol=1e-2)
    np.testing.assert_allclose(left.Q[:, :, ::-1], right.Q, atol=1e-2)


def chosen_step(vehicle, law, speed):
    prepared = prepare(load_vehicle(vehicle), load_track("straight"), Settings(creep_law=law),
                       speed)  # fmt: skip
    return prepared.steps.at(speed)[0]


@pytest.mark.parametrize("vehicle", ["coach_manchester", "coach_flexicoil"])
@points("speed", [20.0, 45.0], always=(1,))
def test_table_needs_no_shorter_step_than_fastsim(vehicle, speed):
    assert chosen_step(vehicle, "table", speed) == chosen_step(vehicle, "fastsim", speed)


def test_table_needs_no_shorter_step_than_linear_theory_at_low_speed():
    """At 5 m/s the slope of the creep force limits the step; linear theory has it and is smooth.

    FASTSIM's secant over the disturbance of the stability test is a little lower than its slope,
    which gives it one output interval's fourteenth instead of fifteenth.
    """
    step = chosen_step("coach_manchester", "table", 5.0)
    assert step >= chosen_step("coach_manchester", "linear", 5.0)
    assert step >= 14.0 / 15.0 * chosen_step("coach_manchester", "fastsim", 5.0) * (1.0 - 1e-9)


def test_error_of_the_step_with_the_table_is_that_with_fastsim(coach):
    """Entry into the curve with 1 ms against 0.25 ms: a rough law would show here."""
    errors = {}
    for law in ("fastsim", "table"):
        runs = [
            simulate(coach, curve(), speed=SPEED, start=310.0, duration=3.0,
                     settings=settings(law, step=step))
            for step in (1e-3, 2.5e-4)
        ]  # fmt: skip
        # rms: the maximum is that of one instant, at which the flange strikes
        errors[law] = [
            np.sqrt(np.mean((runs[0][name] - runs[1][name]) ** 2))
            for name in ("wheelset_yaw", "wheelset_lateral", "Y", "Q")
        ]
    # the motions themselves differ by some per cent
    assert (np.array(errors["table"]) < 1.1 * np.array(errors["fastsim"])).all()


@pytest.fixture
def long_patches(monkeypatch):
    """Runs whose patches are made 90 times as long, over their width, as they are."""
    assemble = preparation.assemble

    def with_long_patches(*arguments):
        model = assemble(*arguments)
        values = model.system.contact.values.copy()
        values[..., A1] *= 90.0**0.5  # semi-axes of unit load
        values[..., B1] /= 90.0**0.5
        values[..., D_B1] /= 90.0**0.5
        values.setflags(write=model.system.contact.values.flags.writeable)  # else compiled anew
        contact = model.system.contact._replace(values=values)
        return replace(model, system=model.system._replace(contact=contact))

    monkeypatch.setattr(preparation, "assemble", with_long_patches)


@laws
def test_ellipses_beyond_the_range_are_counted_and_told(law, bogie, long_patches, caplog):
    """The run goes on with the end of the range, and says so."""
    with caplog.at_level(logging.WARNING):
        result = simulate(bogie, load_track("straight"), speed=SPEED, duration=0.1,
                          settings=settings(law))  # fmt: skip
    assert result.status == "complete"
    assert np.isfinite(result.Q).all()
    facts = result.attributes
    assert facts["patches_out_of_range"] == facts["patches_evaluated"] > 0
    (remark,) = [remark for remark in result.remarks if "range of a/b" in remark]
    assert remark in caplog.text


def test_command_says_once_that_the_range_was_left(long_patches, tmp_path, capsys):
    file = tmp_path / "run.h5"
    assert cli.main(["run", str(DATA / "single_bogie.toml"), "straight", "--speed", "20",
                     "--duration", "0.1", "--set", "settings.creep_law=polach",
                     "--out", str(file)]) == 0  # fmt: skip
    printed = "".join(capsys.readouterr())
    assert printed.count("range of a/b") == 1
    assert open_result(file).remarks[0] in printed


def test_run_within_the_range_has_no_remark(bogie):
    result = in_curve(bogie, "table")
    assert result.attributes["patches_out_of_range"] == 0
    assert not any("range" in remark for remark in result.remarks)


@pytest.mark.parametrize("k", [1.0, 0.3])
def test_slope_of_the_creep_force_is_that_on_a_third_body(k):
    """Along, of wheels that turn 0.02 % faster: what is foreseen is the force over the slip."""
    track = load_track("straight").replace(third_body=(k, k), friction=(0.9, 0.9))
    balance = steady(load_vehicle("coach_manchester"), track, settings("linear"), SPEED)
    system, state = balance.model.system, balance.state.copy()
    state[velocity_begin(system.bodies.kind.size) + 6 * system.contact.body + 4] -= 2e-4 * SPEED
    patch = evaluate(system, state)[0].patch
    patch = patch[:, patch[columns.NORMAL] > 1e4]
    expected = patch[columns.T_X] / (SPEED * patch[columns.XI_X])
    np.testing.assert_allclose(patch[columns.SECANT_ALONG], expected, rtol=0.1)
