"""Courses that θ takes, in balls: it nods, tends to the top, or stays. All with g ≥ 0.

Each gives, at a time, √(1 − u) and √(1 + u), from which θ = 2 arctan √(1 − u)/√(1 + u)
comes without loss, on a pole as elsewhere.
"""

from __future__ import annotations

from functools import cached_property

from flint import acb, arb

from heavytop.analytic.balls.roots import Roots, TooFewBits, root_of
from heavytop.classification.reduced import Reduced, Regime

Half = tuple[arb, arb]
"""√(1 − u) and √(1 + u)."""


class Nodding:
    """An axis between two turning points, u = u₁ + (u₂ − u₁) sn² x with x = w t + x₀.

    Parameters
    ----------
    over : Reduced
    known : Regime
    """

    def __init__(self, over: Reduced, known: Regime) -> None:
        self.over, self.known = over, known
        self.found = found = Roots.of(over, known)
        self.K = arb.pi() / (2 * arb(1).agm(found.mc.sqrt()))
        self.period = 2 * self.K / found.w

    @property
    def roots(self) -> tuple[arb, ...]:
        """u₁, u₂ and, where g is not 0, u₃."""
        found = self.found
        return (found.u1, found.u2) if found.u3 is None else (found.u1, found.u2, found.u3)

    @property
    def turnings(self) -> tuple[Half, Half]:
        """√(1 ∓ u) at u₁ and at u₂."""
        found = self.found
        return (
            (root_of(found.one_minus_u1), root_of(found.one_plus_u1)),
            (root_of(found.one_minus_u2), root_of(found.one_plus_u2)),
        )

    @cached_property
    def turns(self) -> tuple[arb, arb]:
        """∫ ½ P±/(1 ± u) dt over a period; half a turn at an exact pass through a pole.

        These are P₊ Π(n₂|m)/w(1 + u₁) and P₋ Π(n₁|m)/w(1 − u₁), Legendre's integrals by Carlson's.
        """
        found, over, known = self.found, self.over, self.known
        plus = minus = arb.pi()
        if known.misses_bottom:
            ratio = found.one_plus_u2 / found.one_plus_u1
            plus = over.P_plus / (found.w * found.one_plus_u1) * self._third_kind(ratio)
        if known.misses_top:
            ratio = found.one_minus_u2 / found.one_minus_u1
            minus = over.P_minus / (found.w * found.one_minus_u1) * self._third_kind(ratio)
        elif not found.one_minus_u2.is_zero():  # it does not rise to the top
            minus = arb(0)
        return plus, minus

    def _third_kind(self, p: arb) -> arb:
        """Π(1 − p|m), complete."""
        rest = acb.elliptic_rj(acb(0), acb(self.found.mc), acb(1), acb(p)).real
        return self.K + (1 - p) * rest / 3

    @cached_property
    def _phase0(self) -> arb:
        """x₀/2K, in [−1/2, 1/2]."""
        found, over = self.found, self.over
        if self.known.resting:
            return arb(0) if found.down.is_zero() else arb(1) / 2
        if not (over.udot0 > 0 or over.udot0 < 0):
            raise TooFewBits("d cos(theta)/dt at the start and 0", over.udot0)
        s2, c2 = found.down / found.delta, found.up / found.delta
        d2 = found.mc + found.m * c2
        x0 = s2.sqrt() * acb.elliptic_rf(acb(c2), acb(d2), acb(1)).real
        return over.udot0.sgn() * x0 / (2 * self.K)

    def half(self, t: arb) -> Half:
        """√(1 − u) and √(1 + u) at a time."""
        found = self.found
        phase = t / self.period + self._phase0
        sn, cn = self._sn_cn(phase - phase.mid().floor())
        size = found.delta.sqrt()
        high, low = cn * size, sn * size
        return _hypot(found.one_minus_u2, high), _hypot(found.one_plus_u1, low)

    def _sn_cn(self, phase: arb) -> tuple[arb, arb]:
        """The functions sn and cn, up to a common sign, of 2K times the phase."""
        m, mc = self.found.m, self.found.mc
        if m.is_zero():
            s, c = phase.sin_cos_pi()
            return s, c
        k = m.sqrt()
        tau = arb(1).agm(mc.sqrt()) / arb(1).agm(k)  # K'/K
        t1, t2, _, t4 = (t.real for t in acb.modular_theta(acb(phase), acb(0, tau)))
        return t1 / (t4 * k.sqrt()), t2 / t4 * (mc / m).sqrt().sqrt()


class Asymptotic:
    """An axis that comes from the top and returns to it: 1 − u = (1 − u₁) sech² x, x = w t + x₀.

    Parameters
    ----------
    over : Reduced
    known : Regime
    """

    def __init__(self, over: Reduced, known: Regime) -> None:
        b2 = over.b * over.b / (2 * over.g)
        self.one_plus_u1 = b2 if known.misses_bottom else arb(0)
        self.one_minus_u1 = 2 - self.one_plus_u1
        self.w = (over.g * self.one_minus_u1 / 2).sqrt()
        self.x0 = arb(0)
        if not known.resting:
            c0 = (over.one_minus_u0 / self.one_minus_u1).sqrt()
            self.x0 = (over.udot0 / (2 * self.w * self.one_minus_u1 * c0**3)).asinh()

    @property
    def roots(self) -> tuple[arb, ...]:
        """u₁ and twice 1."""
        return self.one_plus_u1 - 1, arb(1), arb(1)

    @property
    def turnings(self) -> tuple[Half, Half]:
        """√(1 ∓ u) at u₁ and on the top, which is never reached."""
        lowest = self.one_minus_u1.sqrt(), root_of(self.one_plus_u1)
        return lowest, (arb(0), arb(2).sqrt())

    def half(self, t: arb) -> Half:
        """√(1 − u) and √(1 + u) at a time."""
        x = self.w * t + self.x0
        size = self.one_minus_u1.sqrt()
        return size * x.sech(), _hypot(self.one_plus_u1, size * x.tanh())


class Steady:
    """An axis of constant θ: u₀ is a double root of f.

    Parameters
    ----------
    over : Reduced
    known : Regime
    """

    def __init__(self, over: Reduced, known: Regime) -> None:
        self.over, self.known = over, known

    @property
    def roots(self) -> tuple[arb, ...]:
        """Twice u₀ and, where g is not 0, the root that is left, in order."""
        over, u0 = self.over, self.over.u0
        if self.known.weightless:
            return u0, u0
        single = (2 * over.kinetic0 + over.b * over.b) / (2 * over.g) - u0  # from their sum
        return u0.min(single), u0, u0.max(single)

    @property
    def turnings(self) -> tuple[Half, Half]:
        """√(1 ∓ u₀), twice."""
        here = root_of(self.over.one_minus_u0), root_of(self.over.one_plus_u0)
        return here, here

    def half(self, t: arb) -> Half:
        """√(1 − u₀) and √(1 + u₀)."""
        return self.turnings[0]


Course = Nodding | Asymptotic | Steady


def course(over: Reduced, known: Regime) -> Course:
    """The course of a motion with g ≥ 0.

    Raises
    ------
    TooFewBits
        Two roots could not be told apart at the working precision.
    """
    if known.steady:
        return Steady(over, known)
    return Asymptotic(over, known) if known.asymptotic else Nodding(over, known)


def _hypot(least: arb, leg: arb) -> arb:
    """√(least + leg²), which is |leg| where `least` is exactly 0."""
    return abs(leg) if least.is_zero() else root_of(least + leg * leg)
