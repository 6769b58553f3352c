"""The mirror image of a state: left and right exchanged, entry by entry.

A mirrored run that is set to the mirror image of the other one after every step shows in each step
by itself whether railsim has a preferred side.  Runs that go their own ways do not: flanges at two
patches, strikes and friction make more and more of the round-off.
"""

import numpy as np

from railsim.kernels.state import N_SCALARS
from railsim.kernels.support import DOF, LMS, LMS_SIZE, STEP_RATIO, SUPPORT_SIZE
from railsim.kernels.system import Y_0

ACROSS = np.array([1.0, -1.0, 1.0])  # along, across, down
BODY = np.concatenate((ACROSS, -ACROSS))  # angles are about those axes
# rails left and right, y and z, then the sleeper; what slopes learn, see `railsim.kernels.support`
TRACK, TRACK_SIGNS = (2, 3, 0, 1, 4, 5, 6), (-1, 1, -1, 1, -1, 1, -1)
LEARNT_SIGNS = (1, -1, -1, -1, 1, 1)


def same_rows(rows, others):
    """Index of the equal row in `others` for each of `rows`; equal ones in their order."""
    free, found = list(range(len(others))), []
    for row in rows:
        distance = [np.abs(row - others[k]).max() for k in free]
        assert min(distance) < 1e-9
        found.append(free.pop(int(np.argmin(distance))))
    return np.array(found, dtype=int)


def body_rows(system, sign):
    """What tells bodies apart, with lateral positions times `sign`."""
    bodies = system.bodies
    carrier = np.where(bodies.parent >= 0, bodies.parent, np.arange(len(bodies.kind)))
    row = bodies.row.copy()
    row[:, Y_0] *= sign
    return np.column_stack((bodies.kind, system.frame_offset[bodies.frame[carrier]], row))


def internal_images(system, mirrored, bodies):
    """Where in `system` the image of each internal state of `mirrored` is, and its sign."""
    order, signs = np.arange(len(system.internal.kind)), np.ones(len(system.internal.kind))
    for here, there in ((system.links, mirrored.links), (system.mounts, mirrored.mounts)):
        pairs = same_rows(
            np.column_stack((bodies[here.body], *(ACROSS * here.point[:, k] for k in (0, 1)))),
            np.column_stack((there.body, *(there.point[:, k] for k in (0, 1)))),
        )
        states, images = here.internal, there.internal[pairs]
        order[images[states >= 0]] = states[states >= 0]
        if states.ndim == 2:  # mounts, by axis
            signs[images[states >= 0]] = np.broadcast_to(ACROSS, states.shape)[states >= 0]
    return order, signs


def image(system, mirrored):
    """Indices and signs: ``signs * state[indices]`` is the state's mirror image.

    `system`, `mirrored`: those of the model and of its mirror image, with steady creep forces.
    """
    assert not system.contact.transient
    bodies = same_rows(body_rows(system, -1.0), body_rows(mirrored, 1.0))
    n, m = len(bodies), len(system.internal.kind)
    body = (6 * np.argsort(bodies)[:, None] + np.arange(6)).ravel()
    inner, inner_signs = internal_images(system, mirrored, bodies)
    parts = [body, 6 * n + body, 12 * n + inner, 12 * n + m + body, 18 * n + m + inner]
    body_signs = np.tile(BODY, n)
    signs = [body_signs, body_signs, inner_signs, body_signs, inner_signs]
    first = 18 * n + 2 * m
    if system.support.elastic:
        sides = LMS + (np.arange(2 * LMS_SIZE) + LMS_SIZE) % (2 * LMS_SIZE)
        blocks = (DOF * np.arange(5)[:, None] + TRACK).ravel()
        for _ in system.contact.body:
            parts.append(first + np.concatenate((blocks, sides, [STEP_RATIO])))
            signs.append(np.concatenate((np.tile(TRACK_SIGNS, 5), np.tile(LEARNT_SIGNS, 2), [1])))
            first += SUPPORT_SIZE
    parts.append(first + np.arange(N_SCALARS))
    signs.append(np.ones(N_SCALARS))
    return np.concatenate(parts), np.concatenate(signs)
