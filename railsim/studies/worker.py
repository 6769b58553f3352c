"""What the server of `railsim.processes` imports: all that a worker needs, compiled code too.

The code is loaded by the first call of each kernel: a run of two steps.
"""

import logging

from railsim.definitions.loading import load_track, load_vehicle
from railsim.simulation import simulate
from railsim.studies.execute import is_compiled


def load_compiled_code() -> None:
    """Load the compiled kernels where they are there; otherwise the first worker compiles them."""
    if not is_compiled():
        return
    logging.disable()  # nobody asked for this run
    try:
        coach, track = load_vehicle("coach_manchester"), load_track("straight")
        simulate(coach, track, speed=20.0, duration=0.01)
    finally:
        logging.disable(logging.NOTSET)


load_compiled_code()
