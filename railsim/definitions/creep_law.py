"""The creep laws: what settings, plots, texts and the time loop know of each."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal


@dataclass(frozen=True)
class CreepLaw:
    """What is known of a creep law."""

    number: int  # in `railsim.kernels.creep`
    label: str  # in texts and pictures
    colour: int  # in pictures, an index of `railsim.plot.style.DISTINCT`
    meaning: str  # what it is, in one line
    grid: bool = False  # whether it divides the patch into cells, `settings.fastsim_grid`
    # of semi-axes: 1/ratio <= a/b <= ratio; beyond it the nearest is taken, and the patch is
    # counted
    ratio: float = 24.0
    measured: bool = False  # whether it needs a curve of the user's own, `settings.adhesion_curve`


CREEP_LAWS: dict[str, CreepLaw] = {
    "fastsim": CreepLaw(
        0, "FASTSIM", 0, "Kalker's simplified theory (1982), the usual compromise", grid=True
    ),
    "table": CreepLaw(1, "table", 1, "Kalker's full half-space theory, tabulated", ratio=20.0),
    "fastrip": CreepLaw(
        2,
        "FaStrip",
        2,
        "strip theory joined to FASTSIM, after Sichani and others (2016)",
        grid=True,
    ),
    "polach": CreepLaw(
        3, "Polach", 3, "Polach's closed formula, with falling friction the choice for traction"
    ),
    "linear": CreepLaw(
        4, "linear", 6, "Kalker's linear theory, saturated after Shen, Hedrick and Elkins"
    ),
    "adhesion_curve": CreepLaw(
        5, "adhesion curve", 4, "a measured curve T/(mu N) over creepage", measured=True
    ),
}
"""Every creep law by its name in a settings file."""

if TYPE_CHECKING:
    CreepLawName = str
else:
    CreepLawName = Literal[tuple(CREEP_LAWS)]
