"""A made-up result in the shape of a real one: the coach's names, smooth curves, no physics."""

from pathlib import Path

import numpy as np

from railsim.notation import QUANTITIES
from railsim.profiles.profile import Profile
from railsim.result import MemorySink, Result

ROOT = Path(__file__).parents[2]
WHEELSETS = (
    "front.outer.wheelset",
    "front.inner.wheelset",
    "rear.inner.wheelset",
    "rear.outer.wheelset",
)
BODIES = ("carbody", "front.frame", "rear.frame", *WHEELSETS)
COORDINATES = {"wheelset": WHEELSETS, "body": BODIES}
OFFSETS = np.array([10.78, 8.22, -8.22, -10.78])


def text(path):
    return (ROOT / path).read_text(encoding="utf-8")


def attributes(speed=20.0, status="complete"):
    return {
        "status": status,
        "status_reason": "",
        "speed": speed,
        "vehicle_toml": text("vehicles/coach_manchester.toml"),
        "track_toml": text("tracks/curve_r250.toml"),
        "settings_json": '{"scheme": "fast", "step": 0.001}',
        "wall_time": 2.0,
        "cpu_time": 0.7,
        "real_time_factor": 70.0,
    }


def arrays(speed=20.0, duration=49.0, rate=50.0, gain=1.0):
    """Return all quantities of a run through the R 250 m curve as smooth made-up functions."""
    time = np.arange(round(duration * rate) + 1) / rate
    distance = speed * time
    at = distance[:, None] + OFFSETS
    ramp = np.interp(at, [300.0, 360.0, 420.0, 480.0], [0.0, 1.0, 1.0, 0.0]) * gain
    lead = np.array([1.0, 0.25, 0.7, 0.2])
    bump = gain * (np.exp(-(((at - 355.0) / 12.0) ** 2)) - np.exp(-(((at - 425.0) / 12.0) ** 2)))
    q0 = np.full((4, 2), 68.8e3)
    dq = np.stack([0.05 * ramp + 0.35 * bump, -0.05 * ramp - 0.35 * bump], axis=-1)
    y = np.stack([-32e3 * ramp * lead, 21e3 * ramp * lead], axis=-1)
    q = q0 * (1.0 + dq)
    body = np.zeros((time.size, len(BODIES), 6))
    body[:, 0, 1] = 0.1 * ramp[:, 0]
    body[:, 0, 5] = 0.01 * ramp[:, 1]
    return {
        "time": time,
        "distance": distance,
        "mileage": 1000.0 + distance,
        "curvature": ramp[:, 0] / 250.0,
        "cant": 0.15 * ramp[:, 0],
        "Q": q,
        "Y": y,
        "Y_over_Q": y / q * np.array([-1.0, 1.0]),
        "dQ_over_Q0": dq,
        "sum_Y": y.sum(-1),
        "sum_abs_Y": np.abs(y).sum(-1),
        "wheelset_lateral": -6.2e-3 * ramp * lead,
        "wheelset_roll": 0.7e-3 * ramp * lead,
        "wheelset_yaw": -9.6e-3 * ramp * lead,
        "wheelset_distance": at,
        "xi_x": 2e-3 * np.stack([ramp, -ramp], axis=-1),
        "xi_y": 5e-3 * np.stack([ramp * lead, ramp * lead], axis=-1),
        "phi": 0.1 * np.stack([1.0 - ramp, ramp - 1.0], axis=-1),
        "contact_y": np.stack([-0.75 + 0.03 * ramp * lead, 0.75 + 0.01 * ramp * lead], axis=-1),
        "contact_z": 0.46 + 0.003 * np.stack([ramp * lead, 0.0 * ramp], axis=-1),
        "T_gamma": 200.0 * np.stack([ramp * lead, ramp * lead], axis=-1),
        "T_gamma_spin": 2.0 * np.stack([ramp * lead, ramp * lead], axis=-1),
        "body_position": body,
        "body_velocity": np.gradient(body, time, axis=0),
        "body_acceleration": 0.1 * body,
        "Q0": q0,
    }


PROFILES = {
    "S1002": Profile("S1002", "wheel", [-0.07, 0.0, 0.06], [0.0, 0.0, -0.001], "made up"),
    "60E1": Profile("60E1", "rail", [-0.03, 0.0, 0.03], [0.01, 0.0, 0.01], "made up", 0.025),
}


def feed(sink, chunks=7, extra=(), status="complete", **how):
    """Feed a sink as a simulation does and return its result."""
    given = arrays(**how)
    sink.begin(COORDINATES, (*QUANTITIES.values(), *extra))
    timed = [name for name in given if name != "Q0"]
    for part in np.array_split(np.arange(given["time"].size), chunks):
        sink.append({name: given[name][part] for name in timed})
    return sink.close(attributes(how.get("speed", 20.0), status), {"Q0": given["Q0"]}, PROFILES)


def example_result(**how) -> Result:
    return feed(MemorySink(), **how)
