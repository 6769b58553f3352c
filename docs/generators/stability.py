"""Make the pictures of ``docs/user/stability.md``.

Parts: ``modes``, ``critical_speed``, ``hunting_flexicoil``, ``hunting_benchmark``, ``curving``.
Together they take some ten minutes on one core.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from railsim import critical_speed, curving, load_vehicle, root_locus
from railsim.plot.curving import curving_figure
from railsim.plot.modes import locus_figure
from railsim.plot.stability import bifurcation_figure
from railsim.plot.style import save

IMAGES = Path(__file__).parents[1] / "img"
COACH = "coach_manchester"
RADII = (250.0, 300.0, 400.0, 500.0, 700.0, 1000.0, 2000.0, 5000.0)
DEFICIENCIES = (0.0, 0.05, 0.1, 0.15)


def modes_picture() -> Figure:
    """Root locus of the coach, contact harmonic with 3 mm."""
    coach = load_vehicle(COACH)
    locus = root_locus(coach, speeds=np.linspace(10.0, 80.0, 29).tolist(), linearisation="harmonic")
    return locus_figure(locus)


def hunting_picture(name: str) -> Figure:
    """Bifurcation diagram of a vehicle by all methods, on the elastic rails of `straight`."""
    vehicle = load_vehicle(name)
    return bifurcation_figure(
        critical_speed(vehicle, methods=("ramp", "bifurcation", "continuation"))
    )


def curving_picture() -> Figure:
    """Steady curving of the coach over radius, cant deficiency and friction."""
    coach = load_vehicle(COACH)
    found = curving(coach, radius=RADII, cant_deficiency=DEFICIENCIES, friction=(0.2, 0.4))
    return curving_figure(found)


PICTURES: dict[str, Callable[[], Figure]] = {
    "modes": modes_picture,
    "critical_speed": partial(hunting_picture, COACH),
    "hunting_flexicoil": partial(hunting_picture, "coach_flexicoil"),
    "hunting_benchmark": partial(hunting_picture, "benchmark_vehicle1"),
    "curving": curving_picture,
}


PARTS = tuple(PICTURES)


def make(parts: Sequence[str]) -> None:
    """Draw these pictures, by default all."""
    for name in parts or PICTURES:
        save(PICTURES[name](), IMAGES / f"{name}.png", overwrite=True)
