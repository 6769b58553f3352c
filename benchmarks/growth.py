"""How cost grows: wheelsets, FASTSIM cells, output rate, length of the track.

    python benchmarks/growth.py [--out growth.json] [--lengths 5 20 50 100]

Times per evaluation are least times of many repetitions; long runs are commands of their own, whose
CPU time and peak memory are those of the process.
"""

import argparse
import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import tomli_w
from commands import run_command
from parts import least_time

from railsim import simulate
from railsim.bench.machine import hardware, versions
from railsim.definitions.loading import load_track, load_vehicle, load_vehicle_text
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.definition import Vehicle
from railsim.kernels.rhs import right_hand_sides
from railsim.model.work import work_arrays
from railsim.simulation import prepare

COACHES = (1, 2, 4)
GRIDS = (5, 10, 20, 50)
RATES = (10.0, 200.0, 1000.0)
LENGTHS = (5.0, 20.0, 50.0, 100.0)  # km
COACH_LENGTH = 26.4  # m
SPEED = 20.0
EVALUATIONS = 200  # in a call, which takes a System apart in 10 us


def train(coaches: int) -> Vehicle:
    """Several coaches, one behind the other, without couplings."""
    data = tomllib.loads(load_vehicle("coach_manchester").to_toml())
    data.pop("loads", None)  # they name the bodies of one coach
    coach = {key: data.pop(key) for key in ("bodies", "assemblies")}
    coach["placements"] = [
        {"name": f"coach{k}", "position": [-COACH_LENGTH * k, 0.0, 0.0]} for k in range(coaches)
    ]
    data |= {"reference": "coach0.carbody", "assemblies": {"coach": coach}}
    # every car body needs what holds it along the track: a soft spring to the one ahead
    data["elements"] = {
        f"hold{k}": {
            "kind": "spring_damper",
            "stiffness": 1e6,
            "damping": 1e5,
            "bodies": [f"coach{k - 1}.carbody", f"coach{k}.carbody"],
            "points": [
                [-COACH_LENGTH * (k - 0.5) + 0.5, 0.0, -1.0],
                [-COACH_LENGTH * (k - 0.5) - 0.5, 0.0, -1.0],
            ],
        }
        for k in range(1, coaches)
    }
    return load_vehicle_text(tomli_w.dumps(data))


def evaluation(vehicle: Vehicle, settings: Settings) -> dict[str, Any]:
    """Time of one evaluation in steady rolling on straight track."""
    prepared = prepare(vehicle, load_track("straight"), settings, SPEED)
    system, state = prepared.model.system, prepared.state
    work, states = work_arrays(system), np.tile(state, (EVALUATIONS, 1))
    derivatives = np.zeros_like(states)

    def evaluate() -> int:
        return right_hand_sides(system, work, states, derivatives)[2]

    time, patches = least_time(evaluate, 100, EVALUATIONS), evaluate()
    return {
        "wheelsets": len(prepared.model.index.wheelsets),
        "patches": patches,
        "time": time,
        "states": len(state),
    }


def output_rates(rates: Sequence[float]) -> list[dict[str, Any]]:
    vehicle, track = load_vehicle("coach_manchester"), load_track("curve_r250")
    found = []
    for rate in rates:
        settings = Settings(output_rate=rate)
        runs = [simulate(vehicle, track, speed=SPEED, settings=settings) for _ in range(3)]
        best = min(runs, key=lambda run: float(run.attributes["cpu_time"]))
        found.append(
            {
                "rate": rate,
                "step": best.attributes["step"],
                "real_time": best.attributes["real_time_factor"],
            }
        )
    return found


def long_run(kilometres: float, folder: Path) -> dict[str, Any]:
    """One run over straights and curves, output every 10 m."""
    plan, cant = [], []
    sections = max(1, round(kilometres / 5.0))
    for k in range(sections):
        radius = 2000.0 if k % 2 else -2000.0
        plan += [
            {"type": "STR", "length": 3000.0},
            {"type": "CLO", "length": 200.0},
            {"type": "CIR", "length": 1600.0, "radius": radius},
            {"type": "CLO", "length": 200.0},
        ]
        cant += [
            {"type": "CST", "length": 3000.0, "cant": 0.0},
            {"type": "LIR", "length": 200.0},
            {"type": "CST", "length": 1600.0, "cant": 0.02 if radius > 0.0 else -0.02},
            {"type": "LIR", "length": 200.0},
        ]
    plan.append({"type": "STR", "length": 10.0})
    cant.append({"type": "CST", "length": 10.0, "cant": 0.0})
    text = tomli_w.dumps({"format": "railsim-track/1", "name": "long", "plan": plan, "cant": cant})
    (folder / "long.toml").write_text(text)
    run = run_command(
        "run",
        "coach_manchester",
        "long.toml",
        "--speed",
        f"{SPEED:g}",
        "--out",
        "long.h5",
        "--overwrite",
        "--quiet",
        "--set",
        "settings.output_spacing=10.0",
        folder=folder,
    )
    size = (folder / "long.h5").stat().st_size if (folder / "long.h5").exists() else 0
    return {"kilometres": kilometres, "file": size, **run}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", default="growth.json")
    parser.add_argument("--lengths", type=float, nargs="*", default=LENGTHS)
    parser.add_argument("--coaches", type=int, nargs="*", default=COACHES)
    parser.add_argument("--grids", type=int, nargs="*", default=GRIDS)
    parser.add_argument("--rates", type=float, nargs="*", default=RATES)
    options = parser.parse_args()
    coach = load_vehicle("coach_manchester")
    found: dict[str, Any] = {"hardware": hardware(), "versions": versions()}
    found["wheelsets"] = [evaluation(train(coaches), Settings()) for coaches in options.coaches]
    found["cells"] = [
        {"grid": grid, **evaluation(coach, Settings(fastsim_grid=(grid, grid)))}
        for grid in options.grids
    ]
    found["output"] = output_rates(options.rates)
    with TemporaryDirectory() as name:
        found["length"] = [long_run(length, Path(name)) for length in options.lengths]
    text = json.dumps(found, indent=2, default=float)
    Path(options.out).write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    main()
