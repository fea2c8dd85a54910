"""Jacobi's theta functions in doubles, on the real line and beside it, from coefficients in balls.

With the nome q of m, or for m > ½ that of 1 − m by Jacobi's imaginary transformation, the series

    θ₁ = S Σ (−1)ⁿ qⁿ⁽ⁿ⁺¹⁾ s₂ₙ₊₁,   θ₂ = C Σ qⁿ⁽ⁿ⁺¹⁾ c₂ₙ₊₁,   θ₃, θ₄ = 1 + 2 Σ (±1)ⁿ qⁿⁿ t₂ₙ

(θ₁ and θ₂ without their factor 2 q^¼) are the same for S, C = sin z, cos z (m ≤ ½) and for sinh z,
cosh z (m > ½): s, c and t are polynomials in C₂ = cos 2z or cosh 2z. Arguments never reach farther
than half way to the next turning point, so that q ≤ e^−π makes four terms enough for a double.

Beside the real line the argument of a theta function is the angle by which φ turns where the axis
passes a pole of the sphere. References: *NIST Digital Library of Mathematical Functions*, chapters
20 and 22; Clenshaw 1955, *Math. Comp.* 9, 118-120.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from flint import arb

from heavytop.numbers.double_double import Array, DoubleDouble, two_product

Series = tuple[float, ...]

_TINY: Final = 1e-19  # what the terms that are left out add up to, beside the first
_BIG: Final = 1e150  # whose square is a double; the nome has made nothing of it long before


class Argument(NamedTuple):
    """S, C and C₂ of many arguments z."""

    S: Array
    C: Array
    C2: Array

    @classmethod
    def of(cls, tau: Array, lo: Array, scale: DoubleDouble, hyperbolic: bool) -> Argument:
        """Those of z = (tau + lo) scale."""
        z, error = two_product(tau, scale[0])
        error = error + (lo * scale[0] + tau * scale[1])
        if hyperbolic:
            S, C = np.sinh(z), np.cosh(z)
            S, C = S + C * error, C + S * error
            near = np.clip(S, -_BIG, _BIG)
            return cls(S, C, 1 + 2 * near * near)
        S, C = np.sin(z), np.cos(z)
        S, C = S + C * error, C - S * error
        return cls(S, C, 1 - 2 * S * S)


def _clenshaw(C2: Array, series: Series) -> tuple[Array | float, Array | float]:
    """Clenshaw's b₀ and b₁ of Σ aₙ pₙ, where pₙ₊₁ = 2 C₂ pₙ − pₙ₋₁.

    The sum is b₀ + b₁ for pₙ = s₂ₙ₊₁/S, b₀ − b₁ for c₂ₙ₊₁/C, b₀ − C₂ b₁ for t₂ₙ.
    """
    twice = C2 + C2
    now: Array | float = series[-1]
    later: Array | float = 0.0
    for a in series[-2::-1]:
        now, later = a + twice * now - later, now
    return now, later


def _sine_sum(at: Argument, series: Series) -> Array:
    b0, b1 = _clenshaw(at.C2, series)
    return at.S * (b0 + b1)


def _cosine_sum(at: Argument, series: Series) -> Array:
    b0, b1 = _clenshaw(at.C2, series)
    return at.C * (b0 - b1)


def _even_sum(at: Argument, series: Series) -> Array:
    b0, b1 = _clenshaw(at.C2, series)
    return b0 - at.C2 * b1


@dataclass(frozen=True, slots=True)
class Sweep:
    """The angle of a theta function along a line beside the real one, zero at z = 0.

    Parameters
    ----------
    odd : bool
        Whether the function is θ₁ or θ₂.
    sine, cosine : tuple of float
        Coefficients of the sine and the cosine of the angle, up to one factor.
    """

    odd: bool
    sine: Series
    cosine: Series

    def __call__(self, at: Argument) -> Array:
        """The angle [rad]."""
        if self.odd:
            return np.arctan2(_sine_sum(at, self.sine), _cosine_sum(at, self.cosine))
        b0, _ = _clenshaw(at.C2, self.sine)
        return np.arctan2(at.S * at.C * b0, _even_sum(at, self.cosine))


class ThetaSeries:
    """sn, cn, dn and the sweeps of one parameter m, beside either turning point.

    Parameters
    ----------
    tau : arb or None
        K'/K; None where m = 0 and it is infinite. To be used inside ``working(bits)``.

    Attributes
    ----------
    hyperbolic : bool
        Whether the nome is that of 1 − m.
    scale : arb
        What the argument z grows by in a period.
    """

    def __init__(self, tau: arb | None) -> None:
        self._tau, self.hyperbolic = tau, tau is not None and bool(tau < 1)
        root_q = arb(0)
        self.scale = arb.pi()
        if tau is not None:
            self.scale = arb.pi() / tau if self.hyperbolic else arb.pi()
            root_q = (-arb.pi() / (2 * tau) if self.hyperbolic else -arb.pi() * tau / 2).exp()
        q, count = root_q * root_q, range(_terms(float(root_q)))
        self._odd = [q ** (n * (n + 1)) for n in count]
        self._even = [q ** (n * n) * (2 if n else 1) for n in count]
        self._two, self._three = _rounded(self._odd), _rounded(self._even)
        self._one, self._four = (
            _rounded(_alternating(self._odd)),
            _rounded(_alternating(self._even)),
        )
        second, third = sum(self._odd, arb(0)), sum(self._even, arb(0))  # θ₂, θ₃ and
        fourth = sum(_alternating(self._even), arb(0))  # θ₄ at z = 0
        if self.hyperbolic:
            factors = third / fourth, second / fourth, second / third, 4 * root_q
        else:
            factors = third / second, fourth / second, fourth / third, arb(1)
        self._sn, self._cn, self._dn, self._far = (float(factor) for factor in factors)

    def sn_cn(self, at: Argument, upper: bool) -> tuple[Array, Array, Array]:
        """The functions sn and cn, and their denominator, of x (lower point) or K + x (upper)."""
        one, second = _sine_sum(at, self._one), _cosine_sum(at, self._two)
        if upper:
            under = _even_sum(at, self._three)
            beside = _even_sum(at, self._four) if self.hyperbolic else second
            return self._sn * beside / under, -self._far * self._cn * one / under, under
        fourth = _even_sum(at, self._four)
        under, beside = (second, fourth) if self.hyperbolic else (fourth, second)
        return self._sn * one / under, self._cn * beside / under, under

    def dn(self, at: Argument, upper: bool, under: Array) -> Array:
        """The function dn at the same place, from the denominator of sn and cn."""
        if not upper:
            return self._dn * _even_sum(at, self._three) / under
        over = _cosine_sum(at, self._two) if self.hyperbolic else _even_sum(at, self._four)
        return self._far * self._dn * over / under

    def sweeps(self, beta: arb) -> tuple[Sweep, Sweep, arb]:
        """The sweeps of a pole at the distance 2K beta from the real line, 0 < 2 beta ≤ K'/K.

        Returns
        -------
        Sweep, Sweep
            π/2 − arg θ₁(z + ib) and −arg θ₂(z + ib), b = π beta, up to a multiple of z: about the
            turning point beside the pole, and about the other.
        arb
            What the angle grows by from one turning point to the next, but for that multiple.
        """
        tau, quarter = self._tau, arb.pi() / 2
        odd, even = _alternating(self._odd), _alternating(self._even)
        if self.hyperbolic and tau is not None:  # −arg θ₁(b − iz) and −arg θ₄(b − iz)
            b = arb.pi() * beta / tau
            own = _sweep(True, odd, b, arb.cos, arb.sin)
            return own, _sweep(False, even, -b, arb.sin, arb.cos), quarter - b
        if tau is None or 4 * beta <= tau:
            b = arb.pi() * beta
            own = _sweep(True, odd, b, arb.cosh, arb.sinh)
            return own, _sweep(True, self._odd, b, arb.sinh, arb.cosh), quarter
        b = arb.pi() * (tau / 2 - beta)
        own = _sweep(False, even, -b, arb.sinh, arb.cosh)  # z + arg θ₄(z + ib), z + arg θ₃(z + ib)
        return own, _sweep(False, self._even, -b, arb.sinh, arb.cosh), arb(0)


def _terms(root_q: float) -> int:
    """How many terms the series need."""
    n = 1
    while root_q ** (n * (2 * n - 1)) > _TINY:
        n += 1
    return n


def _sweep(
    odd: bool, series: list[arb], b: arb,
    sine: Callable[[arb], arb], cosine: Callable[[arb], arb],
) -> Sweep:  # fmt: skip
    """The sweep whose coefficients are a series times the functions of (2n + 1) b or of 2n b."""
    times = [(2 * n + odd) * b for n in range(len(series))]
    y = [a * sine(z) for a, z in zip(series, times, strict=True)]
    x = [a * cosine(z) for a, z in zip(series, times, strict=True)]
    if not odd:  # sin 2nz = 2 S C times a polynomial of degree n − 1
        y = [2 * a for a in y[1:]] or [arb(0)]
    size = max((abs(a.mid()) for a in (*y, *x)), key=lambda a: a.mid())
    return Sweep(odd, _rounded([a / size for a in y]), _rounded([a / size for a in x]))


def _alternating(series: list[arb]) -> list[arb]:
    return [-a if n % 2 else a for n, a in enumerate(series)]


def _rounded(series: list[arb]) -> Series:
    return tuple(float(a) for a in series)
