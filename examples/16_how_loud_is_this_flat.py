"""How loud is this flat?

A wheel with a flat strikes its rail once per turn. The picture shows how hard, over the speed: the
peak of the force on the rail, and by how much the force of spring and damper at the axle box
changes. Slowly the wheel tips over the ends of a fresh flat; faster than some 5 m/s it flies and
lands behind the middle. Rounded ends take away most of the blow up to 60 km/h. The table
answers the workshop's question: how long may a flat be before the peak of Q reaches a limit? The
limit is yours, railsim has none.
"""

import functools

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim.plot.style import styled

LIMIT = 250e3  # N, of the peak of Q: choose your own
RADIUS, STRIKES_AT = 0.46, 40.0  # m

speeds = np.array([4.0, 12.0, 28.0])
lengths = np.array([0.025, 0.05])
track = railsim.load_track("straight").with_values({"support.preset": "co-running"})
settings = railsim.load_settings().with_values(
    {"output_rate": 5000.0, "outputs.elements": ["front.outer.*.right"]}
)
wheelset = "assemblies.bogie.assemblies.axle.wheelsets.wheelset"
angle = (STRIKES_AT / RADIUS + np.pi) % (2.0 * np.pi) - np.pi


@functools.cache
def peaks(load: str, length: float, shape: str, speed: float) -> tuple[float, float]:
    """Largest force on the rail and change of the force at the axle box, of one blow [N]."""
    flat = {"type": "flat", "length": length, "shape": shape, "angle": float(angle)}
    coach = railsim.load_vehicle("coach_manchester").with_values(
        {f"{wheelset}.out_of_round": {"flat": flat}, "load": load}
    )
    # the leading wheelset is 10.8 m ahead of the body's middle; the next one has passed its flat
    start = STRIKES_AT - 10.8 - 0.2
    run = railsim.simulate(
        coach, track, speed=speed, start=start, duration=0.8 / speed, settings=settings
    )
    damper, spring = run["element_force"].swapaxes(0, 1)
    force = spring[:, 2] + damper[:, 0]
    # over all steps: a blow is shorter than the time between some outputs
    return run.groups["peaks"]["Q"][0, 0].max(), np.abs(force - force[0]).max()


with styled():
    figure, axes = plt.subplots(1, 2, figsize=(8.0, 3.4), layout="constrained")
    for shape, line in (("fresh", "-"), ("worn", "--")):
        for length in lengths if shape == "fresh" else lengths[1:]:
            found = np.array([peaks("design", length, shape, speed) for speed in speeds])
            label = f"{shape}, {1e3 * length:g} mm"
            axes[0].plot(3.6 * speeds, 1e-3 * found[:, 0], line, marker="o", label=label)
            axes[1].plot(3.6 * speeds, 1e-3 * found[:, 1], line, marker="o", label=label)
    axes[0].axhline(1e-3 * LIMIT, color="0.5", lw=0.8)
    axes[0].set(xlabel="speed (km/h)", ylabel="peak of Q (kN)", ylim=(0.0, None))
    axes[1].set(xlabel="speed (km/h)", ylabel="change at the axle box (kN)", ylim=(0.0, None))
    axes[1].legend()
    figure.savefig("16_how_loud_is_this_flat.png")

print(f"Length of a fresh flat (mm) at which the peak of Q reaches {1e-3 * LIMIT:g} kN")
print("load    ", *(f"{3.6 * speed:5.0f} km/h" for speed in speeds))
for load in ("design", "laden"):
    row = []
    for speed in speeds:
        largest = [peaks(load, length, "fresh", speed)[0] for length in lengths]
        reached = np.interp(LIMIT, largest, 1e3 * lengths, left=np.nan, right=np.nan)
        over = f"> {1e3 * lengths[-1]:.0f}" if max(largest) < LIMIT else f"< {1e3 * lengths[0]:.0f}"
        row.append(f"{reached:10.0f}" if np.isfinite(reached) else f"{over:>10}")
    print(f"{load:8}", *row)
