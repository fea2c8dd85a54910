"""Φ₊ and Φ₋, the halves of φ that come from the bottom and from the top.

    Φ± = ½ P± ∫ dt/(1 ± u),   φ = φ₀ + Φ₊ + Φ₋,   ψ = ψ₀ + κ t + Φ₊ − Φ₋.

In the complex plane 1/(1 ± u) has its poles at the distance i v± from the turning point nearest
that pole of the sphere, with residues ∓ ½i whatever the motion: so Φ± is a multiple of time and
the argument of a theta function, which sweeps by π each time the axis passes that pole of the
sphere, in a moment where it passes closely. Where P± = 0 the pass is exact and the sweep a jump.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from heavytop.analytic.theory.elliptic import complete_third, first
from heavytop.analytic.theory.nutation import Nutation
from heavytop.analytic.theory.theta_functions import Lattice, Sweep, Value, sweeps
from heavytop.numbers.decimals import Number


@dataclass(frozen=True, slots=True)
class Half:
    """Φ₊ or Φ₋, in pieces that each begin at a turning point.

    Parameters
    ----------
    sign : int
        The sign of P±.
    turn : Value
        What it grows by in a period [rad].
    rate : Value
        Its multiple of time [rad/s].
    own, other : Sweep or None
        Its sweeps about the turning point beside its pole, and about the other; None where P± = 0.
    jumps : bool
        Whether its pole is passed exactly: then it jumps by π there, and does nothing else.
    """

    sign: int
    turn: Value
    rate: Value
    own: Sweep | None
    other: Sweep | None
    jumps: bool

    def map(self, kind: Callable[[Number], Value]) -> Half:
        """The same with every number turned into another kind."""
        own = self.own.map(kind) if self.own else None
        other = self.other.map(kind) if self.other else None
        return Half(self.sign, kind(self.turn), kind(self.rate), own, other, self.jumps)

    def since(
        self, beside: bool, tau: Value, argument: tuple[Value, Value, Value],
        angle: Callable[[Value, Value], Value],
    ) -> Value:  # fmt: skip
        """What it has grown by since a turning point.

        Parameters
        ----------
        beside : bool
            Whether that is the turning point beside its pole.
        tau : Value
            The time since then [s].
        argument : tuple
            S, C and C₂ of that time.
        angle : callable
            The arctangent of a quotient, of such values.
        """
        sweep = self.own if beside else self.other
        if sweep is None:
            return tau - tau
        swept = angle(*sweep(*argument))
        return self.rate * tau + (swept if self.sign > 0 else -swept)


def plus_half(roots: Nutation, lattice: Lattice, tiny: Number) -> Half:
    """Φ₊, whose pole is θ = π, beside the lower turning point.

    Parameters
    ----------
    roots : Nutation
        The turning points.
    lattice : Lattice
        The nome of m.
    tiny : Number
        The error allowed in a sweep [rad].
    """
    ctx, P = roots.ctx, roots.P_plus
    if not P:
        return _jumping(roots, passes=True)
    tangent = ctx.sqrt(roots.one_plus_u1 / roots.delta)
    ratio = roots.one_plus_u2 / roots.one_plus_u1
    turn = P / (roots.w * roots.one_plus_u1) * complete_third(ctx, ratio, roots.mc)
    return _half(roots, lattice, tiny, P, turn, first(ctx, tangent, roots.m))


def minus_half(roots: Nutation, lattice: Lattice, tiny: Number) -> Half:
    """Φ₋, whose pole is θ = 0, beside the upper turning point.

    Parameters
    ----------
    roots : Nutation
        The turning points.
    lattice : Lattice
        The nome of m.
    tiny : Number
        The error allowed in a sweep [rad].
    """
    ctx, P, w = roots.ctx, roots.P_minus, roots.w
    if not P:
        return _jumping(roots, passes=not roots.one_minus_u2)
    lead = P**2 / (roots.one_minus_u1 * roots.one_minus_u2)  # 2g (u₃ − 1)
    tangent = 2 * w * ctx.sqrt(roots.one_minus_u2 / (roots.delta * lead))
    ratio = roots.one_minus_u2 / roots.one_minus_u1
    turn = P / (w * roots.one_minus_u1) * complete_third(ctx, ratio, roots.mc)
    return _half(roots, lattice, tiny, P, turn, first(ctx, tangent, roots.m))


def _half(
    roots: Nutation, lattice: Lattice, tiny: Number, P: Number, turn: Number, v: Number
) -> Half:
    ctx, sign = roots.ctx, 1 if P > 0 else -1
    own, other, missing = sweeps(lattice, v, tiny)
    per_x = (turn - sign * ctx.pi) / (2 * lattice.K) + sign * missing
    return Half(sign, turn, roots.w * per_x, own, other, jumps=False)


def _jumping(roots: Nutation, passes: bool) -> Half:
    """A half of which only jumps by π are left, or nothing."""
    ctx = roots.ctx
    turn = +ctx.pi if passes else ctx.zero
    return Half(0, turn, ctx.zero, None, None, passes)
