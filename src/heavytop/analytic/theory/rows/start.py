"""Tops and starts, reduced: arrays in units A = 1, seen so that g ≥ 0.

The symbols are those of `heavytop.analytic.theory.reduced`. What may cancel is added up with
twice the digits of a double; what comes out is right to a few units in the last place, but for
the errors `vague_…`, which beside a pole, a double root or a separatrix may be larger.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heavytop.analytic.theory.rows.paired import (
    Mask,
    Paired,
    chosen,
    heights,
    plain,
    quotient,
    size,
    spin_about_axis,
)
from heavytop.numbers.pairs import Array, Pairs

RANGE = 2.0**100
"""What is given is 0, or of a size within 1/RANGE … RANGE: no product leaves the normal range."""


@dataclass(frozen=True, slots=True)
class Start:
    """Motions with g ≥ 0; arrays of one shape, or of one element.

    Parameters
    ----------
    mirrored : ndarray of bool
        Whether gMR < 0, so that the top is seen from below.
    g : Array
        |gMR|/A [s⁻²].
    one_minus_u0, one_plus_u0 : Array
        1 ∓ cos θ₀.
    f0, f1, f2 : Array
        Coefficients of f(u₀ + d) in powers of d; that of d³ is 2g.
    P_plus, P_minus : Array
        a ± b [s⁻¹], exactly 0 where that is proved.
    surplus : Array
        4 (h − g) − 2 b P₋ = −f'(1) [s⁻²].
    kappa : Array
        κ = p_ψ (1/C − 1/A) [s⁻¹].
    vague_f1, vague_surplus : Array
        Bounds on the errors of f1 and of the surplus [s⁻²].
    vague_plus, vague_minus : Array
        Bounds on the relative errors of P±.
    fits : ndarray of bool
        Whether all that was given is in range.
    """

    mirrored: Mask
    g: Array
    one_minus_u0: Array
    one_plus_u0: Array
    f0: Array
    f1: Array
    f2: Array
    P_plus: Array
    P_minus: Array
    surplus: Array
    kappa: Array
    vague_f1: Array
    vague_surplus: Array
    vague_plus: Array
    vague_minus: Array
    fits: Mask

    @classmethod
    def of(
        cls, A: Array, C: Array, gMR: Array, theta: Array, thetadot: Array, phidot: Array,
        spin: Array, held: str,
    ) -> Start:  # fmt: skip
        """The reduced motions.

        Parameters
        ----------
        A, C, gMR, theta, thetadot, phidot, spin : Array
            Tops [kg m², kg m² s⁻²] and starts [rad, rad/s]: doubles, that mean their binary value.
        held : {"psidot", "omega3"}
            What `spin` is.
        """
        mirrored = np.asarray(gMR < 0)
        seen, kappa = _seen(A, C, gMR, theta, thetadot, phidot, spin, held, mirrored)
        below, above = _unmoved(A, C, theta, phidot, spin, held)
        none_plus, none_minus = np.where(mirrored, above, below), np.where(mirrored, below, above)
        plus = np.where(none_plus, 0.0, seen.P_plus.hi)
        minus = np.where(none_minus, 0.0, seen.P_minus.hi)
        vague_plus, vague_minus = seen.vague_P
        g, one_minus, one_plus, f0, f1, f2, surplus = (
            np.asarray(each.hi)
            for each in (seen.g, seen.above, seen.below, seen.f0, seen.f1, seen.f2, seen.surplus)
        )
        return cls(
            mirrored, g, one_minus, one_plus, f0, f1, f2, plus, minus, surplus,
            np.asarray(kappa.hi), seen.vague_f1, seen.vague_surplus,
            np.where(none_plus, 0.0, vague_plus / abs(plus)),
            np.where(none_minus, 0.0, vague_minus / abs(minus)),
            _in_range(A, C, gMR, theta, thetadot, phidot, spin),
        )  # fmt: skip


def _seen(
    A: Array, C: Array, gMR: Array, theta: Array, thetadot: Array, phidot: Array, spin: Array,
    held: str, mirrored: Mask,
) -> tuple[Paired, Pairs]:  # fmt: skip
    """The motions, from below where they are mirrored; and κ, seen from above."""
    above, below = heights(theta)
    omega3, terms = plain(spin), abs(spin)
    if held == "psidot":
        omega3, terms = spin_about_axis(spin, phidot, theta, above, below)
    ratio, g = quotient(C, A), quotient(abs(gMR), A)
    b = omega3 * ratio
    seen = Paired(
        g, chosen(mirrored, -b, b), chosen(mirrored, below, above), chosen(mirrored, above, below),
        plain(phidot), plain(thetadot) * plain(thetadot), size(ratio) * terms,
    )  # fmt: skip
    return seen, omega3 - b


def _unmoved(
    A: Array, C: Array, theta: Array, phidot: Array, spin: Array, held: str
) -> tuple[Mask, Mask]:
    """Where P₊ and P₋, seen from above, are exactly zero.

    The cosine of a double other than 0 is transcendental (Lindemann), and P± are linear in it: so
    both its coefficient and the rest must vanish.
    """
    pole, idle = np.equal(theta, 0), np.equal(phidot, 0) & np.equal(spin, 0)
    if held == "omega3":
        return np.where(pole, np.equal(spin, 0), idle), pole | idle
    ball = np.equal(A, C)
    opposite, alike = np.equal(spin, -phidot), np.equal(spin, phidot)
    return np.where(pole, opposite, idle | ball & opposite), pole | idle | ball & alike


def _in_range(*given: Array) -> Mask:
    fits: Mask = np.ones(1, np.bool_)
    for each in given:
        size = abs(each)
        fits = fits & ((size >= 1 / RANGE) & (size <= RANGE) | np.equal(size, 0))
    return fits
