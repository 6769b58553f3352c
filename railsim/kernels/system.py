"""The model as flat arrays: what `assembly` builds once and the time loop never changes.

State vector (float64[n_state]), for n bodies and m internal element states:

    0 .. 6n       coordinates x, y, z, roll, pitch, yaw of each body: position of its centre of
                  gravity relative to its nominal place, in the axes of its own track frame (m, rad)
    6n .. 12n     velocities: x', y', z' in the axes of the track frame (m/s), then the absolute
                  angular velocity u_1, u_2, u_3 in body axes (rad/s); a wheelset's axes do not spin
    12n .. 12n+m  internal states of elements, see `internal`
    then 6n, m    memory of the fast scheme: smoothed accelerations, drives of the internal states
    -3, -2, -1    time t (s), arc length s of the reference body's frame (m), speed V = s' (m/s)

An axlebox has one coordinate, its pitch about the axle; of its twelve places only `pitch` and u_2
(here the pitch rate relative to the wheelset's axes) are used.
"""

from typing import NamedTuple

import numpy as np

from railsim.kernels.internal import Internal
from railsim.kernels.track_frame import TrackTables

# kinds of bodies
RIGID, WHEELSET, AXLEBOX = range(3)

# ways of driving
CONSTANT, TABLE, FREE = range(3)
N_SCALARS = 3  # t, s, V at the end of the state


class Bodies(NamedTuple):
    """Bodies, vehicle by vehicle; within one: rigid bodies, wheelsets from the front, axleboxes.

    Attributes
    ----------
    kind : int64[n]          RIGID, WHEELSET or AXLEBOX
    frame : int64[n]         index of the body's track frame
    parent : int64[n]        the wheelset that carries an axlebox, else -1
    mass : float64[n]        [kg]
    inertia : float64[n, 3]  principal moments [kg m2]; an axlebox uses the second only
    nominal : float64[n, 2]  y and z of the centre of gravity in the track frame [m]
    radius : float64[n]      nominal rolling radius of a wheelset [m], else 1
    references : int64[v]    one body of each vehicle, whose frame is `s`; its x is held
    """

    kind: np.ndarray
    frame: np.ndarray
    parent: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    nominal: np.ndarray
    radius: np.ndarray
    references: np.ndarray


class Contact(NamedTuple):
    """Wheel-rail contact; sides in the order left, right.

    Attributes
    ----------
    body : int64[w]              body index of each wheelset
    table : int64[w, 2]          which table serves each wheel
    values : float64[t, 3, n_w, n_roll, n_y, 8]  tables, see `contact_table`
    shear : float64[t]           lever of roll in the tables' lateral coordinate [m]
    coupling : float64[t, 2]     compliance between neighbouring patches [m/N]
    y0, dy, roll0, droll, dw : float   grid of the tables [m, rad, rad2]
    creep : float64[k, 4]        Kalker's c11 c22 c23 c33 over log(a/b)
    shear_modulus, damping : float   [Pa], [N s/m]
    n_x, n_y : int               cells of FASTSIM along and across
    law : int                    creep law, see `creep.LAW_NUMBERS`
    reduction, slip_reduction : float   third-body factors of Kalker's coefficients
    friction_rest, friction_decay : float   friction falling with slip [1], [s/m]
    law_table : float32[], law_scale : float64[k, 4]   table of the full theory; else empty
    """

    body: np.ndarray
    table: np.ndarray
    values: np.ndarray
    shear: np.ndarray
    coupling: np.ndarray
    y0: float
    dy: float
    roll0: float
    droll: float
    dw: float
    creep: np.ndarray
    shear_modulus: float
    damping: float
    n_x: int
    n_y: int
    law: int
    reduction: float
    slip_reduction: float
    friction_rest: float
    friction_decay: float
    law_table: np.ndarray
    law_scale: np.ndarray


class Links(NamedTuple):
    """Point-to-point elements: springs, dampers, rods (tension positive).

    Attributes
    ----------
    body : int64[e, 2]        the two bodies
    point : float64[e, 2, 3]  attachment points in body axes from the centre of gravity [m]
    length : float64[e]       nominal length [m]
    spring : float64[e, 3]    stiffness [N/m], parallel damping [N s/m], preload [N]
    internal : int64[e]       internal state, else -1
    curve : int64[e, 2]       tables of force over elongation and over its rate, else -1
    """

    body: np.ndarray
    point: np.ndarray
    length: np.ndarray
    spring: np.ndarray
    internal: np.ndarray
    curve: np.ndarray


