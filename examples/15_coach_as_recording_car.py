"""The coach as recording car: what does it know of the track?

Accelerometers on the axleboxes and bogie frames of a coach read what the track does to it. A
smoother on the linearised coach turns that round: level and alignment with their intervals, the
wavelengths that were not seen, and the wheel forces that nobody measured. The readings are computed
here, with noise and a bias, so that the truth is known.
"""

import numpy as np
from matplotlib.figure import Figure

import railsim
from railsim.definitions.excitations.recording import band_passed
from railsim.definitions.measurement import MeasurementFile
from railsim.definitions.settings import Settings
from railsim.measurement import Measurement
from railsim.observation import irregularity
from railsim.plot.style import styled
from railsim.track.irregularity import displacement

SPEED, NOISE, BIAS = 40.0, 0.05, 0.02
coach = railsim.load_vehicle("coach_25t")
track = railsim.load_track("straight").replace(
    irregularities=[{"type": "random", "spectrum": "erri_b176_low", "seed": 5}]
)
settings = Settings(output_rate=1000.0, outputs={"sensors": "readings"})
run = railsim.simulate(coach, track, speed=SPEED, settings=settings)

# what the accelerometers say
random = np.random.default_rng(1)
points = [f"axlebox_{w}_{side}" for w in (1, 2, 3, 4) for side in ("left", "right")]
channels, meant = {}, {}
for point in points:
    for axis in "yz":
        truth = run.series("sensor_acceleration", sensor=point, axis=axis)
        channels[f"{point}_{axis}"] = truth + BIAS + random.normal(0.0, NOISE, len(truth))
        meant[f"{point}_{axis}"] = {"quantity": f"sensor_acceleration:{point}:{axis}"}
definition = MeasurementFile(
    format="railsim-measurement/1", name="Coach in service", file="none.csv", rate=1000.0,
    speed=SPEED, channels=meant,
)  # fmt: skip
speed = np.full(len(run["time"]), SPEED)
measured = Measurement(definition, run["time"], run["distance"], speed, channels)

found = irregularity(measured, coach, track)
for note in found.notes:
    print(note)

rails = displacement(track)(found.s)[0]
true = {"level": 0.5 * (rails[1] + rails[3]), "alignment": 0.5 * (rails[0] + rails[2])}
inside = (found.s > 400.0) & (found.s < 700.0)
with styled():
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    for at, (name, number) in zip(axes, (("level", 1), ("alignment", 0)), strict=False):
        known = 1e3 * band_passed(true[name][None], 0.25, (3.0, 25.0))[0]
        value = 1e3 * found.bands["D1"][number]
        wide = 1.96e3 * found.band_deviations["D1"][number]
        at.fill_between(found.s[inside], (value - wide)[inside], (value + wide)[inside], alpha=0.3)
        at.plot(found.s[inside], value[inside], label="from accelerations, 95 %")
        at.plot(found.s[inside], known[inside], "k--", lw=0.8, label="track")
        at.set_ylabel(f"{name} D1 (mm)")
        print(f"{name}: rms error {np.std((value - known)[inside]):.2f} mm")
    Q = 1e-3 * run["Q"][:, 0, 0]
    axes[2].plot(found.s[inside], 1e-3 * found.force("Q.1.left")[inside], label="smoother")
    axes[2].plot(run["distance"], Q, "k--", lw=0.8, label="run")
    axes[2].set(xlabel="s (m)", ylabel="Q of wheel 1 left (kN)", xlim=(400.0, 700.0))
    for at in axes:
        at.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    figure.savefig("15_coach_as_recording_car.png")
