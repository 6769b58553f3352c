"""Division of the steps over which a wheel lifts or strikes.

Before each step the change of every contact force over it is predicted, from the penetration and
its rate and from the slopes of the rails ahead (`wheel_contact`, `rails.predict_rate_changes`).
"""

from math import ceil

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import unlikely
from railsim.kernels.internal import set_decays
from railsim.kernels.rail_parts import near_range
from railsim.kernels.state import LAST_STEP
from railsim.kernels.system import (
    DIVIDED_STEPS,
    HORIZON,
    IMPLICIT,
    MAX_PARTS,
    PART_SHARE,
    RAILS_AT,
    SECTIONS,
    SHARE,
)

# Long steps on rigid rails are stable by the contacts' stiffness, implicit over the last step.
# Behind a short one they are not, and changes between both feed a wheel that rings: steps are at
# most MAX_GROWTH times the last one, and divided until forces change by RINGING times the share
# of `PART_SHARE` only.
MAX_GROWTH, RINGING = 2.0, 0.5
WHOLE = 1.0 - 1e-9  # against round-off


@compiled(python=False)
def prepare_steps(system, work, h):
    """Decays over steps of length `h`, and for how long contact forces are predicted."""
    work.stepping[RAILS_AT] = np.nan  # of another track
    work.stepping[HORIZON] = h if work.counts[MAX_PARTS] > 0 else 0.0
    set_decays(system.internal, h, work.decay)


@compiled(python=False)
def required_division(system, work, state, h):
    """Wheelset with the contact force that is about to change most, beyond a share of the load.

    There wheels lift, strike, or ring afterwards; -1 where nothing does, or no step is divided; 0
    too behind a short part of a long step on rigid rails, see `MAX_GROWTH`.

    Returns
    -------
    wheelset, parts : int
        Into how many parts the step is divided, so that no force changes by more than another
        share in one of them, as far as parts may be as short.
    """
    contact, n_max, limit = system.contact, work.counts[MAX_PARTS], work.stepping[SHARE]
    wheelset, n_min = -1, 2.0  # fewer than two parts are no division
    if n_max > 0:
        last = abs(state[LAST_STEP])
        if work.stepping[IMPLICIT] > 0.0 and 0.0 < last < h * WHOLE and not system.support.elastic:
            limit = RINGING * work.stepping[PART_SHARE]
            parts = ceil(h / (MAX_GROWTH * last) * WHOLE)
            if parts > 1.0:  # whatever the forces do
                wheelset, n_min = 0, min(parts, float(n_max))
        for w in range(contact.body.shape[0]):
            share = work.force_rate[w] * h / contact.load[w]
            if unlikely(contact.rails.range_row.shape[0] > 0) and near_range(system, state, w):
                share *= work.stepping[SECTIONS]
            if share > limit:
                wheelset, limit = w, share
    return wheelset, np.int64(
        max(n_min, ceil(min(limit / work.stepping[PART_SHARE], float(n_max))))
    )


@compiled(python=False)
def begin_division(system, work, length):
    """Begin a step that is taken in parts of a `length`."""
    work.counts[DIVIDED_STEPS] += 1
    set_decays(system.internal, length, work.decay_part)
