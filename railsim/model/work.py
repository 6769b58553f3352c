"""Work arrays of a system, and the same system on straight level track."""

import numpy as np

from railsim.arrays import Floats
from railsim.contact.creep import creep_scratch
from railsim.kernels import system as kernel
from railsim.kernels.alignment import aligned_zeros
from railsim.kernels.contact_columns import BUMP_SIZE, CONTACT_JACOBIAN, PATCH_ROWS, WHEEL_COLUMNS
from railsim.kernels.contact_table import LOOK_UP_SIZE, N_PATCH, N_WEIGHT, RailTables
from railsim.kernels.control_records import Controllers, Signals
from railsim.kernels.controllers import CONTROLLER_CODES, SIGNAL_CODES, SIGNAL_ROW
from railsim.kernels.element_outputs import ELEMENT_COLUMNS
from railsim.kernels.elements import LAWS_SIZE
from railsim.kernels.extremes import EXTREMES, MAX, MIN
from railsim.kernels.rail_parts import COUNT, NODE_WEIGHTS
from railsim.kernels.rails import (
    COSINE,
    MOTION_SIZE,
    PLANE_SIZE,
    RAIL_SIZE,
    RATE_CHANGE_SIZE,
    write_positions_on_rails,
)
from railsim.kernels.registers import LANES
from railsim.kernels.state import N_SCALARS
from railsim.kernels.support import RAIL_DOF, SUPPORT_COLUMNS, SUPPORT_SIZE, SUPPORT_STEP, TRACED
from railsim.kernels.track_frame import FRAME_SIZE, MU_LEFT, MU_RIGHT, TrackTables
from railsim.kernels.transient import TRANSIENT
from railsim.kernels.vibration import VIBRATION

# shortest step that has the full tolerance of forces on elastic rails (s), see `Work.stepping`
FULL_TOLERANCE = 1.25e-3

NO_SIGNALS = Signals(np.zeros((0, SIGNAL_CODES), dtype=np.int64), np.zeros((0, SIGNAL_ROW)))
NO_CONTROLLERS = Controllers(
    np.zeros((0, CONTROLLER_CODES), dtype=np.int64), np.zeros(0), np.zeros(0, dtype=np.int64)
)
CONSTANT_SPEED = kernel.Drive(kernel.CONSTANT, np.zeros((1, 2)), np.zeros(3))


def components_of(kind: int) -> tuple[int, ...]:
    """Components in which a body of this kind moves."""
    return {kernel.AXLEBOX: (4,), kernel.FIXED: ()}.get(kind, (0, 1, 2, 3, 4, 5))


