"""The first start on a machine: one process compiles while another builds contact tables.

Both take their time once: some 50 s for the time loop, some 15 s for the kernels that build tables,
and the tables of the first pair of profiles.
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from railsim.contact.creep import creep_force
from railsim.contact.table import ContactTable
from railsim.definitions import Settings
from railsim.definitions.loading import load_track, load_vehicle
from railsim.kernels.compiler import PRIVATE
from railsim.kernels.contact_table import N_FIELD, N_PATCH
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.time_loop import FAST, Chunk, time_loop
from railsim.model.assembly import assemble
from railsim.model.time_step import empty_recorder
from railsim.model.work import work_arrays
from railsim.processes import WorkerPool, available_cores

if TYPE_CHECKING:
    from concurrent.futures import Future


def is_compiled() -> bool:
    """Whether the compiled time loop is available; true also if none is stored."""
    folder = _folder()
    return folder is None or any(folder.glob("time_loop.time_loop-*.nbc"))


def _folder() -> Path | None:
    statistics = getattr(time_loop, "stats", None)  # None: the compiler is switched off
    return Path(statistics.cache_path) if statistics and statistics.cache_path else None


@contextmanager
def compiled_beside() -> Iterator[None]:
    """Compile the time loop in another process during the block, where nobody has compiled it.

    With one core, or where nothing can be stored, this process compiles when it calls the time
    loop; so does a worker process, whose pool knows better how many there are.  The creep laws,
    a tenth of the loop, this process compiles after the block, and the other one loads them.
    """
    if is_compiled():
        yield
        return
    with ExitStack() as stack:
        compiling = _begun(stack)
        yield
        creep_force(3e-3, 4e-3, 50e3, 0.3, 1e-3, 0.0, 0.0)
        if compiling is not None:
            compiling.exception()  # then this process meets it too


def _begun(stack: ExitStack) -> "Future[None] | None":
    """Begin to compile in a process of its own, if there may be one."""
    folder = _folder()
    if not PRIVATE or folder is None or not os.access(folder, os.W_OK):
        return None
    # no part of other starts
    from multiprocessing import parent_process

    if available_cores() < 2 or parent_process() is not None:
        return None
    return stack.enter_context(WorkerPool(1)).submit(compile_time_loop)


def _empty_table(*_: Any, **how: Any) -> ContactTable:
    """Return an empty contact table: compiled code depends on its type alone."""
    values = np.zeros((N_PATCH, 2, 2, 2, N_FIELD))
    numbers = 0.0, 1.0, 0.0, 1.0, np.zeros(2), 0.0, how["radius"], how["centre_height"]
    return ContactTable(values, *numbers, how["G"], how["nu"])


def compile_time_loop() -> None:
    """Compile the equations of motion and the time loop by calls without states and steps."""
    coach, track = load_vehicle("coach_manchester"), load_track("straight")
    model = assemble(coach, track, Settings(), make_table=_empty_table)
    system, work, state = model.system, work_arrays(model.system), np.zeros(model.n_state)
    right_hand_sides(system, work, state[None][:0], state[None][:0])
    recorder, stages = empty_recorder(model, 1), np.zeros((3, len(state)))
    time_loop(system, work, state, state.copy(), stages, recorder, FAST, 1e-3, Chunk(0, 0, 1))
