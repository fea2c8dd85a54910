"""Which course the axis takes, and the constants of that course at enough digits."""

from __future__ import annotations

from typing import TypeAlias

from heavytop.analytic.theory.asymptotic import Asymptotic
from heavytop.analytic.theory.course import NOTHING, Course, Proved, course, upright
from heavytop.analytic.theory.nodding import Nodding
from heavytop.analytic.theory.nutation import MOST_DIGITS, Unresolved, nutation, resolved
from heavytop.analytic.theory.reduced import Reduced
from heavytop.analytic.theory.steady_course import Steady
from heavytop.analytic.theory.zeros import digits_lost, vanishes
from heavytop.numbers.decimals import context

Orbit: TypeAlias = "Nodding | Asymptotic | Steady"
"""The course of an axis, with its constants."""


def orbit(reduced: Reduced, digits: int, proved: Proved = NOTHING) -> Orbit:
    """The course of the axis, at a precision that leaves `digits` digits.

    Parameters
    ----------
    reduced : Reduced
        The motion, at any precision.
    digits : int
        Decimal digits.
    proved : Proved
        What is known of it; the rest is told from its numbers, zero below two thirds of their
        digits.

    Raises
    ------
    NoClosedForm
        When 10 000 digits do not tell its turning points apart.
    """
    dps = max(60, digits + 50)
    seen = reduced.refined(context(dps))
    while not resolved(seen, proved):
        dps *= 2
        if dps > MOST_DIGITS:
            raise Unresolved(MOST_DIGITS)
        seen = reduced.refined(context(dps))
    kind = proved.course or course(seen)
    if kind is Course.NUTATING:
        return Nodding(nutation(reduced, digits, proved))
    if kind is Course.STEADY:
        return Steady(upright(seen))
    path = _asymptotic(seen, proved)
    lost = digits_lost(path.ctx, path.one_minus_u1, 1)
    if digits + 20 + lost > dps:
        path = _asymptotic(reduced.refined(context(digits + 30 + 2 * lost)), proved)
    return path


def _asymptotic(reduced: Reduced, proved: Proved) -> Asymptotic:
    over, ctx = upright(reduced), reduced.ctx
    planar = (proved.mirrored() if reduced.g < 0 else proved).zero_plus
    if planar is None:
        scale = over.g + over.kinetic0 + over.b**2
        planar = vanishes(ctx, over.b**2, scale) and vanishes(ctx, over.drift0**2, scale)
    return Asymptotic(over, planar)
