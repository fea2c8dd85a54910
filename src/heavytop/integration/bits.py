"""How many binary digits the numbers of a run have: double, long double, or as many as it takes."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

DOUBLE: Final = 53
LONG_DOUBLE: Final = int(np.finfo(np.longdouble).nmant) + 1  # on this machine
WORD: Final = 64  # MPFR computes in whole words


def enough(needed: float) -> int:
    """Return the bits of the least kind of number that has at least so many.

    Examples
    --------
    >>> enough(50), enough(200), enough(3300.1)
    (53, 256, 3328)
    """
    for bits in (DOUBLE, LONG_DOUBLE):
        if needed <= bits:
            return bits
    return WORD * math.ceil(needed / WORD)


def named(bits: int) -> str:
    """Return what numbers of so many bits are called.

    Examples
    --------
    >>> named(53), named(256)
    ('double', '256 bits')
    """
    if bits == DOUBLE:
        return "double"
    return "long double" if bits == LONG_DOUBLE else f"{bits} bits"


def bits_of(name: str) -> int:
    """Return the bits of the numbers that `named` calls so.

    Examples
    --------
    >>> bits_of("double"), bits_of("256 bits")
    (53, 256)
    """
    known = {"double": DOUBLE, "long double": LONG_DOUBLE}
    return known[name] if name in known else int(name.split()[0])
