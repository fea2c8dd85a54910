"""The coefficients of the fixed-step methods, as published, and of Gauss' collocation, computed."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, localcontext
from functools import cache
from itertools import pairwise

import numpy as np

from heavytop.comparison.march import Array

DoubleWords = tuple[Array, Array]

# Symmetric compositions of a symmetric scheme of order 2: the first half and the middle one.

STRANG = ("1",)

# Kahan & Li (1997), the scheme s17odr8a: order 8, 17 stages.
KAHAN_LI_8 = (
    "0.13020248308889008087881763",
    "0.56116298177510838456196441",
    "-0.38947496264484728640807860",
    "0.15884190655515560089621075",
    "-0.39590389413323757733623154",
    "0.18453964097831570709183254",
    "0.25837438768632204729397911",
    "0.29501172360931029887096624",
    "-0.60550853383003451169892108",
)

# Sofroniou & Spaletta (2005): order 10, 35 stages.
SOFRONIOU_SPALETTA_10 = (
    "0.078795722521686419263907679337684",
    "0.31309610341510852776481247192647",
    "0.027918383235078066109520273275299",
    "-0.22959284159390709415121339679655",
    "0.13096206107716486317465685927961",
    "-0.26973340565451071434460973222411",
    "0.074973343155891435666137105641410",
    "0.11199342399981020488957508073640",
    "0.36613344954622675119314812353150",
    "-0.39910563013603589787862981058340",
    "0.10308739852747107731580277001372",
    "0.41143087395589023782070411897608",
    "-0.0048663605831352617621956593099771",
    "-0.39203335370863990644808193642610",
    "0.051942502962449647037182904015976",
    "0.050665090759924496335874344156866",
    "0.049674370639729879054568800279461",
    "0.049317735759594537917680008339338",
)

# Blanes & Moan (2002), Table 3, the scheme of order 6 with 14 stages that begins with a drift; the
# middle drift and the two middle kicks follow from the sums being 1.
BLANES_MOAN_DRIFTS = (
    "0.0378593198406116",
    "0.102635633102435",
    "-0.0258678882665587",
    "0.314241403071447",
    "-0.130144459517415",
    "0.106417700369543",
    "-0.00879424312851058",
)
BLANES_MOAN_KICKS = (
    "0.09171915262446165",
    "0.183983170005006",
    "-0.05653436583288827",
    "0.004914688774712854",
    "0.143761127168358",
    "0.328567693746804",
)


def composition(half: Sequence[str]) -> tuple[Array, Array]:
    """Return kicks, shape (s + 1,), and drifts, shape (s,), of kick-drift-kick steps in a row.

    Parameters
    ----------
    half : sequence of str
        The lengths of the first steps up to the middle one; the rest mirrors them.
    """
    lengths = [Decimal(x) for x in half]
    lengths += lengths[-2::-1]
    kicks = [(a + b) / 2 for a, b in pairwise([Decimal(0), *lengths, Decimal(0)])]
    return _doubles(kicks), _doubles(lengths)


def blanes_moan() -> tuple[Array, Array]:
    """Return kicks, shape (16,), first and last 0, and drifts, shape (15,)."""
    drifts = [Decimal(x) for x in BLANES_MOAN_DRIFTS]
    kicks = [Decimal(0), *(Decimal(x) for x in BLANES_MOAN_KICKS)]
    kicks.append(Decimal("0.5") - sum(kicks, Decimal(0)))
    middle = 1 - 2 * sum(drifts, Decimal(0))
    return _doubles([*kicks, *kicks[::-1]]), _doubles([*drifts, middle, *drifts[::-1]])


@cache
def gauss(s: int) -> tuple[DoubleWords, DoubleWords, Array]:
    """Return A, shape (s, s), b, shape (s,), of Gauss' collocation, and what foresees a step.

    A and b as doubles and the rest to about 32 digits: rounded to doubles alone they are not
    quite symplectic, and the energy drifts (Hairer, McLachlan & Razakarivony 2008). The third,
    shape (s, s), takes the derivatives at the nodes of one step to the increments up to the nodes
    of the next, along the polynomial through them.
    """
    with localcontext() as context:
        context.prec = 60
        nodes = _gauss_nodes(s)
        at_nodes = [_integrals(nodes, Decimal(0), c) for c in nodes]
        beyond = [_integrals(nodes, Decimal(1), 1 + c) for c in nodes]
        weights = _integrals(nodes, Decimal(0), Decimal(1))
        return _double_words(at_nodes), _double_words(weights), _doubles(beyond)


def _gauss_nodes(s: int) -> list[Decimal]:
    """Return the zeros of the Legendre polynomial on [0, 1], by Newton from numpy's."""
    nodes = []
    for guess in np.polynomial.legendre.leggauss(s)[0]:
        x = Decimal(float(guess))
        for _ in range(3):  # 16, 32, 64 digits
            value, slope = _legendre(s, x)
            x -= value / slope
        nodes.append((1 + x) / 2)
    return nodes


def _legendre(s: int, x: Decimal) -> tuple[Decimal, Decimal]:
    before, value = Decimal(1), x
    for k in range(1, s):
        before, value = value, ((2 * k + 1) * x * value - k * before) / (k + 1)
    return value, s * (before - x * value) / (1 - x * x)


def _integrals(nodes: Sequence[Decimal], low: Decimal, high: Decimal) -> list[Decimal]:
    """Return the integrals from low to high of the Lagrange polynomials of the nodes."""
    return [_integral(_lagrange(nodes, j), low, high) for j in range(len(nodes))]


def _integral(polynomial: Sequence[Decimal], low: Decimal, high: Decimal) -> Decimal:
    powers = enumerate(polynomial, start=1)
    return sum((a * (high**k - low**k) / k for k, a in powers), Decimal(0))


def _lagrange(nodes: Sequence[Decimal], j: int) -> list[Decimal]:
    """Return the polynomial, lowest power first, that is 1 at one node and 0 at the others."""
    result = [Decimal(1)]
    for i, node in enumerate(nodes):
        if i != j:
            shifted = [Decimal(0), *result]
            lower = [*(-node * a for a in result), Decimal(0)]
            scale = nodes[j] - node
            result = [(a + b) / scale for a, b in zip(shifted, lower, strict=True)]
    return result


def _double_words(values: Sequence[Decimal] | Sequence[Sequence[Decimal]]) -> DoubleWords:
    exact = np.array(values, dtype=object)
    high = _doubles(values)
    rest = exact - np.vectorize(Decimal, otypes=[object])(high)
    return high, rest.astype(np.float64)


def _doubles(values: Sequence[Decimal] | Sequence[Sequence[Decimal]]) -> Array:
    array = np.array(values, dtype=object).astype(np.float64)
    array.flags.writeable = False
    return array
