"""When does the vehicle hunt?

The damping of the least damped oscillation over speed, the contact linearised harmonically about
several lateral amplitudes of the wheelsets, from small motions to the flange. The smallest
amplitude loses its damping first, at 40 m/s; at 3 mm the coach seems stable up to 47 m/s, and yet
it hunts from flange to flange from 40 m/s on. The non-linear critical speed, below which no
disturbance makes it hunt, is found by `railsim.critical_speed`.
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim.plot.style import LIMIT, styled

coach = railsim.load_vehicle("coach_manchester")
speeds = np.linspace(30.0, 70.0, 9)

with styled():
    figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
    for amplitude in (0.0001, 0.0005, 0.001, 0.003, 0.006):
        locus = railsim.root_locus(
            coach, speeds=speeds.tolist(), linearisation="harmonic", amplitude=amplitude
        )
        damping = np.array([modes.least_damped.damping_ratio for modes in locus.sets])
        label = f"amplitude {1e3 * amplitude:g} mm"
        if damping.min() < 0.0:
            k = int(np.argmax(damping < 0.0))  # first unstable speed, the one before is stable
            critical = np.interp(0.0, damping[[k, k - 1]], speeds[[k, k - 1]])
            print(f"{label}: linear critical speed {critical:.0f} m/s")
        else:
            print(f"{label}: stable up to {speeds[-1]:g} m/s")
        axes.plot(speeds, 100.0 * damping, marker="o", label=label)
    axes.axhline(0.0, color=LIMIT, ls="--")
    axes.set(xlabel="$V$ (m/s)", ylabel=r"least damping ratio $\zeta$ (%)")
    axes.set_title("Manchester coach, straight track")
    axes.legend()
    figure.savefig("05_when_does_it_hunt.png")
