"""The examples of `docs/extending.md`, put into a copy of the program as the page says."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "tests" / "extending"
PAGE = (ROOT / "docs" / "extending.md").read_text("utf-8")
BLOCK = re.compile(r'^```(python|diff) title="(.*?)"\n(.*?)^```', re.MULTILINE | re.DOTALL)
ELEMENT = """
import numpy as np, railsim
from railsim.definitions import Settings
from railsim.definitions.loading import load_track, load_vehicle
from generators.keys import json_schema, key_table
from railsim.errors import InputError
from railsim.definitions.vehicle.flatten import flatten
from railsim.kernels.rhs import right_hand_side
from railsim.model.assembly import assemble
from railsim.model.element_arrays import ElementArrays
from railsim.model.work import work_arrays

key = "assemblies.bogie.assemblies.axle.elements.primary"
coach = load_vehicle("coach_manchester")
common = {"bodies": ["frame", "wheelset"], "sides": "both", "point": [0.0, 1.0, -0.46]}
bush = coach.with_values({key: {**common, "kind": "hydraulic_bush", "stiffness": [5e6, 1e6, 9e5],
                                "fluid_stiffness": 2e7, "fluid_damping": 1e5}})
same = coach.with_values({key: {**common, "kind": "bushing", "stiffness": [5e6, 1e6, 9e5],
                                "series_stiffness": [2e7, 0.0, 0.0], "damping": [1e5, 0.0, 0.0]}})

def arrays(vehicle):
    flat = flatten(vehicle)
    made = ElementArrays({body.name: body for body in flat.bodies})
    for element in flat.elements:
        made.add(element)
    return [*made.arrays()["mounts"], *made.arrays()["internal"]]

for one, other in zip(arrays(bush), arrays(same), strict=True):
    np.testing.assert_array_equal(one, other)
again = type(bush).model_validate(__import__("tomllib").loads(bush.to_toml()))
assert again == bush
assert "k_s [N/m]" in key_table("railsim-vehicle/1", "HydraulicBush")
assert "HydraulicBush" in json_schema("railsim-vehicle/1")["$defs"]
try:
    coach.with_values({key: {**common, "kind": "hydraulic_bosh"}})
except InputError as error:
    assert "did you mean 'hydraulic_bush'?" in str(error), error

def rates(vehicle):
    model = assemble(vehicle, load_track("straight"), Settings())
    state, found = np.zeros(model.n_state), np.zeros(model.n_state)
    state[-2:] = 10.0, 20.0  # m, m/s
    state[:-3] += np.random.default_rng(1).normal(0.0, 1e-4, model.n_state - 3)
    assert right_hand_side(model.system, work_arrays(model.system), state, found)[0] == 0
    return found

accelerations = rates(bush)
assert np.max(np.abs(accelerations)) > 1.0
np.testing.assert_array_equal(accelerations, rates(same))
"""
EXCITATION = """
import numpy as np
from railsim.definitions.loading import load_track
from generators.keys import key_table
from railsim.definitions.mirror import mirrored_track
from railsim.track.irregularity import displacement

joints = {"type": "joints", "spacing": 20.0, "depth": 4e-3, "begin": 10.0, "end": 95.0}
track = load_track("straight").replace(irregularities=[joints])
moved = displacement(track)
np.testing.assert_allclose(moved(np.array([10.0, 30.0, 30.25, 40.0]))[0][1], [4e-3, 4e-3, 2e-3, 0])
s, h = np.linspace(9.0, 94.0, 1001), 1e-6
slope = (moved(s + h)[0] - moved(s - h)[0]) / (2 * h)
np.testing.assert_allclose(moved(s)[1], slope, atol=1e-6)
assert mirrored_track(track) == track
assert "Distance of the joints" in key_table("railsim-track/1", "Joints")
"""
OUTPUT = """
from railsim.notation import QUANTITIES
import numpy as np
made = QUANTITIES["unloading"]
assert (made.unit, made.scale, made.dims) == ("1", 100.0, ("time", "wheelset", "side"))
np.testing.assert_allclose(made.formula({"dQ_over_Q0": np.array([-0.25, 0.5])}), [0.25, 0.0])
"""
CREEP = """
import numpy as np
from railsim.contact.creep import creep_force
from railsim.definitions.settings import Settings
Settings(creep_law="chartet")
patch = {"a": 6e-3, "b": 4e-3, "N": 70e3, "mu": 0.35}
law, linear = (creep_force(**patch, xi_x=1e-6, xi_y=2e-6, phi=1e-4, law=name)
               for name in ("chartet", "linear"))
np.testing.assert_allclose(law[:2], linear[:2], rtol=0.01)
full = creep_force(**patch, xi_x=0.5, xi_y=0.0, phi=0.0, law="chartet")
np.testing.assert_allclose(np.abs(full[0]), 0.35 * 70e3, rtol=1e-3)
"""


def blocks(language):
    return [(title, text) for kind, title, text in BLOCK.findall(PAGE) if kind == language]


def changed(text, difference):
    """A file with a difference of the page in it: what follows the lines that stay is new."""
    lines = difference.splitlines()
    old = "".join(f"{line[1:]}\n" for line in lines if line[0] != "+")
    new = "".join(f"{line[1:]}\n" for line in lines)
    assert text.count(old) == 1, old
    return text.replace(old, new)


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The program with all examples of the page, as plain Python."""
    folder = tmp_path_factory.mktemp("copy")
    shutil.copytree(ROOT / "railsim", folder / "railsim")  # with what Python compiled
    for kind in ("vehicles", "tracks", "limits", "scenarios", "published", "studies"):
        if (ROOT / kind).is_dir():
            (folder / kind).symlink_to(ROOT / kind)
    for title in {title for title, _ in blocks("python")}:
        shutil.copyfile(EXAMPLES / Path(title).name, folder / title)
    for title, text in blocks("diff"):
        file = folder / title
        file.write_text(changed(file.read_text("utf-8"), text), "utf-8")
    return folder


def test_blocks_of_the_page_stand_in_the_examples():
    for title, text in blocks("python"):
        assert text in (EXAMPLES / Path(title).name).read_text("utf-8"), text
    assert len(blocks("python")) == 4


@pytest.mark.slow
def test_examples_work_in_a_copy_of_the_program(copy):
    """In one process: to start another takes longer than what the examples do."""
    program = "\n".join(
        f"exec(compile({text!r}, {name!r}, 'exec'), {{}})"
        for name, text in (
            ("element", ELEMENT), ("excitation", EXCITATION), ("output", OUTPUT), ("creep", CREEP)
        )
    )  # fmt: skip
    environment = {
        **os.environ,
        "PYTHONPATH": f"{copy}{os.pathsep}{ROOT / 'docs'}",
        "NUMBA_DISABLE_JIT": "1",
    }
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=copy, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
