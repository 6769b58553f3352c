"""What all pictures share: fonts, colours, the shading of curves, and saving.

Colours can be distinguished by colour-blind readers too (Okabe and Ito, "Color universal design",
2008): a bogie has a hue, its leading wheelset the dark shade, the left side a solid and the right
side a dashed line.  A bogie has a marker, too, for print in black and white.
"""

import warnings
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation

from railsim.arrays import Floats
from railsim.definitions.track.elements import Section
from railsim.files.access import PICTURES, check_file, whole_file
from railsim.text import unformatted

STYLE: Any = {
    "axes.axisbelow": True, "axes.edgecolor": "0.35", "axes.grid": True, "axes.labelsize": 9,
    "axes.linewidth": 0.7, "axes.spines.right": False, "axes.spines.top": False,
    "axes.titlelocation": "left", "axes.titlesize": 9.5, "figure.dpi": 150,
    "figure.titlesize": 11.5, "figure.titleweight": "bold", "font.size": 9, "grid.color": "0.88",
    "grid.linewidth": 0.6, "legend.fontsize": 8.5, "legend.frameon": False, "lines.linewidth": 1.2,
    "mathtext.fontset": "dejavusans", "xtick.labelsize": 8.5, "ytick.labelsize": 8.5,
}  # fmt: skip

HUES = (("#004a80", "#56a8e0"), ("#b8450a", "#f0a13c"), ("#00664b", "#5cc0a0"),
        ("#7d3a68", "#d493bd"), ("#4d4d4d", "#a6a6a6"))  # fmt: skip
"""Dark and light shade of the first, second, ... bogie."""

MARKERS = (".", "o", "^", "s", "D")
"""Of the first, second, ... bogie: two hues of one shade look alike in black and white."""

DISTINCT = ("#004a80", "#d1530b", "#0a8765", "#a0568a", "#3f9bd8", "#d99000", "#555555", "#8c2d19")
"""Colours of things that have no order, such as results that are compared."""

PALER = 0.5  # share of the colour beside white in the second round of `DISTINCT`

SIDE_LINES = {"left": "-", "right": (0, (4.0, 1.6))}
SHADES = {"CLO": "0.95", "CIR": "0.90"}
LETTERS = 10.0  # of a title on an inch
SMALL = 1.3 * LETTERS  # letters of other words on an inch
LETTER = 4.0  # width of a letter of a section's name, in axes not yet laid out [points]

LIMIT = "#b3122b"
HALO = (withStroke(linewidth=2.5, foreground="white"),)  # of words on lines

# coordinates of what stands at the upper edge of axes, of what stands at their sides
ABOVE, BESIDE = ("data", "axes fraction"), ("axes fraction", "data")


