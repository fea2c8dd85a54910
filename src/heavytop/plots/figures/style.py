"""What all figures share: colours, marks, the part of a run that is drawn, and saving.

Colours are those of Okabe and Ito, and every kind of event has its own marker, so that nothing
rests on telling colours apart.
"""

from __future__ import annotations

import os
import re
import warnings
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from heavytop.files import write_whole
from heavytop.scene.arguments import path_of

if TYPE_CHECKING:
    from heavytop.integration.outputs import Sample
    from heavytop.run.trajectory import Trajectory

Array = NDArray[np.float64]

MOST_PERIODS: Final = 12  # more would only blacken the paper
POINTS: Final = 4001
PATH: Final = "#0072B2"
OTHER: Final = "#D55E00"
FAINT: Final = "#BBBBBB"


class Mark(NamedTuple):
    """How one kind of event is drawn."""

    label: str
    marker: str
    colour: str


MARKS: Final = {
    "theta_min": Mark("turning point, axis highest", "^", "#009E73"),
    "theta_max": Mark("turning point, axis lowest", "v", "#D55E00"),
    "reversal": Mark("reversal of precession", "o", "#CC79A7"),
    "cusp": Mark("cusp", "D", "#000000"),
}

STYLE: Final[Any] = {
    "svg.hashsalt": "heavytop",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.formatter.useoffset": False,
    "text.usetex": False,
}
# No date and no program version: the file depends on the trajectory alone.
_METADATA: Final[dict[str, dict[str, Any]]] = {
    "svg": {"Date": None, "Creator": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


MOST_LETTERS: Final = 90  # of a text that somebody else wrote
_NO_LETTER: Final = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # in XML 1.0


def literal(text: str, most: int = MOST_LETTERS) -> str:
    r"""A text that somebody else wrote, as it is drawn: one line, no formula, and never hidden.

    Examples
    --------
    >>> print(literal("$x$ \n of _gone"), literal("_gone") + ".", literal(""))
    \$x\$ of _gone  _gone. –
    """
    words = _NO_LETTER.sub("\ufffd", " ".join(text.split())) or "–"
    words = words if len(words) <= most else f"{words[: most - 1]}…"
    words = words.replace("$", r"\$")
    return f" {words}" if words.startswith("_") else words  # which a legend would leave out


@lru_cache(maxsize=1)  # of a run of many digits, each figure would take it for itself
def path(trajectory: Trajectory) -> tuple[Sample, float]:
    """The motion at the times drawn, and the last of them [s]."""
    last = last_shown(trajectory)
    return trajectory(np.linspace(0.0, last, POINTS)), last


def last_shown(trajectory: Trajectory) -> float:
    """The last of the times drawn [s]."""
    end = float(trajectory.orbit.end)
    lowest = [t for kind, t in _timed(trajectory) if kind == "theta_max"]
    if lowest:
        return float(lowest[MOST_PERIODS]) if len(lowest) > MOST_PERIODS else end
    period = float(trajectory.motion.period or np.inf)  # events were not wanted
    return float(np.copysign(min(abs(end), MOST_PERIODS * period), end))


def _timed(trajectory: Trajectory) -> zip[tuple[str, float]]:
    return zip(trajectory.events.kind, trajectory.events.t, strict=True)


def mark_events(ax: Axes, trajectory: Trajectory, shown: float, places: Array) -> None:
    """Mark the events up to the time `shown` at the given places, shape (k, 2)."""
    kinds = np.asarray(trajectory.events.kind, dtype=object)
    drawn = np.abs(np.asarray(trajectory.events.t)) <= abs(shown)
    for kind, mark in MARKS.items():
        here = places[drawn & (kinds == kind)]
        if len(here):
            ax.plot(
                here[:, 0],
                here[:, 1],
                mark.marker,
                label=mark.label,
                color=mark.colour,
                markersize=5,
                markerfacecolor="white",
                linestyle="none",
                zorder=3,
            )


def part_shown(trajectory: Trajectory, shown: float) -> str:
    """Say which part of the run is drawn."""
    end = float(trajectory.orbit.end)
    if shown == end:
        return f"0 to {end:.6g} s"
    return f"the first {shown:.4g} s of {end:.6g} s"


class _SettledLayout(ConstrainedLayoutEngine):
    """A constrained layout whose places are the same bits each time.

    The last digits that matplotlib's solver finds depend on where its variables lie in memory,
    and the names of the clips in an SVG file depend on those digits.
    """

    def execute(self, fig: Figure) -> None:
        """Lay the figure out, and round the place of every axes to twelve decimals."""
        super().execute(fig)
        for ax in fig.axes:
            taking_part = ax.get_in_layout()
            place = ax.get_position(original=True)
            ax.set_position(Bbox(np.round(place.get_points(), 12)))
            ax.set_in_layout(taking_part)  # which set_position ends


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
    form = place.suffix.removeprefix(".")
    if form not in _METADATA:
        raise ValueError(f"{place.name}: a figure is .svg, .png or .pdf")
    layout = figure.get_layout_engine()
    if isinstance(layout, ConstrainedLayoutEngine):
        figure.set_layout_engine(_SettledLayout(**layout.get()))
    with mpl.rc_context(STYLE), warnings.catch_warnings():
        # A title in a script the font lacks is drawn with boxes; the run is none the worse.
        warnings.filterwarnings("ignore", message="Glyph", category=UserWarning)
        metadata = _METADATA[form]
        write_whole(
            place, lambda part: figure.savefig(part, format=form, dpi=160, metadata=metadata)
        )
