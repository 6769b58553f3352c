"""Initial disturbances: added to the state in which a run begins, wheelsets kept on their rails."""

from collections.abc import Callable
from functools import partial

import numpy as np

from railsim.arrays import Floats, first_largest
from railsim.definitions.settings import InitialState, Settings
from railsim.kernels.contact_columns import W_Q
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.state import LAST_STEP
from railsim.kernels.status import RUNNING
from railsim.kernels.system import Work
from railsim.model.assembly import Model
from railsim.model.work import work_arrays
from railsim.notation import COMPONENTS, SIDES

CLOSE = 1e-6  # error of a wheel load over the static one
IMPACT = 0.5  # change of a wheel load over the static one
LONGEST, TURN = 2.5e-4, 5e-3  # way and angle over which the contacts are followed at once [m, rad]
FARTHEST, WIDEST = 0.012, 0.1  # beyond, a wheelset is where it is put [m, rad]
_STEPS = 30

Loads = Callable[[Floats], Floats | None]


def disturb(model: Model, Q0: Floats, settings: Settings, state: Floats) -> tuple[str, ...]:
    """Add the initial disturbance of the settings to a state; return what is to be remarked.

    A wheelset that is moved across the track or turned, and for which neither `z` nor `roll` is
    given, follows its contacts: it is lifted and rolled until its wheels carry what they carried
    before.  Otherwise it would be pressed into the rails: 3 mm sideways on S1002 and 60E1 make
    392 kN of a wheel load of 69 kN.

    `model`: with preloads, on its track; `Q0`: static wheel loads, float64[wheelset, side] [N];
    `state`: float64[n_state], changed in place.
    """
    if not settings.initial:
        return ()
    loads_of = partial(_wheel_loads, model, work_arrays(model.system))
    before = loads_of(state)
    state[LAST_STEP] = 0.0  # the scheme's memory is of the state before
    for name, change in settings.initial.items():
        _add(model, name, change, state)
    remarks = []
    if before is not None:
        for w, name in enumerate(model.index.wheelsets):
            change = settings.initial.get(name, InitialState())
            given = change.z or change.roll
            near = abs(change.y) <= FARTHEST and abs(change.yaw) <= WIDEST
            if (change.y or change.yaw) and near and not given:
                _follow_contacts(model, loads_of, w, change, before[w], state)
        remarks = _impact(model, loads_of(state), before, Q0)
    return tuple(remarks)


def _add(model: Model, body: str, change: InitialState, state: Floats) -> None:
    first = model.index.coordinate(body, 0)
    rate = 6 * model.index.n_bodies + first
    state[first : first + 6] += [getattr(change, name) for name in COMPONENTS]
    state[rate : rate + 6] += [getattr(change, f"v{name}") for name in COMPONENTS]


def _wheel_loads(model: Model, work: Work, state: Floats) -> Floats | None:
    """Wheel loads [wheelset, side] in a state [N]; None where it is outside the model's range."""
    rows = state[None].copy()
    status, *_ = right_hand_sides(model.system, work, rows, np.zeros_like(rows))
    return work.wheel[:, :, W_Q].copy() if status == RUNNING else None


def _follow_contacts(
    model: Model, loads_of: Loads, w: int, change: InitialState, target: Floats, state: Floats
) -> None:
    """Lift and roll wheelset `w` until its wheels carry `wanted`; as it is where that fails.

    It is moved there bit by bit, so that the contacts never lie deep in one another.
    """
    first = model.index.coordinate(model.index.wheelsets[w], 0)
    parts = max(1, round(abs(change.y) / LONGEST), round(abs(change.yaw) / TURN))
    trial = state.copy()
    for part in range(1, parts + 1):
        left = 1.0 - part / parts
        trial[[first + 1, first + 5]] = state[[first + 1, first + 5]]
        trial[first + 1] -= left * change.y
        trial[first + 5] -= left * change.yaw
        if not _make_carry(loads_of, w, first, target, trial):
            return
    state[[first + 2, first + 3]] = trial[[first + 2, first + 3]]


def _make_carry(loads_of: Loads, w: int, first: int, target: Floats, trial: Floats) -> bool:
    """Find the height and roll at which wheelset `w` carries `wanted`, by Newton's method."""
    moved = [first + 2, first + 3]
    for _ in range(_STEPS):
        loads = loads_of(trial)
        if loads is None:
            return False
        rest = loads[w] - target
        if np.max(np.abs(rest)) < CLOSE * np.max(target):
            return True
        slope = np.empty((2, 2))
        for k, at in enumerate(moved):
            nudged = trial.copy()
            nudged[at] += 1e-7
            beside = loads_of(nudged)
            if beside is None:
                return False
            slope[:, k] = (beside[w] - loads[w]) / 1e-7
        if not loads[w].min() > 0.0:  # a wheel in the air has no slope: down onto its rail
            slope += np.array([[1.0, -0.75], [1.0, 0.75]]) * 1e9 * (loads[w] <= 0.0)[:, None]
        trial[moved] -= np.linalg.lstsq(slope, rest, rcond=None)[0]
    return False


def _impact(model: Model, loads: Floats | None, before: Floats, Q0: Floats) -> list[str]:
    """Remark on a disturbance that loads or unloads wheels at once."""
    if loads is None:
        return []
    ratio = np.abs(loads - before) / Q0
    w, side = first_largest(ratio)
    if ratio[w, side] <= IMPACT:
        return []
    return [
        f"The initial disturbance is an impact: Q of {model.index.wheelsets[w]}, {SIDES[side]}, is "
        f"{loads[w, side] / 1e3:.4g} kN at t = 0, at rest {Q0[w, side] / 1e3:.4g} kN. A wheelset "
        "for which neither z nor roll is given follows its contacts, where it stays on them."
    ]
