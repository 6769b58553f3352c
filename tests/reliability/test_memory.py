"""Numbers do not depend on what stood in the memory before: nothing is read that was not written.

`MALLOC_PERTURB_` of the GNU C library fills memory that is given out with a byte.
"""

import os
import subprocess
import sys

from selection import points

RUN = """
import railsim
vehicle, track = railsim.load_vehicle({!r}), railsim.load_track({!r})
result = railsim.simulate(vehicle, track, speed={}, until={})
print([repr(float(abs(q).sum())) for q in (result.dQ_over_Q0, result.Y_over_Q)])
"""
RUNS = {
    "wagon": ("wagon_y25", "curve_r250", 12.0, 60.0),
    "crossing": ("coach_manchester", "crossing_56e1_r245_1in9.25", 15.0, 40.0),
    "check rail": ("metro_b_motor", "depot_r150_check_rail", 5.0, 60.0),
    "locomotive": ("locomotive_coco_a", "turnout_300_1in9", 10.0, 60.0),
}


@points("name", list(RUNS), always=(0,))
def test_results_do_not_depend_on_what_memory_held_before(name):
    outputs = set()
    for byte in ("85", "170"):
        environment = {**os.environ, "MALLOC_PERTURB_": byte}
        command = [sys.executable, "-c", RUN.format(*RUNS[name])]
        done = subprocess.run(command, env=environment, capture_output=True, check=True)
        outputs.add(done.stdout)
    assert len(outputs) == 1
