"""Texts for people: hints at names, printable letters, durations; bases of notebook cells."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LONGEST_NAME: Final = 60  # letters of a name in comparisons and messages
SECONDS_BELOW: Final = 60.0  # shorter times are given in seconds
LONGER: Final = ((31_557_600, "years"), (86_400, "days"), (3600, "h"), (60, "min"))
NOTEBOOK, DRAWING = "heavytop.report.notebook", "heavytop.plots.drawing"
"""The modules that draw, by name: they depend on this one, and are imported when needed."""

# --- names -----------------------------------------------------------------------------------


def with_article(name: str) -> str:
    """Return a name with its indefinite article.

    Examples
    --------
    >>> with_article("int"), with_article("float"), with_article("ndarray")
    ('an int', 'a float', 'an ndarray')
    """
    return f"an {name}" if name.startswith(("nd", *"aeiouAEIOU")) else f"a {name}"


def nearest(value: object, known: Iterable[str]) -> str:
    """Return a hint at the known name that is most similar to a value, or an empty text.

    Parameters
    ----------
    value : object
        The value that was given; only a text is similar to a name, in capitals or not.
    known : iterable of str

    Returns
    -------
    str
        Empty where no name is near.

    Examples
    --------
    >>> nearest("Taylor-axes", ["taylor-axis", "taylor-cubic"])
    'did you mean "taylor-axis"?'
    >>> nearest(1, ["one"])
    ''
    """
    similar = closest(value, known)
    return f'did you mean "{similar}"?' if similar else ""


def closest(value: object, known: Iterable[str]) -> str:
    """Return the known name that is most similar to a value; empty where none is.

    Examples
    --------
    >>> closest("Cups", ["cusp", "kick"])
    'cusp'
    """
    if not isinstance(value, str):
        return ""
    folded = {name.casefold(): name for name in known}
    near = get_close_matches(value[:LONGEST_NAME].casefold(), folded, 1)
    return folded[near[0]] if near else ""


# --- spelling --------------------------------------------------------------------------------


def printable(text: object) -> str:
    r"""The text on one line, with control characters spelled out.

    Examples
    --------
    >>> print(printable("a\nb"), printable("caf\udce9"))
    a\nb caf\udce9
    """
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(text))


def in_a_line(fault: BaseException) -> str:
    r"""An exception on one line: its type, and what it says.

    Examples
    --------
    >>> in_a_line(ValueError("too\nlong"))
    'ValueError: too long'
    """
    return " ".join(f"{type(fault).__name__}: {fault}".split())


def cut(text: str, most: int) -> str:
    """The text, or its beginning where it is longer than `most` letters.

    Examples
    --------
    >>> cut("a long title", 7)
    'a long…'
    """
    return text if len(text) <= most else text[: most - 1] + "…"


def duration(seconds: float) -> str:
    """A time in a suitable unit: seconds, minutes, hours, days or years.

    >>> [duration(x) for x in (3.17, 90, 24_400, 3e5, 1e12)]
    ['3.17 s', '1.5 min', '6.78 h', '3.47 days', '3.17e+04 years']
    """
    if seconds < SECONDS_BELOW:
        return f"{seconds:.3g} s"
    unit, name = next((u, n) for u, n in LONGER if seconds >= u)
    return f"{seconds / unit:.3g} {name}"


# --- cells of notebooks, and pictures --------------------------------------------------------


class Shown:
    """The base of classes that a notebook shows as facts and a small picture, without scripts."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        return str(import_module(NOTEBOOK).html_of(self))


class Plotted(Shown):
    """The base of classes that have pictures."""

    __slots__ = ()

    def plot(
        self,
        what: str | None = None,
        *,
        ax: Axes | None = None,
        unit: str | None = None,
        **style: Any,
    ) -> Axes:
        """Draw one picture, on axes of your own or on a new figure.

        Parameters
        ----------
        what : str, optional
            Its name; any other is refused with all there are. Of a `Motion` (three nutations of the
            closed form; nothing is integrated) and of a `Trajectory` such as "sphere", "theta" or
            "phase"; without one it is "loop" (theta against phi), or "theta" where the top stands
            still or phi was not followed. Of a result it is one of its `charts`, such as "energy"
            of a `Drift` or "axis-evaluations" of a `WorkPrecision`; without one the first.
        ax : matplotlib.axes.Axes, optional
            Where to draw; nothing but these axes is touched, and a title that they have stays.
            Without it a new figure is made by
            ``matplotlib.pyplot``, which a notebook and ``pyplot.show()`` show, with a legend.
        unit : str, optional
            Such as "deg" or "deg,ms", in place of rad, rad/s and s.
        **style
            Of a motion and of a trajectory ``events=False`` leaves out their marks. Keywords of
            matplotlib for the line, such as color, lw, ls or label, which go before those of the
            picture; of several lines each has them, of an `Atlas` the mesh, of a `Stress` the
            image.

        Returns
        -------
        matplotlib.axes.Axes
            The axes that were drawn on: in rad, rad/s and s where `unit` says nothing else.

        Raises
        ------
        Impossible
            There is no such picture: the message lists those there are.
        WrongType
            `ax` is not of matplotlib, or `what` no text.
        ValueError
            The trajectory did not follow what is to be drawn.
        AttributeError
            matplotlib has no such keyword.

        Examples
        --------
        >>> import heavytop as ht
        >>> from matplotlib.figure import Figure
        >>> scene = ht.load_scene("sicm-kicked")
        >>> ax = Figure().subplots()
        >>> ht.Motion(scene.top, scene.start).plot("theta", ax=ax, color="black", lw=2) is ax
        True
        """
        drawn: Axes = import_module(DRAWING).plot_picture(self, what, ax, unit, style)
        return drawn


class Played(Plotted):
    """The base of motions that have a player too."""

    __slots__ = ()

    def play(
        self, *, rounds: float | None = None, time: float | None = None, speed: float | None = None
    ) -> Shown:
        """Return the top that moves, for a cell: turn it with the mouse, or with the arrow keys.

        The player needs no network, no widgets, and less than 100 kB; saved notebooks and the pages
        made of them keep it.

        Parameters
        ----------
        rounds : float, optional
            How often the axis goes round the vertical while it is shown [1].
        time : float, optional
            How much of the motion is shown instead [s].
        speed : float, optional
            How much of it is shown in a second [s].

        Examples
        --------
        >>> import heavytop as ht
        >>> scene = ht.load_scene("sicm-kicked")
        >>> ht.Motion(scene.top, scene.start).play()
        <Player of 'loops'>
        """
        player = import_module(NOTEBOOK).Player
        found: Shown = player.of(self, rounds=rounds, time=time, speed=speed)
        return found
