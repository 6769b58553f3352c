"""How does the bogie steer over the radius?

Angle of attack of the leading wheelset and wear number of all wheels in steady curving, from
tight to wide curves, for both primary suspensions. In tight curves the wheelset cannot become
radial: the flange guides, and the wear number rises.
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim.plot.style import styled

radii = [250.0, 400.0, 800.0, 2000.0]

with styled():
    figure, (attack, wear) = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
    for label, name in (("Manchester", "coach_manchester"), ("flexicoil", "coach_flexicoil")):
        coach = railsim.load_vehicle(name)
        found = railsim.curving(coach, radius=radii, cant_deficiency=[0.05], friction=[0.4])
        angle = 1e3 * found.attack[:, 0, 0, 0]
        T_gamma = np.sum(found.T_gamma[:, 0, 0], axis=(-2, -1))
        print(f"{label}: angle of attack (mrad)", dict(zip(radii, angle.round(2), strict=True)))
        attack.plot(radii, angle, marker="o", label=label)
        wear.plot(radii, T_gamma, marker="o", label=label)
    attack.set(ylabel=r"$\psi$ (mrad)", title="Angle of attack, leading wheelset")
    wear.set(ylabel=r"$T\gamma$ (N)", title="Wear number, all wheels")
    figure.suptitle("Coaches in steady curving, cant deficiency 50 mm")
    for axes in (attack, wear):
        axes.set(xlabel="$R$ (m)", xscale="log")
        axes.set_xticks(radii, [f"{radius:g}" for radius in radii])
        axes.minorticks_off()
    attack.legend()
    figure.savefig("07_steering_over_radius.png")
