"""Step and output interval of a run at any speed."""

import math

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.errors import Fault, InputError
from railsim.kernels.rhs import STANDSTILL_SPEED
from railsim.model.assembly import Model
from railsim.model.equilibrium import equilibrium
from railsim.model.time_step import Stability
from railsim.model.work import level_track_with_friction
from railsim.simulation.flange import in_flange_contact
from railsim.simulation.settling import Progress

Floats = NDArray[np.float64]


class Pace:
    """Step and output interval of a run, chosen once for each class of speeds.

    Creep forces stiffen as 1/V: the step of a class is that of its lowest speed.

    Parameters
    ----------
    states : dict of float to float64[n_state]
        Steady rolling on straight track at the speeds where it is known.
    progress : callable, optional
        Called while a step is judged, as in `railsim.simulation.flange.in_flange_contact`.
    """

    CLASS = 1.2  # ratio of a class's speeds

    def __init__(
        self,
        model: Model,
        settings: Settings,
        track: Track,
        states: dict[float, Floats],
        progress: Progress | None = None,
    ) -> None:
        self._model = model
        self._track = track
        self._settings = settings
        self._progress = progress
        self._known: dict[tuple[float, float], float] = {}
        self._states = states
        self.varies = settings.drive.mode != "constant"
        self.smallest = math.inf

    def at(self, speed: float, rate: float = 0.0) -> tuple[float, int]:
        """Step [s] at `speed`, which changes at `rate`, and number of steps to the next output."""
        interval = output_interval(self._settings, speed)
        if self._settings.output_spacing is not None:
            interval = duration(self._settings.output_spacing, speed, rate)
        key = speed
        if self.varies:
            lowest = self.CLASS ** math.floor(math.log(speed, self.CLASS))
            key = max(lowest, 1.02 * STANDSTILL_SPEED)  # below there is no steady rolling
        longest = self._known.get((key, 0.0)) or self._choose(key, interval)
        self._known[key, 0.0] = longest
        every = max(1, math.ceil(interval / longest * (1.0 - 1e-9)))
        self.smallest = min(self.smallest, interval / every)
        return interval / every, every

    def _choose(self, speed: float, interval: float) -> float:
        given = self._settings.step
        if given is None:
            return self._stability(speed).choose(interval)
        if not self.varies and abs(round(interval / given) * given - interval) > 1e-9 * interval:
            raise InputError(
                [
                    Fault(
                        "settings",
                        "step",
                        f"found {given:g} s",
                        f"an integer fraction of the output interval {interval:g} s",
                    )
                ]
            )
        stability = self._stability(speed)
        if not stability.holds(given):
            raise InputError(
                [
                    Fault(
                        "settings",
                        "step",
                        f"found {given:g} s, unstable at {speed:g} m/s",
                        f"at most {stability.choose(interval):g} s",
                    )
                ]
            )
        return given

    def _stability(self, speed: float) -> Stability:
        state = self._states.get(speed)
        if state is None:
            state = equilibrium(self._model, speed).state
        level = level_track_with_friction(self._model.system)
        return Stability(
            self._model,
            level,
            state,
            self._settings.scheme,
            lambda step: in_flange_contact(self._model, self._track, state, step, self._progress),
        )


def duration(distance: float, speed: float, rate: float) -> float:
    """Time to cover `distance` at a speed that changes at `rate` [s]; without it if that stops."""
    square = speed**2 + 2.0 * rate * distance
    return 2.0 * distance / (speed + math.sqrt(square)) if square > 0.0 else distance / speed


def output_interval(settings: Settings, speed: float) -> float:
    """Time between two outputs [s]."""
    if settings.output_spacing is not None:
        return settings.output_spacing / speed
    return 1.0 / settings.output_rate
