"""Gritti (2012), the ATR95 pantograph: printed, derived and reconstructed numbers.

Every test says of its numbers: *printed* in the source, *derived* from printed numbers alone,
*reconstructed* (they hold for the four-bar R1 or the cam, which agree with what is printed but are
not unique), *new* (beyond the source; computed twice by others, with closed forms and with a
general planar solver).  The ids are those of the list of acceptance numbers.
"""

import numpy as np
import pytest

from railsim.definitions.loading import load_mechanism
from railsim.mechanisms.analysis import analyse

LIFTS = tuple(f"atr95_lift_{i}" for i in (1, 2, 3, 4, 5))
STROKES = (120.7408, 114.2241, 116.1322, 112.1972, 113.6682)
FORCES = (9877.2938, 10257.5192, 10253.8736, 10625.5782, 9803.4512)


@pytest.fixture(scope="module")
def lifts():
    return {name: analyse(load_mechanism(name)) for name in (*LIFTS, "atr95", "atr95_lift_6")}


@pytest.mark.parametrize(("name", "stroke"), list(zip(LIFTS, STROKES, strict=True)))
def test_a1_strokes_printed(lifts, name, stroke):
    assert lifts[name].stroke * 1e3 == pytest.approx(stroke, abs=1e-3)  # travel to 1e-4 deg


def test_a3_length_of_lift_5_derived(lifts):
    length = lifts["atr95_lift_5"].output["length"] * 1e3
    assert length[0] == pytest.approx(157.5893, abs=1e-3)
    assert length[-1] == pytest.approx(271.2574, abs=1e-3)


@pytest.mark.parametrize(("name", "force"), list(zip(LIFTS, FORCES, strict=True)))
def test_a7_largest_forces_printed_and_reconstructed(lifts, name, force):
    result = lifts[name]
    assert result.max_force == pytest.approx(force, abs=0.1)  # R1 was fitted to 0.01 N
    assert result.output["travel"][np.argmax(result.output["force"])] == 0.0
