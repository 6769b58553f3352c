"""Pictures of results and tracks.

=================  ==========================================================================
`style.py`         what all pictures share: colours, fonts, the shading of curves
`selection.py`     which quantities and labels to draw: ``Q``, ``Y:1:left``
`histories.py`     quantities over time or distance
`overlay.py`       the same quantities of several results in one picture
`track.py`         a track: plan, curvature and cant
`vehicle.py`       a vehicle: side, top and front view with its elements
=================  ==========================================================================

Every function returns a `matplotlib.figure.Figure` that is not shown anywhere; `save` writes it.
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES = {
    "Assessment": ("assessment", "single_figure"), "Curving": ("curving", "curving_figure"),
    "CriticalSpeed": ("stability", "bifurcation_figure"),
    "Modes": ("modes", "modes_figure"), "Result": ("histories", "histories"),
    "RootLocus": ("modes", "locus_figure"), "Track": ("track", "track_figure"),
    "Vehicle": ("vehicle", "vehicle_figure"),
}  # fmt: skip
"""Module and function that draws each type; a module is imported when it is needed."""


def plot(
    thing: object, *, path: str | Path | None = None, overwrite: bool = False, **how: Any
) -> "Figure":
    """Draw a vehicle, a track, a result or the result of an analysis: what has a method `plot`.

    `path`: Where the picture is written too; the suffix tells its kind. `overwrite`: Whether a file
    may be replaced. `**how`: Options of the function in `FIGURES`. Raises InputError: the file
    exists or cannot be written. Raises TypeError: nothing draws it.
    """
    names = [kind.__name__ for kind in type(thing).__mro__ if kind.__name__ in FIGURES]
    if not names:
        raise TypeError(f"a {type(thing).__name__} cannot be plotted; {', '.join(FIGURES)} can")
    module, function = FIGURES[names[0]]
    figure: Figure = getattr(import_module(f"{__name__}.{module}"), function)(thing, **how)
    if path is not None:
        from railsim.plot.style import save

        save(figure, Path(path), overwrite=overwrite)
    return figure
