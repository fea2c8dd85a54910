"""Sums, products, powers, cosines and sines of forms, brought to normal form."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Final

from heavytop.errors import NotANumber
from heavytop.numbers.forms import (
    PI,
    ZERO,
    Atom,
    Form,
    Monomial,
    Wave,
    common_measure,
    factor_text,
    fraction,
    monomial_text,
    multiple,
    rational,
    scaled,
    single,
)
from heavytop.numbers.signs import sign
from heavytop.numbers.surds import surd

HALF: Final = Fraction(1, 2)
_PI_ALONE: Final = PI[0][0]  # the monomial
_COSINES: Final = {  # q: n where cos πq = √n / 2
    Fraction(0): 4,
    Fraction(1, 6): 3,
    Fraction(1, 4): 2,
    Fraction(1, 3): 1,
    Fraction(1, 2): 0,
}


def add(a: Form, b: Form) -> Form:
    """Return a + b."""
    total = dict(a)
    for monomial, c in b:
        total[monomial] = total[monomial] + c if monomial in total else c
    kept = [(monomial, c) for monomial, c in total.items() if c]
    if len(kept) > 1:
        kept.sort(key=lambda term: monomial_text(term[0]))
    return tuple(kept)


def multiply(a: Form, b: Form) -> Form:
    """Return a b."""
    if (c := fraction(a)) is not None:
        return scaled(b, c)
    if (c := fraction(b)) is not None:
        return scaled(a, c)
    (p, factors), (q, more) = _factored(a), _factored(b)
    return _product(p * q, (*factors, *more))


def power(x: Form, e: Fraction) -> Form:
    """Return xᵉ.

    Raises
    ------
    NotANumber
        A root of a negative number, or a negative power of zero or of what may be zero.
    """
    root = e.denominator > 1
    known = sign(x) if e < 0 or root else 1
    if e < 0 and not known:
        what = "zero" if known == 0 else "a number that cannot be told from zero"
        raise NotANumber(f"division by {what}")
    if root and known == -1:
        raise NotANumber("a root of a negative number is not real")
    if not root and (q := fraction(x)) is not None:
        return rational(q**e.numerator)
    if not x:
        return ZERO
    c, factors = _factored_for_roots(x) if root else _factored(x)
    return _product(Fraction(1), [(c, e), *((atom, k * e) for atom, k in factors)])


def cos(x: Form) -> Form:
    """Return cos x."""
    half_turns = multiple(x, _PI_ALONE)
    return single(Wave("cos", x)) if half_turns is None else _cos_pi(half_turns)


def sin(x: Form) -> Form:
    """Return sin x."""
    half_turns = multiple(x, _PI_ALONE)
    return single(Wave("sin", x)) if half_turns is None else _cos_pi(HALF - half_turns)


def _cos_pi(q: Fraction) -> Form:
    """Return cos πq, the angle brought to the first quadrant."""
    q = abs((q + 1) % 2 - 1)
    if q > HALF:
        return scaled(_cos_pi(1 - q), -1)
    if q in _COSINES:
        return power(rational(Fraction(_COSINES[q], 4)), HALF)
    return single(Wave("cos", scaled(PI, q)))


# --- normal form -----------------------------------------------------------------------------


def _factored(x: Form) -> tuple[Fraction, Monomial]:
    """Write x ≠ 0 as a coefficient times a monomial; a sum comes out with a positive first term."""
    if len(x) == 1:
        monomial, c = x[0]
        return c, monomial
    c = _content(x) if x[0][1] > 0 else -_content(x)
    return c, ((scaled(x, 1 / c), Fraction(1)),)


def _factored_for_roots(x: Form) -> tuple[Fraction, Monomial]:
    """Write x ≠ 0 as a positive coefficient times factors known not to be negative.

    √(y²) is |y|, so a power of a y of unknown sign is not taken apart; x as a whole has a root.
    """
    if len(x) == 1:
        monomial, c = x[0]
        if c > 0 and all(_never_negative(atom, e) for atom, e in monomial):
            return c, monomial
    c = _content(x)
    return c, ((scaled(x, 1 / c), Fraction(1)),)


def _never_negative(atom: Atom, e: Fraction) -> bool:
    return isinstance(atom, (Fraction, str)) or e.denominator > 1


def _content(x: Form) -> Fraction:
    return common_measure([c for _, c in x])


def _product(coefficient: Fraction, factors: Iterable[tuple[Atom, Fraction]]) -> Form:
    """The product of a coefficient and powers of atoms, like atoms and like roots merged."""
    roots: dict[Fraction, Fraction] = {}  # by exponent
    powers: dict[Atom, Fraction] = {}
    pending = list(factors)
    while pending:
        atom, e = pending.pop()
        if isinstance(atom, Fraction):
            outer, radicand, e = surd(atom, e)
            coefficient *= outer
            if e in roots:
                pending.append((radicand * roots.pop(e), e))
            elif e:
                roots[e] = radicand
            continue
        e += powers.pop(atom, Fraction(0))
        if isinstance(atom, tuple) and len(atom) == 1 and e.denominator == 1:
            inner, c = atom[0]  # one term, kept whole as long as there was a root of it
            pending += [(c, e), *((part, k * e) for part, k in inner)]
        elif e:
            powers[atom] = e
    if not coefficient:
        return ZERO
    monomial = [*((base, e) for e, base in roots.items()), *powers.items()]
    if len(monomial) == 1 and isinstance(atom := monomial[0][0], tuple) and monomial[0][1] == 1:
        return scaled(atom, coefficient)
    return ((tuple(sorted(monomial, key=lambda factor: factor_text(*factor))), coefficient),)
