"""A disc cam of three arcs with a roller that slides along a guide, against its closed form."""

import numpy as np
import pytest

from railsim.definitions.mechanism.definition import Mechanism
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.tables import sentences
from railsim.plot.mechanisms import cam_figure

BASE, FLANK, NOSE, APART, ASIDE = 0.050, 0.130, 0.025, 0.030, 0.004  # of the roller's centre [m]
ALONG = ((FLANK - BASE) ** 2 - (FLANK - NOSE) ** 2 + APART**2) / (2.0 * APART)
ACROSS = -np.sqrt((FLANK - BASE) ** 2 - ALONG**2)
ARCS = ((BASE, 0.0, 0.0), (FLANK, ALONG, ACROSS), (NOSE, APART, 0.0))


@pytest.fixture(scope="module")
def result():
    arcs = [{"radius": r, "turns": "right", "centre": [x, float(y)]} for r, x, y in ARCS]
    return analyse(
        Mechanism.model_validate(
            {
                "format": "railsim-mechanism/1",
                "ground": {"points": {"shaft": [0.3, 0.2], "guide": [0.3 + ASIDE, 0.2]}},
                "bodies": {
                    "cam": {"points": {"shaft": [0, 0], "tip": [APART, 0]}},
                    "follower": {"points": {"roller": [0, 0], "top": [0, 0.1]}, "mass": 2.0},
                },
                "start": {"follower": {"x": 0.3 + ASIDE, "y": 0.2 + BASE}},
                "joints": {
                    "shaft": {"revolute": ["ground.shaft", "cam.shaft"]},
                    "guide": {"prismatic": ["follower.roller", "ground.guide"], "angle": "pi / 2"},
                    "cam": {"cam": "follower.roller", "body": "cam", "arcs": arcs},
                },
                "driver": {"angle": "cam", "start": -0.3, "end": 1.6},
                "output": {"point": "follower.top"},
                "actuators": {"shaft": {"turn": "cam"}},
                "solve": {"unknown": "shaft"},
            }
        )
    )


def lift(arc, s):
    """Height of the roller's centre over the shaft on an arc, and its slope by the cam's angle."""
    radius, u, v = ARCS[arc]
    x, y = u * np.cos(s) - v * np.sin(s) - ASIDE, u * np.sin(s) + v * np.cos(s)
    upright = np.sqrt(radius**2 - x**2)
    return y + upright, (x + ASIDE) + x * y / upright


def test_a_roller_that_slides_follows_its_cam(result):
    heights = result.motion.point("follower.roller")[0][:, 1] - 0.2
    arcs = np.max(result.motion.arcs, axis=1)
    assert set(arcs) == {0, 1, 2}
    for arc in range(3):
        height, slope = lift(arc, result.motion.s[arcs == arc])
        assert heights[arcs == arc] == pytest.approx(height, abs=1e-12)
        torque = result.output["force"][arcs == arc]
        assert torque == pytest.approx(2.0 * 9.81 * slope, abs=1e-10)


def test_changes_of_arcs_are_told_where_the_roller_s_body_does_not_turn(result):
    """Was a division by its rate of rotation; it still rests at the first change."""
    first, second = result.transitions
    assert (first.rate_before, first.rate_after) == (0.0, 0.0)
    for arc, rate in ((1, second.rate_before), (2, second.rate_after)):
        assert rate == pytest.approx(lift(arc, second.travel)[1], rel=1e-6)
    told = [sentence for sentence in sentences(result) if "gap" in sentence]
    assert [words.endswith("jump of the rate 0.000 %") for words in told] == [True, True]


def test_of_a_stretch_without_force_only_the_begin_is_told(result):
    """Every position of the table was, of the half of them at which the cam's base circle rolls."""
    highest = np.arccos(ASIDE / (APART + NOSE))  # the nose's centre below the roller's
    assert result.force_zeros == pytest.approx([result.model.start, highest])


def test_rates_of_a_roller_that_slides_are_drawn(result):
    """The picture was empty: the rate over that of a body that does not turn."""
    (axes,) = cam_figure(result).axes
    assert axes.get_ylabel() == "rate of 'follower.roller' over the driver's (mm/rad)"
    by_arc = {line.get_label(): line.get_data() for line in axes.lines}
    for arc in range(3):
        angle, rate = by_arc[f"arc {arc + 1}, turns right"]
        assert rate == pytest.approx(1e3 * np.abs(lift(arc, np.radians(angle))[1]), abs=1e-9)
