"""An undamped, frictionless vehicle conserves energy: springs and contact are potentials."""

import numpy as np
import pytest
from dynamics import Settings, advance, energy, load_track, load_vehicle, steady, undamped

from railsim.simulation.run_in import follow_rails

FRICTIONLESS = {"friction": (0.0, 0.0)}
FREE = Settings(contact_damping=0.0, drive={"mode": "free"})


def disturbed(model, state):
    """A lively state: wheelsets off centre into the flange root, bodies bouncing and swaying."""
    state = state.copy()
    n = model.index.n_bodies
    car = model.index.coordinate("carbody", 0)
    state[car + 1] += 0.02
    state[6 * n + car + 2] += 0.1
    state[6 * n + car + 3] += 0.02
    for wheelset, y in zip(model.index.wheelsets, (0.004, -0.004, 0.003, 0.001), strict=True):
        index = model.index.coordinate(wheelset, 0)
        state[index + 1] += y
        state[6 * n + index + 1] += 0.05
    return state


@pytest.fixture(
    scope="module",
    params=[pytest.param("coach_manchester", marks=pytest.mark.further), "coach_flexicoil"],
)
def setting(request):
    vehicle = undamped(load_vehicle(request.param))
    track = load_track("straight").replace(**FRICTIONLESS)
    balance = steady(vehicle, track, FREE, 20.0)
    return balance.model, disturbed(balance.model, balance.state)


def drift(model, state, h, duration=0.5):
    after = advance(model.system, state, h, round(duration / h), model=model)
    return energy(model.system, after) - energy(model.system, state)


def test_energy_of_an_undamped_frictionless_coach_is_constant(setting):
    """Exchanged: some 2 kJ.  Left: the step's error and round-off of the 11 MJ total (1e-8)."""
    model, state = setting
    assert abs(drift(model, state, 0.125e-3)) < 1.0


def test_energy_error_falls_with_the_integrators_order(setting):
    """RK4 is of order 4 on smooth forces; p^1.5 at touch-down lowers it, hence 8 and not 16."""
    model, state = setting
    coarse = abs(drift(model, state, 0.5e-3))
    fine = abs(drift(model, state, 0.25e-3))
    assert fine < coarse / 8.0


def test_energy_is_constant_through_a_curve_when_the_coach_runs_free():
    """On curved and canted track, gravity, frames and gyroscopic terms must balance as well."""
    vehicle = undamped(load_vehicle("coach_manchester"))
    track = load_track("curve_r250").replace(**FRICTIONLESS)
    balance = steady(vehicle, track, FREE, 20.0)
    model = balance.model
    state = disturbed(model, balance.state)
    state[-2] = 285.0
    assert abs(drift(model, state, 0.125e-3, duration=2.0)) < 5.0


def test_energy_is_constant_on_irregular_rails_when_the_coach_runs_free():
    """All four displacements of the rails do work through the force along the track alone."""
    vehicle = undamped(load_vehicle("coach_manchester"))
    rough = {"type": "random", "spectrum": "erri_b176_high", "seed": 3, "fade": 0.0}
    track = load_track("curve_r250").replace(**FRICTIONLESS, irregularities=[rough])
    balance = steady(vehicle, track, FREE, 20.0)
    model = balance.model
    state = disturbed(model, balance.state)
    state[-2] = 285.0
    follow_rails(model, state)
    assert abs(drift(model, state, 0.125e-3, duration=2.0)) < 5.0


def test_energy_is_constant_on_undamped_elastic_rails():
    """Rails, pads, sleepers and ballast with masses and without damping take part in it.

    The rails ring at 700 to 1500 Hz, which RK4 damps with the fifth power of the step.
    """
    support = {
        "preset": "co-running",
        "pad_vertical": [150e6, 0.0],
        "pad_lateral": [30e6, 0.0],
        "ballast_vertical": [140e6, 0.0],
        "ballast_lateral": [70e6, 0.0],
    }
    vehicle = undamped(load_vehicle("coach_manchester"))
    track = load_track("straight").replace(**FRICTIONLESS, support=support)
    balance = steady(vehicle, track, FREE, 20.0)
    model, state = balance.model, disturbed(balance.model, balance.state)
    coarse, fine = (abs(drift(model, state, h, duration=0.25)) for h in (0.0625e-3, 0.03125e-3))
    assert fine < 0.5
    assert fine < coarse / 20.0


def test_forces_are_gradients_of_the_energy(setting):
    """Power of all forces = rate of kinetic energy: dE/dt = 0 by central difference of E."""
    model, state = setting
    h = 1e-5
    ahead = advance(model.system, state, h, 1, model=model)
    behind = advance(model.system, state, -h, 1, model=model)
    rate = (energy(model.system, ahead) - energy(model.system, behind)) / (2 * h)
    # energies of 1.1e7 J in double precision over 2e-5 s leave 1e-9 * 1.1e7 / 2e-5 = some 1e-1 W
    assert abs(rate) < 2.0
    assert np.isfinite(rate)
