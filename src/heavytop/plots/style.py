"""The parts that all figures share: styles of kinds and events, lines, titles, legends, saving."""

from __future__ import annotations

import os
import warnings
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from typing import Any, Final, NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.cbook import normalize_kwargs
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from heavytop.files import write_atomic
from heavytop.scene.arguments import path_of
from heavytop.text import cut, printable

Known = Mapping[str, Any]  # a document, or a part of one

# Okabe and Ito's colours, which the colour-blind tell apart.
COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
BLUE, ORANGE, GREEN, PURPLE, YELLOW, SKY, BLACK = COLOURS
FAINT: Final = "#BBBBBB"
MARKERS: Final = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*", "p")
PATH, OTHER = BLUE, ORANGE


def look_of(number: int) -> dict[str, Any]:
    """The colour and the marker of one of many methods; no two of 77 are alike."""
    return {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)]}


class Look(NamedTuple):
    """How a kind of motion or of event is drawn in every figure.

    Attributes
    ----------
    label, colour : str
    marker : str or tuple
        Of an event its marker, of a kind the line style of its boundary.
    """

    label: str
    colour: str
    marker: Any = "-"


KIND_STYLES: Final = {
    "at-rest": Look("at rest", "#FFFFFF"),
    "force-free": Look("force-free", "#DDCC77"),
    "sleeping": Look("sleeping", "#B87A00"),
    "hanging": Look("hanging", "#999933"),
    "planar-pendulum": Look("planar pendulum", "#B8E0F5"),
    "separatrix": Look("separatrix", "#882255", (0, (3, 1, 1, 1, 1, 1))),
    "through-top": Look("through the top", ORANGE, (0, (5, 2))),
    "through-bottom": Look("through the bottom", PURPLE, (0, (5, 2, 1, 2))),
    "uniform-precession": Look("steady precession", GREEN, (0, (1, 1.5))),
    "loops": Look("loops", "#5AA9D6"),
    "cusps": Look("cusps", BLACK),
    "waves": Look("waves", "#F8EFA4"),
    "undecided": Look("undecided", "#FF00FF"),
    "impossible": Look("impossible", "#B9B9B9"),
}


# Every kind of event has its own marker, so that nothing rests on telling colours apart.
EVENT_STYLES: Final = {
    "theta_min": Look("turning point, axis highest", GREEN, "^"),
    "theta_max": Look("turning point, axis lowest", ORANGE, "v"),
    "reversal": Look("reversal of precession", PURPLE, "o"),
    "cusp": Look("cusp", BLACK, "D"),
}

STYLE: Final[Any] = {
    "svg.hashsalt": "heavytop",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.formatter.useoffset": False,
    "legend.frameon": False,
    "text.usetex": False,
}
# The metadata of each format that would hold the date and the version of matplotlib.
_UNDATED: Final[dict[str, dict[str, Any]]] = {
    "svg": dict.fromkeys(("Date", "Creator")),
    "png": dict.fromkeys(("Software",)),
    "pdf": dict.fromkeys(("CreationDate", "Creator", "Producer")),
}

DPI: Final = 160  # of what is no vector graphic
MOST_LETTERS: Final = 90  # of a text that somebody else wrote


def literal(text: str, most: int = MOST_LETTERS) -> str:
    r"""A text of a user for drawing: on one line, without formulas, and never hidden by a legend.

    Examples
    --------
    >>> print(literal("$x$ \n of _gone"), literal("_gone") + ".", literal(""))
    \$x\$ of _gone  _gone. –
    """
    words = cut(printable(" ".join(text.split())) or "–", most).replace("$", r"\$")
    return f" {words}" if words.startswith("_") else words  # which a legend would leave out


def title_of(scene: Any) -> str:
    """The title of a scene, or its name where it has none."""
    return literal(scene.title or scene.name, 80)


