"""Runs that are timed: speed of the time loop, and its error at that speed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

import numpy as np

from railsim.bench.machine import hardware, vector_instructions, versions
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import Settings
from railsim.result import Result, mid_curves
from railsim.result.extremes import peak
from railsim.simulation import simulate
from railsim.table import Column, Table

RELATIVE = ("Q", "Y", "sum_Y", "wheelset_lateral", "wheelset_yaw", "Y_over_Q")
REFERENCE_STEP = 0.125e-3  # s, of RK4


@dataclass(frozen=True)
class Scenario:
    """One run."""

    name: str  # in tables
    vehicle: str  # name of a shipped file
    track: str  # likewise
    speed: float  # m/s
    irregularity: str | None = None  # spectrum of random irregularities on the track
    settings: tuple[tuple[str, Any], ...] = ()  # what differs from the default settings
    support: str | None = None  # preset of the track's support, by default its own
    until: float | None = None  # end of the run [m], by default that of the track
    target: float | None = None  # least multiple of real time that it is to reach

    def run(self, **settings: Any) -> Result:
        """Run it, with further settings if given."""
        track = load_track(self.track)
        if self.irregularity:
            track = track.replace(
                irregularities=[{"type": "random", "spectrum": self.irregularity}]
            )
        if self.support:
            track = track.replace(support={"preset": self.support})
        return simulate(
            load_vehicle(self.vehicle),
            track,
            speed=self.speed,
            until=self.until,
            settings=Settings.model_validate(dict(self.settings) | settings),
        )

    def reference(self) -> Result:
        """Run it by RK4 at `REFERENCE_STEP`."""
        return self.run(scheme="rk4", step=REFERENCE_STEP)


RUNS = (
    Scenario("Manchester coach, R 250 m", "coach_manchester", "curve_r250", 20.0, target=300.0),
    Scenario("flexicoil coach, R 250 m", "coach_flexicoil", "curve_r250", 20.0, target=250.0),
    Scenario(
        "Manchester coach, straight, ERRI B176 low, 40 m/s",
        "coach_manchester",
        "straight",
        40.0,
        irregularity="erri_b176_low",
        until=600.0,
    ),
)
"""Two coaches through a curve, and one on irregular rails; all on elastic ones."""


def benchmark(
    runs: Sequence[Scenario] = RUNS,
    repetitions: int = 3,
    *,
    errors: bool = True,
    progress: Callable[[float], None] = lambda _: None,
) -> dict[str, Any]:
    """Time runs, in turn: what disturbs the machine disturbs all of them.

    Returns plain numbers and strings, SI: `hardware`, `versions` and `runs`, each as `speed`, with
    `error` where asked for.
    """
    results: dict[Scenario, list[Result]] = {run: [] for run in runs}
    for _ in range(repetitions):
        for run in runs:
            results[run].append(run.run())
            progress(0.5 * sum(map(len, results.values())) / (repetitions * len(runs)))
    found = [{"name": run.name, "target": run.target, **speed(results[run])} for run in runs]
    references: dict[Scenario, Result] = {}
    for number, run in enumerate(runs if errors else ()):
        # the same run in another scheme has the same reference
        plain = replace(run, name="", settings=(), target=None)
        if plain not in references:
            references[plain] = plain.reference()
        found[number]["error"] = error(results[run][0], references[plain])
        progress(0.5 + 0.5 * (number + 1) / len(runs))
    facts = hardware() | {"vectors": vector_instructions()}
    return {"hardware": facts, "versions": versions(), "runs": found}


def speed(results: Sequence[Result]) -> dict[str, Any]:
    """Return step and multiples of real time of equal runs.

    `real_time_all`: simulated seconds per CPU second of the time loop, their median `real_time` and
    the best; `cpu_per_step` of the best [s].
    """
    facts = results[0].attributes
    factors = [float(result.attributes["real_time_factor"]) for result in results]
    return {
        **{name: facts[name] for name in ("speed", "scheme", "step", "duration", "status")},
        "real_time": median(factors),
        "real_time_best": max(factors),
        "real_time_all": factors,
        "cpu_per_step": float(facts["step"]) / max(factors),
    }


def error(result: Result, reference: Result) -> dict[str, float]:
    """Return what a result is off from a reference of the same output instants.

    `dQ_over_Q0` of the peak, the worse of both signs [1]; `Y` of the peak and `Y_mid_curve` of any
    wheel [N]; `yaw` of the peak [1, relative]; `peaks`: the largest relative error of all peaks of
    `RELATIVE` and of both signs of dQ/Q0.
    """

    def values(name: str, kind: str = "abs") -> tuple[float, float]:
        found = peak(result, name, kind).value, peak(reference, name, kind).value
        # magnitudes: of two equal peaks of opposite sign either may be the larger by round-off
        return (abs(found[0]), abs(found[1])) if kind == "abs" else found

    unloading = [values("dQ_over_Q0", kind) for kind in ("max", "min")]
    pairs = [*unloading, *(values(name) for name in RELATIVE)]
    lateral, yaw = values("Y"), values("wheelset_yaw")
    curves = zip(mid_curves(result, ["Y"]), mid_curves(reference, ["Y"]), strict=True)
    middle = [np.max(np.abs(a.values["Y"] - b.values["Y"])) for a, b in curves]
    return {
        "dQ_over_Q0": max(abs(a - b) for a, b in unloading),
        "Y": abs(lateral[0] - lateral[1]),
        "Y_mid_curve": float(max(middle, default=0.0)),
        "yaw": abs(yaw[0] / yaw[1] - 1.0),
        "peaks": max(abs(a - b) / max(abs(b), 1e-12) for a, b in pairs),
    }


def table(runs: Sequence[dict[str, Any]]) -> Table:
    """Return the timed runs as a table."""
    columns = [
        Column("name", "time loop"),
        Column("step", "step (ms)", format=".3g"),
        Column("real_time", "x real time", format=".0f"),
        Column("real_time_best", "best", format=".0f"),
        Column("target", format=".0f"),
        Column("cpu_per_step", "us per step", format=".2f"),
        Column("dQ_over_Q0", "dQ/Q0", "%", ".4f"),
        Column("Y", "Y", "kN", ".4f"),
        Column("Y_mid_curve", "Y mid", "kN", ".4f"),
        Column("yaw", "yaw", "%", ".3f"),
        Column("peaks", "peaks", "%", ".2f"),
    ]
    rows = [
        {
            **run,
            **run.get("error", {}),
            "step": 1e3 * run["step"],
            "cpu_per_step": 1e6 * run["cpu_per_step"],
        }
        for run in runs
    ]
    return Table(columns, rows)
