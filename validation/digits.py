"""The numbers of a motion at a number of digits, by their names."""

from heavytop.analytic.motion import ClosedForm
from heavytop.exact.decimals import context


class Digits:
    """Those of a motion as mpmath numbers of so many digits; call it with a time."""

    def __init__(self, motion: ClosedForm, digits: int) -> None:
        self.motion, self.digits, self.ctx = motion, digits, context(digits + 10)

    def __getattr__(self, name):
        return self.motion.mpf(name, self.digits)

    def __call__(self, t):
        return self.motion.at(t, self.digits)
