"""How well does a controller keep the speed, and how well a driver?

A metro car meets a gradient of 3 % at 18 m/s. A proportional-integral controller commands the
motors of all axles, with k_p = 2 m w and k_i = m w^2, m being the mass with the turning wheels. A
load D that begins at once takes D/m t exp(-w t) off the speed; here it grows over a vertical curve.

A driver follows limits of speed, 18, 10 and 16 m/s. He reacts half a second late, brakes along
v^2 = v_2^2 + 2 b (s_2 - s), and his lever has notches. A train without delay that changes its speed
at the same rates takes the shortest time.
"""

from math import floor, sqrt

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim import laws
from railsim.plot.style import styled

G, RADIUS = 9.80665, 0.42
CAR = 35396.0  # kg
MASS = CAR + 4.0 * 104.0 / RADIUS**2  # with the turning wheels
PER_AXLE = RADIUS / 4.0  # torque on each axle over the force on the car


@laws.controller
def keeper(time, speed, wanted, k_p, k_i, memory):
    """Torque on each axle, proportional and integral, every 50 ms."""
    memory[0] += 0.05 * (wanted - speed)
    return k_p * (wanted - speed) + k_i * memory[0]


@laws.controller
def driver(
    time, speed, distance, v_1, s_2, v_2, s_3, v_3, pushes, brakes, margin, late, notch, per, memory
):
    """Torque on each axle, by a lever with notches of some acceleration."""
    there = distance + late * speed  # what he sees now is half a second old
    wanted = v_1 if there < s_2 else v_2 if there < s_3 else v_3
    a = min(pushes, 0.5 * (wanted - margin - speed))
    if there < s_2:
        curve = sqrt(v_2 * v_2 + 2.0 * brakes * (s_2 - there))
        a = min(a, 0.5 * (curve - margin - speed) - brakes)
    a = max(a, -1.2)
    if abs(a / notch - memory[0]) > 0.8:
        memory[0] = floor(a / notch + 0.5)
    return per * notch * memory[0]


def car(law, inputs, values, late=0.0):
    """Return the car with a motor on each axle, and what commands them."""
    vehicle = railsim.load_vehicle("metro_b_motor")
    bogie = vehicle.assemblies["bogie"].model_dump(exclude_none=True)
    bogie["assemblies"]["axle"]["elements"]["motor"] = {
        "kind": "actuator",
        "bodies": ["frame", "wheelset"],
        "acts": "axle",
        "lag": 0.05,
        "force_limit": 5e3,
        "power_limit": 200e3,
    }
    name = law.__name__
    return vehicle.replace(
        assemblies={"bogie": bogie},
        laws={name: laws.law(law)},
        signals={n: {"quantity": n, "rate": 20.0, "delay": late} for n in inputs},
        controllers={
            name: {
                "law": name,
                "period": 0.05,
                "inputs": {n: n for n in inputs},
                "outputs": [
                    f"{b}.{a}.motor" for b in ("front", "rear") for a in ("outer", "inner")
                ],
                "parameters": values,
                "memory": 1,
            }
        },
    )


def run(vehicle, length, speed, **changes):
    """Time, distance and speed of the car that runs freely over a straight track."""
    track = railsim.load_track("straight").replace(
        plan=[{"type": "STR", "length": length}],
        cant=[{"type": "CST", "length": length, "cant": 0.0}],
        support={"preset": "rigid"},
        **changes,
    )
    settings = railsim.Settings(drive={"mode": "free"}, output_rate=50.0)
    until = length - 50.0
    result = railsim.simulate(vehicle, track, speed=speed, until=until, settings=settings)
    time, distance = result["time"], result["distance"]
    return time, distance, np.gradient(distance, time)


w, wanted, begins, curve, gradient = 0.2, 18.0, 60.0, 50.0, 0.03
values = {"wanted": wanted, "k_p": 2.0 * MASS * w * PER_AXLE, "k_i": MASS * w**2 * PER_AXLE}
time, _, speed = run(
    car(keeper, ["speed"], values),
    550.0,
    wanted,
    vertical=[
        {"type": "CST", "length": begins, "gradient": 0.0},
        {"type": "LIR", "length": curve},
        {"type": "CST", "length": 600.0, "gradient": gradient},
    ],
)
load = CAR * G * gradient / np.sqrt(1.0 + gradient**2)
t = np.maximum(0.0, time[:, None] - np.array([begins, begins + curve]) / wanted)
response = (1.0 - (1.0 + w * t) * np.exp(-w * t)) / w**2  # integral of t exp(-w t)
closed = wanted - load / MASS * (response[:, 0] - response[:, 1]) / (curve / wanted)
fallen, foreseen = wanted - np.min(speed), wanted - np.min(closed)
print(f"speed falls by {fallen:.3f} m/s, {foreseen:.3f} m/s by closed form")

limits = {"v_1": 18.0, "s_2": 400.0, "v_2": 10.0, "s_3": 500.0, "v_3": 16.0}
rates = {"pushes": 0.8, "brakes": 0.6}
habits = {"margin": 0.2, "late": 0.5, "notch": 0.12, "per": MASS * PER_AXLE}
vehicle = car(driver, ["speed", "distance"], {**limits, **rates, **habits}, late=0.5)
driven = run(vehicle, 700.0, 14.0)
limit = np.select([driven[1] < 400.0, driven[1] < 500.0], [18.0, 10.0], 16.0)
v = np.array([14.0, 18.0, 18.0, 10.0, 10.0, 16.0, 16.0])
ways = np.diff(v**2)[[0, 2, 4]] / 2.0 / np.array([0.8, -0.6, 0.8])
s = np.array([0.0, ways[0], 400.0 - ways[1], 400.0, 500.0, 500.0 + ways[2], driven[1][-1]])
least = np.sum(np.diff(s) / (0.5 * (v[1:] + v[:-1])))
over = np.max(driven[2] - limit)
print(f"driver: {driven[0][-1]:.1f} s, shortest time {least:.1f} s, {over:.2f} m/s above a limit")

with styled():
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
    left.plot(time, speed, label="controller")
    left.plot(time, closed, "--", label="closed form")
    left.set(xlabel="time (s)", ylabel="speed (m/s)", title="gradient of 3 %")
    right.plot(driven[1], driven[2], label="driver")
    along = np.linspace(0.0, s[-1], 400)
    shortest = np.sqrt(np.interp(along, s, v**2))
    right.plot(along, shortest, ":", color="0.4", label="shortest time")
    right.step([0.0, 400.0, 500.0, 650.0], [18.0, 10.0, 16.0, 16.0], where="post", label="limit")
    right.set(xlabel="distance (m)", ylabel="speed (m/s)", title="limits of speed")
    left.legend()
    right.legend()
    figure.savefig("20_speed_control.png")
