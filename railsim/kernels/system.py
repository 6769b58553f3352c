"""The model as flat arrays: what `assembly` builds once and the time loop never changes.

The state vector: `railsim.kernels.state`.
"""

from typing import NamedTuple

import numpy as np

from railsim.kernels.contact_table import RailTables
from railsim.kernels.control_records import Actuators, Controllers, Signals, UserLaws
from railsim.kernels.element_columns import LINK_COLUMNS, MOUNT_COLUMNS
from railsim.kernels.internal import Internal
from railsim.kernels.patches import CreepLaw, CreepScratch
from railsim.kernels.record import record
from railsim.kernels.track_frame import TrackTables

# kinds of bodies
RIGID, WHEELSET, AXLEBOX, FIXED = range(4)

# ways of driving
CONSTANT, TABLE, FREE = range(3)

# columns of Bodies.row
MASS, I_1, I_2, I_3, Y_0, Z_0, RADIUS, SPINS = range(8)
BODY_SIZE = 8

# columns of Drives.row
BRAKES, OVER_DISTANCE, SLIP_BEGIN, SLIP_END = range(4)

# columns of Work.pose: attitude R (0 to 8), position, velocity, angular velocity, force, moment
POSITION, VELOCITY, ANGULAR, FORCE, MOMENT = 9, 12, 15, 18, 21
# Forces are added by whole cache lines, the last two columns of the angular velocity with them: a
# part of a line that was just written is read again only after a delay.
FORCE_LINE = 16
POSE_SIZE = 24
# columns of Work.relative: attitude C (0 to 8), sines and cosines
SIN_ROLL, COS_ROLL, SIN_PITCH, COS_PITCH = range(9, 13)
RELATIVE_SIZE = 16
RATES_SIZE = 8  # of Work.acceleration and Work.rail_force
# Work.counts: most parts of a step in which a wheel lifts or strikes, 0 where that is not looked
# for; so far: divided steps, evaluations whose elastic rails did not settle, steps, evaluations;
# 1 where patches are recorded, so that no wheelset may be left out of an evaluation
MAX_PARTS, DIVIDED_STEPS, UNSETTLED_RAILS, STEPS, EVALUATIONS, ALL_WHEELS = range(6)
N_COUNTS = 6
# Work.stepping: time for which contact forces are predicted [s]; share of the static wheel load by
# which they may change in a step, and what a change of the lateral force counts against that of
# the vertical one; shortest step that has the full tolerance of forces on elastic rails [s]; arc
# length at which the rails of `Work.plane` and `Work.rail` are [m], no number where that is open;
# share of the wheel load by which they may change in a part of a step; time in which the stiffness
# of a contact on rigid rails counts as damping, over the last step, see `model.time_step`; what a
# change counts near rails whose section changes
HORIZON, SHARE, LATERAL, TOLERANCE_STEP, RAILS_AT, PART_SHARE, IMPLICIT, SECTIONS = range(8)
N_STEPPING = 8
# Work.events, of each wheelset: loaded patches so far, how many of them were outside the range of
# the creep law; the same kept over corrections; look-ups beyond the yaw of the contact table;
# evaluations of its contact alone
REPEATS = 5
N_EVENTS = 6


@record
class Bodies(NamedTuple):
    """Bodies, vehicle by vehicle; within one: rigid bodies, wheelsets from the front, axleboxes.

    Attributes
    ----------
    kind : int64[n]          RIGID, WHEELSET, AXLEBOX or FIXED
    frame : int64[n]         index of the body's track frame
    parent : int64[n]        the wheelset that carries an axlebox, else -1
    row : float64[n, BODY_SIZE]   mass [kg], principal moments of inertia [kg m2] (an axlebox uses
                             the second only), y and z of the centre of gravity in the track frame
                             [m], nominal rolling radius [m] and 1 for a wheelset, else 1 and 0
    whole, axleboxes : int64[...]   bodies with six coordinates, and with one
    fixed : int64[...]       bodies, part of `whole`, that are at rest in their track frames
    reference : int          the body whose frame is `s`; its x is held
    """

    kind: np.ndarray
    frame: np.ndarray
    parent: np.ndarray
    row: np.ndarray
    whole: np.ndarray
    axleboxes: np.ndarray
    fixed: np.ndarray
    reference: int

    @property
    def mass(self) -> np.ndarray:
        """Masses [kg]."""
        return self.row[:, MASS]

    @property
    def inertia(self) -> np.ndarray:
        """Principal moments of inertia [kg m2]."""
        return self.row[:, I_1 : I_1 + 3]

    @property
    def nominal(self) -> np.ndarray:
        """Nominal y and z of the centres of gravity [m]."""
        return self.row[:, Y_0 : Y_0 + 2]

    @property
    def radius(self) -> np.ndarray:
        """Nominal rolling radii [m]."""
        return self.row[:, RADIUS]


