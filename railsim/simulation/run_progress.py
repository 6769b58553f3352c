"""The finished fraction of a run, as it is reported on the way."""

import math
from collections.abc import Callable

from railsim.simulation.conditions import Inputs

Progress = Callable[[float], None]

NOTHING = 1e-12  # part of a run that is no more than the round-off of its time


class RunProgress:
    """The finished fraction of a run and of what comes before it, by simulated time.

    Before a run its step is judged in flange contact, and it may have a run-in.

    `progress`: called with the finished fraction; `inputs`: of the run.
    """

    def __init__(self, progress: Progress | None, inputs: Inputs) -> None:
        self._progress = progress
        end = inputs.track.length if inputs.until is None else inputs.until
        by_distance = (end - inputs.start) / inputs.speed
        self._length = min(inputs.duration or math.inf, by_distance)  # of the run [s]
        self._judged = self._run_in = 0.0  # simulated before it [s]
        self._ways = 2 if inputs.start > 0.0 else 1  # into a curve: a run-in is about as long
        self._on_its_way = False
        self._fraction = 0.0
        self._tell(0.0)

    def of_judgement(self, done: float, whole: float) -> None:
        """Take the time that has been simulated to judge a step, and all of it [s]."""
        if self._on_its_way:  # at another speed: the run waits for it
            self._tell(self._fraction)
            return
        self._judged = done
        self._tell(done / (self._ways * whole + self._length))

    def of_run_in(self, done: float, whole: float) -> None:
        """Take the time of a run-in that has been simulated, and all of it [s]."""
        self._run_in = done
        self._tell((self._judged + done) / (self._judged + whole + self._length))

    def of_run(self, fraction: float) -> None:
        """Take the finished fraction of what follows the preparation."""
        self._on_its_way = True
        before = self._judged + self._run_in
        left = 1.0 - fraction if 1.0 - fraction > NOTHING else 0.0
        self._tell(1.0 - left * self._length / (before + self._length))

    def _tell(self, fraction: float) -> None:
        # a preparation that has to be longer than expected takes nothing back
        self._fraction = max(self._fraction, fraction)
        if self._progress is not None:
            self._progress(self._fraction)
