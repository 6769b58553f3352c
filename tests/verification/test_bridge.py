"""A coach on a simply supported bridge: closed forms of moving forces, Frýba (1999)."""

import ast
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).parents[2] / "examples" / "18_coach_on_a_bridge.py"


@pytest.fixture(scope="module")
def example():
    """The definitions of the example, without its run."""
    tree = ast.parse(SCRIPT.read_text("utf-8"))
    kinds = (ast.Import, ast.ImportFrom, ast.ClassDef, ast.FunctionDef)
    tree.body = [node for node in tree.body if isinstance(node, kinds)]
    names = {"__name__": "bridge"}
    exec(compile(tree, str(SCRIPT), "exec"), names)
    return names


@pytest.mark.parametrize("speed", [25.0, 60.0])
def test_forces_held_constant_give_the_sum_of_closed_forms(example, speed):
    bridge, dt = example["Bridge"](), 1e-3
    forces, arrivals = np.array([1.2e5, 0.9e5, 1.0e5]), np.array([0.1, 0.2, 0.7])
    time = np.arange(1, 3000) * dt
    found = []
    for t in time:
        bridge.step(bridge.begin + speed * (t - 0.5 * dt - arrivals), forces, dt)
        found.append(bridge.deflection([bridge.begin + 0.5 * bridge.span])[0][0])
    closed = example["moving_forces"](bridge, forces, arrivals, speed, time)
    assert np.max(np.abs(found - closed)) < 0.01 * closed.max()


@pytest.mark.slow
@pytest.mark.parametrize("speed", [25.0, 40.0])
def test_a_heavy_bridge_under_the_coach_deflects_as_under_its_loads(example, speed):
    """The bridge has 360 t, the wheelsets 7 t; what inertia adds stays below 3 %."""
    bridge = example["Bridge"]()
    seen, arrivals, loads = example["coach_over"](bridge, speed, 48.0, 88.0)
    closed = example["moving_forces"](bridge, loads, arrivals, speed, seen[:, 0])
    assert seen[:, 1].max() == pytest.approx(closed.max(), rel=0.03)
