"""Creep forces that follow the creepages over the patch: relaxation, steady values, memory."""

import numpy as np
import pytest

from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.kernels.contact_columns import T_Y
from railsim.kernels.rhs import right_hand_side
from railsim.kernels.state import LAST_STEP
from railsim.kernels.transient import (
    CARRYING,
    DELAYED,
    LOADED,
    PATCH_STATE,
    RATE,
    TRACED,
    TRANSIENT_SIZE,
    UNLOADED,
    transient_begin,
)
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.work import level_track_with_friction, work_arrays
from railsim.simulation import simulate

FURTHER = pytest.mark.further
TRANSIENT = {"transient_creep": True}


@pytest.fixture(scope="module")
def coach():
    return load_vehicle("coach_manchester")


def settings(**more):
    return load_settings().with_values(TRANSIENT | more)


class Patch:
    """Leading right wheel at 20 m/s; `state` with its wheelset at the start of steady rolling."""

    def __init__(self, coach):
        model = assemble(coach, load_track("straight"), settings())
        balance = equilibrium(model, 20.0)
        self.system, self.state = level_track_with_friction(balance.model.system), balance.state
        self.work = work_arrays(self.system)
        first = transient_begin(self.system)
        self.kept = slice(first, first + TRANSIENT_SIZE * len(self.system.contact.body))

    def turned(self, yaw):
        """The same state with the wheelset turned."""
        state = self.state.copy()
        state[6 * self.system.contact.body[0] + 5] = yaw
        return state

    def evaluate(self, state, way=0.0):
        """Lateral creepage that its force has followed on a way in semi-axes since the last step.

        Returns it with the force [N] and the memory that it leaves.
        """
        now = self.work.transient
        for length in (0.0, way):
            state[LAST_STEP] = length / now[0, 1, 0, RATE] if length else 0.0
            right_hand_side(self.system, self.work, state, np.zeros_like(state))
        patch = np.flatnonzero((self.work.patch_index == (0, 1, 0)).all(axis=1))[0]
        memory = now[..., :PATCH_STATE].ravel().copy()
        return now[0, 1, 0, DELAYED + 1], self.work.patch[T_Y, patch], memory


@pytest.fixture(scope="module")
def patch(coach):
    return Patch(coach)


def test_force_reaches_63_per_cent_after_half_the_patch(patch):
    """A step of the creepage: nothing at once, then 1 - exp(-x/a) of it."""
    before, force, memory = patch.evaluate(patch.turned(0.0))
    state = patch.turned(2e-4)
    steady, steady_force, _ = patch.evaluate(state)
    assert abs(steady_force - force) > 300.0
    state[patch.kept] = memory
    at_once, force_at_once, memory = patch.evaluate(state)
    assert at_once == pytest.approx(before, abs=1e-15)
    state[patch.kept] = memory
    for way in (0.1, 1.0, 3.0):
        followed, after, _ = patch.evaluate(state, way)
        share = 1.0 - np.exp(-way)
        assert (followed - before) / (steady - before) == pytest.approx(share, rel=1e-9)
        # far from saturation the force is nearly linear
        reached = (after - force_at_once) / (steady_force - force_at_once)
        assert reached == pytest.approx(share, abs=0.01)


def test_creepage_that_grows_evenly_is_followed_a_semi_axis_behind(patch):
    """Exact over steps of any length: (x - 1 + exp(-x))/x of the growth over x semi-axes."""
    before, _, memory = patch.evaluate(patch.turned(0.0))
    state = patch.turned(2e-4)
    steady, _, _ = patch.evaluate(state)
    state[patch.kept] = memory
    for way in (1e-3, 0.5, 2.0, 30.0):
        followed, _, _ = patch.evaluate(state, way)
        expected = (way - 1.0 + np.exp(-way)) / way
        assert (followed - before) / (steady - before) == pytest.approx(expected, rel=1e-9)


