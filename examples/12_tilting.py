"""What does tilting spare the passengers?

Actuators between bogies and car body tilt the coach into a curve of 400 m at 1.5 m/s2 in the track
plane: by the curvature ahead, which the train knows from its position, and by an accelerometer on
the leading bogie behind a filter against hunting and irregularities. The filter makes the sensors
late: the passengers feel more in the transition, and P_CT of EN 12299 shows it. The motion
sickness dose of ISO 2631-1 is the price of both.
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim import laws
from railsim.assessment.comfort import motion_sickness_dose, p_ct
from railsim.plot.style import styled

G = 9.81


@laws.controller
def ahead(time, speed, curvature, cant, share, most):
    """Tilt that takes a share of the acceleration in the track plane."""
    a = speed * speed * curvature - 9.81 * cant
    return min(most, max(-most, share * a / 9.81))


@laws.controller
def sensors(time, a, share, most, lag, memory):
    """The same from an accelerometer behind a first-order filter, called every 10 ms."""
    memory[0] += (a - memory[0]) * 0.01 / (0.01 + lag)
    return min(most, max(-most, share * memory[0] / 9.81))


coach = railsim.load_vehicle("coach_manchester")
bogie = coach.assemblies["bogie"].model_dump(exclude_none=True)
bogie["elements"]["tilt"] = {
    "kind": "actuator",
    "bodies": ["frame", "carbody"],
    "point": [0.0, 0.0, -0.9],
    "acts": "roll",
    "command": "position",
    "stiffness": 50e6,
    "damping": 2e6,
    "lag": 0.2,
    "rate_limit": 0.09,
    "stroke": 0.15,
}
signals = {
    "speed": {"quantity": "speed"},
    "curvature_ahead": {"quantity": "curvature", "ahead": 8.0},
    "cant_ahead": {"quantity": "cant_angle", "ahead": 8.0},
    "a": {
        "quantity": "acceleration",
        "body": "front.frame",
        "axis": "y",
        "rate": 100.0,
        "delay": 0.01,
    },
}
ways = {
    "no tilt": None,
    "ahead": {"inputs": {"speed": "speed", "curvature": "curvature_ahead", "cant": "cant_ahead"}},
    "sensors": {"inputs": {"a": "a"}, "memory": 1},
}
track = railsim.load_track("curve_r250").replace(
    plan=[
        {"type": "STR", "length": 100.0},
        {"type": "CLO", "length": 60.0, "radius_end": 400.0},
        {"type": "CIR", "length": 300.0, "radius": 400.0},
    ],
    cant=[
        {"type": "CST", "length": 100.0, "cant": 0.0},
        {"type": "LIR", "length": 60.0},
        {"type": "CST", "length": 300.0, "cant": 0.15},
    ],
)
speed = float(np.sqrt(400.0 * (1.5 + G * 0.1)))
settings = railsim.Settings(outputs={"sensors": "readings"})
results = {}
with styled():
    figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
    for name, how in ways.items():
        vehicle = coach
        if how is not None:
            law = {"ahead": ahead, "sensors": sensors}[name]
            values = {"share": 0.6, "most": 0.14}
            if name == "sensors":
                values |= {"lag": 1.0, "share": 0.55}
            controller = {
                "law": name,
                "period": 0.01,
                "outputs": ["front.tilt", "rear.tilt"],
                "parameters": values,
                **how,
            }
            vehicle = coach.replace(
                assemblies={"bogie": bogie},
                laws={name: laws.law(law)},
                signals=signals,
                controllers={name: controller},
            )
        result = railsim.simulate(vehicle, track, speed=speed, until=450.0, settings=settings)
        results[name] = result
        sensor = result.coordinates["sensor"].index("floor_middle")
        a = result["sensor_acceleration"][:, sensor]
        rate = np.degrees(result["sensor_roll_rate"][:, sensor])
        smooth = np.convolve(a[:, 1], np.ones(200) / 200.0, "valid")
        jerk = float(np.max(np.abs(smooth[200:] - smooth[:-200])))
        most, turn = float(np.max(np.abs(smooth))), float(np.max(np.abs(rate)))
        standing = p_ct(most, jerk, turn, "standing")
        dose = motion_sickness_dose(a[:, 2], 200.0)
        print(
            f"{name}: {np.mean(a[-400:, 1]):.2f} m/s2 in the curve, at most {most:.2f}; "
            f"P_CT {standing:.0f} % standing, dose {dose:.2f} m/s1.5"
        )
        axes.plot(result["distance"], a[:, 1], label=name)
    axes.set(xlabel="distance (m)", ylabel="lateral acceleration, floor (m/s²)", title="R 400 m")
    axes.legend()
    figure.savefig("12_tilting.png")
