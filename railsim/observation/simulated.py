"""A measured run simulated on estimated irregularities, and the estimate put right by it.

A wheelset that moves by millimetres meets a contact that is another one at every place; a smoother
with one linear contact says little of the alignment there.  With h(r) what channels read in a
simulated run over the irregularities r, H the linear response and K the gain of the smoother,

    r = K (y - h(r) + H r),                                                                 (1)

the linear estimate has r = 0 on the right.  At a solution of (1) the simulated run reads what was
measured, up to what the errors leave; for a linear vehicle it is the linear estimate.  The steps of
(1) do not converge by themselves where the contact is steeper than its mean; mixed with the steps
before, such that the mixture of the residuals is least (Anderson 1965; Walker and Ni 2011), they
do.  Values that do not exist are those of H r.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Flags, Floats
from railsim.definitions.measurement import Channel
from railsim.definitions.settings import Drive, Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import even_line, is_uniform
from railsim.definitions.vehicle.definition import Vehicle
from railsim.linear.track_response import RAILS
from railsim.measurement.counterpart import amplified
from railsim.observation.pieces import STEP, Piece, on_grid
from railsim.result import Result
from railsim.simulation.remarks import silent
from railsim.simulation.run import simulate

OUTPUTS: Any = {"quantities": ["Q", "Y", "sum_Y", "wheelset_lateral"], "sensors": "readings"}
LEAD, AFTER = 100.0, 30.0  # of a piece that is simulated [m]
RATE = 1000.0  # 1/s
KEPT = 25  # steps that are mixed
SHARE = 0.5  # of the residual that is added to the mixture
CHANGE = 0.02  # of the irregularities, over the standard deviation assumed: converged
STEADY = 0.01  # change of a speed that counts as none, over its mean
OVERSAMPLED = 3.0  # simulated values for a step of the grid, where the speed varies
SPEED_ROWS = 20  # steps of the grid between two rows of the speed


@dataclass(frozen=True)
class Reading:
    """What a simulated run says on the grid of a piece: channels and forces."""

    channels: Floats
    forces: Floats


@dataclass(frozen=True)
class Refined:
    """Irregularities that a simulated run agrees with.

    `change`: rms of what is left of (1), over the standard deviation assumed, the largest
    quantity.
    """

    fields: Floats  # float64[quantity, points]
    reading: Reading  # of the run over them
    data: Floats  # y - h(r) + H r, float64[channel, points]
    change: float


class SimulatedRun:
    """A vehicle that runs over irregularities as it did in a piece of a measured run.

    `vehicle`, `track`: The track with its plan, without irregularities. `outputs`: Readings, such
    as ``axlebox_1_left.z``, and the channel of each, with the filters that it has been through.
    `forces`: Such as ``Q.1.left``, ``sum_Y.1``.
    """

    def __init__(
        self, vehicle: Vehicle, track: Track, piece: Piece, outputs: Mapping[str, Channel],
        forces: list[str],
    ) -> None:  # fmt: skip
        self.vehicle, self.piece, self.outputs, self.forces = vehicle, piece, outputs, forces
        s = piece.grid
        # where the track is the same everywhere the run begins at its beginning
        self._uniform = is_uniform(track)
        self._moved = float(s[0]) - LEAD if self._uniform else 0.0
        self._track = track
        self._start = max(0.0, float(s[0]) - LEAD - self._moved)
        self._constant = bool(np.ptp(piece.speeds) < STEADY * np.mean(piece.speeds))

    @property
    def is_steady(self) -> bool:
        """Whether nothing but irregularities is read: on uniform track, at a constant speed."""
        return self._uniform and self._constant

    def __call__(self, fields: Floats) -> Reading | str:
        """Return what is read over irregularities at the grid, or why the run ended before.

        `fields` (float64[quantity, points]): [m]; beyond the grid those with which the smoother,
        whose fields are periodic, brings the vehicle to its beginning and has it leave.
        """
        s = self.piece.grid - self._moved
        before = np.arange(self._start, s[0] - 0.5 * STEP, STEP)
        after = s[-1] + np.arange(STEP, AFTER, STEP)
        places, points = np.concatenate([before, s, after]), fields.shape[1]
        ahead = STEP * (points - len(s))
        share = np.interp(places, [s[0] - ahead, s[0], s[-1], s[-1] + AFTER], [0.0, 1.0, 1.0, 0.0])
        on_rails = (RAILS.T @ fields)[:, np.rint((places - s[0]) / STEP).astype(int) % points]
        rows_moved = np.vstack([places, share * on_rails]).T.tolist()
        irregularity = {"type": "measured", "rows": rows_moved, "fade": 0.0}
        changes: dict[str, Any] = {"irregularities": [irregularity]}
        end = float(s[-1]) + 0.5 * AFTER
        if self._uniform:
            changes |= even_line(end + AFTER)
        else:
            end = min(end, self._track.length)
        with silent():
            speed = float(np.mean(self.piece.speeds)) if self._constant else None
            result = simulate(
                self.vehicle, self._track.replace(**changes), speed=speed,
                start=self._start, until=end, settings=self._settings(s),
            )  # fmt: skip
        if result.status != "complete":
            return f"{result.status}: {result.attributes['status_reason']}"
        rate = (len(result["time"]) - 1) / float(result["time"][-1] - result["time"][0])
        rows = [amplified(_series(result, name), rate, c) for name, c in self.outputs.items()]
        rows += [_series(result, name) for name in self.forces]
        run_places = result["distance"] + self._moved
        series = np.array([on_grid(run_places, x, self.piece.grid) for x in rows])
        return Reading(series[: len(self.outputs)], series[len(self.outputs) :])

    def _settings(self, s: Floats) -> Settings:
        if self._constant:
            return Settings(output_rate=RATE, outputs=OUTPUTS)
        # a run whose speed varies hands over every value by itself: not more than are needed
        rate = min(RATE, OVERSAMPLED * float(self.piece.speeds.max()) / STEP)
        table = np.column_stack([s, self.piece.speeds])[::SPEED_ROWS].tolist()
        drive = Drive(mode="table", speed_table=table)
        return Settings(output_rate=rate, outputs=OUTPUTS, drive=drive)


def _series(result: Result, name: str) -> Floats:
    """A reading or force by its name among the outputs of the linear vehicle."""
    kind, *labels = name.split(".")
    if kind in ("Q", "Y"):
        return np.asarray(result[kind][:, int(labels[0]) - 1, int(labels[1] == "right")])
    if kind in ("sum_Y", "lateral"):
        quantity = "wheelset_lateral" if kind == "lateral" else kind
        return np.asarray(result[quantity][:, int(labels[0]) - 1])
    if labels[0] == "roll_rate":
        return np.asarray(result.series("sensor_roll_rate", sensor=kind))
    return np.asarray(result.series("sensor_acceleration", sensor=kind, axis=labels[0]))


Run = Callable[[Floats], Reading | str]
Map = Callable[[Floats], Floats]
Pair = tuple[Floats, Floats]


def refine(
    run: Run, gain: Map, response: Map, data: tuple[Floats, Flags], first: Pair, most: int
) -> Refined | str:
    """Solve (1), starting from the linear estimate.

    `run`: float64[quantity, points] to what is read on the n of the grid. `gain`, `response`: K, H:
    float64[channel, points] to float64[quantity, points] and back. `data` (float64[channel, n]):
    y, and where it exists.  A constant in it is the channel's, not the track's. `first`,
    `deviations` (float64[quantity, points]): Irregularities to begin with, and what they are
    measured with [m]. `most`: Number of runs. Returns: The best step; why the first run was not
    complete.
    """
    y, valid = data
    r, deviations = first
    scale = np.where(deviations > 0.0, deviations, np.inf)[:, None]
    n = y.shape[1]
    guesses: list[Floats] = []
    residuals: list[Floats] = []
    best: Refined | str = "not there"
    for _ in range(most):
        reading = run(r)
        if isinstance(reading, str):
            return reading if isinstance(best, str) else best
        rest = np.where(valid, y - reading.channels, 0.0)
        count = np.maximum(valid.sum(axis=1, keepdims=True), 1)
        read = np.array(response(r))
        read[:, :n] += np.where(valid, rest - rest.sum(axis=1, keepdims=True) / count, 0.0)
        residual = (gain(read) - r) / scale
        change = float(np.sqrt(np.mean(residual[:, :n] ** 2, axis=1)).max())
        if isinstance(best, str) or change < best.change:
            best = Refined(r, reading, read, change)
        if change < CHANGE:
            return best
        guesses, residuals = [*guesses, r / scale][-KEPT:], [*residuals, residual][-KEPT:]
        r = np.where(np.isfinite(scale), scale, 0.0) * _mixed_step(guesses, residuals)
    return best


def _mixed_step(guesses: list[Floats], residuals: list[Floats]) -> Floats:
    """Next step: of the mixture with the least residual, with a share of that residual."""
    if len(guesses) == 1:
        return guesses[0] + SHARE * residuals[0]
    moved = np.diff(np.reshape(guesses, (len(guesses), -1)), axis=0).T
    changed = np.diff(np.reshape(residuals, (len(guesses), -1)), axis=0).T
    weights = np.linalg.lstsq(changed, residuals[-1].ravel(), rcond=1e-8)[0]
    step = SHARE * residuals[-1].ravel() - (moved + SHARE * changed) @ weights
    return np.asarray(guesses[-1] + step.reshape(guesses[-1].shape))
