"""Objects with a method `plot`.

Analyses lie below pictures and know none of them.  The package's top hands over the function that
draws any of them (`railsim.plot.plot`), which looks at the type of what it is given.
"""

from base64 import b64encode
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_plotters: list[Callable[..., "Figure"]] = []


def use_plotter(function: Callable[..., "Figure"]) -> Callable[..., "Figure"]:
    """Let `function` draw whatever has a method `plot`; a decorator."""
    _plotters[:] = [function]
    return function


def draw_figure(item: object, path: str | Path | None, overwrite: bool, **options: Any) -> "Figure":
    """Draw an object and write what is drawn to `path`; `options`: of its drawing."""
    return _plotters[0](item, path=path, overwrite=overwrite, **options)


def image_tag(figure: "Figure") -> str:
    """Return a figure as a picture within a page."""
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=80)
    return f'<img src="data:image/png;base64,{b64encode(stream.getvalue()).decode()}">'


class Plottable:
    """An object with a `title` and a `table` that can be plotted; a notebook shows all three."""

    @property
    def title(self) -> str:
        """What was analysed, in words."""
        return ""

    def table(self) -> Any:
        """Return the values as a `railsim.table.Table`."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.title}>"

    def _repr_html_(self) -> str:
        table = self.table()
        table.caption = repr(self)[1:-1]
        return f"{table.html()}{image_tag(self.plot())}"

    def plot(
        self, path: str | Path | None = None, *, title: str = "", overwrite: bool = False
    ) -> "Figure":
        """Draw the result, under a title of one's own; also into the file of `path`.

        The suffix of the file tells its kind.  Raises InputError: it exists and may not be
        overwritten, or cannot be written.
        """
        return draw_figure(self, path, overwrite, title=title)
