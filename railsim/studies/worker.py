"""Imported by the server of `railsim.processes`: all that a worker needs, with compiled code.

The code is loaded at the first call of each kernel, by a run of two steps.
"""

import logging

from railsim.definitions.loading import load_track, load_vehicle
from railsim.simulation import simulate
from railsim.studies.execute import is_compiled


def load_compiled_code() -> None:
    """Load the compiled kernels if they exist; otherwise the first worker compiles them."""
    if not is_compiled():
        return
    logging.disable()  # an auxiliary run: its remarks are not reported
    try:
        coach, track = load_vehicle("coach_manchester"), load_track("straight")
        simulate(coach, track, speed=20.0, duration=0.01)
    finally:
        logging.disable(logging.NOTSET)


load_compiled_code()