def legend(figure: Any, columns: int = 4, **looks: Any) -> None:
    """Draw one legend below a figure, with each label of its panels once."""
    each = (zip(*ax.get_legend_handles_labels(), strict=True) for ax in figure.axes)
    known = {label: handle for panel in each for handle, label in panel}
    if known:
        place: Any = {"loc": "outside lower center", "ncols": columns}
        figure.legend(known.values(), known.keys(), **place | looks)


def fill(figure: Figure, draw: Callable[[Axes], Axes]) -> Axes:
    """Draw one picture in a figure, with its legend and the scale of its colours."""
    ax = draw(figure.subplots())
    legend(figure, 3, fontsize=8)
    if ax.images:
        figure.colorbar(ax.images[0], ax=ax, fraction=0.04, aspect=40)
    return ax


@contextmanager
def sheet(
    title: str, size: tuple[float, float], columns: int = 4, /, **grid: Any
) -> Iterator[tuple[Figure, Any]]:
    """Yield a figure and its axes, shape (rows, columns); add title and legend at the end."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        yield figure, figure.subplots(squeeze=False, **grid)
        figure.suptitle(title)
        legend(figure, columns)


def line_style(ours: dict[str, Any], looks: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keywords of a line: ours, replaced by those of a user, without abbreviations.

    Examples
    --------
    >>> line_style({"color": "red", "lw": 1.0}, {"linewidth": 3})
    {'color': 'red', 'linewidth': 3}
    """
    return normalize_kwargs(ours, Line2D) | normalize_kwargs(dict(looks), Line2D)


def line(ax: Axes, x: Any, y: Any, looks: Mapping[str, Any], **ours: Any) -> Line2D:
    """Draw a line; the keywords of a user replace ours."""
    [drawn] = ax.plot(x, y, **line_style(ours, looks))
    return drawn


def label_axes(ax: Axes, xlabel: str, ylabel: str) -> Axes:
    """Label both axes, and draw faint lines at their ticks."""
    ax.set(xlabel=xlabel, ylabel=ylabel)
    ax.grid(True, which="major", lw=0.3, color=FAINT)
    return ax


def new_label(ax: Axes, label: str) -> str:
    """A label, if nothing on the axes has it yet; else "_", which a legend leaves out."""
    return label if label not in ax.get_legend_handles_labels()[1] else "_"


def add_title(ax: Axes, words: str, **where: Any) -> Axes:
    """Give axes a title, unless they have one."""
    if not ax.get_title(**where):
        ax.set_title(words, fontsize="medium", pad=4, **where)
    return ax


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure whole; the name ends in ``.svg``, ``.png`` or ``.pdf``.

    Raises
    ------
    ValueError
        For any other ending.
    OSError
        The file cannot be written.
    """
    place = path_of("path", path)
    form = place.suffix.lower().removeprefix(".")
    if form not in _UNDATED:
        raise ValueError(f"{place.name}: a figure is .svg, .png or .pdf")
    data = _render(figure, form)
    write_atomic(place, lambda part: part.write_bytes(data))


def svg_address(figure: Figure) -> str:
    """A figure as a data address of an image, in which no script runs and identifiers are local.

    Its texts are in the font of the reader.
    """
    data = _render(figure, "svg", **{"svg.fonttype": "none"})
    return f"data:image/svg+xml;base64,{b64encode(data).decode()}"


def _render(figure: Figure, form: str, **style: str) -> bytes:
    """A figure in a format, the same bytes at any time."""
    data = BytesIO()
    with mpl.rc_context(STYLE | style), warnings.catch_warnings():
        # A title in a script that the font lacks is drawn with boxes; that is no reason to warn.
        warnings.filterwarnings("ignore", message="Glyph", category=UserWarning)
        usual = figure.dpi
        figure.dpi = DPI
        canvas: Any = get_registered_canvas_class(form)(figure)  # savefig would draw all twice
        getattr(canvas, f"print_{form}")(data, metadata=_UNDATED[form])
        figure.dpi = usual
    return data.getvalue()
