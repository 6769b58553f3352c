"""When does the vehicle hunt?

The least damped oscillation over speed, the contact linearised harmonically about two amplitudes
of the wheelset. Where its damping ratio crosses zero, the linear critical speed for this
amplitude is reached. The critical speed of the non-linear system is found by
`railsim.critical_speed`.
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim.plot.style import LIMIT, styled

coach = railsim.load_vehicle("coach_manchester")
speeds = np.linspace(40.0, 80.0, 5)

with styled():
    figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
    for amplitude in (0.003, 0.005):
        label = f"amplitude {1e3 * amplitude:g} mm"
        locus = railsim.root_locus(
            coach, speeds=speeds.tolist(), linearisation="harmonic", amplitude=amplitude
        )
        least = [modes.least_damped for modes in locus.sets]
        damping = np.array([mode.damping_ratio for mode in least])
        print(
            f"{label}: least damped at {speeds[-1]:g} m/s: {least[-1].name}, "
            f"{least[-1].frequency:.2f} Hz, damping {100.0 * damping[-1]:.1f} %"
        )
        if damping[-1] < 0.0:
            k = int(np.argmax(damping < 0.0))  # first unstable speed, the one before is stable
            critical = np.interp(0.0, damping[[k, k - 1]], speeds[[k, k - 1]])
            print(f"   linear critical speed near {critical:.0f} m/s")
        axes.plot(speeds, 100.0 * damping, marker="o", label=label)
    axes.axhline(0.0, color=LIMIT, ls="--")
    axes.set(xlabel="speed (m/s)", ylabel="least damping ratio (%)")
    axes.legend()
    figure.savefig("05_when_does_it_hunt.png")
