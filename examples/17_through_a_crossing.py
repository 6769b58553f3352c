"""How does a wheel pass a crossing?

The wheel leaves the wing rail, which goes aside and so lets it down, for the nose, which rises
under it. The first picture shows the path of the wheel's centre for several lateral positions, the
second the sections of rail and wheel at the lowest point, the third the force of the leading wheel.
The sections are those of the crossing 56E1-R245-1:9.25 of a public benchmark.
"""

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim.contact.curves import wheel_curve
from railsim.contact.rail_sections import path_heights, rail_parts
from railsim.definitions.section_files import SectionList
from railsim.plot.style import styled

track = railsim.load_track("crossing_56e1_r245_1in9.25")
crossing = track.sections[0]
contours = [np.array([one.y, one.z]) for one in crossing.contours]
places = np.array([one.s for one in crossing.contours])
parts = rail_parts(SectionList(places, tuple(contours), np.zeros((len(contours), 0))))
wheel = wheel_curve(railsim.load_profile("S1002"), 0.46, 0.75)
aside = np.array([-3.0, 0.0, 3.0]) * 1e-3

with styled():
    figure, axes = plt.subplots(3, 1, figsize=(7.0, 7.5), layout="constrained")
    begin, end = crossing.begin - crossing.shift, crossing.end - crossing.shift
    s, heights = path_heights(parts, wheel, 0.46, begin, end, aside)
    for y, height in zip(aside, heights.T, strict=True):
        axes[0].plot(s, 1e3 * height, label=f"y = {1e3 * y:g} mm")
        k = int(np.argmin(height))
        print(f"y = {1e3 * y:4.1f} mm: lowest {1e3 * height[k]:.3f} mm at s = {1e3 * s[k]:.0f} mm")
    axes[0].set(xlabel="s from the theoretical nose (m)", ylabel="path (mm)", xlim=(-0.2, 0.8))
    axes[0].legend()

    at, y = 0.252, 0.0
    for part in parts:
        rail = part.contour(at)
        axes[1].plot(1e3 * rail[0], 1e3 * rail[1], color="k")
    touch = min(
        (np.interp(wheel.y + y, *part.contour(at), left=1, right=1) - wheel.r + 0.46).min()
        for part in parts
    )
    axes[1].plot(1e3 * (wheel.y + y), 1e3 * (wheel.r - 0.46 + touch), color="C0")
    axes[1].set(xlabel="y (mm)", ylabel="z (mm)", xlim=(-75, 75), ylim=(34, -8))
    axes[1].set_title(f"wheel between wing and nose, s = {1e3 * at:g} mm")

    coach = railsim.load_vehicle("coach_manchester")
    settings = railsim.load_settings().with_values({"output_rate": 4000.0})
    for speed in (10.0, 25.0):
        run = railsim.simulate(coach, track, speed=speed, start=38.0, until=40.5, settings=settings)
        Q = 1e-3 * run["Q"][:, 0, 1]
        where = run["wheelset_distance"][:, 0] - crossing.shift
        axes[2].plot(where, Q, label=f"{speed:g} m/s")
        print(f"{speed:g} m/s: largest Q {Q.max():.0f} kN, static {Q[0]:.0f} kN")
    axes[2].set(xlabel="s (m)", ylabel="Q, leading right wheel (kN)", xlim=(-0.2, 0.8))
    axes[2].legend()
    figure.savefig("17_through_a_crossing.png")
