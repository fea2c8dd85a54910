"""The tags of many motions at once, as far as bounded double arithmetic can tell them.

ψ̇ changes sign in the nutation only where |p_φ| > |p_ψ|. In units A = 1 it has the sign of −h(u),

    h(u) = p_ψ (1 − C) u² + C p_φ u − p_ψ,   h(±1) = ±C (p_φ ∓ p_ψ),   h(0) = −p_ψ;

where |p_φ| > |p_ψ|, h has one zero r between the poles, and it counts where f(r) > 0. Elsewhere
h has one sign at −1, 0 and 1, and as C ≤ 2 its extremum is of another sign only beyond them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, cast

import numpy as np

from heavytop.classification.bounded import Array, Bounded, Mask, total
from heavytop.classification.codes import NAMES, Codes, bits
from heavytop.classification.criteria import Given, miss_of_bottom, miss_of_top
from heavytop.classification.kind import Kind
from heavytop.classification.starts import Starts
from heavytop.classification.tags import away_from_one, upper_roots_nearer

_NOT_NODDING: Final = tuple(
    NAMES.index(kind)
    for kind in (
        Kind.AT_REST, Kind.FORCE_FREE, Kind.SLEEPING, Kind.HANGING, Kind.PLANAR_PENDULUM
    )
)  # fmt: skip
_NOWHERE: Final = np.zeros(1, np.bool_)
_STEEPEST: Final = 24.0
"""|f′(u)| ≤ |2 gMR (1 − u²)| + |2u| (2K + |2 gMR| (|cosθ| + |u|)) + 2 |p_φ − p_ψ u| |p_ψ|
≤ 2 + 2·5 + 2·3·1 for |u| ≤ 1, where 2K, |gMR|, |p_ψ| ≤ 1 and |p_φ| ≤ 2; and room for roundings."""


@dataclass(frozen=True, slots=True)
class Units:
    """A motion in units in which A = 1 and √(2AK + p_ψ² + A |gMR|) is of order 1.

    It serves the criteria of `heavytop.classification.tags` in the place of `Given`; φ̇ is taken for
    1, and sin²θ for φ̇ sin²θ.
    """

    A: Bounded
    gMR: Bounded
    cos: Bounded
    kinetic: Bounded
    p_psi: Bounded
    phidot: Bounded
    sin2: Bounded

    @staticmethod
    def of(x: Given, momentum: Array) -> Units:
        """The motion `x` in units of its own; `momentum` is that root, about."""
        one = np.ldexp(1.0, -np.frexp(momentum)[1])
        square = one * one
        unit, whole = Bounded(np.ones(1), 0, 0, 0, positive=True), np.ones(1)
        return Units(
            A=unit,
            gMR=(x.A * x.gMR).scaled(square, 0),
            cos=x.cos.scaled(whole, 1),
            kinetic=(x.A * x.kinetic).scaled(square, 0),
            p_psi=x.p_psi.scaled(one, 8),
            phidot=unit,
            sin2=(x.A * x.phidot * x.sin2).scaled(one, 1),
        )


def put_tags(
    starts: Starts, x: Given, momentum: Array, kind: Codes, into: tuple[Codes, Codes]
) -> None:
    """Put the bits of the tags that hold, and of those that are left open, where they are kept.

    Parameters
    ----------
    starts : Starts
        Tops and starts.
    x : Given
        The same, in bounded arithmetic.
    momentum : ndarray of float
        √(2AK + p_ψ² + A |gMR|), about.
    kind : ndarray of uint8
        The codes of their kinds.
    into : tuple of 2 ndarray of uint8
        Where the bits go; 0 so far.
    """
    at_rest, free, sleeping, hanging, planar = (kind == code for code in _NOT_NODDING)
    still, flat = at_rest | sleeping | hanging, at_rest | planar
    resting = ~still & starts.level & starts.still
    units = Units.of(x, momentum)
    told = {
        "spherical-pendulum": _within(~flat, x.p_psi.most == 0, x.p_psi.least > 0),
        "spherical-top": _sure(starts.A == starts.C),
        "spin-reversal": _within(~(still | planar), *_reverses(starts, x, units)),
        "closed-orbit": _sure(planar | (free & ~resting)),
        "near-separatrix": _within(~(still | free), _NOWHERE, _far(units)),
        "inverted-gravity": _sure(starts.gMR < 0),
        "start-at-rest": _sure(resting),
    }
    for name, masks in told.items():
        for array, mask in zip(into, masks, strict=True):
            array |= mask * np.uint8(bits((name,)))


def _sure(holds: Mask) -> tuple[Mask, Mask]:
    return holds, _NOWHERE


def _within(eligible: Mask, yes: Mask, no: Mask) -> tuple[Mask, Mask]:
    return eligible & yes, eligible & ~yes & ~no


def _far(units: Units) -> Mask:
    """Where 1 − m is surely not small; that it is, is beyond doubles: it is the square of 1e-6."""
    x = cast("Given", units)
    return _sides(total(away_from_one(x)))[1] | _sides(total(upper_roots_nearer(x)))[0]


def _reverses(starts: Starts, x: Given, units: Units) -> tuple[Mask, Mask]:
    """Whether ψ̇ changes its sign; a turning point, and a pole, are known zeros of no such kind."""
    (top_below, top_above), (bottom_below, bottom_above) = (
        _sides(total(miss(x))) for miss in (miss_of_top, miss_of_bottom)
    )
    outside = (top_below & bottom_below) | (top_above & bottom_above)
    inside = (top_below & bottom_above) | (top_above & bottom_below)
    none = starts.pole
    if starts.held == "psidot":
        none = none | ((starts.spin == 0) & starts.still)
    falls, rises = _sides_of_f(units, *_zero(x, units))
    return outside & rises & ~none, inside | falls | none


def _zero(x: Given, units: Units) -> tuple[Array, Array]:
    """The zero r = 2 p_ψ/(b ± √d) of h, b = C p_φ, d = b² + 4 p_ψ² (1 − C), and its error.

    |2 p_ψ − r̂ (b ± √d)| is the error but for |b| + √d, and √d is known to d's error over √d.
    """
    C = (x.C / x.A).scaled(np.ones(1), 1)
    b, p = C * _p_phi(units), units.p_psi
    d = b * b + 4 * p * p * (units.A - C)
    root = np.sqrt(np.where(d.value > d.bound, d.value, np.nan))
    spread = b.bound + d.bound / root
    denominator = np.abs(b.value) + root
    r = 2 * p.value / np.where(b.least > 0, np.copysign(denominator, b.value), np.nan)
    error = (2 * p.bound + np.abs(r) * (spread + 2.0**-50 * denominator)) / (denominator - spread)
    return r, np.where(error > 0, 2 * error, np.nan)


def _sides_of_f(units: Units, r: Array, error: Array) -> tuple[Mask, Mask]:
    """Where A² f is surely negative, or surely positive, at a place within `error` of r."""
    u = Bounded(np.where(np.abs(r) < 1.01, r, np.nan), 0, 0, 0).scaled(np.ones(1), 1)
    energy = units.kinetic + 2 * units.gMR * (units.cos - u)
    drop = _p_phi(units) - units.p_psi * u
    f = energy * (units.A - u * u) - drop * drop
    sure = f.least > _STEEPEST * error
    return sure & (f.value < 0), sure & (f.value > 0)


def _p_phi(units: Units) -> Bounded:
    return units.sin2 + units.p_psi * units.cos


def _sides(x: Bounded) -> tuple[Mask, Mask]:
    """Where x is surely negative, and where surely positive."""
    sure = x.least > 0
    return sure & (x.value < 0), sure & (x.value > 0)
