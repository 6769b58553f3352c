"""What does active steering save in a curve of 300 m?

The longitudinal springs of the primary suspension get actuators in series, which turn the wheelsets
against the bogie frame: at a gain of 1 by a/R, half the wheelbase over the radius, which makes them
radial. The curvature is the yaw rate of the frame over the speed. In one long curve the gain rises
from section to section; each point is the mean of the last metres of a section. Radial wheelsets
roll where the difference of the rolling radii is 2 b_0 r_0/R (Redtenbacher 1855), here at a jump of
the contact of S1002 on 60E1: the creepages that are left come from there.
"""

from math import floor

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim import laws
from railsim.contact import contact_geometry
from railsim.plot.style import styled
from railsim.profiles import load_profile

RADIUS, SPEED = 300.0, 15.0
GAINS = np.arange(0.0, 1.6, 0.25)
BEGIN, SECTION = 150.0, 50.0  # m: where the gain begins to rise, length of each gain
HALF_BASE, ARM = 1.28, 1.0  # m: half the wheelbase, lateral position of the springs


@laws.controller
def steering(time, turn, speed, distance, begin, section, rise, arm):
    """Elongation of the actuator: against the turn of its wheelset."""
    gain = rise * max(0.0, floor((distance - begin) / section))
    return -gain * arm * turn / speed


coach = railsim.load_vehicle("coach_manchester")
bogie = coach.assemblies["bogie"].model_dump(exclude_none=True)
elements = bogie["assemblies"]["axle"]["elements"]
along, *others = elements["primary"]["stiffness"]
elements["primary"] |= {
    "stiffness": [0.0, *others],
    "damping": [0.0, *elements["primary"]["damping"][1:]],
    "series_stiffness": [0.0, *elements["primary"]["series_stiffness"][1:]],
}
elements["steer"] = {
    "kind": "actuator",
    "bodies": ["frame", "wheelset"],
    "point": [0.0, ARM, -0.46],
    "sides": "both",
    "acts": "x",
    "command": "position",
    "stiffness": along,
    "damping": 15e3,
    "lag": 0.1,
}
signals = {"speed": {"quantity": "speed"}, "distance": {"quantity": "distance"}}
controllers = {}
for end in ("front", "rear"):
    rate = {"quantity": "angular_velocity", "body": f"{end}.frame", "axis": "yaw"}
    signals[f"turn_{end}"] = {**rate, "rate": 100.0}
    for side, sign in (("right", 1.0), ("left", -1.0)):
        controllers[f"{end}_{side}"] = {
            "law": "steering",
            "period": 0.01,
            "inputs": {"turn": f"turn_{end}", "speed": "speed", "distance": "distance"},
            "outputs": [f"{end}.{axle}.steer.{side}" for axle in ("outer", "inner")],
            "parameters": {
                "begin": BEGIN - SECTION,
                "section": SECTION,
                "rise": GAINS[1],
                "arm": sign * ARM * HALF_BASE,
            },
        }
steered = coach.replace(
    assemblies={"bogie": bogie},
    laws={"steering": laws.law(steering)},
    signals=signals,
    controllers=controllers,
)
length = BEGIN + SECTION * len(GAINS) + 20.0
track = railsim.load_track("curve_r250").replace(
    plan=[
        {"type": "STR", "length": 30.0},
        {"type": "CLO", "length": 50.0, "radius_end": RADIUS},
        {"type": "CIR", "length": length, "radius": RADIUS},
    ],
    cant=[
        {"type": "CST", "length": 30.0, "cant": 0.0},
        {"type": "LIR", "length": 50.0},
        {"type": "CST", "length": length, "cant": 0.1},
    ],
)
settings = railsim.Settings(outputs={"elements": ["front.outer.steer.*"]})
until = BEGIN + SECTION * (len(GAINS) - 1)
result = railsim.simulate(steered, track, speed=SPEED, until=until, settings=settings)

ends = BEGIN + SECTION * np.arange(len(GAINS)) - 1.0
parts = [(result["distance"] > end - 8.0) & (result["distance"] < end) for end in ends]


def means(values):
    """Mean of each section."""
    return np.array([np.mean(values[part], axis=0) for part in parts])


wear = means(np.sum(result["T_gamma"], axis=2))
Y = 1e-3 * means(result["Y"])
attack = 1e3 * means(result["wheelset_yaw"])
force = 1e-3 * np.max(np.abs(means(result["element_force"][:, :, 0])))
for k, gain in enumerate(GAINS):
    print(
        f"gain {gain:.2f}: T_gamma {np.sum(wear[k]):.0f} N on all wheels, outer leading wheel "
        f"Y {-Y[k, 0, 0]:.1f} kN, angle of attack {attack[k, 0]:.2f} mrad"
    )
wheel, rail = (load_profile(name) for name in ("S1002", "60E1"))
rigid = contact_geometry(wheel, rail, inclination=0.025)
rolling = 1e3 * np.max(rigid.lateral[rigid.delta_r < -1.5 * 0.46 / RADIUS])
lateral = 1e3 * means(result["wheelset_lateral"])[list(GAINS).index(1.0)]
print(f"pure rolling at {rolling:.2f} mm; at gain 1 at", *(f"{y:.2f}" for y in lateral), "mm")
print(f"a/R {1e3 * HALF_BASE / RADIUS:.2f} mrad; largest force of an actuator {force:.1f} kN")
with styled():
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
    for w, name in enumerate(result.wheelsets):
        left.plot(GAINS, wear[:, w], "o-", label=name.removesuffix(".wheelset"))
        right.plot(GAINS, -Y[:, w, 0], "o-")
    left.set(xlabel="gain", ylabel=r"$T_\gamma$ of the wheelset (N)", title="R 300 m, 15 m/s")
    right.set(xlabel="gain", ylabel="Y of the outer wheel (kN)")
    left.legend()
    figure.savefig("21_active_steering.png")
