"""Jacobi's theta functions on the real line and beside it, in any arithmetic.

With the nome q of m, or for m > ½ that of 1 − m by Jacobi's imaginary transformation, the series

    θ₁ = S Σ (−1)ⁿ qⁿ⁽ⁿ⁺¹⁾ s₂ₙ₊₁,   θ₂ = C Σ qⁿ⁽ⁿ⁺¹⁾ c₂ₙ₊₁,   θ₃, θ₄ = 1 + 2 Σ (±1)ⁿ qⁿⁿ t₂ₙ

(θ₁ and θ₂ without their factor 2 q^¼) are the same for S, C = sin z, cos z (m ≤ ½) and for sinh z,
cosh z (m > ½): s, c and t are polynomials in C₂ = cos 2z or cosh 2z. Arguments never reach farther
than half way to the next turning point, so that q ≤ e^−π makes four terms enough for a double.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from heavytop.analytic.theory.elliptic import complete_first
from heavytop.numbers.decimals import Context, Number

Value: TypeAlias = Any
"""A number of an mpmath context, an array of doubles, or a `Pairs` of them."""

Coefficients: TypeAlias = "tuple[Value, ...]"


@dataclass(frozen=True, slots=True)
class Lattice:
    """The nome in use, and what a time of 1/w is worth in its argument.

    Parameters
    ----------
    ctx : Context
        The precision.
    K, K_other : Number
        K(m) and K(1 − m), the latter infinite for m = 0.
    hyperbolic : bool
        Whether the nome is that of 1 − m.
    q, root_q : Number
        The nome, at most e^−π, and its square root.
    unit : Number
        z/x: π/2K, or π/2K(1 − m).
    """

    ctx: Context
    K: Number
    K_other: Number
    hyperbolic: bool
    q: Number
    root_q: Number
    unit: Number

    @classmethod
    def of(cls, ctx: Context, m: Number, mc: Number) -> Lattice:
        """The lattice of the parameter m = 1 − mc."""
        K = complete_first(ctx, mc)
        K_other = complete_first(ctx, m) if m else ctx.inf
        hyperbolic = bool(m > mc)
        here, there = (K_other, K) if hyperbolic else (K, K_other)
        root_q = ctx.exp(-ctx.pi * there / (2 * here))
        return cls(ctx, K, K_other, hyperbolic, root_q**2, root_q, ctx.pi / (2 * here))

    def terms(self, tiny: Number) -> int:
        """How many terms the series need for errors below `tiny`."""
        n = 1
        while self.root_q ** (n * (2 * n - 1)) > tiny:
            n += 1
        return n

    def argument(self, x: Number) -> tuple[Number, Number, Number]:
        """S, C and C₂ at x = w t."""
        ctx, z = self.ctx, self.unit * x
        if self.hyperbolic:
            S, C = ctx.sinh(z), ctx.cosh(z)
            return S, C, 1 + 2 * S * S
        C, S = ctx.cos_sin(z)
        return S, C, 1 - 2 * S * S


def clenshaw(C2: Value, coefficients: Coefficients) -> tuple[Value, Value]:
    """Clenshaw's b₀ and b₁ of Σ aₙ pₙ, where pₙ₊₁ = 2 C₂ pₙ − pₙ₋₁.

    The sum is b₀ + b₁ for pₙ = s₂ₙ₊₁/S, b₀ − b₁ for c₂ₙ₊₁/C, b₀ − C₂ b₁ for t₂ₙ.
    """
    twice = C2 + C2
    later = coefficients[-1] - coefficients[-1]
    now = coefficients[-1]
    for a in coefficients[-2::-1]:
        now, later = a + twice * now - later, now
    return now, later


@dataclass(frozen=True, slots=True)
class Functions:
    """sn, cn and dn beside either turning point.

    Parameters
    ----------
    hyperbolic : bool
        As in the lattice.
    one, two, three, four : tuple
        Coefficients of θ₁ … θ₄.
    sn, cn, dn, far : Value
        Their factors, and that of cn and dn beside the upper turning point (1 unless hyperbolic).
    """

    hyperbolic: bool
    one: Coefficients
    two: Coefficients
    three: Coefficients
    four: Coefficients
    sn: Value
    cn: Value
    dn: Value
    far: Value

    @classmethod
    def of(cls, lattice: Lattice, tiny: Number) -> Functions:
        """The functions on a lattice, with errors below `tiny`."""
        count, q = range(lattice.terms(tiny)), lattice.q
        two = tuple(q ** (n * (n + 1)) for n in count)
        three = tuple(q ** (n * n) * (2 if n else 1) for n in count)
        one, four = _alternating(two), _alternating(three)
        second, third, fourth = sum(two), sum(three), sum(four)  # θ₂, θ₃, θ₄ at z = 0
        if lattice.hyperbolic:
            factors = third / fourth, second / fourth, second / third, 4 * lattice.root_q
        else:
            factors = third / second, fourth / second, fourth / third, lattice.ctx.one
        return cls(lattice.hyperbolic, one, two, three, four, *factors)

    def map(self, kind: Callable[[Number], Value]) -> Functions:
        """The same with every number turned into another kind."""
        series = (self.one, self.two, self.three, self.four)
        factors = (self.sn, self.cn, self.dn, self.far)
        return Functions(
            self.hyperbolic, *(tuple(map(kind, each)) for each in series), *map(kind, factors)
        )

    def __call__(self, S: Value, C: Value, C2: Value, upper: bool) -> tuple[Value, Value, Value]:
        """sn, cn, dn at x beside the lower turning point, or at K + x beside the upper one."""
        b0, b1 = clenshaw(C2, self.one)
        one = S * (b0 + b1)
        b0, b1 = clenshaw(C2, self.two)
        two = C * (b0 - b1)
        b0, b1 = clenshaw(C2, self.three)
        three = b0 - C2 * b1
        b0, b1 = clenshaw(C2, self.four)
        four = b0 - C2 * b1
        below, beside = (two, four) if self.hyperbolic else (four, two)
        if not upper:
            return self.sn * one / below, self.cn * beside / below, self.dn * three / below
        cn = -self.far * self.cn * one / three
        return self.sn * beside / three, cn, self.far * self.dn * below / three


@dataclass(frozen=True, slots=True)
class Sweep:
    """The angle of a theta function along a line beside the real one, zero at z = 0.

    Parameters
    ----------
    odd : bool
        Whether the function is θ₁ or θ₂.
    sine, cosine : tuple
        Coefficients of the sine and the cosine of the angle, up to one factor.
    """

    odd: bool
    sine: Coefficients
    cosine: Coefficients

    def map(self, kind: Callable[[Number], Value]) -> Sweep:
        """The same with every number turned into another kind."""
        return Sweep(self.odd, tuple(map(kind, self.sine)), tuple(map(kind, self.cosine)))

    def __call__(self, S: Value, C: Value, C2: Value) -> tuple[Value, Value]:
        """Sine and cosine of the angle, up to one factor."""
        y0, y1 = clenshaw(C2, self.sine)
        x0, x1 = clenshaw(C2, self.cosine)
        if self.odd:
            return S * (y0 + y1), C * (x0 - x1)
        return S * C * y0, x0 - C2 * x1


def sweeps(lattice: Lattice, v: Number, tiny: Number) -> tuple[Sweep, Sweep, Number]:
    """The sweeps of a pole at the distance i v, about its own turning point and about the other.

    Parameters
    ----------
    lattice : Lattice
        The nome.
    v : Number
        How far from the real line, 0 < v ≤ K(1 − m).
    tiny : Number
        The error allowed.

    Returns
    -------
    Sweep, Sweep
        π/2 − arg θ₁(z + ib) and −arg θ₂(z + ib), b = πv/2K, each up to a multiple of z.
    Number
        What is missing, per x: the real sweep is that multiple of x more.
    """
    ctx, count, q = lattice.ctx, range(lattice.terms(tiny)), lattice.q
    odd = [(-1) ** n * q ** (n * (n + 1)) for n in count]
    even = [(2 if n else 1) * (-1) ** n * q ** (n * n) for n in count]
    if lattice.hyperbolic:  # −arg θ₁(β − iz) and −arg θ₄(β − iz)
        beta = lattice.unit * v
        own = _sweep(True, odd, beta, ctx.cos, ctx.sin)
        return own, _sweep(False, even, -beta, ctx.sin, ctx.cos), beta / lattice.K
    if 2 * v <= lattice.K_other:
        b, plain = lattice.unit * v, [abs(a) for a in odd]
        own = _sweep(True, odd, b, ctx.cosh, ctx.sinh)
        return own, _sweep(True, plain, b, ctx.sinh, ctx.cosh), ctx.zero
    b, plain = lattice.unit * (lattice.K_other - v), [abs(a) for a in even]
    own = _sweep(False, even, -b, ctx.sinh, ctx.cosh)  # z + arg θ₄(z + ib) and z + arg θ₃(z + ib)
    return own, _sweep(False, plain, -b, ctx.sinh, ctx.cosh), lattice.unit


def _sweep(
    odd: bool,
    series: list[Number],
    b: Number,
    sine: Callable[[Number], Number],
    cosine: Callable[[Number], Number],
) -> Sweep:
    """The sweep whose coefficients are a series times the functions of (2n + 1) b or of 2n b."""
    if odd:
        y = [a * sine((2 * n + 1) * b) for n, a in enumerate(series)]
        x = [a * cosine((2 * n + 1) * b) for n, a in enumerate(series)]
    else:  # sin 2nz = 2 S C times a polynomial of degree n − 1
        y = [2 * a * sine(2 * n * b) for n, a in enumerate(series)][1:] or [0 * b]
        x = [a * cosine(2 * n * b) for n, a in enumerate(series)]
    scale = max(map(abs, (*y, *x)))
    return Sweep(odd, tuple(a / scale for a in y), tuple(a / scale for a in x))


def _alternating(series: Coefficients) -> Coefficients:
    return tuple(-a if n % 2 else a for n, a in enumerate(series))
