"""Adaptation of the slopes of contact forces on elastic rails to the errors of their predictions.

After each step of `support_step` the difference of the forces found and predicted is known.  It
corrects two numbers a wheel, part of the state, that are added to the slopes of the contact
(`adapt_slopes`).  Where the iteration shows that they are wrong they are reset (`relax_imbalance`).
"""

from railsim.kernels import compiled
from railsim.kernels.lanes import (
    load_rows,
    maximum,
    minimum,
    pair_starts,
    splat,
    store_rows,
    swap_pairs,
    where_beyond,
)
from railsim.kernels.support import LAST_IMBALANCE, LMS_SIZE, PATCHES, RELAXATION, SUPPORT_STEP

# `adapt_slopes`: scale of the motion [m] in a step of this length [s]; gain, regularisation of the
# squared motion, leakage in a step; share of the static wheel load from which on an error is large
MOTION_SCALE, REFERENCE_STEP = 5e-6, 1.25e-3
GAIN, REGULARISATION, LEAKAGE = 0.3, 0.05, 0.01
LARGE_ERROR_Y, LARGE_ERROR_Z = 0.1, 0.3
# `relax_imbalance`: least relaxation; growth of the squared imbalance that resets the adaptation
MIN_RELAXATION, DIVERGENCE = 0.05, 4.0
# bounds of the adaptation [N/m]
MIN_K, MAX_K = -2e7, 3e8


@compiled(inline=True)
def adapt_slopes(work, state, lms, rows, load, h):
    """Adapt the slopes at eight wheels to the errors of the forces predicted in the last step.

    Normalised least mean squares (Widrow and Hoff 1960): of an error e with the motion y of the
    step, in units of `MOTION_SCALE` at 1.25 ms, the slopes take gain e y/(y^2 + REGULARISATION).
    They leak slowly, and are reset where the set of patches changes, a wheel lifts or the error is
    large: there the contact is another one.
    """
    zero, one, share = splat(0.0), splat(1.0), h / REFERENCE_STEP
    per_motion = 1.0 / (MOTION_SCALE * share)
    y_y, z_y, motion, error_y, error_z, patches_0 = load_rows(state, lms, 0, LMS_SIZE)
    patches, d_y, d_z = load_rows(work.support, rows, PATCHES, 3)
    # the first error of the step, also where rails have moved for it at once
    square = error_y * error_y + error_z * error_z
    d_y, d_z = where_beyond(square, 0.0, error_y, d_y), where_beyond(square, 0.0, error_z, d_z)
    valid = where_beyond(patches - patches_0, 0.0, zero, where_beyond(patches, 0.0, one, zero))
    valid = where_beyond(d_y / load, LARGE_ERROR_Y, zero, valid)
    valid = where_beyond(d_z / load, LARGE_ERROR_Z, zero, valid)
    y = per_motion * motion
    retention = valid * (1.0 - LEAKAGE * share)
    y = valid * GAIN / (y * y + REGULARISATION) * per_motion * y
    store_rows(
        state,
        lms,
        0,
        (
            clamp(retention * y_y + d_y * y, MIN_K, MAX_K),
            clamp(retention * z_y + d_z * y, -MAX_K, MAX_K),
            motion,
            zero,
            zero,
            patches,
        ),
    )


@compiled(inline=True)
def clamp(value, low, high):
    """The value, not beyond its bounds."""
    return minimum(splat(high), maximum(splat(low), value))


@compiled(inline=True)
def relax_imbalance(work, state, wheels, lms, y, z, first):
    """Multiply imbalances of eight rails so that corrections do what the last ones missed.

    The relaxation of Irons and Tuck (1969) after Aitken: of the part of the slopes' error that
    dominates, convergence as with the secant.  Where the last correction has more than doubled the
    imbalance, the adaptation is wrong, and reset.  `first`: nothing was corrected before; `lms`:
    where the state keeps the adaptation.
    """
    rails = pair_starts(wheels, 0, SUPPORT_STEP, 2)
    factor = pair_starts(wheels, 0, SUPPORT_STEP, 1)
    relaxation = splat(1.0)
    if not first:
        b_y, b_z = load_rows(work.support_step, rails, LAST_IMBALANCE, 2)
        last = load_rows(work.support_step, factor, RELAXATION, 1)[0]
        d_y, d_z = y - b_y, z - b_z
        square = d_y * d_y + d_z * d_z
        estimate = -(b_y * d_y + b_z * d_z) / square * last
        relaxation = where_beyond(square, 0.0, clamp(estimate, MIN_RELAXATION, 3.0), last)
        zero, one = splat(0.0), splat(1.0)
        excess = y * y + z * z - DIVERGENCE * (b_y * b_y + b_z * b_z)
        retention = where_beyond(maximum(zero, excess + swap_pairs(excess)), 0.0, zero, one)
        y_y, z_y = load_rows(state, lms, 0, 2)
        store_rows(state, lms, 0, (retention * y_y, retention * z_y))
    store_rows(work.support_step, rails, LAST_IMBALANCE, (y, z))
    store_rows(work.support_step, factor, RELAXATION, (relaxation,))
    return relaxation * y, relaxation * z
