"""Support of the rails as a track file says it: presets, single keys, contradictions."""

import numpy as np
import pytest
from pydantic import ValidationError

from railsim.definitions.track.support import PRESETS, Support, beam_on_foundation


def test_single_keys_replace_values_of_the_preset():
    support = Support(preset="co-running", pad_vertical=[80e6, 60e3])
    values = support.values
    assert values.pad_vertical == (80e6, 60e3)
    assert values.ballast_vertical == PRESETS["co-running"].ballast_vertical


def test_rigid_rails_have_no_values():
    assert Support(preset="rigid").values is None


def test_ballasted_is_co_running_without_masses():
    with_masses, without = PRESETS["co-running"], PRESETS["ballasted"]
    assert without.massless
    assert not with_masses.massless
    for name in ("pad_vertical", "pad_lateral", "ballast_vertical", "ballast_lateral"):
        assert getattr(without, name) == getattr(with_masses, name)


@pytest.mark.parametrize(
    "wrong",
    [
        {"preset": "rigid", "rail_mass": 60.0},
        {"preset": "rigid", "variation": [[0.0, 2.0]]},
        {"preset": "ballasted", "rail_mass": 60.0},
        {"preset": "ballasted", "pad_vertical": [150e6, 0.0]},
        {"preset": "ballasted", "pad_vertical": [0.0, 100e3]},
        {"preset": "p2", "ballast_lateral": [70e6, 350e3]},
        {"preset": "p2", "sleeper_mass": 200.0},
        {"preset": "ballasted", "variation": [[10.0, 1.0], [0.0, 2.0]]},
        {"preset": "ballasted", "ballast_base": 800.0},  # mm
        {"preset": "soft"},
    ],
)
def test_contradictions_are_refused(wrong):
    with pytest.raises(ValidationError):
        Support.model_validate(wrong)


def test_one_factor_stands_for_pads_and_ballast():
    assert Support(preset="ballasted", variation=[[0.0, 2.0]]).variation == ((0.0, 2.0, 2.0),)


def test_rail_as_a_beam_on_an_elastic_foundation():
    """60E1 on pads of 150 and ballast of 140 MN/m every 0.6 m: deflection under 100 kN."""
    chain = 1.0 / (1.0 / 150e6 + 1.0 / 140e6)
    length, stiffness = beam_on_foundation(6.38e6, chain / 0.6)
    assert length == pytest.approx(0.678, abs=1e-3)
    assert stiffness == pytest.approx(163.7e6, rel=1e-3)
    assert 100e3 / stiffness == pytest.approx(0.611e-3, rel=1e-3)


def test_slab_is_its_fastenings_in_the_static_shape_of_the_beam():
    length, stiffness = beam_on_foundation(2.059e11 * 3.217e-5, 40e6 / 0.63)
    slab = PRESETS["slab"]
    assert slab.pad_vertical == pytest.approx((stiffness, 1.5 * length * 52e3 / 0.63), rel=1e-3)
    assert slab.rail_mass == pytest.approx(1.5 * length * 60.64, rel=1e-3)


@pytest.mark.parametrize(
    ("hertz", "share"), [(1.0, 1.0), (30.0, 0.994), (100.0, 0.924), (200.0, 0.824), (700.0, 1.526)]
)
def test_how_far_the_slab_track_is_a_beam_on_a_foundation(hertz, share):
    """Dynamic stiffness over that of an endless beam, 8 E I beta^3 (Grassie et al. 1982)."""
    bending, rail, foundation, damping = 2.059e11 * 3.217e-5, 60.64, 40e6 / 0.63, 52e3 / 0.63
    omega = 2.0 * np.pi * hertz
    beta = ((foundation + 1j * omega * damping - rail * omega**2) / (4.0 * bending)) ** 0.25
    slab = PRESETS["slab"]
    stiffness, damper = slab.pad_vertical
    found = stiffness + 1j * omega * damper - slab.rail_mass * omega**2
    assert abs(found / (8.0 * bending * beta**3)) == pytest.approx(share, abs=2e-3)
