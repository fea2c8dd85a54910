"""The form an exact number is held in, and how a form is written.

A form is a sum of terms, a term a rational coefficient times a monomial, a monomial a product of
powers of atoms; and an atom is a radicand, π, a cosine or sine, or a form again. All of it is plain
tuples, ordered by how they are written, so that equal forms compare and hash alike. No term is
zero: the form of 0 is empty.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Final, Literal, TypeAlias


@dataclass(frozen=True, slots=True)
class Wave:
    """cos or sin of a form that has no simpler one."""

    name: Literal["cos", "sin"]
    argument: Form


Atom: TypeAlias = "Fraction | Literal['pi'] | Wave | Form"
Monomial: TypeAlias = "tuple[tuple[Atom, Fraction], ...]"
Form: TypeAlias = "tuple[tuple[Monomial, Fraction], ...]"


def rational(q: Fraction | int) -> Form:
    """The form of a rational number."""
    return (((), q if isinstance(q, Fraction) else Fraction(q)),) if q else ()


def single(atom: Atom) -> Form:
    """The form of one atom."""
    return ((((atom, Fraction(1)),), Fraction(1)),)


ZERO: Final = rational(0)
ONE: Final = rational(1)
PI: Final = single("pi")


def fraction(x: Form) -> Fraction | None:
    """The value of a form without atoms."""
    return multiple(x, ())


def multiple(x: Form, monomial: Monomial) -> Fraction | None:
    """The coefficient q where x is q times `monomial`, and nothing else."""
    if not x:
        return Fraction(0)
    return x[0][1] if len(x) == 1 and x[0][0] == monomial else None


def scaled(x: Form, q: Fraction | int) -> Form:
    """Return q x."""
    return tuple((monomial, c * q) for monomial, c in x) if q else ZERO


def common_measure(rationals: Collection[Fraction]) -> Fraction:
    """The largest positive rational that each of them, not all 0, is a whole multiple of."""
    return Fraction(
        math.gcd(*(q.numerator for q in rationals)),
        math.lcm(*(q.denominator for q in rationals)),
    )


# --- text ------------------------------------------------------------------------------------


def written(x: Form) -> str:
    """A text that says x in the grammar of scenes, with cos( ) and sin( ) added."""
    text = ""
    for monomial, c in x:
        if text:
            text += f" {'-' if c < 0 else '+'} {_term(monomial, abs(c))}"
        else:
            text = _term(monomial, c)
    return text or "0"


def monomial_text(monomial: Monomial) -> str:
    """How a monomial is written: what terms are ordered by."""
    return _term(monomial, Fraction(1))


def factor_text(atom: Atom, e: Fraction) -> str:
    """How a power of an atom is written: what factors are ordered by."""
    if isinstance(atom, str):
        body: str = atom
    elif isinstance(atom, Wave):
        body = f"{atom.name}({written(atom.argument)})"
    else:
        body = f"({_decimal(atom) if isinstance(atom, Fraction) else written(atom)})"
        if e == Fraction(1, 2):
            return "sqrt" + body
    return body if e == 1 else f"{body}^{e}" if e.denominator == 1 else f"{body}^({e})"


def _term(monomial: Monomial, c: Fraction) -> str:
    above = [factor_text(atom, e) for atom, e in monomial if e > 0]
    below = ["/" + factor_text(atom, -e) for atom, e in monomial if e < 0]
    if abs(c) != 1 or not above:
        above.insert(0, _decimal(c))
    elif c < 0:
        above[0] = "-" + above[0]
    return "*".join(above) + "".join(below)


def _decimal(q: Fraction) -> str:
    """A decimal where the expansion ends, else p/q; through Decimal, which knows no longest int."""
    twos = (q.denominator & -q.denominator).bit_length() - 1
    fives, odd = 0, q.denominator >> twos
    while odd % 5 == 0:
        fives, odd = fives + 1, odd // 5
    if odd != 1:
        return f"{Decimal(q.numerator)}/{Decimal(q.denominator)}"
    places = max(twos, fives)
    scaled = Decimal(q.numerator * 10**places // q.denominator).as_tuple()
    return str(Decimal((scaled.sign, scaled.digits, -places)))
