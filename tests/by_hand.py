"""The constants of a motion and its cubic, by mpmath alone, from the numbers of a scene."""

import mpmath


class ByHand:
    """u̇² = f(u) = 2 (h − g u)(1 − u²) − (a − b u)²."""

    def __init__(self, top, start, digits):
        self.mp = mp = mpmath.MPContext()
        mp.dps = digits
        A, C, gMR = (x.mpf(mp) for x in (top.A, top.C, top.gMR))
        begun = start.theta, start.thetadot, start.phidot, start.omega3
        theta, self.rate, self.turn, self.omega3 = (x.mpf(mp) for x in begun)
        self.u0, self.sine = mp.cos(theta), mp.sin(theta)
        self.g, self.b = gMR / A, C * self.omega3 / A
        self.a = self.turn * self.sine**2 + self.b * self.u0
        self.h = (self.rate**2 + (self.turn * self.sine) ** 2) / 2 + self.g * self.u0

    @property
    def cubic(self):
        """The coefficients of f, the highest first; without weight those of a square."""
        g, a, b, h = self.g, self.a, self.b, self.h
        found = [2 * g, -(2 * h + b * b), 2 * (a * b - g), 2 * h - a * a]
        return found if g else found[1:]

    @property
    def roots(self):
        """They are real; where they meet, most of the digits are lost."""
        mp = self.mp
        found = mp.polyroots(self.cubic, maxsteps=3000, extraprec=4 * mp.prec, error=False)
        return sorted(mp.re(u) for u in found)
