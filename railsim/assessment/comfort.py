"""Ride comfort from accelerations on the floor of the car body: EN 12299 and ISO 2631-1.

Mean comfort (EN 12299): weighted accelerations, root mean squares over 5 s, and their 50 or 95 %
percentiles over 60 blocks.  Comfort on curve transitions P_CT and on discrete events P_DE: from the
lateral acceleration, its change within 1 s and the roll velocity, after a zero-phase low-pass
filter of 2 Hz.

Lateral accelerations are accelerometer readings: they include the component of gravity.

Sources: EN 12299:2009 (replaced by EN 12299:2024) and ISO 2631-1:1997; formulas and constants of
P_CT and P_DE from memory (equal to the older form in per cent of g), the others from secondary
sources.  None has been compared with the printed standards.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats
from railsim.assessment.weighting import WB, WC, WD, WF
from railsim.result.filters import integral, low_passed

BLOCK = 5.0  # s
BLOCKS = 60
EVENT_WINDOW = 2.0  # s
ALL = slice(None)


def block_rms(a: Floats, rate: float) -> Floats:
    """Root mean squares of consecutive complete blocks of 5 s, float64[block, ...]."""
    size = round(BLOCK * rate)
    whole = len(a) // size
    parts = a[: whole * size].reshape(whole, size, *a.shape[1:])
    return np.asarray(np.sqrt(np.mean(parts**2, axis=1)))


@dataclass(frozen=True)
class MeanComfort:
    """Mean comfort at one measuring point."""

    N_MV: float  # index on the floor [1]
    N_VA: float  # seated [1]
    N_VD: float  # standing [1]
    continuous: Floats  # float64[block, 3], rms over 5 s with Wd, Wd, Wb along x, y, z [m/s2]
    blocks: int  # number of blocks of 5 s; the standard requires 60


def en12299_mean_comfort(a: Floats, rate: float) -> MeanComfort:
    """Mean comfort on the floor, of passengers seated and standing (EN 12299).

    N_MV = 6 sqrt(axP95^2 + ayP95^2 + azP95^2);
    N_VA = 4 azP95 + 2 sqrt(ayA95^2 + azA95^2) + 4 axD95;
    N_VD = 3 sqrt(16 axP50^2 + 4 ayP50^2 + azP50^2) + 5 ayP95.

    The accelerations of the seat surface (A) and back (D) are those of the floor: the model has no
    seat.

    `a` (float64[time, 3]): Acceleration along x, y, z [m/s2]; where it begins abruptly the weighted
    one is in error for 3 s, and the first block by 10 %. `rate`: Samples per second [1/s]. Returns:
    Values are nan where the record is shorter than a block.
    """
    floor, back = weighted_for_comfort(a, rate)
    return mean_comfort(block_rms(floor, rate), block_rms(back, rate))


def weighted_for_comfort(a: Floats, rate: float) -> tuple[Floats, Floats]:
    """Accelerations along x, y, z with Wd, Wd, Wb, and along x with Wc (seat back) [m/s2]."""
    axes = enumerate((WD, WD, WB))
    floor = np.stack([weighting.weighted(a[:, k], rate) for k, weighting in axes], axis=-1)
    return floor, WC.weighted(a[:, 0], rate)


def mean_comfort(rms: Floats, back: Floats) -> MeanComfort:
    """Indices from weighted rms of blocks, on the floor [block, 3] and along x with Wc [m/s2]."""
    if not len(rms):
        return MeanComfort(math.nan, math.nan, math.nan, rms, 0)
    x95, y95, z95 = np.percentile(rms, 95.0, axis=0)
    x50, y50, z50 = np.percentile(rms, 50.0, axis=0)
    back95 = np.percentile(back, 95.0)
    return MeanComfort(
        N_MV=float(6.0 * math.sqrt(x95**2 + y95**2 + z95**2)),
        N_VA=float(4.0 * z95 + 2.0 * math.sqrt(y95**2 + z95**2) + 4.0 * back95),
        N_VD=float(3.0 * math.sqrt(16.0 * x50**2 + 4.0 * y50**2 + z50**2) + 5.0 * y95),
        continuous=rms,
        blocks=len(rms),
    )


def running_mean(x: Floats, rate: float, length: float) -> Floats:
    """Running means over `length` [s], for each position of the window within the record.

    The record is linear between its samples; value i is the mean from sample i on.
    """
    size = round(length * rate)
    if len(x) <= size:
        return np.zeros((0, *x.shape[1:]))
    cumulative = integral(np.arange(len(x)) / rate, x)
    return np.asarray((cumulative[size:] - cumulative[:-size]) * (rate / size))


TRANSITION: Mapping[str, tuple[float, float, float, float, float]] = {
    "standing": (28.54, 20.69, 11.1, 0.185, 2.283),
    "seated": (8.97, 9.68, 5.9, 0.120, 1.626),
}
EVENT: Mapping[str, tuple[float, float, float]] = {
    "standing": (16.62, 27.01, 37.0),
    "seated": (8.46, 13.05, 21.7),
}


def motion_sickness_dose(a: Floats, rate: float) -> float:
    """Motion sickness dose value of the vertical acceleration, MSDV_z = sqrt(int a_wf^2 dt).

    Weighted with Wf; the percentage of people who may vomit is about a third of it (ISO 2631-1,
    annex D).

    `a` (float64[time]): Vertical acceleration [m/s2]. `rate`: Samples per second [1/s]. Returns:
    [m/s1.5].

    >>> t = np.arange(0.0, 1000.0, 0.05)
    >>> dose = motion_sickness_dose(np.sin(2.0 * np.pi * 0.2 * t), 20.0)
    >>> round(dose / 500.0**0.5, 2)
    0.99
    """
    return float(np.sqrt(np.sum(WF.weighted(a, rate) ** 2) / rate))


def p_ct(acceleration: float, jerk: float, roll_rate: float, posture: str) -> float:
    """Percentage of dissatisfied passengers on a curve transition, P_CT (EN 12299).

    P_CT = max(A y'' + B y''' - C, 0) + D r^E.

    `acceleration`, `jerk`: Largest lateral acceleration [m/s2] and its largest change within 1 s
    [m/s3]. `roll_rate`: Largest roll velocity [deg/s]. `posture` ({'standing', 'seated'}).
    Returns: [%].

    >>> round(p_ct(1.0, 0.5, 2.0, "standing"), 2)
    28.69
    """
    A, B, C, D, E = TRANSITION[posture]
    return float(max(A * acceleration + B * jerk - C, 0.0) + D * roll_rate**E)


def p_de(peak_to_peak: float | Floats, mean: float | Floats, posture: str) -> Floats:
    """Percentage of dissatisfied passengers on a discrete event, P_DE (EN 12299).

    P_DE = max(a yp + b ym - c, 0), yp and ym over 2 s.

    >>> round(float(p_de(1.2, 1.0, "seated")), 2)
    1.5
    """
    a, b, c = EVENT[posture]
    return np.maximum(a * peak_to_peak + b * mean - c, 0.0)


@dataclass(frozen=True)
class TransitionComfort:
    """Comfort on one curve transition: P_CT [%] and its arguments."""

    begin: float  # time at which the measuring point passes its beginning [s]
    end: float  # and its end [s]
    acceleration: float  # [m/s2]
    jerk: float  # [m/s3]
    roll_rate: float  # [deg/s]
    standing: float  # [%]
    seated: float  # [%]


def transition_comfort(
    time: Floats, lateral: Floats, roll_rate: Floats, begin: float, end: float
) -> TransitionComfort | None:
    """P_CT of a transition that is passed between two times.

    The acceleration is the largest 1 s mean from the beginning to 1.6 s after the end; the jerk is
    the largest difference of two such means 1 s apart, from 1 s before the beginning; both after a
    low-pass filter of 2 Hz.  The roll velocity is the largest 1 s mean within the transition.

    `time` (float64[time]): Equal steps [s]. `lateral`, `roll_rate` (float64[time]): Lateral
    acceleration [m/s2], roll velocity of the body [rad/s]. `begin`, `end`: Times [s]. Returns:
    None where the record does not extend from 2 s before to 2.1 s after the transition.
    """
    if time[0] > begin - 2.0 or time[-1] < end + 2.1:
        return None
    rate = (len(time) - 1) / (time[-1] - time[0])
    size = round(rate)
    middles = time[: len(time) - size] + 0.5
    means = running_mean(low_passed(lateral, rate, 2.0), rate, 1.0)
    rolls = running_mean(low_passed(roll_rate, rate, 2.0), rate, 1.0)
    in_window = (middles >= begin) & (middles <= end + 1.6)
    acceleration = float(np.max(np.abs(means[in_window])))
    changes = np.abs(means[size:] - means[:-size])
    first = middles[: len(changes)]
    in_jerk_window = (first >= begin - 1.0) & (first + 1.0 <= end + 1.6)
    jerk = float(np.max(changes[in_jerk_window]))
    inside = (middles >= begin) & (middles <= end)
    rolling = float(np.degrees(np.max(np.abs(rolls[inside])))) if inside.any() else 0.0
    felt = acceleration, jerk, rolling
    return TransitionComfort(begin, end, *felt, p_ct(*felt, "standing"), p_ct(*felt, "seated"))


def event_comfort(lateral: Floats, rate: float, part: slice = ALL) -> dict[str, float]:
    """Largest P_DE of a part of a record by posture [%]: windows of 2 s in it, filter of 2 Hz."""
    low = low_passed(lateral, rate, 2.0)[part]
    size = round(EVENT_WINDOW * rate)
    if len(low) <= size:
        return dict.fromkeys(EVENT, math.nan)
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    # windows centred on each sample; those that extend beyond the ends are omitted
    half = size // 2
    whole = slice(half, len(low) - half)
    spread = maximum_filter1d(low, 2 * half + 1)[whole] - minimum_filter1d(low, 2 * half + 1)[whole]
    mean = np.abs(running_mean(low, rate, 2 * half / rate))
    return {posture: float(np.max(p_de(spread, mean, posture))) for posture in EVENT}
