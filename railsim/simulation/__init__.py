"""Runs in the time domain; begin reading in `run`.

- `run`: `simulate`, the course of a run on one page
- `stepping`: `Simulation`, a run that is taken step by step
- `conditions`, `preparation`, `ending`: its inputs checked, its model and state, its result
- `together`: `simulate_together`, several vehicles over one track
- `run_progress`: the finished fraction, as it is reported during the run
- `advance`: the time loop, chunk by chunk
- `step_choice`: step and output interval at any speed; `flange`: the step judged in flange contact
- `run_in`: the state in which a run starts, also in curves; `auxiliary_track`: run-ins
- `disturbance`: initial disturbances, wheelsets kept on their rails
- `outputs`: from raw records to the quantities of a result
- `sampling`: low-pass filter before storage
- `remarks`: remarks for the reader of a result
- `assumptions`: what an engineer reads before a run begins
- `check_step`: a run compared with itself at half its step
"""

from railsim.simulation.preparation import prepare
from railsim.simulation.run import simulate
from railsim.simulation.stepping import Simulation
from railsim.simulation.together import simulate_together

__all__ = ["Simulation", "prepare", "simulate", "simulate_together"]
