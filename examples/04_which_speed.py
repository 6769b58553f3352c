"""At which speed may the coach run through that curve?

Steady curving over the cant deficiency, at R 250 m with 150 mm of cant: the speed follows from
the balance of centrifugal force, weight and cant. Sum of guiding forces against 10 kN + P0/3
(Prud'homme, EN 14363), derailment quotient against 0.8, and the unloading of the inner wheels.
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim.plot.style import LIMIT, styled

coach = railsim.load_vehicle("coach_manchester")
P0 = railsim.static_loads(coach).axle_load
prudhomme = 10e3 + P0.max() / 3.0
found = railsim.curving(coach, radius=[250.0], cant=0.150, cant_deficiency=[-0.10, 0.0, 0.08, 0.15])

kmh = 3.6 * found.speed[0]
forces = np.abs(found.sum_Y[0, :, 0]).max(axis=-1)
quotient = found.Y_over_Q[0, :, 0].max(axis=(-2, -1))
unloading = found.dQ_over_Q0[0, :, 0].min(axis=(-2, -1))
for row in zip(kmh, forces / 1e3, quotient, 100.0 * unloading, strict=True):
    print("{:5.1f} km/h: sum of guiding forces {:5.1f} kN, Y/Q {:.2f}, dQ/Q0 {:.0f} %".format(*row))

with styled():
    figure, axes = plt.subplots(1, 3, figsize=(10.0, 3.2), layout="constrained", sharex=True)
    for one, values, limit, label in (
        (axes[0], forces / 1e3, prudhomme / 1e3, r"largest $|\Sigma Y|$ (kN)"),
        (axes[1], quotient, 0.8, "largest $Y/Q$"),
        (axes[2], -100.0 * unloading, 60.0, r"largest $-\Delta Q/Q_0$ (%)"),
    ):
        one.plot(kmh, values, marker="o")
        one.axhline(limit, color=LIMIT, ls="--")
        one.set(xlabel="$V$ (km/h)", ylabel=label, ylim=(0.0, None))
    figure.suptitle("Manchester coach, R 250 m, cant 150 mm; dashed: limits")
    figure.savefig("04_which_speed.png")
