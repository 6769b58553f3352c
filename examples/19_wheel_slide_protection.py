"""How far does a train slide on slippery rails?

A metro car brakes from 20 m/s and starts at 5 m/s on a coefficient of friction of 0.10, which falls
with the slip velocity (Polach 2005, wet rails). Each axle gets more torque than the rails take, and
without protection the wheels lock, or spin. A static law takes the torque back with the slip: all
of it is there up to 1 %, nothing from 3 % on. A controller for each axle takes it back by the
speeds of axle and vehicle, measured every 10 ms, through a cylinder with a lag and a limited rate;
above 2 m/s the slip has to stay within the same band. No brake stops the car in less than
v0^2/(2 mu g).
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim import laws
from railsim.plot.style import styled

MU, G = 0.10, 9.80665
DEMAND = 6e3  # N m on each axle; the rails take 3.6 kN m
BAND = 0.01, 0.03  # of slip
AXLES = [f"{bogie}.{axle}" for bogie in ("front", "rear") for axle in ("outer", "inner")]


@laws.controller
def protection(time, axle, vehicle, sense, demand, fill, target, ahead, gain, memory):
    """Torque that is filled up to the demand, and led by the slip that comes.

    Below half of the target slip it rises at the rate `fill`, then with `gain` times what is left
    to the target. `sense`: 1 in traction, -1 in braking.
    """
    sliding = sense * (axle - vehicle)
    coming = sliding + ahead * (sliding - memory[1]) / 0.01
    left = target * vehicle - coming
    change = fill if left > 0.5 * target * vehicle else min(fill, gain * left)
    memory[0], memory[1] = min(demand, max(0.0, memory[0] + 0.01 * change)), sliding
    return memory[0]


def with_torques(**torque):
    """Return the car with a torque on each of its axles."""
    vehicle = railsim.load_vehicle("metro_b_motor")
    bogie = vehicle.assemblies["bogie"].model_dump(exclude_none=True)
    torque = {"bodies": ["frame", "wheelset"], **torque}
    bogie["assemblies"]["axle"]["elements"]["torque"] = torque
    return vehicle.replace(assemblies={"bogie": bogie})


def without_control(kind, slip_control=None):
    """Return the car with a demand that rises within a second, and the static law where given."""
    tables = {"torque_table": [[0.0, DEMAND]], "demand_table": [[0.0, 0.0], [1.0, 1.0]]}
    return with_torques(kind=kind, slip_control=slip_control, **tables)


def with_control(kind):
    """Return the car with a controller for each axle."""
    brakes = kind == "brake"
    values = {"sense": -1.0 if brakes else 1.0, "demand": DEMAND, "fill": DEMAND}
    values |= {"target": 0.025, "ahead": 0.1, "gain": 16e3}
    signals = {"vehicle": {"quantity": "speed", "rate": 100.0}}
    controllers = {}
    for axle in AXLES:
        name = axle.replace(".", "_")
        speed = {"quantity": "wheel_speed", "wheelset": f"{axle}.wheelset"}
        signals[name] = {**speed, "rate": 100.0, "resolution": 0.002}
        controllers[name] = {
            "law": "protection",
            "period": 0.01,
            "inputs": {"axle": name, "vehicle": "vehicle"},
            "outputs": [f"{axle}.torque"],
            "parameters": values,
            "memory": 2,
        }
    vehicle = with_torques(
        kind="actuator",
        acts="axle",
        command="brake" if brakes else "force",
        lag=0.04,
        rate_limit=20e3,
        force_limit=DEMAND,
    )
    return vehicle.replace(
        laws={"protection": laws.law(protection)}, signals=signals, controllers=controllers
    )


track = railsim.load_track("straight").replace(
    plan=[{"type": "STR", "length": 700.0}],
    cant=[{"type": "CST", "length": 700.0, "cant": 0.0}],
    friction=(MU, MU),
    friction_falling={"rest": 0.4, "decay": 0.2},
    third_body=(0.3, 0.1),
    support={"preset": "rigid"},
)
settings = railsim.Settings(drive={"mode": "free"}, creep_law="polach", output_rate=100.0)
ways = {"brake": ("braking", 20.0, 60.0), "traction": ("starting", 5.0, 15.0)}
with styled():
    figure, both = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
    for axes, (kind, (words, speed, duration)) in zip(both, ways.items(), strict=True):
        vehicles = {
            "without protection": without_control(kind),
            "static law": without_control(kind, BAND),
            "controller": with_control(kind),
        }
        for name, vehicle in vehicles.items():
            run = {"speed": speed, "duration": duration, "settings": settings}
            result = railsim.simulate(vehicle, track, **run)
            time, distance = result["time"], result["distance"]
            runs = np.gradient(distance, time) > 2.0  # m/s
            slip = np.abs(result["xi_x"][:, :, 0])
            within = np.mean((slip[runs] > BAND[0]) & (slip[runs] < BAND[1]))
            print(
                f"{words}, {name}: {distance[-1]:.1f} m in {time[-1]:.1f} s, "
                f"slip in its band for {100.0 * within:.0f} % of the time"
            )
            axes.plot(time[runs], 100.0 * slip[runs, 0], label=name)
        axes.axhspan(*(100.0 * np.array(BAND)), color="0.9")
        axes.set(xlabel="time (s)", ylabel="slip of the leading axle (%)", title=words)
        axes.set(xlim=(0.0, 25.0 if kind == "brake" else 15.0), ylim=(0.0, 5.0))
    both[1].legend()
    figure.savefig("19_wheel_slide_protection.png")
print(f"shortest distance {20.0**2 / (2.0 * MU * G):.1f} m")