@record
class Contact(NamedTuple):
    """Wheel-rail contact; sides in the order left, right.

    Attributes
    ----------
    body : int64[w]              body index of each wheelset
    table : int64[w, 2]          which table serves each wheel
    load : float64[w]            mean static wheel load of its vehicle [N]
    values : float64[t, 3, n_w, n_roll, n_y, 8]  tables, see `contact_table`
    shear : float64[t]           lever of roll in the tables' lateral coordinate [m]
    coupling : float64[t, 2]     compliance between neighbouring patches [m/N]
    y0, dy, roll0, droll : float   grid of the tables [m, rad]
    w : float64[n_w]             its nodes of yaw squared [rad2]
    damping : float              normal to the patch [N s/m]
    kalker : float64[k, 4]       c11 c22 c23 c33 over (a - b)/(a + b)
    law : CreepLaw               creep law with its material, its grid and its data
    friction_rest, friction_decay : float   friction falling with slip [1], [s/m]
    surface_of : int64[w, 2, 3]  surface of each wheel that is not round, by patch, -1 where round;
                             w = 0 where all wheels are round, see `wheel_surface`
    surface_row : float64[k, SURFACE_ROW];  surface : float64[..., 4];  flat_ahead : float64[...]
    rails : RailTables           rails whose section changes
    check : float64[c, CHECK_ROW];  check_flangeway : float64[..., 2];
    check_wheel : float64[w, c, CHECK_WHEEL]   check rails, see `check_rails`
    transient : int              1 where creep forces follow the creepages, see `transient`
    friction_law : int           address of a law of one's own for it, else 0
    friction_block : float64[...]   its block, see `user_laws`
    """

    body: np.ndarray
    table: np.ndarray
    load: np.ndarray
    values: np.ndarray
    shear: np.ndarray
    coupling: np.ndarray
    y0: float
    dy: float
    roll0: float
    droll: float
    w: np.ndarray
    damping: float
    kalker: np.ndarray
    law: CreepLaw
    friction_rest: float
    friction_decay: float
    surface_of: np.ndarray
    surface_row: np.ndarray
    surface: np.ndarray
    flat_ahead: np.ndarray
    rails: RailTables
    check: np.ndarray
    check_flangeway: np.ndarray
    check_wheel: np.ndarray
    transient: int
    friction_law: int
    friction_block: np.ndarray


@record
class Links(NamedTuple):
    """Point-to-point elements: springs, dampers, rods (tension positive).

    Attributes
    ----------
    body : int64[e, 2]        the two bodies
    row : float64[e, LINK_SIZE]   see `element_columns.LINK_COLUMNS`
    internal : int64[e]       internal state, else -1
    curve : int64[e, 2]       tables of force over elongation and over its rate, else -1
    """

    body: np.ndarray
    row: np.ndarray
    internal: np.ndarray
    curve: np.ndarray

    @property
    def point(self) -> np.ndarray:
        """Attachment points, shape (e, 2, 3) [m]."""
        return self.row[:, :6].reshape(-1, 2, 3)

    @property
    def length(self) -> np.ndarray:
        """Nominal lengths [m]."""
        return self.row[:, LINK_COLUMNS["length"].start]

    @property
    def spring(self) -> np.ndarray:
        """Stiffness [N/m], parallel damping [N s/m], preload [N], shape (e, 3)."""
        first, last = LINK_COLUMNS["stiffness"], LINK_COLUMNS["preload"]
        return self.row[:, first.start : last.stop]


