"""Time of the creep laws: per contact patch and call, and of a whole step in the time loop.

``python benchmarks/creep_laws.py [--patches 10] [--json]``

All patches of a vehicle are computed together: first random ones, stick and slip, then whole time
steps of a coach in the middle of the curve R 250 m, where everything else belongs to the step too.
"""

import argparse
import json
import platform
import time

import numpy as np

from railsim import load_settings, load_track, load_vehicle
from railsim.contact.creep import LAWS, creep_law, creep_scratch
from railsim.contact.kalker import kalker_coefficients
from railsim.kernels import compiled, fastsim_simd
from railsim.kernels.creep import creep_forces
from railsim.kernels.patches import Patches
from railsim.kernels.time_loop import FAST, Chunk, time_loop
from railsim.model.time_step import empty_recorder
from railsim.model.work import work_arrays
from railsim.simulation import prepare

GRIDS = (5, 10, 20, 50)
CURVE = ("coach_manchester", "curve_r250", 20.0, 396.0)  # vehicle, track, m/s, middle of the curve
STEPS = 50


@compiled
def repeated(times, n, law, inputs, scratch):
    for _ in range(times):
        creep_forces(n, law, inputs, scratch)


def patches(n):
    """Mixed patches: treads and flanges, stick and slip."""
    rng = np.random.default_rng(0)
    ratio = np.exp(rng.uniform(-1.5, 2.0, n))
    size = rng.uniform(3e-3, 6e-3, n)
    a, b = size * np.sqrt(ratio), size / np.sqrt(ratio)
    mu_N = rng.uniform(10e3, 40e3, n)
    coefficients = kalker_coefficients(ratio)
    unit = mu_N / (82e9 * a * b)
    creepages = [rng.normal(size=n) * unit / c for c in coefficients[:3]]
    creepages[2] /= size
    arrays = (a, b, mu_N, *coefficients, *creepages, *np.zeros((4, n)))
    return Patches(*(np.ascontiguousarray(v) for v in arrays))


def nanoseconds(law, n, grid, inputs, rounds=25):
    """Least time per patch and call."""
    chosen = creep_law(law, (grid, grid), 82e9, 0.28)
    times = max(10, 200_000 // (grid * grid * n))
    arguments = (n, chosen, inputs, creep_scratch(n, chosen))
    repeated(1, *arguments)
    best = np.inf
    for _ in range(rounds):
        begin = time.perf_counter()
        repeated(times, *arguments)
        best = min(best, time.perf_counter() - begin)
    return 1e9 * best / times / n


def step_microseconds(rounds):
    """Least time of a step of the fast scheme by law, measured in turns; and the chosen steps."""
    vehicle, track, speed, distance = CURVE
    never = 1 << 40
    cases, chosen = {}, {}
    for law in LAWS:
        settings = load_settings(overrides=[f'creep_law="{law}"'])
        prepared = prepare(load_vehicle(vehicle), load_track(track), settings, speed)
        system, state = prepared.model.system, prepared.state.copy()
        step, _ = prepared.steps.at(speed)
        arrays = (work_arrays(system), state, np.zeros_like(state), np.zeros((3, len(state))),
                  empty_recorder(prepared.model, 1))  # fmt: skip
        time_loop(system, *arrays, FAST, step, Chunk(1, int(distance / speed / step), never))
        cases[law], chosen[law] = (system, arrays, state.copy(), step), step
    best = dict.fromkeys(cases, np.inf)
    for _ in range(rounds):
        for law, (system, arrays, state, step) in cases.items():
            arrays[1][:] = state
            begin = time.perf_counter()
            time_loop(system, *arrays, FAST, step, Chunk(1, STEPS, never))
            best[law] = min(best[law], (time.perf_counter() - begin) / STEPS)
    return {law: 1e6 * value for law, value in best.items()}, chosen


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--patches", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=200)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    inputs = patches(options.patches)
    found = {
        "processor": platform.processor() or platform.machine(),
        "avx512": fastsim_simd.available(),
        "patches": options.patches,
        "fastsim_ns": {g: nanoseconds("fastsim", options.patches, g, inputs) for g in GRIDS},
        "other_laws_ns": {
            law: nanoseconds(law, options.patches, 10, inputs)
            for law in ("table", "fastrip", "polach", "linear")
        },
    }
    found["step_us"], found["step_s"] = step_microseconds(options.rounds)
    if options.json:
        print(json.dumps(found))
        return
    print(f"{options.patches} patches, AVX-512: {found['avx512']}; ns per patch and call")
    for grid, value in found["fastsim_ns"].items():
        print(f"fastsim {grid} x {grid}: {value:8.1f}   {value / grid**2:.2f} per cell")
    reference = found["fastsim_ns"][10]
    for law, value in found["other_laws_ns"].items():
        print(f"{law:8} {'10 x 10' if law == 'fastrip' else '       '}: {value:8.1f}   "
              f"{value / reference:.2f} of fastsim 10 x 10")  # fmt: skip
    print("a step of the coach in the curve, us, and the step that was chosen, ms")
    for law, value in found["step_us"].items():
        print(f"{law:8} {value:8.2f}   {value / found['step_us']['fastsim']:.2f} of fastsim   "
              f"{1e3 * found['step_s'][law]:g}")  # fmt: skip


if __name__ == "__main__":
    main()
