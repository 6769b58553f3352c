"""Made-up runs for assessments: forces as functions of time and distance, no physics."""

import numpy as np
from example_result import BODIES, COORDINATES, OFFSETS, PROFILES, text

from railsim.definitions.track.definition import Track
from railsim.notation import QUANTITIES
from railsim.result import MemorySink

Q0 = 54.545e3
KEPT = ("time", "distance", "Q", "Y", "Y_over_Q", "wheelset_distance", "T_gamma", "xi_x",
        "body_position", "body_velocity", "body_acceleration", "Q0")  # fmt: skip

# as a run for an assessment may be stored, in a fifth of the instants; and instantaneous values
FINE = {"rate": 1000.0, "settings": "{}"}
FILTERED = '{"outputs": {"low_pass": {"frequency": 80.0}}, "output_rate": 200.0}'


def track(*plan, cant=0.0, irregularities=()):
    """A track of plan elements; `cant` in its circles, ramps in its clothoids."""
    if any(element["type"] == "CIR" for element in plan) and cant:
        kinds = {"STR": "CST", "CLO": "LIR", "CIR": "CST"}
        cants = []
        for element in plan:
            own = {"type": kinds[element["type"]], "length": element["length"]}
            if own["type"] == "CST":
                own["cant"] = cant if element["type"] == "CIR" else 0.0
            cants.append(own)
    else:
        cants = [{"type": "CST", "length": 10.0, "cant": cant}]
    return Track.model_validate({
        "format": "railsim-track/1", "name": "made up", "plan": list(plan), "cant": cants,
        "irregularities": list(irregularities),
    })  # fmt: skip


def curve(radius, length, run=120.0, clothoid=80.0):
    """Straight, transition, curve, transition, straight."""
    return [
        {"type": "STR", "length": run}, {"type": "CLO", "length": clothoid},
        {"type": "CIR", "length": length, "radius": radius},
        {"type": "CLO", "length": clothoid}, {"type": "STR", "length": run},
    ]  # fmt: skip


def made(
    on,
    speed,
    *,
    rate=200.0,
    until=None,
    Y=None,
    Q=None,
    lateral=None,
    accelerations=None,
    without=(),
    status="complete",
    settings=FILTERED,
    T_gamma=None,
    vehicle=None,
    profiles=PROFILES,
):
    """A run whose wheel forces and body accelerations are given functions.

    Parameters
    ----------
    Y, Q : callable, optional
        Time [time] and distance [time, wheelset] to forces [time, wheelset, side].
    lateral : callable, optional
        Time to the lateral acceleration of the car body.
    accelerations : callable, optional
        Time to the accelerations [time, body, 3] of all bodies.
    """  # fmt: skip
    time = np.arange(round((until or on.length) / speed * rate) + 1) / rate
    distance = speed * time
    at = distance[:, None] + OFFSETS
    shape = (*at.shape, 2)
    loads = np.full(shape, Q0) if Q is None else Q(time, at)
    forces = np.zeros(shape) if Y is None else Y(time, at)
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = np.where(loads > 0.0, forces / loads * np.array([-1.0, 1.0]), np.nan)
    body = np.zeros((len(time), len(BODIES), 6))
    acceleration = body.copy()
    acceleration[:, :, 2] = 9.81  # held against nothing: readings of sensors are then zero
    acceleration[:, :, 2] -= 9.81
    if lateral is not None:
        acceleration[:, 0, 1] = lateral(time)
    if accelerations is not None:
        acceleration[:, :, :3] += accelerations(time)
    given = {
        "time": time, "distance": distance, "Q": loads, "Y": forces, "Y_over_Q": quotient,
        "wheelset_distance": at,
        "T_gamma": np.zeros(shape) if T_gamma is None else T_gamma(time, at),
        "xi_x": np.full(shape, -1e-3), "body_position": body, "body_velocity": body,
        "body_acceleration": acceleration, "Q0": np.full((4, 2), Q0),
    }  # fmt: skip
    kept = [name for name in KEPT if name not in without]
    sink = MemorySink()
    sink.begin(COORDINATES, [QUANTITIES[name] for name in kept])
    sink.append({name: given[name] for name in kept if name != "Q0"})
    attributes = {
        "status": status, "status_reason": "" if status == "complete" else "made up",
        "speed": speed, "vehicle_toml": vehicle or text("vehicles/coach_manchester.toml"),
        "track_toml": on.to_toml(), "settings_json": settings,
    }  # fmt: skip
    return sink.close(attributes, {"Q0": given["Q0"]}, profiles)
