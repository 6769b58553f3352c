"""When does the vehicle hunt?

The least damped oscillation over speed, the contact linearised harmonically with an amplitude of 3 mm. Where its
damping ratio crosses zero, the linear critical speed is reached. Worn pairs of profiles have a greater equivalent
conicity and hunt earlier; the second line is for a conicity of 0.3.
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim.plot.style import LIMIT, styled

coach = railsim.load_vehicle("coach_manchester")
speeds = np.linspace(20.0, 80.0, 7)

with styled():
    figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
    for label, contact in (
        ("S1002 on 60E1 1:40, 3 mm", {"linearisation": "harmonic", "amplitude": 0.003}),
        ("conicity 0.3", {"conicity": 0.3}),
    ):
        locus = railsim.root_locus(coach, speeds=speeds.tolist(), **contact)
        least = [modes.least_damped for modes in locus.sets]
        damping = np.array([mode.damping_ratio for mode in least])
        print(f"{label}: least damped at {speeds[-1]:g} m/s: {least[-1].name}, "
              f"{least[-1].frequency:.2f} Hz, damping {100.0 * damping[-1]:.1f} %")
        if damping[-1] < 0.0:
            falling = damping[::-1]  # interp wants rising values
            print(f"   linear critical speed near {np.interp(0.0, falling, speeds[::-1]):.0f} m/s")
        axes.plot(speeds, 100.0 * damping, marker="o", label=label)
    axes.axhline(0.0, color=LIMIT, ls="--")
    axes.set(xlabel="speed (m/s)", ylabel="least damping ratio (%)")
    axes.legend()
    figure.savefig("05_when_does_it_hunt.png")