def distinct(number: int) -> str:
    """Return the colour of the thing of a number, after the last the first again, but paler."""
    share = PALER ** (number // len(DISTINCT))
    red, green, blue = (1.0 - share * (1.0 - c) for c in to_rgb(DISTINCT[number % len(DISTINCT)]))
    return to_hex((red, green, blue))


class Picture(Figure):
    """A figure that a notebook displays, without pyplot; width and height in inches."""

    def __init__(
        self, width: float, height: float, title: str = "", edges: Sequence[Any] = (), **how: Any
    ) -> None:
        """`edges`: Left, bottom, right, top, space across and down, in place of what fits."""
        layout = None if edges else "constrained"
        super().__init__(figsize=(width, height), **{"layout": layout} | how)
        if edges:
            self.subplots_adjust(*edges)
        if title:
            lines = [fill(line, int(LETTERS * width)) for line in title.splitlines()]
            self.suptitle("\n".join(lines), x=0.012, ha="left")

    def _repr_png_(self) -> bytes:
        return to_bytes(self)


def single(
    width: float, height: float, title: str = "", edges: Sequence[Any] = ()
) -> tuple[Picture, Axes]:
    """Return a figure with one pair of axes, and these."""
    figure = Picture(width, height, title, edges)
    return figure, figure.subplots()


@contextmanager
def styled(changes: Any = None) -> Iterator[None]:
    """Use the style of railsim's pictures within the block, with `changes`."""
    with matplotlib.rc_context(STYLE | (changes or {})):
        yield


def wheelset_looks(names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return a colour and a marker for every wheelset: a hue for each bogie, from dark to light.

    Wheelsets belong together when the first parts of their dotted names agree.
    """
    bogies: dict[str, list[str]] = {}
    for name in names:
        bogies.setdefault(name.split(".")[0], []).append(name)
    looks: dict[str, dict[str, Any]] = {}
    for i, members in enumerate(bogies.values()):
        alone = len(bogies) == len(names)
        dark, light = map(to_rgb, (distinct(i),) * 2 if alone else HUES[i % len(HUES)])
        for name, colour in zip(members, np.linspace(dark, light, len(members)), strict=True):
            looks[name] = {"color": tuple(colour), "marker": MARKERS[i % len(MARKERS)]}
    return looks


class Span(NamedTuple):
    """A section of the track on the axis of a picture, in the axis's unit."""

    section: Section
    low: float
    high: float


def spans(sections: Sequence[Section], distance: Floats, axis: Floats) -> list[Span]:
    """Return the transitions and curves that a run passed, on the axis of a picture.

    `sections`: Elements of the plan. `distance` (shape (time,)): Distance of the reference body,
    increasing [m]. `axis` (shape (time,)): What the picture shows horizontally: the distance
    itself, or time.
    """
    found = []
    for section in sections:
        start, end = np.clip([section.begin, section.end], distance[0], distance[-1])
        if section.type in SHADES and start < end:
            low, high = np.interp([start, end], distance, axis)
            found.append(Span(section, float(low), float(high)))
    return found


def shade(axes: Axes, spans: Sequence[Span], *, with_names: bool = False) -> None:
    """Shade transitions and curves; with `with_names`, write what they are above the axes.

    Where there is no room for all names, those of curves come first.
    """
    for section, begin, end in spans:
        axes.axvspan(begin, end, color=SHADES[section.type], lw=0, zorder=0)
    if not with_names or not spans:
        return
    low, high = axes.get_xlim()
    letter = LETTER * (high - low) / (72.0 * axes.bbox.width / axes.figure.dpi)
    names: list[tuple[float, float, str]] = []  # middle, half of the width, words
    for section, begin, end in sorted(spans, key=lambda span: span[0].type):  # CIR before CLO
        words = "CLO" if section.type == "CLO" else f"R {1.0 / section.start_value:.6g}"
        middle, half = 0.5 * (begin + end), 0.5 * letter * len(words)
        if end - begin < (2.0 * half if words == "CLO" else 0.5 * letter):
            continue
        if all(abs(middle - other) >= half + reach for other, reach, _ in names):
            names.append((middle, half, words.replace("-", "−")))
    look: Any = {"fontsize": 6.5, "color": "0.4", "frame": ABOVE}
    for middle, _, words in sorted(names):
        note(axes, words, (middle, 1.0), (0, 2), "center", "bottom", **look)
    axes.set_title(axes.get_title(loc="left"), pad=14.0)


def signed(value: float) -> str:
    """Return a number with a minus sign as on the axes."""
    return f"{value:g}".replace("-", "\N{MINUS SIGN}")


def wrap(text: str, width: float) -> str:
    """Return words without formatting in lines that have room on a width [inches]."""
    return fill(unformatted(text), int(SMALL * width))


def note(
    axes: Axes, text: str, xy: Any, shift: Any, ha: Any = "left", va: Any = "baseline", **how: Any
) -> Annotation:
    """Write words beside a point, shifted by points of print; `frame`: coordinates of the point."""
    look: dict[str, Any] = {"fontsize": 7, "color": "0.3", "frame": "data"} | how
    return axes.annotate(text, xy, shift, look.pop("frame"), "offset points", ha=ha, va=va, **look)


def key(label: str, **look: Any) -> Line2D:
    """Return an entry of a legend."""
    return Line2D([], [], label=label, **look)


def side_keys(sides: Collection[str | None], **look: Any) -> list[Line2D]:
    """Return entries of a legend for the wheels of some sides."""
    return [key(f"{s} wheel", **{"ls": ls} | look) for s, ls in SIDE_LINES.items() if s in sides]


def grid_of(
    count: int, across: int, width: float, height: float, margin: float, title: str = "", **how: Any
) -> tuple[Picture, list[Axes]]:
    """Return a figure with axes in rows, and the axes; `height` of a row, beside a margin."""
    rows = -(-count // across)
    figure = Picture(width, margin + height * rows, title)
    cells = list(figure.subplots(rows, across, squeeze=False, **how).flat)
    for axes in cells[count:]:
        axes.remove()
    return figure, cells[:count]


def label_grid(axes: Any, count: int, across: int, labels: tuple[str, str]) -> None:
    """Label the outer ones of the axes in use, and hide the others."""
    for panel in axes[count:]:
        panel.set_visible(False)
    for panel in axes[max(count - across, 0) : count]:
        panel.set_xlabel(labels[0])
    for panel in axes[::across]:
        panel.set_ylabel(labels[1])


def say(axes: Axes, text: str) -> None:
    """Write in the middle of axes why they are empty."""
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes)
    axes.set(xticks=[], yticks=[])


def save(figure: Figure, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a figure; the ending of the name says the format (.png, .svg, .pdf).

    Raises InputError: the file exists and may not be overwritten, or its ending is none that can be
    drawn. Raises OSError: the disk is full, or the folder is no longer there.
    """
    path = Path(path)
    check_file(path, overwrite=overwrite, endings=PICTURES)
    with whole_file(path) as partial:
        partial.write_bytes(to_bytes(figure, path.suffix[1:].lower()))
    return path


def to_bytes(figure: Figure, form: str = "png", **how: Any) -> bytes:
    """Return the file of a figure in a format of matplotlib's; `how`: of `Figure.savefig`."""
    stream = BytesIO()
    salt: Any = {"svg.hashsalt": "railsim"}  # the same names in each SVG of a figure
    with warnings.catch_warnings(), matplotlib.rc_context(salt):
        # letters that the font lacks are drawn as boxes, and that is seen
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(stream, format=form, **how)
    return stream.getvalue()
