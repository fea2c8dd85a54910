"""What a notebook shows of things: the one module that reaches upwards, when a cell asks it to."""

from __future__ import annotations


class Shown:
    """A thing of which a cell shows facts, and a small picture; the page needs no script."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        from heavytop.report.notebook import html_of

        return html_of(self)


class Played(Shown):
    """A motion that can also be played."""

    __slots__ = ()

    def play(self) -> Shown:
        """Return the top that moves, for a cell: turn it with the mouse, or with the arrow keys.

        The player needs no network, no widgets, and less than 100 kB; saved notebooks and the pages
        made of them keep it.

        Examples
        --------
        >>> import heavytop as ht
        >>> scene = ht.load_scene("sicm-kicked")
        >>> ht.Motion(scene.top, scene.start).play()
        <Player of 'loops'>
        """
        from heavytop.report.notebook import Player

        return Player.of(self)