@record
class Mounts(NamedTuple):
    """Elements with three axes: bushings, shear springs, roll bars, bump stops.

    Attributes
    ----------
    body : int64[e, 2]
    row : float64[e, MOUNT_SIZE]   see `element_columns.MOUNT_COLUMNS`
    friction : float64[e, 3, 4]  limit of a friction pad along each axis: constant [N], share of the
                                 vertical spring force [1]; its fall with the sliding speed: ratio
                                 of sliding to static friction [1], Stribeck speed [m/s]
    internal : int64[e, 3]       internal states, else -1
    curve : int64[e, 3]          tables of force over deflection, else -1
    flags : int64[e, 4]          1 if: translational part, axes of both bodies (shear), rotational
                                 part, friction pads (`ONE_SIDED` where they may lift)
    law : int64[l, 3]            see `nonlinear_axes`
    falling : int64[f]           mounts whose friction falls with the sliding speed
    """

    body: np.ndarray
    row: np.ndarray
    friction: np.ndarray
    internal: np.ndarray
    curve: np.ndarray
    flags: np.ndarray
    law: np.ndarray
    falling: np.ndarray

    @property
    def point(self) -> np.ndarray:
        """Points in body axes, shape (e, 2, 3) [m]."""
        return self.row[:, :6].reshape(-1, 2, 3)

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffnesses, shape (e, 3) [N/m]."""
        return self.row[:, MOUNT_COLUMNS["stiffness"]]

    @property
    def damping(self) -> np.ndarray:
        """Dampings, shape (e, 3) [N s/m]."""
        return self.row[:, MOUNT_COLUMNS["damping"]]

    @property
    def preload(self) -> np.ndarray:
        """Preloads, shape (e, 3) [N]."""
        return self.row[:, MOUNT_COLUMNS["preload"]]

    @property
    def rotation(self) -> np.ndarray:
        """K_d of the rotational potential, shape (e, 3) [N m]."""
        return self.row[:, MOUNT_COLUMNS["rotation"]]

    @property
    def rotation_damping(self) -> np.ndarray:
        """Dampings about the axes, shape (e, 3) [N m s]."""
        return self.row[:, MOUNT_COLUMNS["rotation_damping"]]


@record
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


@record
class Loads(NamedTuple):
    """Given forces and torques over time or distance.

    Attributes
    ----------
    body : int64[l]
    point : float64[l, 3]    where a force acts, body axes [m]
    flags : int64[l, 3]      1 if: torque, axes of the track, over distance
    start : int64[l + 1]     first row of each load
    table : float64[..., 4]  time [s] or position of the body's track frame [m], three components
                             [N or N m]; linear, constant beyond
    """

    body: np.ndarray
    point: np.ndarray
    flags: np.ndarray
    start: np.ndarray
    table: np.ndarray


@record
class Drives(NamedTuple):
    """Torques between wheelsets and the bodies that take their reactions.

    Attributes
    ----------
    body : int64[d, 2]       body that takes the reaction, wheelset
    row : float64[d, 4]      1 for a brake, 1 for a demand over distance, slips between which the
                             torque is taken back (0 for none)
    start : int64[2 d + 1]   first row of the table of the torque and of that of the demand of each
    table : float64[..., 2]  speed [m/s] and torque [N m]; time [s] or distance [m] and factor
    """

    body: np.ndarray
    row: np.ndarray
    start: np.ndarray
    table: np.ndarray


@record
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


@record
class Support(NamedTuple):
    """Moving track model, the same under each wheelset.

    Attributes
    ----------
    elastic, sleeper, massless : int   1 if so
    row : float64[SUPPORT_ROW]         see `support` [kg, kg m2, N/m, N s/m, N m, N m s, m]
    variation : float64[k, 3]          arc length [m], factors of pads and ballast; empty if none
    """

    elastic: int
    sleeper: int
    massless: int
    row: np.ndarray
    variation: np.ndarray


@record
class System(NamedTuple):
    """Everything the time loop reads.

    Attributes
    ----------
    frame_offset : float64[f]     arc length of each frame relative to the reference [m]
    """

    bodies: Bodies
    frame_offset: np.ndarray
    track: TrackTables
    support: Support
    contact: Contact
    links: Links
    mounts: Mounts
    curves: Curves
    internal: Internal
    loads: Loads
    drives: Drives
    drive: Drive
    gravity: float
    actuators: Actuators
    signals: Signals
    controllers: Controllers
    user_laws: UserLaws


@record
class Work(NamedTuple):
    """Scratch arrays and by-products of one evaluation of the right-hand side.

    Attributes
    ----------
    frames : float64[f, FRAME_SIZE];  cell : int64[f];  cell_u : float64[f]
    pose : float64[n, POSE_SIZE]   attitude of each body row by row, position, velocity, angular
                            velocity, force and moment about the centre of gravity, global axes
    relative : float64[n, RELATIVE_SIZE]   attitude relative to the track frame row by row; sine and
                            cosine of roll and of pitch (0 and 1 for a wheelset)
    rail_force : float64[n, 6]  contact force and moment on a wheelset, track axes
    acceleration : float64[n, 6]  absolute, in body axes
    drive : float64[m, 2]       what drives each internal state, and its limit
    friction : float64[e, 3, 2]  limits of the pads of mounts, see `elements.update_friction_limits`
    laws : float64[LAWS_SIZE]   of the elements at hand, see `elements`
    decay : float64[m]          see `internal.set_decays`
    contact_jacobian : float64[n, CONTACT_JACOBIAN]  see `wheel_rail`
    slip_matrix : float64[5, 8] see `step_fast.damp_coupled`
    plane : float64[w, PLANE_SIZE];  rail : float64[w, 2, RAIL_SIZE];
    rail_motion : float64[w, 2, MOTION_SIZE]   the rails under each wheelset, see `rails`
    rail_cell : int64[w];  rail_u : float64[w]   where in the track's tables they are
    wheelset : float64[10]      the wheelset at hand in the plane of its rails: y, z, roll, yaw,
                                their rates, stretched roll and slope, see `wheel_rail`
    look_up, weights, stiffness, approach : of the wheel at hand, see `contact_table`
    patch_index : int64[p, 3]   wheelset, side and patch of each active contact patch
    patch : float64[PATCH_ROWS, p]  see `wheel_rail`
    creep : CreepScratch        of the creep laws
    wheel : float64[w, 2, WHEEL_COLUMNS]  see `wheel_rail`
    support : float64[w, 2, SUPPORT_COLUMNS];  support_step : float64[w, SUPPORT_STEP]
                                of each wheelset's track, see `support`; w = 0 on rigid rails
    motion : float64[w, 2, LANES]   motion of the wheelsets before a step, see `support_step`
    compliance : float64[3]     of a rail over the last step [m/(N s), m/(N s), s], see
                                `support.set_compliance`
    vibration : float64[w, 2, VIBRATION]  of each wheel load, see `vibration`
    events : int64[w, N_EVENTS]   see there
    force_rate : float64[w]     largest rate of the contact forces of each wheelset, and of stops
                                between bodies [N/s]
    stepping : float64[N_STEPPING]  see there
    rate_change : float64[2, RATE_CHANGE_SIZE] of this wheelset, see `rails.predict_rate_changes`
    counts : int64[N_COUNTS]     see there
    extremes : float64[6, w, EXTREMES]  see `extremes`
    current : float64[EXTREMES] scratch of the extremes
    unloaded : float64[w, 2]    time during which each wheel has carried nothing [s]
    transient : float64[w, 2, p, TRANSIENT]  of each patch, see `transient`; w = 0 in steady rolling
    bump : float64[p, BUMP_SIZE]  heights of the wheel at hand by patch, see `wheel_surface`
    decay_part : float64[m]     as `decay` for a part of a step
    memory : float64[...]       of commands, signals and laws of one's own, see `UserLaws`
    element : float64[1, ELEMENT_COLUMNS]   of the element that a signal measures
    """

    frames: np.ndarray
    cell: np.ndarray
    cell_u: np.ndarray
    pose: np.ndarray
    relative: np.ndarray
    rail_force: np.ndarray
    acceleration: np.ndarray
    drive: np.ndarray
    friction: np.ndarray
    laws: np.ndarray
    decay: np.ndarray
    contact_jacobian: np.ndarray
    slip_matrix: np.ndarray
    plane: np.ndarray
    rail: np.ndarray
    rail_motion: np.ndarray
    rail_cell: np.ndarray
    rail_u: np.ndarray
    wheelset: np.ndarray
    look_up: np.ndarray
    weights: np.ndarray
    stiffness: np.ndarray
    approach: np.ndarray
    patch_index: np.ndarray
    patch: np.ndarray
    creep: CreepScratch
    support: np.ndarray
    support_step: np.ndarray
    motion: np.ndarray
    compliance: np.ndarray
    vibration: np.ndarray
    events: np.ndarray
    wheel: np.ndarray
    force_rate: np.ndarray
    stepping: np.ndarray
    rate_change: np.ndarray
    counts: np.ndarray
    extremes: np.ndarray
    current: np.ndarray
    unloaded: np.ndarray
    transient: np.ndarray
    bump: np.ndarray
    decay_part: np.ndarray
    memory: np.ndarray
    element: np.ndarray
