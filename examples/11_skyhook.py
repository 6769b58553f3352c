"""What does an active lateral suspension gain?

The coach's lateral dampers between bogies and car body are replaced by actuators, and a Python
function commands them: as a skyhook, a force against the car body's own sway, and semi-active, as
dampers whose constant follows the skyhook where they can only take energy. Comfort on irregular
track, N_MV of EN 12299 (lower is better), against the passive coach; and the car body's sway by the
linearised loop, its delay included.
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim import laws
from railsim.assessment.comfort import en12299_mean_comfort
from railsim.linear.closed_loop import closed_loop
from railsim.linear.eigenmodes import eigenmodes
from railsim.plot.style import styled


@laws.controller
def skyhook(time, v, c):
    """Force that pushes the frame along and the car body back."""
    return c * v


@laws.controller
def semi_active(time, v, rate, c, least):
    """Constant of a damper: the skyhook's where it takes energy, else the least."""
    if v * rate <= 0.0:
        return least
    return min(c, max(least, c * v / rate))


coach = railsim.load_vehicle("coach_manchester")
bogie = coach.assemblies["bogie"].model_dump(exclude_none=True)
del bogie["elements"]["secondary_lateral_damper"]
ends = {"front": 9.5, "rear": -9.5}


def active(law, command, inputs, **parameters):
    """Return the coach with two lateral actuators and a controller for each."""
    actuator = {
        "kind": "actuator",
        "bodies": ["frame", "carbody"],
        "point": [0.0, 0.0, -0.7],
        "acts": "y",
        "command": command,
        "lag": 0.005,
    }
    signals = {}
    for end, x in ends.items():
        place = {"body": "carbody", "position": [x, 0.0, -0.7]}
        signals[f"v_{end}"] = {"quantity": "velocity", "axis": "y", "rate": 500.0, **place}
        signals[f"rate_{end}"] = {"quantity": "rate", "axis": "y", "element": f"{end}.lateral"}
    controllers = {
        end: {
            "law": law.__name__,
            "period": 0.002,
            "inputs": {name: f"{name}_{end}" for name in inputs},
            "outputs": [f"{end}.lateral"],
            "parameters": parameters,
        }
        for end in ends
    }
    return coach.replace(
        assemblies={"bogie": {**bogie, "elements": {**bogie["elements"], "lateral": actuator}}},
        laws={law.__name__: laws.law(law)},
        signals=signals,
        controllers=controllers,
    )


vehicles = {
    "passive": coach,
    "semi-active": active(semi_active, "damper", ["v", "rate"], c=120e3, least=6e3),
    "skyhook": active(skyhook, "force", ["v"], c=120e3),
}

track = railsim.load_track("straight").replace(
    plan=[{"type": "STR", "length": 2200.0}],
    cant=[{"type": "CST", "length": 2200.0, "cant": 0.0}],
    irregularities=[{"type": "random", "spectrum": "erri_b176_low", "seed": 1}],
)
settings = railsim.Settings(outputs={"sensors": "readings"})
with styled():
    figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
    for name, vehicle in vehicles.items():
        result = railsim.simulate(vehicle, track, speed=33.0, until=2100.0, settings=settings)
        sensor = result.coordinates["sensor"].index("floor_front")
        a = result["sensor_acceleration"][:, sensor]
        comfort = en12299_mean_comfort(a, 200.0)
        sway = np.sqrt(np.mean((a[:, 1] - a[:, 1].mean()) ** 2))
        print(f"{name}: N_MV {comfort.N_MV:.2f}, lateral {sway:.3f} m/s2 rms")
        part = (result["time"] > 20.0) & (result["time"] < 30.0)
        axes.plot(result["time"][part], a[part, 1], label=name)
    axes.set(xlabel="time (s)", ylabel="lateral acceleration, floor (m/s²)", title="33 m/s")
    axes.legend()
    figure.savefig("11_skyhook.png")

rigid = railsim.load_track("straight").replace(support={"preset": "rigid"})
loop = eigenmodes(closed_loop(vehicles["skyhook"], rigid, 33.0, step=0.001))
sway = min((e for e in loop.eigenvalues if 1.0 < e.imag < 10.0), key=lambda e: e.imag)
damping = -100.0 * sway.real / abs(sway)
print(f"sway with skyhook: {abs(sway) / 6.2832:.2f} Hz, damping {damping:.0f} %")
