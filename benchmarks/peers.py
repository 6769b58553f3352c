"""railsim and its peers side by side in one run.

    pip install -e ".[bench]"
    python benchmarks/peers.py [--out peers.json] [--until 450] [--small]

The Manchester coach through the R 250 m curve at 20 m/s on rigid rails, 10 x 10 FASTSIM at every
contact and every evaluation, the same compiled kernels everywhere:

- railsim's default settings;
- scipy `solve_ivp` over the same compiled right-hand side, several methods and tolerances;
- Exudyn with an equivalent coach, several of its solvers and steps (see `exudyn_coach`); railsim
  runs that simplified coach too.

scipy runs the whole track, and straight track with ERRI B176 low irregularities: most of the
curve's track is smooth and straight, which steps of variable length cross in no time.

Of each peer the fastest setting counts whose error against the converged solution is within what
railsim's default run is allowed, or within railsim's own error where that is larger.  CPU times of
the integration alone, of one core; all candidates of a peer run once, the best one and railsim
three times, the least time counts.  `--small` runs 2 m with one setting of each peer, scipy on the
irregular track only, to see that the script works.
"""

import argparse
import json
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from fastsim_benchmark import measure as measure_fastsim
from scipy_peer import Peer

from railsim import simulate
from railsim.bench.machine import hardware, versions
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import Settings

TRACK, SPEED, MIDDLE = "curve_r250", 20.0, 390.0
# What a default run may be off from RK4 at 0.125 ms: unloading [1], Y [N], yaw [1].
ALLOWED = {"dQ_over_Q0": 1e-4, "Y": 50.0, "Y_mid_curve": 50.0, "yaw": 1e-3}
SCIPY = (
    ("RK23", 1e-2),
    ("RK45", 1e-2),
    ("DOP853", 1e-2),
    ("LSODA", 1e-2),
    ("LSODA", 5e-3),
    ("LSODA", 2e-3),
    ("LSODA", 1e-3),
    ("LSODA", 1e-4),
    ("BDF", 1e-3),
)
SCIPY_ROUGH = (("RK23", 1e-2), ("LSODA", 1e-2), ("LSODA", 3e-3), ("LSODA", 1e-3))
EXUDYN = (
    ("VelocityVerlet", 0.5e-3),
    ("VelocityVerlet", 0.3125e-3),
    ("VelocityVerlet", 0.25e-3),
    ("VelocityVerlet", 0.2e-3),
    ("RK44", 0.625e-3),
    ("GeneralizedAlpha", 1.25e-3),
    ("TrapezoidalIndex2", 0.5e-3),
)
# typical sizes of the states: absolute tolerances are these times the relative one
LENGTH, VELOCITY, FORCE = 1e-3, 1e-2, 1e3


def errors(outputs: dict[str, np.ndarray], reference: dict[str, np.ndarray]) -> dict[str, float]:
    """Differences of peaks and mid-curve values, as `railsim.bench.runs.errors`."""
    found = {
        "dQ_over_Q0": max(
            abs(float(extreme(outputs["dQ_over_Q0"]) - extreme(reference["dQ_over_Q0"])))
            for extreme in (np.max, np.min)
        ),
        "Y": abs(float(np.max(np.abs(outputs["Y"])) - np.max(np.abs(reference["Y"])))),
    }
    middle = [
        np.array(
            [
                [np.interp(MIDDLE, run["distance"], run["Y"][:, w, side]) for side in range(2)]
                for w in range(run["Y"].shape[1])
            ]
        )
        for run in (outputs, reference)
    ]
    found["Y_mid_curve"] = float(np.max(np.abs(middle[0] - middle[1])))
    yaw = [float(np.max(np.abs(run["wheelset_yaw"]))) for run in (outputs, reference)]
    found["yaw"] = abs(yaw[0] / yaw[1] - 1.0)
    return found


def railsim_run(vehicle: Any, track: Any, until: float | None, **settings: Any) -> dict[str, Any]:
    result = simulate(
        vehicle, track, speed=SPEED, until=until, settings=Settings.model_validate(settings)
    )
    facts = result.attributes
    return {
        "cpu": facts["cpu_time"],
        "real_time": facts["real_time_factor"],
        "step": facts["step"],
        "outputs": {name: result[name] for name in result},
    }


def judge(
    record: dict[str, Any], reference: dict[str, np.ndarray], ours: dict[str, Any] | None = None
) -> dict[str, Any]:
    outputs = record.pop("outputs")
    if record.get("success", True) and outputs is not None:
        error = record["error"] = errors(outputs, reference)
        own = ours["error"] if ours else {}
        record["allowed"] = all(
            error[name] <= max(limit, own.get(name, 0.0)) for name, limit in ALLOWED.items()
        )
    else:
        record["allowed"] = False
    return record


def fastest(candidates: list[dict[str, Any]]) -> dict[str, Any] | None:
    good = [record for record in candidates if record["allowed"]]
    return max(good, key=lambda record: record["real_time"]) if good else None


