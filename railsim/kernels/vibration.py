"""Vibrations of the wheel loads above 40 Hz: how much, how fast, where.

Each wheel load passes a Butterworth high-pass filter of order two at 40 Hz (bilinear transform,
Oppenheim and Schafer, Discrete-Time Signal Processing, 7.2); its mean square and that of its
differences fade with a time constant of 0.1 s, so that a single blow counts little.  Of a harmonic
vibration of the angular frequency w they are A^2/2 and A^2 (1 - cos w h).

A guiding force that alternates from step to step is no motion of the vehicle: the step is too long.
Its second difference is then 4 A with changing sign: half its product with the last but one less
the last is 16 A^2, on average and faded likewise; of what a step follows, below a third of the
steps' frequency (w h < 2 pi/3), the mean, in proportion to cos 2 w h - cos w h, is negative.
"""

from math import acos, exp, pi, sqrt, tan

from railsim.kernels import compiled
from railsim.kernels.contact_columns import W_Y

CUT_OFF = 40.0  # Hz
MEMORY = 0.1  # s

# columns of Work.vibration[w, side]: 1 once begun, memory of the filter, last value, mean squares
# of value and difference; then of the largest vibration so far its amplitude [N], where it was [m]
# and its frequency [Hz]; of the guiding force last value, last difference and second difference,
# 16 A^2 of its alternation, of the largest so far, where that was [m]; second difference before
STARTED, Z_1, Z_2, LAST, SQUARE, D_SQUARE, AMPLITUDE, POSITION, FREQUENCY = range(9)
LAST_Y, D_Y, D2_Y, ALTERNATION_NOW, ALTERNATION, ALTERNATES_AT, LAST_D2_Y = range(9, 16)
VIBRATION = 16  # whole cache lines


@compiled(python=False)
def high_pass_coefficients(h):
    """Coefficients of the filter at the step `h` [s]: b0 = -b1/2 = b2, a1, a2; fading in a step."""
    k = tan(pi * min(CUT_OFF * h, 0.4))
    scale = 1.0 / (1.0 + sqrt(2.0) * k + k * k)
    return (
        scale,
        2.0 * (k * k - 1.0) * scale,
        (1.0 - sqrt(2.0) * k + k * k) * scale,
        exp(-h / MEMORY),
    )


@compiled(inline=True)
def update_alternation(vibration, w, side, guiding, decay, s):
    """Update the alternation of a wheel's guiding force."""
    first = guiding - vibration[w, side, LAST_Y]
    second = first - vibration[w, side, D_Y]
    last = vibration[w, side, D2_Y]
    product = 0.5 * second * (vibration[w, side, LAST_D2_Y] - last)
    alternation = decay * (vibration[w, side, ALTERNATION_NOW] - product) + product
    vibration[w, side, LAST_Y] = guiding
    vibration[w, side, D_Y] = first
    vibration[w, side, D2_Y] = second
    vibration[w, side, LAST_D2_Y] = last
    vibration[w, side, ALTERNATION_NOW] = alternation
    if alternation > vibration[w, side, ALTERNATION]:
        vibration[w, side, ALTERNATION] = alternation
        vibration[w, side, ALTERNATES_AT] = s


@compiled(python=False)
def update_vibration(work, coefficients, h, s):
    """Update the vibrations by the loads of a step of length `h` that begins at arc length `s`.

    `coefficients`: see `high_pass_coefficients`.
    """
    wheel, vibration = work.wheel, work.vibration
    b0, a1, a2, decay = coefficients
    for w in range(wheel.shape[0]):
        for side in range(2):
            load = wheel[w, side, 0]
            if vibration[w, side, STARTED] == 0.0:  # as after a long time at this load
                vibration[w, side, STARTED] = 1.0
                vibration[w, side, Z_1] = -b0 * load
                vibration[w, side, Z_2] = b0 * load
                vibration[w, side, LAST_Y] = wheel[w, side, W_Y]
            update_alternation(vibration, w, side, wheel[w, side, W_Y], decay, s)
            value = b0 * load + vibration[w, side, Z_1]
            vibration[w, side, Z_1] = vibration[w, side, Z_2] - 2.0 * b0 * load - a1 * value
            vibration[w, side, Z_2] = b0 * load - a2 * value
            change = value - vibration[w, side, LAST]
            vibration[w, side, LAST] = value
            square = value * value + decay * (vibration[w, side, SQUARE] - value * value)
            changes = change * change + decay * (vibration[w, side, D_SQUARE] - change * change)
            vibration[w, side, SQUARE] = square
            vibration[w, side, D_SQUARE] = changes
            if 2.0 * square > vibration[w, side, AMPLITUDE] * vibration[w, side, AMPLITUDE]:
                vibration[w, side, AMPLITUDE] = sqrt(2.0 * square)
                vibration[w, side, POSITION] = s
                cosine = max(-1.0, 1.0 - 0.5 * changes / square)
                vibration[w, side, FREQUENCY] = acos(cosine) / (2.0 * pi * h)
