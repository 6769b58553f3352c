"""How does this coach run through that curve?

A vehicle, a track and a speed make a run. Its largest values come as a table with wheelset, time
and distance; the picture shows wheel loads, lateral forces, derailment quotients and the position
of the wheelsets over the distance, with transitions and curve shaded.
"""

import railsim

coach = railsim.load_vehicle("coach_manchester")
track = railsim.load_track("curve_r250")
result = railsim.simulate(coach, track, speed=20.0, until=600.0)

for peak in railsim.peaks(result):
    quantity = peak.quantity
    labels = peak.labels.get("wheelset", ""), peak.labels.get("side", "")
    print(f"{quantity.words:45} {quantity.text(peak.value):>9} at {peak.distance:5.1f} m", *labels)

figure = result.plot(path="01_first_run.png", overwrite=True)
