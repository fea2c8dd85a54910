"""How many binary digits the numbers of a run have: those of a double, or as many as it takes.

A projection has to have more of them than a double; heyoka is asked for none of this.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from heavytop.equations.formulation import Formulation

DOUBLE: Final = 53
TEXT_SPARE_DIGITS: Final = 12
ROOM: Final = 260  # states in a leg that is projected: steps take longer the more they have
WORD: Final = 64  # MPFR computes in whole words


def digits_of(bits: int) -> int:
    """Return the decimal digits of texts that are to be rounded to numbers of so many bits.

    Examples
    --------
    >>> digits_of(53)
    27
    """
    return int(bits * math.log10(2)) + TEXT_SPARE_DIGITS


def enough(needed: float) -> int:
    """Return the bits of the least kind of number that has at least so many.

    Examples
    --------
    >>> enough(50), enough(60), enough(200), enough(3300.1)
    (53, 64, 256, 3328)
    """
    return DOUBLE if needed <= DOUBLE else WORD * math.ceil(needed / WORD)


def precision(x: Any) -> int:
    """Return the bits of a number: a double, or one of heyoka's reals."""
    return int(getattr(x, "prec", DOUBLE))


def named(bits: int) -> str:
    """Return what numbers of so many bits are called.

    Examples
    --------
    >>> named(53), named(256)
    ('double', '256 bits')
    """
    return "double" if bits == DOUBLE else f"{bits} bits"


def bits_of(name: str) -> int:
    """Return the bits of the numbers that `named` calls so.

    Examples
    --------
    >>> bits_of("double"), bits_of("256 bits")
    (53, 256)
    """
    return DOUBLE if name == "double" else int(name.split()[0])


def extended() -> float:
    """Return the relative spacing of long doubles on this machine."""
    return float(np.finfo(np.longdouble).eps)


def why_not(formulation: Formulation) -> str:
    """Return why runs of a formulation cannot be projected, or nothing."""
    if not formulation.invariants:
        return f"the {formulation.name} form has no invariant to project onto"
    if extended() > np.finfo(float).eps / 256:
        return "long double has no more digits than double on this machine"
    return ""
