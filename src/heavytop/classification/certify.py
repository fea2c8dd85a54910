"""Certified classification of one motion: its kind, its tags and its margin, each proved."""

from __future__ import annotations

import math

from heavytop.classification.judge import Ball, Judge, UndecidedError
from heavytop.classification.kind import WHY, Kind, Verdict
from heavytop.classification.tags import found
from heavytop.classification.tree import Tree
from heavytop.scene.arguments import expect
from heavytop.scene.state import State
from heavytop.scene.top import Top


def classify(top: Top, start: State) -> Verdict:
    """The kind of motion of `top` from `start`, with tags, margin and the reason, proved.

    Parameters
    ----------
    top : Top
        What spins; its numbers are exact.
    start : State
        How it starts; its numbers are exact, floats mean their binary value.

    Returns
    -------
    Verdict
        Certified, unless some sign can be neither told with 4096 bits nor proved to be zero.

    Raises
    ------
    WrongType
        `top` is no Top, or `start` no State.

    Notes
    -----
    Every sign is decided by real balls or by an algebraic proof that the number is zero:
    no threshold enters.

    Accuracy: ``tests/property/test_verdicts.py`` holds verdicts over the whole space to the
    definitions at 300 digits, ``validation/11_certified_verdicts.py`` 1e5 of them to integrated
    motions.

    References
    ----------
    Landau & Lifshitz, *Mechanics*, section 35; Whittaker, *Analytical Dynamics*, sections 71 to 73,
    for the separatrix.

    Examples
    --------
    >>> top = Top(A="3.28e-4", C="6.60e-5", gMR="0.0456")
    >>> verdict = classify(top, State(theta="0.1", psidot=140))
    >>> str(verdict.kind), verdict.certified, verdict.tags
    ('cusps', True, ('start-at-rest',))
    >>> str(classify(top, State(theta="0.1", phidot="1e-40", psidot=140)).kind)
    'waves'
    """
    expect("top", top, Top)
    expect("start", start, State)
    try:
        judge = Judge(top, start)
        tree = Tree(judge)
        kind = tree.kind()
    except UndecidedError as unknown:
        return _undecided(unknown.bound)
    details, open_details = tree.detail(kind)
    tags, open_tags = found(judge, kind)
    margin, enclosure = _bounds(tree.margin())
    return Verdict(
        kind, (*details, *tags), (*open_details, *open_tags), True, margin, enclosure, WHY[kind]
    )


def _undecided(bound: str) -> Verdict:
    why = f"{WHY[Kind.UNDECIDED]}: beside its terms it is at most {bound}"
    return Verdict(Kind.UNDECIDED, (), (), False, 0.0, (0.0, _above(float(bound))), why, bound)


def _bounds(margin: Ball) -> tuple[float, tuple[float, float]]:
    """The middle of a ball of positive numbers, and bounds rounded outward."""
    low = max(0.0, math.nextafter(float(margin.lower()), -math.inf))
    return float(margin.mid()), (low, _above(float(margin.upper())))


def _above(x: float) -> float:
    return math.nextafter(x, math.inf)
