"""Division of the steps over which a wheel lifts or strikes.

Before each step the change of every contact force over it is predicted, from the penetration and
its rate and from the slopes of the rails ahead (`wheel_contact`, `rails.predict_rate_changes`).
"""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.internal import constant_decays
from railsim.kernels.support import step_compliance
from railsim.kernels.system import AHEAD, DIVIDED, LOCATED, PARTS, SHARE


@compiled(python=False)
def prepare_steps(system, work, h):
    """Decays and rails' compliance over steps of length `h` and over their parts."""
    parts = work.parts[PARTS]
    work.watch[LOCATED] = np.nan  # of another track
    work.watch[AHEAD] = h if parts > 0 else 0.0
    constant_decays(system.internal, h, work.decay)
    if parts > 0:
        constant_decays(system.internal, h / parts, work.decay_part)
    if system.support.elastic:
        step_compliance(system.support, h, work.compliance)


@compiled(python=False)
def striking(system, work, h):
    """First wheelset with a contact force about to change by more than a share of the wheel load.

    There wheels lift, strike, or ring afterwards; -1 where nothing does, or no step is divided.
    """
    contact, share = system.contact, work.watch[SHARE]
    if work.parts[PARTS] > 0:
        for w in range(contact.body.shape[0]):
            if work.force_rate[w] * h > share * contact.load[w]:
                return w
    return -1


@compiled(python=False)
def begin_division(system, work, length):
    """Begin a step that is taken in parts of a `length`."""
    work.parts[DIVIDED] += 1
    if system.support.elastic:
        step_compliance(system.support, length, work.compliance)


@compiled(python=False)
def end_division(system, work, h):
    """Go back to whole steps of length `h`."""
    if system.support.elastic:
        step_compliance(system.support, h, work.compliance)