def best_of(records: list[dict[str, Any]]) -> dict[str, Any]:
    return max(records, key=lambda record: float(record["real_time"]))


@dataclass(frozen=True)
class Extent:
    """How far the runs go [m]; how many settings of a peer are tried, and how often the best."""

    scipy: float | None
    exudyn: float
    settings: int | None
    repetitions: int


def railsim_record(
    vehicle: Any, track: Any, until: float | None, repetitions: int
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    reference = railsim_run(vehicle, track, until, scheme="rk4", step=0.125e-3)["outputs"]
    runs = [railsim_run(vehicle, track, until) for _ in range(repetitions)]
    return judge(best_of(runs), reference), reference


def scipy_candidates(
    track: Any, choice: tuple[tuple[str, float], ...], extent: Extent
) -> dict[str, Any]:
    vehicle = load_vehicle("coach_manchester")
    ours, reference = railsim_record(vehicle, track, extent.scipy, extent.repetitions)
    peer = Peer.of(vehicle, track, SPEED, extent.scipy)
    n = peer.prepared.model.index.n_bodies
    size = np.concatenate(
        [
            np.full(6 * n, LENGTH),
            np.full(6 * n, VELOCITY),
            np.full(len(peer.kept) - 12 * n - 3, FORCE),
            [1.0, 1.0, 1.0],
        ]
    )

    def solve(method: str, tolerance: float) -> dict[str, Any]:
        found = peer.solve(method, rtol=tolerance, atol=tolerance * size)
        found = judge(found, reference, ours)
        found["options"] = {"tolerance": tolerance}
        print(
            "scipy",
            method,
            tolerance,
            f"{found['real_time']:.2f}",
            found["allowed"],
            found.get("error"),
            flush=True,
        )
        return found

    candidates = [solve(method, tolerance) for method, tolerance in choice[: extent.settings]]
    best = fastest(candidates)
    if best is not None:
        again = [
            solve(best["method"], best["options"]["tolerance"])
            for _ in range(extent.repetitions - 1)
        ]
        best = best_of([best, *again])
    return {"candidates": candidates, "best": best, "railsim": ours}


def exudyn_candidates(track: Any, extent: Extent) -> dict[str, Any]:
    from exudyn_coach import ExudynCoach, simplified_coach

    until = extent.exudyn

    def solve(method: str, step: float) -> dict[str, Any]:
        return ExudynCoach(track, SPEED, until).solve(method, step)

    reference = solve("RK44", 0.25e-3)["outputs"]
    ours, own = railsim_record(simplified_coach(), track, until, extent.repetitions)

    def judged(method: str, step: float) -> dict[str, Any]:
        found = judge(solve(method, step), reference, ours)
        print(
            "exudyn",
            method,
            step,
            f"{found['real_time']:.2f}",
            found["allowed"],
            found.get("error"),
            flush=True,
        )
        return found

    candidates = [judged(method, step) for method, step in EXUDYN[: extent.settings]]
    best = fastest(candidates)
    if best is not None:
        again = [judged(best["method"], best["step"]) for _ in range(extent.repetitions - 1)]
        best = best_of([best, *again])
    return {
        "candidates": candidates,
        "best": best,
        "railsim": ours,
        "until": until,
        "models_differ_by": errors(reference, own),
        "peak_dQ_over_Q0": {
            "exudyn": float(np.max(reference["dQ_over_Q0"])),
            "railsim": float(np.max(own["dQ_over_Q0"])),
        },
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", default="peers.json")
    parser.add_argument("--until", type=float, default=420.0, help="end of the Exudyn run (m)")
    parser.add_argument("--small", action="store_true", help="2 m and one setting of each peer")
    options = parser.parse_args()
    extent = Extent(2.0, 2.0, 1, 1) if options.small else Extent(None, options.until, None, 3)
    found: dict[str, Any] = {"hardware": hardware(), "versions": versions(("exudyn",))}
    curve = load_track(TRACK).with_values({"support.preset": "rigid"})
    rough = (
        load_track("straight")
        .replace(irregularities=[{"type": "random", "spectrum": "erri_b176_low"}])
        .with_values({"support.preset": "rigid"})
    )
    if not options.small:
        found["fastsim"] = measure_fastsim()
        found["scipy"] = scipy_candidates(curve, SCIPY, extent)
    found["scipy, irregular track"] = scipy_candidates(rough, SCIPY_ROUGH, extent)
    if find_spec("exudyn"):
        found["exudyn"] = exudyn_candidates(curve, extent)
    else:
        print("exudyn is not installed: left out")
    for name in ("scipy", "scipy, irregular track", "exudyn"):
        if name not in found:
            continue
        ours, best = found[name]["railsim"], found[name]["best"]
        found[name]["ratio"] = ours["real_time"] / best["real_time"] if best else None
        print(name, "ratio", found[name]["ratio"], "railsim", ours, flush=True)
    Path(options.out).write_text(json.dumps(found, indent=2, default=float) + "\n")


if __name__ == "__main__":
    main()
