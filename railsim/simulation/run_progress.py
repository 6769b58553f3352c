"""The finished fraction of runs, as it is reported during the run."""

import math
from collections.abc import Callable

from railsim.simulation.conditions import Inputs

Progress = Callable[[float], None]

NOTHING = 1e-12  # part of a run that is no more than the round-off of its time


class RunProgress:
    """The finished fraction of runs and of what comes before them, by simulated time.

    Before a run its step is judged in flange contact, and it may have a run-in.

    `progress`: called with the finished fraction of all runs; `number`: how many they are;
    `inputs`: what they have in common.
    """

    def __init__(self, progress: Progress | None, number: int, inputs: Inputs) -> None:
        self._progress, self._number = progress, number
        end = inputs.track.length if inputs.until is None else inputs.until
        by_distance = (end - inputs.start) / inputs.speed
        self._length = min(inputs.duration or math.inf, by_distance)  # of one run [s]
        self._before = 0.0  # simulated while other runs were prepared [s]
        self._judged = self._run_in = 0.0  # and this one
        self._on_their_way = False
        self._fraction = 0.0

    def next_run(self) -> None:
        """Take note that another run is prepared."""
        self._before += self._judged + self._run_in
        self._judged = self._run_in = 0.0
        self._tell(self._fraction)

    def of_judgement(self, done: float, whole: float) -> None:
        """Take the time that has been simulated to judge a step, and all of it [s]."""
        if self._on_their_way:  # at another speed: the runs wait for it
            self._tell(self._fraction)
            return
        self._judged = done
        self._tell((self._before + done) / (self._number * (whole + self._length)))

    def of_run_in(self, done: float, whole: float) -> None:
        """Take the time of a run-in that has been simulated, and all of it [s]."""
        self._run_in = done
        each = self._judged + whole + self._length
        self._tell((self._before + self._judged + done) / (self._number * each))

    def of_runs(self, fraction: float) -> None:
        """Take the finished fraction of what follows the preparation."""
        self._on_their_way = True
        before = self._before + self._judged + self._run_in
        runs = self._number * self._length
        left = 1.0 - fraction if 1.0 - fraction > NOTHING else 0.0
        self._tell(1.0 - left * runs / (before + runs))

    def _tell(self, fraction: float) -> None:
        # a preparation that has to be longer than expected takes nothing back
        self._fraction = max(self._fraction, fraction)
        if self._progress is not None:
            self._progress(self._fraction)
