"""Division of the steps over which a wheel lifts or strikes.

Before each step the change of every contact force over it is predicted, from the penetration and
its rate and from the slopes of the rails ahead (`wheel_contact`, `rails.predict_rate_changes`).
"""

from math import ceil

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import rarely
from railsim.kernels.internal import constant_decays
from railsim.kernels.rail_parts import near_range
from railsim.kernels.state import LAST_STEP
from railsim.kernels.system import (
    AHEAD,
    AT_SECTIONS,
    DIVIDED,
    IMPLICIT,
    LOCATED,
    PARTS,
    PER_PART,
    SHARE,
)

# Long steps on rigid rails are stable by the contacts' stiffness, implicit over the last step.
# Behind a short one they are not, and changes between both feed a wheel that rings: steps are at
# most LONGER times the last one, and divided until forces change by RINGS times `PER_PART` only.
LONGER, RINGS = 2.0, 0.5
WHOLE = 1.0 - 1e-9  # against round-off


@compiled(python=False)
def prepare_steps(system, work, h):
    """Decays over steps of length `h`, and for how long contact forces are foreseen."""
    work.watch[LOCATED] = np.nan  # of another track
    work.watch[AHEAD] = h if work.parts[PARTS] > 0 else 0.0
    constant_decays(system.internal, h, work.decay)


@compiled(python=False)
def striking(system, work, state, h):
    """Wheelset with the contact force that is about to change most, beyond a share of the load.

    There wheels lift, strike, or ring afterwards; -1 where nothing does, or no step is divided; 0
    too behind a short part of a long step on rigid rails, see `LONGER`.

    Returns
    -------
    wheelset, parts : int
        Into how many parts the step is divided, so that no force changes by more than another
        share in one of them, as far as parts may be as short.
    """
    contact, most, change = system.contact, work.parts[PARTS], work.watch[SHARE]
    where, least = -1, 2.0  # fewer than two parts are no division
    if most > 0:
        last = abs(state[LAST_STEP])
        if work.watch[IMPLICIT] > 0.0 and 0.0 < last < h * WHOLE and not system.support.elastic:
            change, times = RINGS * work.watch[PER_PART], ceil(h / (LONGER * last) * WHOLE)
            if times > 1.0:  # whatever the forces do
                where, least = 0, min(times, float(most))
        for w in range(contact.body.shape[0]):
            own = work.force_rate[w] * h / contact.load[w]
            if rarely(contact.rails.range_row.shape[0] > 0) and near_range(system, state, w):
                own *= work.watch[AT_SECTIONS]
            if own > change:
                where, change = w, own
    return where, np.int64(max(least, ceil(min(change / work.watch[PER_PART], float(most)))))


@compiled(python=False)
def begin_division(system, work, length):
    """Begin a step that is taken in parts of a `length`."""
    work.parts[DIVIDED] += 1
    constant_decays(system.internal, length, work.decay_part)
