"""What is shown of things: the one module that reaches upwards, when a cell or a user asks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Shown:
    """A thing of which a cell shows facts, and a small picture; the page needs no script."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        from heavytop.report.notebook import html_of

        return html_of(self)


class Plotted(Shown):
    """A thing that can be drawn, a picture at a time."""

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
            Of a `Motion` (three nutations of the closed form; nothing is integrated) and of a
            `Trajectory`: "loop" (theta against phi; the default, unless the top stands still or phi
            was not followed), "sphere" (the path of the axis), "theta" (upright), "phi", "psi",
            "thetadot", "phidot" or "psidot" (against time), "potential" or "phase"; of a
            `Trajectory` "errors" too.
            Of a `Drift` the error that grows: "energy", "phase_s", "axis" or an invariant, of those
            that are not zero. Of a `WorkPrecision` the error, against time or, as
            "axis-evaluations", against evaluations: axis, theta, phase, energy. Of a `Check`
            "errors" or "phase". The first of them is the default. An `Atlas` has its "map" alone, a
            `Stress` its "digits".
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
            The axes that were drawn on: angles are in rad, rates in rad/s, times in s.

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
        from heavytop.plots.drawing import plotted

        return plotted(self, what, ax, unit, style)


class Played(Plotted):
    """A motion that can also be played."""

    __slots__ = ()

    def play(
        self,
        *,
        rounds: float | None = None,
        time: float | None = None,
        speed: float | None = None,
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
        from heavytop.report.notebook import Player

        return Player.of(self, rounds=rounds, time=time, speed=speed)
