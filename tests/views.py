"""The numbers of a motion at a number of digits, or within bounds, by their names."""

from fractions import Fraction

from heavytop.analytic.motion import ClosedForm
from heavytop.exact.balls import Interval
from heavytop.exact.decimals import context


def holds(interval, value, digits):
    """Whether an interval holds a number that is good to so many digits."""
    slack = Fraction(1, 10**digits) * max(1, abs(interval.middle))
    return value in Interval(interval.middle, interval.spread + slack)


class Bounds:
    """Those of a motion as intervals of so many digits; call it with a name and a time."""

    def __init__(self, motion, digits=15):
        self.motion = motion if isinstance(motion, ClosedForm) else ClosedForm(motion)
        self.digits, self.ctx = digits, context(digits + 10)

    def __getattr__(self, name):
        return self.motion.interval(name, digits=self.digits)

    def __call__(self, name, t):
        return self.motion.interval(name, t, self.digits)


class Digits(Bounds):
    """Those of a motion as mpmath numbers of so many digits; call it with a time."""

    def __getattr__(self, name):
        return self.motion.mpf(name, self.digits)

    def __call__(self, t):
        return self.motion.at(t, self.digits)