class Mounts(NamedTuple):
    """Elements with three axes: bushings, shear springs, roll bars, bump stops.

    Attributes
    ----------
    body : int64[e, 2]
    point : float64[e, 2, 3]     points in body axes; coincident in the nominal position [m]
    stiffness, damping, preload : float64[e, 3]   [N/m], [N s/m], [N]
    rotation : float64[e, 3]     K_d of the rotational potential tr(K_d (1 - R)) [N m]
    rotation_damping : float64[e, 3]   [N m s]
    friction : float64[e, 3, 2]  limit of a friction pad: constant [N], share of the vertical
                                 spring force [1]
    internal : int64[e, 3]       internal states, else -1
    curve : int64[e, 3]          tables of force over deflection, else -1
    flags : int64[e, 5]          1 if: translational part, both-ended axes (shear), rotational part,
                                 friction pads, tables or internal states
    """

    body: np.ndarray
    point: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    preload: np.ndarray
    rotation: np.ndarray
    rotation_damping: np.ndarray
    friction: np.ndarray
    internal: np.ndarray
    curve: np.ndarray
    flags: np.ndarray


class Curves(NamedTuple):
    """Piecewise linear tables, one after the other; beyond its ends a table continues linearly.

    Attributes
    ----------
    start : int64[c + 1]   first point of each table
    x, f : float64[...]    abscissa and value
    """

    start: np.ndarray
    x: np.ndarray
    f: np.ndarray


class Loads(NamedTuple):
    """Given forces and torques over time.

    Attributes
    ----------
    body : int64[l]
    point : float64[l, 3]    where a force acts, body axes [m]
    flags : int64[l, 2]      1 if: torque, axes of the track
    start : int64[l + 1]     first row of each load
    table : float64[..., 4]  time [s], three components [N or N m]; linear, constant beyond
    """

    body: np.ndarray
    point: np.ndarray
    flags: np.ndarray
    start: np.ndarray
    table: np.ndarray


class Drive(NamedTuple):
    """How the speed goes along the track.

    Attributes
    ----------
    mode : int                CONSTANT, TABLE or FREE
    table : float64[k, 2]     TABLE: arc length [m], speed [m/s]; FREE: speed [m/s], traction [N]
    resistance : float64[3]   FREE: a + b V + c V^2 on the reference body [N, N s/m, N s2/m2];
                              a system that runs freely has one vehicle
    """

    mode: int
    table: np.ndarray
    resistance: np.ndarray


class System(NamedTuple):
    """Everything the time loop reads.

    Attributes
    ----------
    frame_offset : float64[f]     arc length of each frame relative to the reference [m]
    """

    bodies: Bodies
    frame_offset: np.ndarray
    track: TrackTables
    contact: Contact
    links: Links
    mounts: Mounts
    curves: Curves
    internal: Internal
    loads: Loads
    drive: Drive
    gravity: float


class Work(NamedTuple):
    """Scratch arrays and by-products of one evaluation of the right-hand side.

    Attributes
    ----------
    frames : float64[f, FRAME_SIZE];  cell : int64[f];  cell_u : float64[f]
    R : float64[n, 9]       attitude of each body in global axes, row by row
    X, V, W : float64[n, 3] position, velocity, angular velocity in global axes
    F, M : float64[n, 3]    force and moment about the centre of gravity, global axes
    S : float64[n, 4]       sin, cos of roll and of pitch
    C : float64[n, 9]       attitude relative to the track frame
    rail_force : float64[n, 6]  contact force and moment on a wheelset, track axes
    acceleration : float64[n, 6]  absolute, in body axes
    drive : float64[m, 2]       what drives each internal state, and its limit
    decay : float64[m]          see `internal.constant_decays`
    contact_jacobian : float64[n, 8]  see `wheel_rail`
    look_up, weights, stiffness, approach, rail : of the wheel at hand, see `contact_table`
    patch_index : int64[p, 3]   wheelset, side and patch of each active contact patch
    patch : float64[PATCH_ROWS, p]  see `wheel_rail`
    fastsim : float64[WORK_ROWS, ...];  offsets : int64[16]   scratch of the creep laws
    wheel : float64[w, 2, WHEEL_COLUMNS]  see `wheel_rail`
    events : int64[w, 2]        of each wheelset: loaded patches so far, and how many of them were
                                outside the range of the creep law
    """

    frames: np.ndarray
    cell: np.ndarray
    cell_u: np.ndarray
    R: np.ndarray
    X: np.ndarray
    V: np.ndarray
    W: np.ndarray
    F: np.ndarray
    M: np.ndarray
    S: np.ndarray
    C: np.ndarray
    rail_force: np.ndarray
    acceleration: np.ndarray
    drive: np.ndarray
    decay: np.ndarray
    contact_jacobian: np.ndarray
    look_up: np.ndarray
    weights: np.ndarray
    stiffness: np.ndarray
    approach: np.ndarray
    rail: np.ndarray
    patch_index: np.ndarray
    patch: np.ndarray
    fastsim: np.ndarray
    offsets: np.ndarray
    events: np.ndarray
    wheel: np.ndarray
