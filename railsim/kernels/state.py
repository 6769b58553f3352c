"""The state vector, float64[n_state], for n bodies and m internal element states:

    0 .. 6n       coordinates x, y, z, roll, pitch, yaw of each body: position of its centre of
                  gravity relative to its nominal position, in axes of its own track frame (m, rad)
    6n .. 12n     velocities: x', y', z' in the axes of the track frame (m/s), then the absolute
                  angular velocity u_1, u_2, u_3 in body axes (rad/s); a wheelset's axes do not spin
    12n .. 12n+m  internal states of elements, see `internal`
    then 6n, m    memory of the fast scheme: smoothed accelerations, drives of the internal states
    then 84w      of each wheelset whose creep forces follow the creepages: see `transient`
    then 48w      of each wheelset on elastic rails: track under it, see `support`
    LAST_STEP     memory of the fast scheme: length of the last step (s), 0 where there was none
    TIME, ARC_LENGTH, SPEED   t (s), s of the reference body's frame (m), V = s' (m/s)

An axlebox has one coordinate, its pitch about the axle; of its twelve entries only `pitch` and u_2
(here the pitch rate relative to the wheelset's axes) are used.  A fixed body keeps its coordinates;
its u_1, u_2, u_3 are those of its track frame.
"""

from numba.extending import register_jitable

# at the end
LAST_STEP, TIME, ARC_LENGTH, SPEED = range(-4, 0)
N_SCALARS = 4


@register_jitable(inline="always")
def velocity_begin(n: int) -> int:
    """Index of the first body's velocities in a state of `n` bodies."""
    return 6 * n


@register_jitable(inline="always")
def internal_begin(n: int) -> int:
    """Index of the first internal state."""
    return 12 * n


@register_jitable(inline="always")
def smoothed_begin(n: int, m: int) -> int:
    """Index of the first body's smoothed accelerations; `m` internal states."""
    return 12 * n + m


@register_jitable(inline="always")
def drive_begin(n: int, m: int) -> int:
    """Index of the last drive of the first internal state."""
    return 18 * n + m


@register_jitable(inline="always")
def contact_begin(n: int, m: int) -> int:
    """Index of what wheelsets keep: creep forces that follow, tracks under them."""
    return 18 * n + 2 * m
