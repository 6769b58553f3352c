"""How does a wheel pass a crossing?

The wheel leaves the wing rail, which goes aside and so lets it down, for the nose, which rises
under it. The first picture shows the path of the wheel for several lateral positions, with the dip
angle of both slopes; the next how wing and nose share the forces of a wheel in a run; then
the largest force over speed on two supports. Below, sections of rail and wheel meet in a run on
rigid rails; `17_through_a_crossing.gif` has the same as an animation. The sections are those of the
crossing 56E1-R245-1:9.25 of a public benchmark.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter

import railsim
from railsim.contact.curves import wheel_curve
from railsim.contact.rail_sections import kinematic_height, rail_parts, rigid_gaps
from railsim.definitions.section_files import SectionList
from railsim.plot.style import styled

track = railsim.load_track("crossing_56e1_r245_1in9.25")
crossing = track.sections[0]
contours = [np.array([one.y, one.z]) for one in crossing.contours]
places = np.array([one.s for one in crossing.contours])
parts = rail_parts(SectionList(places, tuple(contours)))
wheel = wheel_curve(railsim.load_profile("S1002"), 0.46, 0.75)
aside = np.array([-3.0, 0.0, 3.0]) * 1e-3
settings = railsim.load_settings().with_values(
    {"output_rate": 10e3, "outputs.contact_patches": True}
)


def passage(vehicle, speed, support="co-running"):
    """Run in which the leading wheel passes the nose."""
    lead = {"coach_manchester": 10.8, "wagon_y25": 8.0}[vehicle]
    return railsim.simulate(
        railsim.load_vehicle(vehicle),
        track.replace(support={"preset": support}),
        speed=speed,
        start=48.6 - lead,
        until=51.0 - lead,
        settings=settings,
    )


def shares(run, side=1):
    """Q and Y of the leading wheel on wing and nose (kN)."""
    N, angle, T_y = (run[f"patch_{name}"][:, 0, side] for name in ("N", "angle", "T_y"))
    Q, Y = N * np.cos(angle) - T_y * np.sin(angle), T_y * np.cos(angle) + N * np.sin(angle)
    return [1e-3 * force.reshape(-1, 2, 3).sum(axis=2) for force in (Q, Y)]


def place(run):
    """Place of the leading wheel (m from the nose)."""
    return run["wheelset_distance"][:, 0] - crossing.shift


film = passage("coach_manchester", 20.0, "rigid")
film_s, film_y, film_z = place(film), film["wheelset_lateral"][:, 0], film.body_position[:, :, 2]
film_z = film_z[:, film.bodies.index(film.wheelsets[0])]
shown = np.flatnonzero((film_s > 0.1) & (film_s < 0.45))
# the rails stand 1.435 m apart, those of the list 1.430 m
beside = film_y - 2.5e-3
level = kinematic_height(parts, film_s[shown[0]], (wheel.y, wheel.r), 0.46, beside[shown[0]])[0]


def meet(axes, k):
    """Draw the sections of rails and wheel at one instant of the run."""
    axes.clear()
    for part in parts:
        if part.positions[0] <= film_s[k] <= part.positions[-1]:
            axes.plot(*(1e3 * part.contour(film_s[k])), color="k")
    z = wheel.r - 0.46 + level + film_z[k] - film_z[shown[0]]
    axes.plot(1e3 * (wheel.y + beside[k]), 1e3 * z, color="C0")
    axes.set(xlim=(-75, 75), ylim=(34, -8), title=f"s = {1e3 * film_s[k]:.0f} mm")
    axes.set(xlabel="y (mm)", ylabel="z (mm)")


with styled():
    figure = plt.figure(figsize=(7.0, 11.0), layout="constrained")
    rows = figure.add_gridspec(5, 4, height_ratios=[1.0, 1.0, 1.0, 1.0, 0.8])
    path, on_Q, on_Y, over = (figure.add_subplot(rows[k, :]) for k in range(4))
    s = np.arange(-0.2, 0.8, 2e-3)
    gaps = [rigid_gaps(part, s, 0.46, [(wheel.y, wheel.r)], aside)[:, 0] for part in parts]
    for y, low in zip(aside, np.min(gaps, axis=0).T, strict=True):
        path.plot(s, -1e3 * low, label=f"y = {1e3 * y:g} mm")
        k, slope = int(np.argmax(low)), np.gradient(low, s)
        dip = 1e3 * (slope[k - 20 : k - 2].mean() - slope[k + 3 : k + 21].mean())
        print(f"y = {1e3 * y:4.1f} mm: lowest at s = {1e3 * s[k]:.0f} mm, dip {dip:.1f} mrad")
    path.set(xlabel="s from the theoretical nose (m)", ylabel="path (mm)")
    path.legend()

    for k, speed in enumerate((10.0, 25.0)):
        run = passage("coach_manchester", speed)
        s = place(run)
        for axes, forces in zip((on_Q, on_Y), shares(run), strict=True):
            for rail, name, line in ((0, "wing", "--"), (1, "nose", "-")):
                on = (s < 0.5) & (forces[:, rail] != 0.0)
                axes.plot(s[on], forces[on, rail], f"C{k}{line}", label=f"{name}, {speed:g} m/s")
    on_Q.set(ylabel="Q (kN)", xlim=(-0.2, 0.5))
    on_Y.set(xlabel="s (m)", ylabel="Y (kN)", xlim=(-0.2, 0.5))
    on_Q.legend(ncols=2)

    speeds = {"coach_manchester": (10, 15, 20, 25, 30, 35), "wagon_y25": (10, 15, 20, 25)}
    for k, (vehicle, tried) in enumerate(speeds.items()):
        for support, line in (("co-running", "o-"), ("p2", "s--")):
            runs = [passage(vehicle, float(speed), support) for speed in tried]
            Q = [1e-3 * run.groups["peaks"]["Q"][0, 0, 1] for run in runs]  # over all steps
            over.plot(tried, Q, f"C{k}{line}", label=f"{vehicle}, {support}")
            print(f"{vehicle}, {support}: largest Q {', '.join(f'{q:.0f}' for q in Q)} kN")
    over.set(xlabel="speed (m/s)", ylabel="largest Q on the nose (kN)")
    over.legend()

    for k, at in enumerate((0.15, 0.23, 0.26, 0.35)):
        meet(figure.add_subplot(rows[4, k]), int(np.argmin(np.abs(film_s - at))))
    figure.savefig("17_through_a_crossing.png")

    moving, axes = plt.subplots(figsize=(4.8, 2.2), layout="constrained")
    animation = FuncAnimation(moving, lambda k: meet(axes, k), shown[::2], interval=100)
    animation.save("17_through_a_crossing.gif", PillowWriter(10))

# the diverging route, mirrored: the crossing is the left rail
diverging = railsim.load_track("crossing_56e1_r245_1in9.25_diverging")
for support in ("co-running", "p2"):
    run = railsim.simulate(
        railsim.load_vehicle("coach_manchester"),
        diverging.replace(support={"preset": support}),
        speed=11.0,
        until=100.0,
        settings=settings,
    )
    Q, N = 1e-3 * run.groups["peaks"]["Q"][0, 0, 0], 1e-3 * run["check_rail_force"].max()
    print(f"diverging route, 11 m/s, {support}: largest Q {Q:.0f} kN, check rail {N:.0f} kN")
