"""Objects with a method `plot`.

Analyses lie below pictures and know none of them.  The package's top hands over the function that
draws any of them (`railsim.plot.plot`), which looks at the type of what it is given.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_plotters: list[Callable[..., "Figure"]] = []


def use_plotter(function: Callable[..., "Figure"]) -> Callable[..., "Figure"]:
    """Let `function` draw whatever has a method `plot`; a decorator."""
    _plotters[:] = [function]
    return function


def picture_of(thing: object, path: str | Path | None, overwrite: bool, **how: Any) -> "Figure":
    """Draw an object and write what is drawn to `path`; `how` are options of its drawing."""
    return _plotters[0](thing, path=path, overwrite=overwrite, **how)


class Plottable:
    """An object that can be plotted."""

    def plot(
        self, path: str | Path | None = None, *, title: str = "", overwrite: bool = False
    ) -> "Figure":
        """Draw the result.

        Parameters
        ----------
        path : str or Path, optional
            Where the picture is written too; the suffix tells its kind.
        title : str
            What was analysed.
        overwrite : bool
            Whether a file may be replaced.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            The file exists or cannot be written.
        """
        return picture_of(self, path, overwrite, title=title)
