"""Runs in the time domain; begin reading in `run`.

- `run`: `simulate`, the course of a run on one page; `simulate_together`: of several in one call
- `advance`: the time loop, chunk by chunk
- `pace`: step and output interval at any speed; `flange`: the step judged in flange contact
- `run_in`: the state in which a run starts, also in curves; `settling`: run-ins
- `ensemble`: several vehicles as one system
- `outputs`: from raw records to the quantities of a result
- `right_samples`: low-pass filter before storage
- `remarks`: what a reader of a result must know
- `check_step`: a run compared with itself at half its step
"""

from railsim.simulation.run import outcomes, prepare, simulate, simulate_together

__all__ = ["outcomes", "prepare", "simulate", "simulate_together"]
