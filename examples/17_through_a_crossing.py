"""How does a wheel pass a crossing?

The wheel leaves the wing rail, which goes aside and so lets it down, for the nose, which rises
under it. The first picture shows the path of the wheel for several lateral positions, the second
the sections of rail and wheel at the lowest point, the third how wing and nose share the force of
the leading wheel, the last the largest force over speed. The sections are those of the crossing
56E1-R245-1:9.25 of a public benchmark.
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim.contact.curves import wheel_curve
from railsim.contact.rail_sections import rail_parts, rigid_gaps
from railsim.definitions.section_files import SectionList
from railsim.plot.style import styled

track = railsim.load_track("crossing_56e1_r245_1in9.25")
crossing = track.sections[0]
contours = [np.array([one.y, one.z]) for one in crossing.contours]
places = np.array([one.s for one in crossing.contours])
parts = rail_parts(SectionList(places, tuple(contours), np.zeros((len(contours), 0))))
wheel = wheel_curve(railsim.load_profile("S1002"), 0.46, 0.75)
aside = np.array([-3.0, 0.0, 3.0]) * 1e-3
settings = railsim.load_settings().with_values(
    {"output_rate": 4000.0, "outputs.contact_patches": True}
)


def passage(vehicle, speed):
    """Place of the leading wheel (m from the nose), its Q on wing and nose (kN)."""
    lead = {"coach_manchester": 10.8, "wagon_y25": 8.0}[vehicle]
    run = railsim.simulate(
        railsim.load_vehicle(vehicle),
        track,
        speed=speed,
        start=48.6 - lead,
        until=51.0 - lead,
        settings=settings,
    )
    N, angle, T_y = (run[f"patch_{name}"][:, 0, 1] for name in ("N", "angle", "T_y"))
    force = (N * np.cos(angle) - T_y * np.sin(angle)).reshape(-1, 2, 3).sum(axis=2)
    return run["wheelset_distance"][:, 0] - crossing.shift, 1e-3 * force


with styled():
    figure, axes = plt.subplots(4, 1, figsize=(7.0, 9.5), layout="constrained")
    s = np.arange(-0.2, 0.8, 2e-3)
    gaps = [rigid_gaps(part, s, 0.46, [(wheel.y, wheel.r)], aside)[:, 0] for part in parts]
    for y, low in zip(aside, np.min(gaps, axis=0).T, strict=True):
        axes[0].plot(s, -1e3 * low, label=f"y = {1e3 * y:g} mm")
        k = int(np.argmax(low))
        print(f"y = {1e3 * y:4.1f} mm: lowest at s = {1e3 * s[k]:.0f} mm")
    axes[0].set(xlabel="s from the theoretical nose (m)", ylabel="path (mm)")
    axes[0].legend()

    at = 0.252
    for part in parts:
        rail = part.contour(at)
        axes[1].plot(1e3 * rail[0], 1e3 * rail[1], color="k")
    touch = min(
        (np.interp(wheel.y, *part.contour(at), left=1, right=1) - wheel.r + 0.46).min()
        for part in parts
    )
    axes[1].plot(1e3 * wheel.y, 1e3 * (wheel.r - 0.46 + touch), color="C0")
    axes[1].set(xlabel="y (mm)", ylabel="z (mm)", xlim=(-75, 75), ylim=(34, -8))
    axes[1].set_title(f"wheel between wing and nose, s = {1e3 * at:g} mm")

    for k, speed in enumerate((10.0, 25.0)):
        s, force = passage("coach_manchester", speed)
        on_wing = (s < 0.5) & (force[:, 0] > 0.0)
        on_nose = (s < 0.5) & (force[:, 1] > 0.0)
        axes[2].plot(s[on_wing], force[on_wing, 0], f"C{k}--", label=f"wing, {speed:g} m/s")
        axes[2].plot(s[on_nose], force[on_nose, 1], f"C{k}-", label=f"nose, {speed:g} m/s")
    axes[2].set(xlabel="s (m)", ylabel="Q, leading wheel (kN)", xlim=(-0.2, 0.5))
    axes[2].legend(ncols=2)

    speeds = {"coach_manchester": (10, 15, 20, 25, 30, 35), "wagon_y25": (10, 15, 20, 25)}
    for vehicle, tried in speeds.items():
        largest = []
        for speed in tried:
            s, force = passage(vehicle, float(speed))
            near = np.abs(s - 0.3) < 0.25
            largest.append(force[near].sum(axis=1).max())
        axes[3].plot(tried, largest, "o-", label=vehicle)
        print(f"{vehicle}: largest Q {', '.join(f'{Q:.0f}' for Q in largest)} kN")
    axes[3].set(xlabel="speed (m/s)", ylabel="largest Q on the nose (kN)")
    axes[3].legend()
    figure.savefig("17_through_a_crossing.png")
