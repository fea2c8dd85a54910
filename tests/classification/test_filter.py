"""What the filter is sure of is true: Fractions and mpmath against arrays of doubles."""

import math

import mpmath
import numpy as np
import pytest

from heavytop.classification import filter as module
from heavytop.classification import kinds
from heavytop.classification.arrays import InputArrays
from heavytop.classification.filter import LIBRARY, ArraySigns
from heavytop.classification.reduced import Reduced

from ..starts import nasty

pytestmark = pytest.mark.reference


def test_sines_of_the_library_are_trusted_with_reason():
    """Of the angles that are asked for, the library's error is half of what is allowed, or less."""
    random, k, end = np.random.default_rng(5), np.arange(3000), math.pi / 4
    small = np.exp(random.uniform(math.log(2.0**-100), math.log(end), 12_000))
    beside = [end - k * np.spacing(end), end * (1 - np.ldexp(k, -40)), end - k * 1e-9, k * 1e-9]
    angles = np.concatenate([random.uniform(0, end, 15_000), small, *beside])
    angles = angles[angles >= 2.0**-100]
    with mpmath.workprec(320):
        for x, value in zip(angles.tolist(), np.sin(angles).tolist(), strict=True):
            truth = mpmath.sin(mpmath.mpf(x))
            assert abs(float((truth - value) / truth)) * 2**53 < LIBRARY / 2


# --- the criteria themselves ---------------------------------------------------------------------

NUMBERS = (
    kinds.PASS_TOP, kinds.PASS_BOTTOM, kinds.OVER_TOP, kinds.OVER_BOTTOM, kinds.PULL,
    kinds.LOOPING, kinds.SLEEPING, kinds.THETA_RATE, kinds.ACROSS_RATE, kinds.SPIN_MOMENTUM,
    kinds.WEIGHT, kinds.SINE, kinds.HIGH, kinds.FASTER, kinds.SLOWER, kinds.KINETIC,
    kinds.SPIN_STOPS,
)  # fmt: skip


def wide(random, numbers):
    """The same with numbers as small and as large as are let in."""
    off = 2.0 ** random.uniform(-90, 90, (6, numbers["A"].size))
    scale = dict(zip((n for n in numbers if n not in ("C", "theta")), off, strict=False))
    return {name: x * scale.get("A" if name == "C" else name, 1) for name, x in numbers.items()}


def exact_reduced(A, C, gMR, theta, thetadot, phidot, spin, held):
    """The constants of the motion, at the working precision of mpmath; u̇₀ as the filter has it."""
    u = mpmath.cos(theta)
    omega3 = spin if held == "omega3" else spin + phidot * u
    sin2, b = (1 - u) * (1 + u), C * omega3 / A
    kinetic = (thetadot**2 + phidot**2 * sin2) / 2
    udot = -thetadot * sin2
    return Reduced(gMR / A, b, u, 1 - u, 1 + u, udot, phidot * sin2, kinetic, omega3 - b)


@pytest.mark.slow
@pytest.mark.parametrize("held", ["psidot", "omega3"])
@pytest.mark.parametrize("stretched", [False, True])
def test_numbers_are_within_their_errors(held, stretched):
    """Each number on doubles, and by the same functions at 400 digits or more."""
    random = np.random.default_rng(6)
    numbers = nasty(random, 1500, held)
    numbers = wide(random, numbers) if stretched else numbers
    with np.errstate(all="ignore"):
        signs = ArraySigns(InputArrays(numbers).starts(slice(None)))
        found = [(number, signs.sign(number)) for number in NUMBERS]
    seen = np.zeros((len(NUMBERS), 2), int)
    with mpmath.workdps(400):
        for at in range(1500):
            exact = exact_reduced(*(mpmath.mpf(float(x[at])) for x in numbers.values()), held)
            for which, (number, (sized, _, certain, zero)) in enumerate(found):
                truth, value = number.value(exact), sized.value[at]
                if zero[at]:
                    assert truth == 0, number
                    continue
                if math.isnan(value):
                    assert not certain[at]
                    continue
                assert abs(truth - value) <= module.FILTER_ROUNDING * sized.magnitude[at], number
                sure = bool(certain[at])
                assert not sure or (value > 0) == (truth > 0)
                seen[which, int(sure)] += 1
    assert seen[:, 1].min() > 500
    assert stretched or seen[:2, 0].min() > 20  # that were aimed at
