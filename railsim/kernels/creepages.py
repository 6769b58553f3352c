"""Positions and creepages of the contact patches: see `wheel_rail` for the equations."""

from railsim.kernels import compiled
from railsim.kernels.contact_columns import (
    ANGLE_COS,
    ANGLE_SIN,
    C_X,
    C_Y,
    C_Z,
    FOOT_X,
    FOOT_X_PER_YAW,
    FOOT_Y,
    FOOT_Z,
    NORMAL_Y,
    NORMAL_Z,
    PATCH_SPEED,
    PHI,
    RISE,
    TANGENT_Y,
    TANGENT_Z,
    XI_X,
    XI_Y,
)
from railsim.kernels.rails import (
    COSINE,
    MIDDLE_Y,
    MIDDLE_Z,
    MOTION_Y_RATE,
    MOTION_Z_RATE,
    RAIL_SLOPE,
    ROLL_SLOPE,
    SINE,
    SLOPE_Z,
)
from railsim.kernels.state import velocity_begin
from railsim.kernels.system import Y_0, Z_0
from railsim.kernels.track_frame import OMEGA


@compiled(python=False)
def set_creepages(system, work, n, speed, state):
    """Positions and creepages of the active patches, see the module's equations."""
    patch, C, frames, plane = work.patch, work.relative, work.frames, work.plane
    n_bodies = system.bodies.kind.shape[0]
    for k in range(n):
        w, side = work.patch_index[k, 0], work.patch_index[k, 1]
        b = system.contact.body[w]
        f = system.bodies.frame[b]
        w1, w2, w3 = frames[f, OMEGA], frames[f, OMEGA + 1], frames[f, OMEGA + 2]
        x = state[6 * b]
        y = state[6 * b + 1] + system.bodies.row[b, Y_0]
        z = state[6 * b + 2] + system.bodies.row[b, Z_0]
        v = velocity_begin(n_bodies) + 6 * b
        u1, u2, u3 = state[v + 3], state[v + 4], state[v + 5]
        a1 = C[b, 0] * u1 + C[b, 1] * u2 + C[b, 2] * u3
        a2 = C[b, 3] * u1 + C[b, 4] * u2 + C[b, 5] * u3
        a3 = C[b, 6] * u1 + C[b, 7] * u2 + C[b, 8] * u3
        # position and normal from the plane of the rails to the track's axes
        sine, cosine = plane[w, SINE], plane[w, COSINE]
        cy = cosine * patch[FOOT_Y, k] - sine * patch[FOOT_Z, k]
        cz = sine * patch[FOOT_Y, k] + cosine * patch[FOOT_Z, k]
        s = cosine * patch[ANGLE_SIN, k] - sine * patch[ANGLE_COS, k]
        c = cosine * patch[ANGLE_COS, k] + sine * patch[ANGLE_SIN, k]
        # direction of the rail at the patch, (1, t_y, t_z); the patch leads accordingly
        slope = work.rail[w, side, RAIL_SLOPE]
        cx = patch[FOOT_X, k] - slope * cy
        roll_slope = plane[w, ROLL_SLOPE]
        t_z = (
            w1 * (y + cy)
            - w2 * (x + cx)
            + plane[w, SLOPE_Z]
            + roll_slope * (y + cy - plane[w, MIDDLE_Y])
            - patch[RISE, k]
        )
        cx -= t_z * cz
        frame_turn = w3 * (x + cx) - w1 * (z + cz) - roll_slope * (z + cz - plane[w, MIDDLE_Z])
        t_y = slope + frame_turn
        cx -= (patch[FOOT_X_PER_YAW, k] + cy) * frame_turn
        # velocity of the wheel's material against that of the rail, along the rail and across it
        rail_y, rail_z = (
            work.rail_motion[w, side, MOTION_Y_RATE],
            work.rail_motion[w, side, MOTION_Z_RATE],
        )
        vx = speed * (1.0 + w2 * z - w3 * y) + state[v] + a2 * cz - a3 * cy
        vy = (
            state[v + 1]
            + speed * (w3 * x - w1 * z)
            + a3 * cx
            - a1 * cz
            - cosine * rail_y
            + sine * rail_z
        )
        vz = (
            state[v + 2]
            + speed * (w1 * y - w2 * x)
            + a1 * cy
            - a2 * cx
            - sine * rail_y
            - cosine * rail_z
        )
        v_p = speed * (1.0 + w2 * (z + cz) - w3 * (y + cy)) + state[v]
        patch[C_X, k] = cx
        patch[C_Y, k] = cy
        patch[C_Z, k] = cz
        patch[TANGENT_Y, k] = t_y
        patch[TANGENT_Z, k] = t_z
        patch[NORMAL_Y, k] = s
        patch[NORMAL_Z, k] = c
        patch[PATCH_SPEED, k] = v_p
        patch[XI_X, k] = (vx + t_y * vy + t_z * vz) / v_p
        patch[XI_Y, k] = ((vy - t_y * vx) * c - (vz - t_z * vx) * s) / v_p
        patch[PHI, k] = (a2 * s + a3 * c - a1 * (t_y * s + t_z * c)) / v_p
