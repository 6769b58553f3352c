"""How much do friction and speed matter?

A study runs every combination and keeps one result file a run; what is finished is never computed
again. Here three speeds and two coefficients of friction in a tight curve, with the largest
derailment quotient of each run.
"""

import matplotlib.pyplot as plt

import railsim
from railsim.plot.style import styled

speeds, frictions = [12.0, 16.0, 20.0], [0.2, 0.4]
outcome = railsim.study(
    "coach_manchester",
    "curve_r250",
    speeds,
    grid={"track.friction": frictions},
    start=240.0,
    until=430.0,
    out="study_friction_speed",
    workers=1,
    overwrite=True,
)

with styled():
    figure, axes = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
    results = list(outcome.results().values())
    for friction in frictions:
        runs = [run for run in results if run.track().friction == (friction, friction)]
        quotients = [railsim.peaks(run, ["Y_over_Q"])[0].value for run in runs]
        print(f"friction {friction}: Y/Q", [round(value, 3) for value in quotients])
        axes.plot([run.speed for run in runs], quotients, marker="o", label=rf"$\mu$ = {friction}")
    axes.set(xlabel="$V$ (m/s)", ylabel="largest $Y/Q$", ylim=(0.0, None))
    axes.set_title("Manchester coach, R 250 m, cant 150 mm")
    axes.legend()
    figure.savefig("10_study_friction_speed.png")
