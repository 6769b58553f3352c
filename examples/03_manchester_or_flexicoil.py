"""Two primary suspensions: which one steers better?

The coaches differ in the primary suspension only: links and rubber of the Manchester benchmarks
against trailing arms on coil springs. The same curve at the same speed, both in one picture; the
table gives the largest values and their relative difference.
"""

import railsim
from railsim.compare import compare
from railsim.plot.overlay import overlay
from railsim.plot.style import save

track = railsim.load_track("curve_r250")
names = {"Manchester": "coach_manchester", "flexicoil": "coach_flexicoil"}
coaches = [railsim.load_vehicle(name) for name in names.values()]
runs = railsim.simulate_together(coaches, track, speed=20.0, until=520.0)
results = dict(zip(names, runs, strict=True))

for row in compare(results):
    values = [row.quantity.text(peak.value) for peak in row.peaks.values()]
    difference = 100.0 * row.differences["flexicoil"]
    print(
        f"{row.quantity.words:45} {row.where:17} {values[0]:>8} {values[1]:>8} {difference:+6.1f} %"
    )

figure = overlay(results, ("sum_Y:1", "Y_over_Q:1:left", "wheelset_yaw:1", "wheelset_lateral:1"))
save(figure, "03_manchester_or_flexicoil.png", overwrite=True)
