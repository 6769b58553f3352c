"""Slopes of the contact forces on elastic rails that learn from the errors of their forecasts.

After each step of `support_step` the difference of the forces found and foreseen is known.  It goes
into two numbers a wheel, part of the state, that are added to the slopes of the contact (`learn`).
Where corrections show that they are wrong they are forgotten (`relax_corrections`).
"""

from railsim.kernels import compiled
from railsim.kernels.lanes import (
    beside,
    larger,
    load_rows,
    pair_starts,
    smaller,
    spread,
    store_rows,
    where_beyond,
)
from railsim.kernels.support import BEFORE, LEARNT_SIZE, PATCHES, RELAXATION, SUPPORT_STEP

# `learn`: scale of the way [m] in a step of this length [s]; share of an error that is learnt, what
# is added to the square of the way, what a step forgets; share of the static wheel load from which
# on an error is large
WAY, WHOLE_STEP = 5e-6, 1.25e-3
GAIN, REST, FORGOTTEN = 0.3, 0.05, 0.01
LARGE_Y, LARGE_Z = 0.1, 0.3
# `relax_corrections`: least relaxation; growth of the squared imbalance from which on what the
# slopes have learnt is forgotten
LEAST_RELAXATION, WORSE = 0.05, 4.0
# bounds of what slopes learn [N/m]
LEAST_K, MOST_K = -2e7, 3e8


@compiled(inline=True)
def learn(work, state, learnt, own, load, h):
    """Take the errors of the forces foreseen in the last step into the slopes at eight wheels.

    Normalised least mean squares (Widrow and Hoff 1960): of an error e with the way y of the step,
    in units of `WAY` at 1.25 ms, the slopes take gain e y/(y^2 + rest).  They are forgotten slowly,
    and at once where the set of patches changes, a wheel lifts or the error is large: there the
    contact is another one.
    """
    zero, one, share = spread(0.0), spread(1.0), h / WHOLE_STEP
    per_way = 1.0 / (WAY * share)
    y_y, z_y, way, error_y, error_z, before = load_rows(state, learnt, 0, LEARNT_SIZE)
    patches, d_y, d_z = load_rows(work.support, own, PATCHES, 3)
    # the first error of the step, also where rails have moved for it at once
    either = error_y * error_y + error_z * error_z
    d_y, d_z = where_beyond(either, 0.0, error_y, d_y), where_beyond(either, 0.0, error_z, d_z)
    known = where_beyond(patches - before, 0.0, zero, where_beyond(patches, 0.0, one, zero))
    known = where_beyond(d_y / load, LARGE_Y, zero, known)
    known = where_beyond(d_z / load, LARGE_Z, zero, known)
    y = per_way * way
    keep = known * (1.0 - FORGOTTEN * share)
    y = known * GAIN / (y * y + REST) * per_way * y
    store_rows(
        state,
        learnt,
        0,
        (
            bounded(keep * y_y + d_y * y, LEAST_K, MOST_K),
            bounded(keep * z_y + d_z * y, -MOST_K, MOST_K),
            way,
            zero,
            zero,
            patches,
        ),
    )


@compiled(inline=True)
def bounded(value, least, most):
    """The value, not beyond its bounds."""
    return smaller(spread(most), larger(spread(least), value))


@compiled(inline=True)
def relax_corrections(work, state, wheels, learnt, y, z, begins):
    """Multiply imbalances of eight rails so that corrections do what the last ones missed.

    The relaxation of Irons and Tuck (1969) after Aitken: of the part of the slopes' error that
    dominates, convergence as with the secant.  Where the last correction has more than doubled the
    imbalance, what the slopes have learnt is wrong, and forgotten.  `begins`: nothing was corrected
    before; `learnt`: where the state keeps what the slopes have learnt.
    """
    rails = pair_starts(wheels, 0, SUPPORT_STEP, 2)
    factor = pair_starts(wheels, 0, SUPPORT_STEP, 1)
    relaxation = spread(1.0)
    if not begins:
        b_y, b_z = load_rows(work.support_step, rails, BEFORE, 2)
        last = load_rows(work.support_step, factor, RELAXATION, 1)[0]
        d_y, d_z = y - b_y, z - b_z
        square = d_y * d_y + d_z * d_z
        found = -(b_y * d_y + b_z * d_z) / square * last
        relaxation = where_beyond(square, 0.0, bounded(found, LEAST_RELAXATION, 3.0), last)
        zero, one = spread(0.0), spread(1.0)
        more = y * y + z * z - WORSE * (b_y * b_y + b_z * b_z)
        keep = where_beyond(larger(zero, more + beside(more)), 0.0, zero, one)
        y_y, z_y = load_rows(state, learnt, 0, 2)
        store_rows(state, learnt, 0, (keep * y_y, keep * z_y))
    store_rows(work.support_step, rails, BEFORE, (y, z))
    store_rows(work.support_step, factor, RELAXATION, (relaxation,))
    return relaxation * y, relaxation * z