def work_arrays(system: kernel.System) -> kernel.Work:
    """Scratch arrays for `system`."""
    n = len(system.bodies.kind)
    n_wheelsets = len(system.contact.body)
    of_wheel = N_PATCH * parts_of_wheel(system.contact.rails)
    n_patches = -(-2 * of_wheel * n_wheelsets // LANES) * LANES  # by eights
    n_frames = len(system.frame_offset)
    n_tracks = n_wheelsets * system.support.elastic
    return kernel.Work(
        frames=aligned_zeros((n_frames, FRAME_SIZE)),
        cell=aligned_zeros(n_frames, np.int64),
        cell_u=aligned_zeros(n_frames),
        pose=aligned_zeros((n, kernel.POSE_SIZE)),
        relative=aligned_zeros((n, kernel.RELATIVE_SIZE)),
        rail_force=aligned_zeros((n, kernel.RATES_SIZE)),
        acceleration=aligned_zeros((n, kernel.RATES_SIZE)),
        drive=aligned_zeros((len(system.internal.kind), 2)),
        friction=np.ascontiguousarray(system.mounts.friction[:, :, :2]),
        laws=aligned_zeros(LAWS_SIZE),
        decay=aligned_zeros(len(system.internal.kind)),
        contact_jacobian=aligned_zeros((n, CONTACT_JACOBIAN)),
        slip_matrix=aligned_zeros((5, 8)),
        plane=smooth_planes(n_wheelsets),
        rail=aligned_zeros((n_wheelsets, 2, RAIL_SIZE)),
        rail_motion=aligned_zeros((n_wheelsets, 2, MOTION_SIZE)),
        rail_cell=aligned_zeros(n_wheelsets, np.int64),
        rail_u=aligned_zeros(n_wheelsets),
        wheelset=aligned_zeros(10),
        look_up=aligned_zeros((of_wheel + 1) * LOOK_UP_SIZE),
        weights=aligned_zeros(N_WEIGHT + NODE_WEIGHTS),
        stiffness=aligned_zeros(2 * of_wheel),
        approach=aligned_zeros(of_wheel),
        patch_index=aligned_zeros((n_patches, 3), np.int64),
        patch=aligned_zeros((PATCH_ROWS, n_patches)),
        creep=creep_scratch(n_patches, system.contact.law),
        support=aligned_zeros((n_tracks, 2, SUPPORT_COLUMNS)),
        support_step=aligned_zeros((n_tracks, SUPPORT_STEP)),
        motion=aligned_zeros((n_tracks, 2, LANES)),
        compliance=aligned_zeros(3),
        vibration=aligned_zeros((n_wheelsets, 2, VIBRATION)),
        events=aligned_zeros((n_wheelsets, kernel.N_EVENTS), np.int64),
        wheel=aligned_zeros((n_wheelsets, 2, WHEEL_COLUMNS)),
        force_rate=aligned_zeros(n_wheelsets),
        stepping=np.array([0.0, np.inf, 1.0, FULL_TOLERANCE, np.nan, 1.0, 0.0, 1.0]),
        rate_change=aligned_zeros((2, RATE_CHANGE_SIZE)),
        counts=aligned_zeros(kernel.N_COUNTS, np.int64),
        extremes=no_extremes(n_wheelsets),
        current=aligned_zeros(EXTREMES),
        unloaded=aligned_zeros((n_wheelsets, 2)),
        transient=aligned_zeros((n_wheelsets * system.contact.transient, 2, TRACED, TRANSIENT)),
        bump=aligned_zeros((of_wheel, BUMP_SIZE)),
        decay_part=aligned_zeros(len(system.internal.kind)),
        memory=system.user_laws.memory.copy(),
        element=np.zeros((1, ELEMENT_COLUMNS)),
    )


def parts_of_wheel(rails: RailTables) -> int:
    """Most rails that lie side by side under one wheel."""
    return int(rails.piece[:, COUNT].max(initial=1))


def smooth_planes(n_wheelsets: int) -> Floats:
    """Planes of rails that are not displaced: they turn nothing."""
    plane = aligned_zeros((n_wheelsets, PLANE_SIZE))
    plane[:, COSINE] = 1.0
    return plane


def no_extremes(n_wheelsets: int) -> Floats:
    """`Work.extremes` before anything has been seen, shape (6, wheelset, EXTREMES)."""
    extremes = aligned_zeros((6, n_wheelsets, EXTREMES))
    extremes[MAX] = -np.inf
    extremes[MIN] = np.inf
    return extremes


def level_track(system: kernel.System) -> kernel.System:
    """Return the same system on straight, level, smooth, frictionless track, no given loads."""
    cells = 4
    length = float(np.ptp(system.frame_offset)) + 100.0
    coefficients = np.zeros((cells, 6, 4))
    ds = 2.0 * length / cells
    coefficients[:, 0, 0] = -length + ds * np.arange(cells)
    coefficients[:, 0, 1] = 1.0
    start = float(np.min(system.frame_offset)) - length / 2.0
    coefficients[:, 0, 0] += start + length
    track = TrackTables(start, ds, coefficients, np.zeros((cells, 6, 4)), 0, system.track.rail_base)
    even = system.support._replace(variation=system.support.variation[:0])
    return without_loads(system)._replace(track=track, support=even, drive=CONSTANT_SPEED)


def without_loads(system: kernel.System) -> kernel.System:
    """Return the system without given forces and torques, which analyses without a clock omit."""
    return system._replace(
        loads=system.loads._replace(
            body=system.loads.body[:0], point=system.loads.point[:0], flags=system.loads.flags[:0]
        ),
        drives=system.drives._replace(body=system.drives.body[:0], row=system.drives.row[:0]),
    )


def level_track_with_friction(system: kernel.System) -> kernel.System:
    """As `level_track`, with the largest friction that each rail of the real track has."""
    level = level_track(system)
    rail = level.track.rail.copy()
    for row in (MU_LEFT, MU_RIGHT):
        rail[:, row, 0] = np.max(system.track.rail[:, row, 0])
    return level._replace(track=level.track._replace(rail=rail))


def uneven_rigid_rails(system: kernel.System) -> int:
    """1 where the fast scheme follows irregular rigid rails, which its judged steps do too."""
    return int(system.track.has_irregularity and not system.support.elastic)


def against_rails(system: kernel.System, state: Floats, rail: Floats | None = None) -> Floats:
    """Lateral displacement and roll of each wheelset against its rails, from recorded states.

    `rail`: what each rail yields, float64[time, wheelset, side, 2] [m]; default: as in the states.
    Returns float64[time, wheelset, 2] [m], [rad].
    """
    axles = system.contact.body
    found = np.empty((len(state), len(axles), 2))
    write_positions_on_rails(
        system.track,
        axles,
        system.frame_offset[system.bodies.frame[axles]],
        system.bodies.row[axles, kernel.Z_0],
        state,
        rail_displacement(system, state) if rail is None else rail,
        smooth_planes(len(axles)),
        np.zeros((len(axles), 2, RAIL_SIZE)),
        found,
    )
    return found


def rail_displacement(system: kernel.System, state: Floats) -> Floats:
    """Displacement of the rail heads on their support, from states.

    float64[time, wheelset, side, 2], lateral and vertical [m]; zero on rigid rails.
    """
    rows, wheelsets = len(state), len(system.contact.body)
    if not system.support.elastic:
        return np.zeros((rows, wheelsets, 2, 2))
    track = state[:, -N_SCALARS - wheelsets * SUPPORT_SIZE : -N_SCALARS]
    return track.reshape(rows, wheelsets, SUPPORT_SIZE)[..., :RAIL_DOF].reshape(rows, -1, 2, 2)
