"""One row for each motion: its turning points, its period and what turns in it."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from heavytop.analytic.theory.rows.integrals import complete
from heavytop.analytic.theory.rows.paired import Mask
from heavytop.analytic.theory.rows.roots import Roots
from heavytop.analytic.theory.rows.start import Start
from heavytop.numbers.pairs import Array

VAGUE = 2.0**-46
"""What cancellation may leave of a relative error; the rest are roundings of doubles."""

TERMS = 12  # of the arctangent of an eighth of the tilt, to 1e-18

_ROUNDED = 2.0**-48  # a bound on the latter, relative to each turn
_WANTED = 5e-14  # of an angle, beside max(1, |x|)


class Row(NamedTuple):
    """Turning points and turns of motions that nod; arrays of the shape of what was given.

    Parameters
    ----------
    theta_min, theta_max : Array
        The tilts between which θ nods [rad].
    period : Array
        T [s].
    precession, spin : Array
        Δφ and Δψ in a period [rad]; a pass through a pole is a jump by π, as in `closed_form`.
    trusted : ndarray of bool
        Whether every one of them has its digits. Where the motion does not nod it means nothing.
    """

    theta_min: Array
    theta_max: Array
    period: Array
    precession: Array
    spin: Array
    trusted: Mask


def rows(
    A: Array, C: Array, gMR: Array, theta: Array, thetadot: Array, phidot: Array, spin: Array,
    held: str,
) -> Row:  # fmt: skip
    """The rows of tops and starts, each bit for bit what it is alone.

    Parameters
    ----------
    A, C, gMR, theta, thetadot, phidot, spin : Array, shape (n,) or (1,)
        Tops [kg m², kg m² s⁻²] and starts [rad, rad/s].
    held : {"psidot", "omega3"}
        What `spin` is.

    Examples
    --------
    The book's top, kicked backwards:

    >>> given = (3.28e-4, 6.6e-5, 0.0456, 0.1, 0.0, -15.0, 140.0)
    >>> row = rows(*(np.array([each]) for each in given), "psidot")
    >>> [round(float(each[0]), 10) for each in row[2:5]], row.trusted
    ([0.5428955182, 3.9741816546, 64.3238261194], array([ True]))
    """
    with np.errstate(all="ignore"):  # what is not trusted may be anything
        start = Start.of(A, C, gMR, theta, thetadot, phidot, spin, held)
        return _row(start, Roots.of(start))


def _row(start: Start, roots: Roots) -> Row:
    K, over_bottom, over_top = complete(
        roots.mc, roots.one_plus_u2 / roots.one_plus_u1, roots.one_minus_u2 / roots.one_minus_u1
    )
    period = 2 * K / roots.w
    passed = np.where(roots.one_minus_u2 == 0, pi, 0.0)
    plus = _turn(start.P_plus, roots.w * roots.one_plus_u1, over_bottom, np.asarray(pi))
    minus = _turn(start.P_minus, roots.w * roots.one_minus_u1, over_top, passed)
    low = _tilt(start.mirrored, roots.one_minus_u1, roots.one_plus_u1)
    high = _tilt(start.mirrored, roots.one_minus_u2, roots.one_plus_u2)
    carried = start.kappa * period
    precession = plus + minus
    spin = carried + np.where(start.mirrored, minus - plus, plus - minus)
    turned = abs(plus) + abs(minus)
    trusted = (
        start.fits
        & (roots.vague <= VAGUE)
        & _fine(precession, turned)
        & _fine(spin, turned + abs(carried))
    )
    return Row(
        np.where(start.mirrored, low, high), np.where(start.mirrored, high, low), period,
        precession, spin, trusted,
    )  # fmt: skip


def _turn(P: Array, under: Array, third: Array, passed: Array) -> Array:
    """Φ± in a period; where P± = 0 only the jump is left, if that pole is passed."""
    return np.where(P == 0, passed, P / under * third)


def _tilt(mirrored: Mask, one_minus_u: Array, one_plus_u: Array) -> Array:
    """θ [rad], seen from above."""
    late = mirrored ^ (one_minus_u > one_plus_u)
    angle = _angle(np.minimum(one_minus_u, one_plus_u), np.maximum(one_minus_u, one_plus_u))
    return np.where(late, pi - angle, angle)


def _angle(nearer: Array, farther: Array) -> Array:
    """The angle between the axis and the nearer pole, 2 arctan √(nearer/farther).

    By the tangent of its eighth part, for which a series is short: sums, products and roots have
    the same bits on every machine.
    """
    quarter = np.sqrt(nearer / 2) / (1 + np.sqrt(farther / 2))
    eighth = quarter / (1 + np.sqrt(1 + quarter * quarter))  # at most tan(π/16)
    square = -eighth * eighth
    series = 1 / (2 * TERMS + 1) * square
    for k in range(TERMS - 1, 0, -1):
        series = (series + 1 / (2 * k + 1)) * square
    return np.asarray(8 * (eighth + eighth * series))


def _fine(angle: Array, size: Array) -> Mask:
    """Whether an angle has its digits, being a sum of terms of such a size."""
    return np.asarray(_ROUNDED * size <= _WANTED * np.maximum(1.0, abs(angle)))