def test_new_patch_begins_without_traction(patch):
    """What a patch knew is forgotten where it did not carry."""
    state = patch.turned(1e-3)
    steady, _, memory = patch.evaluate(state)
    rows = memory.reshape(-1, PATCH_STATE)
    assert np.count_nonzero(rows[:, LOADED] == CARRYING) == 8
    assert np.count_nonzero(rows[:, LOADED] == UNLOADED) == 8 * (TRACED - 1)
    rows[:, LOADED] = UNLOADED
    state[patch.kept] = rows.ravel()
    assert patch.evaluate(state)[:2] == (0.0, 0.0)
    followed, _, _ = patch.evaluate(state, 1.0)
    assert followed == pytest.approx((1.0 - np.exp(-1.0)) * steady, rel=1e-9)


def test_steady_curving_keeps_its_values(coach):
    """Within 1e-9 of the largest force where nothing changes any more."""
    track = load_track("straight").with_values(
        {
            "plan": [{"type": "CIR", "length": 300.0, "radius": 1600.0}],
            "cant": [{"type": "CST", "length": 300.0, "cant": 0.0}],
            "support.preset": "rigid",
        }
    )
    how = {"speed": 20.0, "start": 100.0, "duration": 2.0}
    steady = {"start_state": "steady", "step": 1e-3}
    mine = simulate(coach, track, settings=settings(**steady), **how)
    other = simulate(coach, track, settings=load_settings().with_values(steady), **how)
    for name in ("Q", "Y", "T_gamma"):
        scale = np.abs(other[name]).max()
        np.testing.assert_allclose(mine[name][-1], other[name][-1], atol=1e-9 * scale, rtol=0.0)


STRUCK = {"initial": {"front.outer.wheelset": {"y": 1e-3, "vy": 0.03}}, "step": 1.25e-4}
RIGID = {"support.preset": "rigid"}
RUN = {"speed": 20.0, "start": 20.0}


def test_memory_belongs_to_the_state(coach):
    """A run in two parts has the bits of the run in one."""
    track = load_track("straight").with_values(RIGID)
    how = RUN | {"settings": settings(**STRUCK)}
    whole = simulate(coach, track, duration=0.1, **how)
    first = simulate(coach, track, duration=0.05, **how)
    second = simulate(coach, track, duration=0.05, resume=first, settings=how["settings"])
    half = len(first["time"]) - 1
    for name in ("Q", "Y", "T_gamma"):
        np.testing.assert_array_equal(second[name], whole[name][half:])


def test_a_struck_wheelset_builds_up_its_forces_as_by_the_reference_scheme(coach):
    """Over the first 10 ms within 2 %; in steady rolling they are there at once, 5 % and more."""
    track = load_track("straight").with_values(RIGID)
    fine = STRUCK | {"output_rate": 2000.0}
    every = settings(**fine), settings(**fine, scheme="rk4"), load_settings().with_values(fine)
    mine, reference, at_once = (
        simulate(coach, track, duration=0.01, settings=one, **RUN)["Y"][1:] for one in every
    )
    scale = np.ptp(mine, axis=0).max()
    assert np.abs(mine - reference).max() < 0.02 * scale
    assert np.abs(mine - at_once).max() > 0.05 * scale


@FURTHER
def test_reference_scheme_agrees(coach):
    """A wheelset thrown aside: within 1 % of the largest force, which steady rolling misses."""
    track = load_track("straight").with_values(RIGID)
    fine = STRUCK | {"output_rate": 2000.0}
    found = [
        simulate(coach, track, duration=0.05, settings=one, **RUN)["Y"][4:]
        for one in (
            settings(**fine),
            settings(**fine, scheme="rk4"),
            load_settings().with_values(fine),
        )
    ]
    scale = np.ptp(found[0], axis=0).max()
    print(scale, np.abs(found[0] - found[1]).max(), np.abs(found[0] - found[2]).max())
    assert np.abs(found[0] - found[1]).max() < 0.01 * scale
    assert np.abs(found[0] - found[2]).max() > 0.02 * scale
