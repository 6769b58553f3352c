"""How much of a full grid's Pareto front `railsim optimise` finds with a fifth of its designs.

    python benchmarks/optimise.py OUT [STUDY] [--side 20] [--seeds 0 1 2] [--method surrogate]

The two variables of STUDY are put on a grid of SIDE x SIDE designs; then each seed has a fifth of
as many.  Both volumes are measured from the worst feasible value of each objective on the grid.
Folders are continued, so that the command can be repeated.
"""

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pymoo.indicators.hv import HV

from railsim.definitions.loading import load_study
from railsim.studies.optimise import optimise
from railsim.studies.search import METHODS, Task, non_dominated


@dataclass
class Grid:
    """A search that computes a full grid."""

    side: int

    def __call__(self, task: Task) -> None:
        ends = np.linspace(0.0, 1.0, self.side)
        points = np.stack(np.meshgrid(ends, ends, indexing="ij"), axis=-1).reshape(-1, 2)
        for begin in range(0, len(points), self.side):
            task.evaluate(points[begin : begin + self.side])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("study", nargs="?", default="examples/primary_and_yaw_damper.toml")
    parser.add_argument("--side", type=int, default=20)
    parser.add_argument("--seeds", type=int, nargs="*", default=[0, 1, 2])
    parser.add_argument("--method", default="surrogate")
    asked = parser.parse_args()
    definition = load_study(asked.study)
    assert definition.optimise is not None
    how = {"workers": 1, "resume": True}
    begin = time.process_time()
    usual, METHODS["surrogate"] = METHODS["surrogate"], Grid(asked.side)
    grid = optimise(definition, out=asked.out / "grid", method="surrogate",
                    evaluations=asked.side**2, **how)  # fmt: skip
    METHODS["surrogate"] = usual
    print(f"grid: {len(grid.designs)} designs, {time.process_time() - begin:.0f} s CPU", flush=True)
    signs = np.array([1.0 if o.goal == "minimise" else -1.0 for o in grid.definition.objectives])
    values = np.array([d.objectives for d in grid.designs if d.feasible])
    reference = (signs * values).max(axis=0)
    volume_of = HV(ref_point=reference)
    whole = volume_of((signs * values)[non_dominated(signs * values)])
    shares = {}
    for seed in asked.seeds:
        begin = time.process_time()
        found = optimise(definition, out=asked.out / f"{asked.method}_{seed}", seed=seed,
                         method=asked.method, evaluations=asked.side**2 // 5, **how)  # fmt: skip
        front = np.array([design.objectives for design in found.front])
        volume = volume_of(signs * front) / whole
        shares[seed] = volume
        print(f"seed {seed}: {len(found.designs)} designs, front of {len(found.front)}, "
              f"{100.0 * volume:.2f} % of the grid's volume, "
              f"{time.process_time() - begin:.0f} s CPU", flush=True)  # fmt: skip
    print(json.dumps({"grid": whole, "reference": (signs * reference).tolist(), "shares": shares}))


if __name__ == "__main__":
    main()
