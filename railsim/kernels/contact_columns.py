"""Rows and columns of what the wheel-rail contact writes: patches, wheels, wheelsets, heights."""

# rows of Work.patch: one column per active patch.  Angle and foot are in the plane of the rails:
# position of the patch from the wheelset's centre for a rail along x, and its x per yaw; normal
# and C in the track's axes, as is the direction of the rail at the patch, (1, t_y, t_z).
# Derivatives of the vertical force over the wheelset's y, z and roll, and that force times the turn
# of the contact angle's tangent over y, for elastic rails.
(
    A,
    B,
    NORMAL,
    MU_N,
    ANGLE_SIN,
    ANGLE_COS,
    C_X,
    C_Y,
    C_Z,
    XI_X,
    XI_Y,
    PHI,
    C11,
    C22,
    C23,
    C33,
    T_X,
    T_Y,
    M_Z,
    PENETRATION,
    BEYOND,
    NORMAL_STIFFNESS,
    NORMAL_DAMPING,
    FOOT_X_PER_YAW,
    FOOT_X,
    FOOT_Y,
    FOOT_Z,
    TANGENT_Y,
    TANGENT_Z,
    NORMAL_Y,
    NORMAL_Z,
    PATCH_SPEED,
    SLOPE_ALONG,
    SLOPE_ACROSS,
    SECANT_ALONG,
    RISE,
    FORCE_PER_Y,
    FORCE_PER_Z,
    FORCE_PER_ROLL,
    GEOMETRIC_STIFFNESS,
) = range(40)
PATCH_ROWS = 40

# columns of Work.wheel[w, side]; creepages, normal force and position of the most loaded patch;
# force of check rails and its wear number
(
    W_Q,
    W_Y,
    W_XI_X,
    W_XI_Y,
    W_PHI,
    W_T_GAMMA,
    W_LIFT,
    W_NORMAL,
    W_T_GAMMA_SPIN,
    W_C_Y,
    W_C_Z,
    W_CHECK,
    W_CHECK_GAMMA,
) = range(13)
WHEEL_COLUMNS = 13

# columns of Work.contact_jacobian[b], what the contact takes from the wheelset's speeds, for the
# implicit part of the step: slopes of the creep forces along the track, their secants [N s/m], the
# latter times the lever c_z [N s], in yaw [N m s]; then in y, z and roll [N s/m, N s, N m s] the
# upper half of the symmetric matrix of the creep forces across, and row by row that of the normal
# forces with the friction that follows them; at walking pace the secants times c_y [N s], by the
# slopes of the creep force in one direction over the slip in the other what the slip along takes
# from the speeds in y, z and roll, and that times c_y
J_ALONG, J_SECANT, J_SECANT_C_Z, J_SECANT_YAW, J_SLIP, J_NORMAL = 0, 1, 2, 3, 4, 10
J_SECANT_C_Y, J_CROSS, J_CROSS_YAW = 19, 20, 23
CONTACT_JACOBIAN = 26

# columns of Work.bump, of each patch of the wheel at hand: e [m], its rate [m/s], e_phi [m], e_y
# [1], change of the rate over `HORIZON` [m/s]; what is added to the radius [m]; where a rail's
# section changes, its rise [1], rates of K and K2 over s, lateral position of the wheel [m]
B_HEIGHT, B_RATE, B_E_PHI, B_E_Y, B_CHANGE, B_RADIUS, B_RISE, B_K, B_K2, B_LEVER = range(10)
BUMP_SIZE = 16
