"""What is proved of the course of θ: where it leads, and which poles it may pass."""

from __future__ import annotations

from typing import Final, Literal, TypeAlias

from heavytop.classification.kinds import Kind, Verdict
from heavytop.classification.signs import SceneSigns, UndecidedError
from heavytop.scene.state import State
from heavytop.scene.top import Top

Course: TypeAlias = Literal["steady", "asymptotic", "nutating"]

_COURSES: Final[dict[Kind, Course]] = {
    **dict.fromkeys((Kind.AT_REST, Kind.SLEEPING, Kind.HANGING, Kind.UNIFORM_PRECESSION), "steady"),
    Kind.SEPARATRIX: "asymptotic",
    **dict.fromkeys(
        (Kind.THROUGH_TOP, Kind.THROUGH_BOTTOM, Kind.LOOPS, Kind.CUSPS, Kind.WAVES), "nutating"
    ),
}


def course(top: Top, start: State, verdict: Verdict) -> Course | None:
    """Whether θ is constant, tends to the vertical or nods; None where that is not proved.

    Parameters
    ----------
    top : Top
    start : State
    verdict : Verdict
        What `classify` says of them.

    Examples
    --------
    >>> from heavytop.classification.classify import classify
    >>> top, start = Top(1, 1, 0), State("pi/2", phidot="1e-20")
    >>> course(top, start, classify(top, start))
    'steady'
    """
    if verdict.kind is Kind.FORCE_FREE:
        return _without_weight(SceneSigns(top, start))
    if verdict.kind is Kind.PLANAR_PENDULUM and "asymptotic" not in verdict.open_tags:
        return "asymptotic" if "asymptotic" in verdict.tags else "nutating"
    return _COURSES.get(verdict.kind)


def zero_momenta(top: Top, start: State) -> tuple[bool | None, bool | None]:
    """Whether p_φ + p_ψ and p_φ − p_ψ are zero; None where that is not proved.

    Parameters
    ----------
    top : Top
    start : State

    Examples
    --------
    >>> zero_momenta(Top(1, 1, 1), State(0, thetadot=1, psidot=2))
    (False, True)
    """
    signs = SceneSigns(top, start)
    return _is_zero(signs, "P_plus"), _is_zero(signs, "P_minus")


def _is_zero(signs: SceneSigns, name: str) -> bool | None:
    try:
        return signs.sign_of(name) == 0
    except UndecidedError:
        return None


def _without_weight(signs: SceneSigns) -> Course | None:
    """The axis runs round L; θ is constant if L is vertical or the axis is at rest."""
    if signs.rate("thetadot"):
        return "nutating"
    if signs.pole or signs.rate("phidot") == 0:
        return "steady"
    level = _is_zero(signs, "pull")
    return None if level is None else "steady" if level else "nutating"
