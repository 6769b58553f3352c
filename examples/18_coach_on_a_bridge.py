"""How far does a bridge bend under a coach?

Another program moves the rails: here a simply supported beam by its first three modes. The run is
taken step by step. The rails move to where the beam is foreseen at the end of the step, the beam
gets the wheel forces that they meet there, and the rails its deflection. Without the coach's
dynamics the deflection is the sum of closed forms of moving forces (Frýba 1999, Vibration of solids
and structures under moving loads). A train of such coaches meets resonance where each arrives a
whole number of the bridge's periods after the one before.
"""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np

import railsim
from railsim.plot.style import styled


@dataclass
class Bridge:
    """Simply supported beam: modes sin(k pi x/L), of frequency (k pi/L)^2 sqrt(EI/m)."""

    begin: float = 60.0  # m along the track
    span: float = 30.0  # m
    mass: float = 12e3  # kg/m
    stiffness: float = 60e9  # N m2
    modes: int = 3

    def __post_init__(self):
        self.wave = np.arange(1, self.modes + 1) * np.pi / self.span
        self.omega = self.wave**2 * np.sqrt(self.stiffness / self.mass)
        self.q, self.rate = np.zeros(self.modes), np.zeros(self.modes)

    def step(self, positions, forces, dt):
        """Exact step of the modes under forces that hold over it."""
        x = np.asarray(positions) - self.begin
        on = (x > 0.0) & (x < self.span)
        load = forces[on] @ np.sin(np.outer(x[on], self.wave))
        rest = 2.0 * load / (self.mass * self.span) / self.omega**2
        c, s, away = np.cos(self.omega * dt), np.sin(self.omega * dt), self.q - rest
        self.q = rest + c * away + s * self.rate / self.omega
        self.rate = c * self.rate - s * away * self.omega

    def deflection(self, positions, speed=0.0):
        """Deflection under points, and its rate of change under points that move."""
        x = np.asarray(positions) - self.begin
        shape = np.sin(np.outer(x, self.wave)) * ((x > 0.0) & (x < self.span))[:, None]
        slope = np.cos(np.outer(x, self.wave)) * ((x > 0.0) & (x < self.span))[:, None]
        return shape @ self.q, shape @ self.rate + speed * (slope * self.wave) @ self.q


def moving_forces(bridge, forces, arrivals, speed, time):
    """Deflection at midspan under constant forces that arrive one after the other (closed form)."""
    total = np.zeros(len(time))
    for force, arrival in zip(forces, arrivals, strict=True):
        t = np.asarray(time) - arrival
        leaves = bridge.span / speed
        for k, (omega, wave) in enumerate(zip(bridge.omega, bridge.wave, strict=True), start=1):
            drive = wave * speed
            scale = 2.0 * force / (bridge.mass * bridge.span) / (omega**2 - drive**2)

            def on(t, scale=scale, drive=drive, omega=omega):
                return scale * (np.sin(drive * t) - drive / omega * np.sin(omega * t))

            end = on(leaves)
            end_rate = scale * drive * (np.cos(drive * leaves) - np.cos(omega * leaves))
            after = omega * (t - leaves)
            free = end * np.cos(after) + end_rate / omega * np.sin(after)
            q = np.where(t < 0.0, 0.0, np.where(t < leaves, on(t), free))
            total += q * np.sin(k * np.pi / 2.0)
    return total


def coach_over(bridge, speed, start=0.0, until=150.0):
    """Run a coach over the bridge: time and deflection at midspan, arrivals and wheelset loads."""
    vehicle = railsim.load_vehicle("coach_manchester")
    track = railsim.load_track("straight").with_values({"support": {"preset": "rigid"}})
    settings = railsim.Settings(step=5e-4)  # short, as the bridge meets the stiff contact itself
    middle, seen = [bridge.begin + 0.5 * bridge.span], []
    with railsim.Simulation(
        vehicle, track, speed=speed, start=start, until=until, settings=settings, record=False
    ) as run:
        positions, loads = run.read("wheelset_distance"), run.read("Q").sum(axis=1)
        arrivals, before = (bridge.begin - positions) / speed, loads
        motion = np.zeros((2, len(loads), 2, 2))
        while run.step():
            dt, positions = run.step_length, run.read("wheelset_distance")
            down, rate = bridge.deflection(positions - speed * dt, speed)
            motion[0, :, :, 1], motion[1, :, :, 1] = (down + rate * dt)[:, None], rate[:, None]
            run.set_rails(*motion)  # foreseen, for the forces at the end of the step
            forces = run.read("Q").sum(axis=1)
            bridge.step(positions, 0.5 * (before + forces), dt)
            down, rate = bridge.deflection(positions, speed)
            motion[0, :, :, 1], motion[1, :, :, 1] = down[:, None], rate[:, None]
            run.set_rails(*motion)
            before = forces
            seen.append((run.time, bridge.deflection(middle)[0][0]))
    return np.array(seen), arrivals, loads


speed = 40.0
seen, arrivals, loads = coach_over(Bridge(), speed)
time, coupled = seen[:, 0], seen[:, 1]
closed = moving_forces(Bridge(), loads, arrivals, speed, time)
print(f"moving forces {1e3 * closed.max():.3f} mm, coupled {1e3 * coupled.max():.3f} mm")

# ten coaches of 26.4 m, one closed form for each wheelset
speeds = np.linspace(30.0, 120.0, 181)
largest = []
for v in speeds:
    bridge, coaches = Bridge(), 26.4 * np.arange(10)[:, None] / v
    times = ((arrivals * speed / v) + coaches).ravel()
    instants = np.linspace(times.min(), times.max() + bridge.span / v, 2000)
    largest.append(moving_forces(bridge, np.tile(loads, 10), times, v, instants).max())
resonance = Bridge().omega[0] / (2.0 * np.pi) * 26.4
print(f"resonance at {resonance:.1f} m/s, largest there at {speeds[np.argmax(largest)]:.1f} m/s")

with styled():
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
    left.plot(time, 1e3 * closed, label="moving forces, closed form")
    left.plot(time, 1e3 * coupled, "--", label="coach and bridge coupled")
    left.set(xlabel="time (s)", ylabel="deflection at midspan (mm)")
    right.plot(speeds, 1e3 * np.array(largest))
    right.axvline(resonance, ls=":", color="0.4", label="frequency x length of coach")
    right.set(xlabel="speed (m/s)", ylabel="largest of ten coaches (mm)", ylim=(0.0, None))
    left.legend()
    right.legend()
    figure.savefig("18_coach_on_a_bridge.png")
