"""Roots, sines, cosines and their inverses of exact numbers."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Final

from heavytop.errors import NotANumber
from heavytop.exact.number import ONE, PI, ZERO, Exact, Number, split

_MAX_ARC_MULTIPLE: Final = 16  # multiples of an arc whose cosine is written as algebraic

_COSINES: Final = {Fraction(k, 12): n for k, n in ((0, 4), (2, 3), (3, 2), (4, 1), (6, 0))}
"""n by q, where cos πq = √n / 2."""


def sqrt(x: Number) -> Exact:
    """The square root of `x`; a negative `x` raises `NotANumber`."""
    return Exact.of(x) ** Fraction(1, 2)


def cos(x: Number) -> Exact:
    """The cosine of `x` [rad], in closed form at multiples of π/6 and π/4 and of an arc.

    Examples
    --------
    >>> print(cos(PI / 2), cos(-PI / 6), cos(0.5), cos(acos("3/4")))
    0 0.5*sqrt(3) cos(0.5) 3/4
    """
    return _circle_point(Exact.of(x))[0]


def sin(x: Number) -> Exact:
    """The sine of `x` [rad], in closed form at multiples of π/6 and π/4 and of an arc.

    Examples
    --------
    >>> print(sin(PI), sin("30 deg"), sin("pi/4"), sin(acos("3/5")))
    0 0.5 0.5*sqrt(2) 0.8
    """
    return _circle_point(Exact.of(x))[1]


def tan(x: Number) -> Exact:
    """The tangent of `x` [rad].

    Examples
    --------
    >>> print(tan("pi/4"), tan(atan(3)))
    1 3
    """
    cosine, sine = _circle_point(Exact.of(x))
    return sine / cosine


def acos(x: Number) -> Exact:
    """The arc cosine of `x` [rad], in 0 … π; outside of −1 … 1 it raises `NotANumber`.

    Examples
    --------
    >>> print(acos("-1/2"), acos("3/4"), acos(1))
    2/3*pi acos(0.75) 0
    """
    cosine = Exact.of(x)
    inside = (1 - cosine * cosine).sign()
    if inside == -1:
        raise NotANumber("an arc cosine or sine is of a number within -1 … 1")
    if inside == 0:
        return ZERO if cosine.sign() == 1 else PI
    sixths = {Fraction(1, 2): 2, ZERO: 3, Fraction(-1, 2): 4}.get(cosine)
    return PI * Fraction(sixths, 6) if sixths else Exact("acos", (cosine,))


def asin(x: Number) -> Exact:
    """The arc sine of `x` [rad], π/2 − acos x; outside of −1 … 1 it raises `NotANumber`."""
    return PI / 2 - acos(x)


def atan(x: Number) -> Exact:
    """The arc tangent of `x` [rad], in −π/2 … π/2."""
    tangent = Exact.of(x)
    if tangent in (-1, 0, 1):
        return PI / 4 * tangent
    return Exact("atan", (tangent,))


def _circle_point(x: Exact) -> tuple[Exact, Exact]:
    """Return cos x and sin x; of a sum by the cosines and sines of its terms."""
    times, angle = split(x)
    arc = angle.op in ("acos", "atan")
    if x.op == "+" or (arc and 1 < times <= _MAX_ARC_MULTIPLE):
        first = x.args[0] if x.op == "+" else angle
        (c, s), (cosine, sine) = map(_circle_point, (first, x - first))
        return cosine * c - sine * s, sine * c + cosine * s
    if times < 0:
        cosine, sine = _circle_point(-x)
        return cosine, -sine
    if angle.op == "pi":
        return _cos_pi(times), _cos_pi(Fraction(1, 2) - times)
    if arc and times == 1:
        (y,) = angle.args
        near = sqrt(1 - y * y if angle.op == "acos" else 1 + y * y)
        return (y, near) if angle.op == "acos" else (1 / near, y / near)
    return (Exact("cos", (x,)), Exact("sin", (x,))) if times else (ONE, ZERO)


@lru_cache(64)
def _cos_pi(q: Fraction) -> Exact:
    """Return cos πq, by an angle in the first quadrant."""
    q = abs((q + 1) % 2 - 1)
    if 2 * q > 1:
        return -_cos_pi(1 - q)
    if q in _COSINES:
        return sqrt(_COSINES[q]) / 2
    return Exact("cos", (PI * q,))


FUNCTIONS: Final = {each.__name__: each for each in (sqrt, cos, sin, tan, acos, asin, atan)}
"""The functions that a text may call, by name."""
