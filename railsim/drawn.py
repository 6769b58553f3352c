"""Results with a method `plot`.

Analyses lie below pictures and know none of them: the function that draws a result is named, and
looked up when a picture is requested.
"""

from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def drawn(
    function: str, *arguments: Any, path: str | Path | None, overwrite: bool, **how: Any
) -> "Figure":
    """Call a function of pictures by its name, ``module:name``, and write what it draws to `path`.

    Raises
    ------
    InputError
        The file exists or cannot be written.
    """
    figure: Figure = resolve_name(function)(*arguments, **how)
    if path is not None:
        resolve_name("railsim.plot.style:save")(figure, Path(path), overwrite=overwrite)
    return figure


class Drawn:
    """A result that can be plotted.

    Attributes
    ----------
    FIGURE : str
        Function of result and title that draws it, as ``module:name``.
    """

    FIGURE: ClassVar[str]

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
        return drawn(self.FIGURE, self, title, path=path, overwrite=overwrite)
