"""A double and many turns against fractions; the doubles of motions hold the other sums."""

from fractions import Fraction

import numpy as np

from heavytop.exact.pairs import add_turns

TWO_PI = Fraction("6.2831853071795864769252867665590057683943387987502116419498891846")


def test_turns_are_added_with_one_rounding():
    random = np.random.default_rng(5)
    angle = random.uniform(-3.2, 3.2, 400)
    turns = np.rint(10 ** random.uniform(0, 9, 400)) * random.choice([-1, 0.5, 1], 400)
    for rest, n, found in zip(angle, turns, add_turns(angle, turns), strict=True):
        exact = Fraction(rest) + Fraction(n) * TWO_PI
        assert abs(Fraction(found) - exact) <= (abs(exact) + 6) / 2**53
    assert np.array_equal(add_turns(angle, np.zeros(400)), angle)
