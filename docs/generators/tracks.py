"""Fill the tables of `docs/validation/vehicles_and_tracks.md` and draw its picture."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import welch

from generators.filling import fill_page, table
from railsim.definitions.excitations.spectra import SPECTRA
from railsim.definitions.track.definition import Track
from railsim.notation import QUANTITIES
from railsim.plot.style import DISTINCT, save, styled
from railsim.track.irregularity import displacement

DOCS = Path(__file__).parents[1]
PAGE = DOCS / "validation" / "vehicles_and_tracks.md"
sys.path.insert(0, str(DOCS.parent / "tests" / "verification"))
from step_halving import changes, half_as_long, irregular_run  # noqa: E402

CASES = [(60.0, 1000.0), (3.0, 300.0)]  # m/s, m
CHANNELS = {
    "lateral": "alignment",
    "vertical": "longitudinal level",
    "cross_level": "cross level",
    "gauge": "gauge",
}
BAND = (3.0, 70.0)  # m
LENGTH, SPACING, SEEDS = 1000.0, 0.25, 50  # m, m, -; a part of the period of 1400 m


def signed(value):
    """Per cent with two decimals and its sign, without that of zero."""
    return f"{round(value, 2) + 0.0:+.2f}"


def convergence():
    """Change of peaks and root mean squares from the chosen step to half of it."""
    found, heads, times = [], [], []
    for speed, until in CASES:
        full = irregular_run(speed, until)
        exact = irregular_run(speed, until, scheme="rk4")
        found += [changes(full, half_as_long(full)), changes(full, exact)]
        step, short = (1e3 * result.attributes["step"] for result in (full, exact))
        heads.append(f"{speed:g} m/s, {step:.3g} ms against half: peak, rms (%)")
        heads.append(f"against `rk4`, {short:.2g} ms: peak, rms (%)")
        times += [f"{result.attributes['real_time_factor']:.0f}" for result in (full, exact)]
    body = []
    for name in found[0]:
        words = QUANTITIES[name].words.partition(" (")[0]
        words = "acceleration of the car body" if name == "body_acceleration" else words
        cells = [", ".join(signed(100.0 * value) for value in case[name]) for case in found]
        body.append((words, *cells))
    return table(("", *heads), [*body, ("simulated per CPU second", *times)])


def channels(seed):
    """Alignment, level, cross level and gauge of one realisation [m]."""
    track = Track.model_validate(
        {
            "format": "railsim-track/1",
            "name": "t",
            "plan": [{"type": "STR", "length": LENGTH}],
            "irregularities": [
                {
                    "type": "random",
                    "spectrum": "erri_b176_low",
                    "seed": seed,
                    "wavelengths": list(BAND),
                    "fade": 0.0,
                }
            ],
        }
    )
    (y_left, z_left, y_right, z_right), _ = displacement(track)(np.arange(0.0, LENGTH, SPACING))
    return {
        "lateral": 0.5 * (y_left + y_right),
        "vertical": 0.5 * (z_left + z_right),
        "cross_level": (z_right - z_left) / 1.5,
        "gauge": y_right - y_left,
    }


def spectra():
    """Mean spectrum and variance over all seeds by channel, and the wave numbers [rad/m]."""
    total = {name: 0.0 for name in CHANNELS}
    variance = {name: 0.0 for name in CHANNELS}
    for seed in range(SEEDS):
        for name, values in channels(seed).items():
            per_metre, density = welch(values, 1.0 / SPACING, nperseg=4000, detrend=False)
            total[name] = total[name] + density / (2.0 * np.pi) / SEEDS
            variance[name] += np.mean(values**2) / SEEDS
    return 2.0 * np.pi * per_metre, total, variance


def variance_table(variance):
    """Variances against the integrals of the bands."""
    body = []
    for name, words in CHANNELS.items():
        unit = (1e3, "mrad") if name == "cross_level" else (1e3, "mm")
        exact = np.sqrt(SPECTRA["erri_b176_low"].band_variance(name, BAND))
        found = np.sqrt(variance[name])
        body.append(
            (
                f"{words} ({unit[1]})",
                f"{unit[0] * exact:.4f}",
                f"{unit[0] * found:.4f}",
                signed(100.0 * (variance[name] / exact**2 - 1.0)),
            )
        )
    head = (
        "standard deviation",
        "from the spectrum's integral",
        f"mean of {SEEDS} seeds",
        "difference of the variance (%)",
    )
    return table(head, body)


def picture(omega, density):
    """Spectra of the generated track over those asked for."""
    with styled():
        figure, axes = plt.subplots(1, 2, figsize=(8.0, 3.4), layout="constrained", sharex=True)
        exact = np.geomspace(2.0 * np.pi / 90.0, 2.0 * np.pi / 2.5, 300)
        band = (exact >= 2.0 * np.pi / BAND[1]) & (exact <= 2.0 * np.pi / BAND[0])
        for k, (name, words) in enumerate(CHANNELS.items()):
            ax = axes[int(name == "cross_level")]
            wanted = SPECTRA["erri_b176_low"].density(name, exact)
            shown = (omega > exact[0]) & (omega < exact[-1])
            ax.plot(omega[shown], density[name][shown], color=DISTINCT[k], lw=1.6, label=words)
            ax.plot(exact[band], wanted[band], color="black", lw=0.9, ls=(0, (4, 2)))
        for ax, unit in zip(axes, ("m²/(rad/m)", "rad²/(rad/m)"), strict=True):
            ax.set(xscale="log", yscale="log", xlim=(0.06, 3.0))
            ax.set(xlabel="Ω (rad/m)", ylabel=f"S ({unit})")
            ax.legend(loc="lower left")
        axes[0].set_ylim(1e-11, 1e-4)
        axes[1].set_ylim(1e-11, 1e-5)
        figure.suptitle("ERRI B176 low, 3 to 70 m: target (dashed) and generated")
        save(figure, DOCS / "img" / "irregularity_spectra.png", overwrite=True)


PARTS = ("convergence", "variance")


def make(parts):
    """Fill the tables of these names, and draw the picture."""
    omega, density, variance = spectra()
    picture(omega, density)
    fill_page(
        PAGE, {"convergence": convergence, "variance": lambda: variance_table(variance)}, parts
    )
