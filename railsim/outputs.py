"""From raw records of the time loop to the quantities of a result (see `railsim.notation`)."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from railsim.assembly import Model
from railsim.kernels.time_loop import Recorder
from railsim.kernels.wheel_rail import W_PHI, W_Q, W_T_GAMMA, W_XI_X, W_XI_Y, W_Y

Floats = NDArray[np.float64]

ROLL, YAW, LATERAL = 3, 5, 1


def quantities(model: Model, recorder: Recorder, rows: int, Q0: Floats) -> Mapping[str, Floats]:
    """Quantities of the first `rows` records.

    Parameters
    ----------
    Q0 : float64[wheelset, side]
        Static wheel loads [N].

    Returns
    -------
    mapping of str to ndarray
        By the names of `railsim.notation.QUANTITIES`, time first [SI].
    """
    n = model.index.n_bodies
    state = recorder.state[:rows]
    position = state[:, : 6 * n].reshape(rows, n, 6)
    wheel = recorder.wheel[:rows]
    axles = model.system.contact.body
    Q, Y = wheel[..., W_Q], wheel[..., W_Y]
    outwards = np.array([-1.0, 1.0])
    # a wheel that carries nothing has no derailment quotient
    loaded = np.where(Q > 0.0, Q, np.nan)
    places = model.system.frame_offset[model.system.bodies.frame[axles]]
    return {
        "time": state[:, -3],
        "distance": state[:, -2],
        "Q": Q,
        "Y": Y,
        "Y_over_Q": outwards * Y / loaded,
        "dQ_over_Q0": (Q - Q0) / Q0,
        "sum_Y": Y.sum(axis=-1),
        "sum_abs_Y": np.abs(Y).sum(axis=-1),
        "wheelset_lateral": position[:, axles, LATERAL],
        "wheelset_roll": position[:, axles, ROLL],
        "wheelset_yaw": position[:, axles, YAW],
        "wheelset_distance": state[:, -2, None] + places + position[:, axles, 0],
        "xi_x": wheel[..., W_XI_X],
        "xi_y": wheel[..., W_XI_Y],
        "phi": wheel[..., W_PHI],
        "T_gamma": wheel[..., W_T_GAMMA],
        "body_position": position,
        "body_velocity": recorder.rates[:rows].reshape(rows, n, 6),
        "body_acceleration": recorder.acceleration[:rows],
    }
