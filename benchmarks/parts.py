"""Time per right-hand side and its parts, FASTSIM over its grid, table look-up."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import loops
import numpy as np
from loops import Part
from numpy.typing import NDArray

from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import Settings
from railsim.kernels.fastsim import fastsim_workspace
from railsim.kernels.patches import Patches
from railsim.kernels.time_loop import FAST, Chunk, time_loop
from railsim.model.time_step import empty_recorder
from railsim.model.work import work_arrays
from railsim.simulation import prepare
from railsim.simulation.advance import Preparation

Floats = NDArray[np.float64]
GRIDS = (5, 10, 20, 50)
REPETITIONS = 50
CALLS = 1000  # evaluations in one repetition: taking a System apart for a call is 10 us
PATCHES = 10

PARTS = {
    "track frames": Part.FRAMES,
    "kinematics": Part.KINEMATICS,
    "links": Part.LINKS,
    "mounts": Part.MOUNTS,
    "normal contact with table look-up": Part.NORMAL_CONTACT,
    "creepages, Kalker's coefficients": Part.CREEPAGES,
    "FASTSIM 10 x 10": Part.FASTSIM,
    "creep forces on the wheelsets": Part.CREEP_FORCES,
    "dynamics": Part.DYNAMICS,
}


def least_time(call: Callable[[], Any], repetitions: int, evaluations: int) -> float:
    """Return the least time of one evaluation [s].

    Many short repetitions: one of them runs undisturbed, however loaded the machine is.
    """
    call()
    best = np.inf
    for _ in range(repetitions):
        begin = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - begin)
    return best / evaluations


def state_at(vehicle: str, track: str, speed: float, distance: float) -> tuple[Preparation, Floats]:
    """Prepare a run and advance it to a position along the track."""
    prepared = prepare(load_vehicle(vehicle), load_track(track), Settings(), speed)
    system, state = prepared.model.system, prepared.state.copy()
    step, _ = prepared.steps.at(speed)
    steps = int(distance / speed / step)
    time_loop(
        system,
        work_arrays(system),
        state,
        np.zeros_like(state),
        np.zeros((3, len(state))),
        empty_recorder(prepared.model, 1),
        FAST,
        step,
        Chunk(1, steps, 1 << 40, fresh=1),
    )
    return prepared, state


def right_hand_side_parts(
    vehicle: str = "coach_manchester",
    track: str = "curve_r250",
    speed: float = 20.0,
    distance: float = 396.0,
    repetitions: int = REPETITIONS,
) -> dict[str, Any]:
    """Measure the right-hand side and its parts in the middle of the curve.

    Returns
    -------
    dict
        `patches`; times in seconds: `right_hand_side` (as RK4 calls it), `evaluation` (as the fast
        scheme calls it), `wheel_rail`, `parts` by name, `rest`: evaluation less the parts, `step`:
        a whole step of the fast scheme in the loop.
    """
    prepared, state = state_at(vehicle, track, speed, distance)
    model = prepared.model
    system, work = model.system, work_arrays(model.system)
    derivative = np.zeros_like(state)

    def repeated(part: Part, patches: int = 0, n: int = 1) -> int:
        return int(loops.many(int(part), system, work, state, derivative, patches, n))

    repeated(Part.RIGHT_HAND_SIDE)
    patches = repeated(Part.NORMAL_CONTACT)
    # FASTSIM needs creepages, the rest the forces that belong to them
    repeated(Part.RIGHT_HAND_SIDE)

    def measured(part: Part) -> float:
        found = least_time(lambda: repeated(part, patches, CALLS), repetitions, CALLS)
        # forces add up and columns are overwritten: start again
        repeated(Part.RIGHT_HAND_SIDE)
        return found

    parts = {name: measured(part) for name, part in PARTS.items()}
    evaluation = measured(Part.MECHANICS)
    return {
        "vehicle": vehicle,
        "place": distance,
        "patches": patches,
        "right_hand_side": measured(Part.RIGHT_HAND_SIDE),
        "evaluation": evaluation,
        "wheel_rail": measured(Part.WHEEL_RAIL),
        "parts": parts,
        "rest": evaluation - sum(parts.values()),
        "step": _step_time(prepared, state, repetitions),
        "look_up": measured(Part.LOOK_UP),
    }


def _step_time(prepared: Preparation, state: Floats, repetitions: int) -> float:
    """Time of a step of the fast scheme along the curve [s]."""
    system = prepared.model.system
    work, trial = work_arrays(system), state.copy()
    derivative, stages = np.zeros_like(state), np.zeros((3, len(state)))
    recorder = empty_recorder(prepared.model, 1)
    step, _ = prepared.steps.at(float(state[-1]))

    def some_steps() -> None:
        trial[:] = state
        time_loop(
            system, work, trial, derivative, stages, recorder, FAST, step, Chunk(1, CALLS, 1 << 40)
        )

    return least_time(some_steps, repetitions, CALLS)


def fastsim_grids(
    grids: Sequence[int] = GRIDS, patches: int = PATCHES, repetitions: int = REPETITIONS
) -> list[dict[str, float]]:
    """Measure FASTSIM over its grid, time per patch of `patches` together and of one alone [s]."""
    inputs = patch_inputs(patches)
    rows = []
    for cells in grids:
        work = fastsim_workspace(patches, cells, cells)
        calls = max(1, round(2000 / cells**2))

        def per_patch(n: int, cells: int = cells, work: Floats = work, calls: int = calls) -> float:
            return least_time(
                lambda: loops.many_fastsim_patches(n, cells, cells, inputs, 82e9, work, calls),
                repetitions,
                calls * n,
            )

        rows.append({"grid": cells, "together": per_patch(patches), "alone": per_patch(1)})
    return rows


def patch_inputs(patches: int) -> Patches:
    """Return patches of a curving coach, some of which slide."""
    share = np.linspace(0.1, 1.0, patches)
    one = np.ones(patches)
    return Patches(
        a=6e-3 * one,
        b=4e-3 * one,
        mu_N=0.4 * 60e3 * share,
        c11=4.5 * one,
        c22=4.0 * one,
        c23=1.8 * one,
        c33=one,
        xi_x=1e-3 * share,
        xi_y=-4e-3 * share,
        phi=0.5 * share,
        T_x=np.zeros(patches),
        T_y=np.zeros(patches),
        M_z=np.zeros(patches),
        outside=np.zeros(patches),
    )
