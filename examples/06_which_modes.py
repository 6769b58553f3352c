"""Which modes has the vehicle?

Eigenfrequencies and damping ratios at one speed, named after what moves: bounce, pitch, lower and
upper sway, yaw of the car body, hunting of the bogies. The picture shows the share of each
displacement in the least damped modes.
"""

import railsim

coach = railsim.load_vehicle("coach_manchester")
modes = railsim.modes(coach, speed=30.0)

for mode in modes.oscillations[:12]:
    print(f"{mode.name:28} {mode.frequency:6.3f} Hz   damping {100.0 * mode.damping_ratio:5.1f} %")

figure = modes.plot(
    "06_which_modes.png", title="Manchester coach, straight track, 30 m/s", overwrite=True
)
