"""Arcs of a cam with given centres: where they end."""

import numpy as np
import pytest

from railsim.definitions.mechanism.parts import Arc
from railsim.mechanisms.model import centred_arcs


class Path:
    """A path of tangent arcs, walked along: each begins where, and as, the last one ends."""

    def __init__(self, radii, turns, angles):
        place, heading = 0.3 - 0.2j, np.exp(0.7j)
        self.arcs, self.ends = [], []
        for radius, turn, angle in zip(radii, turns, angles, strict=True):
            sense = 1.0 if turn == "left" else -1.0
            centre = place + 1j * sense * radius * heading
            turned = np.exp(1j * sense * angle)
            begin, end = (place - centre) / radius, (place - centre) / radius * turned
            self.arcs.append(Arc(radius=radius, turns=turn, centre=(centre.real, centre.imag)))
            self.ends.append((begin.real, begin.imag, end.real, end.imag, sense))
            place, heading = centre + radius * end, heading * turned


@pytest.mark.parametrize(
    "turns", [("left",) * 4, ("right",) * 4, ("left", "right", "right", "left")]
)
@pytest.mark.parametrize("radii", [(0.4, 0.3, 0.2, 0.1), (0.1, 0.3, 0.2, 0.5)])
def test_tangent_arcs_end_where_they_touch(radii, turns):
    path = Path(radii, turns, (0.5, 1.1, 0.2, 0.9))
    found = [ends for *_, ends in centred_arcs(path, {})]
    np.testing.assert_allclose(found[0][2:], path.ends[0][2:], atol=1e-12)
    np.testing.assert_allclose(found[1:-1], path.ends[1:-1], atol=1e-12)
    np.testing.assert_allclose(found[-1][:2], path.ends[-1][:2], atol=1e-12)
    # the outer two go nearly half a turn on
    for begin_x, begin_y, end_x, end_y, _ in (found[0], found[-1]):
        assert begin_x * end_x + begin_y * end_y == pytest.approx(-1.0, abs=1e-3)
