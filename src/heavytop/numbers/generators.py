"""Generators: the numbers that a form is a quotient of polynomials in.

They are roots of coprime integers, π or a root of it, cosines and sines of angles that the
others are small multiples of, and roots of sums.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from heavytop.numbers.forms import Atom, Form, Wave, common_measure, scaled
from heavytop.numbers.surds import coprime_base

_MAX_MULTIPLE: Final = 8  # of an angle; where more is needed, arguments count as unrelated


@dataclass(frozen=True, slots=True)
class Generators:
    """What to adjoin to the rationals to hold a form.

    Attributes
    ----------
    integers : tuple of int
        Coprime; the root of order `index` of each is a generator.
    index : int
    pi : int
        The order of the root of π that is one.
    multiples : dict
        The argument of each cosine and sine as an angle and a whole number: it is their product.
    roots : dict
        The order of the root of each sum; what a sum holds comes before it.
    """

    integers: tuple[int, ...]
    index: int
    pi: int
    multiples: dict[Form, tuple[Form, int]]
    roots: dict[Form, int]


def generators(x: Form) -> Generators:
    """The generators of x."""
    atoms = list(_atoms(x))
    radicands = {(a, e.denominator) for a, e in atoms if isinstance(a, Fraction)}
    index = math.lcm(*(order for _, order in radicands))
    parts = {n for a, _ in radicands for n in (a.numerator, a.denominator)}
    arguments = (atom.argument for atom, _ in atoms if isinstance(atom, Wave))
    roots: dict[Form, int] = {}
    for atom, e in atoms:
        if isinstance(atom, tuple):
            roots[atom] = math.lcm(roots.get(atom, 1), e.denominator)
    return Generators(
        integers=coprime_base(parts, index),
        index=index,
        pi=math.lcm(*(e.denominator for atom, e in atoms if isinstance(atom, str))),
        multiples=_multiples(list(dict.fromkeys(arguments))),
        roots=roots,
    )


def _atoms(x: Form) -> Iterator[tuple[Atom, Fraction]]:
    """The atoms in x and their exponents, the inner ones first; not those within an angle."""
    for monomial, _ in x:
        for atom, e in monomial:
            if isinstance(atom, tuple):
                yield from _atoms(atom)
            yield atom, e


def _multiples(arguments: Collection[Form]) -> dict[Form, tuple[Form, int]]:
    found: dict[Form, tuple[Form, int]] = {}
    for direction in dict.fromkeys(map(_direction, arguments)):
        sizes = [argument[0][1] for argument in arguments if _direction(argument) == direction]
        for family in _families(sizes):
            unit = common_measure(family)
            for size in family:
                found[scaled(direction, size)] = scaled(direction, unit), int(size / unit)
    return found


def _direction(argument: Form) -> Form:
    return scaled(argument, 1 / argument[0][1])


def _families(sizes: Iterable[Fraction]) -> list[list[Fraction]]:
    """The sizes in groups, of each of which all are small multiples of a common measure."""
    families: list[list[Fraction]] = []
    for size in sizes:
        for family in families:
            together = [*family, size]
            if max(map(abs, together)) <= _MAX_MULTIPLE * common_measure(together):
                family.append(size)
                break
        else:
            families.append([size])
    return families
